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
from wearlab.updating import grids, kalman, likelihood, measurements
from wearlab.updating.run_curves import ObservationPoints, RunCurve, RunHistory

POWER, STRAYING, SPREAD, MEDIAN = "power", "straying", "spread", "median"
NODES, FINER = 65, 2  # of a unit's grid; times as fine as it is integrated
DEPTH = 60.0  # of a unit's log likelihood below its top that counts
REACH = 6.0  # standard deviations of the population that a unit's grid goes to
RADIUS = 4.5  # of the lattice, in standard deviations
SPACING = {1: 0.1, 2: 0.25, 3: 0.5, 4: 0.8, 5: 1.0}  # of the lattice, by its dimensions
# points between the lattice's; times as wide as the fitted law they lie
BETWEEN = 2**15
WIDER = 1.3
EDGE = (
    0.03  # probability at the lattice's edge from which it does not hold the posterior
)
MOST = 5  # unknowns that all units share
SOME = 12  # units that the law is fitted to first
GUIDES, ROUNDS, FIT = (
    64,
    12,
    16.0,
)  # points that the law is fitted with, rounds, effective points of each


class Parameter(NamedTuple):
    """Something positive that all units share: its name, its prior, and the SI value of the prior's unit."""

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
        """The last inspection [cycles]; the first cycle where there was none."""
        return float(max(self.cycles, default=self.run.start))

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
        ]
        curves = [points.curve is not self.run.limit for points in self.run.points]
        return sorted(
            numbers, key=lambda n: (not len(self.blocks[n].observed), curves[n])
        )

    def inspected(self, cycles: Array) -> Index:
        """Return how many inspections there had been by cycles."""
        count = len(self.blocks) if self.foreseen is None else self.foreseen
        at = cycles[:, None]
        cycle, later = (
            np.array(
                [(inspection.cycle, n >= count) for n, inspection in self.inspections]
            )
            .reshape(-1, 2)
            .T
        )
        return np.sum((cycle < at) | ((cycle == at) & (later == 0.0)), axis=1)

    def up_to(self, cycle: float) -> "FleetMember":
        """Return the unit with what had been measured by a cycle."""
        n = len(self.blocks) if self.foreseen is None else self.foreseen
        until = likelihood.select_by_cycle(self.blocks, self.run, np.less_equal, cycle)
        earlier = likelihood.select_by_cycle(self.blocks, self.run, np.less, cycle)
        return replace(self, blocks=(*until[:n], *earlier[n:]))


class Shared(NamedTuple):
    """What the units share, as lanes (p, 1): power b, straying ρ, sd of each block.

    And T [cycles].
    """

    power: Array
    straying: Array
    sd: tuple[Array, ...]
    reference: float

    def equal(self, cycle: float | Array) -> Array:
        """Return Λ of cycles from the start, (p, 1), or of some, (p, 1, n)."""
        power = self.power[..., None] if np.ndim(cycle) else self.power
        return np.asarray(self.reference * (cycle / self.reference) ** power)

    @property
    def rate(self) -> Array:
        """The variance of W per unit of equal wear time, (p, 1)."""
        return np.asarray(self.straying**2 / self.reference)

    def worn(self, run: RunHistory, curve: RunCurve, factor: Array) -> Array:
        """Return what is worn of a quantity at T, of a profile in the mean."""
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
        """Return the mean course of what is asked at cycles, (…, n), for factors (…)."""
        equal = self.equal(run.equal(cycle, points.clock))
        return points.curve.at(
            run.start + equal * (factor[..., None] / run.factor), column
        )


def unit_likelihood(
    unit: FleetMember, shared: Shared, log_factor: Array, *, steps: bool = False
) -> kalman.Filtered:
    """Return how probable a unit's measurements are, and what is known of its W, for lanes (p, nodes)."""
    run = unit.run
    factor = np.exp(log_factor)
    begins = [0]
    parts = []
    for points, block, sd in zip(run.points, unit.blocks, shared.sd, strict=False):
        model = shared.mean(
            run, points, factor, points.cycle[block.rows], points.column[block.rows]
        )
        parts.append(likelihood.compared(block, model, sd))
        begins.append(begins[-1] + len(block.rows))
    worn = [shared.worn(run, points.curve, factor) for points in run.points]
    when = (
        (n, inspection, shared.equal(run.equal(inspection.cycle)))
        for n, inspection in unit.inspections
    )
    times = [
        inspection._replace(
            cycle=t, values=inspection.values + begins[n], scale=worn[n]
        )
        for n, inspection, t in when
    ]
    residuals = parts[0] if len(parts) == 1 else _side_by_side(parts)
    return kalman.filtered(
        residuals, times, kalman.Filtered(), shared.rate, steps=steps
    )


