"""Adaptive steps over cycles: as long as error and stability allow.

Kutta's fourth order while steps are not stiff, RKC2 beyond.

**Error test.** ``max|e| ≤ tolerance · w`` with the local error e of the step and ``w =
max(Δh, D/20)``: Δh the largest wear of the step, D the largest depth reached so far, at
least ``scale``. So the local errors sum to the tolerance times the final depth (times
at most 1 + steps/20), which makes the tolerance one of the whole life and not of a
step; and noise of the rate below ``tolerance·D/20`` never shrinks a step. The local
tolerance is half the one asked for: where wear brakes itself (h ∝ √N), a life is half
as exact as its depth.

**Jumps.** Where the rate jumps to another branch, steps shrink until what lies between
its sides is within the tolerance; the step across is recorded as a jump.

**Growing waves.** Where errors made at the start would grow to more than 1/tolerance
before the end (:mod:`wearlab.life.stiffness`), no step is short enough to foresee that
end: one that follows the fastest wave is accepted.

**Rough stretches.** Averaged over an aperiodic response the rate is noisy, and no step
is short enough for the test; nor can a life be followed whose rates get too dear for
the work it may do. There a step holds what the motion adds to the static rate
(:mod:`wearlab.life.stiffness`), and records the error that it estimates.
"""

from typing import Any, NamedTuple

import numpy as np

from wearlab.life import runge_kutta
from wearlab.life.limits import CountedRate, Rate
from wearlab.life.step import (
    FOURTH_ORDER,
    Jump,
    Node,
    Step,
    Stepper,
    depth_at,
    growth,
)
from wearlab.life.stiffness import (
    KnownSpectrum,
    Work,
    cycles_of_rough_step,
    held_step,
)

STEPS_PER_SPECTRUM, STEPS_BEFORE_STIFF = 12, 3
"""Age, in steps, from which the spectrum is looked at anew, and where a step may turn
stiff."""
LOOKED_AT = 0.5
"""ΔN ρ from which it matters that ρ is known."""
SAFETY, LARGEST_GROWTH, LARGEST_CUT = 0.85, 5.0, 0.1
FIRST_SHARE, FIRST_WEAR = 0.5, 15.0
"""Largest first step over the way to the limit; its wear over scale and fourth root of
the tolerance."""
LONG_WAY = 3.0
"""ρ times the way left from which a step may be stiff, and a wave may grow."""
WORTH = 1.25
"""Least step of RKC2 over the longest of the fourth-order method, which is far more
exact; and growth of what RKC2 is believed to manage, with every step without it."""
STRETCH = 1.1
"""Largest factor on a step that ends the way."""
HEARD = 0.1
"""Noise of the rate, over the tolerance and the fastest rate at the start, from which
it is rough."""
FOLLOWED, LOST = 1.25, 0.1
"""Largest ΔN ρ of a step that follows growing waves, and its largest error over its
wear."""
SHORTER, UNCHANGED = 0.65, 0.7
"""A step so much shorter, across which the rate changes as much, may cross a jump;"""
PROBES = (1.0 / 8.0, 1.0 / 2.0)
CONTINUOUS = 0.2
"""where it does, rates inside are nearer to one of its ends than this share of their
difference."""


class Adaptive(NamedTuple):
    """Kutta's fourth order or RKC2, with error control: the default."""

    def start(
        self, node: Node, rate: CountedRate, tolerance: float, scale: float
    ) -> "AdaptiveStepper":
        """Return the stepper at the first state."""
        return AdaptiveStepper(node, rate, tolerance, scale)


def order_of(step: Step) -> int:
    """Return the order of the method that took a step.

    Parameters
    ----------
    step : a step that was taken
    """
    return 4 if step.by == FOURTH_ORDER else 2


def follows(step: Step) -> bool:
    """Whether the error of a step is still small beside its wear.

    Parameters
    ----------
    step : a step that was taken
    """
    worn = float((step.end.depth - step.start.depth).max(initial=0.0))
    return float(np.abs(step.error).max(initial=0.0)) <= LOST * worn


def change_over(step: Step) -> float:
    """Return the change of the rate over a step [m per cycle].

    Parameters
    ----------
    step : a step that was taken
    """
    return float(np.linalg.norm(step.end.rate - step.start.rate))


def across(step: Step, size: float) -> tuple[Step, Jump]:
    """Return a step of ΔN [1] as one across a jump anywhere in it, and the jump.

    Parameters
    ----------
    step : a step inside which the rate jumps
    size : its length ΔN [1]
    """
    start = step.start
    end = step.end
    secant = (end.depth - start.depth) / size
    error = np.maximum(np.abs(step.error), size * np.abs(end.rate - start.rate))
    return Step(start, end, (secant, secant), error, 1.0), Jump(
        end.cycle, size, start.rate, end.rate
    )


