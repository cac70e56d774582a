"""Gears and gear sets of a scene, from their tables."""

from dataclasses import fields
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.gears import helix, pairs, planetary
from wearlab.gears.gear import GearPair
from wearlab.gears.specification import Basics, GearSpec, Material, Relief, ReliefFrom
from wearlab.mesh.gear_set import Body, GearSet, PairOfSet, mesh_load
from wearlab.scene import Scene

OF_ITS_OWN = ("material", "tooth_thickness_allowance", "tip_relief", "root_relief")
"""What a file says of a gear in tables; all else is specified by the value that stands
there."""


def build_pair(scene: Scene) -> GearPair:
    """Return the pair of ``[gears]``, driven by ``operation.input``.

    Of helical gears their section.
    """
    gears: Any = scene.gears
    (first, second), basics = transverse_section(gears)
    driving = scene.operation.input
    internal = gears.kind == "internal-pair"
    return pairs.gear_pair(
        first,
        second,
        basics,
        centre_distance=gears.centre_distance,
        driving=driving,
        internal=internal,
    )


def transverse_section(gears: Any) -> tuple[list[GearSpec], Basics]:
    """Return what ``[gears]`` says of each gear and of all, of helical gears in their transverse section."""
    specs = [specification(name, member) for name, member in gears.gears().items()]
    basics = Basics(
        gears.module, gears.pressure_angle, gears.face_width, material(gears.material)
    )
    if not gears.helix_angle:
        return specs, basics
    turned = helix.helix(gears.helix_angle, gears.pressure_angle)
    return [helix.transverse(spec, turned) for spec in specs], helix.transverse_basics(
        basics, turned.angle
    )


def build_planetary(scene: Scene, *, sun_drives: bool) -> planetary.PlanetarySet:
    """Return the planetary set of ``[gears]``.

    Parameters
    ----------
    scene : a scene with ``gears.kind = "planetary"``
    sun_drives : direction of the power flow seen from the carrier, as the train of
        ``[operation]`` says
    """
    gears: Any = scene.gears
    distances = gears.centre_distance
    given = gears.carrier
    (sun, planet, ring), basics = transverse_section(gears)
    carrier = planetary.Carrier(
        given.mass, given.inertia, _half(given.pin_circle_diameter)
    )
    return planetary.planetary_set(
        sun,
        planet,
        ring,
        carrier,
        basics,
        planets=gears.planets,
        planet_angles=gears.planet_angles,
        centre_distance=None
        if distances is None
        else (distances.sun_planet, distances.planet_ring),
        sun_drives=sun_drives,
    )


def specification(name: str, member: Any) -> GearSpec:
    """Return what ``[gears.<name>]`` says of one gear."""
    allowance = member.tooth_thickness_allowance
    alike = {field.name for field in fields(GearSpec)}.intersection(
        type(member).model_fields
    ) - {*OF_ITS_OWN}
    return GearSpec(
        name=name,
        tooth_thickness_allowance=0.0 if allowance is None else allowance.mean,
        material=None if member.material is None else material(member.material),
        tip_relief=relief(member.tip_relief),
        root_relief=relief(member.root_relief),
        **{key: getattr(member, key) for key in alike},
    )


def material(given: Any) -> Material:
    """Return a material from its three constants."""
    return Material(given.youngs_modulus, given.poisson_ratio, given.density)


def relief(given: Any) -> Any:
    """Return a relief by its length or by where it starts, None when there is none."""
    if given is None or given.length is not None:
        return (
            None if given is None else Relief(given.amount, given.length, given.shape)
        )
    return ReliefFrom(
        given.amount, _half(given.start_diameter), given.start_roll_angle, given.shape
    )


def _half(diameter: float | None) -> float | None:
    return None if diameter is None else 0.5 * diameter


def modifications(pair: GearPair, position: Array) -> Array:
    """Return the material removed on purpose at path positions (n,), (2, n) (driving, driven) [m]."""
    return np.stack([pair.modification(gear, position) for gear in (0, 1)])


def kinks(pair: GearPair) -> tuple[float, ...]:
    """Return the path positions at which a relief begins or ends [m]."""
    places = []
    for gear in pair.gears:
        for word in ("tip_relief", "root_relief"):
            relief = getattr(gear.modification, word, None)
            if relief is not None:
                at_end = (word == "tip_relief") == (gear is pair.driving)
                places.append(
                    pair.path.E - relief.length
                    if at_end
                    else pair.path.A + relief.length
                )
    return tuple(places)


APART = "planet: its two meshes deflect apart, as if they shared no body"


def build_set(scene: Scene) -> GearSet:
    """Return the gear set of a scene, in operation."""
    gears = _of_pair(scene) if scene.gears.descriptor.is_pair else _of_planetary(scene)
    if not scene.gears.helix_angle:
        return gears
    # contact of a right-handed driving gear that drives with its right flanks reaches
    # larger y later, and so it does in every mesh of a set: the next gear turns the
    # other way with the other hand, or is a ring
    right = scene.hands()[gears.kinds[0].pair.driving.name] == "right"
    sense = 1.0 if right == (scene.operation.drive_flank == "right") else -1.0
    return gears._replace(
        helix=helix.helix(scene.gears.helix_angle, scene.gears.pressure_angle, sense)
    )


