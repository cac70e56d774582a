"""A scene in one line, and as a table for notebooks."""

from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from wearlab.scene.scene import Scene


def one_line(scene: "Scene") -> str:
    """Return the gears with their teeth, torque and speed, how they move and whether they wear."""
    teeth = " × ".join(
        str(member["teeth"]) for member in _tables(scene.gears.model_dump()) if member.get("teeth")
    )
    motion = "quasi-static" if scene.dynamics is None else scene.dynamics.chosen
    wear = "no wear" if scene.wear is None else f"{scene.wear.load.chosen} wear"
    return ", ".join(part for part in (f"{scene.gears.kind} {teeth}", _driven(scene), motion, wear) if part)


def html(scene: "Scene") -> str:
    """Return everything that the scene's file says, section by section."""
    rows = "".join(
        f"<tr><td>{escape(key)}</td><td>{escape(str(value))}</td></tr>"
        for key, value in _written(scene._mapping)
    )
    return f"<p><b>{escape(repr(scene)[1:-1])}</b></p><table>{rows}</table>"


def _driven(scene: "Scene") -> str:
    given = scene._mapping.get("operation", {})
    return ", ".join(str(given[key]) for key in ("torque", "power", "speed") if key in given)


def _tables(gears: dict[str, Any]) -> list[dict[str, Any]]:
    return [table for table in gears.values() if isinstance(table, dict)]


def _written(table: dict[str, Any], above: str = "") -> list[tuple[str, Any]]:
    return [
        pair
        for key, value in table.items()
        for pair in (
            _written(value, f"{above}{key}.") if isinstance(value, dict) else [(f"{above}{key}", value)]
        )
    ]
