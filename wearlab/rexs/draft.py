"""What becomes of one stage: values with where they come from, and what is missing."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from wearlab.rexs.quantities import Read


class KeyEntry(NamedTuple):
    """One key of a campaign file.

    Parameters
    ----------
    value : as a campaign file writes it: text with unit, number, table or list
    comment : where it comes from
    """

    value: Any
    comment: str


@dataclass
class Draft:
    """One stage as a campaign file has it.

    Parameters
    ----------
    title : of the campaign
    entries : section, such as ``gears.pinion`` → key → entry
    derived : what was worked out from other values, a line each
    left_out : what the file says and the campaign does not, a line each
    missing : what a campaign needs or assumes and the file does not say, a line each
    """

    title: str
    entries: dict[str, dict[str, KeyEntry]] = field(default_factory=dict)
    derived: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)

    def put(self, section: str, key: str, value: Any, comment: str) -> None:
        """Set a key of a section.

        Parameters
        ----------
        section : such as ``gears.pinion``
        key : of the campaign file
        value : as a campaign file writes it
        comment : where it comes from
        """
        self.entries.setdefault(section, {})[key] = KeyEntry(value, comment)

    def take(self, section: str, key: str, read: Read | None, unit: str = "") -> bool:
        """Set a key to a value that was read; return whether there was one.

        Parameters
        ----------
        section : such as ``gears.pinion``
        key : of the campaign file
        read : the value and where it stood, None where the file has none
        unit : of the value, "" for a plain number
        """
        if read is None:
            return False
        self.put(section, key, with_unit(read.value, unit), read.source)
        return True

    def table(self) -> dict[str, Any]:
        """Return the stage as a dict like a campaign file."""
        table: dict[str, Any] = {"title": self.title}
        for section, entries in self.entries.items():
            place = table
            for name in section.split("."):
                place = place.setdefault(name, {})
            place.update({key: entry.value for key, entry in entries.items()})
        return table

    def text(self) -> str:
        """Return the stage as a campaign file that people read."""
        lines = [f"title = {toml(self.title)}"]
        for section, entries in self.entries.items():
            lines += ["", f"[{section}]"]
            lines += [
                f"{key} = {toml(entry.value)}"
                + (f" # {printable(entry.comment)}" if entry.comment else "")
                for key, entry in entries.items()
            ]
        for heading, remarks in (
            ("derived", self.derived),
            ("left out", self.left_out),
            ("missing", self.missing),
        ):
            if remarks:
                lines += [
                    "",
                    f"# {heading}:",
                    *(f"#   {printable(line)}" for line in remarks),
                ]
        return "\n".join(lines) + "\n"


def with_unit(value: float, unit: str) -> Any:
    """Return a value as a campaign file writes it.

    Parameters
    ----------
    value : the number
    unit : its unit, "" for a plain number

    Examples
    --------
    >>> with_unit(4.5, "mm"), with_unit(27.0, "")
    ('4.5 mm', 27)
    """
    number = int(value) if value.is_integer() and abs(value) < 1e15 else value
    return f"{number!r} {unit}" if unit else number


def toml(value: Any) -> str:
    """Return a value in TOML.

    Parameters
    ----------
    value : text, number, truth value, list or mapping

    Examples
    --------
    >>> print(toml({"torque": "567 N*m", "share": 0.2}))
    { torque = "567 N*m", share = 0.2 }
    """
    if isinstance(value, Mapping):
        inside = ", ".join(f"{key} = {toml(entry)}" for key, entry in value.items())
        return f"{{ {inside} }}"
    if isinstance(value, list | tuple):
        if value and all(isinstance(entry, Mapping) for entry in value):
            rows = "".join(f"    {toml(entry)},\n" for entry in value)
            return f"[\n{rows}]"
        return f"[{', '.join(toml(entry) for entry in value)}]"
    if isinstance(value, str):
        return json.dumps(printable(value), ensure_ascii=False)
    return json.dumps(value)


def printable(text: str) -> str:
    """Return a text as one line without control characters.

    Names come from the file; one with a line break would write lines of its own.

    Parameters
    ----------
    text : such as the name of a stage
    """
    return "".join(letter if letter.isprintable() else " " for letter in text)
