"""Names of the members, flanks and meshes of every kind of gear set."""

from typing import Any

TOOTHED = {
    "external-pair": ("pinion", "gear"),
    "internal-pair": ("pinion", "ring"),
    "planetary": ("sun", "planet", "ring"),
}
"""Members with teeth."""
FLANKS = {
    "external-pair": ("pinion", "gear"),
    "internal-pair": ("pinion", "ring"),
    "planetary": ("sun", "planet-sun", "planet-ring", "ring"),
}
"""Flanks that wear."""
MESHES = {
    "external-pair": ("pinion-gear",),
    "internal-pair": ("pinion-ring",),
    "planetary": ("sun-planet", "planet-ring"),
}
"""Kinds of mesh."""

ALL_TOOTHED = tuple(dict.fromkeys(name for names in TOOTHED.values() for name in names))
ALL_FLANKS = tuple(dict.fromkeys(name for names in FLANKS.values() for name in names))


def kind_of(mapping: Any) -> str:
    """Return the kind of gear set that a raw scene says, the external pair where it says none."""
    gears = mapping.get("gears") if isinstance(mapping, dict) else None
    kind = gears.get("kind") if isinstance(gears, dict) else None
    return kind if isinstance(kind, str) and kind in TOOTHED else "external-pair"


def member_of(flank: str) -> str:
    """Return the member a flank belongs to: both flanks of a planet are the planet's."""
    return flank.split("-")[0]
