"""Gears and gear sets of a scene, from their tables."""

from collections.abc import Callable
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.gears import external, internal, planetary, sets, train
from wearlab.gears.gear import Gear, GearPair
from wearlab.gears.helix import helix, transverse, transverse_basics
from wearlab.gears.specification import Basics, GearSpec, Material, Relief, ReliefFrom
from wearlab.mesh.gear_set import Body, GearSet, PairOfSet, mesh_load
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
    """Return the pair of ``[gears]``, driven by ``operation.input``; of helical gears their section."""
    gears: Any = scene.gears
    specs, basics = transverse_section(gears)
    make = PAIRS[gears.descriptor]
    return make(*specs, basics, centre_distance=gears.centre_distance, driving=scene.operation.input)


def transverse_section(gears: Any) -> tuple[list[GearSpec], Basics]:
    """Return what ``[gears]`` says of each gear and of all, of helical gears in their transverse section."""
    specs = [specification(name, member) for name, member in gears.gears().items()]
    if not gears.helix_angle:
        return specs, basics_of(gears)
    turned = helix(gears.helix_angle, gears.pressure_angle)
    basics = transverse_basics(basics_of(gears), gears.helix_angle)
    return [transverse(spec, turned) for spec in specs], basics


def basics_of(gears: Any) -> Basics:
    """Return what the gears of ``[gears]`` share."""
    return Basics(gears.module, gears.pressure_angle, gears.face_width, material(gears.material))


PAIRS: dict[sets.SetDescriptor, Callable[..., GearPair]] = {
    sets.EXTERNAL_PAIR: external.external_pair,
    sets.INTERNAL_PAIR: internal.internal_pair,
}
"""Who shapes the two gears of a pair."""


def build_planetary(scene: Scene, *, sun_drives: bool) -> planetary.PlanetarySet:
    """Return the planetary set of ``[gears]``.

    Parameters
    ----------
    scene : a scene with ``gears.kind = "planetary"``
    sun_drives : direction of the power flow seen from the carrier, as the train of ``[operation]`` says
    """
    gears: Any = scene.gears
    distances = gears.centre_distance
    pins = gears.carrier.pin_circle_diameter
    (sun, planet, ring), basics = transverse_section(gears)
    return planetary.planetary_set(
        sun,
        planet,
        ring,
        planetary.Carrier(gears.carrier.mass, gears.carrier.inertia, None if pins is None else 0.5 * pins),
        basics,
        planets=gears.planets,
        planet_angles=gears.planet_angles,
        centre_distance=None if distances is None else (distances.sun_planet, distances.planet_ring),
        sun_drives=sun_drives,
    )


