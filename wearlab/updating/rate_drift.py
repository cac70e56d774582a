"""A wear rate that drifts, as clocks on the one stored run.

Half of the probability before is that of a steady rate. Else wear has one of three
courses over the share x of the time inspected, each 1 at x = 1 and going on beyond it:

    power       x^b                                     faster and faster, or slower
    change      x until p, and r times as fast after    one change, at any p alike
    running-in  x + (r − 1) p (1 − exp(−x/p))           r times as fast at first, r > 1

One scale says how far rates drift: the logs of b and r are Student-t, with it in the
proportions of `PROPORTION`. Each course is a clock on the stored run, so that k, errors
and lives are inferred as without it, and courses count by their evidence: no test
switches one on.

Which courses count is found by the evidence in Laplace's approximation, which is good
for a range of sizes; in it stand evenly spaced ones, which are then integrated exactly.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.special import logsumexp
from scipy.stats import t as student_t

from wearlab.arrays import Array, Index
from wearlab.updating import condensing, data_blocks, grids
from wearlab.updating.lives import Answer
from wearlab.updating.run_curves import Clock, Course, ObservationPoints, RunHistory

STEADY, POWER, CHANGE, RUNNING_IN = "steady", "power", "change", "running-in"
STEADY_SHARE = 0.5  # probability of a steady rate before
SCALE = 0.5  # of ln of the ratio by which a rate drifts
PROPORTION = {POWER: 0.5, CHANGE: 1.0, RUNNING_IN: 2.0}  # of sizes to that scale
FREEDOM = 3.0  # degrees, of the Student-t law of sizes
PLACES = {
    POWER: np.ones(1),
    CHANGE: (np.arange(16) + 0.5) / 16,
    RUNNING_IN: np.geomspace(0.01, 0.3, 7),
}
WIDEST = {POWER: 1.5, CHANGE: 4.0, RUNNING_IN: 4.0}  # size that is looked at first
LOOKED_AT = 41  # sizes at a place while their range is narrowed
# sizes at a place that are integrated over, shifted from place to place
NODES = {POWER: 32, CHANGE: 8, RUNNING_IN: 8}
GOLDEN = 0.6180339887  # by which they are
ROUNDS = 6  # of narrowing
DEPTH = 9.0  # of ln of the weight below its top that a range reaches down to
COUNTED = 6.0  # of ln of the weight below the largest, that counts
MAX_RUNS = 80
MAX_RUNS_OF_MANY = 10  # where values are condensed
GROUPS = 48  # of neighbouring values that courses are chosen by
STEPS = 4  # of Gauss and Newton
LONGEST_STEP = 0.5  # of ln factor
AHEAD = 30.0  # times the time inspected to which a clock is made
KNOTS = 100  # of a clock until now, and as many ahead
NEGLIGIBLE = 1e-3  # probability of a course that is not told
ENDS = np.array([0.05, 0.5, 0.95])


def wear_passed(kind: str, size: Any, place: Any, share: Any) -> Array:
    """Return the share of equal wear that has passed, 1 at 1; shapes are broadcast.

    Parameters
    ----------
    kind : power | change | running-in
    size : ln of the power, or of the ratio of rates
    place : share of the time inspected at which the rate changes
    share : of the time inspected
    """
    ratio = np.exp(size)
    if kind == POWER:
        return np.asarray(share**ratio)
    if kind == CHANGE:
        later = np.maximum(share - place, 0.0)
        total = place + ratio * (1.0 - place)
        return np.asarray((np.minimum(share, place) + ratio * later) / total)
    extra = (ratio - 1.0) * place
    total = 1.0 - extra * np.expm1(-1.0 / place)
    return np.asarray((share - extra * np.expm1(-share / place)) / total)


def log_density_of_size(kind: str, size: Array) -> Array:
    """Return the log of the prior density of sizes.

    Parameters
    ----------
    kind : power | change | running-in, of which a size is above 0
    size : ln of the power, or of the ratio of rates
    """
    law = student_t(FREEDOM, scale=SCALE * PROPORTION[kind])
    return np.asarray(law.logpdf(size) + np.log(1.0 + (kind == RUNNING_IN)))


class CourseReading(NamedTuple):
    """What one course of the wear rate would make of the measurements.

    Parameters
    ----------
    kind : steady | power | change | running-in
    probability : of the course
    life : (3,) its 5, 50 and 95 % quantiles, if it is right [cycles]
    size : (3,) those of the power, or of the ratio of rates after and before; 1 of a
        steady rate
    """

    kind: str
    probability: float
    life: Array
    size: Array


def readings_of(answer: Answer) -> tuple[CourseReading, ...]:
    """Return what each course would make of the measurements, the likeliest first.

    Parameters
    ----------
    answer : of runs with drift
    """
    post = answer.posterior
    kinds = np.array([_kind_of(run) for run in post.histories])
    readings = []
    for kind in (STEADY, *PLACES):
        of_kind = np.flatnonzero(kinds == kind)
        probability = float(post.weight[of_kind].sum())
        if probability < NEGLIGIBLE:
            continue
        alone = replace(answer, posterior=post.of_runs(of_kind))
        runs = alone.posterior.histories
        sizes = [run.course.size if run.course else 0.0 for run in runs]
        ratio = np.exp(np.array(sizes) * (-1.0 if kind == RUNNING_IN else 1.0))
        size = grids.weighted_quantiles(ratio, alone.posterior.weight, ENDS)
        readings.append(CourseReading(kind, probability, alone.life(ENDS), size))
    return tuple(sorted(readings, key=lambda reading: -reading.probability))


def _kind_of(run: RunHistory) -> str:
    """Return the kind of a run's course."""
    return STEADY if run.course is None else run.course.kind


