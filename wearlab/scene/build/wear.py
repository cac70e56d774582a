"""``[wear]`` and ``[lubricant]`` → wear law, film, load, limits, snapshots and the step over cycles."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.gears.pair import GearPair
from wearlab.life.adaptive import Adaptive
from wearlab.life.euler import Euler, Fixed
from wearlab.life.limits import Limits, Snapshots
from wearlab.life.load import EquivalentLoad, InstantLoad, Load, StaticLoad
from wearlab.life.march import Method
from wearlab.life.state import Coupled
from wearlab.scene import Scene
from wearlab.scene.build.sets import GearSet, PairOfSet
from wearlab.wear.archard import MEAN_PRESSURE, PEAK_PRESSURE, NormalProjection, OverCosine
from wearlab.wear.coefficient import Coefficient, Constant, Hardness, Janakiraman
from wearlab.wear.film import Film, composite_rq
from wearlab.wear.law import PreparedLaw, WearLaw, prepare
from wearlab.wear.path import WearPath, contact_modulus, wear_path

Array = NDArray[np.float64]

UNCALIBRATED = 1e-16
"""Stands in for a wear coefficient that is still to be calibrated: lives tell its scale [m²/N]."""


def build_film(scene: Scene, pair: GearPair) -> Film | None:
    """Return the oil between the flanks, when the scene names an oil and both roughnesses."""
    roughness = _roughness(scene, pair)
    if scene.lubricant is None or roughness is None:
        return None
    oil = scene.lubricant
    return Film(oil.viscosity, oil.pressure_viscosity, composite_rq(roughness))


def _roughness(scene: Scene, pair: GearPair) -> list[float] | None:
    values = [getattr(scene.gears, gear.name).roughness_ra for gear in pair.gears]
    return None if any(value is None for value in values) else values


def build_law(scene: Scene, pair: GearPair, path: WearPath) -> PreparedLaw | None:
    """Return the wear law on the path, None when nothing wears."""
    wear = scene.wear
    if wear is None or wear.coefficient is None:
        return None
    each = [_of_member(wear.coefficient, gear.name) for gear in pair.gears]
    law = WearLaw(
        coefficient=(_coefficient(each[0], scene, pair), _coefficient(each[1], scene, pair)),
        film=build_film(scene, pair) if any(one.film for one in each) else None,
        pressure_factor=PEAK_PRESSURE if wear.pressure == "peak" else MEAN_PRESSURE,
        projection=OverCosine() if wear.projection == "over-cosine" else NormalProjection(),
        average_over_contact_width=wear.average_over_contact_width,
    )
    return prepare(law, path)


def _of_member(given: Any, name: str) -> Any:
    return given[name] if isinstance(given, dict) else given


def _coefficient(given: Any, scene: Scene, pair: GearPair) -> Coefficient:
    match given.model:
        case "hardness":
            return Hardness(given.k, given.hardness, given.factor)
        case "janakiraman":
            assert scene.lubricant is not None
            roughness = float(np.hypot(*(_roughness(scene, pair) or (0.0, 0.0))))
            return Janakiraman(scene.lubricant.pressure_viscosity, roughness, given.factor)
        case "calibrated":
            return Constant(UNCALIBRATED, given.factor)
        case _:
            return Constant(given.value, given.factor)


def build_load(scene: Scene) -> Load:
    """Return which force wears the flanks."""
    if scene.wear is None:
        return StaticLoad() if scene.dynamics is None else InstantLoad()
    match scene.wear.load:
        case "instant":
            return InstantLoad()
        case "equivalent":
            assert scene.wear.wohler_slope is not None
            return EquivalentLoad(scene.wear.wohler_slope)
        case _:
            return StaticLoad()


def build_path(one: PairOfSet, position: Array, face_load_factor: float) -> WearPath:
    """Return what the wear law needs to know of the path of contact at positions (n,) [m].

    The face load factor K_Hβ puts the load on as much less of the face: wear is that of its busiest part.
    """
    gears = one.pair.gears
    return wear_path(
        np.stack(one.pair.curvature(position)),
        base_radius=[gear.base_radius for gear in gears],
        teeth=[gear.teeth for gear in gears],
        driving_speed=one.speed,
        passes=one.passes,
        face_width=one.pair.face_width / face_load_factor,
        contact_modulus=contact_modulus(
            [gear.material.youngs_modulus for gear in gears],
            [gear.material.poisson_ratio for gear in gears],
        ),
        concave=one.pair.kind == "internal",
    )


def flank_entries(flank: str | None, gears: GearSet, coupling: Coupled) -> slice:
    """Return where a flank's depths lie in the flat state; all of them when no flank is named."""
    return slice(None) if flank is None else coupling.entries(*gears.flank(flank))


def build_limits(
    scene: Scene,
    gears: GearSet,
    coupling: Coupled,
    speed: float | None = None,
    passed: tuple[float, float] = (0.0, 0.0),
) -> Limits:
    """Return where the life ends, in cycles of the reference gear and depth.

    Parameters
    ----------
    scene, gears, coupling : the scene and its physics
    speed : mean speed of the reference gear over time, that of ``gears`` where left out [rad/s]
    passed : cycles and operating time [s] that lie behind
    """
    until: Any = scene.wear.until if scene.wear else None
    turned = (gears.speed if speed is None else speed) / (2 * np.pi)
    cycles = [
        None if until.cycles is None else until.cycles - passed[0],
        None if until.mesh_cycles is None else until.mesh_cycles / gears.reference_teeth - passed[0],
        None if until.hours is None else (3600.0 * until.hours - passed[1]) * turned,
    ]
    given = [value for value in cycles if value is not None]
    return Limits(min(given) if given else None, until.depth, flank_entries(until.flank, gears, coupling))


def build_snapshots(scene: Scene, gears: GearSet, coupling: Coupled) -> Snapshots:
    """Return the states asked for on the way."""
    asked: Any = scene.wear.snapshots if scene.wear else None
    if asked is None:
        return Snapshots()
    cycles = tuple(asked.cycles or ()) + tuple(n / gears.reference_teeth for n in asked.mesh_cycles or ())
    return Snapshots(cycles, tuple(asked.depth or ()), flank_entries(asked.flank, gears, coupling))


def build_step(scene: Scene) -> Method:
    """Return how the wear is stepped over cycles."""
    step: Any = scene.wear.step if scene.wear else None
    match step.method:
        case "euler":
            return Euler(step.threshold)
        case "fixed":
            stable = getattr(step.size, "stability", None)
            return Fixed(stability=stable) if stable is not None else Fixed(size=step.size)
        case _:
            return Adaptive()
