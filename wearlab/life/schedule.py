"""Whether the work that a march may do pays for the way it still has, and steps for which it does.

A march is on schedule as long as the share of its work that is done is not far ahead of the share of its way
that is made. Behind schedule, as where teeth part and a steady state costs a hundred times as much, steps are
as long as the work that is left pays for; their errors are estimated and recorded like those of any step. So
a life ends where it was asked to, less exactly than asked and saying so, and not by the bound on its work.
"""

from math import expm1, inf, log1p, sqrt

from wearlab.life.counted import CountedRate

HEAD_START = 0.15
"""Share of the work that a march may be ahead of its way: the first micrometres ask for short steps."""
PLANNED = 0.7
"""Share of the work left with which steps are planned; the rest is for rates that get dearer."""


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