class Group(NamedTuple):
    """Neighbouring values of a block, as courses are chosen by.

    Parameters
    ----------
    block : with the errors of a value
    span : equal cycles of the time inspected
    points : with the curve that they are compared with
    share : (n,) of the time inspected
    first : (n,) from which wear counts
    column : (n,) of the curve
    value : (n,) means [SI]
    size : (n,) values of each
    variance : (n,) of an error besides the unknown [SI²]
    scatter : sum of squares within the groups [SI²]
    """

    block: data_blocks.Block
    span: float
    points: ObservationPoints
    share: Array
    first: Array
    column: Index
    value: Array
    size: Array
    variance: Array
    scatter: float


def _span(run: RunHistory, blocks: data_blocks.Blocks, clock: Clock | None) -> float:
    """Return the equal cycles until the last inspection, of a run if there was none."""
    cycles = data_blocks.cycles_of(blocks, run)
    last = float(run.equal(cycles[-1:], clock)[0]) if len(cycles) else 0.0
    return last if last > 0.0 else run.end - run.start


def _groups(run: RunHistory, blocks: data_blocks.Blocks) -> list[Group]:
    """Return the values of blocks, of many some neighbours together."""
    groups = []
    for number in data_blocks.measured_blocks(blocks):
        block = blocks[number]
        points = run.points[number]
        observed = block.observed
        counted = np.flatnonzero(~observed.censored[block.rows])
        if not len(counted):
            continue
        in_order = np.lexsort(
            (points.cycle[block.rows[counted]], points.column[block.rows[counted]])
        )
        place = counted[in_order]
        order = block.rows[place]
        begins = _begins(points.column[order], len(order))
        size = np.diff(begins, append=len(order))
        cycle = np.add.reduceat(points.cycle[order], begins) / size
        since = data_blocks.cycles_since(block, run, number)[place]
        first = np.add.reduceat(since, begins) / size
        value = np.add.reduceat(observed.value[order], begins) / size
        error = block.data.error
        column_variance = np.add.reduceat(observed.sd[order] ** 2, begins) / size
        relative_variance = (block.relative * value) ** 2

        span = _span(run, blocks, points.clock)
        rest = observed.value[order] - np.repeat(value, size)
        group = Group(
            block=block,
            span=span,
            points=points,
            share=run.equal(cycle, points.clock) / span,
            first=run.equal(first, points.clock) / span,
            column=points.column[order][begins],
            value=value,
            size=size,
            variance=column_variance + relative_variance + error.offset_sd**2 * size,
            scatter=float(np.sum(rest**2)) if len(order) > GROUPS else 0.0,
        )
        groups.append(group)
    return groups