def _of_planetary(scene: Scene) -> GearSet:
    """Return a planetary set: sun and planets, planets and ring, seen from the carrier."""
    given: Any = scene.operation
    sun, planet, ring = (gear.teeth for gear in scene.gears.gears().values())
    of = planetary.Train(sun, planet, ring, given.input, given.output, given.fixed)
    built = build_planetary(scene, sun_drives=of.sun_drives)
    count = built.planets
    speeds = of.speeds(given.speed)
    turning = {
        "sun": speeds.sun_relative,
        "planet": speeds.planet_relative,
        "ring": speeds.ring_relative,
    }
    load = mesh_load(abs(of.torques(given.torque).sun), built.sun.base_radius, count)

    def kind(pair: GearPair, section: str, of_planet: str) -> PairOfSet:
        first, second = (
            of_planet if gear.name == built.planet.name else gear.name
            for gear in pair.gears
        )
        return PairOfSet(
            pair=pair,
            flanks=(first, second),
            section=section,
            speed=abs(turning[pair.driving.name]),
            passes=np.array([built.passes[flank] for flank in (first, second)]),
            load=load,
            loaded=int(pair.driving.name == built.planet.name),
        )

    gears = {"sun": built.sun, "planet": built.planet, "ring": built.ring}
    bodies = {
        name: Body(gear.mass, gear.inertia, gear.base_radius)
        for name, gear in gears.items()
    }
    held = built.carrier
    mass = np.nan if held.mass is None else held.mass
    inertia = np.nan if held.inertia is None else held.inertia
    bodies["carrier"] = Body(mass, inertia, float(held.pin_circle_radius or 0.0))
    mirrored = 1.0 if built.sun_drives else -1.0
    angles = mirrored * np.asarray(built.planet_angles)
    sense = mirrored * float(np.sign(speeds.sun_relative))
    return GearSet(
        kinds=(
            kind(built.sun_planet, "sun_planet", "planet-sun"),
            kind(built.planet_ring, "planet_ring", "planet-ring"),
        ),
        mesh_names=tuple(
            f"{name}-{n + 1}"
            for name in ("sun-planet", "planet-ring")
            for n in range(count)
        ),
        mesh_kinds=(0,) * count + (1,) * count,
        mesh_lags=built.mesh_phase_offset,
        flanks=scene.gears.descriptor.flanks,
        members=("sun", *(f"planet-{n + 1}" for n in range(count)), "ring", "carrier"),
        gears=gears,
        reference_teeth=built.sun.teeth,
        input_teeth=built.sun.teeth * abs(of.speeds(1.0).sun_relative),
        speed=abs(speeds.sun_relative),
        bodies=bodies,
        coordinate_speeds=_nominal_speeds(speeds, sense, bodies, angles),
        angles=tuple(angles.tolist()),
        sense=mirrored,
        notes=(APART,),
    )


def _nominal_speeds(
    speeds: planetary.TrainSpeeds, sense: float, bodies: dict[str, Body], angles: Array
) -> dict[str, float]:
    """Return the nominal rotation of a planetary set as seen from outside: planets travel with their pins."""
    turning = {
        name: sense * getattr(speeds, name) * body.radius
        for name, body in bodies.items()
    }
    speed = {f"{name}.u": turning[name] for name in ("sun", "ring", "carrier")}
    for n, angle in enumerate(angles, 1):
        speed[f"planet-{n}.u"] = turning["planet"]
        speed[f"planet-{n}.x"] = -np.sin(angle) * turning["carrier"]
        speed[f"planet-{n}.y"] = np.cos(angle) * turning["carrier"]
    return speed


def _of_pair(scene: Scene) -> GearSet:
    """Return a pair as a set of one mesh."""
    pair = build_pair(scene)
    names = scene.gears.descriptor.members
    gears = {gear.name: gear for gear in pair.gears}
    speed = scene.operation.speed or 0.0
    teeth = gears[names[0]].teeth
    kind = PairOfSet(
        pair=pair,
        flanks=(pair.driving.name, pair.driven.name),
        section="",
        speed=speed,
        passes=np.array([teeth / gear.teeth for gear in pair.gears]),
        load=mesh_load(scene.operation.torque, pair.driving.base_radius),
        loaded=0,
    )
    return GearSet(
        kinds=(kind,),
        mesh_names=("-".join(names),),
        mesh_kinds=(0,),
        mesh_lags=np.zeros(1),
        flanks=names,
        members=names,
        gears={name: gears[name] for name in names},
        reference_teeth=teeth,
        input_teeth=pair.driving.teeth,
        speed=speed * pair.driving.teeth / teeth,
        bodies={
            name: Body(gear.mass, gear.inertia, gear.base_radius)
            for name, gear in gears.items()
        },
        coordinate_speeds={
            f"{name}.u": speed * pair.driving.base_radius for name in gears
        },
    )
