"""Adaptive steps over cycles: fourth order while they are not stiff, RKC2 beyond with the stages it takes.

**Error test.** ``max|e| ≤ tolerance · w`` with the local error e of the step and ``w = max(Δh, D/20)``:
Δh the largest wear of the step, D the largest depth reached so far, at least ``scale``. So the local errors
sum to the tolerance times the final depth (times at most 1 + steps/20), which makes the tolerance one of the
whole life and not of a step; and noise of the rate below ``tolerance·D/20`` never shrinks a step. The local
tolerance is half the one asked for: where wear brakes itself (h ∝ √N), a life is half as exact as its depth.

**Rough stretches.** Averaged over an aperiodic response the rate is noisy, and no step is short enough for
the test. There a step wears a fixed share of the depth, and its estimated error is recorded all the same. It
holds what the motion adds to the static rate (:mod:`wearlab.life.held`), where the rate knows a static one.

**Growing waves.** Where errors made at the start would grow to more than 1/tolerance before the end
(:mod:`wearlab.life.known_spectrum`), a step is not cut below that same share of the depth, as long as it
follows the fastest wave.

**Work.** Behind the schedule of the work it may do (:mod:`wearlab.life.schedule`) a march takes steps that
the rest of it pays for, whatever the error test says, held ones like those through rough stretches;
``hurried`` tells. Once the work is used up, what the motion added last is held to the end, if that is near.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from wearlab.life import embedded
from wearlab.life.counted import CountedRate, Rate
from wearlab.life.held import coasting_step, held_step
from wearlab.life.jump import Jump, crosses_jump, locate
from wearlab.life.known_spectrum import KnownSpectrum
from wearlab.life.limits import OutOfEvaluations
from wearlab.life.sawtooth import saws
from wearlab.life.schedule import MOST_HURRIED, Schedule
from wearlab.life.spectrum import random_direction
from wearlab.life.step import Node, Step
from wearlab.life.trial import LARGEST_GROWTH, Trial, fitting, try_fourth_order, try_stiff

STEPS_PER_SPECTRUM = 12
STEPS_BEFORE_STIFF = 3
LOOKED_AT = 0.5
"""ΔN ρ from which it matters that ρ is known."""
NEAR_JUMP = 2.0
"""ΔN ρ of a step in which a jump is located, over the square root of the tolerance: by trapezoids."""
FIRST = 2.0
"""ΔN ρ of a first step, over the fourth root of the tolerance."""
SHARE_OF_DEPTH = 1.0 / 20.0
SHARE_OF_TOLERANCE = 0.5
FIRST_SHARE = 0.5
"""Largest first step over the way to the limit."""
FIRST_WEAR = 15.0
"""Largest wear of a first step, over the depth scale and the fourth root of the tolerance."""
LONG_WAY = 3.0
"""ρ times the way left from which a step may be stiff, and a wave may grow."""
WORTH = 1.25
"""Least step of RKC2 over the longest of the fourth-order method, which is far more exact."""
RETRIED = 1.25
"""Growth of what RKC2 is believed to manage, with every step without it, and of a step that was lost though
it was not to be cut: errors fade."""
STRETCH = 1.1
"""Largest factor on a step that ends the way."""
MOST_SEARCHES = 3
SUSPICIOUS = 10.0
"""Error ratio that a smooth step does not reach once it was cut."""
LEAST_MISSED = 1.3
"""Error ratio by which a step that is tried again is cut at least."""
ROUNDING = 1e-9
"""By which a step may be longer than one of the same length."""
MOST_JUMPS = 6
"""Jumps that are located; in a life with more of them the rate counts as rough."""
UNHEARD = 0.1
"""Noise of the rate, over the tolerance and the fastest rate at the start, that is none."""
COASTED = 1.0
"""Way left over the way made, on which a march goes on by the static rate alone once its work is used up."""
FOLLOWED = 1.25
"""Largest ΔN ρ of a step that misses its error test: each wave is followed, and decays if it should."""


@dataclass(frozen=True)
class Adaptive:
    """Kutta's fourth order or RKC2, with error control: the default."""

    def start(self, node: Node, rate: CountedRate, tolerance: float, scale: float) -> "AdaptiveStepper":
        """Return the stepper at the first state."""
        return AdaptiveStepper(node, rate, tolerance, scale)