def _begins(column: Index, count: int) -> Any:
    """Return where groups of neighbours begin; none goes over two columns."""
    evenly = np.linspace(0, count, min(count, GROUPS), endpoint=False).astype(np.intp)
    changes = np.flatnonzero(np.diff(column)) + 1
    return np.union1d(evenly, changes) if count > GROUPS else np.arange(count)


class Courses(NamedTuple):
    """Courses of one kind.

    Parameters
    ----------
    kind : power | change | running-in
    size : (places, sizes)
    place : (places, 1)
    """

    kind: str
    size: Array
    place: Array

    def passed(self, share: Array) -> Array:
        """Return the share of equal wear that has passed, (places, sizes, n)."""
        return wear_passed(
            self.kind, self.size[..., None], self.place[..., None], share
        )


def _log_evidence(
    run: RunHistory, groups: Sequence[Group], start: float, courses: Courses
) -> Array:
    """Return the log of the evidence of courses by Laplace, but for a constant."""
    log_factor = np.full(courses.size.shape, start)
    passed = [(courses.passed(g.share), courses.passed(g.first)) for g in groups]
    for _ in range(STEPS):
        gradient = np.zeros(courses.size.shape)
        curvature = np.full(courses.size.shape, 1e-300)
        logs = np.zeros(courses.size.shape)
        for group, (now, first) in zip(groups, passed, strict=True):
            model = _modelled(run, group, log_factor, now, first)
            nearby = _modelled(run, group, log_factor + 1e-4, now, first)
            slope = (nearby - model) / 1e-4
            rest = group.value - model
            variance, of_errors = _variances(group, rest)
            logs += of_errors - 0.5 * np.sum(rest**2 / variance, axis=-1)
            gradient += np.sum(slope * rest / variance, axis=-1)
            curvature += np.sum(slope**2 / variance, axis=-1)
        step = np.clip(gradient / curvature, -LONGEST_STEP, LONGEST_STEP)
        log_factor = log_factor + step
    # at the top, by the parabola about the last point
    return np.asarray(logs + 0.5 * gradient * step - 0.5 * np.log(curvature))


def _modelled(
    run: RunHistory,
    group: Group,
    log_factor: Array,
    now: Array,
    first: Array,
) -> Array:
    """Return what courses say of groups, (places, sizes, n) [SI]."""
    factor = np.exp(log_factor)[..., None] / run.factor
    curve = group.points.curve
    value = curve.at(run.start + group.span * now * factor, group.column)
    if not group.block.counts_since:
        return value
    return value - curve.at(run.start + group.span * first * factor, group.column)


def _variances(group: Group, rest: Array) -> tuple[Array, Array]:
    """Return the variances of means of groups, and the log of what they add.

    An unknown sd is where it is most probable by the residuals ``rest``, its prior
    being worth as many values as make a scaled inverse chi-square law as wide.
    """
    spread = group.block.sd
    count = float(group.size.sum())
    variance = np.full(rest.shape[:-1], spread.known**2)
    worth = 0.0
    if spread.prior is not None:
        worth = data_blocks.values_worth(spread)
        squares = np.maximum(group.size * rest**2 - group.variance, 0.0)
        total = np.sum(squares, axis=-1) + group.scatter
        variance = (total + worth * spread.known**2) / (count + worth)

    variance = np.maximum(variance, 1e-300)
    of_mean = np.maximum((variance[..., None] + group.variance) / group.size, 1e-300)
    logs = np.sum(np.log(of_mean), axis=-1)
    within = group.scatter + worth * spread.known**2
    logs += within / variance if spread.prior is not None else 0.0
    logs += (count - len(group.size) + worth) * np.log(variance)
    return of_mean, -0.5 * logs


