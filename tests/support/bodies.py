"""Wheel bodies of unworn teeth, pressed along the line of action."""

from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.gears.gear import Gear
from wearlab.mesh.body import annulus_along, foundation_along, line_of_action


def foundation_compliance(gear: Gear, radius: ArrayLike) -> Array:
    """Return Sainsot's compliance of a wheel body at contact radii (n,) [m/N]."""
    return foundation_along(gear, line_of_action(gear, radius))


def body_compliance(gear: Gear, radius: ArrayLike) -> Array:
    """Return the compliance of the annulus at contact radii (n,) [m/N]."""
    return annulus_along(gear, line_of_action(gear, radius))
