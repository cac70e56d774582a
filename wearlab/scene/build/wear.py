"""``[wear]`` and ``[lubricant]`` → wear law, film, load, limits, snapshots and the step over cycles."""

from dataclasses import dataclass
from types import FunctionType
from typing import Any

import numpy as np

from wearlab import arrays, compiled, slots
from wearlab.gears.gear import GearPair
from wearlab.life import coupled, limits, loads
from wearlab.mesh import contact, gear_set
from wearlab.scene import Scene
from wearlab.scene.build import sets
from wearlab.wear import coefficients, films
from wearlab.wear.law import NAN, FlankLaw, PreparedLaw, WearLaw, prepare
from wearlab.wear.path import WearPath, contact_modulus, wear_path
from wearlab.wear.setting import PowerOfLoad, Setting


@dataclass(frozen=True)
class KindParts:
    """The physics of one kind of mesh; what the scene leaves out is ``None``.

    Parameters
    ----------
    pair : the gears in their operating position
    analysis : contact of the worn flanks
    modification : (2, n) material removed on purpose, (driving, driven) [m]
    path : velocities and radii along the path
    law, film : present parts of the wear law
    """

    pair: GearPair
    analysis: contact.ContactAnalysis
    modification: arrays.Array
    path: WearPath
    law: PreparedLaw | None
    film: films.Film | None


def build_kind(
    scene: Scene, kind: gear_set.PairOfSet, analysis: contact.ContactAnalysis, cosine: float
) -> KindParts:
    """Return the physics of one kind of mesh; ``cosine``: of the base helix angle, which flattens flanks."""
    position = analysis.grid.position
    path = build_path(kind, position, scene.mesh.of(kind.section).face_load_factor)
    path = path._replace(equivalent_radius=path.equivalent_radius / cosine)
    law, film = build_law(scene, kind.pair, path), build_film(scene, kind.pair)
    return KindParts(kind.pair, analysis, sets.modifications(kind.pair, position), path, law, film)


def build_film(scene: Scene, pair: GearPair) -> films.Film | None:
    """Return the oil between the flanks, when the scene names an oil and both roughnesses."""
    roughness = _roughness(scene, pair)
    if scene.lubricant is None or roughness is None:
        return None
    oil = scene.lubricant
    assert oil.viscosity is not None and oil.pressure_viscosity is not None  # given, or of its grade
    return films.Film(oil.viscosity, oil.pressure_viscosity, films.composite_rq(roughness))


def _roughness(scene: Scene, pair: GearPair) -> list[float] | None:
    values = [getattr(scene.gears, gear.name).roughness_ra for gear in pair.gears]
    return None if any(value is None for value in values) else values


def build_law(scene: Scene, pair: GearPair, path: WearPath) -> PreparedLaw | None:
    """Return the wear law on the path, None when nothing wears."""
    wear = scene.wear
    if wear is None or wear.coefficient is None:
        return None
    settings = [setting(scene, pair, path, gear) for gear in (0, 1)]
    each = [wear.coefficient_of(gear.name) for gear in pair.gears]
    first, second = (
        _flank(scene, coefficient, where) for coefficient, where in zip(each, settings, strict=True)
    )
    law = WearLaw(
        flanks=(first, second),
        lambda_ratio=_lambda_ratio(each, settings[0]),
        pressure_factor=wear.pressure.factor,
        projection=wear.projection,
    )
    return prepare(law, path)


def setting(scene: Scene, pair: GearPair, path: WearPath, gear: int) -> Setting:
    """Return what a wear law may know of a flank of a pair, 0 driving or 1 driven."""
    roughness = _roughness(scene, pair)
    own = getattr(scene.gears, pair.gears[gear].name)
    return Setting(
        path=path,
        gear=gear,
        lubricant=scene.lubricant,
        roughness=None if roughness is None else (roughness[0], roughness[1]),
        hardness=getattr(own.material or scene.gears.material, "hardness", None),
        temperature=getattr(scene.lubricant, "temperature", None),
    )


