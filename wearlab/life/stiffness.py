"""How stiff a wear rate is: the largest eigenvalue of ∂r/∂h, as a life knows it.

Stages of a step tell a lower bound of the spectral radius ρ of ∂r/∂h. As long as ρ
times the whole way left is small by it, no step can be stiff and no wave can grow much,
and nothing else is asked. A longer way, or a step that fails its test, is worth a power
iteration. A noisy rate hides its spectrum: what was known stays.

**Growing waves.** Under the load of the moment a flank may corrugate: below the natural
frequency of a mesh the force is largest where the flank is worn most, and waves of wear
grow until teeth part. Errors grow with them, so that no step is short enough to tell
where a wave will be many e-foldings later; what the waves do on the average is all that
can be known.

Steps through rough stretches: what the motion adds to the static rate is held, the
static one followed.

Where teeth part and no motion repeats, a rate is dear, noisy, and as stiff as any. The
rate under the static load r₀ is cheap and smooth beside it, and nearly as stiff, for
the same contact lets wear even out:

    ``h' = max{0, r₀(h) + d}``,  ``d = r − r₀`` at the start,

by RKC2 with the stages that r₀ asks for; then once more with the straight line from d
to what it is at that end. So a step takes one r whatever its length, is of second
order, and the noise of one step is levelled in the next. What the second pass moves, a
first-order error, is reported: a drift adds up in it with its sign. Noise of d does
not: it moves each pass by 1/√2 of what it does to the wear, for every rate ends one
step and begins another, and adds up by its squares, node by node.

A step wears a small share of the depth, less where its second pass moves much: places
that are struck move on as they wear, and a step that is too long for that digs holes.
Or it wears as much more as the work left pays for. A life whose work runs ahead of its
way goes on by such steps to its end, less exactly than asked and saying so, and does
not end by the bound on its work.
"""

from math import expm1, inf, isfinite, log1p
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.life import runge_kutta
from wearlab.life.limits import CountedRate, Rate
from wearlab.life.step import Node, Step

RADIUS_SAFETY = 1.15
"""Margin on the spectral radius, which a power iteration tells from below."""
KRYLOV = 16
FOUND = 0.3
"""Residual of an approximate eigenvalue, over the spectral radius seen, up to which it
counts as found."""


class Spectrum(NamedTuple):
    """The dominant eigenvalue of ∂r/∂h.

    Parameters
    ----------
    radius : ρ = |λ|max [1/cycle]
    alignment : −v·Jv/(|v||Jv|): 1 for a real decaying λ, less off the axis [1]
    direction : (n,) its vector, for the next estimate
    """

    radius: float
    alignment: float
    direction: Array

    @property
    def is_real(self) -> bool:
        """Whether the fastest part simply decays (as under the static load)."""
        return self.alignment > 0.96


def spectrum(
    rate: Rate,
    h: Array,
    start: Array,
    *,
    amplitude: float,
    tolerance: float = 0.05,
    iterations: int = 15,
) -> Spectrum:
    """Return the dominant eigenvalue by power iteration with differences of the rate.

    ``J v ≈ (r(h + δ(1 + v)) − r(h + δ))/δ`` with max|v| = 1: the probe never refills a
    flank.

    Parameters
    ----------
    rate : r(h)
    h : (n,) depth [m]
    start : (n,) first direction: the last spectrum's, or random
    amplitude : δ, small beside the elastic deflection and large beside the noise of r
        [m]
    tolerance : relative change of ρ at which to stop
    iterations : bound on the evaluations
    """
    base = rate(h + amplitude)
    v = start
    radius = 0.0
    for _ in range(iterations):
        largest = float(np.abs(v).max())
        if largest == 0.0:
            return Spectrum(0.0, 1.0, start)
        v = v / largest
        Jv = (rate(h + amplitude * (1.0 + v)) - base) / amplitude
        length = float(np.linalg.norm(Jv))
        previous = radius
        radius = length / float(np.linalg.norm(v))
        if length == 0.0:
            return Spectrum(0.0, 1.0, v)
        alignment = -float(v @ Jv) / (length * float(np.linalg.norm(v)))
        v = Jv
        if abs(radius - previous) <= tolerance * radius:
            break
    return Spectrum(radius, alignment, v)


def growth_rate(
    rate: Rate, h: Array, start: Array, *, amplitude: float, iterations: int = KRYLOV
) -> float:
    """Return the largest growth rate among the waves of a profile, max Re λ, ≥ 0.

    Arnoldi's method with differences of the rate, as in :func:`spectrum`; of its values
    only those count whose residual is small, because those of a non-normal matrix may
    lie far from any eigenvalue.

    Parameters
    ----------
    rate, h, start, amplitude : as for :func:`spectrum`
    iterations : evaluations, the size of the Krylov space
    """
    length = float(np.linalg.norm(start))
    if length == 0.0:
        return 0.0
    base = rate(h + amplitude)
    basis = [start / length]
    upper = np.zeros((iterations + 1, iterations))
    for k in range(iterations):
        v = basis[-1]
        largest = float(np.abs(v).max())
        w = (rate(h + amplitude * (1.0 + v / largest)) - base) * (largest / amplitude)
        for _ in range(2):  # twice is enough for orthogonality to rounding
            for i, vector in enumerate(basis):
                share = float(vector @ w)
                upper[i, k] += share
                w = w - share * vector
        upper[k + 1, k] = length = float(np.linalg.norm(w))
        if length <= 1e-10 * float(np.abs(upper).max()):
            iterations = k + 1
            break
        basis.append(w / length)
    values, vectors = np.linalg.eig(upper[:iterations, :iterations])
    residual = upper[iterations, iterations - 1] * np.abs(vectors[-1])
    return max(
        0.0, float(values[residual <= FOUND * np.abs(values)].real.max(initial=0.0))
    )