def _side_by_side(parts: Sequence[kalman.Compared]) -> kalman.Compared:
    """Return residuals, variances and limits of several blocks as those of one."""
    shape = np.broadcast_shapes(*(array.shape[:-1] for part in parts for array in part))
    wide = [
        [np.broadcast_to(array, (*shape, part[0].shape[-1])) for array in part]
        for part in parts
    ]
    residual, variance, room = (
        np.concatenate(array, axis=-1) for array in zip(*wide, strict=True)
    )
    return residual, variance, room


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
        """Return what the units share at points (p, parameters)."""
        names = [parameter.name for parameter in self.parameters]
        ones = np.ones((len(theta), 1))
        columns = dict(zip(names, np.exp(theta.T)[..., None], strict=True))
        sd = tuple(
            columns.get(f"sd_{n}", value * ones) for n, value in enumerate(self.sd)
        )
        power = columns.get(POWER, np.full((1, 1), self.power))
        return Shared(
            power, columns.get(STRAYING, self.straying * ones), sd, self.reference
        )


def law_of(fleet: Fleet, prior: Distribution, units: Sequence[FleetMember]) -> Law:
    """Return what is unknown of all units together.

    Raises
    ------
    UpdateError : that is more than five numbers
    """
    options = {POWER: fleet.power, STRAYING: fleet.straying}
    sds = [block.sd for block in units[0].blocks]
    parameters = [
        Parameter(n, value)
        for n, value in options.items()
        if isinstance(value, Distribution)
    ]
    numbers = {
        n: value for n, value in options.items() if not isinstance(value, Distribution)
    }
    parameters += [
        Parameter(f"sd_{n}", sd.prior, sd.scale) for n, sd in enumerate(sds) if sd.prior
    ]
    parameters += [Parameter(SPREAD, fleet.spread), Parameter(MEDIAN, prior)]
    if len(parameters) > MOST:
        message = (
            f"{len(parameters)} numbers are unknown to all units, at most {MOST} can "
            "be: give power or "
        )
        raise measurements.UpdateError(
            f"update.population: {message}straying as a number, or an error.sd"
        )
    times = np.concatenate([unit.run.equal(unit.cycles) for unit in units])
    run = units[0].run
    reference = (
        float(np.median(times[times > 0.0]))
        if (times > 0.0).any()
        else run.end - run.start
    )
    if fleet.reference is not None:
        reference = fleet.reference * HOUR / run.seconds_per_cycle
    return Law(
        tuple(parameters), reference, sd=tuple(sd.known for sd in sds), **numbers
    )


def _likelihood_on_grid(
    unit: FleetMember, shared: Shared, ends: Array, cycles: Array | None
) -> tuple[Array, Array]:
    """Return ln f on a fine grid of a unit, (n,), and the log of its likelihood times the spacing, (p, n).

    With cycles that likelihood is of what had been measured by each of them, (cycles,
    p, n).
    """

    def log_likelihood(lanes: Shared, u: Array, cycles: Array | None = None) -> Array:
        shape = (len(lanes.straying), u.shape[1])
        filtered = unit_likelihood(unit, lanes, u, steps=cycles is not None)
        if cycles is None:
            return np.broadcast_to(filtered.log_likelihood, shape)
        gained = [
            np.broadcast_to(step.log_likelihood, shape) for step in filtered.steps
        ]
        return np.asarray(
            np.cumsum([np.zeros(shape), *gained], axis=0)[unit.inspected(cycles)]
        )

    # one lane in the middle of all: the top moves little with what the units share
    logs_of = (
        np.log(np.maximum(lane_values, 1e-300))
        for lane_values in (shared.power, shared.straying, *shared.sd)
    )
    power, straying, *sd = (
        np.exp(np.mean(logs, axis=0, keepdims=True)) for logs in logs_of
    )
    middle = Shared(power, straying, tuple(sd), shared.reference)
    top = grids.find_peaks(lambda u, _: log_likelihood(middle, u), ends[:1], ends[1:])
    centre = float(top[0][0])
    width = float(np.clip(top[1][0], 1e-4, 0.25 * (ends[1] - ends[0])))
    first, last = np.arcsinh((ends - centre) / width).tolist()
    coarse, fine = (
        np.linspace(first, last, n) for n in (NODES, FINER * (NODES - 1) + 1)
    )
    logs = log_likelihood(shared, (centre + width * np.sinh(coarse))[None], cycles)
    logs = CubicSpline(
        coarse, np.maximum(logs, logs.max(axis=-1, keepdims=True) - 1e5), axis=-1
    )(fine)
    deep = (
        (logs > logs.max(axis=-1, keepdims=True) - DEPTH)
        .reshape(-1, len(fine))
        .any(axis=0)
    )
    spacing = (
        width * np.cosh(fine) * (fine[1] - fine[0]) * grids.even_weights(len(fine))
    )
    return (centre + width * np.sinh(fine))[deep], (logs + np.log(spacing))[..., deep]


