"""Steps for a rate that wavers: what the motion adds to the static rate is held, the static one followed.

Where teeth part and no motion repeats, a rate is dear, noisy, and as stiff as any. The rate under the
static load r₀ is cheap and smooth beside it, and nearly as stiff, for the same contact lets wear even out:

    ``h' = max{0, r₀(h) + d}``,  ``d = r − r₀`` at the start,

by RKC2 with the stages that r₀ asks for; then once more with the straight line from d to what it is at that
end. So a step takes one r whatever its length, is of second order, and the noise of one step is levelled in
the next. What the second pass moves, a first-order error, is reported. A drift adds up in it with its sign;
what jumps to and fro has none, and counts as scatter too.
"""

from collections.abc import Callable

import numpy as np

from wearlab.arrays import Array
from wearlab.life import rkc
from wearlab.life.spectrum import RADIUS_SAFETY, Spectrum, random_direction, spectrum
from wearlab.life.step import Node, Step

Rate = Callable[[Array], Array]


def held_step(
    rate: Rate, still: Rate, node: Node, size: float, direction: Array, amplitude: float
) -> tuple[Step, Spectrum]:
    """Return a step of ``size`` cycles and the spectrum of the static rate at its start.

    Parameters
    ----------
    rate, still : r(h), r₀(h) [m per cycle]
    node : the start
    size : ΔN [1]
    direction : (n,) of the last spectrum of r₀, any other size: none is known
    amplitude : of the probe for the spectrum [m]
    """
    first = still(node.depth)
    direction = direction if direction.size == first.size else random_direction(first)
    seen = spectrum(still, node.depth, direction, amplitude=amplitude)
    scheme = rkc.stages_for(size * RADIUS_SAFETY * seen.radius)
    added = node.rate - first

    def reached(added_there: Array) -> Array:
        """Follow the static rate, with what is added to it going straight from start to end."""
        change = added_there - added

        def following(at: Array) -> Array:
            depth, x = at[:-1], at[-1]
            return np.append(np.maximum(0.0, still(depth) + added + x * change), 1.0 / size)

        begin = np.append(node.depth, 0.0)
        return rkc.step(following, begin, np.append(node.rate, 1.0 / size), size, scheme)[:-1]

    held = reached(added)
    added_there = rate(held) - still(held)
    depth = reached(added_there)
    end = Node(node.cycle + size, depth, np.maximum(0.0, still(depth) + added_there))
    error, secant = depth - held, (depth - node.depth) / size
    return Step(node, end, (secant, secant), error, 1.0, None, float(np.abs(error).max(initial=0.0))), seen


def coasting_step(still: Rate, node: Node, size: float, amplitude: float) -> Step:
    """Return a step of ``size`` cycles on which what the motion adds is as at its start, no dear rate asked.

    Its error is all that the motion adds on the way: nothing tells how that changes.

    Parameters
    ----------
    still : r₀(h) [m per cycle]
    node, size, amplitude : as for :func:`held_step`
    """
    first = still(node.depth)
    told = spectrum(still, node.depth, random_direction(first), amplitude=amplitude)
    scheme = rkc.stages_for(size * RADIUS_SAFETY * told.radius)

    def reached(added: Array) -> Array:
        def following(depth: Array) -> Array:
            return np.maximum(0.0, still(depth) + added)

        return rkc.step(following, node.depth, following(node.depth), size, scheme)

    added = node.rate - first
    depth = reached(added)
    error = np.abs(depth - reached(np.zeros_like(added)))
    end = Node(node.cycle + size, depth, np.maximum(0.0, still(depth) + added))
    secant = (depth - node.depth) / size
    return Step(node, end, (secant, secant), error, 1.0, None)