class AdaptiveStepper:
    """The controller between steps: next size, last error ratio, what is known of the spectrum, its schedule.

    ``trying`` is the size of the last try, ``rejected`` counts tries; a saw is rejected, never flagged.

    Parameters
    ----------
    node : the first state
    rate : the wear rate
    tolerance : relative error in depth and life [1]
    scale : depth below which the tolerance is not relative any more [m]
    """

    saw_tooth = False

    def __init__(self, node: Node, rate: CountedRate, tolerance: float, scale: float) -> None:
        self.rate, self.tolerance, self.scale = rate, tolerance, scale
        self.noise_before, self.heard = 0.0, UNHEARD * tolerance * float(node.rate.max(initial=0.0))
        self.known = KnownSpectrum(scale, self.heard)
        self.schedule = Schedule(rate, node, scale)
        self.jumps = self.rejected = 0
        self.trying, self.most = 0.0, np.inf
        self.next_size = self.stiff_size = self.kept_up = np.inf
        self.last_ratio, self.last_order = 1.0, 4

    @property
    def hurried(self) -> bool:
        """Whether steps were as long as the work left paid for."""
        return self.schedule.hurried

    @property
    def wave_growth(self) -> float:
        """Fastest growth of a wave of wear where it is too fast to foresee its end, else 0 [1/cycle]."""
        return 0.0 if self.known.foreseeable else self.known.wave_growth

    def advance(self, node: Node, largest: float) -> tuple[list[Step], Jump | None]:
        """Return the accepted step from ``node``, at most ``largest`` cycles long, and any jump it met.

        Raises
        ------
        OutOfEvaluations
            When the work is used up too far from the end, or no static rate is known that would lead there.
        """
        memory = self.rate.remember()
        try:
            return self._advanced(node, largest)
        except OutOfEvaluations:
            if self.rate.still is None or largest > COASTED * node.cycle:
                raise
            self.rate.recall(memory)
            self.schedule.hurried = True
            size = min(largest, self.schedule.worn(node, MOST_HURRIED))
            return [coasting_step(self.rate.still, node, size, self.known.amplitude)], None

    def _advanced(self, node: Node, largest: float) -> tuple[list[Step], Jump | None]:
        memory, self.noise_before = self.rate.remember(), self.rate.noise
        dear = self.schedule.dear(self.rate)
        paid = self.schedule.paid_for(self.rate, node, largest, dear, self._stiffness())
        if self.rate.still is not None and (self._is_rough() or self.next_size < paid < np.inf):
            return [self._held(node, largest, dear, self.rate.still)], None
        floor = self._prepare(node, largest, paid, memory)
        wanted = max(self._suited(max(self.next_size, floor), self.last_order), paid)
        size, searches = self._bounded(self._even(wanted, largest), largest), 0
        sizes: list[float] = []
        changes: list[float] = []
        while True:
            tried = self._try(node, size)
            sizes.append(size)
            changes.append(tried.change)
            again = len(sizes) > 1
            suspicious = again and (tried.ratio > SUSPICIOUS or crosses_jump(sizes, changes))
            if self._is_rough():
                return [self._through_roughness(tried, largest, dear, memory)], None
            if tried.ratio > 1.0 and size <= floor and (paid or tried.follows):
                self.schedule.hurried = self.schedule.hurried or not tried.follows
                return [self._accepted(tried, rejected=True)], None
            if searches < MOST_SEARCHES and suspicious and not paid:
                if size > (1.0 + ROUNDING) * (short := self._near_jump()):
                    self.rejected += 1
                    self.rate.recall(memory)
                    size = short
                    continue
                searches += 1
                beyond = self.rate.remember()
                met = self._across(node, tried, memory)
                if met is not None:
                    return met
                self.rate.recall(beyond)
            sawtooth = size * self.known.radius > 1.0 and saws(node.rate, tried.end.depth - node.depth)
            if tried.ratio <= 1.0 and not sawtooth:
                return [self._accepted(tried, rejected=again)], None
            self.rejected += 1
            self.rate.recall(memory)
            if self.known.age > 0 and size * self.known.radius > LOOKED_AT:
                self.known.look(self.rate, node, memory)
            fits = fitting(max(tried.ratio, LEAST_MISSED), tried.order)
            if size <= floor:  # lost even so: what is kept up is less, for some steps
                self.kept_up = floor = size * fits
            cut = self._suited(max(size * fits, floor if floor < size else 0.0), tried.order)
            size = self._bounded(cut, 0.5 * size if sawtooth else 0.95 * size)

    def shorten(self, size: float) -> None:
        """Take no step longer than ``size`` next: the last one led where the gears cannot run."""
        self.most = size

    def _prepare(self, node: Node, left: float, paid: float, memory: Any) -> float:
        """Look at the spectrum if it matters, settle the next size, return that below which none is cut."""
        if self._must_look(left):
            self.known.look(self.rate, node, memory)
        if not np.isfinite(self.next_size):
            self.next_size = self._first(node, left)
        if self._is_rough():
            self.next_size = self.schedule.worn(node)
        self.known.foresee(self.rate, node, left, self.tolerance)
        followed = 0.0 if self.known.foreseeable else FOLLOWED / self.known.radius
        self.kept_up *= RETRIED
        return max(min(self.schedule.worn(node), followed, self.kept_up), paid)

    def _must_look(self, left: float) -> bool:
        """Whether it matters now to know the spectrum at least as well as it is known."""
        if not self.known.looked:
            return self.schedule.late or left * self.known.radius > LONG_WAY
        reached = self.next_size * self.known.radius
        if self.last_order == 4 and reached > embedded.REACH:
            return self.known.age >= STEPS_BEFORE_STIFF
        return self.known.age >= STEPS_PER_SPECTRUM and reached > LOOKED_AT

    def _is_rough(self) -> bool:
        """Whether the rate is noisy on either side of the step, or has jumped too often to be followed."""
        return max(self.rate.noise, self.noise_before) > self.heard or self.jumps >= MOST_JUMPS

    def _stiffness(self) -> float:
        """Return the spectral radius that RKC2 has to reach: off the real axis it reaches half as far."""
        return self.known.radius * (1.0 if self.known.spectrum.is_real else 2.0)

    def _first(self, node: Node, left: float) -> float:
        """Return a first step when nothing is known: half a step will tell whether it is too long."""
        fastest = float(node.rate.max(initial=0.0))
        worn = FIRST_WEAR * self.scale * self.tolerance**0.25
        return min(FIRST_SHARE * left, worn / fastest) if fastest > 0.0 else FIRST_SHARE * left

    def _suited(self, size: float, order: int) -> float:
        """Return a step for the method that suits it: what the test of a method of this order asked for."""
        if not self.known.looked or (order == 4 and size * self.known.radius <= embedded.REACH):
            return size
        self.stiff_size = size if order == 2 else min(size, RETRIED * self.stiff_size)
        reach = embedded.REACH / self.known.radius
        return self.stiff_size if self.stiff_size > WORTH * reach else reach

    def _even(self, size: float, left: float) -> float:
        """Return a step that leaves no short one for the end of the way."""
        if size < left <= STRETCH * size:
            size = left
        elif size < left < 2.0 * size:
            size = 0.5 * left
        return min(size, self.most)

    def _bounded(self, size: float, largest: float) -> float:
        return float(min(size, largest, self.known.reach))

    def _through_roughness(self, tried: Trial, left: float, dear: float, memory: Any) -> Step:
        """Return the step tried, or one that holds what the motion adds where the static rate is known."""
        self.most = np.inf
        if self.noise_before <= self.heard < self.rate.noise:
            self.jumps += 1
        if self.rate.still is None:
            return tried.accepted()
        self.rejected += 1
        self.rate.recall(memory)
        return self._held(tried.start, left, dear, self.rate.still)

    def _held(self, node: Node, left: float, dear: float, still: Rate) -> Step:
        """Return a step that holds what the motion adds to the static rate."""
        wanted = self.schedule.held(self.rate, node, left, dear)
        self.trying = self.next_size = size = min(self._even(wanted, left), left)
        direction = self.known.spectrum.direction
        step, self.known.spectrum = held_step(self.rate, still, node, size, direction, self.known.amplitude)
        self.known.looked = True
        self._went_on(1.0, 4)
        return step

    def _try(self, node: Node, size: float) -> Trial:
        self.trying = size
        if (self.known.looked or self.schedule.late) and size * self.known.radius > embedded.REACH:
            return try_stiff(self.rate, self.known, node, size, self._allowed)
        return try_fourth_order(self.rate, self.known, node, size, self._allowed, self._is_rough)

    def _allowed(self, node: Node, end: Node) -> float:
        worn = float((end.depth - node.depth).max(initial=0.0))
        reached = max(float(end.depth.max(initial=0.0)), self.scale)
        return SHARE_OF_TOLERANCE * self.tolerance * max(worn, SHARE_OF_DEPTH * reached)

    def _accepted(self, tried: Trial, *, rejected: bool) -> Step:
        """Return an accepted step, and settle the next size by its error and how errors went lately."""
        ratio = max(tried.ratio, 1e-10)
        trend = min(1.0, (self.last_ratio / ratio) ** 0.1) if tried.order == self.last_order else 1.0
        factor = min(fitting(ratio, tried.order) * trend, 1.0 if rejected else LARGEST_GROWTH)
        self.next_size = tried.size * factor
        self._went_on(ratio, tried.order)
        return tried.accepted()

    def _went_on(self, ratio: float, order: int) -> None:
        self.last_ratio, self.last_order, self.most = ratio, order, np.inf
        self.known.age += 1

    def _near_jump(self) -> float:
        """Return the step up to which the way to a jump is straight enough for it to be located [cycles]."""
        radius = self.known.radius
        return NEAR_JUMP * self.tolerance**0.5 / radius if radius > 0.0 else np.inf

    def _across(self, node: Node, tried: Trial, memory: Any) -> tuple[list[Step], Jump] | None:
        """Return the steps up to a jump and across it, and the jump; None where there is none after all."""
        width = 0.1 * self.tolerance * (node.cycle + tried.size)
        located = locate(self.rate, node, tried.size, tried.end.rate, memory, width)
        if located is None:
            return None
        up, across, jump = located
        self.jumps += 1
        self.known.look(self.rate, across.end, self.rate.remember(), random_direction(across.end.rate))
        # The step whose fastest wave is followed to the tolerance: nothing else is known.
        radius = self.known.radius
        self.next_size = FIRST * self.tolerance**0.25 / radius if radius > 0.0 else tried.size
        return [step for step in (up, across) if step.size > 0.0], jump
