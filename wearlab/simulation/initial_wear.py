"""The wear that a run starts from: a scene's own, or that of another run."""

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.life import coupled, history, limits
from wearlab.scene import Scene
from wearlab.scene.operation import BACK
from wearlab.scene.start import is_replaced
from wearlab.simulation import label
from wearlab.simulation.work import max_work

APART = 1e-9
"""Distance of the two nodes of a step of the wear, over the length of the path."""
BEYOND = 1e-6
"""Distance by which nodes at the ends of the path may differ, over its length."""


def initial_wear(
    scene: Scene, parts: assembly.GearModel, together: coupled.Coupled | None = None
) -> coupled.Wear:
    """Return the wear before the first cycle, of every kind of mesh, (2, n) each [m].

    Parameters
    ----------
    scene, parts : the scene and its physics
    together : by which flanks are worn that are to be worn by this law, that of
        ``parts`` where left out
    """
    if scene.start is not None:
        return continued_wear(scene, parts)
    wear = parts.coupling.unworn()
    by_law: dict[str, tuple[limits.Flanks, float]] = {}
    for name in parts.gears.flanks:
        flank = None if scene.wear is None else scene.initial_of(name)
        if flank is None:
            continue
        kind, gear = parts.gears.flank(name)
        pair = parts.kinds[kind].pair
        position = parts.kinds[kind].analysis.grid.position
        if flank.by_law:
            entries = assembly.life.flank_entries(
                name, parts.gears, parts.coupling, flank.planet
            )
            by_law[name] = entries, flank.depth
        elif parts.face is None:
            depth = flank.at_nodes(pair, gear, position)
            places = parts.gears.places_of(name)
            if flank.planet is not None:
                places = [places[flank.planet - 1]]
            for place in places:
                wear[place[0]][place[1]] = depth
        else:
            slices = parts.face.kinds[kind].contact.grid.position
            sliced = assembly.face.sliced_flank(
                scene, parts.gears, (kind, gear), slices
            )
            wear[kind][gear] = flank.over_face(pair, gear, position, sliced)
    if not by_law:
        return wear
    rate = history.SetRate(together or parts.coupling)
    try:
        depth = history.worn(
            rate,
            parts.coupling.flat(wear),
            by_law,
            tolerance=scene.numerics.tolerance,
            max_work=max_work(scene, parts),
        )
        return parts.coupling.split(depth)
    except ValueError as error:
        raise label.Refused(str(error)) from error


def continued_wear(scene: Scene, parts: assembly.GearModel) -> coupled.Wear:
    """Return the wear that a run starts from, of every kind of mesh [m].

    Replaced flanks are new. Depths are taken over by position on the path, linear
    between the parent's nodes; where the parent's path did not reach, its flank is not
    worn.

    Parameters
    ----------
    scene : a scene that goes on from another run
    parts : its physics

    Raises
    ------
    Refused : the parent's wear was not handed over, or the parent has other flanks or
        wore the other side
    """
    assert scene.start is not None
    start_wear = scene.start_wear
    run = scene.start.run
    if start_wear is None:
        raise label.Refused(
            f"this scene continues run {run}: run it with the store that holds that "
            "one, or hand over the wear: "
            "scene.with_start_wear(start_wear(parent, scene.start))"
        )
    wear = parts.coupling.unworn()
    for name in parts.gears.flanks:
        if is_replaced(name, scene.start.replace):
            continue

        if name not in start_wear.depth and name.endswith(BACK):
            continue  # nothing reversed in that run
        if name not in start_wear.depth:
            raise label.Refused(
                f"run {run} has no flank {name!r}: it has {', '.join(start_wear.depth)}"
            )
        side = scene.operation.side_of(name)
        if start_wear.side.get(name) not in ("", None, side):
            raise label.Refused(
                f"run {run} wore the {start_wear.side[name]} flanks, this one loads "
                f"the {side} ones: they are new; leave [start] out"
            )
        places = parts.gears.places_of(name)
        depths = [start_wear.depth[name]] * len(places)
        of_planets = (start_wear.planet_depth or {}).get(name)
        if of_planets and parts.gears.planets_are_apart:
            depths = list(of_planets)
        if len(depths) != len(places):
            raise label.Refused(
                f"run {run} has {len(depths)} planets, this one {len(places)}: each "
                "planet goes on from its own wear; leave [start] out, or give as many "
                "planets"
            )
        for (kind, gear), depth in zip(places, depths, strict=True):
            wear[kind][gear] = moved(
                np.array(start_wear.position[name]),
                np.array(depth),
                parts.kinds[kind].analysis.grid.position,
            )
    return wear


def left_behind(scene: Scene, parts: assembly.GearModel) -> tuple[str, ...]:
    """Return what a run does not take on of the wear that it starts from, a line each.

    Parameters
    ----------
    scene : the scene
    parts : its physics
    """
    start_wear = scene.start_wear
    if scene.start is None or start_wear is None:
        return ()
    backs = [
        (name, max(depth))
        for name, depth in start_wear.depth.items()
        if name.endswith(BACK)
        and name not in parts.gears.flanks
        and not is_replaced(name, scene.start.replace)
        and any(depth)
    ]
    return tuple(
        f"{name} of the run that this one starts from is worn by up to "
        f"{1e6 * depth:.4g} um, and no condition here loads it: it counts as new, so "
        "teeth are stiffer, backlash is smaller and worn mass less than they are; "
        "give operation.duty a row of negative torque to keep it"
        for name, depth in backs
    )


def inherited_error(scene: Scene, parts: assembly.GearModel) -> float:
    """Return the error of the wear that a run starts from [m].

    It is its parent's, and that of reading between states; 0 where nothing is
    inherited; NaN where the parent has no estimate.

    Parameters
    ----------
    scene : the scene
    parts : its physics
    """
    start_wear = scene.start_wear
    if scene.start is None or start_wear is None:
        return 0.0
    new = all(is_replaced(name, scene.start.replace) for name in parts.gears.flanks)
    return 0.0 if new else start_wear.error + start_wear.estimate


def moved(position: Array, depth: Array, target: Array) -> Array:
    """Return depths at other nodes, steps as steps, 0 beyond the ends, (m,) [m].

    Parameters
    ----------
    position : (n,) of the nodes on the path [m]
    depth : (n,) there [m]
    target : (m,) positions of the other nodes [m]
    """
    if position.shape == target.shape and np.allclose(
        position, target, rtol=0.0, atol=1e-12
    ):
        return depth.copy()
    span = float(position.max() - position.min())
    first = position.min() - BEYOND * span
    last = position.max() + BEYOND * span
    inside = (target >= first) & (target <= last)
    values = np.interp(_set_apart(target, span), _set_apart(position, span), depth)
    return np.where(inside, values, 0.0)


def _set_apart(position: Array, span: float) -> Array:
    """Return positions in which the node before a step lies before the one after it."""
    twin = np.abs(np.diff(position)) < 1e-3 * APART * span
    shifted = position.copy()
    shifted[:-1][twin] -= APART * span
    shifted[1:][twin] += APART * span
    return shifted
