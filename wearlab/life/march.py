"""Wear over cycles: from the first state to a limit, with snapshots on the way.

``dh/dN = r(h)``: every rate is a contact analysis, a steady response and a wear law (PHYSICS §8).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wearlab.life.adaptive import Adaptive, AdaptiveStepper
from wearlab.life.counted import CountedRate, Rate
from wearlab.life.euler import Euler, Fixed, SawTooth
from wearlab.life.jump import Jump, shift_by
from wearlab.life.keeping import Place, Told, place
from wearlab.life.limits import Limits, OutOfEvaluations, Snapshots, StopWear
from wearlab.life.step import Node, Step, crossing, depth_at

Array = NDArray[np.float64]
Method = Adaptive | Euler | Fixed

ELASTIC_SCALE = 1e-6
"""Default depth scale: well below the elastic deflection of a loaded tooth pair (about 5 µm) [m]."""
AIM = 1.1
"""How far past the expected crossing of a depth limit the last step aims."""
TREND = 0.5
"""Share of the trend of the rate over the last step that is expected to go on: wear evens out."""
MOST_TREND = 1.5
"""Largest factor by which the trend of the rate moves the expected crossing."""
LANDED = 1e-10
GIVEN = ("rate", "limits", "tolerance", "scale")
"""What a march and its stepper are given anew when they are taken up."""


class Stepper(Protocol):
    """What the march asks of a method."""

    rejected: int
    trying: float
    saw_tooth: bool

    def advance(self, node: Node, largest: float) -> tuple[list[Step], Jump | None]:
        """Return accepted steps from ``node``."""

    def shorten(self, size: float) -> None:
        """Take no longer step next."""


@dataclass(frozen=True)
class Life:
    """Wear over cycles.

    Parameters
    ----------
    cycle : (m,) cycles of the accepted states, 0 first, the end last [1]
    depth, rate : (m, n) wear depth [m] and wear rate [m per cycle] there
    error : (m,) estimated local error of the step that led there, largest over the nodes [m]
    accumulated_error : (m,) largest over the nodes of their signed sum, amplified where wear accelerates, and
        by as far as it may have shifted a jump; and the root of the squares of what scatters [m]
    snapshot_cycle : (k,) cycles of the snapshots reached, in order [1]
    snapshot_depth : (k, n) depths there [m]
    end_reason : "cycles", "depth", "no wear", "saw-tooth", "evaluation limit", "work limit", or why the
        gears stopped
    jumps : where the wear rate jumped to another branch
    saw_tooth : whether steps beyond the stability limit left their mark
    wave_growth : fastest growth of a wave of wear, where it is too fast to foresee its end; else 0 [1/cycle]
    hurried : whether steps were as long as the work left paid for, and not as their errors ask
    count_rate_evaluations, count_rejected : work done
    steps : the accepted steps, whole where the limit is met inside the last
    """

    cycle: Array
    depth: Array
    rate: Array
    error: Array
    accumulated_error: Array
    snapshot_cycle: Array
    snapshot_depth: Array
    end_reason: str
    jumps: tuple[Jump, ...]
    saw_tooth: bool
    wave_growth: float
    hurried: bool
    count_rate_evaluations: int
    count_rejected: int
    steps: tuple[Step, ...] = ()

    @property
    def error_estimate_depth(self) -> float:
        """Estimated error of the last depths, largest over the nodes [m]."""
        return float(self.accumulated_error[-1])

    @property
    def error_estimate_life(self) -> float:
        """Estimated error of the life: the depth error over the fastest wear at the end [1]."""
        fastest = float(self.rate[-1].max(initial=0.0))
        return self.error_estimate_depth / fastest if fastest > 0.0 else 0.0

    @property
    def worn_out(self) -> bool:
        """Whether it ended at its depth limit."""
        return self.end_reason == "depth"

    @property
    def count_steps(self) -> int:
        """Accepted steps."""
        return len(self.cycle) - 1

    def updates(self, only_snapshots: bool = False) -> tuple[Array, Array]:
        """Return the states to store: the first, the snapshots and the last; without snapshots all accepted.

        Parameters
        ----------
        only_snapshots : whether snapshots were asked for, though the life may have reached none

        Returns
        -------
        cycle : (u,) [1]
        depth : (u, n) [m]
        """
        if not len(self.snapshot_cycle) and not only_snapshots:
            return self.cycle, self.depth
        inner = (self.snapshot_cycle > 0.0) & (self.snapshot_cycle < self.cycle[-1])
        cycle = np.concatenate([self.cycle[:1], self.snapshot_cycle[inner], self.cycle[-1:]])
        depth = np.concatenate([self.depth[:1], self.snapshot_depth[inner], self.depth[-1:]])
        return cycle, depth


def evolve(
    rate: Rate,
    initial: ArrayLike,
    *,
    limits: Limits,
    method: Method | None = None,
    snapshots: Snapshots | None = None,
    tolerance: float = 1e-3,
    scale: float = ELASTIC_SCALE,
    most_evaluations: int = 100_000,
    most_work: float = np.inf,
    progress: Callable[[Node], None] | None = None,
) -> Life:
    """Return the wear over cycles from a first state to a limit.

    Parameters
    ----------
    rate : h (n,) [m] -> dh/dN (n,) [m per cycle], ≥ 0. It may raise StopWear(reason). A rate that depends on
        its past (an orbit carried over) offers ``remember()`` and ``recall(memory)``.
    initial : (n,) depth at cycle 0, ≥ 0 [m]
    limits : where to end; a depth limit is landed on exactly, its cycle is the life
    method : Adaptive (default), Euler or Fixed
    snapshots : states wanted on the way, read off the curve through the accepted states: they change nothing
    tolerance : relative error in depth and life (Adaptive) and in locating ends and jumps [1]
    scale : depth below which errors are no longer relative; also the scale of the stiffness probe [m]
    most_evaluations, most_work : bounds on the evaluations, and on their work where the rate counts it
    progress : called with every accepted state

    Returns
    -------
    Life

    Raises
    ------
    StopWear
        When the first state itself cannot run.
    ValueError
        For impossible limits, depths or rates.
    """
    limits = limits.checked()
    h0 = np.array(initial, float)
    if h0.ndim != 1 or not np.all(np.isfinite(h0)) or h0.min(initial=0.0) < 0.0:
        raise ValueError("initial wear depths must be one array of finite values that are not negative")
    counted = CountedRate(rate, most_evaluations, most_work)
    march = _March(counted, limits, tolerance, scale, Node(0.0, h0, counted(h0)))
    kept = place((h0, march.node.rate, limits, method, tolerance, scale), counted.shared)
    march.run(method or Adaptive(), progress, kept)
    return march.life(snapshots or Snapshots())


class _March:
    """The loop from state to state, and what it leaves behind."""

    def __init__(self, rate: CountedRate, limits: Limits, tolerance: float, scale: float, node: Node) -> None:
        self.rate, self.limits, self.tolerance, self.scale = rate, limits, tolerance, scale
        self.nodes, self.errors, self.accumulated = [node], [0.0], [0.0]
        self.total = np.zeros_like(node.depth)
        self.scatter, self.noise = 0.0, rate.noise
        self.curves: list[Step] = []
        self.jumps: list[Jump] = []
        self.reason = ""
        self.rejected, self.saw_tooth, self.wave_growth, self.hurried = 0, False, 0.0, False

    @property
    def node(self) -> Node:
        return self.nodes[-1]

    def run(self, method: Method, progress: Callable[[Node], None] | None, keep: Place | None) -> None:
        """March until there is a reason to end, from where an earlier process put it down."""
        self.reason = "depth" if self._reached(self.node) else ""
        stepper: Stepper | None = None
        followed: list[tuple[Node, Any]] = []
        if keep is not None and (kept := keep.kept) is not None:
            stepper, followed = self._taken_up(kept, method)
            self._show(progress, followed)
        while not self.reason:
            try:
                if stepper is None:
                    stepper = method.start(self.node, self.rate, self.tolerance, self.scale)
                self._advance(stepper)
            except SawTooth:
                self.reason = "saw-tooth"
            except OutOfEvaluations as out:
                self.reason = out.reason
            if progress is not None:
                progress(self.node)
            if keep is not None:
                followed.append((self.node, self.rate.remember()))
                told = Told(self.node.cycle, float(self.node.depth.max(initial=0.0)))
                keep.keep(told, partial(self._put_down, stepper, followed))
        if keep is not None:
            keep.settle(partial(self._put_down, stepper, followed))
        if stepper is not None:
            self.rejected, self.saw_tooth = stepper.rejected, stepper.saw_tooth
        if isinstance(stepper, AdaptiveStepper):
            self.wave_growth = 0.0 if stepper.foreseeable else stepper.wave_growth
            self.hurried = stepper.hurried

    def _put_down(self, stepper: Stepper | None, followed: list[tuple[Node, Any]]) -> dict[str, Any]:
        """Return all that the march depends on: of itself, of its stepper, of its rate."""
        own = {name: value for name, value in vars(self).items() if name not in GIVEN}
        steps = None if stepper is None else {k: v for k, v in vars(stepper).items() if k not in GIVEN}
        return {"march": own, "stepper": steps, "followed": followed, "rate": self.rate.put_down()}

    def _taken_up(
        self, kept: dict[str, Any], method: Method
    ) -> tuple[Stepper | None, list[tuple[Node, Any]]]:
        """Go on from what was put down; return its stepper and what was told along the way."""
        stepper = None
        if kept["stepper"] is not None:
            stepper = method.start(self.nodes[0], self.rate, self.tolerance, self.scale)
            vars(stepper).update(kept["stepper"])
        vars(self).update(kept["march"])
        self.rate.take_up(kept["rate"])
        return stepper, list(kept["followed"])

    def _show(self, progress: Callable[[Node], None] | None, followed: list[tuple[Node, Any]]) -> None:
        """Tell the states that an earlier process reached, with the memory that the rate had there."""
        now = self.rate.remember()
        for node, memory in followed:
            self.rate.recall(memory)
            if progress is not None:
                progress(node)
        self.rate.recall(now)

    def _advance(self, stepper: Stepper) -> None:
        largest = self._largest()
        if not np.isfinite(largest):
            self.reason = "no wear"
            return
        memory = self.rate.remember()
        try:
            steps, jump = stepper.advance(self.node, largest)
        except StopWear as stop:
            self.rate.recall(memory)
            if self._negligible(stepper.trying):
                self.reason = stop.reason
            stepper.shorten(0.5 * stepper.trying)
            return
        noise, self.noise = max(self.noise, self.rate.noise), self.rate.noise
        for step in steps:
            if not self.reason:
                doubt = self._doubt_of(step, memory) if jump is not None and step is steps[-1] else None
                self._keep(step, noise)
                if doubt is not None:
                    self._add(doubt)
        if jump is not None and jump.cycle <= self.node.cycle:
            self.jumps.append(jump)

    def _doubt_of(self, across: Step, memory: Any) -> Array:
        """Return what the error of the depth before a jump is worth by shifting it, (n,) ≥ 0 [m]."""
        beyond = self.rate.remember()
        try:
            shift = shift_by(self.rate, across, self.total, memory)
        except (StopWear, OutOfEvaluations):
            shift = across.size
        self.rate.recall(beyond)
        return np.asarray(shift * np.abs(across.end.rate - across.start.rate))

    def _add(self, doubt: Array) -> None:
        """Count a doubt of either sign into the error accumulated so far."""
        self.total = self.total + np.copysign(doubt, self.total)
        self.accumulated[-1] = self._accumulated()

    def _accumulated(self) -> float:
        """Return the error accumulated: what has a sign, and the scatter of independent steps [m]."""
        return float(np.abs(self.total).max(initial=0.0)) + self.scatter

    def _largest(self) -> float:
        """Cycles that the next step may take: to the cycle limit, or just past the depth limit."""
        node, limits = self.node, self.limits
        left = np.inf if limits.cycles is None else limits.cycles - node.cycle
        if limits.depth is None:
            return float(left)
        rate, missing = node.rate[limits.flank], limits.depth - node.depth[limits.flank]
        if limits.cycles is None and not node.rate.any():
            return np.inf
        due = np.divide(missing, rate, out=np.full_like(missing, np.inf), where=rate > 0.0)
        soonest = float(due.min(initial=np.inf))
        if not np.isfinite(soonest):
            return float(left)
        braked = float((due * self._braking(due)).min())
        return float(min(left, AIM * np.clip(braked, soonest / MOST_TREND, soonest * MOST_TREND)))

    def _braking(self, due: Array) -> Array:
        """Return by what the trend of the last step moves the cycles due at the present rate, (n_flank,) [1].

        ``g + q g²/2 = 1`` with q the change of the rate over those cycles, relative to the rate.
        """
        if not self.curves:
            return np.ones_like(due)
        step, flank = self.curves[-1], self.limits.flank
        trend = (step.end.rate - step.start.rate)[flank] / step.size
        wears = np.isfinite(due)
        q = np.zeros_like(due)
        q[wears] = TREND * trend[wears] * due[wears] / step.end.rate[flank][wears]
        return np.asarray(2.0 / (1.0 + np.sqrt(np.maximum(0.0, 1.0 + 2.0 * q))))

    def _negligible(self, size: float) -> bool:
        """Whether a step is too short to matter for the life or the depth."""
        worn = size * float(self.node.rate.max(initial=0.0))
        reached = max(float(self.node.depth.max(initial=0.0)), self.scale)
        return size <= self.tolerance * self.node.cycle or worn <= self.tolerance * reached

    def _reached(self, node: Node) -> bool:
        depth = self.limits.depth
        return depth is not None and bool(node.depth[self.limits.flank].max() >= depth * (1.0 - LANDED))

    def _keep(self, step: Step, noise: float) -> None:
        """Record a step, or its part up to the limit; ``noise``: standard error of its rates."""
        self.curves.append(step)
        end = step.end
        if self._reached(end):
            end, self.reason = self._landed(step), "depth"
        elif self.limits.cycles is not None and end.cycle >= self.limits.cycles * (1.0 - 1e-14):
            end, self.reason = end._replace(cycle=self.limits.cycles), "cycles"
        self.nodes.append(end)
        self.total = self.total * step.growth + step.error
        self.errors.append(float(np.abs(step.error).max(initial=0.0)))
        self.scatter = float(np.hypot(self.scatter * step.growth, np.hypot(step.scatter, step.size * noise)))
        self.accumulated.append(self._accumulated())

    def _landed(self, step: Step) -> Node:
        """Return the state where the depth limit is met, exactly."""
        limit, flank = float(self.limits.depth or 0.0), self.limits.flank
        cycle = crossing(step, limit, flank)
        depth = depth_at(step, cycle).copy()
        on_flank = np.minimum(depth[flank], limit)
        on_flank[np.argmax(on_flank)] = limit
        depth[flank] = on_flank
        try:
            rate = self.rate(depth)
        except (StopWear, OutOfEvaluations):
            rate = step.end.rate
        return Node(cycle, depth, rate)

    def life(self, snapshots: Snapshots) -> Life:
        """Return the record, with the snapshots read off the curves."""
        taken = sorted(self._snapshots(snapshots), key=lambda pair: pair[0])
        n = self.node.depth.size
        return Life(
            cycle=np.array([node.cycle for node in self.nodes]),
            depth=np.stack([node.depth for node in self.nodes]),
            rate=np.stack([node.rate for node in self.nodes]),
            error=np.array(self.errors),
            accumulated_error=np.array(self.accumulated),
            snapshot_cycle=np.array([cycle for cycle, _ in taken]),
            snapshot_depth=np.array([depth for _, depth in taken]).reshape(-1, n),
            end_reason=self.reason,
            jumps=tuple(self.jumps),
            saw_tooth=self.saw_tooth,
            wave_growth=self.wave_growth,
            hurried=self.hurried,
            count_rate_evaluations=self.rate.count,
            count_rejected=self.rejected,
            steps=tuple(self.curves),
        )

    def _snapshots(self, wanted: Snapshots) -> list[tuple[float, Array]]:
        cycles = [float(cycle) for cycle in wanted.cycles if 0.0 <= cycle <= self.node.cycle]
        found = [self._cycle_of(depth, wanted) for depth in wanted.depths]
        cycles += [cycle for cycle in found if cycle is not None]
        return [(cycle, self._depth_at(cycle)) for cycle in cycles]

    def _cycle_of(self, depth: float, wanted: Snapshots) -> float | None:
        if self.nodes[0].depth[wanted.flank].max() >= depth:
            return 0.0
        for step in self.curves:
            if step.end.depth[wanted.flank].max() >= depth:
                cycle = crossing(step, depth, wanted.flank)
                return cycle if cycle <= self.node.cycle else None
        return None

    def _depth_at(self, cycle: float) -> Array:
        for step, end in zip(self.curves, self.nodes[1:], strict=True):
            if cycle == end.cycle:
                return end.depth
            if cycle < end.cycle:
                return depth_at(step, cycle)
        return self.nodes[0].depth if cycle == 0.0 else self.node.depth
