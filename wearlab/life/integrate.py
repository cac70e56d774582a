"""Wear over cycles: from the first state to a limit, with snapshots on the way.

``dh/dN = r(h)``: every rate is a contact analysis, a steady response and a wear law
(PHYSICS §8).

A life as it was found: accepted states, snapshots, how it ended, and its error so far.
"""

from bisect import bisect_left
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.life import adaptive, checkpoint
from wearlab.life.limits import (
    WORN_OUT,
    CountedRate,
    Limits,
    OutOfEvaluations,
    Snapshots,
    StopWear,
)
from wearlab.life.step import (
    Jump,
    Method,
    Node,
    SawTooth,
    Step,
    Stepper,
    crossing,
    depth_at,
)

Progress = Callable[[Node], None] | None
"""Called with every accepted state."""

ELASTIC_SCALE = 1e-6
"""Default depth scale: well below the elastic deflection of a loaded tooth pair (about
5 µm) [m]."""
AIM = 1.1
"""How far past the expected crossing of a depth limit the last step aims."""
TREND = 0.5
"""Share of the trend of the rate over the last step that is expected to go on: wear
evens out."""
MAX_TREND = 1.5
"""Largest factor by which the trend of the rate moves the expected crossing."""
STORED_SHARE = 0.02
"""Wear between two stored states of a rough stretch, over the depth reached, where no
snapshots are asked for: its steps may be ten times as short [1]."""
NEARLY, LAST_WORK = 0.98, 0.15
"""Share of its depth limit from which a life that is out of work gets some more, and
how much of all of it: steps through noise near their end before they reach it."""
GIVEN = ("rate", "limits", "tolerance", "scale", "stepper")
"""What a life and its stepper are given anew when they are taken up."""


class Life(NamedTuple):
    """Wear over cycles.

    Parameters
    ----------
    cycle : (m,) cycles of the accepted states, 0 first, the end last [1]
    depth, rate : (m, n) wear depth [m] and wear rate [m per cycle] there
    accumulated_error : (m,) largest over the nodes of the signed sum of the errors of
        all steps so far, amplified where wear accelerates, and by as far as it may have
        shifted a jump; and, in squares, of what scatters [m]
    depth_error : (n,) estimated error of the last depth with its sign, less what
        scatters [m]
    scatter : (n,) what scatters of that error [m]
    snapshot_cycle : (k,) cycles of the snapshots reached, in order [1]
    snapshot_depth : (k, n) depths there [m]
    end_reason : "cycles", "depth", "no wear", "saw-tooth", "evaluation limit", "work
        limit", or why the gears stopped
    jumps : where the wear rate jumped to another branch
    saw_tooth : whether steps beyond the stability limit left their mark
    wave_growth : fastest growth of a wave of wear, where it is too fast to foresee its
        end; else 0 [1/cycle]
    hurried : whether steps were as long as the work left paid for, and not as their
        errors ask
    count_rate_evaluations, count_rejected : work done
    steps : the accepted steps, whole where the limit is met inside the last
    end_detail : why the gears stopped in a sentence with its numbers, "" without
    """

    cycle: Array
    depth: Array
    rate: Array
    accumulated_error: Array
    depth_error: Array
    scatter: Array
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
    end_detail: str = ""

    @property
    def error_estimate_life(self) -> float:
        """Estimated error of the life: depth error over the fastest wear [1]."""
        fastest = float(self.rate[-1].max(initial=0.0))
        return float(self.accumulated_error[-1]) / fastest if fastest > 0.0 else 0.0

    @property
    def worn_out(self) -> bool:
        """Whether it ended at its depth limit."""
        return self.end_reason == WORN_OUT

    @property
    def count_steps(self) -> int:
        """Accepted steps."""
        return len(self.cycle) - 1

    def updates(self, only_snapshots: bool = False) -> tuple[Array, Array]:
        """Return the states to store: the first, the snapshots and the last.

        Without snapshots all accepted, in rough stretches `STORED_SHARE` of the depth
        apart.

        Parameters
        ----------
        only_snapshots : whether snapshots were asked for, though the life may have
            reached none

        Returns
        -------
        cycle : (u,) [1]
        depth : (u, n) [m]
        """
        if not len(self.snapshot_cycle) and not only_snapshots:
            spread = self._spread_out()
            return self.cycle[spread], self.depth[spread]
        inner = (self.snapshot_cycle > 0.0) & (self.snapshot_cycle < self.cycle[-1])
        cycle = np.concatenate(
            [self.cycle[:1], self.snapshot_cycle[inner], self.cycle[-1:]]
        )
        return cycle, np.concatenate(
            [self.depth[:1], self.snapshot_depth[inner], self.depth[-1:]]
        )

    def _spread_out(self) -> list[int]:
        """Return the numbers of accepted states, fewer where steps are short and rough.

        A state between two rough steps is left out where less than `STORED_SHARE` of
        its depth has worn since the last one that is not.
        """
        last = len(self.cycle) - 1
        kept = [0]
        for number in range(1, last):
            before, after = self.steps[number - 1 : number + 1]
            is_rough = before.holds and after.holds
            worn = float((self.depth[number] - self.depth[kept[-1]]).max())
            is_close = worn < STORED_SHARE * float(self.depth[number].max())
            if not (is_rough and is_close):
                kept.append(number)
        return [*kept, last] if last > 0 else kept


