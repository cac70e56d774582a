"""Which kind of gear set a section belongs to, and the names that all kinds have together."""

from typing import Any

from wearlab.gears.sets import SETS, UNSAID, SetDescriptor

ALL_TOOTHED, ALL_FLANKS = UNSAID.toothed, UNSAID.flanks


def kind_of(mapping: Any) -> str:
    """Return the kind of gear set that a raw scene says, "" where it says none that there is."""
    gears = mapping.get("gears") if isinstance(mapping, dict) else None
    kind = gears.get("kind") if isinstance(gears, dict) else None
    return kind if isinstance(kind, str) and kind in SETS else UNSAID.kind


def set_in(context: Any) -> SetDescriptor:
    """Return the kind of gear set in whose scene a section is read."""
    return SETS.get((context or {}).get("kind", ""), UNSAID)


def member_of(flank: str) -> str:
    """Return the member a flank belongs to: both flanks of a planet are the planet's."""
    return flank.split("-")[0]
