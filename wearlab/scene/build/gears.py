"""``[gears]`` → gears in their operating position, and what this part of a scene assumes."""

from collections.abc import Callable
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.external import external_pair
from wearlab.gears.gear import GearPair
from wearlab.gears.internal import internal_pair
from wearlab.gears.planetary import Carrier, PlanetarySet, planetary_set
from wearlab.gears.sets import EXTERNAL_PAIR, INTERNAL_PAIR, SetDescriptor
from wearlab.gears.specification import Basics, GearSpec, Material, Relief, ReliefFrom
from wearlab.scene import Scene

GIVEN = (
    "teeth",
    "profile_shift_coefficient",
    "addendum_coefficient",
    "dedendum_coefficient",
    "tip_alteration_coefficient",
    "tip_alteration",
    "tip_diameter",
    "root_diameter",
    "fillet_radius_coefficient",
    "root_profile",
    "rim_diameter",
    "bore_diameter",
    "face_width",
    "mass",
    "inertia",
    "profile_crowning",
    "profile_slope",
)


def build_pair(scene: Scene) -> GearPair:
    """Return the pair of ``[gears]``, driven by ``operation.input``."""
    gears: Any = scene.gears
    specs = [specification(name, member) for name, member in gears.gears().items()]
    driving = scene.operation.input
    make = PAIRS[gears.descriptor]
    return make(*specs, basics_of(gears), centre_distance=gears.centre_distance, driving=driving)


def basics_of(gears: Any) -> Basics:
    """Return what the gears of ``[gears]`` share."""
    return Basics(gears.module, gears.pressure_angle, gears.face_width, material(gears.material))


PAIRS: dict[SetDescriptor, Callable[..., GearPair]] = {
    EXTERNAL_PAIR: external_pair,
    INTERNAL_PAIR: internal_pair,
}
"""Who shapes the two gears of a pair."""


def build_planetary(scene: Scene, *, sun_drives: bool) -> PlanetarySet:
    """Return the planetary set of ``[gears]``.

    Parameters
    ----------
    scene : a scene with ``gears.kind = "planetary"``
    sun_drives : direction of the power flow seen from the carrier, as the train of ``[operation]`` says
    """
    gears: Any = scene.gears
    distances = gears.centre_distance
    pins = gears.carrier.pin_circle_diameter
    return planetary_set(
        specification("sun", gears.sun),
        specification("planet", gears.planet),
        specification("ring", gears.ring),
        Carrier(gears.carrier.mass, gears.carrier.inertia, None if pins is None else 0.5 * pins),
        basics_of(gears),
        planets=gears.planets,
        planet_angles=gears.planet_angles,
        centre_distance=None if distances is None else (distances.sun_planet, distances.planet_ring),
        sun_drives=sun_drives,
    )


def specification(name: str, member: Any) -> GearSpec:
    """Return what ``[gears.<name>]`` says of one gear."""
    return GearSpec(
        name=name,
        material=None if member.material is None else material(member.material),
        tip_relief=relief(member.tip_relief),
        root_relief=relief(member.root_relief),
        **{key: getattr(member, key) for key in GIVEN if getattr(member, key, None) is not None},
    )


def material(given: Any) -> Material:
    """Return a material from its three constants."""
    return Material(given.youngs_modulus, given.poisson_ratio, given.density)


def relief(given: Any) -> Any:
    """Return a relief by its length or by where it starts, None when there is none."""
    if given is None:
        return None
    if given.length is not None:
        return Relief(given.amount, given.length, given.shape)
    radius = None if given.start_diameter is None else 0.5 * given.start_diameter
    return ReliefFrom(given.amount, radius, given.start_roll_angle, given.shape)


def modifications(pair: GearPair, position: Array) -> Array:
    """Return the material removed on purpose at path positions (n,), (2, n) (driving, driven) [m]."""
    return np.stack([pair.modification(gear, position) for gear in (0, 1)])


def kinks(pair: GearPair) -> tuple[float, ...]:
    """Return the path positions at which a relief begins or ends [m]."""
    places = []
    for index, gear in enumerate(pair.gears):
        if gear.modification is None:
            continue
        towards_recess = index == 0
        for item, at_tip in ((gear.modification.tip_relief, True), (gear.modification.root_relief, False)):
            if item is not None:
                at_end = at_tip == towards_recess
                places.append(pair.path.E - item.length if at_end else pair.path.A + item.length)
    return tuple(places)
