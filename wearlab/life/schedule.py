"""Whether the work that a march may do pays for the way it still has, and steps for which it does.

A march is on schedule as long as the share of its work that is done is not far ahead of the share of its way
that is made. Behind schedule, as where teeth part and a steady state costs a hundred times as much, steps are
as long as the work that is left pays for; their errors are estimated and recorded like those of any step. So
a life ends where it was asked to, less exactly than asked and saying so, and not by the bound on its work.
"""

from math import expm1, inf, isfinite, log1p, sqrt

import numpy as np

from wearlab.life.counted import CountedRate
from wearlab.life.step import Node

HEAD_START = 0.15
"""Share of the work that a march may be ahead of its way: the first micrometres ask for short steps."""
PLANNED = 0.7
"""Share of the work left with which steps are planned; the rest is for rates that get dearer."""
ROUGH_SHARE = 0.02
"""Wear of a step through a rough stretch, over the depth reached."""
HURRIED_SHARE, MOST_HURRIED = 0.2, 0.5
"""Wear of a step behind schedule over the depth reached, and where the work left pays for no shorter ones."""


class Schedule:
    """Where a march stands on its way and in its work, and the steps that this allows.

    ``late``: whether it is or was behind; ``hurried``: whether a step was accepted because the work left
    paid for no shorter one.

    Parameters
    ----------
    rate : the wear rate
    node : the first state
    scale : depth scale of the march [m]
    """

    def __init__(self, rate: CountedRate, node: Node, scale: float) -> None:
        self.scale, self.first_depth = scale, _deepest(node)
        self.before = 0, rate.work
        self.late = self.hurried = False

    def dear(self, rate: CountedRate) -> float:
        """Return the work of one rate, and remember where the next one begins."""
        dear = each(rate, *self.before)
        self.before = rate.count, rate.work
        return dear

    def worn(self, node: Node, share: float = ROUGH_SHARE) -> float:
        """Return the cycles that wear this share of the depth reached."""
        fastest = _fastest(node)
        return share * max(_deepest(node), self.scale) / fastest if fastest > 0.0 else inf

    def paid_for(self, rate: CountedRate, node: Node, left: float, dear: float, stiffness: float) -> float:
        """Return the step that the work left pays for, 0 as long as the march was on schedule [cycles].

        Parameters
        ----------
        rate : the wear rate
        node : where the march is
        left : way to the limit [cycles]
        dear : work of one rate
        stiffness : spectral radius that RKC2 has to reach [1/cycle]
        """
        if not isfinite(left):
            return 0.0
        self.late = self.late or behind(rate.share_of_work, node.cycle / (node.cycle + left))
        if not self.late:
            return 0.0
        size = affordable(left, stiffness, rate.affords(dear))
        share = share_of_depth(left * _fastest(node), max(_deepest(node), self.scale), left / size)
        return float(min(size, self.worn(node, np.clip(share, HURRIED_SHARE, MOST_HURRIED))))

    def held(self, rate: CountedRate, node: Node, left: float, dear: float) -> float:
        """Return the step of one rate: a fixed share of the depth, or more if the work left pays for no less.

        Parameters
        ----------
        rate, node, left, dear : as for :meth:`paid_for`
        """
        reached, fastest = _deepest(node), _fastest(node)
        way, depth = left * fastest if isfinite(left) else 0.0, max(reached, self.scale)
        share = affordable_share(way, depth, rate.affords(dear))
        self.hurried = self.hurried or share > ROUGH_SHARE
        # The fastest place is another one every time: the deepest gets deeper at a third of its rate.
        deepens = (reached - self.first_depth) / node.cycle if reached > self.first_depth else fastest
        return float(np.clip(share, ROUGH_SHARE, MOST_HURRIED) * depth / deepens) if deepens > 0.0 else inf


def _deepest(node: Node) -> float:
    return float(node.depth.max(initial=0.0))


def _fastest(node: Node) -> float:
    return float(node.rate.max(initial=0.0))


def behind(work: float, way: float) -> bool:
    """Whether a share of the work done is too much for a share of the way made."""
    return work > HEAD_START + (1.0 - HEAD_START) * way


def affordable(left: float, radius: float, rates: float) -> float:
    """Return the step [cycles] that a number of rates pays for, all the way.

    RKC2 over ΔN takes about ``2 + √(1.5 ρ ΔN)`` rates, so that n equal steps over the way L take
    ``2n + √(1.5 ρ L n)``; n follows from that being PLANNED of the rates.

    Parameters
    ----------
    left : L, the way left [cycles]
    radius : ρ, the spectral radius [1/cycle]
    rates : evaluations of the rate that the work left pays for
    """
    c = sqrt(1.5 * radius * left)
    steps = ((sqrt(c * c + 8.0 * PLANNED * max(0.0, rates)) - c) / 4.0) ** 2
    return left / max(steps, 1.0)


def affordable_share(wear: float, depth: float, rates: float) -> float:
    """Return the share of the depth reached that steps of one rate each may wear, so that work pays for all.

    Parameters
    ----------
    wear, depth : of the way left, and reached [m]
    rates : evaluations of the rate that the work left pays for
    """
    return share_of_depth(wear, depth, PLANNED * max(0.0, rates))


def each(rate: CountedRate, counted: int, worked: float) -> float:
    """Return the work of one rate: where orbits come and go one may cost a thousand times another.

    The dearer of all rates on the mean and of those since so many were counted and so much was worked.
    """
    last = (rate.work - worked) / max(1, rate.count - counted)
    return max(1.0, last, (rate.work - rate.first_work) / max(1, rate.count))


def share_of_depth(wear: float, depth: float, steps: float) -> float:
    """Return by which share of the depth reached so many steps wear all the way, ``(1 + w/h)^{1/n} − 1``.

    Parameters
    ----------
    wear : w, of the way left [m]
    depth : h, reached [m]
    steps : n, at least one
    """
    return expm1(log1p(wear / depth) / max(steps, 1.0)) if depth > 0.0 else inf