def random_direction(r: Array) -> Array:
    """Return random signs weighted by the rate, 0 where nothing wears, (n,).

    Parameters
    ----------
    r : (n,) wear rate [m per cycle]
    """
    signs = np.random.default_rng(20160501).choice([-1.0, 1.0], size=r.shape)
    return np.asarray(signs * (np.abs(r) + 1e-3 * float(np.abs(r).max(initial=0.0))))


NOTHING_KNOWN = Spectrum(0.0, 1.0, np.empty(0))
"""Until the first look."""


class KnownSpectrum:
    """The spectrum of ∂r/∂h as it was last seen.

    ``age``: steps since; ``looked``: whether more than stages of steps told it;
    ``wave_growth``: the fastest growth of a wave of wear that was seen [1/cycle];
    ``foreseeable``: whether errors made at the start stay small to the end.

    Parameters
    ----------
    scale : depth scale of the life [m]
    heard : noise above which a rate hides its spectrum [m per cycle]
    """

    def __init__(self, scale: float, heard: float) -> None:
        self.amplitude = 1e-3 * scale
        self.heard = heard
        self.spectrum = NOTHING_KNOWN
        self.age = 0
        self.wave_growth = 0.0
        self.looked = False
        self.growth_known = False
        self.foreseeable = True

    @property
    def radius(self) -> float:
        """Spectral radius with a margin [1/cycle]."""
        return RADIUS_SAFETY * self.spectrum.radius

    @property
    def damping(self) -> float:
        """RKC damping that suits the spectrum."""
        return runge_kutta.SHARP if self.spectrum.is_real else runge_kutta.WIDE

    @property
    def reach(self) -> float:
        """The longest step that any method takes [cycles]."""
        longest = runge_kutta.scheme(runge_kutta.MAX_STAGES, self.damping).reach
        return longest / self.radius if self.radius > 0.0 else np.inf

    def hear(self, rate: CountedRate, radius: float) -> None:
        """Take the spectral radius from stages of a step where none is known better.

        Parameters
        ----------
        rate : the wear rate
        radius : spectral radius that the stages show [1/cycle]
        """
        if (
            not self.looked
            and rate.noise <= self.heard
            and radius > self.spectrum.radius
        ):
            self.spectrum = NOTHING_KNOWN._replace(radius=radius)

    def look(self, rate: CountedRate, node: Node, memory: Any) -> None:
        """Estimate the spectrum at a state, and put the rate's memory back.

        Parameters
        ----------
        rate : the wear rate
        node : the state
        memory : of the rate there
        """
        if rate.noise > self.heard:
            self.age = 0
            return
        direction = self.spectrum.direction
        direction = (
            direction
            if direction.size == node.rate.size
            else random_direction(node.rate)
        )
        self.spectrum = spectrum(rate, node.depth, direction, amplitude=self.amplitude)
        rate.recall(memory)
        self.age = 0
        self.looked = True
        self.growth_known = self.spectrum.is_real or not self.foreseeable

    def foresee(
        self, rate: CountedRate, node: Node, left: float, tolerance: float
    ) -> None:
        """Find out whether an early error stays small up to the end of the life."""
        if not self.foreseeable:
            return
        whole = node.cycle + (left if np.isfinite(left) else 0.0)
        max_exponent = -np.log(tolerance)
        is_known = self.looked and rate.noise <= self.heard
        if (
            is_known
            and self.spectrum.radius * whole > max_exponent
            and not self.growth_known
        ):
            memory = rate.remember()
            growth = growth_rate(
                rate, node.depth, self.spectrum.direction, amplitude=self.amplitude
            )
            rate.recall(memory)
            self.wave_growth = max(self.wave_growth, growth)
            self.growth_known = True
        self.foreseeable = bool(self.wave_growth * whole <= max_exponent)


HEAD_START = 0.15
"""Share of the work that a life may be ahead of its way: the first micrometres ask for
short steps."""
PLANNED = 0.7
"""Share of the work left with which steps are planned; the rest is for rates that get
dearer."""
ROUGH_SHARES = 0.002, 0.02
"""Least and largest wear of a step over the depth reached."""
FIRST_ROUGH_SHARE = 0.005
"""Wear of the first step over the depth reached."""
MAX_HURRIED = 0.5
"""Largest wear of a step over the depth reached where the work left pays for no shorter
ones."""
MOVED = 0.2
"""Error of a step over its wear for which it is as long as it should be."""
CHANGE_OF_SHARE = 1.3
"""Largest factor from one share to the next, and the other way."""


