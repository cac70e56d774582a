"""Flanks as another run left them."""

import numpy as np

from wearlab.arrays import Array
from wearlab.life.state import Wear
from wearlab.scene import Scene
from wearlab.scene.build import Parts
from wearlab.scene.wear import is_replaced
from wearlab.simulation.errors import Refused

APART = 1e-9  # of the path: the two nodes of a step of the wear stand so far apart
BEYOND = 1e-6  # of the path: nodes at its ends may differ by so much


def continued_wear(scene: Scene, parts: Parts) -> Wear:
    """Return the wear that a run starts from, of every kind of mesh [m]; replaced flanks are new.

    Depths are taken over by position on the path, linear between the parent's nodes; where the parent's path
    did not reach, its flank is not worn.

    Raises
    ------
    Refused : the parent's wear was not handed over, or the parent has other flanks or wore the other side
    """
    assert scene.start is not None
    given = scene.start_wear
    if given is None:
        raise Refused(
            f"this scene continues run {scene.start.run}: run it with the store that holds that one, "
            "or hand over the wear: scene.with_start_wear(start_wear(parent, scene.start))"
        )
    wear = parts.coupling.unworn()
    for name in parts.gears.flanks:
        if is_replaced(name, scene.start.replace):
            continue
        if name not in given.depth:
            raise Refused(f"run {scene.start.run} has no flank {name!r}: it has {', '.join(given.depth)}")
        if given.side.get(name) not in ("", None, parts.drive_flank):
            raise Refused(
                f"run {scene.start.run} wore the {given.side[name]} flanks, this one loads the "
                f"{parts.drive_flank} ones: they are new; leave [start] out"
            )
        kind, gear = parts.gears.flank(name)
        position = parts.kinds[kind].analysis.grid.position
        wear[kind][gear] = moved(np.array(given.position[name]), np.array(given.depth[name]), position)
    return wear


def inherited_error(scene: Scene, parts: Parts) -> float:
    """Return the error of the wear that a run starts from [m]: its parent's, and of reading between states.

    It is 0 where nothing is inherited; NaN where the parent has no estimate.
    """
    given = scene.start_wear
    if scene.start is None or given is None:
        return 0.0
    if all(is_replaced(name, scene.start.replace) for name in parts.gears.flanks):
        return 0.0
    return given.error + given.estimate


def moved(own: Array, depth: Array, wanted: Array) -> Array:
    """Return depths at other nodes, steps kept as steps, 0 beyond the ends, (m,) [m]."""
    if own.shape == wanted.shape and np.allclose(own, wanted, rtol=0.0, atol=1e-12):
        return depth.copy()
    span = float(own.max() - own.min())
    inside = (wanted >= own.min() - BEYOND * span) & (wanted <= own.max() + BEYOND * span)
    return np.where(inside, np.interp(_set_apart(wanted, span), _set_apart(own, span), depth), 0.0)


def _set_apart(position: Array, span: float) -> Array:
    """Return positions in which the node before a step lies before the one after it."""
    twin = np.abs(np.diff(position)) < 1e-3 * APART * span
    apart = position.copy()
    apart[:-1][twin] -= APART * span
    apart[1:][twin] += APART * span
    return apart
