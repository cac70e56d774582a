"""``[wear]`` and ``[lubricant]`` → wear law of both flanks, and the oil between."""

from collections.abc import Sequence
from types import FunctionType
from typing import Any

from wearlab import compiled, slots
from wearlab.gears.gear import GearPair
from wearlab.scene import Scene
from wearlab.wear import coefficients, films
from wearlab.wear.law import NAN, FlankLaw, PreparedLaw, WearLaw, prepare
from wearlab.wear.path import WearPath
from wearlab.wear.setting import Setting


def build_film(scene: Scene, pair: GearPair) -> films.Film | None:
    """Return the oil between the flanks, None without an oil or both roughnesses.

    Parameters
    ----------
    scene : the scene
    pair : the gears
    """
    roughness = _roughness(scene, pair)
    if scene.lubricant is None or roughness is None:
        return None
    oil = scene.lubricant
    assert (
        oil.viscosity is not None and oil.pressure_viscosity is not None
    )  # given, or of its grade
    return films.Film(
        oil.viscosity, oil.pressure_viscosity, films.composite_rq(roughness)
    )


def _roughness(scene: Scene, pair: GearPair) -> tuple[float, float] | None:
    """Return the mean roughness of (driving, driven) [m], None where one is unknown."""
    driving = getattr(scene.gears, pair.driving.name).roughness_ra
    driven = getattr(scene.gears, pair.driven.name).roughness_ra
    return None if driving is None or driven is None else (driving, driven)


def build_law(
    scene: Scene,
    pair: GearPair,
    path: WearPath,
    flank_temperatures: Sequence[float] | None = None,
) -> PreparedLaw | None:
    """Return the wear law on the path, None when nothing wears.

    Film thickness over roughness is by the first film that a flank has, else the
    standard.

    Parameters
    ----------
    scene : the scene
    pair : the gears
    path : velocities and radii along the path of contact
    flank_temperatures : of (driving, driven) [K], None: that of the surroundings
    """
    wear = scene.wear
    if wear is None or wear.coefficient is None:
        return None
    coefficients_of = [wear.coefficient_of(gear.name) for gear in pair.gears]
    if flank_temperatures is None and scene.thermal is not None:
        flank_temperatures = [scene.thermal.ambient] * len(pair.gears)
    settings = _settings(scene, pair, path, flank_temperatures)
    first, second = (
        _flank_law(wear.law, coefficient, setting)
        for coefficient, setting in zip(coefficients_of, settings, strict=True)
    )
    law = WearLaw(
        (first, second),
        _lambda_ratio(scene, pair, coefficients_of, settings[0]),
        wear.pressure.factor,
        wear.projection,
    )
    return prepare(law, path)


def _settings(
    scene: Scene,
    pair: GearPair,
    path: WearPath,
    flank_temperatures: Sequence[float] | None,
) -> list[Setting]:
    """Return what the wear of (driving, driven) may depend on."""
    roughness = _roughness(scene, pair)
    temperature = getattr(scene.lubricant, "temperature", None)
    settings = []
    for number, gear in enumerate(pair.gears):
        material = getattr(scene.gears, gear.name).material or scene.gears.material
        of_flank = None if flank_temperatures is None else flank_temperatures[number]
        setting = Setting(
            path,
            number,
            scene.lubricant,
            roughness,
            material.hardness,
            temperature,
            flank_temperature=of_flank,
        )
        settings.append(setting)
    return settings


def _lambda_ratio(
    scene: Scene,
    pair: GearPair,
    coefficients_of: Sequence[coefficients.CoefficientModel],
    setting: Setting,
) -> Any:
    """Return film thickness over roughness, None without oil or without roughnesses."""
    roughness = _roughness(scene, pair)
    if scene.lubricant is None or roughness is None:
        return None
    films_of = [coefficient.film_model for coefficient in coefficients_of]
    film = next(filter(None, films_of), coefficients.standard_film())
    thickness = film.thickness(setting)
    return thickness._replace(scale=thickness.scale / films.composite_rq(roughness))


def _flank_law(
    law: Any, coefficient: coefficients.CoefficientModel, setting: Setting
) -> FlankLaw:
    """Return the law of one flank."""
    film = coefficient.film_model
    return FlankLaw(
        coefficient=of_user(coefficient, coefficient.build(setting)),
        factor=coefficient.factor,
        film=None if film is None else of_user(film, film.build(setting)),
        rate=of_user(law, law.build(setting)),
        hardness=NAN if setting.hardness is None else setting.hardness,
        temperature=NAN if setting.temperature is None else setting.temperature,
        flank_temperature=_or_nan(setting.flank_temperature),
    )


def _or_nan(value: float | None) -> float:
    """Return a number, NaN where there is none."""
    return NAN if value is None else value


def of_user(variant: slots.Variant, built: Any) -> Any:
    """Return what a variant built; a function of a user's compiles where it can.

    Parameters
    ----------
    variant : the variant
    built : what its ``build`` returned
    """
    if variant.origin is None or not isinstance(built, FunctionType):
        return built
    return compiled.compiled_if_possible(
        built, f"{variant.origin.file}: {variant.chosen!r}"
    )
