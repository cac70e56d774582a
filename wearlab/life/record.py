"""Wear over cycles as it was found: accepted states, snapshots, how it ended, and its error so far."""

from bisect import bisect_left
from dataclasses import dataclass

import numpy as np

from wearlab.arrays import Array
from wearlab.life.limits import WORN_OUT, Snapshots
from wearlab.life.step import Jump, Node, Step, crossing, depth_at


@dataclass(frozen=True)
class Life:
    """Wear over cycles.

    Parameters
    ----------
    cycle : (m,) cycles of the accepted states, 0 first, the end last [1]
    depth, rate : (m, n) wear depth [m] and wear rate [m per cycle] there
    accumulated_error : (m,) largest over the nodes of the signed sum of the errors of all steps so far,
        amplified where wear accelerates, and by as far as it may have shifted a jump; and the root of the
        squares of what scatters [m]
    depth_error : (n,) estimated error of the last depth with its sign, less what scatters [m]
    scatter : what scatters of that error, at any node [m]
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
    accumulated_error: Array
    depth_error: Array
    scatter: float
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
    def error_estimate_life(self) -> float:
        """Estimated error of the life: the depth error over the fastest wear at the end [1]."""
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
        return cycle, np.concatenate([self.depth[:1], self.snapshot_depth[inner], self.depth[-1:]])


def read_off(wanted: Snapshots, nodes: list[Node], curves: list[Step]) -> tuple[Array, Array]:
    """Return the snapshots that a life reached, in order, read off the curve through its states.

    Parameters
    ----------
    wanted : the snapshots asked for
    nodes : the accepted states
    curves : the steps between them, the last one whole where a limit is met inside it

    Returns
    -------
    cycle : (k,) [1]
    depth : (k, n) [m]
    """
    cycles, flank = list(wanted.cycles), wanted.flank
    for depth in wanted.depths:
        end = bisect_left(nodes, depth, key=lambda node: node.depth[flank].max())
        if end < len(nodes):
            cycles.append(crossing(curves[end - 1], depth, flank) if end else 0.0)
    cycles = sorted(float(cycle) for cycle in cycles if 0.0 <= cycle <= nodes[-1].cycle)
    depths = np.empty((len(cycles), nodes[0].depth.size))
    for row, cycle in zip(depths, cycles, strict=True):
        end = bisect_left(nodes, cycle, key=lambda node: node.cycle)
        row[:] = nodes[end].depth if cycle == nodes[end].cycle else depth_at(curves[end - 1], cycle)
    return np.array(cycles), depths


class AccumulatedError:
    """The error of the depth, step after step.

    ``total``: (n,) what has a sign, added up and amplified [m]; ``scatter``: what has another sign in every
    step, the root of its squares [m]; ``largest``: of every state, the error so far [m].

    Parameters
    ----------
    size : entries of the depth
    noise : standard error of the first rate [m per cycle]
    """

    def __init__(self, size: int, noise: float) -> None:
        self.total, self.scatter, self.noise = np.zeros(size), 0.0, noise
        self.largest = [0.0]

    def add(self, step: Step, noise: float) -> None:
        """Count a step at whose end the rate has this standard error [m per cycle]."""
        before, self.noise = self.noise, noise
        self.total = self.total * step.growth + step.error
        scatter = np.hypot(step.scatter, step.size * max(before, noise))
        self.scatter = float(np.hypot(self.scatter * step.growth, scatter))
        self.largest.append(self._now())

    def doubt(self, doubt: Array) -> None:
        """Count a doubt of either sign in the last state, (n,) ≥ 0 [m]."""
        self.total = self.total + np.copysign(doubt, self.total)
        self.largest[-1] = self._now()

    def _now(self) -> float:
        return float(np.abs(self.total).max(initial=0.0)) + self.scatter
