"""Flanks that vary over the face on purpose or stand askew, and how deep they press."""

from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.gears import helix
from wearlab.mesh import gear_set
from wearlab.mesh.face import deepest
from wearlab.scene import Scene

PLACES = 201
"""Places across the face at which gaps are looked at for the deepest deflection."""


def lead(gear: Any) -> helix.Lead:
    """Return the lead modification that ``[gears.<name>]`` says.

    Parameters
    ----------
    gear : options of the gear
    """
    relief = gear.end_relief
    return helix.Lead(
        crowning=gear.lead_crowning or 0.0,
        slope=gear.lead_slope or 0.0,
        relief=0.0 if relief is None else relief.amount,
        relief_length=1.0 if relief is None else relief.length,
        bias=gear.bias or 0.0,
    )


def opening(scene: Scene, kind: gear_set.PairOfSet, torque: float) -> float:
    """Return how far misaligned flanks open from one end of the face to the other [m].

    Parameters
    ----------
    scene, kind : the scene and the kind of mesh
    torque : of the input [N·m]
    """
    misalignment = scene.mesh.of(kind.section).misalignment
    if misalignment is None:
        return 0.0
    return float(misalignment.over_face(kind.pair.working_pressure_angle, torque))


def deepest_deflection(
    scene: Scene, kind: gear_set.PairOfSet, deflection: float
) -> float:
    """Return the deflection where flanks are pressed hardest across the face [m].

    Parameters
    ----------
    scene, kind : the scene and the kind of mesh
    deflection : of flanks that touch over the whole face [m]
    """
    if not scene.face_keys:
        return deflection
    gaps = _gaps_at_ends(scene, kind)
    return max(deepest.deepest_deflection(gap, deflection) for gap in gaps.T)


def _gaps_at_ends(scene: Scene, kind: gear_set.PairOfSet) -> Array:
    """Return gaps across the face at A and E, (n, 2), under the heaviest load [m]."""
    pair = kind.pair
    width = pair.face_width
    position = np.linspace(-0.5 * width, 0.5 * width, PLACES)
    ends = np.array([pair.path.A, pair.path.E])
    opened = opening(scene, kind, scene.operation.largest_torque)
    gaps = np.repeat(opened * position[:, None] / width, len(ends), axis=1)
    for number, gear in enumerate(pair.gears):
        share = pair.from_root(number, ends)
        removed = lead(getattr(scene.gears, gear.name))
        gaps = gaps + removed.removed(position, share, width)
    return np.asarray(gaps)
