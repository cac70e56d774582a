"""Which kind of gear set a section belongs to, and the names that all kinds have together."""

from typing import Any

from wearlab.gears.sets import EXTERNAL_PAIR, SETS, SetDescriptor

ALL_TOOTHED = tuple(dict.fromkeys(name for one in SETS.values() for name in one.toothed))
ALL_FLANKS = tuple(dict.fromkeys(name for one in SETS.values() for name in one.flanks))


def kind_of(mapping: Any) -> str:
    """Return the kind of gear set that a raw scene says, the external pair where it says none."""
    gears = mapping.get("gears") if isinstance(mapping, dict) else None
    kind = gears.get("kind") if isinstance(gears, dict) else None
    return kind if isinstance(kind, str) and kind in SETS else EXTERNAL_PAIR.kind


def set_in(context: Any) -> SetDescriptor:
    """Return the kind of gear set in whose scene a section is read; on its own it is an external pair's."""
    return SETS[(context or {}).get("kind", EXTERNAL_PAIR.kind)]


def member_of(flank: str) -> str:
    """Return the member a flank belongs to: both flanks of a planet are the planet's."""
    return flank.split("-")[0]