def specification(name: str, member: Any) -> GearSpec:
    """Return what ``[gears.<name>]`` says of one gear."""
    allowance = member.tooth_thickness_allowance
    return GearSpec(
        name=name,
        tooth_thickness_allowance=0.0 if allowance is None else allowance.mean,
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


APART = "planet: its two meshes deflect apart, as if they shared no body"


def build_set(scene: Scene) -> GearSet:
    """Return the gear set of a scene, in operation."""
    return BUILDERS[scene.gears.descriptor](scene)


def train_of(scene: Scene) -> train.Train:
    """Return the train of a planetary set: its speeds and torques."""
    gears: Any = scene.gears
    given: Any = scene.operation
    return train.Train(
        gears.sun.teeth, gears.planet.teeth, gears.ring.teeth, given.input, given.output, given.fixed
    )


def _of_planetary(scene: Scene) -> GearSet:
    """Return a planetary set: sun and planets, planets and ring, seen from the carrier."""
    train = train_of(scene)
    built = build_planetary(scene, sun_drives=train.sun_drives)
    count = built.planets
    speeds = train.speeds(scene.operation.speed)
    turning = {
        "sun": abs(speeds.sun_relative),
        "planet": abs(speeds.planet_relative),
        "ring": abs(speeds.ring_relative),
    }
    load = mesh_load(abs(train.torques(scene.operation.torque).sun), built.sun.base_radius, count)
    passes = built.passes

    def kind(pair: GearPair, section: str, of_planet: str) -> PairOfSet:
        flanks = [of_planet if gear.name == built.planet.name else gear.name for gear in pair.gears]
        return PairOfSet(
            pair=pair,
            flanks=(flanks[0], flanks[1]),
            section=section,
            speed=turning[pair.driving.name],
            passes=np.array([passes[flank] for flank in flanks]),
            load=load,
            loaded=int(pair.driving.name == built.planet.name),
        )

    bodies = {gear.name: _body(gear) for gear in (built.sun, built.planet, built.ring)}
    carrier = built.carrier
    mass, inertia = (np.nan if value is None else value for value in (carrier.mass, carrier.inertia))
    bodies["carrier"] = Body(mass, inertia, float(carrier.pin_circle_radius or 0.0))
    mirrored = 1.0 if built.sun_drives else -1.0
    angles = mirrored * np.asarray(built.planet_angles)
    planets = [f"planet-{n + 1}" for n in range(count)]
    return GearSet(
        kinds=(
            kind(built.sun_planet, "sun_planet", "planet-sun"),
            kind(built.planet_ring, "planet_ring", "planet-ring"),
        ),
        mesh_names=tuple(f"{name}-{n + 1}" for name in ("sun-planet", "planet-ring") for n in range(count)),
        mesh_kinds=(0,) * count + (1,) * count,
        mesh_lags=built.mesh_phase_offset,
        flanks=scene.gears.descriptor.flanks,
        members=("sun", *planets, "ring", "carrier"),
        gears={"sun": built.sun, "planet": built.planet, "ring": built.ring},
        reference_teeth=built.sun.teeth,
        input_teeth=built.sun.teeth * abs(train.speeds(1.0).sun_relative),
        speed=turning["sun"],
        bodies=bodies,
        coordinate_speeds=_nominal_speeds(
            speeds, mirrored * float(np.sign(speeds.sun_relative)), bodies, angles
        ),
        angles=tuple(float(angle) for angle in angles),
        sense=mirrored,
        notes=(APART,),
    )


def _body(gear: Gear) -> Body:
    return Body(gear.mass, gear.inertia, gear.base_radius)


def _nominal_speeds(
    speeds: train.TrainSpeeds, sense: float, bodies: dict[str, Body], angles: Array
) -> dict[str, float]:
    """Return the nominal rotation of a planetary set as seen from outside: planets travel with their pins."""
    speed = {
        "sun.u": sense * speeds.sun * bodies["sun"].radius,
        "ring.u": sense * speeds.ring * bodies["ring"].radius,
        "carrier.u": sense * speeds.carrier * bodies["carrier"].radius,
    }
    for n, angle in enumerate(angles):
        speed[f"planet-{n + 1}.u"] = sense * speeds.planet * bodies["planet"].radius
        speed[f"planet-{n + 1}.x"] = -np.sin(angle) * speed["carrier.u"]
        speed[f"planet-{n + 1}.y"] = np.cos(angle) * speed["carrier.u"]
    return speed


def _of_pair(scene: Scene) -> GearSet:
    """Return a pair as a set of one mesh."""
    pair = build_pair(scene)
    gears = {gear.name: gear for gear in pair.gears}
    names = scene.gears.descriptor.members
    driving_speed = scene.operation.speed or 0.0
    teeth = gears[names[0]].teeth
    kind = PairOfSet(
        pair=pair,
        flanks=(pair.driving.name, pair.driven.name),
        section="",
        speed=driving_speed,
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
        speed=driving_speed * pair.driving.teeth / teeth,
        bodies={gear.name: _body(gear) for gear in pair.gears},
        coordinate_speeds={f"{gear.name}.u": driving_speed * pair.driving.base_radius for gear in pair.gears},
    )


BUILDERS: dict[sets.SetDescriptor, Callable[[Scene], GearSet]] = {
    sets.EXTERNAL_PAIR: _of_pair,
    sets.INTERNAL_PAIR: _of_pair,
    sets.PLANETARY: _of_planetary,
}
"""Who puts a kind of gear set into operation."""
