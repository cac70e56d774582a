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
from wearlab.scene.operation import back_of

TABLES_OF_A_GEAR = (
    "material",
    "tooth_thickness_allowance",
    "tip_relief",
    "root_relief",
)
"""What a file says of a gear in tables; all else is specified by the value that stands
there."""
APART = "planet: its two meshes deflect apart, as if they shared no body"


def build_set(scene: Scene) -> GearSet:
    """Return the gear set of a scene, in operation.

    Parameters
    ----------
    scene : the scene

    Raises
    ------
    GearError : there can be no such gears
    """
    turned = helix_of(scene.gears)
    if scene.gears.descriptor.is_pair:
        gears = _set_of_pair(scene, turned)
    else:
        gears = _planetary_gear_set(scene, turned)
    if not turned.angle:
        return gears
    # contact of a right-handed driving gear that drives with its right flanks reaches
    # larger y later, and so it does in every mesh of a set: the next gear turns the
    # other way with the other hand, or is a ring
    is_right = scene.hands()[gears.kinds[0].pair.driving.name] == "right"
    drives_right = scene.operation.drive_flank == "right"
    sense = 1.0 if is_right == drives_right else -1.0
    return gears._replace(helix=turned._replace(sense=sense))


def helix_of(gears: Any) -> helix.Helix:
    """Return the helix of ``[gears]``, that of spur gears where they have none.

    Parameters
    ----------
    gears : options of the gear set
    """
    if not gears.helix_angle:
        return helix.SPUR
    return helix.helix(gears.helix_angle, gears.pressure_angle)


def build_pair(scene: Scene, turned: helix.Helix | None = None) -> GearPair:
    """Return the pair of ``[gears]``, driven by ``operation.input``.

    Of helical gears their transverse section.

    Parameters
    ----------
    scene : a scene of a pair
    turned : its helix [as its gears say]
    """
    gears: Any = scene.gears
    turned = helix_of(gears) if turned is None else turned
    (first, second), basics = transverse_section(gears, turned)
    return pairs.gear_pair(
        first,
        second,
        basics,
        centre_distance=gears.centre_distance,
        driving=scene.operation.input,
        internal=gears.kind == "internal-pair",
        turned=turned,
    )


def transverse_section(
    gears: Any, turned: helix.Helix
) -> tuple[list[GearSpec], Basics]:
    """Return the specification of each gear and of all, in the transverse section.

    Parameters
    ----------
    gears : options of the gear set
    turned : its helix
    """
    specifications = [
        specification(name, member) for name, member in gears.gears().items()
    ]
    basics = Basics(
        gears.module, gears.pressure_angle, gears.face_width, material(gears.material)
    )
    if not turned.angle:
        return specifications, basics
    return (
        [helix.transverse(of_gear, turned) for of_gear in specifications],
        helix.transverse_basics(basics, turned.angle),
    )


def build_planetary(
    scene: Scene, *, sun_drives: bool, turned: helix.Helix | None = None
) -> planetary.PlanetarySet:
    """Return the planetary set of ``[gears]``.

    Parameters
    ----------
    scene : a scene with ``gears.kind = "planetary"``
    sun_drives : direction of the power flow seen from the carrier, as the train of
        ``[operation]`` says
    turned : its helix [as its gears say]
    """
    gears: Any = scene.gears
    turned = helix_of(gears) if turned is None else turned
    (sun, planet, ring), basics = transverse_section(gears, turned)
    carrier = planetary.Carrier(
        gears.carrier.mass,
        gears.carrier.inertia,
        _half(gears.carrier.pin_circle_diameter),
    )
    distances = gears.centre_distance
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
        turned=turned,
    )


def specification(name: str, member: Any) -> GearSpec:
    """Return what ``[gears.<name>]`` says of one gear.

    Parameters
    ----------
    name : of the gear
    member : its options
    """
    allowance = member.tooth_thickness_allowance
    specified = {field.name for field in fields(GearSpec)}
    shared = specified & type(member).model_fields.keys() - {*TABLES_OF_A_GEAR}
    return GearSpec(
        name=name,
        tooth_thickness_allowance=0.0 if allowance is None else allowance.mean,
        material=None if member.material is None else material(member.material),
        tip_relief=relief(member.tip_relief),
        root_relief=relief(member.root_relief),
        **{key: getattr(member, key) for key in shared},
    )


def material(options: Any) -> Material:
    """Return a material from its three constants.

    Parameters
    ----------
    options : of the material
    """
    return Material(options.cold_modulus, options.poisson_ratio, options.density)


def relief(options: Any) -> Any:
    """Return a relief by its length or by where it starts, None when there is none.

    Parameters
    ----------
    options : of the relief
    """
    if options is None:
        return None
    if options.length is not None:
        return Relief(options.amount, options.length, options.shape)
    return ReliefFrom(
        options.amount,
        _half(options.start_diameter),
        options.start_roll_angle,
        options.shape,
    )


def _half(diameter: float | None) -> float | None:
    """Return the radius of a diameter."""
    return None if diameter is None else 0.5 * diameter


def modifications(pair: GearPair, position: Array) -> Array:
    """Return the material removed on purpose, (2, n) (driving, driven) [m].

    Parameters
    ----------
    pair : the gears
    position : (n,) path positions [m]
    """
    return np.stack([pair.modification(gear, position) for gear in (0, 1)])


def kinks(pair: GearPair) -> tuple[float, ...]:
    """Return the path positions at which a relief begins or ends [m].

    Parameters
    ----------
    pair : the gears
    """
    places = []
    for gear in pair.gears:
        for kind in ("tip_relief", "root_relief"):
            relief = getattr(gear.modification, kind, None)
            if relief is None:
                continue
            is_tip = kind == "tip_relief"
            at_end = is_tip == (gear is pair.driving)
            length = relief.length
            if is_tip:
                length -= pair.overreach[int(gear is pair.driven)]
            places.append(pair.path.E - length if at_end else pair.path.A + length)
    return tuple(places)


