"""``[gears]`` and ``[operation]`` → a gear set in operation: its pairs, its meshes on one clock, its load."""

from collections.abc import Callable
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.gear import Gear, GearPair
from wearlab.gears.sets import EXTERNAL_PAIR, INTERNAL_PAIR, PLANETARY, SetDescriptor
from wearlab.gears.train import Train, TrainSpeeds
from wearlab.mesh.gear_set import Body, GearSet, PairOfSet, mesh_load
from wearlab.scene import Scene
from wearlab.scene.build.gears import build_pair, build_planetary

APART = "planet: its two meshes deflect apart, as if they shared no body"


def build_set(scene: Scene) -> GearSet:
    """Return the gear set of a scene, in operation."""
    return BUILDERS[scene.gears.descriptor](scene)


def train_of(scene: Scene) -> Train:
    """Return the train of a planetary set: its speeds and torques."""
    gears: Any = scene.gears
    given: Any = scene.operation
    return Train(
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
    bodies["carrier"] = Body(carrier.mass, carrier.inertia, float(carrier.pin_circle_radius or 0.0))
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
        turning=_turning(speeds, mirrored * float(np.sign(speeds.sun_relative)), bodies, angles),
        angles=tuple(float(angle) for angle in angles),
        sense=mirrored,
        notes=(APART,),
    )


def _body(gear: Gear) -> Body:
    return Body(gear.mass, gear.inertia, gear.base_radius)


def _turning(speeds: TrainSpeeds, sense: float, bodies: dict[str, Body], angles: Array) -> dict[str, float]:
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
        turning={f"{gear.name}.u": driving_speed * pair.driving.base_radius for gear in pair.gears},
    )


BUILDERS: dict[SetDescriptor, Callable[[Scene], GearSet]] = {
    EXTERNAL_PAIR: _of_pair,
    INTERNAL_PAIR: _of_pair,
    PLANETARY: _of_planetary,
}
"""Who puts a kind of gear set into operation."""
