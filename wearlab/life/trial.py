"""A step tried: by Kutta's fourth order where it is not stiff, by RKC2 beyond; judged by its local error."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from wearlab.arrays import Array
from wearlab.life import embedded, rkc
from wearlab.life.counted import CountedRate
from wearlab.life.known_spectrum import KnownSpectrum
from wearlab.life.step import EMBEDDED, Node, Step, growth

Allowed = Callable[[Node, Node], float]
"""The largest local error of a step between two states that is allowed [m]."""

SAFETY = 0.85
LARGEST_GROWTH, LARGEST_CUT = 5.0, 0.1
HOPELESS = 3.0
"""Error ratio foreseen after half a step at which it is not completed."""
LOST = 0.1
"""Largest error, over its wear, of a step that misses its error test and still follows the waves."""


@dataclass(frozen=True)
class Trial:
    """A step tried.

    Parameters
    ----------
    start, end : the states at its ends
    size : ΔN [1]
    error : (n,) estimated local error [m]
    ratio : its largest over the allowed one [1]
    order : of the method
    by : the method, as `wearlab.life.step.Step` tells it
    share : 2/3 of a step that was given up there; its end is what a straight line makes of the rest
    """

    start: Node
    end: Node
    size: float
    error: Array
    ratio: float
    order: int
    by: rkc.Scheme | str
    share: float = 1.0

    @property
    def follows(self) -> bool:
        """Whether the error is still small beside the wear of the step."""
        worn = float((self.end.depth - self.start.depth).max(initial=0.0))
        return float(np.abs(self.error).max(initial=0.0)) <= LOST * worn

    @property
    def change(self) -> float:
        """Change of the rate over the whole step [m per cycle]."""
        return self.share**-1 * float(np.linalg.norm(self.end.rate - self.start.rate))

    def accepted(self) -> Step:
        """Return the step as it goes into the record."""
        rates, by = (self.start.rate, self.end.rate), self.by if self.share == 1.0 else None
        if self.ratio <= 1.0 or self.follows:
            return Step(self.start, self.end, rates, self.error, growth(self.start, self.end), by)
        # Rates at the ends of a step that is lost on the way do not tell how errors grow, nor their signs.
        return Step(self.start, self.end, rates, np.abs(self.error), 1.0, by)


def fitting(ratio: float, order: int) -> float:
    """Return the factor on the size of a step that an error ratio asks for [1]."""
    if ratio <= 0.0:
        return LARGEST_GROWTH
    return float(np.clip(SAFETY * ratio ** (-1.0 / order), LARGEST_CUT, LARGEST_GROWTH))


def try_fourth_order(
    rate: CountedRate,
    known: KnownSpectrum,
    node: Node,
    size: float,
    allowed: Allowed,
    rough: Callable[[], bool],
) -> Trial:
    """Try a step of Kutta's fourth-order method, whose stages tell of the spectrum.

    Parameters
    ----------
    rate : the wear rate
    known : what is known of its spectrum
    node : the start
    size : ΔN [1]
    allowed : the local error that is allowed
    rough : whether the rate is noisy by now; if not, half a step tells when its error will be too large
    """

    def tried(end: Node, error: Array) -> Trial:
        return Trial(node, end, size, error, _ratio(error, allowed(node, end)), 4, EMBEDDED)

    begun = embedded.begin(rate, node.depth, node.rate, size)
    known.told(rate, begun.seen)
    end = Node(node.cycle + size, node.depth + size * begun.third, begun.third)
    foreseen = tried(end, begun.foreseen(size, known.radius))
    if foreseen.ratio > HOPELESS and not rough():
        return replace(foreseen, share=2.0 / 3.0)
    depth, at_end, difference, seen = embedded.complete(rate, node.depth, node.rate, size, begun)
    known.told(rate, seen)
    return tried(Node(node.cycle + size, depth, at_end), embedded.reported(difference, size * known.radius))


def try_stiff(rate: CountedRate, known: KnownSpectrum, node: Node, size: float, allowed: Allowed) -> Trial:
    """Try a step of RKC2 with the stages that the spectrum asks for; parameters as above."""
    scheme = rkc.stages_for(size * known.radius, known.damping)
    depth = rkc.step(rate, node.depth, node.rate, size, scheme)
    end = Node(node.cycle + size, depth, rate(depth))
    error = rkc.local_error(node.depth, depth, node.rate, end.rate, size)
    return Trial(node, end, size, error, _ratio(error, allowed(node, end)), 2, scheme)


def _ratio(error: Array, allowed: float) -> float:
    return float(np.abs(error).max(initial=0.0)) / allowed
