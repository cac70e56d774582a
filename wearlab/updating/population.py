"""Units of one population: what each tells of the others, integrated over a lattice.

The wear coefficient of unit i is f_i times that of its run, ln f_i ~ N(m, s²); m, s,
and the errors θ that all units share are unknown. At equal wear time Λ = T (N/T)^b a
unit has worn h_i(f_i Λ) + h_i(f_i T) W; W is a Wiener process whose standard deviation
at T is ρ: wear strays by a share of itself, one for all that is measured of a unit,
each by the clock of its own wear. Then

    p(θ, m, s | y) ∝ p(θ) p(m) p(s) Π_i Z_i,   Z_i = ∫ L_i(u; θ) N(u; m, s²) du,

with L_i from the filter, exact, and its integral on a grid of the unit's own. What is
left, up to five dimensions, is summed over a lattice in the scores of a normal law
fitted to the posterior.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree
from scipy.special import logsumexp, ndtri, softmax
from scipy.stats import qmc

from wearlab.arrays import Array, Index, Random
from wearlab.campaign.distributions import Distribution
from wearlab.campaign.update_options import Fleet
from wearlab.units import HOUR
from wearlab.updating import (
    grids,
    interval_blocks,
    kalman,
    likelihood,
    measurements,
)
from wearlab.updating.run_curves import ObservationPoints, RunCurve, RunHistory

POWER, STRAYING, SPREAD, MEDIAN = "power", "straying", "spread", "median"
NODES = 65  # of a unit's grid
DEPTH = 60.0  # of a unit's log likelihood below its top that counts
FLOOR = 1e3  # of it below its top, down to which it is interpolated
REACH = 6.0  # standard deviations of the population that a unit's grid goes to
SMALLEST_SHARE = 0.1  # of its mean course that a unit is worn
STRAYED = 0.7  # of ln f below where it is so small: no course explains the unit
MAX_STRAYING = 5.0  # times itself, that the wear of units may stray by
REMEDY = (
    "look at the units and hours of its values and at update.record, leave out what is "
    "wrong (one of several sheets), or give a larger error.sd"
)
RADIUS = 4.5  # of the lattice, in standard deviations
SPACING = {1: 0.1, 2: 0.25, 3: 0.5, 4: 0.8, 5: 1.0}  # of the lattice, by its dimensions
# points between the lattice's; times as wide as the fitted law they lie
BETWEEN = 2**15
WIDER = 1.3
# probability at the lattice's edge from which it does not hold the posterior
EDGE = 0.03
MAX_SHARED = 5  # unknowns that all units share
FIRST_UNITS = 12  # that the normal law is fitted to first
FIT_POINTS = 64  # points that the normal law is fitted with in each round
FIT_ROUNDS = 12
EFFECTIVE_POINTS = 16.0  # that a round needs to be trusted
BISECTIONS = 30  # of the share of the likelihood that counts
LATTICE_ROUNDS = 3  # in which the lattice is laid anew about the posterior


class Parameter(NamedTuple):
    """Something positive that all units share.

    Parameters
    ----------
    name : what it is called in datasets
    prior : what is known of it before
    scale : SI value of the prior's unit
    """

    name: str
    prior: Distribution
    scale: float = 1.0


@dataclass(frozen=True)
class FleetMember:
    """A unit: its name, its run, and what was measured of it.

    Parameters
    ----------
    name, run, blocks : of the unit
    foreseen : block of which an inspection is foreseen: at a cycle it, and blocks after
        it, do not count yet
    """

    name: str
    run: RunHistory
    blocks: likelihood.Blocks
    foreseen: int | None = None

    @property
    def now(self) -> float:
        """The last inspection [cycles]; when it was new where there was none."""
        return float(max(self.cycles, default=self.run.new_cycle))

    @cached_property
    def inspections(self) -> list[tuple[int, kalman.Inspection]]:
        """The inspections and the block of each, in order of time.

        Those of one time in order of blocks.
        """
        numbered = enumerate(self.blocks)
        inspections = [
            (n, inspection)
            for n, block in numbered
            for inspection in likelihood.inspections_of(block, self.run, n)
        ]
        return sorted(inspections, key=lambda inspection: inspection[1].cycle)

    @cached_property
    def cycles(self) -> Array:
        """The times of inspections, rising [cycles]."""
        return np.unique([inspection.cycle for _, inspection in self.inspections])

    @property
    def whole(self) -> list[int]:
        """The blocks without places on the flank.

        What was measured, and what ends the life, first.
        """
        numbers = [
            n
            for n, block in enumerate(self.blocks)
            if block.observed.place_kind is None
            and not interval_blocks.stands_apart(block)
        ]
        curves = [points.curve is not self.run.limit for points in self.run.points]
        return sorted(
            numbers, key=lambda n: (not len(self.blocks[n].observed), curves[n])
        )

    @cached_property
    def strayed(self) -> tuple[Array, Array]:
        """Where each measurement would be but a small share of the mean course.

        They are the cycles of the measurements, and those of the run in which so much
        would be worn, (n,) each.
        """
        run = self.run
        cycles = [np.zeros(0)]
        run_cycles = [np.zeros(0)]
        for number in self.whole:
            block = self.blocks[number]
            points = run.points[number]
            value = points.curve.value[:, 0]
            if not len(block.rows) or value[-1] <= value[0]:
                continue
            worn = np.maximum(likelihood.largest_values(block) - value[0], 0.0)
            far = points.curve.first_above(value[0] + worn / SMALLEST_SHARE)
            cycle = run.equal(points.cycle[block.rows], points.clock)
            has_run = cycle > 0.0
            cycles.append(cycle[has_run])
            run_cycles.append(far[has_run] - run.start)
        return np.concatenate(cycles), np.concatenate(run_cycles)

    def largest_log_factor(self, shared: "Shared") -> float:
        """Return the ln f up to which a unit is compared, infinite without values.

        Beyond, each of its values would be but a small share of its mean course: it
        would have strayed back to almost new. A normal law does, a gear does not; and
        in nothing else do two sheets that contradict each other agree.

        Parameters
        ----------
        shared : what units share
        """
        cycle, run_cycle = self.strayed
        if not len(cycle):
            return np.inf
        ratio = cycle / shared.reference
        equal = shared.reference * np.min(ratio**shared.power, axis=0)
        largest = float(np.max(run_cycle * self.run.factor / equal))
        return float(np.log(largest)) if largest > 0.0 else np.inf

    def inspected(self, cycles: Array) -> Index:
        """Return how many inspections there had been by cycles, (cycles,).

        Parameters
        ----------
        cycles : times, (cycles,)
        """
        foreseen = self._first_foreseen
        rows = [(time.cycle, n >= foreseen) for n, time in self.inspections]
        cycle, is_later_block = np.array(rows).reshape(-1, 2).T
        at = cycles[:, None]
        now_known = (cycle == at) & (is_later_block == 0.0)
        return np.sum((cycle < at) | now_known, axis=1)

    @property
    def _first_foreseen(self) -> int:
        """The first block that is foreseen at a cycle, past the last where none is."""
        return len(self.blocks) if self.foreseen is None else self.foreseen

    def up_to(self, cycle: float) -> "FleetMember":
        """Return the unit with what had been measured by a cycle.

        Parameters
        ----------
        cycle : until which measurements count
        """
        n = self._first_foreseen
        until = likelihood.select_by_cycle(self.blocks, self.run, np.less_equal, cycle)
        earlier = likelihood.select_by_cycle(self.blocks, self.run, np.less, cycle)
        return replace(self, blocks=(*until[:n], *earlier[n:]))


class Shared(NamedTuple):
    """What the units share, as lanes.

    Parameters
    ----------
    power : b, (p, 1)
    straying : ρ, (p, 1)
    sd : of each block, (p, 1) [SI]
    reference : T [cycles]
    """

    power: Array
    straying: Array
    sd: tuple[Array, ...]
    reference: float

    def equal(self, cycle: float | Array) -> Array:
        """Return the equal wear time Λ = T (N/T)^b of cycles.

        It is (p, 1) of one cycle, (p, 1, n) of n.

        Parameters
        ----------
        cycle : N, from the start of the run
        """
        power = self.power[..., None] if np.ndim(cycle) else self.power
        return np.asarray(self.reference * (cycle / self.reference) ** power)

    @property
    def rate(self) -> Array:
        """The variance of W per unit of equal wear time, (p, 1)."""
        return np.asarray(self.straying**2 / self.reference)

    def worn(self, run: RunHistory, curve: RunCurve, factor: Array) -> Array:
        """Return what is worn of a quantity at T, of a profile in the mean.

        Parameters
        ----------
        run : the stored run
        curve : the quantity over its cycles
        factor : on the wear coefficient
        """
        cycles = run.start + self.reference * factor[..., None] / run.factor
        return np.maximum(
            curve.at(cycles, np.arange(curve.value.shape[1])).mean(axis=-1), 1e-100
        )

    def mean(
        self,
        run: RunHistory,
        points: ObservationPoints,
        factor: Array,
        cycle: Array,
        column: Any = 0,
    ) -> Array:
        """Return the mean course of a quantity at cycles, (…, n) [SI].

        Parameters
        ----------
        run : the stored run
        points : with the curve of the quantity
        factor : on the wear coefficient, (…)
        cycle : when, (n,)
        column : of the curve, of each cycle where they differ
        """
        equal = self.equal(run.equal(cycle, points.clock))
        run_cycle = run.start + equal * (factor[..., None] / run.factor)
        return points.curve.at(run_cycle, column)


def unit_likelihood(
    unit: FleetMember, shared: Shared, log_factor: Array, *, steps: bool = False
) -> kalman.Filtered:
    """Return how probable a unit's measurements are, and what is known of its W.

    Parameters
    ----------
    unit : with its measurements
    shared : what units share, lanes (p, 1)
    log_factor : ln of the factor on the wear coefficient, (p, nodes)
    steps : whether each inspection's innovation is kept
    """
    run = unit.run
    factor = np.exp(log_factor)
    begins = [0]
    parts = []
    apart: dict[int, list[Array]] = {}
    columns = zip(run.points, unit.blocks, shared.sd, strict=False)
    for number, (points, block, sd) in enumerate(columns):
        if interval_blocks.stands_apart(block):
            begins.append(begins[-1])
            if len(block.rows):
                apart[number] = interval_blocks.log_likelihoods(
                    block, run, number, shared, factor
                )
            continue
        cycle = points.cycle[block.rows]
        column = points.column[block.rows]
        model = shared.mean(run, points, factor, cycle, column)
        parts.append(likelihood.compared(block, model, sd))
        begins.append(begins[-1] + len(block.rows))

    nothing = np.zeros(0, np.intp)
    scales = [shared.worn(run, points.curve, factor) for points in run.points]
    times = [
        inspection._replace(
            cycle=shared.equal(run.equal(inspection.cycle)),
            values=inspection.values + begins[n] if n not in apart else nothing,
            offset_variance=0.0 if n in apart else inspection.offset_variance,
            scale=scales[n],
        )
        for n, inspection in unit.inspections
    ]
    residuals = _residuals_of(parts, log_factor.shape)
    before = kalman.Filtered()
    filtered = kalman.filtered(residuals, times, before, shared.rate, steps=steps)
    return _with_apart(filtered, unit, apart) if apart else filtered


def _residuals_of(
    parts: Sequence[kalman.Residuals], lanes: tuple[int, ...]
) -> kalman.Residuals:
    """Return residuals of blocks as those of one, of lanes without any value."""
    if not parts:
        return kalman.Residuals(*(np.empty((*lanes, 0)) for _ in range(3)))
    return parts[0] if len(parts) == 1 else _side_by_side(parts)


def _with_apart(
    filtered: kalman.Filtered, unit: FleetMember, apart: dict[int, list[Array]]
) -> kalman.Filtered:
    """Return what the filter knows, with the likelihood of blocks that stand apart."""
    of_inspection = {number: iter(logs) for number, logs in apart.items()}
    total = filtered.log_likelihood + sum(sum(logs) for logs in apart.values())
    innovations = []
    for step, (number, _) in zip(filtered.steps, unit.inspections, strict=False):
        if number in apart:
            log_likelihood = np.asarray(next(of_inspection[number]))
            step = replace(step, log_likelihood=log_likelihood)
        innovations.append(step)
    return replace(filtered, log_likelihood=total, steps=innovations)


def _side_by_side(parts: Sequence[kalman.Residuals]) -> kalman.Residuals:
    """Return residuals, variances and limits of several blocks as those of one."""
    shapes = [array.shape[:-1] for part in parts for array in part]
    lanes = np.broadcast_shapes(*shapes)
    wide = []
    for part in parts:
        shape = (*lanes, part.difference.shape[-1])
        wide.append([np.broadcast_to(array, shape) for array in part])
    columns = zip(*wide, strict=True)
    return kalman.Residuals(*(np.concatenate(column, axis=-1) for column in columns))


class Law(NamedTuple):
    """What is unknown of all units together, and what is known.

    Parameters
    ----------
    parameters : unknown; the errors first (``sd_`` and the number of a block), then
        spread and median
    reference : T, cycles at which f and straying are said
    power, straying : where they are known
    sd : of each block where it is known
    """

    parameters: tuple[Parameter, ...]
    reference: float
    power: float = 1.0
    straying: float = 0.0
    sd: tuple[float, ...] = (0.0,)

    def shared(self, theta: Array) -> Shared:
        """Return what the units share at points.

        Parameters
        ----------
        theta : ln of the parameters, (p, parameters)
        """
        names = [parameter.name for parameter in self.parameters]
        columns = dict(zip(names, np.exp(theta.T)[..., None], strict=True))
        ones = np.ones((len(theta), 1))
        return Shared(
            power=columns.get(POWER, np.full((1, 1), self.power)),
            straying=columns.get(STRAYING, self.straying * ones),
            sd=tuple(
                columns.get(f"sd_{n}", value * ones) for n, value in enumerate(self.sd)
            ),
            reference=self.reference,
        )


def law_of(fleet: Fleet, prior: Distribution, units: Sequence[FleetMember]) -> Law:
    """Return what is unknown of all units together.

    Parameters
    ----------
    fleet : as the campaign says it
    prior : of the median factor on the wear coefficient
    units : with their runs and measurements

    Raises
    ------
    UpdateError : that is more than five numbers
    """
    sds = [block.sd for block in units[0].blocks]
    parameters = []
    known: dict[str, float] = {}
    for name, value in ((POWER, fleet.power), (STRAYING, fleet.straying)):
        if isinstance(value, Distribution):
            parameters.append(Parameter(name, value))
        else:
            known[name] = value
    for n, sd in enumerate(sds):
        if sd.prior:
            parameters.append(Parameter(f"sd_{n}", sd.prior, sd.scale))
    parameters.append(Parameter(SPREAD, fleet.spread))
    parameters.append(Parameter(MEDIAN, prior))

    if len(parameters) > MAX_SHARED:
        message = (
            f"{len(parameters)} numbers are unknown to all units, at most {MAX_SHARED} "
            "can be: give power or straying as a number, or an error.sd"
        )
        raise measurements.UpdateError(f"update.population: {message}")
    return Law(
        tuple(parameters),
        _reference_of(fleet, units),
        sd=tuple(sd.known for sd in sds),
        **known,
    )


def _reference_of(fleet: Fleet, units: Sequence[FleetMember]) -> float:
    """Return T as the campaign says, else in the middle of inspections [cycles]."""
    run = units[0].run
    if fleet.reference is not None:
        return fleet.reference * HOUR / run.seconds_per_cycle
    times = np.concatenate([unit.run.equal(unit.cycles) for unit in units])
    worn_times = times[times > 0.0]
    return float(np.median(worn_times)) if len(worn_times) else run.end - run.start


def _likelihood_on_grid(
    unit: FleetMember, shared: Shared, ends: Array, cycles: Array | None
) -> tuple[Array, Array]:
    """Return ln f on a fine grid, and the log of the likelihood times the spacing.

    That is (p, n); with cycles it is of what had been measured by each of them,
    (cycles, p, n).
    """
    centre, width = _top_of_unit(unit, shared, ends)
    first, last = np.arcsinh((ends - centre) / width).tolist()
    coarse = np.linspace(first, last, NODES)
    fine = np.linspace(first, last, 2 * NODES - 1)

    nodes = (centre + width * np.sinh(coarse))[None]
    logs = _log_likelihood_at(unit, shared, nodes, cycles)
    logs = _with_middles(coarse, logs)

    counted = logs > logs.max(axis=-1, keepdims=True) - DEPTH
    deep = counted.reshape(-1, len(fine)).any(axis=0)
    step = fine[1] - fine[0]
    spacing = width * np.cosh(fine) * step * grids.even_weights(len(fine))
    log_factor = centre + width * np.sinh(fine)
    return log_factor[deep], (logs + np.log(spacing))[..., deep]


def _with_middles(nodes: Array, logs: Array) -> Array:
    """Return logs of a likelihood at even nodes and between them, (…, 2n − 1).

    A spline of them overshoots where the log falls steeply, by more than what stands
    at the top: between two nodes that do not count, it is the larger of theirs.

    Parameters
    ----------
    nodes : (n,)
    logs : (…, n)
    """
    top = logs.max(axis=-1, keepdims=True)
    spline = CubicSpline(nodes, np.maximum(logs, top - FLOOR), axis=-1)
    middles = spline(0.5 * (nodes[1:] + nodes[:-1]))
    larger = np.maximum(logs[..., 1:], logs[..., :-1])

    result = np.empty((*logs.shape[:-1], 2 * len(nodes) - 1))
    result[..., ::2] = logs
    result[..., 1::2] = np.where(larger > top - DEPTH, middles, larger)
    return result


def _log_likelihood_at(
    unit: FleetMember, shared: Shared, log_factor: Array, cycles: Array | None
) -> Array:
    """Return the log likelihood of a unit at ln f (1, nodes), as of each of cycles."""
    shape = (len(shared.straying), log_factor.shape[1])
    filtered = unit_likelihood(unit, shared, log_factor, steps=cycles is not None)
    if cycles is None:
        return np.broadcast_to(filtered.log_likelihood, shape)
    gained = [np.broadcast_to(step.log_likelihood, shape) for step in filtered.steps]
    so_far = np.cumsum([np.zeros(shape), *gained], axis=0)
    return np.asarray(so_far[unit.inspected(cycles)])


def _top_of_unit(unit: FleetMember, shared: Shared, ends: Array) -> tuple[float, float]:
    """Return the most probable ln f of a unit, and the width of its likelihood.

    In one lane in the middle of all: the top moves little with what the units share.
    """

    def middle(values: Array) -> Array:
        logs = np.log(np.maximum(values, 1e-300))
        return np.asarray(np.exp(np.mean(logs, axis=0, keepdims=True)))

    lane = Shared(
        power=middle(shared.power),
        straying=middle(shared.straying),
        sd=tuple(middle(sd) for sd in shared.sd),
        reference=shared.reference,
    )

    def logs_at(log_factor: Array, _: Index) -> Array:
        return _log_likelihood_at(unit, lane, log_factor, None)

    top, width = grids.find_peaks(logs_at, ends[:1], ends[1:])
    largest_width = 0.25 * (ends[1] - ends[0])
    return float(top[0]), float(np.clip(width[0], 1e-4, largest_width))


class UnitMasses(NamedTuple):
    """What is known of a unit's factor, given what the units share.

    Parameters
    ----------
    log_factor : ln f, (n,)
    mass : L N(ln f; m, s²) there over the largest, (…, p, n)
    log_marginal : ln of their sums, (…, p)
    """

    log_factor: Array
    mass: Array
    log_marginal: Array


def masses(
    unit: FleetMember, law: Law, theta: Array, cycles: Array | None = None
) -> UnitMasses:
    """Return what is known of a unit's factor at points of what the units share.

    Parameters
    ----------
    unit : with its measurements
    law : what is unknown of all units together
    theta : ln of the parameters, (p, parameters)
    cycles : (cycles,) up to each of which measurements count, the masses then being
        (cycles, p, n) [all count]
    """
    spread = np.exp(theta[:, -2])
    median = theta[:, -1]
    # the likelihood knows the errors alone
    errors = np.round(theta[:, :-2], 10)
    _, first, lane = np.unique(errors, axis=0, return_index=True, return_inverse=True)
    shared = law.shared(theta[first])
    low = np.min(median - REACH * spread)
    high = np.max(median + REACH * spread)
    # a range is left though all points lie beyond what was measured
    ends = np.array([low, max(min(high, unit.largest_log_factor(shared)), low + 1.0)])
    u, logs = _likelihood_on_grid(unit, shared, ends, cycles)

    z = (u - median[:, None]) / spread[:, None]
    log_norm = np.log(spread * np.sqrt(2.0 * np.pi))[:, None]
    logs = logs[..., lane.ravel(), :]
    logs -= 0.5 * z * z + log_norm
    top = logs.max(axis=-1)
    # large: no copies of it
    mass = np.exp(np.subtract(logs, top[..., None], out=logs), out=logs)
    return UnitMasses(u, mass, top + np.log(mass.sum(axis=-1)))


@dataclass(frozen=True)
class Population:
    """What is known of all units together.

    Parameters
    ----------
    law, units : what was asked
    mean, root : ln of the parameters at the lattice's middle, and what its scores are
        multiplied by
    theta : (p, parameters) ln of the parameters at its points
    log_prior : (p,) of the prior times the lattice's cell
    log_marginal : (units, p) ln Z of each unit
    resolved : whether the lattice holds the posterior
    """

    law: Law
    units: tuple[FleetMember, ...]
    mean: Array
    root: Array
    theta: Array
    log_prior: Array
    log_marginal: Array
    resolved: bool

    @property
    def evidence(self) -> float:
        """The log of the probability of all measurements."""
        return float(logsumexp(self.log_prior + self.log_marginal.sum(axis=0)))

    def weight(self, without: int | None = None) -> Array:
        """Return the probability of each point, (p,).

        Parameters
        ----------
        without : number of a unit whose measurements do not count
        """
        logs = self.log_prior + self.log_marginal.sum(axis=0)
        if without is not None:
            logs = logs - self.log_marginal[without]
        return np.asarray(softmax(logs))

    @cached_property
    def _between(self) -> tuple[Array, Array]:
        """Scores of points between the lattice's, and their probabilities.

        They are (q, parameters) and (q,).

        The posterior over the normal law that it was fitted with is smooth: its log is
        a cubic spline.
        """
        d = self.theta.shape[1]
        z = lattice(d)
        ratio = np.log(np.maximum(self.weight(), 1e-300)) + 0.5 * np.sum(z * z, axis=1)
        reach = int(RADIUS // SPACING[d])
        cube = SPACING[d] * (np.indices((2 * reach + 1,) * d) - reach)
        nearest = cKDTree(z).query(np.moveaxis(cube, 0, -1))[1]
        table = ratio[nearest]

        inside = np.clip(qmc.Sobol(d, rng=0).random(BETWEEN), 1e-5, 1.0 - 1e-5)
        points = WIDER * ndtri(inside)
        places = (points / SPACING[d] + reach).T
        logs = map_coordinates(table, places, order=3, mode="nearest")
        logs -= 0.5 * (1.0 - WIDER**-2) * np.sum(points**2, axis=1)
        return points, softmax(logs)

    def parameters(self, n: int, rng: Random) -> tuple[Array, Array]:
        """Return draws of ln of the parameters, and these with errors on the lattice.

        Both are (n, parameters). Each value of the errors takes a likelihood of its
        own: those of the lattice are few.

        Parameters
        ----------
        n : number of draws
        rng : of the draws
        """
        points, probability = self._between
        z = points[grids.equal_draws(probability, n, rng)]
        spacing = SPACING[z.shape[1]]
        on_lattice = spacing * np.round(z / spacing)
        theta = self.mean + z @ self.root.T
        near = self.mean + on_lattice @ self.root.T
        errors = z.shape[1] - 2
        return theta, np.hstack([near[:, :errors], theta[:, errors:]])


def fit_population(units: Sequence[FleetMember], law: Law, seed: int) -> Population:
    """Return what is known of all units together.

    Parameters
    ----------
    units : with their runs and measurements
    law : what is unknown of them together
    seed : of the points that the lattice is fitted with

    Raises
    ------
    UpdateError : the measurements contradict each other
    """
    fit, share = _fitted_law(units, law, seed)
    if share < 1.0:
        raise _contradiction("the units")
    return _on_lattice(units, law, fit)


def _contradiction(names: str) -> measurements.UpdateError:
    """Return the message that what was measured of units cannot all be true."""
    return measurements.UpdateError(
        f"update.population: what was measured of {names} contradicts itself by far "
        f"more than its errors, no course of wear explains it; {REMEDY}"
    )


def _refuse_strayed(fleet: Population, log_factors: Array) -> None:
    """Refuse units whose wear strays by far more than itself, or back to almost new.

    ``log_factors`` are the means of ln f of units at the lattice's points, (units, p).
    """
    weight = fleet.weight()
    shared = fleet.law.shared(fleet.mean[None])
    names = [
        unit.name
        for unit, mean in zip(fleet.units, log_factors @ weight, strict=True)
        if mean > unit.largest_log_factor(shared) - STRAYED
    ]
    if len(names) > 3:
        names[3:] = [f"{len(names) - 3} others"]
    if names:
        raise _contradiction(", ".join(names))
    for parameter, mean in zip(fleet.law.parameters, weight @ fleet.theta, strict=True):
        if parameter.name == STRAYING and mean > np.log(MAX_STRAYING):
            raise _contradiction("the units")


class NormalLaw(NamedTuple):
    """A normal law of ln of the parameters.

    Parameters
    ----------
    mean : (parameters,)
    root : Cholesky root of its covariance, (parameters, parameters)
    """

    mean: Array
    root: Array

    def at(self, z: Array) -> Array:
        """Return ln of the parameters at standard scores, (p, parameters)."""
        return self.mean + z @ self.root.T


def _log_prior(law: Law, theta: Array) -> Array:
    """Return the log of the prior at points, (p,)."""
    pairs = zip(law.parameters, theta.T, strict=True)
    logs = (likelihood.log_density(p.prior, u, p.scale) for p, u in pairs)
    return np.asarray(sum(logs))


def _known_of_units(
    units: Sequence[FleetMember], law: Law, theta: Array
) -> tuple[Array, Array]:
    """Return ln Z and the mean of ln f of units at points, (units, p) both.

    ln Z is 0 of a unit that was not measured, the mean that of the population.
    """
    log_marginals = []
    means = []
    for unit in units:
        log_marginal = np.zeros(len(theta))
        mean = theta[:, -1]
        if len(unit.cycles):
            known = masses(unit, law, theta)
            log_marginal = known.log_marginal
            mean = known.mass @ known.log_factor / known.mass.sum(axis=1)
        log_marginals.append(log_marginal)
        means.append(mean)
    return np.stack(log_marginals), np.stack(means)


def _prior_law(law: Law) -> NormalLaw:
    """Return the normal law that is as wide as the prior."""
    # a standard deviation about the prior's median
    thirds = np.array([0.159, 0.5, 0.841])
    quantiles = [p.scale * np.asarray(p.prior.at(thirds)) for p in law.parameters]
    low, mean, high = np.log(quantiles).T
    return NormalLaw(mean, np.diag(0.5 * (high - low)))


def _fitted_law(
    units: Sequence[FleetMember], law: Law, seed: int
) -> tuple[NormalLaw, float]:
    """Return a normal law fitted to the posterior, and what share of the data it has.

    It is fitted by importance sampling in rounds.

    So much of the likelihood counts as leaves points enough with weight, first of some
    of the units, then of all.
    """
    fit = _prior_law(law)
    d = len(fit.mean)
    share = 0.0
    fitted_units = units[:: max(len(units) // FIRST_UNITS, 1)]
    for n in range(FIT_ROUNDS):
        random = qmc.Sobol(d, rng=seed + n).random(FIT_POINTS)
        z = ndtri(np.clip(random, 1e-6, 1.0 - 1e-6))
        theta = fit.at(z)
        log_seen = _known_of_units(fitted_units, law, theta)[0].sum(axis=0)
        log_before = _log_prior(law, theta) + 0.5 * np.sum(z * z, axis=1)

        share = _largest_share(share, log_before, log_seen)
        fit = _normal_law(theta, log_before + share * log_seen)
        if share == 1.0 and len(fitted_units) < len(units):
            share = len(fitted_units) / len(units)
            fitted_units = units
        elif share == 1.0 and _surplus(1.0, log_before, log_seen) > EFFECTIVE_POINTS:
            break
    return fit, share


def _largest_share(temper: float, log_before: Array, log_seen: Array) -> float:
    """Return the largest share of the likelihood that leaves points enough with weight.

    It is between the last one and 1. There may be several: the search goes by halves.
    """
    if _surplus(1.0, log_before, log_seen) >= 0.0:
        return 1.0
    highest = 1.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (temper + highest)
        if _surplus(middle, log_before, log_seen) >= 0.0:
            temper = middle
        else:
            highest = middle
    return 1.0 if highest == 1.0 else temper


def _on_lattice(units: Sequence[FleetMember], law: Law, fit: NormalLaw) -> Population:
    """Return what is known on a lattice, laid anew where the posterior is elsewhere."""
    d = len(fit.mean)
    z = lattice(d)
    at_edge = np.linalg.norm(z, axis=1) > RADIUS - 0.5 * SPACING[d]
    for _ in range(LATTICE_ROUNDS):
        theta = fit.at(z)
        cell = float(np.linalg.slogdet(fit.root)[1]) + d * np.log(SPACING[d])
        log_marginal, log_factors = _known_of_units(units, law, theta)
        population = Population(
            law=law,
            units=tuple(units),
            mean=fit.mean,
            root=fit.root,
            theta=theta,
            log_prior=_log_prior(law, theta) + cell,
            log_marginal=log_marginal,
            resolved=True,
        )

        weight = population.weight()
        edge = float(weight[at_edge].sum())
        offset = np.linalg.solve(fit.root, (weight @ theta) - fit.mean)
        better = _normal_law(theta, np.log(np.maximum(weight, 1e-300)))
        change = np.linalg.solve(fit.root, better.root)
        ratio = np.linalg.svd(change, compute_uv=False)
        if np.abs(offset).max() < 0.3 and 0.7 < ratio.min() and ratio.max() < 1.2:
            break
        fit = better
    _refuse_strayed(population, log_factors)
    return replace(population, resolved=edge < EDGE)


@cache
def lattice(d: int) -> Array:
    """Return even points within `RADIUS` of 0, (p, d).

    Parameters
    ----------
    d : number of dimensions
    """
    reach = int(RADIUS // SPACING[d])
    points = SPACING[d] * (np.indices((2 * reach + 1,) * d).reshape(d, -1).T - reach)
    return np.asarray(points[np.linalg.norm(points, axis=1) <= RADIUS])


def _surplus(share: float, log_prior: Array, log_likelihood: Array) -> float:
    """Return by how many the effective points exceed those that a round needs.

    ``share`` is how much of the log likelihood counts.
    """
    weight = softmax(log_prior + share * log_likelihood)
    return float(1.0 / np.sum(weight**2)) - EFFECTIVE_POINTS


def _normal_law(theta: Array, logs: Array) -> NormalLaw:
    """Return the normal law with mean and covariance of weighted points."""
    weight = softmax(logs)
    covariance = np.atleast_2d(np.cov(theta.T, aweights=weight, bias=True))
    root = np.linalg.cholesky(covariance + 1e-10 * np.eye(len(covariance)))
    return NormalLaw(np.asarray(weight @ theta, float), np.asarray(root, float))


def factors(unit: FleetMember, law: Law, theta: Array, rng: Random) -> Array:
    """Return a draw of ln f of a unit for each of points, given its measurements, (n,).

    Parameters
    ----------
    unit : with its measurements
    law : what is unknown of all units together
    theta : ln of the parameters, (n, parameters)
    rng : of the draws
    """
    if not len(unit.cycles):
        spread = np.exp(theta[:, -2])
        return np.asarray(theta[:, -1] + spread * rng.standard_normal(len(theta)))
    points, rows = np.unique(theta, axis=0, return_inverse=True)
    known = masses(unit, law, points)
    return grids.draws_along_grid(known.log_factor, known.mass, rows.ravel(), rng)
