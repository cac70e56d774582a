"""``[gears]`` and ``[operation]`` → a gear set in operation: its pairs, its meshes on one clock, its load."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.gears.pair import GearPair
from wearlab.gears.train import Train
from wearlab.mesh.gear_set import GearSet, PairOfSet
from wearlab.scene import Scene
from wearlab.scene.build.gears import build_pair, build_planetary

Array = NDArray[np.float64]


def build_set(scene: Scene) -> GearSet:
    """Return the gear set of a scene, in operation."""
    return _of_pair(scene) if scene.gears.descriptor.is_pair else _of_planetary(scene)


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
    load = abs(train.torques(scene.operation.torque).sun) / (count * built.sun.base_radius)
    passes = built.passes

    def kind(pair: GearPair, section: str, of_planet: str) -> PairOfSet:
        flanks = [of_planet if gear.name == "planet" else gear.name for gear in pair.gears]
        return PairOfSet(
            pair=pair,
            flanks=(flanks[0], flanks[1]),
            section=section,
            speed=turning[pair.driving.name],
            passes=np.array([passes[flank] for flank in flanks]),
            load=load,
        )

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
        planetary=built,
    )


def _of_pair(scene: Scene) -> GearSet:
    """Return a pair as a set of one mesh."""
    pair = build_pair(scene)
    gears = {gear.name: gear for gear in pair.gears}
    names = tuple(sorted(gears, key=lambda name: name != "pinion"))
    driving_speed = scene.operation.speed or 0.0
    teeth = gears[names[0]].teeth
    kind = PairOfSet(
        pair=pair,
        flanks=(pair.driving.name, pair.driven.name),
        section="",
        speed=driving_speed,
        passes=np.array([teeth / gear.teeth for gear in pair.gears]),
        load=scene.operation.torque / pair.driving.base_radius,
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
    )
