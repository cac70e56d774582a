"""What changed on the way, as clocks on stored runs: loads, the wear coefficient itself, gears that were new.

A load record is a clock of equal wear, made from a run of each condition.

A coefficient that changes once: none has half of the probability before. Else k was a
ratio r of what it is now until a cycle, ln r ~ N(0, 1): in each gap between two
inspections alike, evenly within it; of running-in r is above 1, and the logarithm of
the cycle is even. Cycles and ratios stand on a grid, each point a clock on the one
stored run.

Gears that were replaced, while their mates went on as worn as they were: a new gear's
wear counts from its day on, h(f (N − N₁)), by a run that begins with the wear of its
mates at N₁. That is the one at the median of k: one run has one wear to begin with. The
mates' own wear goes on from one run to the next, joined at f̂ N₁, so that it stays a
function of f N.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from wearlab import options, units
from wearlab.scene import Scene
from wearlab.updating import answers, grids, likelihood, run_curves
from wearlab.updating.cases import OperatingRecord, Subject, UpdateError
from wearlab.updating.run_curves import Clock, RunHistory, Runs

RATIOS, IN_GAP, TIMES = (
    15,
    3,
    20,
)  # points over ln r, cycles in a gap, cycles of running-in
GOLDEN = 0.6180339887
WIDE = 4.0  # standard deviations of ln r that are looked at first
EARLIEST = 1e-3  # of the cycles inspected at which running-in may be over
ROUNDS, DEPTH = (
    6,
    12.0,
)  # of narrowing ln r; of ln of the weight below its top that counts
ENDS = np.array([0.05, 0.5, 0.95])
SWEEPS = 25  # through bins, whose order is not known
CLOCKS = ("cycle", "operating_hours", "mesh_cycles")
# of the factor at which the mates' wear is taken: it says how much, and hardly how
DIGITS = 2
FAR = 1e6  # times a run's length that a clock reaches

PosteriorFunction = Callable[[Runs], grids.Posterior]


def clock_of(
    record: OperatingRecord,
    scene_run: RunHistory,
    runs: Runs,
    factor: float,
    block: int | None,
) -> Clock:
    """Return the clock of equal wear of what ran, from a run of the scene and one of each condition.

    Wear is what ends the life, or what a block tells: at equal depth a harder load has
    worn less mass.

    Under a condition wear goes on as its own run does from the same wear. That depends
    on the wear that was reached, and so on the factor; hardly, where the conditions
    wear alike in shape.
    """
    condition_of_piece = record.conditions()[1]
    passed = np.diff(record.time)
    if record.mixed:  # all of them, one after another, many times
        seconds_of = np.bincount(condition_of_piece + 1, passed, len(runs) + 1)
        condition_of_piece = np.tile(np.arange(-1, len(runs), dtype=np.intp), SWEEPS)
        passed = np.tile(seconds_of / SWEEPS, SWEEPS)
    begins = np.append(0, np.flatnonzero(np.diff(condition_of_piece)) + 1)
    condition_of_piece = condition_of_piece[begins]
    passed = np.add.reduceat(passed, begins)
    wear, *worn_by = (
        run.limit if block is None else run.points[block].curve
        for run in (scene_run, *runs)
    )
    equal = [0.0]
    for condition, seconds in zip(condition_of_piece, passed, strict=True):
        reached = equal[-1]
        if condition >= 0:
            run = runs[condition]
            curve = worn_by[condition]
            condition_cycle = float(
                curve.first_above(
                    wear.at(
                        scene_run.start + np.array(reached * factor / scene_run.factor)
                    )
                )
            )
            condition_cycle += seconds / run.seconds_per_cycle * factor / run.factor
            equal_cycle = wear.first_above(curve.at(np.array(condition_cycle)))
            reached = max(
                float(equal_cycle - scene_run.start) * scene_run.factor / factor,
                reached,
            )
        equal.append(reached)
    at = np.append(0.0, np.cumsum(passed)) / scene_run.seconds_per_cycle
    ahead = max(float(at[-1]), 1.0)
    return Clock(
        scene_run.start + np.append(at, at[-1] + ahead),
        scene_run.start + np.append(equal, equal[-1] + ahead),
    )


def clocked_run(study: Subject, run: RunHistory, condition_runs: Runs) -> RunHistory:
    """Return a run with the clock of its record, at the factor that the measurements tell with it."""
    assert study.record is not None
    factors = np.ones(3)
    weighed = [
        n
        for n, observed in enumerate(study.observations)
        if observed.data.quantity == "worn_mass" and len(observed)
    ]
    for _ in range(3 if any(len(observed) for observed in study.observations) else 1):
        clocks = [
            clock_of(study.record, run, condition_runs, float(factor), None)
            for factor in factors
        ]
        ends = [clock.equal[-2] - run.start for clock in clocks]
        off = float(abs(ends[2] - ends[0]) / max(ends[1], 1e-300))
        points = list(run.points)
        for n in weighed:
            points[n] = points[n]._replace(
                clock=clock_of(study.record, run, condition_runs, float(factors[1]), n)
            )
        clocked = replace(run, clock=clocks[1]._replace(off=off), points=tuple(points))
        factors = answers.answer_of(
            study, (clocked,), answers.blocks_of(study, (clocked,))
        ).factor(ENDS)
    return clocked


def with_step_in_k(
    run: RunHistory, at: float, ratio: float, width: float = 0.0
) -> RunHistory:
    """Return a run with k ``ratio`` times what it is until a cycle, and as it is from then on.

    ``width`` is that of the cycles which this one stands for.
    """
    ends = np.array([run.start, run.end])
    clock = Clock(ends, ends) if run.clock is None else run.clock
    knots = np.unique(
        np.append(clock.cycle, [at, max(at, float(clock.cycle[-1])) + run.end])
    )
    equal = run.equal(knots)
    until = float(run.equal(np.array(at)))
    passed = ratio * np.minimum(equal, until) + np.maximum(equal - until, 0.0)
    return replace(
        run,
        clock=Clock(knots, run.start + passed, clock.off),
        change=(at, 1.0 / ratio, width),
    )


def runs_with_change(run: RunHistory, kind: str, judge: PosteriorFunction) -> Runs:
    """Return a run of constant k and those with a change that counts, which say how often each stands.

    Parameters
    ----------
    run : whose k is constant
    kind : once | running-in
    judge : what is known after the measurements, given runs

    Raises
    ------
    UpdateError : there are fewer than two inspections
    """
    cycles = np.unique(
        np.concatenate([[run.start], *(points.cycle for points in run.points)])
    )
    if len(cycles) < 3:
        raise UpdateError(
            "update.change: at least two inspections are needed to see k change"
        )
    early = kind == "running-in"
    if early:
        at = (
            run.start
            + (cycles[-1] - run.start) * np.geomspace(EARLIEST, 1.0, TIMES + 2)[1:-1]
        )
        width = 2.0 * np.sinh(-0.5 * np.log(EARLIEST) / (TIMES + 1)) * (at - run.start)
    else:
        width = np.repeat(np.diff(cycles) / IN_GAP, IN_GAP)
        at = (
            cycles[:-1, None]
            + np.diff(cycles)[:, None] * (np.arange(IN_GAP) + 0.5) / IN_GAP
        ).ravel()
    n = len(at)
    lowest_ratio = 0.0 if early else -WIDE
    low = np.full(n, lowest_ratio)
    high = np.full(n, WIDE)
    moved = np.arange(n)
    grid, evidence = np.empty((2, n, RATIOS))
    # so that no ratio is preferred
    inside = np.full(n, 0.5) if early else (0.5 + GOLDEN * np.arange(n)) % 1.0
    for _ in range(ROUNDS):  # each cycle has the ratios that go with it
        step = (high - low) / RATIOS
        grid[moved] = (
            low[:, None] + step[:, None] * (np.arange(RATIOS) + inside[:, None])
        )[moved]
        candidates = tuple(
            with_step_in_k(run, float(at[t]), float(np.exp(r)))
            for t in moved
            for r in grid[t]
        )
        evidence[moved] = judge(candidates).log_evidence.reshape(-1, RATIOS)
        logs = evidence - 0.5 * grid**2
        held = logs > logs.max(axis=1, keepdims=True) - DEPTH
        left = np.maximum(np.where(held, grid, np.inf).min(axis=1) - step, lowest_ratio)
        right = np.minimum(np.where(held, grid, -np.inf).max(axis=1) + step, WIDE)
        moved = np.flatnonzero(right - left < 0.6 * (high - low))
        if not len(moved):
            break
        low[moved], high[moved] = left[moved], right[moved]
    scale = (2.0 if early else 1.0) / np.sqrt(2.0 * np.pi) / n
    log_prior = np.log(0.5 * scale * step[:, None]) - 0.5 * grid**2
    counted = np.argwhere(log_prior + evidence > (log_prior + evidence).max() - DEPTH)
    runs = (
        run,
        *(
            with_step_in_k(
                run, float(at[t]), float(np.exp(grid[t, r])), float(width[t])
            )
            for t, r in counted
        ),
    )
    log_weights = -np.append(np.log(0.5), log_prior[tuple(counted.T)]) - np.log(
        len(runs)
    )
    return [
        replace(changed_run, log_weight=ratio)
        for changed_run, ratio in zip(runs, log_weights.tolist(), strict=True)
    ]


class ServiceInterval(NamedTuple):
    """A gear in service: the cycle at which it was new, and a run of its wear since."""

    begin: float
    run: xr.Dataset


def with_replacements(
    study: Subject, compute: Callable[[Scene], xr.Dataset]
) -> tuple[Subject, RunHistory]:
    """Return a study whose measurements are parted by the gears they are of, and its history.

    Parameters
    ----------
    study : with gears that were replaced
    compute : runs a scene, and returns what is stored of it

    Raises
    ------
    UpdateError : a gear is not there, or a measurement or limit does not say of which
        gear it is
    """
    scene = study.first
    first = compute(study.first)
    flanks = first["flank"].astype(str).values.tolist()
    gears = list(dict.fromkeys(map(run_curves.gear, flanks)))
    eras = {
        gear: [ServiceInterval(float(first["cycle"].values[0]), first)]
        for gear in gears
    }
    _gear_of(study.limit.where, gears, "update.limit")
    descriptions = []
    for number, (members, at) in enumerate(_events(study, first, gears)):
        parted, history = _history(study, scene, eras)
        blocks_before = likelihood.select_by_cycle(
            answers.blocks_of(parted, (history,)), history, np.less_equal, at
        )
        answer = answers.answer_of(parted, (history,), blocks_before)
        factor = float(f"{answer.factor(np.array([0.5]))[0]:.{DIGITS}g}")
        run_cycle = {
            gear: (at - intervals[-1].begin) * factor / history.factor
            for gear, intervals in eras.items()
        }
        worn: dict[str, Any] = {}
        for flank, gear in zip(flanks, map(run_curves.gear, flanks), strict=True):
            new = gear in members
            worn[f"wear.initial.{flank}"] = (
                None if new else _profile(eras[gear][-1].run, flank, run_cycle[gear])
            )
        next_run = compute(
            scene.replace({key: wear for key, wear in worn.items() if wear or number})
        )
        for gear, intervals in eras.items():
            if gear in members:
                intervals.append(ServiceInterval(at, next_run))
            else:
                intervals[-1] = intervals[-1]._replace(
                    run=_joined(intervals[-1].run, run_cycle[gear], next_run)
                )
        descriptions.append(f"{' and '.join(members)} new at {at:.6g} cycles")
    parted, history = _history(study, scene, eras)
    return replace(parted, renewals="; ".join(descriptions)), history


def _gear_of(where: str | None, gears: list[str], place: str) -> str:
    if where is None:
        raise UpdateError(
            f"{place}: with update.replaced, say of which gear it is: "
            f"{', '.join(gears)}"
        )
    return run_curves.gear(where)


def _events(
    study: Subject, first: xr.Dataset, gears: list[str]
) -> list[tuple[Sequence[str], float]]:
    """Return which gears were replaced when, in order: their names, cycle."""
    events = []
    for number, event in enumerate(study.spec.replaced):
        place = f"update.replaced[{number}]"
        for gear in event.members:
            if gear not in gears:
                raise UpdateError(
                    f"{place}.members: {gear!r} is not one of {', '.join(gears)}"
                )
        at = event.cycle
        hours = event.hours
        if at is None:
            if hours is None:
                hours = (
                    np.nan
                    if study.calendar is None
                    else float(study.calendar.hours(event.date))
                )
                message = (
                    "needs update.calendar = { date, hours, hours_per_year }; or give "
                    "hours"
                )
                if hours < 0.0:
                    message = (
                        f"{event.date} is before the first operating hour, by "
                        "update.calendar"
                    )
                if not hours >= 0.0:
                    raise UpdateError(f"{place}.date: {message}")
            seconds_per_cycle = run_curves.per_cycle(first, "operating_hours")
            at = (
                float(first["cycle"].values[0]) + hours * units.HOUR / seconds_per_cycle
            )
        events.append((event.members, at))
    return sorted(events, key=lambda one: one[1])


def _history(
    study: Subject, scene: Scene, eras: Mapping[str, list[ServiceInterval]]
) -> tuple[Subject, RunHistory]:
    """Return the study with its measurements parted, and its history.

    What is in service comes first.
    """
    gears = list(eras)
    parts = []
    points = []
    last = eras[_gear_of(study.limit.where, gears, "update.limit")][-1]
    latest = run_curves.history_of(last.run, scene, (), study.limit)
    for observed in study.observations:
        intervals = eras[_gear_of(observed.data.where, gears, observed.data.place)]
        cycles = run_curves.cycles_of(intervals[0].run, observed)
        interval_of_value = np.searchsorted(
            [era.begin for era in intervals[1:]], cycles, side="left"
        )
        for k, (begin, run) in reversed([*enumerate(intervals)]):
            rows = np.flatnonzero(interval_of_value == k)
            if len(rows) or k == len(intervals) - 1:
                names = ("time", "value", "sd", "below", "place", "row")
                parts.append(
                    replace(
                        observed,
                        **{name: getattr(observed, name)[rows] for name in names},
                    )
                )
                ended = latest.limit if run is last.run else None
                block_points = run_curves.points_of(
                    run_curves.distinct(run), parts[-1], study.limit, ended
                )
                points.append(
                    block_points._replace(
                        clock=_clock(begin, latest.start, latest.end), begin=begin
                    )
                )
    history = replace(
        latest, points=tuple(points), clock=_clock(last.begin, latest.start, latest.end)
    )
    return replace(study, observations=tuple(parts)), history


def _clock(begin: float, start: float, end: float) -> Clock:
    """Return the clock of a gear that was new at a cycle."""
    ahead = FAR * (end - start)
    cycle = np.array([min(start, begin - 1.0), begin, begin + ahead])
    return Clock(cycle, np.array([start, start, start + ahead]))


def _profile(run: xr.Dataset, flank: str, at_cycle: float) -> dict[str, Any]:
    """Return the wear of a flank at a cycle of a run, as a scene writes it."""
    flank_data = run_curves.distinct(run).sel(flank=flank).sortby("path_position")
    names = ("cycle", "wear_depth", "wear_rate", "path_position")
    cycle, depth, rate, position = (
        np.asarray(flank_data[name].values, float) for name in names
    )
    held = np.flatnonzero(np.isfinite(position))
    worn = np.maximum(
        run_curves.RunCurve(cycle, depth, rate).at(np.full(len(held), at_cycle), held),
        0.0,
    )
    if not worn.any():
        return {}
    x, y = (
        tuple(map(options.Stored, values.tolist())) for values in (position[held], worn)
    )
    named = {"shape": "measured", "x": "path_position", "y": "depth"}
    return {**named, "abscissa": x, "ordinate": y, "continuation": "hold"}


def _joined(run: xr.Dataset, cycle: float, continuation: xr.Dataset) -> xr.Dataset:
    """Return a run until one of its cycles, and from there on another."""
    held = run.isel(update=run["cycle"].values < cycle * (1.0 - 1e-9))
    shifts = {
        name: cycle * run_curves.per_cycle(run, name)
        for name in CLOCKS
        if name in run and name in continuation
    }
    later = continuation.assign(
        {name: continuation[name] + shift for name, shift in shifts.items()}
    )
    how: Any = {"data_vars": "minimal", "coords": "minimal", "compat": "override"}
    return xr.concat([held, later], "update", **how)