def read_off(
    snapshots: Snapshots, nodes: list[Node], curves: list[Step]
) -> tuple[Array, Array]:
    """Return the snapshots that a life reached, read off the curve of its states.

    Parameters
    ----------
    snapshots : the snapshots asked for
    nodes : the accepted states
    curves : the steps between them, the last one whole where a limit is met inside it

    Returns
    -------
    cycle : (k,) [1]
    depth : (k, n) [m]
    """
    cycles = list(snapshots.cycles)
    flank = snapshots.flank
    for depth in snapshots.depths:
        end = bisect_left(nodes, depth, key=lambda node: node.depth[flank].max())
        if end < len(nodes):
            cycles.append(crossing(curves[end - 1], depth, flank) if end else 0.0)
    cycles = sorted(float(cycle) for cycle in cycles if 0.0 <= cycle <= nodes[-1].cycle)
    depths = np.empty((len(cycles), nodes[0].depth.size))
    for row, cycle in zip(depths, cycles, strict=True):
        end = bisect_left(nodes, cycle, key=lambda node: node.cycle)
        row[:] = (
            nodes[end].depth
            if cycle == nodes[end].cycle
            else depth_at(curves[end - 1], cycle)
        )
    return np.array(cycles), depths


class AccumulatedError:
    """The error of the depth, step after step.

    ``total``: (n,) what has a sign, added up and amplified [m]; ``scatter``: (n,) what
    has another sign in every step, the root of its squares [m]; ``largest``: of every
    state, the error so far [m].

    Parameters
    ----------
    size : entries of the depth
    noise : standard error of the first rate [m per cycle]
    """

    def __init__(self, size: int, noise: float) -> None:
        self.total = np.zeros(size)
        self.scatter = np.zeros(size)
        self.noise = noise
        self.largest = [0.0]

    def add(self, step: Step, noise: float) -> None:
        """Count a step at whose end the rate has this standard error [m per cycle]."""
        scatter = step.scatter(max(self.noise, noise))
        self.noise = noise
        self.total = self.total * step.growth + step.error
        self.scatter = np.hypot(self.scatter * step.growth, scatter)
        self.largest.append(self._now())

    def doubt(self, doubt: Array) -> None:
        """Count a doubt of either sign in the last state, (n,) ≥ 0 [m]."""
        self.total = self.total + np.copysign(doubt, self.total)
        self.largest[-1] = self._now()

    def _now(self) -> float:
        return float(np.hypot(self.total, self.scatter).max(initial=0.0))


