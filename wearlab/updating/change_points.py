"""A wear coefficient that changes once, as clocks on the one stored run.

No change has half of the probability before. Else k was a ratio r of what it is now
until a cycle, ln r ~ N(0, 1): in each gap between two inspections alike, evenly within
it; of running-in r is above 1, and the logarithm of the cycle is even. Cycles and
ratios stand on a grid, each point a clock on the stored run.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.updating import grids
from wearlab.updating.measurements import UpdateError
from wearlab.updating.run_curves import Clock, RunHistory, Runs

RATIOS = 15  # points over ln r
CYCLES_IN_GAP = 3  # at which k may change between two inspections
RUNNING_IN_CYCLES = 20  # at which running-in may be over
EARLIEST = 1e-3  # of the cycles inspected, at which it may be
WIDE = 4.0  # standard deviations of ln r that are looked at first
ROUNDS = 6  # of narrowing ln r
DEPTH = 12.0  # of ln of the weight below its top that counts
GOLDEN = 0.6180339887  # by which grids of ratios are shifted from cycle to cycle
NARROWER = 0.6  # of its range, to which that of ln r must shrink to be narrowed again

PosteriorFunction = Callable[[Runs], grids.Posterior]


def with_step_in_k(
    run: RunHistory, at: float, ratio: float, width: float = 0.0
) -> RunHistory:
    """Return a run whose k was another until a cycle, and is as it is from then on.

    Parameters
    ----------
    run : whose k is constant
    at : the cycle
    ratio : of k until then to what it is
    width : of the cycles which this one stands for
    """
    ends = np.array([run.start, run.end])
    clock = Clock(ends, ends) if run.clock is None else run.clock
    # of what has a clock of its own, such as masses under a record, k changed as well
    points = tuple(
        asked
        if asked.clock is None
        else asked._replace(clock=_stepped(run, asked.clock, at, ratio))
        for asked in run.points
    )
    return replace(
        run,
        clock=_stepped(run, clock, at, ratio),
        points=points,
        change=(at, 1.0 / ratio, width),
    )


def _stepped(run: RunHistory, clock: Clock, at: float, ratio: float) -> Clock:
    """Return a clock that ran at another pace until a cycle."""
    last = max(at, float(clock.cycle[-1])) + run.end
    knots = np.unique(np.append(clock.cycle, [at, last]))
    equal = run.equal(knots, clock)
    until = float(run.equal(np.array(at), clock))
    passed = ratio * np.minimum(equal, until) + np.maximum(equal - until, 0.0)
    return Clock(knots, run.start + passed, clock.off)


class ChangeCycles(NamedTuple):
    """Cycles at which k may have changed.

    Parameters
    ----------
    at : (n,) the cycles
    width : (n,) of the cycles that each stands for
    """

    at: Array
    width: Array


class RatioGrid(NamedTuple):
    """Ratios of k before each change to k after it, and how well they explain the data.

    Parameters
    ----------
    log_ratio : ln r, (cycles, ratios)
    step : of ln r, (cycles,)
    log_evidence : (cycles, ratios)
    """

    log_ratio: Array
    step: Array
    log_evidence: Array


def runs_with_change(
    run: RunHistory, kind: str, posterior_of: PosteriorFunction
) -> Runs:
    """Return a run of constant k and those with a change that counts.

    They say how often each stands.

    Parameters
    ----------
    run : whose k is constant
    kind : once | running-in
    posterior_of : what is known after the measurements, given runs

    Raises
    ------
    UpdateError : there are fewer than two inspections
    """
    times = [points.cycle for points in run.points]
    inspected = np.unique(np.concatenate([[run.start], *times]))
    if len(inspected) < 3:
        raise UpdateError(
            "update.change: at least two inspections are needed to see k change"
        )
    early = kind == "running-in"
    changes = _running_in_cycles(inspected) if early else _cycles_in_gaps(inspected)
    grid = _ratio_grid(run, changes.at, early, posterior_of)

    # the prior of each point: half of it is that of no change
    scale = (2.0 if early else 1.0) / np.sqrt(2.0 * np.pi) / len(changes.at)
    log_prior = np.log(0.5 * scale * grid.step[:, None]) - 0.5 * grid.log_ratio**2
    joint = log_prior + grid.log_evidence
    counted = np.argwhere(joint > joint.max() - DEPTH)
    runs = [run]
    for t, r in counted:
        ratio = float(np.exp(grid.log_ratio[t, r]))
        width = float(changes.width[t])
        runs.append(with_step_in_k(run, float(changes.at[t]), ratio, width))

    log_priors = np.append(np.log(0.5), log_prior[tuple(counted.T)])
    log_weights = -log_priors - np.log(len(runs))
    return [
        replace(changed_run, log_weight=log_weight)
        for changed_run, log_weight in zip(runs, log_weights.tolist(), strict=True)
    ]


def _running_in_cycles(inspected: Array) -> ChangeCycles:
    """Return cycles at which running-in may be over, even in their logarithm."""
    start = inspected[0]
    shares = np.geomspace(EARLIEST, 1.0, RUNNING_IN_CYCLES + 2)[1:-1]
    at = start + (inspected[-1] - start) * shares
    half_step = -0.5 * np.log(EARLIEST) / (RUNNING_IN_CYCLES + 1)
    return ChangeCycles(at, 2.0 * np.sinh(half_step) * (at - start))


def _cycles_in_gaps(inspected: Array) -> ChangeCycles:
    """Return cycles evenly within each gap between two inspections."""
    gaps = np.diff(inspected)
    width = np.repeat(gaps / CYCLES_IN_GAP, CYCLES_IN_GAP)
    places = np.arange(CYCLES_IN_GAP) + 0.5
    at = inspected[:-1, None] + gaps[:, None] * places / CYCLES_IN_GAP
    return ChangeCycles(at.ravel(), width)


def _ratio_grid(
    run: RunHistory, at: Array, early: bool, posterior_of: PosteriorFunction
) -> RatioGrid:
    """Return the ratios that go with each cycle of change, narrowed in rounds."""
    n = len(at)
    lowest = 0.0 if early else -WIDE
    low = np.full(n, lowest)
    high = np.full(n, WIDE)
    log_ratio = np.empty((n, RATIOS))
    evidence = np.empty((n, RATIOS))
    # so that no ratio is preferred
    inside = np.full(n, 0.5) if early else (0.5 + GOLDEN * np.arange(n)) % 1.0
    places = np.arange(RATIOS) + inside[:, None]

    narrowed = np.arange(n)
    for _ in range(ROUNDS):
        step = (high - low) / RATIOS
        log_ratio[narrowed] = (low[:, None] + step[:, None] * places)[narrowed]
        candidates = tuple(
            with_step_in_k(run, float(at[t]), float(np.exp(u)))
            for t in narrowed
            for u in log_ratio[t]
        )
        log_evidence = posterior_of(candidates).log_evidence
        evidence[narrowed] = log_evidence.reshape(-1, RATIOS)

        logs = evidence - 0.5 * log_ratio**2
        counted = logs > logs.max(axis=1, keepdims=True) - DEPTH
        first = np.where(counted, log_ratio, np.inf).min(axis=1)
        last = np.where(counted, log_ratio, -np.inf).max(axis=1)
        left = np.maximum(first - step, lowest)
        right = np.minimum(last + step, WIDE)
        narrowed = np.flatnonzero(right - left < NARROWER * (high - low))
        if not len(narrowed):
            break
        low[narrowed] = left[narrowed]
        high[narrowed] = right[narrowed]
    return RatioGrid(log_ratio, step, evidence)