def held_step(
    rate: Rate, still: Rate, node: Node, size: float, direction: Array, amplitude: float
) -> tuple[Step, Spectrum]:
    """Return a step of ``size`` cycles and the spectrum of the static rate.

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
    static_spectrum = spectrum(still, node.depth, direction, amplitude=amplitude)
    scheme = runge_kutta.stages_for(size * RADIUS_SAFETY * static_spectrum.radius)
    added = node.rate - first

    def reached(added_there: Array) -> Array:
        """Follow the static rate plus a straight line from the start to the end."""
        change = added_there - added

        def following(at: Array) -> Array:
            depth = at[:-1]
            x = at[-1]
            return np.append(
                np.maximum(0.0, still(depth) + added + x * change), 1.0 / size
            )

        begin = np.append(node.depth, 0.0)
        slope = np.append(node.rate, 1.0 / size)
        return runge_kutta.chebyshev_step(following, begin, slope, size, scheme)[:-1]

    held = reached(added)
    added_there = rate(held) - still(held)
    depth = reached(added_there)
    end = Node(node.cycle + size, depth, np.maximum(0.0, still(depth) + added_there))
    error = depth - held
    secant = (depth - node.depth) / size
    step = Step(node, end, (secant, secant), error, 1.0, holds=True)
    return step, static_spectrum


class Work:
    """Where a life stands on its way and in its work, and the steps that this pays for.

    Parameters
    ----------
    rate : the wear rate
    node : the first state
    scale : depth scale of the life [m]
    """

    def __init__(self, rate: CountedRate, node: Node, scale: float) -> None:
        self.scale = scale
        self.first_depth = node.deepest
        self.before = rate.count, rate.work
        self.dear = 1.0
        self.late = False
        self.share = FIRST_ROUGH_SHARE

    def is_late(self, rate: CountedRate, node: Node, left: float) -> bool:
        """Whether the work is, or was, too far ahead of the way.

        To be asked once a step.

        Parameters
        ----------
        rate : the wear rate
        node : where the life is
        left : way to the limit [cycles]
        """
        # Where orbits come and go one rate may cost a thousand times another: the
        # dearer of all and the last.
        last = (rate.work - self.before[1]) / max(1, rate.count - self.before[0])
        self.dear = max(1.0, last, (rate.work - rate.first_work) / max(1, rate.count))
        self.before = rate.count, rate.work
        way = node.cycle / (node.cycle + left) if isfinite(left) else 1.0
        work_done = (rate.work - rate.first_work) / (rate.max_work - rate.first_work)
        self.late = (
            self.late
            or max(work_done, rate.count / rate.max_evaluations)
            > HEAD_START + (1.0 - HEAD_START) * way
        )
        return self.late

    def affordable(
        self, rate: CountedRate, node: Node, left: float
    ) -> tuple[float, bool]:
        """Return the step of one rate [cycles], and whether the work left forces it."""
        reached = node.deepest
        fastest = node.fastest
        way = left * fastest if isfinite(left) else 0.0
        depth = max(reached, self.scale)
        rates = min(
            (rate.max_work - rate.work) / self.dear,
            float(rate.max_evaluations - rate.count),
        )
        paid = share_of_depth(way, depth, PLANNED * max(0.0, rates))
        # The fastest place is another one every time: the deepest gets deeper at a
        # third of its rate.
        deepens = (
            (reached - self.first_depth) / node.cycle
            if reached > self.first_depth
            else fastest
        )
        worn = float(np.clip(paid, self.share, MAX_HURRIED)) * depth
        return worn / deepens if deepens > 0.0 else inf, paid > self.share

    def learn(self, step: Step) -> None:
        """Take shorter steps where the second pass of one moved much, else longer.

        Parameters
        ----------
        step : the last one that held what the motion adds
        """
        worn = float((step.end.depth - step.start.depth).max(initial=0.0))
        error = float(np.abs(step.error).max(initial=0.0))
        wanted = MOVED * worn / error if error > 0.0 else inf
        factor = np.clip(wanted, 1.0 / CHANGE_OF_SHARE, CHANGE_OF_SHARE)
        self.share = float(np.clip(self.share * factor, *ROUGH_SHARES))


def cycles_of_rough_step(node: Node, scale: float) -> float:
    """Return the cycles of the longest rough step of an unhurried life.

    It wears the largest of `ROUGH_SHARES` of the depth, at least of the scale.

    Parameters
    ----------
    node : the state
    scale : depth scale of the life [m]
    """
    return (
        ROUGH_SHARES[1] * max(node.deepest, scale) / node.fastest
        if node.fastest > 0.0
        else inf
    )


def share_of_depth(wear: float, depth: float, steps: float) -> float:
    """Return the share of the depth by which each of so many steps wears.

    Parameters
    ----------
    wear : w, of the way left [m]
    depth : h, reached [m]
    steps : n, at least one
    """
    return expm1(log1p(wear / depth) / max(steps, 1.0)) if depth > 0.0 else inf
