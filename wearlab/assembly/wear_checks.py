"""Wear that teeth cannot have: limits and initial wear deeper than a tooth is thick."""

from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.assembly import face
from wearlab.gears import gear, outline, specification
from wearlab.mesh import gear_set
from wearlab.scene import Scene

CHECKED_POINTS, CHECKED_SLICES = 101, 41
"""Points of a profile, and slices of a face, at which the wear it starts with is looked
at before a run."""


def tooth_thickness(pair: gear.GearPair, number: int, position: Array) -> Array:
    """Return the thickness of teeth along the line of action, at positions (n,) [m]."""
    return 2.0 * outline.contact_depth(
        pair.gears[number], pair.radius(number, position)
    )


def thickest(gears: gear_set.GearSet, where: str | None) -> float:
    """Return the largest tooth thickness at the flanks of a member, or of all [m]."""
    flanks = [name for name in gears.flanks if where in (name, name.split("-")[0])]
    places = [
        (gears.kinds[kind].pair, number)
        for kind, number in map(gears.flank, flanks or gears.flanks)
    ]
    return float(
        max(tooth_thickness(pair, gear, _checked(pair)).max() for pair, gear in places)
    )


def _checked(pair: gear.GearPair) -> Array:
    return np.linspace(pair.path.A, pair.path.E, CHECKED_POINTS)


def check_limits(scene: Scene, gears: gear_set.GearSet) -> None:
    """Refuse a depth of a limit or snapshot that is more than the thickness of teeth.

    Raises
    ------
    GearError : with path, depth and thickness
    """
    for place in ("until", "snapshots"):
        depths: Any = getattr(scene.wear, place, None)
        if depths is None or not depths.depth:
            continue
        depth = np.max(depths.depth)
        thickness = thickest(gears, depths.flank)
        if depth >= thickness:
            raise specification.GearError(
                f"wear.{place}.depth: {1e3 * depth:.4g} mm is deeper than "
                f"{depths.flank or 'any tooth'} is thick, {1e3 * thickness:.4g} mm "
                "along the normal of its flank: look at its unit, or give less"
            )


def check_initial_wear(scene: Scene, gears: gear_set.GearSet) -> None:
    """Refuse wear a scene starts with that its gears cannot have, before anything runs.

    Raises
    ------
    GearError
        Where a measured profile does not cover its flank, or wear is deeper than the
        tooth.
    """
    for name in gears.flanks:
        flank = scene.initial_of(name)
        (kind, number) = gears.flank(name)
        if flank is None:
            continue
        pair = gears.kinds[kind].pair
        position = _checked(pair)
        thickness = tooth_thickness(pair, number, position)
        sliced = (
            None
            if flank.by_law
            else face.sliced_flank(scene, gears, (kind, number), CHECKED_SLICES)
        )
        if flank.by_law:  # which course it has, the run finds out
            thickness = thickness.max(keepdims=True)
            depth = np.array([getattr(flank, "depth", 0.0)])
        elif sliced is None:
            depth = flank.at_nodes(pair, number, position)
        else:
            depth = flank.over_face(pair, number, position, sliced).max(axis=0)
        if np.any(depth >= thickness):
            worst = int(np.argmax(depth - thickness))
            raise specification.GearError(
                f"wear.initial.{name}: wear of {1e3 * depth[worst]:.4g} mm is deeper "
                "than the tooth, "
                f"{1e3 * thickness[worst]:.4g} mm thick there along its normal; give "
                "less initial wear"
            )