def _planetary_gear_set(scene: Scene, turned: helix.Helix) -> GearSet:
    """Return a planetary set, seen from the carrier."""
    operation: Any = scene.operation
    sun, planet, ring = (gear.teeth for gear in scene.gears.gears().values())
    train = planetary.Train(
        sun, planet, ring, operation.input, operation.output, operation.fixed
    )
    gear_set = build_planetary(scene, sun_drives=train.sun_drives, turned=turned)
    count = gear_set.planets
    speeds = train.speeds(operation.speed)
    bodies = _bodies(gear_set)
    mirrored = 1.0 if gear_set.sun_drives else -1.0
    angles = mirrored * np.asarray(gear_set.planet_angles)
    sense = mirrored * float(np.sign(speeds.sun_relative))
    planets = [f"planet-{number}" for number in range(1, count + 1)]
    return GearSet(
        kinds=_planetary_kinds(gear_set, train, operation),
        mesh_names=tuple(
            f"{name}-{number}"
            for name in ("sun-planet", "planet-ring")
            for number in range(1, count + 1)
        ),
        mesh_kinds=(0,) * count + (1,) * count,
        mesh_lags=gear_set.mesh_phase_offset,
        flanks=scene.gears.descriptor.flanks,
        members=("sun", *planets, "ring", "carrier"),
        gears={
            "sun": gear_set.sun,
            "planet": gear_set.planet,
            "ring": gear_set.ring,
        },
        reference_teeth=gear_set.sun.teeth,
        input_teeth=gear_set.sun.teeth * abs(train.speeds(1.0).sun_relative),
        speed=abs(speeds.sun_relative),
        bodies=bodies,
        coordinate_speeds=_nominal_speeds(speeds, sense, bodies, angles),
        angles=tuple(angles.tolist()),
        sense=mirrored,
        notes=(APART,),
    )


def _planetary_kinds(
    gear_set: planetary.PlanetarySet, train: planetary.Train, operation: Any
) -> tuple[PairOfSet, PairOfSet]:
    """Return the meshes of sun and planets, and of planets and ring, in operation."""
    sun = gear_set.sun
    planet = gear_set.planet
    speeds = train.speeds(operation.speed)
    relative_speed = {
        "sun": speeds.sun_relative,
        "planet": speeds.planet_relative,
        "ring": speeds.ring_relative,
    }
    torque = abs(train.torques(operation.torque).sun)
    load = mesh_load(torque, sun.base_radius, gear_set.planets)

    def kind(pair: GearPair, section: str, planet_flank: str) -> PairOfSet:
        """Return one kind of mesh; a planet has a flank for each of its mates."""
        first, second = (
            planet_flank if gear.name == planet.name else gear.name
            for gear in pair.gears
        )
        return PairOfSet(
            pair=pair,
            flanks=(first, second),
            section=section,
            speed=abs(relative_speed[pair.driving.name]),
            passes=np.array([gear_set.passes[flank] for flank in (first, second)]),
            load=load,
            loaded=int(pair.driving.name == planet.name),
        )

    return (
        kind(gear_set.sun_planet, "sun_planet", "planet-sun"),
        kind(gear_set.planet_ring, "planet_ring", "planet-ring"),
    )


def _bodies(gear_set: planetary.PlanetarySet) -> dict[str, Body]:
    """Return the bodies of a planetary set; NaN is an unknown mass of the carrier."""
    gears = {
        "sun": gear_set.sun,
        "planet": gear_set.planet,
        "ring": gear_set.ring,
    }
    bodies = {
        name: Body(gear.mass, gear.inertia, gear.base_radius)
        for name, gear in gears.items()
    }
    carrier = gear_set.carrier
    mass = np.nan if carrier.mass is None else carrier.mass
    inertia = np.nan if carrier.inertia is None else carrier.inertia
    bodies["carrier"] = Body(mass, inertia, float(carrier.pin_circle_radius or 0.0))
    return bodies


def _nominal_speeds(
    speeds: planetary.TrainSpeeds, sense: float, bodies: dict[str, Body], angles: Array
) -> dict[str, float]:
    """Return the nominal speeds of a planetary set as seen from outside.

    Planets travel with their pins.
    """
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


def _set_of_pair(scene: Scene, turned: helix.Helix) -> GearSet:
    """Return a pair as a set of one mesh."""
    pair = build_pair(scene, turned)
    names = scene.gears.descriptor.members
    gears = {gear.name: gear for gear in pair.gears}
    speed = scene.operation.speed or 0.0
    teeth = gears[names[0]].teeth
    front = PairOfSet(
        pair=pair,
        flanks=(pair.driving.name, pair.driven.name),
        section="",
        speed=speed,
        passes=np.array([teeth / gear.teeth for gear in pair.gears]),
        load=mesh_load(scene.operation.torque, pair.driving.base_radius),
        loaded=0,
    )
    kinds: tuple[PairOfSet, ...] = (front,)
    flanks = tuple(names)
    side = scene.operation.loaded_side
    if side is not None:
        driving_back, driven_back = map(back_of, front.flanks)
        kinds = (front, front._replace(flanks=(driving_back, driven_back)))
        flanks = (*names, *map(back_of, names))
    return GearSet(
        kinds=kinds,
        mesh_names=("-".join(names),),
        mesh_kinds=(int(side == "back"),),
        mesh_lags=np.zeros(1),
        flanks=flanks,
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