def _narrowed(
    run: RunHistory, groups: Sequence[Group], start: float, kind: str
) -> tuple[Courses, Array]:
    """Return courses of a kind where they count, and ln of prior times evidence.

    They are evenly spaced between the ends of a range at each place.
    """
    places = PLACES[kind][:, None]
    lowest = 0.0 if kind == RUNNING_IN else -WIDEST[kind]
    low = np.full(places.shape, lowest)
    high = np.full(places.shape, WIDEST[kind])
    inside = (np.arange(LOOKED_AT) + 0.5) / LOOKED_AT
    for _ in range(ROUNDS if groups else 0):
        size = low + (high - low) * inside
        courses = Courses(kind, size, places)
        logs = _log_evidence(run, groups, start, courses)
        logs = logs + log_density_of_size(kind, size)
        step = (high - low) / LOOKED_AT
        above = logs - logs.max(axis=1, keepdims=True) + DEPTH
        left = size[:, :1] + step * (_places_below(above) - 1.0)
        right = size[:, -1:] - step * (_places_below(above[:, ::-1]) - 1.0)
        new_low = np.maximum(left, lowest)
        new_high = np.minimum(right, WIDEST[kind])
        settled = (new_high - new_low) > 0.6 * (high - low)
        low = new_low
        high = new_high
        if settled.all():
            break
    shift = (0.5 + GOLDEN * np.arange(len(places))) % 1.0
    middles = (np.arange(NODES[kind]) + shift[:, None]) / NODES[kind]
    courses = Courses(kind, low + (high - low) * middles, places)
    width = (high - low) / NODES[kind]
    log_prior = log_density_of_size(kind, courses.size) + np.log(width)
    log_prior += np.log((1.0 - STEADY_SHARE) / len(PLACES) / len(places))
    return courses, log_prior


def _places_below(above: Array) -> Array:
    """Return how many even places there are before a function is above 0, (rows, 1).

    Straight between places, so that what is found moves with it continuously.
    """
    rows = np.arange(len(above))
    first = np.argmax(above > 0.0, axis=1)
    before = np.maximum(first - 1, 0)
    rise = above[rows, first] - above[rows, before]
    part = above[rows, first] / np.where(rise > 0.0, rise, 1.0)
    places = np.where(first > 0, first - np.clip(part, 0.0, 1.0), 0.0)
    return np.asarray(places[:, None])


class DriftKnots(NamedTuple):
    """Where the clock of a rate that drifts is known.

    Parameters
    ----------
    cycle : (n,) its knots, rising
    share : (n,) of the time inspected that has passed then
    span : equal cycles of the time inspected
    off : as that of a clock of a record
    """

    cycle: Array
    share: Array
    span: float
    off: float

    def clock(self, start: float, course: Course) -> Clock:
        """Return the clock of a course.

        Parameters
        ----------
        start : first cycle of the run
        course : of the wear rate
        """
        passed = wear_passed(course.kind, course.size, course.place, self.share)
        return Clock(self.cycle, start + self.span * passed, self.off)


def _knots(
    run: RunHistory, blocks: data_blocks.Blocks, clock: Clock | None
) -> DriftKnots:
    """Return where the clock of a rate that drifts on a run's clock is known."""
    cycles = data_blocks.cycles_of(blocks, run)
    span = _span(run, blocks, clock)
    until = np.geomspace(1e-4, 1.0, KNOTS)
    ahead = np.geomspace(1.0, AHEAD, KNOTS)[1:]
    evenly = np.concatenate([[0.0], until, ahead]) * span
    if clock is None:
        knots = np.union1d(run.start + evenly, cycles)
    else:
        knots = clock.inverse(run.start + evenly)
        knots = np.unique(np.concatenate([clock.cycle, knots, cycles]))
    share = np.maximum(run.equal(knots, clock), 0.0) / span
    return DriftKnots(knots, share, span, 0.0 if clock is None else clock.off)


