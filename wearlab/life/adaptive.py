"""Adaptive steps over cycles: fourth order while they are not stiff, RKC2 beyond with the stages it takes.

**Error test.** ``max|e| ≤ tolerance · w`` with the local error e of the step and ``w = max(Δh, D/20)``:
Δh the largest wear of the step, D the largest depth reached so far, at least ``scale``. So the local errors
sum to the tolerance times the final depth (times at most 1 + steps/20), which makes the tolerance one of the
whole life and not of a step; and noise of the rate below ``tolerance·D/20`` never shrinks a step. The local
tolerance is half the one asked for: where wear brakes itself (h ∝ √N), a life is half as exact as its depth.

**Stiffness.** Stages of a step tell a lower bound of the spectral radius ρ of ∂r/∂h. As long as ρ times the
whole way left is small by it, no step can be stiff and no wave can grow much, and nothing else is asked. A
longer way, or a step that fails its test, is worth a power iteration.

**Rough stretches.** Averaged over an aperiodic response the rate is noisy, and no step is short enough for
the test. There a step wears a fixed share of the depth, and its estimated error is recorded all the same. It
holds what the motion adds to the static rate (:mod:`wearlab.life.held`), where the rate knows a static one.

**Growing waves.** Under the load of the moment a flank may corrugate: below the natural frequency of a mesh
the force is largest where the flank is worn most, and waves of wear grow until teeth part. Errors grow with
them, so that no step is short enough to tell where a wave will be many e-foldings later; what the waves do on
the average is all that can be known. Where errors made at the start would grow to more than 1/tolerance
before the end, a step is not cut below that same share of the depth, as long as it follows the fastest wave.

**Work.** Behind the schedule of the work it may do (:mod:`wearlab.life.schedule`) a march takes steps that
the rest of it pays for, whatever the error test says, held ones like those through rough stretches;
``hurried`` tells.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.life import embedded, rkc
from wearlab.life.counted import CountedRate, Rate
from wearlab.life.held import held_step
from wearlab.life.jump import Jump, crosses_jump, locate
from wearlab.life.sawtooth import saws
from wearlab.life.schedule import affordable, affordable_share, behind, each, share_of_depth
from wearlab.life.spectrum import RADIUS_SAFETY, Spectrum, growth_rate, random_direction, spectrum
from wearlab.life.step import EMBEDDED, Node, Step, growth

Array = NDArray[np.float64]

SAFETY = 0.85
LARGEST_GROWTH, LARGEST_CUT = 5.0, 0.1
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
HOPELESS = 3.0
"""Error ratio foreseen after half a step at which it is not completed."""
WORTH = 1.25
"""Least step of RKC2 over the longest of the fourth-order method, which is far more exact."""
RETRIED = 1.25
"""Growth of what RKC2 is believed to manage, with every step without it: errors fade."""
STRETCH = 1.1
"""Largest factor on a step that ends the way."""
MOST_SEARCHES = 3
SUSPICIOUS = 10.0
"""Error ratio that a smooth step does not reach once it was cut."""
ROUNDING = 1e-9
"""By which a step may be longer than one of the same length."""
MOST_JUMPS = 6
"""Jumps that are located; in a life with more of them the rate counts as rough."""
UNHEARD = 0.1
"""Noise of the rate, over the tolerance and the fastest rate at the start, that is none."""
ROUGH_SHARE = 0.02
"""Wear of a step through a rough stretch, over the depth reached."""
HURRIED_SHARE, MOST_HURRIED = 0.2, 0.5
"""Wear of a step behind schedule over the depth reached, and where the work left pays for no shorter ones."""
FOLLOWED = 1.25
"""Largest ΔN ρ of a step that misses its error test: each wave is followed, and decays if it should."""
LOST = 0.1
"""Largest error of such a step over its wear."""
NOTHING_KNOWN = Spectrum(0.0, 1.0, np.empty(0))
"""Until the first look."""
STEEP, SLOPE = 3.0, 0.75
"""Growth of the spectral radius from one look to the next that may be a jump of the rate, and how much of
it must be found over twice the way."""
PROBE = 1e-3
"""Amplitude of the power iteration over the depth scale."""


@dataclass(frozen=True)
class Adaptive:
    """Kutta's fourth order or RKC2, with error control: the default."""

    def start(self, node: Node, rate: CountedRate, tolerance: float, scale: float) -> "AdaptiveStepper":
        """Return the stepper at the first state."""
        return AdaptiveStepper(node, rate, tolerance, scale)


