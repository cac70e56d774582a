"""A scene in one line, and as a table for notebooks."""

from collections.abc import Mapping
from html import escape
from typing import Any

from wearlab.scene.sections import Sections


def one_line(scene: Sections, written: Mapping[str, Any]) -> str:
    """Return the gears with their teeth, torque and speed as written, how they move and whether they wear."""
    teeth = " × ".join(
        str(member["teeth"]) for member in _tables(scene.gears.model_dump()) if member.get("teeth")
    )
    motion = "quasi-static" if scene.dynamics is None else scene.dynamics.chosen
    wear = "no wear" if scene.wear is None else f"{scene.wear.load.chosen} wear"
    return ", ".join(part for part in (f"{scene.gears.kind} {teeth}", _driven(written), motion, wear) if part)


def html(title: str, written: Mapping[str, Any]) -> str:
    """Return everything that a scene's file says, section by section, below the scene in one line."""
    rows = "".join(
        f"<tr><td>{escape(key)}</td><td>{escape(str(value))}</td></tr>" for key, value in _written(written)
    )
    return f"<p><b>{escape(title[1:-1])}</b></p><table>{rows}</table>"


def _driven(written: Mapping[str, Any]) -> str:
    given = written.get("operation", {})
    return ", ".join(str(given[key]) for key in ("torque", "power", "speed") if key in given)


def _tables(gears: dict[str, Any]) -> list[dict[str, Any]]:
    return [table for table in gears.values() if isinstance(table, dict)]


def _written(table: Mapping[str, Any], above: str = "") -> list[tuple[str, Any]]:
    return [
        pair
        for key, value in table.items()
        for pair in (
            _written(value, f"{above}{key}.") if isinstance(value, dict) else [(f"{above}{key}", value)]
        )
    ]
