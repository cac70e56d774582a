"""States and steps over cycles, the curve between states, jumps, retaken steps."""

from typing import NamedTuple, Protocol

import numpy as np

from wearlab.arrays import Array
from wearlab.life import limits, runge_kutta

FOURTH_ORDER = "fourth order"
EULER = "Euler"
"""Methods of a step beside the schemes of RKC2."""


class Node(NamedTuple):
    """A state of wear.

    Parameters
    ----------
    cycle : N [1]
    depth : (n,) h [m]
    rate : (n,) r(h) [m per cycle]
    """

    cycle: float
    depth: Array
    rate: Array

    @property
    def deepest(self) -> float:
        """Largest depth [m]."""
        return float(self.depth.max(initial=0.0))

    @property
    def fastest(self) -> float:
        """Largest rate [m per cycle]."""
        return float(self.rate.max(initial=0.0))


class Step(NamedTuple):
    """An accepted step.

    Parameters
    ----------
    start, end : the states at its ends
    slopes : (n,), (n,) dh/dN at the ends of the curve between them [m per cycle]
    error : (n,) estimated local error, signed [m]
    growth : factor by which the step multiplies errors made before it, ≥ 1 [1]
    by : the method that took it, with which it can be taken again; None: none can
    holds : whether it held part of a rate that wavers
    """

    start: Node
    end: Node
    slopes: tuple[Array, Array]
    error: Array
    growth: float
    by: runge_kutta.Scheme | str | None = None
    holds: bool = False

    @property
    def size(self) -> float:
        """ΔN [1]."""
        return self.end.cycle - self.start.cycle

    def scatter(self, noise: float) -> Array | float:
        """Return the standard deviation of its wear, (n,) or everywhere alike [m].

        Noise of a rate that it holds has moved its second pass by 1/√2 of that.

        Parameters
        ----------
        noise : standard error of the rates at its ends [m per cycle]
        """
        if self.holds:
            return np.asarray(np.sqrt(2.0) * np.abs(self.error))
        return self.size * noise


class Jump(NamedTuple):
    """A discontinuity of the wear rate along the life.

    Parameters
    ----------
    cycle : where it lies [1]
    width : cycles within which it was located [1]
    rate_before, rate_after : (n,) wear rate on either side [m per cycle]
    """

    cycle: float
    width: float
    rate_before: Array
    rate_after: Array


class SawTooth(Exception):
    """A step is beyond the stability limit: its wear alternates without end."""


class Stepper(Protocol):
    """What takes a life from one state to the next; a subclass has its ``advance``.

    Parameters
    ----------
    trying : size of the last step that was tried [cycles]
    max_size : bound on the next step [cycles]
    rejected : how many steps were tried and rejected
    saw_tooth : whether steps beyond the stability limit left their mark
    hurried : whether steps were as long as the work left paid for
    wave_growth : fastest growth of a wave of wear, where it is too fast to foresee its
        end; else 0 [1/cycle]
    """

    trying: float = 0.0
    max_size: float = np.inf
    rejected: int = 0
    saw_tooth: bool = False
    hurried: bool = False
    wave_growth: float = 0.0

    def advance(self, node: Node, largest: float) -> tuple[Step, Jump | None]:
        """Return the accepted step from a state, and any jump that it crosses.

        Parameters
        ----------
        node : the state
        largest : bound on the size of the step [cycles]

        Raises
        ------
        SawTooth
            When the step is beyond the stability limit and the method ends the life
            there.
        """
        raise NotImplementedError(f"{type(self).__name__} has no advance")

    def shorten(self, size: float) -> None:
        """Take no step longer than ``size`` [cycles] next.

        The last one led where the gears cannot run.

        Parameters
        ----------
        size : longest step from now on [1]
        """
        self.max_size = size


class Method(Protocol):
    """A way to step over cycles: what `wearlab.life.steps.StepMethod.build` returns."""

    def start(
        self, node: Node, rate: limits.CountedRate, tolerance: float, scale: float
    ) -> Stepper:
        """Return the stepper of one life.

        Parameters
        ----------
        node : the first state
        rate : the wear rate, called with depths (n,) [m]
        tolerance : relative error in depth and life [1]
        scale : depth below which errors are no longer relative [m]
        """
        ...


def depth_at(step: Step, cycle: float) -> Array:
    """Return the depth inside a step, a monotone cubic of values and slopes [m].

    Slopes are cut to three times the secant (Fritsch & Carlson, SIAM J. Numer. Anal. 17
    (1980) 238–246): a step much longer than the relaxation of the profile starts
    steeper than it goes on. The ends are exact.

    Parameters
    ----------
    step : the step
    cycle : a cycle inside it [1]
    """
    if cycle <= step.start.cycle:
        return step.start.depth
    if cycle >= step.end.cycle:
        return step.end.depth
    H = step.size
    x = (cycle - step.start.cycle) / H
    rise = step.end.depth - step.start.depth
    at_start, at_end = step.slopes
    left = np.clip(H * at_start, 0.0, 3.0 * rise)
    right = np.clip(H * at_end, 0.0, 3.0 * rise)
    inner = (
        x * x * (3.0 - 2.0 * x) * rise
        + x * (1.0 - x) ** 2 * left
        - x * x * (1.0 - x) * right
    )
    return np.asarray(step.start.depth + np.clip(inner, 0.0, rise))


def crossing(step: Step, depth: float, flank: limits.Flanks) -> float:
    """Return the cycle at which the largest depth on the flank reaches ``depth`` [1].

    By bisection to round-off: the largest depth never decreases.

    Parameters
    ----------
    step : a step in which the depth is reached
    depth : the depth [m]
    flank : entries of the flank
    """
    low = step.start.cycle
    high = step.end.cycle
    for _ in range(200):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        if depth_at(step, middle)[flank].max() >= depth:
            high = middle
        else:
            low = middle
    return high


def growth(start: Node, end: Node) -> float:
    """Return ``exp(max(0, ΔN dr·dh/|dh|²))``, by what an error grows in a step [1].

    Parameters
    ----------
    start, end : states at the ends of a step
    """
    dh = end.depth - start.depth
    square = float(dh @ dh)
    if square == 0.0:
        return 1.0
    exponent = (end.cycle - start.cycle) * float((end.rate - start.rate) @ dh) / square
    return float(np.exp(min(max(0.0, exponent), 50.0)))


def retake_step(step: Step, rate: limits.Rate, start: Node) -> Step:
    """Return a step of the same method and size from another state.

    Parameters
    ----------
    step : an accepted step
    rate : r(h) [m per cycle]
    start : the other state, at the same cycle

    Raises
    ------
    ValueError
        When the step crossed a jump of the rate, or held part of one that wavers: no
        method took it.
    """
    if step.by is None:
        raise ValueError(
            "the wear rate jumps or wavers in this step: it cannot be taken again"
        )
    if step.by == FOURTH_ORDER:
        trial = runge_kutta.fourth_order_step(rate, start.depth, start.rate, step.size)
        end = Node(step.end.cycle, trial.depth, trial.rate)
    else:
        depth = start.depth + step.size * start.rate
        if isinstance(step.by, runge_kutta.Scheme):
            depth = runge_kutta.chebyshev_step(
                rate, start.depth, start.rate, step.size, step.by
            )
        end = Node(step.end.cycle, depth, rate(depth))
    slopes = start.rate, start.rate if step.by == EULER else end.rate
    return Step(start, end, slopes, np.zeros_like(end.depth), 1.0, step.by)
