"""``[wear]`` → the load that wears, limits and snapshots of a life."""

from typing import Any

import numpy as np

from wearlab.life import coupled, limits, loads
from wearlab.life.loads.instant import InstantLoad
from wearlab.life.loads.static import StaticLoad
from wearlab.mesh import gear_set
from wearlab.scene import Scene


def build_load(scene: Scene) -> loads.LoadModel:
    """Return which force wears the flanks, or would.

    Parameters
    ----------
    scene : the scene
    """
    if scene.wear is None:
        return StaticLoad() if scene.dynamics is None else InstantLoad()
    return scene.wear.load.build(scene.wear.wohler_slope)


def flank_entries(
    flank: str | None,
    gears: gear_set.GearSet,
    coupling: coupled.Coupled,
    planet: int | None = None,
) -> limits.Flanks:
    """Return where a flank's depths lie in the flat state.

    All of them when no flank is named. Planets that are apart have their own, all of
    which count.

    Parameters
    ----------
    flank : its name, None of all
    gears, coupling : the gear set and its physics
    planet : number of the planet whose flank counts alone, from 1; None: of all
    """
    if flank is None:
        return slice(None)
    places = gears.places_of(flank)
    if planet is not None:
        places = [places[planet - 1]]
    if len(places) == 1:
        return coupling.entries(*places[0])
    entries = [coupling.entries(*place) for place in places]
    return np.concatenate([np.arange(one.start, one.stop) for one in entries])


def build_limits(
    scene: Scene,
    gears: gear_set.GearSet,
    coupling: coupled.Coupled,
    speed: float | None = None,
    passed: tuple[float, float] = (0.0, 0.0),
) -> limits.Limits:
    """Return where the life ends, in cycles of the reference gear and depth.

    Nowhere if nothing is said.

    Parameters
    ----------
    scene, gears, coupling : the scene and its physics
    speed : mean speed of the reference gear over time, that of ``gears`` where left out
        [rad/s]
    passed : cycles and operating time [s] that lie behind
    """
    until: Any = scene.wear.until if scene.wear else None
    if until is None:
        return limits.Limits(None, None, slice(None))
    turns = (
        until.cycles,
        until.mesh_cycles and until.mesh_cycles / gears.reference_teeth,
    )
    cycles = [count - passed[0] for count in turns if count is not None]
    if until.hours is not None:
        turned = (gears.speed if speed is None else speed) / (2 * np.pi)
        cycles.append((3600.0 * until.hours - passed[1]) * turned)
    return limits.Limits(
        min(cycles, default=None),
        until.depth,
        flank_entries(until.flank, gears, coupling),
    )


def build_snapshots(
    scene: Scene, gears: gear_set.GearSet, coupling: coupled.Coupled
) -> limits.Snapshots:
    """Return the states that are stored on the way.

    Parameters
    ----------
    scene, gears, coupling : the scene and its physics
    """
    snapshots: Any = scene.wear.snapshots if scene.wear else None
    if snapshots is None:
        return limits.Snapshots()
    cycles = tuple(snapshots.cycles or ()) + tuple(
        n / gears.reference_teeth for n in snapshots.mesh_cycles or ()
    )
    return limits.Snapshots(
        cycles,
        tuple(snapshots.depth or ()),
        flank_entries(snapshots.flank, gears, coupling),
    )