def fitting(ratio: float, order: int) -> float:
    """Return the factor on the size of a step that an error ratio asks for [1].

    Parameters
    ----------
    ratio : estimated error over the tolerated one [1]
    order : of the method
    """
    if ratio <= 0.0:
        return LARGEST_GROWTH
    return float(np.clip(SAFETY * ratio ** (-1.0 / order), LARGEST_CUT, LARGEST_GROWTH))


class AdaptiveStepper(Stepper):
    """The controller between steps: next size, last error ratio, spectrum and work.

    ``hurried`` tells whether steps were as long as the work left paid for,
    ``wave_growth`` the fastest growth of a wave of wear where it is too fast to foresee
    its end [1/cycle].

    Parameters
    ----------
    node : the first state
    rate : the wear rate
    tolerance : relative error in depth and life [1]
    scale : depth below which the tolerance is not relative any more [m]
    """

    def __init__(
        self, node: Node, rate: CountedRate, tolerance: float, scale: float
    ) -> None:
        self.rate = rate
        self.tolerance = tolerance
        self.scale = scale
        self.heard = HEARD * tolerance * node.fastest
        self.known = KnownSpectrum(scale, self.heard)
        self.work = Work(rate, node, scale)
        self.next_size = np.inf
        self.stiff_size = np.inf
        self.last_ratio = 1.0
        self.last_order = 4
        self.ahead = 0.0, 0.0

    def advance(self, node: Node, largest: float) -> tuple[Step, Jump | None]:
        """Return the accepted step from ``node`` and any jump that it crosses."""
        memory = self.rate.remember()
        still = self.rate.still
        late = self.work.is_late(self.rate, node, largest)
        if still is not None and (late or self.rate.noise > self.heard):
            self.hurried = self.hurried or late
            return self._held(node, largest, still), None
        self._prepare(node, largest, memory)
        floor = self._floor(node)
        size = self._first_size(floor, largest)
        rejected = False
        while True:
            self.trying = size
            step, ratio = self._try(node, size)
            if still is not None and self.rate.noise > self.heard:
                self._reject(memory)
                return self._held(node, largest, still), None
            if ratio <= 1.0 or (size <= floor and follows(step)):
                self._went_on(size, ratio, order_of(step), rejected=rejected)
                if self._crosses_jump(step, size, memory):
                    return across(step, size)
                return step, None

            self._note_rejected_change(step, size)
            self._reject(memory)
            rejected = True
            if self.known.age > 0 and size * self.known.radius > LOOKED_AT:
                self.known.look(self.rate, node, memory)
            shorter = size * fitting(ratio, order_of(step))
            if floor >= size:
                floor = shorter
            size = self._retried_size(size, max(shorter, floor), order_of(step))

    def _floor(self, node: Node) -> float:
        """Return ΔN below which a step is not cut where waves of wear grow fast [1]."""
        if self.known.foreseeable:
            return 0.0
        followed = FOLLOWED / self.known.radius
        return min(followed, cycles_of_rough_step(node, self.scale))

    def _first_size(self, floor: float, largest: float) -> float:
        """Return ΔN of the first trial of a step, ``largest`` at most [1]."""
        suited = self._suited(max(self.next_size, floor), self.last_order)
        return float(min(self._even(suited, largest), largest, self.known.reach))

    def _retried_size(self, size: float, wanted: float, order: int) -> float:
        """Return ΔN of the next trial after one of ``size`` was rejected [1]."""
        suited = self._suited(wanted, order)
        return float(min(suited, 0.95 * size, self.known.reach))

    def _reject(self, memory: Any) -> None:
        """Count a rejected trial, and put back the rate's memory of the start."""
        self.rejected += 1
        self.rate.recall(memory)

    def _note_rejected_change(self, step: Step, size: float) -> None:
        """Note how much the rate changes over a rejected trial, if that is most."""
        change = change_over(step)
        if UNCHANGED * change > self.ahead[1]:
            self.ahead = size, change

    def _crosses_jump(self, step: Step, size: float, memory: Any) -> bool:
        """Whether the rate jumps inside an accepted step.

        Parameters
        ----------
        step, size : the step, and its ΔN [1]
        memory : of the rate at its start
        """
        (longer, changed) = self.ahead
        change = change_over(step)
        if size > SHORTER * longer or change <= UNCHANGED * changed:
            return False
        self.ahead = 0.0, 0.0
        beyond = self.rate.remember()
        nearest = list[float]()
        for share in PROBES:
            self.rate.recall(memory)
            inside = self.rate(depth_at(step, step.start.cycle + share * size))
            nearest.append(
                min(float(np.linalg.norm(inside - end.rate)) for end in step[:2])
            )
        self.rate.recall(beyond)
        return max(nearest) <= CONTINUOUS * change

    def _prepare(self, node: Node, left: float, memory: Any) -> None:
        """Look at the spectrum if it matters, and settle the next size."""
        if self._must_look(left):
            self.known.look(self.rate, node, memory)
        if not np.isfinite(self.next_size):  # the first step: nothing is known
            worn = FIRST_WEAR * self.scale * self.tolerance**0.25
            self.next_size = min(
                FIRST_SHARE * left,
                worn / node.fastest if node.fastest > 0.0 else np.inf,
            )
        self.known.foresee(self.rate, node, left, self.tolerance)
        self.wave_growth = 0.0 if self.known.foreseeable else self.known.wave_growth

    def _must_look(self, left: float) -> bool:
        """Whether the spectrum matters now and is not known well enough."""
        if not self.known.looked:
            return left * self.known.radius > LONG_WAY
        reached = self.next_size * self.known.radius
        if self.last_order == 4 and reached > runge_kutta.REACH:
            return self.known.age >= STEPS_BEFORE_STIFF
        return self.known.age >= STEPS_PER_SPECTRUM and reached > LOOKED_AT

    def _suited(self, size: float, order: int) -> float:
        """Return a step for the method that suits what the error test asked for."""
        if not self.known.looked or (
            order == 4 and size * self.known.radius <= runge_kutta.REACH
        ):
            return size
        self.stiff_size = size if order == 2 else min(size, WORTH * self.stiff_size)
        reach = runge_kutta.REACH / self.known.radius
        return self.stiff_size if self.stiff_size > WORTH * reach else reach

    def _even(self, size: float, left: float) -> float:
        """Return a step that leaves no short one for the end of the way."""
        if size < left < 2.0 * size:
            size = left if left <= STRETCH * size else 0.5 * left
        return min(size, self.max_size)

    def _held(self, node: Node, left: float, still: Rate) -> Step:
        """Return a step that holds what the motion adds to the static rate."""
        affordable, short_of_work = self.work.affordable(self.rate, node, left)
        self.hurried = self.hurried or short_of_work
        self.trying = self.next_size = size = min(self._even(affordable, left), left)
        direction = self.known.spectrum.direction
        step, self.known.spectrum = held_step(
            self.rate, still, node, size, direction, self.known.amplitude
        )
        self.work.learn(step)
        self.known.looked = True
        self.max_size = np.inf
        self.known.age += 1
        return step

    def _try(self, node: Node, size: float) -> tuple[Step, float]:
        """Return a step of fourth order, or of RKC2 where that is not stable.

        Its error over the allowed.
        """
        by: runge_kutta.Scheme | str
        stiffness = self.known
        if stiffness.looked and size * stiffness.radius > runge_kutta.REACH:
            by = runge_kutta.stages_for(size * stiffness.radius, stiffness.damping)
            depth = runge_kutta.chebyshev_step(
                self.rate, node.depth, node.rate, size, by
            )
            end = Node(node.cycle + size, depth, self.rate(depth))
            error = runge_kutta.chebyshev_error(
                node.depth, depth, node.rate, end.rate, size
            )
        else:
            by = FOURTH_ORDER
            trial = runge_kutta.fourth_order_step(
                self.rate, node.depth, node.rate, size
            )
            stiffness.hear(self.rate, trial.radius_seen)
            end = Node(node.cycle + size, trial.depth, trial.rate)
            error = runge_kutta.fourth_order_error(
                trial.difference, size * stiffness.radius
            )
        worn = float((end.depth - node.depth).max(initial=0.0))
        allowed = 0.5 * self.tolerance * max(worn, 0.05 * max(end.deepest, self.scale))
        step = Step(node, end, (node.rate, end.rate), error, growth(node, end), by)
        return step, float(np.abs(error).max(initial=0.0)) / allowed

    def _went_on(
        self, size: float, ratio: float, order: int, *, rejected: bool
    ) -> None:
        """Set the next size by the errors of an accepted step and those before."""
        ratio = max(ratio, 1e-10)
        trend = (
            min(1.0, (self.last_ratio / ratio) ** 0.1)
            if order == self.last_order
            else 1.0
        )
        self.next_size = size * min(
            fitting(ratio, order) * trend, 1.0 if rejected else LARGEST_GROWTH
        )
        self.last_ratio = ratio
        self.last_order = order
        self.max_size = np.inf
        self.known.age += 1