@dataclass(frozen=True)
class _Try:
    """A step tried: end, estimated local error (n,) [m], that over the allowed one, size, order of method.

    ``share`` is 2/3 of a step that was given up there; its end is what a straight line makes of the rest.
    ``by``: the method, as `wearlab.life.step.Step` tells it.
    """

    end: Node
    error: Array
    ratio: float
    size: float
    order: int
    by: rkc.Scheme | str
    share: float = 1.0

    def follows(self, start: Node) -> bool:
        """Whether the error is still small beside the wear of the step."""
        worn = float((self.end.depth - start.depth).max(initial=0.0))
        return float(np.abs(self.error).max(initial=0.0)) <= LOST * worn

    def fits(self, ratio: float) -> float:
        """Return the factor on the size that an error ratio asks for."""
        if ratio <= 0.0:
            return LARGEST_GROWTH
        return float(np.clip(SAFETY * ratio ** (-1.0 / self.order), LARGEST_CUT, LARGEST_GROWTH))


class AdaptiveStepper:
    """The controller between steps: next size, last error ratio, spectrum and its age.

    ``trying`` is the size of the last try, ``rejected`` counts tries; a saw is rejected, never flagged;
    ``wave_growth`` is the fastest growth of a wave of wear that was seen [1/cycle]; ``hurried`` says whether
    a step was accepted because the work left paid for no shorter one.

    Parameters
    ----------
    node : the first state
    rate : the wear rate
    tolerance : relative error in depth and life [1]
    scale : depth below which the tolerance is not relative any more [m]
    """

    def __init__(self, node: Node, rate: CountedRate, tolerance: float, scale: float) -> None:
        self.rate, self.tolerance, self.scale = rate, tolerance, scale
        self.last_ratio = 1.0
        self.first_depth = float(node.depth.max(initial=0.0))
        self.rejected = 0
        self.trying = 0.0
        self.saw_tooth = self.late = self.hurried = False
        self.jumps = 0
        self.before = 0, self.rate.work
        self.most = np.inf
        self.noise_before, self.heard = 0.0, UNHEARD * tolerance * float(node.rate.max(initial=0.0))
        self.wave_growth = 0.0
        self.foreseeable = True
        self.age = 0
        self.spectrum = NOTHING_KNOWN
        self.looked = self.growth_known = False
        self.next_size = self.stiff_size = np.inf
        self.last_order = 4

    @property
    def radius(self) -> float:
        """Spectral radius with a margin [1/cycle]."""
        return RADIUS_SAFETY * self.spectrum.radius

    def _cautious(self, otherwise: float) -> float:
        """Return the step whose fastest wave is followed to the tolerance, when nothing else is known."""
        return FIRST * self.tolerance**0.25 / self.radius if self.radius > 0.0 else otherwise

    def _near_jump(self) -> float:
        """Return the step up to which the way to a jump is straight enough for it to be located [cycles]."""
        return NEAR_JUMP * self.tolerance**0.5 / self.radius if self.radius > 0.0 else np.inf

    @property
    def damping(self) -> float:
        """RKC damping that suits the spectrum."""
        return rkc.SHARP if self.spectrum.is_real else rkc.WIDE

    def advance(self, node: Node, largest: float) -> tuple[list[Step], Jump | None]:
        """Return the accepted step from ``node``, at most ``largest`` cycles long, and any jump it met."""
        memory, self.noise_before = self.rate.remember(), self.rate.noise
        sizes: list[float] = []
        changes: list[float] = []
        dear = each(self.rate, *self.before)
        self.before = self.rate.count, self.rate.work
        paid = self._paid_for(node, largest, dear)
        if self.rate.still is not None and (self._is_rough() or self.next_size < paid < np.inf):
            return [self._held(node, largest, dear, self.rate.still)], None
        if self._must_look(largest):
            self._look(node, self.spectrum.direction, memory)
        if not np.isfinite(self.next_size):
            self.next_size = self._first(node, largest)
        if self._is_rough():
            self.next_size = self._rough_size(node)
        self.foreseeable = self.foreseeable and self._errors_stay_small(node, largest)
        floor = 0.0 if self.foreseeable else min(self._rough_size(node), FOLLOWED / self.radius)
        floor = max(floor, paid)
        wanted = max(self._suited(max(self.next_size, floor), self.last_order), paid)
        size, searches = self._bounded(self._even(wanted, largest), largest), 0
        while True:
            tried = self._try(node, size)
            sizes.append(size)
            changes.append(tried.share**-1 * float(np.linalg.norm(tried.end.rate - node.rate)))
            again = len(sizes) > 1
            suspicious = again and (tried.ratio > SUSPICIOUS or crosses_jump(sizes, changes))
            if self._is_rough():
                self.most = np.inf
                return [self._step(node, tried)], None
            if tried.ratio > 1.0 and size <= floor and (paid or tried.follows(node)):
                self.hurried = self.hurried or not tried.follows(node)
                self._accepted(tried, rejected=True)
                return [self._step(node, tried)], None
            if searches < MOST_SEARCHES and suspicious and not paid:
                if size > (1.0 + ROUNDING) * (short := self._near_jump()):
                    self.rejected += 1
                    self.rate.recall(memory)
                    size = short
                    continue
                searches += 1
                beyond = self.rate.remember()
                found = self._across(node, tried, memory)
                if found is not None:
                    return found
                self.rate.recall(beyond)
            sawtooth = size * self.radius > 1.0 and saws(node.rate, tried.end.depth - node.depth)
            if tried.ratio <= 1.0 and not sawtooth:
                self._accepted(tried, rejected=len(sizes) > 1)
                return [self._step(node, tried)], None
            self.rejected += 1
            self.rate.recall(memory)
            if self.age > 0 and size * self.radius > LOOKED_AT:
                self._look(node, self.spectrum.direction, memory)
            cut = max(size * tried.fits(max(tried.ratio, 1.3)), min(floor, size))
            cut = self._suited(cut, tried.order)
            size = self._bounded(cut, 0.5 * size if sawtooth else 0.95 * size)

    def _must_look(self, left: float) -> bool:
        """Whether it matters now to know the spectrum at least as well as it is known."""
        if not self.looked:
            return self.late or left * self.radius > LONG_WAY
        turns_stiff = self.last_order == 4 and self.next_size * self.radius > embedded.REACH
        if turns_stiff:
            return self.age >= STEPS_BEFORE_STIFF
        return self.age >= STEPS_PER_SPECTRUM and self.next_size * self.radius > LOOKED_AT

    def _first(self, node: Node, left: float) -> float:
        """Return a first step when nothing is known: half a step will tell whether it is too long."""
        fastest = float(node.rate.max(initial=0.0))
        worn = FIRST_WEAR * self.scale * self.tolerance**0.25
        return min(FIRST_SHARE * left, worn / fastest) if fastest > 0.0 else FIRST_SHARE * left

    def _suited(self, size: float, order: int) -> float:
        """Return a step for the method that suits it: what the test of a method of this order asked for."""
        if not self.looked or (order == 4 and size * self.radius <= embedded.REACH):
            return size
        self.stiff_size = size if order == 2 else min(size, RETRIED * self.stiff_size)
        reach = embedded.REACH / self.radius
        return self.stiff_size if self.stiff_size > WORTH * reach else reach

    def _even(self, size: float, left: float) -> float:
        """Return a step that leaves no short one for the end of the way."""
        if size < left <= STRETCH * size:
            size = left
        elif size < left < 2.0 * size:
            size = 0.5 * left
        return min(size, self.most)

    def _is_rough(self) -> bool:
        """Whether the rate is noisy on either side of the step, or has jumped too often to be followed."""
        return max(self.rate.noise, self.noise_before) > self.heard or self.jumps >= MOST_JUMPS

    def _errors_stay_small(self, node: Node, left: float) -> bool:
        """Whether an error made at the start grows to less than 1/tolerance before the limit."""
        whole, most = node.cycle + (left if np.isfinite(left) else 0.0), -np.log(self.tolerance)
        if self.spectrum.radius * whole > most and not self.growth_known:
            self._look_for_growth(node)
        return bool(self.wave_growth * whole <= most)

    def _rough_size(self, node: Node, share: float = ROUGH_SHARE) -> float:
        """Return the step that wears a fixed share of the depth reached: the error test is no guide here."""
        reached = max(float(node.depth.max(initial=0.0)), self.scale)
        fastest = float(node.rate.max(initial=0.0))
        return share * reached / fastest if fastest > 0.0 else np.inf

    def _paid_for(self, node: Node, left: float, dear: float) -> float:
        """Return the step that the work left pays for, 0 as long as the march was on schedule [cycles]."""
        if not np.isfinite(left):
            return 0.0
        self.late = self.late or behind(self.rate.share_of_work, node.cycle / (node.cycle + left))
        if not self.late:
            return 0.0
        stiffness = self.radius * (1.0 if self.spectrum.is_real else 2.0)
        size = affordable(left, stiffness, self.rate.affords(dear))
        reached, fastest = float(node.depth.max(initial=0.0)), float(node.rate.max(initial=0.0))
        share = share_of_depth(left * fastest, max(reached, self.scale), left / size)
        return float(min(size, self._rough_size(node, np.clip(share, HURRIED_SHARE, MOST_HURRIED))))

    def _held(self, node: Node, left: float, dear: float, still: Rate) -> Step:
        """Return a step that wears a fixed share of the depth, or more if the work left pays for no less."""
        reached, fastest = float(node.depth.max(initial=0.0)), float(node.rate.max(initial=0.0))
        way = left * fastest if np.isfinite(left) else 0.0
        depth = max(reached, self.scale)
        share = affordable_share(way, depth, self.rate.affords(dear))
        self.hurried = self.hurried or share > ROUGH_SHARE
        # The fastest place is another one every time: the deepest gets deeper at a third of its rate.
        deepens = (reached - self.first_depth) / node.cycle if reached > self.first_depth else fastest
        wanted = np.clip(share, ROUGH_SHARE, MOST_HURRIED) * depth / deepens if deepens > 0.0 else np.inf
        self.trying = self.next_size = size = min(self._even(wanted, left), left)
        step, self.spectrum = held_step(
            self.rate, still, node, size, self.spectrum.direction, PROBE * self.scale
        )
        self.last_ratio, self.last_order, self.age, self.most = 1.0, 4, self.age + 1, np.inf
        self.looked = True
        return step

    def shorten(self, size: float) -> None:
        """Take no step longer than ``size`` next: the last one led where the gears cannot run."""
        self.most = size

    def _across(self, node: Node, tried: _Try, memory: Any) -> tuple[list[Step], Jump] | None:
        width = 0.1 * self.tolerance * (node.cycle + tried.size)
        found = locate(self.rate, node, tried.size, tried.end.rate, memory, width)
        if found is None:
            return None
        up, across, jump = found
        self.jumps += 1
        self._look(across.end, random_direction(across.end.rate), self.rate.remember())
        self.next_size = self._cautious(tried.size)
        return [step for step in (up, across) if step.size > 0.0], jump

    def _try(self, node: Node, size: float) -> _Try:
        self.trying = size
        if (self.looked or self.late) and size * self.radius > embedded.REACH:
            return self._try_stiff(node, size)
        begun = embedded.begin(self.rate, node.depth, node.rate, size)
        self._saw(begun.seen)
        end = Node(node.cycle + size, node.depth + size * begun.third, begun.third)
        foreseen = self._tried(node, end, begun.foreseen(size, self.radius), size, 4, EMBEDDED)
        if foreseen.ratio > HOPELESS and not self._is_rough():
            return replace(foreseen, share=2.0 / 3.0)
        depth, rate, difference, seen = embedded.complete(self.rate, node.depth, node.rate, size, begun)
        self._saw(seen)
        error = embedded.reported(difference, size * self.radius)
        return self._tried(node, Node(node.cycle + size, depth, rate), error, size, 4, EMBEDDED)

    def _try_stiff(self, node: Node, size: float) -> _Try:
        coefficients = rkc.stages_for(size * self.radius, self.damping)
        depth = rkc.step(self.rate, node.depth, node.rate, size, coefficients)
        rate = self.rate(depth)
        error = rkc.local_error(node.depth, depth, node.rate, rate, size)
        return self._tried(node, Node(node.cycle + size, depth, rate), error, size, 2, coefficients)

    def _tried(
        self, node: Node, end: Node, error: Array, size: float, order: int, by: rkc.Scheme | str
    ) -> _Try:
        largest = float(np.abs(error).max(initial=0.0))
        return _Try(end, error, largest / self._allowed(node, end), size, order, by)

    def _saw(self, radius: float) -> None:
        """Take what the stages of a step tell of the spectral radius, where nothing better is known."""
        if not self.looked and self.rate.noise <= self.heard and radius > self.spectrum.radius:
            self.spectrum = NOTHING_KNOWN._replace(radius=radius)

    def _allowed(self, node: Node, end: Node) -> float:
        worn = float((end.depth - node.depth).max(initial=0.0))
        reached = max(float(end.depth.max(initial=0.0)), self.scale)
        return SHARE_OF_TOLERANCE * self.tolerance * max(worn, SHARE_OF_DEPTH * reached)

    def _bounded(self, size: float, largest: float) -> float:
        reach = rkc.longest_reach(self.damping) / self.radius if self.radius > 0.0 else np.inf
        return float(min(size, largest, reach))

    def _accepted(self, tried: _Try, *, rejected: bool) -> None:
        ratio = max(tried.ratio, 1e-10)
        trend = min(1.0, (self.last_ratio / ratio) ** 0.1) if tried.order == self.last_order else 1.0
        factor = min(tried.fits(ratio) * trend, 1.0 if rejected else LARGEST_GROWTH)
        self.next_size = tried.size * factor
        self.last_ratio, self.last_order, self.age, self.most = ratio, tried.order, self.age + 1, np.inf

    def _step(self, node: Node, tried: _Try) -> Step:
        rates, by = (node.rate, tried.end.rate), tried.by if tried.share == 1.0 else None
        if tried.ratio <= 1.0 or tried.follows(node):
            return Step(node, tried.end, rates, tried.error, growth(node, tried.end), by)
        # Rates at the ends of a step that is lost on the way do not tell how errors grow, nor their signs.
        return Step(node, tried.end, rates, np.abs(tried.error), 1.0, by)

    def _look(self, node: Node, direction: Array, memory: Any = None) -> None:
        """Estimate the spectrum at a state; a noisy rate hides it, and the last estimate stays."""
        if self.rate.noise > self.heard:
            self.age = 0
            return
        direction = direction if direction.size == node.rate.size else random_direction(node.rate)
        found = spectrum(self.rate, node.depth, direction, amplitude=PROBE * self.scale)
        if not self.looked or found.radius <= STEEP * self.spectrum.radius or self._is_slope(node, found):
            self.spectrum = found
        if memory is not None:
            self.rate.recall(memory)
        self.age, self.looked, self.growth_known = 0, True, self.spectrum.is_real or not self.foreseeable

    def _is_slope(self, node: Node, found: Spectrum) -> bool:
        """Whether a steep rate is as steep over twice the way; over a jump it is half as steep."""
        twice = 2.0 * PROBE * self.scale
        again = spectrum(self.rate, node.depth, found.direction, amplitude=twice, iterations=1)
        return again.radius > SLOPE * found.radius

    def _look_for_growth(self, node: Node) -> None:
        """Measure the growth of waves at a state where the spectrum was looked at, and is complex."""
        if self.rate.noise > self.heard or not self.looked:
            return
        memory = self.rate.remember()
        found = growth_rate(self.rate, node.depth, self.spectrum.direction, amplitude=PROBE * self.scale)
        self.rate.recall(memory)
        self.wave_growth, self.growth_known = max(self.wave_growth, found), True
