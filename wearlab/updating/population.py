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
from typing import NamedTuple

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree
from scipy.special import logsumexp, ndtri, softmax
from scipy.stats import qmc

from wearlab.arrays import Array, Random
from wearlab.campaign.distributions import Distribution
from wearlab.campaign.update_options import Fleet
from wearlab.units import HOUR
from wearlab.updating import data_blocks, grids, measurements
from wearlab.updating.fleet_law import MEDIAN, POWER, SPREAD, STRAYING, Law, Parameter
from wearlab.updating.fleet_members import FleetMember
from wearlab.updating.unit_factors import masses_by_reading

STRAYED = 0.7  # of ln f below where it is so small: no course explains the unit
MAX_STRAYING = 5.0  # times itself, that the wear of units may stray by
# units with sheets that contradict each other, and their share of those with several,
# above which it is not the sheets that are wrong
MAX_DOUBTED = 2
MAX_DOUBTED_SHARE = 0.5
REMEDY = (
    "look at the units and hours of its values and at update.record, leave out what is "
    "wrong (one of several sheets), or give a larger error.sd"
)
MAX_SHARED = 5  # unknowns that all units share
RADIUS = 4.5  # of the lattice, in standard deviations
SPACING = {1: 0.1, 2: 0.25, 3: 0.5, 4: 0.8, 5: 1.0}  # of the lattice, by its dimensions
# points between the lattice's; times as wide as the fitted law they lie
BETWEEN = 2**15
WIDER = 1.3
# probability at the lattice's edge from which it does not hold the posterior
EDGE = 0.03
FIRST_UNITS = 12  # that the normal law is fitted to first
FIT_POINTS = 64  # points that the normal law is fitted with in each round
FIT_ROUNDS = 12
EFFECTIVE_POINTS = 16.0  # that a round needs to be trusted
BISECTIONS = 30  # of the share of the likelihood that counts
LATTICE_ROUNDS = 3  # in which the lattice is laid anew about the posterior


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
    law = Law(
        tuple(parameters),
        _reference_of(fleet, units),
        sd=tuple(sd.known for sd in sds),
    )
    return law._replace(
        power=known.get(POWER, law.power), straying=known.get(STRAYING, law.straying)
    )


def _reference_of(fleet: Fleet, units: Sequence[FleetMember]) -> float:
    """Return T as the campaign says, else in the middle of inspections [cycles]."""
    run = units[0].run
    if fleet.reference is not None:
        return fleet.reference * HOUR / run.seconds_per_cycle
    times = np.concatenate([unit.run.equal(unit.cycles) for unit in units])
    worn_times = times[times > 0.0]
    return float(np.median(worn_times)) if len(worn_times) else run.end - run.start


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
    by_reading : of each unit (readings, p) ln Z of each reading of its sheets
    resolved : whether the lattice holds the posterior
    """

    law: Law
    units: tuple[FleetMember, ...]
    mean: Array
    root: Array
    theta: Array
    log_prior: Array
    by_reading: tuple[Array, ...]
    resolved: bool

    @cached_property
    def log_marginal(self) -> Array:
        """The logs of Z of each unit, whichever of its sheets are sound, (units, p)."""
        return np.stack([_of_all(logs) for logs in self.by_reading])

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

    def weight_of_reading(self, number: int, reading: int) -> Array:
        """Return how probable each point is together with a reading of a unit, (p,).

        Parameters
        ----------
        number : of the unit
        reading : number of the reading
        """
        log_share = self.by_reading[number][reading] - self.log_marginal[number]
        return np.asarray(self.weight() * np.exp(log_share))

    def reading_probabilities(self, number: int) -> Array:
        """Return how probable each reading of a unit's sheets is, (readings,).

        Parameters
        ----------
        number : of the unit
        """
        readings = range(len(self.by_reading[number]))
        return np.array([self.weight_of_reading(number, n).sum() for n in readings])

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


def _refuse_strayed(fleet: Population, means: Sequence[Array]) -> None:
    """Refuse units whose wear strays by far more than itself, or back to almost new.

    Or most of whose sheets contradict each other. ``means`` are those of ln f of units
    by each reading at the lattice's points, (readings, p) each.
    """
    weight = fleet.weight()
    shared = fleet.law.shared(fleet.mean[None])
    strayed = []
    doubted = []
    for number, unit in enumerate(fleet.units):
        likeliest = int(np.argmax(fleet.reading_probabilities(number)))
        reading = unit.readings[likeliest]
        mean = means[number][likeliest] @ weight
        if mean > reading.unit.largest_log_factor(shared) - STRAYED:
            strayed.append(unit.name)
        if reading.aside is not None:
            doubted.append(unit.name)

    several = sum(len(unit.readings) > 1 for unit in fleet.units)
    if len(doubted) > max(MAX_DOUBTED, MAX_DOUBTED_SHARE * several):
        strayed = doubted
    if len(strayed) > 3:
        strayed[3:] = [f"{len(strayed) - 3} others"]
    if strayed:
        raise _contradiction(", ".join(strayed))
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
    logs = (data_blocks.log_density(p.prior, u, p.scale) for p, u in pairs)
    return np.asarray(sum(logs))


class UnitKnowledge(NamedTuple):
    """What is known of a unit at points of what all share.

    Parameters
    ----------
    log_marginal : ln Z by each reading of its sheets, (readings, p); 0 of a unit that
        was not measured
    mean : of ln f by each, (readings, p)
    """

    log_marginal: Array
    mean: Array


def _known_of_units(
    units: Sequence[FleetMember], law: Law, theta: Array
) -> list[UnitKnowledge]:
    """Return what is known of units at points (p, parameters)."""
    known = []
    for unit in units:
        by_reading = masses_by_reading(unit, law, theta) if len(unit.cycles) else []
        log_marginal = [one.log_marginal for one in by_reading]
        mean = [one.mass @ one.log_factor / one.mass.sum(axis=1) for one in by_reading]
        unmeasured = UnitKnowledge(np.zeros((1, len(theta))), theta[None, :, -1])
        measured = UnitKnowledge(np.array(log_marginal), np.array(mean))
        known.append(measured if by_reading else unmeasured)
    return known


def _of_all(log_marginal: Array) -> Array:
    """Return ln Z of a unit, whichever of its sheets are sound, (p,)."""
    if len(log_marginal) == 1:
        return log_marginal[0]
    return np.asarray(logsumexp(log_marginal, axis=0))


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
        known = _known_of_units(fitted_units, law, theta)
        log_seen = np.sum([_of_all(one.log_marginal) for one in known], axis=0)
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
        known = _known_of_units(units, law, theta)
        population = Population(
            law=law,
            units=tuple(units),
            mean=fit.mean,
            root=fit.root,
            theta=theta,
            log_prior=_log_prior(law, theta) + cell,
            by_reading=tuple(one.log_marginal for one in known),
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
    _refuse_strayed(population, [one.mean for one in known])
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
