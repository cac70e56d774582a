"""How a gear set turns on the whole: the nominal speeds of all coordinates, for the work done on them."""

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.system import System
from wearlab.mesh.gear_set import GearSet
from wearlab.scene import Scene
from wearlab.scene.build.sets import train_of

Array = NDArray[np.float64]


def nominal_motion(scene: Scene, gears: GearSet, system: System) -> Array | None:
    """Return the speeds (n,) of the nominal rotation, which no mesh resists; None where x alone moves [m/s].

    A planetary set is seen from outside: planets travel with their pins, in the model's axes.
    """
    if not any(name.endswith(".u") for name in system.coordinates):
        return None
    given = _of_pair(gears) if gears.planetary is None else _of_planetary(scene, gears)
    return np.array([given.get(name, 0.0) for name in system.coordinates])


def _of_pair(gears: GearSet) -> dict[str, float]:
    one = gears.kinds[0]
    speed = one.speed * one.pair.driving.base_radius
    return {f"{gear.name}.u": speed for gear in one.pair.gears}


def _of_planetary(scene: Scene, gears: GearSet) -> dict[str, float]:
    built = gears.planetary
    assert built is not None
    speeds = train_of(scene).speeds(scene.operation.speed)
    sense = (1.0 if built.sun_drives else -1.0) * np.sign(speeds.sun_relative)
    pins = float(built.carrier.pin_circle_radius or 0.0)
    found = {
        "sun.u": sense * speeds.sun * built.sun.base_radius,
        "ring.u": sense * speeds.ring * built.ring.base_radius,
        "carrier.u": sense * speeds.carrier * pins,
    }
    mirrored = 1.0 if built.sun_drives else -1.0
    for n, angle in enumerate(mirrored * np.asarray(built.planet_angles)):
        found[f"planet-{n + 1}.u"] = sense * speeds.planet * built.planet.base_radius
        found[f"planet-{n + 1}.x"] = -np.sin(angle) * found["carrier.u"]
        found[f"planet-{n + 1}.y"] = np.cos(angle) * found["carrier.u"]
    return found
