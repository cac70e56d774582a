"""Clocks on one stored run: what really ran, and a wear coefficient that changes once.

None has half of the probability before. Else k was a ratio r of what it is now until a cycle, ln r ~ N(0, 1):
in each gap between two inspections alike, evenly within it; of running-in r is above 1, and the logarithm of
the cycle is even. Cycles and ratios stand on a grid, each point a clock on the one stored run.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import logsumexp

from wearlab.arrays import Array
from wearlab.updating.measurements import OperatingRecord, UpdateError
from wearlab.updating.posterior import Posterior, weighted_quantiles
from wearlab.updating.run_curves import Clock, RunHistory

RATIOS, IN_GAP, TIMES = 15, 3, 20  # points over ln r, cycles in a gap, cycles of running-in
GOLDEN = 0.6180339887
WIDE = 4.0  # standard deviations of ln r that are looked at first
EARLIEST = 1e-3  # of the cycles inspected at which running-in may be over
ROUNDS, DEPTH = 6, 12.0  # of narrowing ln r; of ln of the weight below its top that counts
ENDS = (0.05, 0.5, 0.95)
WITHIN = 30  # cycles that a point of the grid is spread over when their interval is told
SWEEPS = 25  # through bins, whose order is not known

Judge = Callable[[tuple[RunHistory, ...]], Posterior]


def clock_of(
    record: OperatingRecord,
    own: RunHistory,
    runs: Sequence[RunHistory],
    factor: float,
    block: int | None = None,
) -> Clock:
    """Return the clock of equal wear of what ran, from a run of the scene and one of each condition.

    Wear is what ends the life, or what a block tells: at equal depth a harder load has worn less mass.

    Under a condition wear goes on as its own run does from the same wear. That depends on the wear that
    was reached, and so on the factor; hardly, where the conditions wear alike in shape.
    """
    which, passed = record.conditions()[1], np.diff(record.time)
    if record.mixed:  # all of them, one after another, many times
        each = np.bincount(which + 1, passed, len(runs) + 1)
        which = np.tile(np.arange(-1, len(runs), dtype=np.intp), SWEEPS)
        passed = np.tile(each / SWEEPS, SWEEPS)
    begins = np.append(0, np.flatnonzero(np.diff(which)) + 1)
    which, passed = which[begins], np.add.reduceat(passed, begins)
    wear, *worn_by = (run.limit if block is None else run.asked[block].curve for run in (own, *runs))
    equal = [0.0]
    for condition, seconds in zip(which, passed, strict=True):
        reached = equal[-1]
        if condition >= 0:
            run, curve = runs[condition], worn_by[condition]
            worn = wear.at(own.start + np.array(reached * factor / own.factor))
            after = float(curve.first_above(worn))
            after += seconds / run.seconds_per_cycle * factor / run.factor
            there = wear.first_above(curve.at(np.array(after)))
            reached = max(float(there - own.start) * own.factor / factor, reached)
        equal.append(reached)
    at = np.append(0.0, np.cumsum(passed)) / own.seconds_per_cycle
    ahead = max(float(at[-1]), 1.0)
    return Clock(own.start + np.append(at, at[-1] + ahead), own.start + np.append(equal, equal[-1] + ahead))


def stepped(run: RunHistory, at: float, ratio: float, width: float = 0.0) -> RunHistory:
    """Return a run with k ``ratio`` times what it is until a cycle, and as it is from then on.

    ``width`` is that of the cycles which this one stands for.
    """
    ends = np.array([run.start, run.end])
    own = Clock(ends, ends) if run.clock is None else run.clock
    knots = np.unique(np.append(own.cycle, [at, max(at, float(own.cycle[-1])) + run.end]))
    equal, until = run.equal(knots), float(run.equal(np.array(at)))
    passed = ratio * np.minimum(equal, until) + np.maximum(equal - until, 0.0)
    return replace(run, clock=Clock(knots, run.start + passed, own.off), change=(at, 1.0 / ratio, width))


def changing(run: RunHistory, kind: str, judge: Judge) -> tuple[tuple[RunHistory, ...], Array]:
    """Return a run of constant k and those with a change that counts, and ln of how often each stands.

    Parameters
    ----------
    run : whose k is constant
    kind : once | running-in
    judge : what is known after the measurements, given runs

    Raises
    ------
    UpdateError : there are fewer than two inspections
    """
    cycles = np.unique(np.concatenate([[run.start], *(asked.cycle for asked in run.asked)]))
    if len(cycles) < 3:
        raise UpdateError("update.change: at least two inspections are needed to see k change")
    early = kind == "running-in"
    if early:
        at = run.start + (cycles[-1] - run.start) * np.geomspace(EARLIEST, 1.0, TIMES + 2)[1:-1]
        width = 2.0 * np.sinh(-0.5 * np.log(EARLIEST) / (TIMES + 1)) * (at - run.start)
    else:
        width = np.repeat(np.diff(cycles) / IN_GAP, IN_GAP)
        at = (cycles[:-1, None] + np.diff(cycles)[:, None] * (np.arange(IN_GAP) + 0.5) / IN_GAP).ravel()
    n, least = len(at), 0.0 if early else -WIDE
    low, high, moved = np.full(n, least), np.full(n, WIDE), np.arange(n)
    grid, evidence = np.empty((2, n, RATIOS))
    inside = (
        np.full(n, 0.5) if early else (0.5 + GOLDEN * np.arange(n)) % 1.0
    )  # so that no ratio is preferred
    for _ in range(ROUNDS):  # each cycle has the ratios that go with it
        step = (high - low) / RATIOS
        grid[moved] = (low[:, None] + step[:, None] * (np.arange(RATIOS) + inside[:, None]))[moved]
        some = tuple(stepped(run, float(at[t]), float(np.exp(r))) for t in moved for r in grid[t])
        evidence[moved] = judge(some).log_evidence.reshape(-1, RATIOS)
        logs = evidence - 0.5 * grid**2
        held = logs > logs.max(axis=1, keepdims=True) - DEPTH
        first, last = held.argmax(axis=1), RATIOS - 1 - held[:, ::-1].argmax(axis=1)
        left = np.maximum(grid[np.arange(n), first] - step, least)
        right = np.minimum(grid[np.arange(n), last] + step, WIDE)
        moved = np.flatnonzero(right - left < 0.6 * (high - low))
        if not len(moved):
            break
        low[moved], high[moved] = left[moved], right[moved]
    scale = (2.0 if early else 1.0) / np.sqrt(2.0 * np.pi) / n
    before = np.log(0.5 * scale * step[:, None]) - 0.5 * grid**2
    kept = np.argwhere(before + evidence > (before + evidence).max() - DEPTH)
    runs = (run, *(stepped(run, float(at[t]), float(np.exp(grid[t, r])), float(width[t])) for t, r in kept))
    return runs, -np.append(np.log(0.5), before[tuple(kept.T)]) - np.log(len(runs))


def facts_of(post: Posterior) -> dict[str, float]:
    """Return how much the data prefer a change, and its ratio and cycle, with 90 %, given one."""
    changed = np.array([run.change is not None for run in post.histories])
    if not changed.any():
        return {}
    relative = post.log_evidence - post.log_proposal
    gain = float(logsumexp(relative[changed]) - logsumexp(relative[~changed]))
    at, ratio, width = np.array([run.change for run in post.histories if run.change is not None]).T
    found = {"log_evidence_of_change": gain}
    inside = at + np.outer((np.arange(WITHIN) + 0.5) / WITHIN - 0.5, width)
    for name, values in (("change_cycle", inside), ("change_ratio", ratio)):
        weight = np.broadcast_to(post.weight[changed], values.shape).ravel()
        for p, value in zip((5, 50, 95), weighted_quantiles(values.ravel(), weight, ENDS), strict=True):
            found[f"{name}_{p}"] = float(value)
    return found