def masses(
    unit: FleetMember, law: Law, theta: Array, cycles: Array | None = None
) -> tuple[Array, ...]:
    """Return ln f of a unit, (n,), the mass there of L N(u; m, s²) over the largest, and ln of their sums.

    Masses are (…, p, n) for points (p, parameters): with cycles, of what had been
    measured by each of them.
    """
    spread = np.exp(theta[:, -2])
    median = theta[:, -1]
    ends = np.array([np.min(median - REACH * spread), np.max(median + REACH * spread)])
    _, first, lane = np.unique(
        np.round(theta[:, :-2], 10), axis=0, return_index=True, return_inverse=True
    )
    u, logs = _likelihood_on_grid(unit, law.shared(theta[first]), ends, cycles)
    z = (u - median[:, None]) / spread[:, None]
    logs = logs[..., lane.ravel(), :]
    logs -= 0.5 * z * z + np.log(spread * np.sqrt(2.0 * np.pi))[:, None]
    top = logs.max(axis=-1)
    mass = np.exp(
        np.subtract(logs, top[..., None], out=logs), out=logs
    )  # large: no copies of it
    return u, mass, top + np.log(mass.sum(axis=-1))


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
        """Return the probability of each point, (p,); without a unit."""
        logs = self.log_prior + self.log_marginal.sum(axis=0)
        return np.asarray(
            softmax(logs if without is None else logs - self.log_marginal[without])
        )

    @cached_property
    def _between(self) -> tuple[Array, Array]:
        """Scores of points between the lattice's, (q, parameters), and their probabilities, (q,).

        The posterior over the normal law that it was fitted with is smooth: its log is
        a cubic spline.
        """
        d = self.theta.shape[1]
        z = lattice(d)
        weight = self.weight()
        ratio = np.log(np.maximum(weight, 1e-300)) + 0.5 * np.sum(z * z, axis=1)
        reach = int(RADIUS // SPACING[d])
        cube = SPACING[d] * (np.indices((2 * reach + 1,) * d) - reach)
        table = ratio[cKDTree(z).query(np.moveaxis(cube, 0, -1))[1]]
        points = WIDER * ndtri(
            np.clip(qmc.Sobol(d, rng=0).random(BETWEEN), 1e-5, 1.0 - 1e-5)
        )
        logs = map_coordinates(
            table, (points / SPACING[d] + reach).T, order=3, mode="nearest"
        )
        logs -= 0.5 * (1.0 - WIDER**-2) * np.sum(points**2, axis=1)
        return points, softmax(logs)

    def parameters(self, n: int, rng: Random) -> tuple[Array, Array]:
        """Return draws of ln of the parameters, (n, parameters), and these with errors on the lattice.

        Each value of the errors takes a likelihood of its own: those of the lattice are
        few.
        """
        points, probability = self._between
        z = points[grids.equal_draws(probability, n, rng)]
        spacing = SPACING[z.shape[1]]
        errors = z.shape[1] - 2
        theta, near = (
            self.mean + scores @ self.root.T
            for scores in (z, spacing * np.round(z / spacing))
        )
        return theta, np.hstack([near[:, :errors], theta[:, errors:]])


def fit_population(units: Sequence[FleetMember], law: Law, seed: int) -> Population:
    """Return what is known of all units together.

    Parameters
    ----------
    units : with their runs and measurements
    law : what is unknown of them together
    seed : of the points that the lattice is fitted with
    """

    def log_prior(theta: Array) -> Array:
        pairs = zip(law.parameters, theta.T, strict=True)
        return np.asarray(
            sum(likelihood.log_density(p.prior, u, p.scale) for p, u in pairs)
        )

    def log_units(theta: Array, fitted_units: Sequence[FleetMember] = units) -> Array:
        nothing = np.zeros(len(theta))
        return np.stack(
            [
                masses(unit, law, theta)[2] if len(unit.cycles) else nothing
                for unit in fitted_units
            ]
        )

    thirds = np.array(
        [0.159, 0.5, 0.841]
    )  # a standard deviation about the prior's median
    low, mean, high = np.log(
        [p.scale * np.asarray(p.prior.at(thirds)) for p in law.parameters]
    ).T
    root = np.diag(0.5 * (high - low))
    temper = 0.0
    d = len(mean)
    fitted_units = units[:: max(len(units) // SOME, 1)]
    for n in range(ROUNDS):
        z = ndtri(np.clip(qmc.Sobol(d, rng=seed + n).random(GUIDES), 1e-6, 1.0 - 1e-6))
        theta = mean + z @ root.T
        log_seen = log_units(theta, fitted_units).sum(axis=0)
        log_before = log_prior(theta) + 0.5 * np.sum(z * z, axis=1)
        highest = 1.0
        for _ in range(
            30 if _surplus(1.0, log_before, log_seen) < 0.0 else 0
        ):  # not one root: from above
            middle = 0.5 * (temper + highest)
            temper, highest = (
                (middle, highest)
                if _surplus(middle, log_before, log_seen) >= 0.0
                else (temper, middle)
            )
        temper = 1.0 if highest == 1.0 else temper
        mean, root = _fitted(theta, log_before + temper * log_seen)
        if temper == 1.0 and len(fitted_units) < len(units):
            temper = len(fitted_units) / len(units)
            fitted_units = units
        elif temper == 1.0 and _surplus(1.0, log_before, log_seen) > FIT:
            break
    for _ in range(3):
        z = lattice(d)
        theta = mean + z @ root.T
        log_marginal = log_units(theta)
        cell = float(np.linalg.slogdet(root)[1]) + d * np.log(SPACING[d])
        fitted = Population(
            law,
            tuple(units),
            mean,
            root,
            theta,
            log_prior(theta) + cell,
            log_marginal,
            True,
        )
        weight = fitted.weight()
        edge = float(
            weight[np.linalg.norm(z, axis=1) > RADIUS - 0.5 * SPACING[d]].sum()
        )
        offset = np.linalg.solve(root, (weight @ theta) - mean)
        mean, fitted_root = _fitted(theta, np.log(np.maximum(weight, 1e-300)))
        ratio = np.linalg.svd(np.linalg.solve(root, fitted_root), compute_uv=False)
        if np.abs(offset).max() < 0.3 and 0.7 < ratio.min() and ratio.max() < 1.2:
            break
        root = fitted_root
    return replace(fitted, resolved=edge < EDGE)


@cache
def lattice(d: int) -> Array:
    """Return even points within `RADIUS` of 0 in ``d`` dimensions, (p, d)."""
    reach = int(RADIUS // SPACING[d])
    points = SPACING[d] * (np.indices((2 * reach + 1,) * d).reshape(d, -1).T - reach)
    return np.asarray(points[np.linalg.norm(points, axis=1) <= RADIUS])


def _surplus(share: float, log_prior: Array, log_likelihood: Array) -> float:
    """Return by how many the effective points are more than `FIT` where so much counts of what was seen."""
    return float(1.0 / np.sum(softmax(log_prior + share * log_likelihood) ** 2)) - FIT


def _fitted(theta: Array, logs: Array) -> tuple[Array, Array]:
    """Return mean and Cholesky root of the covariance of weighted points."""
    weight = softmax(logs)
    covariance = np.atleast_2d(np.cov(theta.T, aweights=weight, bias=True))
    root = np.linalg.cholesky(covariance + 1e-10 * np.eye(len(covariance)))
    return np.asarray(weight @ theta, float), np.asarray(root, float)


def factors(unit: FleetMember, law: Law, theta: Array, rng: Random) -> Array:
    """Return a draw of ln f of a unit for each of the points (n, parameters), given its measurements."""
    if not len(unit.cycles):
        return np.asarray(
            theta[:, -1] + np.exp(theta[:, -2]) * rng.standard_normal(len(theta))
        )
    points, point_numbers = np.unique(theta, axis=0, return_inverse=True)
    u, mass, _ = masses(unit, law, points)
    return grids.draws_along_grid(u, mass, point_numbers.ravel(), rng)