def _flank(scene: Scene, given: coefficients.CoefficientModel, where: Setting) -> FlankLaw:
    assert scene.wear is not None
    film, law = given.film_model, scene.wear.law
    return FlankLaw(
        coefficient=of_user(given, given.build(where)),
        factor=given.factor,
        film=None if film is None else of_user(film, film.build(where)),
        rate=of_user(law, law.build(where)),
        hardness=NAN if where.hardness is None else where.hardness,
        temperature=NAN if where.temperature is None else where.temperature,
    )


def of_user(variant: slots.Variant, built: Any) -> Any:
    """Return what a variant built; a function of a user's compiles where it can."""
    if variant.origin is None or not isinstance(built, FunctionType):
        return built
    return compiled.compiled_if_possible(built, f"{variant.origin.file}: {variant.chosen!r}")


def _lambda_ratio(each: list[coefficients.CoefficientModel], where: Setting) -> PowerOfLoad | None:
    """Return film thickness over roughness, by the first film that a flank has, else the standard."""
    if where.lubricant is None or where.roughness is None:
        return None
    film = next(filter(None, (coefficient.film_model for coefficient in each)), coefficients.standard_film())
    thickness = film.thickness(where)
    return thickness._replace(scale=thickness.scale / films.composite_rq(where.roughness))


def build_load(scene: Scene) -> loads.LoadModel:
    """Return which force wears the flanks, or would."""
    if scene.wear is None:
        return loads.StaticLoad() if scene.dynamics is None else loads.InstantLoad()
    return scene.wear.load.build(scene.wear.wohler_slope)


def build_path(pair: gear_set.PairOfSet, position: arrays.Array, face_load_factor: float) -> WearPath:
    """Return what the wear law needs to know of the path of contact at positions (n,) [m].

    The face load factor K_Hβ puts the load on as much less of the face: wear is that of its busiest part.
    """
    gears = pair.pair.gears
    return wear_path(
        np.stack(pair.pair.curvature(position)),
        base_radius=[gear.base_radius for gear in gears],
        teeth=[gear.teeth for gear in gears],
        driving_speed=pair.speed,
        passes=pair.passes,
        face_width=pair.pair.face_width / face_load_factor,
        contact_modulus=contact_modulus(
            [gear.material.youngs_modulus for gear in gears], [gear.material.poisson_ratio for gear in gears]
        ),
        concave=pair.pair.internal,
    )


def flank_entries(flank: str | None, gears: gear_set.GearSet, coupling: coupled.Coupled) -> slice:
    """Return where a flank's depths lie in the flat state; all of them when no flank is named."""
    return slice(None) if flank is None else coupling.entries(*gears.flank(flank))


def build_limits(
    scene: Scene,
    gears: gear_set.GearSet,
    coupling: coupled.Coupled,
    speed: float | None = None,
    passed: tuple[float, float] = (0.0, 0.0),
) -> limits.Limits:
    """Return where the life ends, in cycles of the reference gear and depth; nowhere if nothing is said.

    Parameters
    ----------
    scene, gears, coupling : the scene and its physics
    speed : mean speed of the reference gear over time, that of ``gears`` where left out [rad/s]
    passed : cycles and operating time [s] that lie behind
    """
    until: Any = scene.wear.until if scene.wear else None
    if until is None:
        return limits.Limits(None, None, slice(None))
    turned = (gears.speed if speed is None else speed) / (2 * np.pi)
    cycles = [
        None if until.cycles is None else until.cycles - passed[0],
        None if until.mesh_cycles is None else until.mesh_cycles / gears.reference_teeth - passed[0],
        None if until.hours is None else (3600.0 * until.hours - passed[1]) * turned,
    ]
    given = [value for value in cycles if value is not None]
    return limits.Limits(
        min(given) if given else None, until.depth, flank_entries(until.flank, gears, coupling)
    )


def build_snapshots(scene: Scene, gears: gear_set.GearSet, coupling: coupled.Coupled) -> limits.Snapshots:
    """Return the states asked for on the way."""
    asked: Any = scene.wear.snapshots if scene.wear else None
    if asked is None:
        return limits.Snapshots()
    cycles = tuple(asked.cycles or ()) + tuple(n / gears.reference_teeth for n in asked.mesh_cycles or ())
    return limits.Snapshots(cycles, tuple(asked.depth or ()), flank_entries(asked.flank, gears, coupling))
