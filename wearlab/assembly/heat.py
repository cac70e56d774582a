"""``[thermal]`` → the heat's way out of both gears, and the temperatures they bear."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.gears import vdi
from wearlab.gears.gear import GearPair
from wearlab.gears.specification import GearError
from wearlab.materials.over_temperature import TemperatureCurve, celsius
from wearlab.mesh.gear_set import GearSet, PairOfSet
from wearlab.scene import Scene
from wearlab.thermal import models
from wearlab.thermal.balance import (
    FLANK,
    PLACES,
    ROOT,
    HeatBalance,
    TemperatureLimit,
)


def options_of(scene: Scene) -> models.ThermalModel:
    """Return ``[thermal]`` of a scene that has it.

    Parameters
    ----------
    scene : the scene
    """
    assert scene.thermal is not None
    return scene.thermal


def material_of(scene: Scene, member: str) -> Any:
    """Return the options of a member's material.

    Parameters
    ----------
    scene : the scene
    member : its name
    """
    return getattr(scene.gears, member).material or scene.gears.material


def moduli(scene: Scene, pair: GearPair) -> tuple[TemperatureCurve, TemperatureCurve]:
    """Return Young's modulus of (driving, driven) over temperature [Pa].

    Parameters
    ----------
    scene : the scene
    pair : the gears
    """
    driving, driven = (material_of(scene, gear.name).modulus for gear in pair.gears)
    return driving, driven


def tables(scene: Scene) -> Iterator[tuple[str, TemperatureCurve, str]]:
    """Yield every table over temperature: its key, itself, and its member or "".

    Parameters
    ----------
    scene : a scene with [thermal]
    """
    for member in scene.gears.toothed:
        material = material_of(scene, member)
        if material.softens:
            yield f"gears.{member}.material.youngs_modulus", material.modulus, member
        coefficient = scene.coefficients.get(member)
        curve = getattr(coefficient, "curve", None)
        if isinstance(curve, TemperatureCurve):
            yield f"wear.coefficient.{member}", curve, member
    friction = options_of(scene).friction_curve
    if math.isfinite(friction.highest):
        yield "thermal.friction", friction, ""


def at_moduli(pair: GearPair, modulus: Array) -> GearPair:
    """Return a pair whose materials have other moduli.

    Parameters
    ----------
    pair : the gears
    modulus : (2, 2) of (driving, driven) at (root, flank) [Pa]
    """
    driving, driven = (
        gear._replace(
            material=gear.material._replace(
                youngs_modulus=float(of_gear[ROOT]),
                flank_modulus=float(of_gear[FLANK]),
            )
        )
        for gear, of_gear in zip(pair.gears, modulus, strict=True)
    )
    return pair._replace(driving=driving, driven=driven)


def softest(scene: Scene, pair: GearPair) -> GearPair:
    """Return a pair as soft as its tables know it.

    Parameters
    ----------
    scene : a scene with [thermal]
    pair : the gears
    """
    least = [[min(curve.value)] * len(PLACES) for curve in moduli(scene, pair)]
    return at_moduli(pair, np.array(least))


def as_warm_as_surroundings(scene: Scene, gears: GearSet) -> GearSet:
    """Return the gear set with the moduli at the surroundings' temperature.

    Parameters
    ----------
    scene : a scene with [thermal]
    gears : its gear set

    Raises
    ------
    GearError : something is not known at that temperature
    """
    ambient = options_of(scene).ambient
    for name, curve, _ in tables(scene):
        if not curve.lowest <= ambient <= curve.highest:
            raise GearError(
                f"thermal.ambient: {celsius(ambient)} is outside the table of {name}, "
                f"which goes from {celsius(curve.lowest)} to {celsius(curve.highest)}: "
                "give values down to and up to it"
            )
    kinds = []
    for kind in gears.kinds:
        curves = moduli(scene, kind.pair)
        cold = np.array([[curve.at(ambient)] * len(PLACES) for curve in curves])
        kinds.append(kind._replace(pair=at_moduli(kind.pair, cold)))
    return gears._replace(kinds=tuple(kinds))


def flank_temperatures(temperature: Array) -> list[float]:
    """Return the temperatures of the flanks, (driving, driven) [K].

    Parameters
    ----------
    temperature : (2, 2) of (driving, driven) at (root, flank) [K]
    """
    return [float(of_gear[FLANK]) for of_gear in temperature]


def limits_of(scene: Scene, pair: GearPair) -> tuple[TemperatureLimit, ...]:
    """Return the temperatures that places of the gears must not pass.

    The end of a table for what asks it, and the service temperature for all places.

    Parameters
    ----------
    scene : a scene with [thermal]
    pair : the gears
    """
    limits = []
    for number, gear in enumerate(pair.gears):
        for name, curve, member in tables(scene):
            if member not in ("", gear.name):
                continue
            places = range(len(PLACES)) if "youngs" in name else [FLANK]
            reason = f"where the table {name} ends"
            limits += [
                TemperatureLimit(gear.name, number, place, curve.highest, reason)
                for place in places
            ]
        service = material_of(scene, gear.name).service_temperature
        if service is not None:
            reason = f"the service temperature of gears.{gear.name}.material"
            limits += [
                TemperatureLimit(gear.name, number, place, service, reason)
                for place in range(len(PLACES))
            ]
    return tuple(limits)


def heat_transfers(scene: Scene) -> dict[str, dict[str, float]]:
    """Return k_ϑ of every member that warms up, as stated or by the pair of materials.

    In VDI's units [K (m/s)^0.75 mm^1.75/W], by place. A metal stays as warm as the
    surroundings.

    Parameters
    ----------
    scene : a scene with [thermal]
    """
    stated = options_of(scene).heat_transfer
    plastic = [
        name for name in scene.gears.toothed if material_of(scene, name).is_plastic
    ]
    usual = models.ON_METAL if len(plastic) == 1 else models.ON_PLASTIC
    transfers = {}
    for name in scene.gears.toothed:
        of_member = getattr(stated, name)
        if of_member is not None:
            transfers[name] = {"root": of_member.root, "flank": of_member.flank}
        elif name in plastic:
            transfers[name] = usual
    return transfers


def build_balance(
    scene: Scene, kind: PairOfSet, speed: float, relative_duty: float
) -> HeatBalance:
    """Return how warm friction makes the gears at a speed.

    Parameters
    ----------
    scene : a scene with [thermal]
    kind : the mesh
    speed : of the driving gear [rad/s]
    relative_duty : share of the time under load [1]
    """
    thermal = options_of(scene)
    pair = kind.pair
    pitch_radius = pair.driving.base_radius / math.cos(pair.working_pressure_angle)
    resistance = np.zeros((len(pair.gears), len(PLACES)))
    for name, transfer in heat_transfers(scene).items():
        number = [gear.name for gear in pair.gears].index(name)
        gear = pair.gears[number]
        for place, word in enumerate(PLACES):
            path = vdi.HeatPath(
                transfer=transfer[word],
                width=pair.face_width / vdi.MILLIMETRE,
                module=gear.module / vdi.MILLIMETRE,
                teeth=gear.teeth,
                speed=speed * pitch_radius,
                housing=thermal.housing.thermal_resistance,
                duty=relative_duty,
            )
            resistance[number, place] = vdi.thermal_resistance(path)
    return HeatBalance(thermal.ambient, resistance, limits_of(scene, pair))


def mean_balance(
    scene: Scene, kind: PairOfSet, speeds: Sequence[float], time: Array
) -> HeatBalance:
    """Return how warm the mean friction of conditions makes the gears.

    At their mean speed over the time in which they turn under load; pauses count by
    the loss that they have not.

    Parameters
    ----------
    scene : a scene with [thermal]
    kind : the mesh
    speeds : of the driving gear in each condition [rad/s]
    time : share of the operating time of each [1]
    """
    mean_speed = float(np.dot(time, speeds) / time.sum())
    return build_balance(scene, kind, mean_speed, 1.0)
