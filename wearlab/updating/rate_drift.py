"""A wear rate that drifts, as clocks on the one stored run, and scatter of readings.

A steady rate has a probability before (`SHARE`). Else wear has one of three courses
over the share x of the time inspected, each 1 at x = 1 and going on beyond it:

    power       x^b                                     faster and faster, or slower
    change      x until p, and r times as fast after    one change, at any p alike
    running-in  x + (r − 1) p (1 − exp(−x/p))           r times as fast at first, r > 1

One scale says how far rates drift: the logs of b and r are Student-t, with it in the
proportions of `PROPORTION`. Each course is a clock on the stored run, so that k, errors
and lives are inferred as without it, and courses count by their evidence: no test
switches one on. With each of them, and with a steady rate, readings may scatter in
proportion to the wear besides the errors that are named (`SCATTER`): else what is
larger errors late in a life is taken for a rate that drifts.

Where courses count is found by the evidence in Laplace's approximation, which is good
for a range of sizes; in it stand evenly spaced ones. Of these, some are drawn evenly by
their probability so found, and integrated exactly.
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
SHARE = {STEADY: 0.2, POWER: 0.25, CHANGE: 0.2, RUNNING_IN: 0.35}  # before
SCATTER = {0.0: 0.3, 0.025: 0.4, 0.06: 0.3}  # probability of relative errors besides
SCALE = 0.65  # of ln of the ratio by which a rate drifts
PROPORTION = {POWER: 0.25, CHANGE: 1.0, RUNNING_IN: 2.25}  # of sizes to that scale
FREEDOM = 3.0  # degrees, of the Student-t law of sizes
PLACES = {
    POWER: np.ones(1),
    CHANGE: (np.arange(16) + 0.5) / 16,
    RUNNING_IN: np.geomspace(0.01, 0.3, 7),
}
WIDEST = {POWER: 1.5, CHANGE: 4.0, RUNNING_IN: 4.0}  # size that is looked at first
LOOKED_AT = 41  # sizes at a place while their range is narrowed
# sizes at a place that are integrated over, shifted from place to place
NODES = {POWER: 20, CHANGE: 6, RUNNING_IN: 6}
GOLDEN = 0.6180339887  # by which they are
ROUNDS = 6  # of narrowing
DEPTH = 9.0  # of ln of the weight below its top that a range reaches down to
COUNTED = 8.0  # of ln of the weight below the largest, that counts
MAX_RUNS = 64
MAX_RUNS_OF_MANY = 10  # where values are condensed
LEAST_RUNS = 24  # where they are not, of however many
VALUES_OF_RUNS = 20_000  # of all runs together, up to which there are more
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
    """Courses of one kind; a row is a place with a scatter.

    Parameters
    ----------
    kind : power | change | running-in
    size : (rows, sizes)
    place : (rows, 1)
    scatter : (rows, 1) relative error of readings besides
    """

    kind: str
    size: Array
    place: Array
    scatter: Array

    def passed(self, share: Array) -> Array:
        """Return the share of equal wear that has passed, (rows, sizes, n)."""
        return wear_passed(
            self.kind, self.size[..., None], self.place[..., None], share
        )

    def added_variance(self, group: Group) -> Array:
        """Return the variance of readings besides the unknown, (rows, 1, n) [SI²]."""
        scatter = self.scatter[..., None] * group.value
        return np.asarray(group.variance + scatter**2)

    def each(self) -> list["ScatteredCourse"]:
        """Return every course with its scatter, row by row."""
        columns = [
            np.broadcast_to(column, self.size.shape).ravel().tolist()
            for column in (self.size, self.place, self.scatter)
        ]
        return [
            ScatteredCourse(Course(self.kind, size, place), scatter)
            for size, place, scatter in zip(*columns, strict=True)
        ]


class ScatteredCourse(NamedTuple):
    """A course with the relative error of readings besides those that are named."""

    course: Course
    scatter: float


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
            added = courses.added_variance(group)
            variance, of_errors = _variances(group, added, rest)
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
    """Return what courses say of groups, (rows, sizes, n) [SI]."""
    factor = np.exp(log_factor)[..., None] / run.factor
    curve = group.points.curve
    value = curve.at(run.start + group.span * now * factor, group.column)
    if not group.block.counts_since:
        return value
    return value - curve.at(run.start + group.span * first * factor, group.column)


def _variances(group: Group, added: Array, rest: Array) -> tuple[Array, Array]:
    """Return the variances of means of groups, and the log of what they add.

    Known is ``added`` [SI²]. An unknown sd is where it is most probable by the
    residuals ``rest``, its prior being worth as many values as make a scaled inverse
    chi-square law as wide.
    """
    spread = group.block.sd
    count = float(group.size.sum())
    variance = np.full(rest.shape[:-1], spread.known**2)
    worth = 0.0
    if spread.prior is not None:
        worth = data_blocks.values_worth(spread)
        squares = np.maximum(group.size * rest**2 - added, 0.0)
        total = np.sum(squares, axis=-1) + group.scatter
        variance = (total + worth * spread.known**2) / (count + worth)

    variance = np.maximum(variance, 1e-300)
    of_mean = np.maximum((variance[..., None] + added) / group.size, 1e-300)
    logs = np.sum(np.log(of_mean), axis=-1)
    within = group.scatter + worth * spread.known**2
    logs += within / variance if spread.prior is not None else 0.0
    logs += (count - len(group.size) + worth) * np.log(variance)
    return of_mean, -0.5 * logs


def _narrowed(
    run: RunHistory, groups: Sequence[Group], start: float, kind: str, scatters: Array
) -> tuple[Courses, Array]:
    """Return courses of a kind where they count, and ln of their prior.

    They are evenly spaced between the ends of a range in each row.
    """
    places = np.repeat(PLACES[kind], len(scatters))[:, None]
    scatter = np.tile(scatters, len(PLACES[kind]))[:, None]
    lowest = 0.0 if kind == RUNNING_IN else -WIDEST[kind]
    low = np.full(places.shape, lowest)
    high = np.full(places.shape, WIDEST[kind])
    inside = (np.arange(LOOKED_AT) + 0.5) / LOOKED_AT
    for _ in range(ROUNDS if groups else 0):
        size = low + (high - low) * inside
        courses = Courses(kind, size, places, scatter)
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
    courses = Courses(kind, low + (high - low) * middles, places, scatter)
    width = (high - low) / NODES[kind]
    log_prior = log_density_of_size(kind, courses.size) + np.log(width)
    log_prior += np.log(SHARE[kind] / len(PLACES[kind]))
    return courses, log_prior + _log_share_of(scatter)


def _log_share_of(scatter: Array) -> Array:
    """Return ln of the probability before of scatters, where any is known besides 0."""
    if not np.any(scatter):
        return np.zeros(np.shape(scatter))
    return np.log(np.vectorize(SCATTER.__getitem__)(scatter))


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
    run: RunHistory, blocks: data_blocks.Blocks, prior: Any, *, before: bool = False
) -> list[RunHistory]:
    """Return a run of steady rate and those whose rate drifts, that count.

    The first is the run as it is. They say how often each stands.

    Parameters
    ----------
    run : whose rate is steady
    blocks : the observations that count
    prior : of the factor on the wear coefficient
    before : whether they count as before the values were known
    """
    groups = [] if before else _groups(run, blocks)
    start = 0.0
    if groups:
        steady = grids.Posterior([run], blocks, prior)
        start = float(steady.centre[0])

    is_many = _has_many(run, blocks)
    scatters = np.array([0.0] if is_many else list(SCATTER))
    chosen: list[ScatteredCourse] = []
    parts_of_prior: list[Array] = []
    parts_of_joint: list[Array] = []
    for kind in PLACES:
        courses, log_prior = _narrowed(run, groups, start, kind, scatters)
        evidence = np.zeros(log_prior.shape)
        if groups:
            evidence = _log_evidence(run, groups, start, courses)
        chosen += courses.each()
        parts_of_prior.append(log_prior.ravel())
        parts_of_joint.append((log_prior + evidence).ravel())

    log_joint = np.concatenate(parts_of_joint)
    log_prior = np.concatenate(parts_of_prior)
    most = MAX_RUNS_OF_MANY if is_many else _most_runs(blocks)
    numbers, probability = drawn_evenly(log_joint, most)
    if is_many:
        steady_joint = _log_joint_of_steady(run, groups, start)
        is_counted = log_joint[numbers] > steady_joint - COUNTED
        numbers = numbers[is_counted]
        probability = probability[is_counted]
        if not len(numbers):
            return [run]

    runs = [replace(run, scatter=scatter) for scatter in scatters.tolist()]
    logs_of_steady = np.log(SHARE[STEADY]) + _log_share_of(scatters)
    drifting = with_courses(run, [chosen[n].course for n in numbers], blocks)
    runs += [
        replace(one, scatter=chosen[n].scatter)
        for one, n in zip(drifting, numbers, strict=True)
    ]
    logs_of_drifting = log_prior[numbers] - np.log(probability)
    logs = np.concatenate([logs_of_steady, logs_of_drifting])
    return [
        replace(one, log_weight=float(-log - np.log(len(runs))))
        for one, log in zip(runs, logs, strict=True)
    ]


def _most_runs(blocks: data_blocks.Blocks) -> int:
    """Return how many runs there may be whose rate drifts: fewer of many values."""
    values = max(sum(len(block.rows) for block in blocks), 1)
    return int(np.clip(VALUES_OF_RUNS // values, LEAST_RUNS, MAX_RUNS))


def _has_many(run: RunHistory, blocks: data_blocks.Blocks) -> bool:
    """Whether values of any block are so many that they are condensed."""
    return any(
        condensing.condenses(blocks[number], run.points[number], np.ones(1))
        for number in data_blocks.measured_blocks(blocks)
    )


def _log_joint_of_steady(
    run: RunHistory, groups: Sequence[Group], start: float
) -> float:
    """Return ln of prior times evidence of a steady rate, which is a power of 1."""
    log_share = float(np.log(SHARE[STEADY]))
    if not groups:
        return log_share
    one = Courses(POWER, np.zeros((1, 1)), np.ones((1, 1)), np.zeros((1, 1)))
    return log_share + float(_log_evidence(run, groups, start, one)[0, 0])


def drawn_evenly(log_weight: Array, most: int) -> tuple[Index, Array]:
    """Return which of some items are drawn, at most so many, and how probably each was.

    Those of large weight are drawn surely, the others in proportion to their weight
    and evenly in their order, so that sums over items drawn, each over its probability,
    are those over all but for little (Fearnhead and Clifford 2003).

    Parameters
    ----------
    log_weight : ln of weights, (n,)
    most : number of items to draw

    References
    ----------
    Fearnhead and Clifford 2003, https://doi.org/10.1111/1467-9868.00421
    """
    counted = np.flatnonzero(log_weight > log_weight.max() - COUNTED)
    weight = np.exp(log_weight[counted] - logsumexp(log_weight[counted]))
    if len(counted) <= most:
        return counted, np.ones(len(counted))

    falling = np.sort(weight)[::-1]
    rest = np.cumsum(falling[::-1])[::-1]  # of each and all smaller ones
    threshold = rest[:most] / (most - np.arange(most))
    sure = int(np.argmax(falling[:most] <= threshold))
    probability = np.minimum(weight / threshold[sure], 1.0)

    below = np.cumsum(probability)
    drawn = np.floor(below + 0.5) > np.floor(below - probability + 0.5)
    return counted[drawn], probability[drawn]