def with_courses(
    run: RunHistory, courses: Sequence[Course], blocks: data_blocks.Blocks
) -> list[RunHistory]:
    """Return a run with each of some courses of its wear rate.

    Parameters
    ----------
    run : whose rate is as the scene has it
    courses : of its wear
    blocks : observations, until the last of which they count
    """
    knots = _knots(run, blocks, run.clock)
    by_block = [
        None if points.clock is None else _knots(run, blocks, points.clock)
        for points in run.points
    ]
    runs = []
    for course in courses:
        points = tuple(
            seen if at is None else seen._replace(clock=at.clock(run.start, course))
            for seen, at in zip(run.points, by_block, strict=True)
        )
        clock = knots.clock(run.start, course)
        runs.append(replace(run, clock=clock, points=points, course=course))
    return runs


def runs_with_drift(
    run: RunHistory, blocks: data_blocks.Blocks, prior: Any
) -> list[RunHistory]:
    """Return a run of steady rate and those whose rate drifts, that count.

    They say how often each stands.

    Parameters
    ----------
    run : whose rate is steady
    blocks : the observations that count
    prior : of the factor on the wear coefficient
    """
    groups = _groups(run, blocks)
    start = 0.0
    if groups:
        steady = grids.Posterior([run], blocks, prior)
        start = float(steady.centre[0])

    chosen: list[Course] = []
    log_priors: list[float] = []
    log_joint: list[float] = []
    for kind in PLACES:
        courses, log_prior = _narrowed(run, groups, start, kind)
        evidence = np.zeros(log_prior.shape)
        if groups:
            evidence = _log_evidence(run, groups, start, courses)
        place = np.broadcast_to(courses.place, courses.size.shape)
        chosen += [
            Course(kind, *both)
            for both in zip(courses.size.ravel(), place.ravel(), strict=True)
        ]
        log_priors += log_prior.ravel().tolist()
        log_joint += (log_prior + evidence).ravel().tolist()

    counted = _counted(np.array(log_joint), run, blocks)
    if len(counted) and len(counted) <= MAX_RUNS_OF_MANY:
        # beside a steady rate, which is a power of 1
        one = Courses(POWER, np.zeros((1, 1)), np.ones((1, 1)))
        steady_joint = np.log(STEADY_SHARE)
        if groups:
            steady_joint += _log_evidence(run, groups, start, one)[0, 0]
        counted = counted[np.array(log_joint)[counted] > steady_joint - COUNTED]
    if not len(counted):
        return [run]
    runs = [run, *with_courses(run, [chosen[n] for n in counted], blocks)]
    logs = np.array([np.log(STEADY_SHARE), *(log_priors[n] for n in counted)])
    # what is left out counts by those that count
    logs[1:] += logsumexp(log_joint) - logsumexp(np.array(log_joint)[counted])
    return [
        replace(drifting, log_weight=float(-log - np.log(len(runs))))
        for drifting, log in zip(runs, logs, strict=True)
    ]


def _counted(log_joint: Array, run: RunHistory, blocks: data_blocks.Blocks) -> Array:
    """Return which courses count: those of largest weight, at most so many."""
    most = MAX_RUNS
    for number in data_blocks.measured_blocks(blocks):
        block = blocks[number]
        sds = np.ones(1)
        if condensing.condenses(block, run.points[number], sds):
            most = MAX_RUNS_OF_MANY
    order = np.argsort(-log_joint, kind="stable")[:most]
    return np.sort(order[log_joint[order] > log_joint[order[0]] - COUNTED])
