"""Steps through rough stretches: what the motion adds to the static rate is held, the static one followed.

Where teeth part and no motion repeats, a rate is dear, noisy, and as stiff as any. The rate under the
static load r₀ is cheap and smooth beside it, and nearly as stiff, for the same contact lets wear even out:

    ``h' = max{0, r₀(h) + d}``,  ``d = r − r₀`` at the start,

by RKC2 with the stages that r₀ asks for; then once more with the straight line from d to what it is at that
end. So a step takes one r whatever its length, is of second order, and the noise of one step is levelled in
the next. What the second pass moves, a first-order error, is reported. A drift adds up in it with its sign;
what jumps to and fro has none, and counts as scatter too.

A step wears a fixed share of the depth, or as much more as the work left pays for. A life whose work runs
ahead of its way goes on by such steps to its end, less exactly than asked and saying so, and does not end by
the bound on its work.
"""

from math import expm1, inf, isfinite, log1p

import numpy as np

from wearlab.arrays import Array
from wearlab.life import runge_kutta
from wearlab.life.rate import CountedRate, Rate
from wearlab.life.step import Node, Step
from wearlab.life.stiffness import RADIUS_SAFETY, Spectrum, random_direction, spectrum

HEAD_START = 0.15
"""Share of the work that a life may be ahead of its way: the first micrometres ask for short steps."""
PLANNED = 0.7
"""Share of the work left with which steps are planned; the rest is for rates that get dearer."""
ROUGH_SHARE, MOST_HURRIED = 0.02, 0.5
"""Wear of a step over the depth reached, and where the work left pays for no shorter ones."""


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
    scheme = runge_kutta.stages_for(size * RADIUS_SAFETY * seen.radius)
    added = node.rate - first

    def reached(added_there: Array) -> Array:
        """Follow the static rate, with what is added to it going straight from start to end."""
        change = added_there - added

        def following(at: Array) -> Array:
            depth, x = at[:-1], at[-1]
            return np.append(np.maximum(0.0, still(depth) + added + x * change), 1.0 / size)

        begin, slope = np.append(node.depth, 0.0), np.append(node.rate, 1.0 / size)
        return runge_kutta.chebyshev_step(following, begin, slope, size, scheme)[:-1]

    held = reached(added)
    added_there = rate(held) - still(held)
    depth = reached(added_there)
    end = Node(node.cycle + size, depth, np.maximum(0.0, still(depth) + added_there))
    error, secant = depth - held, (depth - node.depth) / size
    return Step(node, end, (secant, secant), error, 1.0, None, float(np.abs(error).max(initial=0.0))), seen


class Work:
    """Where a life stands on its way and in its work, and the steps that this pays for.

    Parameters
    ----------
    rate : the wear rate
    node : the first state
    scale : depth scale of the life [m]
    """

    def __init__(self, rate: CountedRate, node: Node, scale: float) -> None:
        self.scale, self.first_depth = scale, _deepest(node)
        self.before = rate.count, rate.work
        self.dear, self.late = 1.0, False

    def is_late(self, rate: CountedRate, node: Node, left: float) -> bool:
        """Whether the work is, or was, too far ahead of the way; to be asked once a step.

        Parameters
        ----------
        rate : the wear rate
        node : where the life is
        left : way to the limit [cycles]
        """
        # Where orbits come and go one rate may cost a thousand times another: the dearer of all and the last.
        last = (rate.work - self.before[1]) / max(1, rate.count - self.before[0])
        self.dear = max(1.0, last, (rate.work - rate.first_work) / max(1, rate.count))
        self.before = rate.count, rate.work
        way = node.cycle / (node.cycle + left) if isfinite(left) else 1.0
        self.late = self.late or rate.share_of_work > HEAD_START + (1.0 - HEAD_START) * way
        return self.late

    def affordable(self, rate: CountedRate, node: Node, left: float) -> tuple[float, bool]:
        """Return the step of one rate [cycles], and whether the work left pays for no shorter ones."""
        reached, fastest = _deepest(node), _fastest(node)
        way, depth = left * fastest if isfinite(left) else 0.0, max(reached, self.scale)
        share = share_of_depth(way, depth, PLANNED * max(0.0, rate.affords(self.dear)))
        # The fastest place is another one every time: the deepest gets deeper at a third of its rate.
        deepens = (reached - self.first_depth) / node.cycle if reached > self.first_depth else fastest
        worn = float(np.clip(share, ROUGH_SHARE, MOST_HURRIED)) * depth
        return worn / deepens if deepens > 0.0 else inf, share > ROUGH_SHARE


def wearing(node: Node, scale: float, share: float = ROUGH_SHARE) -> float:
    """Return the cycles that wear this share of the depth reached, at least of the scale."""
    fastest = _fastest(node)
    return share * max(_deepest(node), scale) / fastest if fastest > 0.0 else inf


def share_of_depth(wear: float, depth: float, steps: float) -> float:
    """Return by which share of the depth reached so many steps wear all the way, ``(1 + w/h)^{1/n} − 1``.

    Parameters
    ----------
    wear : w, of the way left [m]
    depth : h, reached [m]
    steps : n, at least one
    """
    return expm1(log1p(wear / depth) / max(steps, 1.0)) if depth > 0.0 else inf


def _deepest(node: Node) -> float:
    return float(node.depth.max(initial=0.0))


def _fastest(node: Node) -> float:
    return float(node.rate.max(initial=0.0))
