"""Scenes that tests begin from: tables of gear sets, and the files of campaigns.

A table is what a campaign file says, so a test adds the sections that it is about:
``{"gears": external_pair(25, 30), "operation": {"torque": "100 N*m", …}}``.
"""

from pathlib import Path
from typing import Any

TOP = Path(__file__).parents[2]
CAMPAIGNS = TOP / "campaigns"
SPUR_50_50 = CAMPAIGNS / "base" / "spur_50_50.toml"

Member = int | dict[str, Any]


def external_pair(pinion: Member, gear: Member, **options: Any) -> dict[str, Any]:
    """Return the table ``[gears]`` of an external pair.

    Parameters
    ----------
    pinion, gear : numbers of teeth, or tables of the members
    options : further keys of the table; ``module`` [3 mm], ``face_width`` [20 mm]
    """
    kind = {"kind": "external-pair", "module": "3 mm", "face_width": "20 mm"}
    members = {"pinion": _member(pinion), "gear": _member(gear)}
    return {**kind, **members, **options}


def internal_pair(pinion: Member, ring: Member, **options: Any) -> dict[str, Any]:
    """Return the table ``[gears]`` of an internal pair.

    Parameters
    ----------
    pinion, ring : numbers of teeth, or tables of the members
    options : further keys of the table; ``module`` [3 mm], ``face_width`` [20 mm]
    """
    kind = {"kind": "internal-pair", "module": "3 mm", "face_width": "20 mm"}
    members = {"pinion": _member(pinion), "ring": _member(ring)}
    return {**kind, **members, **options}


def planetary_set(
    sun: Member, planet: Member, ring: Member, **options: Any
) -> dict[str, Any]:
    """Return the table ``[gears]`` of a planetary set.

    Parameters
    ----------
    sun, planet, ring : numbers of teeth, or tables of the members
    options : further keys of the table, the carrier among them; ``planets`` [3],
        ``module`` [3 mm], ``face_width`` [20 mm]
    """
    kind = {"kind": "planetary", "module": "3 mm", "face_width": "20 mm", "planets": 3}
    members = {"sun": _member(sun), "planet": _member(planet), "ring": _member(ring)}
    return {**kind, **members, **options}


def _member(member: Member) -> dict[str, Any]:
    """Return the table of a member."""
    return {"teeth": member} if isinstance(member, int) else member


GEAR_UNIT: dict[str, Any] = {
    "gears": external_pair(23, 71, module="4 mm", face_width="45 mm"),
    "operation": {"torque": "320 N*m", "speed": "1450 rpm"},
}
"""The pair of a gear unit: what tests of flanks with a width begin from."""

VIBRATING_PAIR: dict[str, Any] = {
    "gears": external_pair(23, 37),
    "operation": {"torque": "150 N*m", "speed": "2900 rpm"},
    "mesh": {"damping_ratio": 0.05},
    "dynamics": {"model": "torsional"},
}
"""A small pair under load, for tests of what moves in it."""

TWO_TORQUES = f"""
title = "Two torques"
extends = "{SPUR_50_50.as_posix()}"
drop = ["dynamics"]
[wear]
load = "static"
until = {{ depth = "20 um", flank = "pinion" }}
[[sweep]]
"operation.torque" = ["100 N*m", "120 N*m"]
"""
"""A campaign of two short static lives, for tests of what happens around runs."""
