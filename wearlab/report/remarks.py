"""What runs say of themselves: assumed values, limits of validity, departures of their models."""

import re
from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wearlab.store.catalogue import Entry

MOST_LINES = 100
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?!\w)")


def departures(entries: "Mapping[str, Entry]") -> tuple[tuple[str, int], ...]:
    """Return the known departures of the models of runs, each with its count."""
    counted = Counter(
        line
        for entry in entries.values()
        for line in {*str(entry.summary.get("model_error") or "").split("\n")} - {""}
    )
    return tuple(counted.most_common(MOST_LINES))


def remarks(entries: "Mapping[str, Entry]") -> tuple[tuple[str, int], ...]:
    """Return assumed values and limits of validity that runs touch, warnings too, each with its count.

    Lines that differ in one number are one, with its range.
    """
    lines: dict[str, set[str]] = {}
    for entry in entries.values():
        said = {*str(entry.summary.get("validity") or "").split("\n"), *entry.warnings} - {""}
        for line in said:
            lines.setdefault(line, set()).add(entry.id)
    alike: dict[str, list[str]] = {}
    for line in lines:
        alike.setdefault(NUMBER.sub("#", line), []).append(line)
    counted: Counter[str] = Counter()
    for some in alike.values():
        for words, those in _ranged(some).items():
            counted[words] = len(set().union(*(lines[line] for line in those)))
    return tuple(counted.most_common(MOST_LINES))


def _ranged(lines: list[str]) -> dict[str, list[str]]:
    """Return what to say of lines that are equal but for their numbers, and of which lines it is said."""
    numbers = list(zip(*(list(NUMBER.finditer(line)) for line in lines), strict=True))
    varying = [matches for matches in numbers if len({match[0] for match in matches}) > 1]
    if len(varying) != 1:
        return {line: [line] for line in lines}
    ordered = sorted(varying[0], key=lambda match: float(match[0]))
    first, last = ordered[0], ordered[-1]
    return {f"{first.string[: first.end()]} to {last[0]}{first.string[first.end() :]}": lines}