def integrate(
    rate: Callable[[Array], Array],
    initial: ArrayLike,
    *,
    limits: Limits,
    method: Method | None = None,
    snapshots: Snapshots | None = None,
    tolerance: float = 1e-3,
    scale: float = ELASTIC_SCALE,
    max_evaluations: int = 100_000,
    max_work: float = np.inf,
    progress: Progress = None,
) -> Life:
    """Return the wear over cycles from a first state to a limit.

    Parameters
    ----------
    rate : h (n,) [m] -> dh/dN (n,) [m per cycle], ≥ 0. It may raise StopWear(reason). A
        rate that depends on its past (an orbit carried over) offers ``remember()`` and
        ``recall(memory)``.
    initial : (n,) depth at cycle 0, ≥ 0 [m]
    limits : where to end; a depth limit is landed on exactly, its cycle is the life
    method : Adaptive (default), Euler or Fixed
    snapshots : states wanted on the way, read off the curve through the accepted
        states: they change nothing
    tolerance : relative error in depth and life (Adaptive) and in locating ends and
        jumps [1]
    scale : depth below which errors are no longer relative; also the scale of the
        stiffness probe [m]
    max_evaluations, max_work : bounds on the evaluations, and on their work where the
        rate counts it
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
        raise ValueError(
            "initial wear depths must be one array of finite values that are not "
            "negative"
        )
    counted = CountedRate(rate, max_evaluations, max_work)
    life = _Integration(counted, limits, tolerance, scale, Node(0.0, h0, counted(h0)))
    place = checkpoint.checkpoint(
        (h0, life.node.rate, limits, method, tolerance, scale), counted.shared
    )
    life.run(method or adaptive.Adaptive(), progress, place)
    return life.recorded(snapshots or Snapshots())


class _Integration:
    """The loop from state to state, and what it leaves behind."""

    def __init__(
        self,
        rate: CountedRate,
        limits: Limits,
        tolerance: float,
        scale: float,
        node: Node,
    ) -> None:
        self.rate = rate
        self.limits = limits
        self.tolerance = tolerance
        self.scale = scale
        self.nodes = [node]
        self.error = AccumulatedError(node.depth.size, rate.noise)
        self.curves: list[Step] = []
        self.jumps: list[Jump] = []
        self.reason = ""
        self.detail = ""
        self.finishing = False
        self.stepper: Stepper | None = None

    @property
    def node(self) -> Node:
        return self.nodes[-1]

    def run(
        self, method: Method, progress: Progress, keep: checkpoint.Checkpoint | None
    ) -> None:
        """Go on until there is a reason to end, from where a process before stopped."""
        self.reason = self.limits.reached(*self.node[:2])
        followed: list[tuple[Node, Any]] = []
        if keep is not None and self._has_shape_of_state(stored := keep.kept):
            followed = self._restored(stored, method, progress)
        while not self.reason:
            try:
                if self.stepper is None:
                    self.stepper = method.start(
                        self.node, self.rate, self.tolerance, self.scale
                    )
                self._advance(self.stepper)
            except SawTooth:
                self.reason = "saw-tooth"
            except OutOfEvaluations as out:
                nearly = self.limits._replace(
                    depth=self.limits.depth and NEARLY * self.limits.depth
                )
                if self.finishing or nearly.reached(*self.node[:2]) != WORN_OUT:
                    self.reason = out.reason
                else:  # nearly at its limit: it gets some more work, once
                    self.finishing = True
                    self.rate.grant(LAST_WORK)
            if progress is not None:
                progress(self.node)
            if keep is not None:
                followed.append((self.node, self.rate.remember()))
                reached = checkpoint.Reached(self.node.cycle, self.node.deepest)
                keep.keep(reached, partial(self._state, followed))
        if keep is not None:
            keep.settle(partial(self._state, followed))

    def _state(self, followed: list[tuple[Node, Any]]) -> dict[str, Any]:
        """Return all that the life depends on: of itself, its stepper and its rate."""
        fields = {
            name: value for name, value in vars(self).items() if name not in GIVEN
        }
        steps = self.stepper and {
            k: v for k, v in vars(self.stepper).items() if k not in GIVEN
        }
        return {
            "integration": fields,
            "stepper": steps,
            "followed": followed,
            "rate": self.rate.save_state(),
        }

    def _has_shape_of_state(self, stored: Any) -> bool:
        """Whether what was kept has the shape of what `_state` returns."""
        if not isinstance(stored, dict) or stored.keys() != {
            "integration",
            "stepper",
            "followed",
            "rate",
        }:
            return False
        fields = stored["integration"]
        steps = stored["stepper"]
        whole = isinstance(fields, dict) and fields.keys() == vars(self).keys() - set(
            GIVEN
        )
        return whole and (steps is None or isinstance(steps, dict))

    def _restored(
        self, stored: dict[str, Any], method: Method, progress: Progress
    ) -> list[tuple[Node, Any]]:
        """Go on from a stored state.

        Tell the states reached, with the memory that the rate had there.
        """
        if stored["stepper"] is not None:
            self.stepper = method.start(
                self.nodes[0], self.rate, self.tolerance, self.scale
            )
            vars(self.stepper).update(stored["stepper"])
        vars(self).update(stored["integration"])
        self.rate.restore(stored["rate"])
        if self.finishing:
            self.rate.grant(LAST_WORK)
        last_memory = self.rate.remember()
        followed = list(stored["followed"])
        for node, memory in followed:
            self.rate.recall(memory)
            if progress is not None:
                progress(node)
        self.rate.recall(last_memory)
        return followed

    def _advance(self, stepper: Stepper) -> None:
        largest = longest_step(
            self.node, self.limits, self.curves[-1] if self.curves else None
        )
        if not np.isfinite(largest):
            self.reason = "no wear"
            return
        memory = self.rate.remember()
        try:
            step, jump = stepper.advance(self.node, largest)
        except StopWear as stop:
            self.rate.recall(memory)
            size = stepper.trying
            deep = max(self.node.deepest, self.scale)
            # too short to matter for the life or the depth
            if (
                size <= self.tolerance * self.node.cycle
                or size * self.node.fastest <= self.tolerance * deep
            ):
                self.reason = stop.reason
                self.detail = stop.detail
            stepper.shorten(0.5 * size)
            return
        except OutOfEvaluations:
            self.rate.recall(memory)
            raise
        noise = self.rate.noise
        last_error = float(np.abs(self.error.total).max(initial=0.0))
        self.nodes.append(self._kept(step))
        self.rate.accept(self.node.depth)
        self.curves.append(step)
        self.error.add(step, noise)
        if jump is not None and jump.cycle <= self.node.cycle:
            self.jumps.append(jump)
            fastest = float(jump.rate_before.max(initial=0.0))
            if (
                fastest > 0.0
            ):  # by as much as the depth may be off, the jump may be shifted
                self.error.doubt(
                    last_error / fastest * np.abs(jump.rate_after - jump.rate_before)
                )

    def _kept(self, step: Step) -> Node:
        """Return the end of a step, or where it meets a limit, exactly."""
        cycles, limit, flank = self.limits
        self.reason = self.limits.reached(*step.end[:2])
        if self.reason != WORN_OUT or limit is None:
            return (
                step.end._replace(cycle=cycles)
                if self.reason and cycles is not None
                else step.end
            )
        cycle = crossing(step, limit, flank)
        depth = depth_at(step, cycle).copy()
        on_flank = np.minimum(depth[flank], limit)
        on_flank[np.argmax(on_flank)] = limit
        depth[flank] = on_flank
        rate = step.end.rate
        with suppress(StopWear, OutOfEvaluations):
            rate = self.rate(depth)
        return Node(cycle, depth, rate)

    def recorded(self, snapshots: Snapshots) -> Life:
        """Return the record, with the snapshots read off the curves."""
        cycle, depth = read_off(snapshots, self.nodes, self.curves)
        # without a step, at its limit from the beginning
        stepper = Stepper if self.stepper is None else self.stepper
        return Life(
            cycle=np.array([node.cycle for node in self.nodes]),
            depth=np.stack([node.depth for node in self.nodes]),
            rate=np.stack([node.rate for node in self.nodes]),
            accumulated_error=np.array(self.error.largest),
            depth_error=self.error.total,
            scatter=self.error.scatter,
            snapshot_cycle=cycle,
            snapshot_depth=depth,
            end_reason=self.reason,
            jumps=tuple(self.jumps),
            saw_tooth=stepper.saw_tooth,
            wave_growth=stepper.wave_growth,
            hurried=stepper.hurried,
            count_rate_evaluations=self.rate.count,
            count_rejected=stepper.rejected,
            steps=tuple(self.curves),
            end_detail=self.detail,
        )


def longest_step(node: Node, limits: Limits, last: Step | None) -> float:
    """Return the cycles that the next step may take, inf where no limit is near.

    Parameters
    ----------
    node : where the life is
    limits : where it ends
    last : the last step, whose trend is expected to go on; None: no step was made
    """
    left = np.inf if limits.cycles is None else limits.cycles - node.cycle
    if limits.depth is None:
        return float(left)
    rate = node.rate[limits.flank]
    missing = limits.depth - node.depth[limits.flank]
    if limits.cycles is None and not node.rate.any():
        return np.inf
    due = np.divide(missing, rate, out=np.full_like(missing, np.inf), where=rate > 0.0)
    soonest = float(due.min(initial=np.inf))
    if not np.isfinite(soonest):
        return float(left)
    braked = float((due if last is None else due * _braking(due, last, limits)).min())
    return float(
        min(left, AIM * np.clip(braked, soonest / MAX_TREND, soonest * MAX_TREND))
    )


def _braking(due: Array, last: Step, limits: Limits) -> Array:
    """Return by what a trend moves the cycles due at the present rate, (n_flank,) [1].

    ``g + q g²/2 = 1`` with q the change of the rate over those cycles, relative to the
    rate.
    """
    trend = (last.end.rate - last.start.rate)[limits.flank] / last.size
    wears = np.isfinite(due)
    q = np.zeros_like(due)
    q[wears] = TREND * trend[wears] * due[wears] / last.end.rate[limits.flank][wears]
    return np.asarray(2.0 / (1.0 + np.sqrt(np.maximum(0.0, 1.0 + 2.0 * q))))
