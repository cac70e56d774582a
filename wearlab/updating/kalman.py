"""A scalar Kalman filter: measurements whose errors are shared or accumulate.

The wear strays from the model's by a Wiener process W whose variance grows by ``rate``
a cycle; an inspection sees it with one offset of its own and one independent error a
value, y = m + a W + offset + error; a is the scale of what is measured, by which
quantities of one unit stray together. The values of one inspection are replaced by
their weighted mean, which is sufficient for W. Values below a limit of detection come
after the others: given what an inspection's values share, u, they are independent, so
that p(y) = p(those seen) E[Π Φ((limit − m − u)/σ)], one integral over u for each
inspection. Afterwards u is replaced by the normal law of equal mean and variance, which
is exact without a drift.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import hermite_e, legendre
from scipy.special import log_ndtr, logsumexp

from wearlab.arrays import Array, Flags, Index, Random
from wearlab.campaign.update_options import ErrorModel

LOG_TWO_PI = float(np.log(2.0 * np.pi))
REACH = 7.0  # standard deviations of u that are integrated over
SCORINGS = 12  # steps to the top of a gain's law
GAIN_NODES = 20  # points over that law
PANELS = 14  # of the integral over u, each with so many points
POINTS = 6
MAX_PANELS = 280  # for u that is spread far wider than the values' errors


class Inspection(NamedTuple):
    """The values taken at one time, of one quantity.

    Parameters
    ----------
    cycle : when [cycles], of each lane where they differ
    values : which
    offset_variance : of the error that they share
    scale : of the quantity over W, of each lane where they differ
    """

    cycle: Any
    values: Index
    offset_variance: float = 0.0
    scale: Any = 1.0


Inspections = Sequence[Inspection]


class Residuals(NamedTuple):
    """Values beside a model; leading dimensions are lanes, and are broadcast.

    Parameters
    ----------
    difference : (…, n) measured minus model, 0 of values that were not seen [SI]
    variance : (…, n) or (…, 1) of the independent errors
    room : (…, n) limit of detection minus model, NaN of values that were seen [SI]
    """

    difference: Array
    variance: Array
    room: Array


class WeightedSums(NamedTuple):
    """Sums over values with residuals r, variances v and loadings a.

    Parameters
    ----------
    square : Σ r²/v, None where it follows from the next two
    cross : Σ a r/v
    precision : Σ a²/v
    logs : Σ ln 2πv
    """

    square: Array | None
    cross: Array
    precision: Array
    logs: Array


class StateUpdate(NamedTuple):
    """What values tell of a state.

    Parameters
    ----------
    surprise : by how much they are off, over the standard deviation expected
    chi_square : sum of all squared standard differences
    log_likelihood : of the values
    mean, variance : of the state afterwards
    """

    surprise: Any
    chi_square: Any
    log_likelihood: Any
    mean: Any
    variance: Any


@dataclass(frozen=True)
class Innovation:
    """One inspection, seen from those before it.

    Parameters
    ----------
    count : of its values, without those below a limit of detection
    surprise : difference of its mean from what was expected, over the standard
        deviation expected
    chi_square : sum of all squared standard differences of its values
    log_likelihood : of its values, given those before
    mean, variance : of W after it
    """

    count: int
    surprise: Array
    chi_square: Array
    log_likelihood: Array
    mean: Array
    variance: Array


@dataclass
class Filtered:
    """What the filter knows after the last inspection, of every lane.

    Parameters
    ----------
    log_likelihood : of all values
    mean, variance : of W
    cycle : of the last inspection, of each lane where they differ
    steps : the innovation of each inspection, where it was asked for
    """

    log_likelihood: Any = 0.0
    mean: Any = 0.0
    variance: Any = 0.0
    cycle: Any = 0.0
    steps: list[Innovation] = field(default_factory=list)

    def drawn(self, cycle: Any, rate: Any, rng: Random) -> Array:
        """Return a draw of W at a later cycle for each lane.

        Parameters
        ----------
        cycle : when [cycles]
        rate : variance of W per cycle
        rng : of the draws
        """
        spread = np.sqrt(self.variance + rate * (cycle - self.cycle))
        return np.asarray(self.mean + spread * rng.standard_normal(np.shape(self.mean)))


def filtered(
    residuals: Residuals,
    times: Inspections,
    state: Filtered,
    rate: Any,
    loading: Any = None,
    steps: bool = False,
    tails: Any = None,
) -> Filtered:
    """Return the likelihood of residuals and what is known of W.

    Parameters
    ----------
    residuals : values beside the model
    times : inspections in order of time
    state : of W before
    rate : variance of W per cycle
    loading : (…, n) by which W and the offset count in a value [1]
    steps : whether each inspection's innovation is kept
    tails : scales of variances of errors that are Student-t (`tails.Tails`) [normal]
    """
    lanes = _lanes_of(residuals, rate, loading)
    censored = censored_values(residuals.room)
    # each grows to the lanes that it depends on
    total = state.log_likelihood
    mean = state.mean
    variance = state.variance
    last = state.cycle
    innovations: list[Innovation] = []
    for time in times:
        # W and the offset, as expected
        scale = time.scale
        expected = scale * mean
        before_variance = scale**2 * (variance + rate * (time.cycle - last))
        shared_variance = before_variance + time.offset_variance
        last = time.cycle

        measured = time.values[~censored[time.values]]
        under = time.values[censored[time.values]]
        nothing = np.zeros(1)[0]
        update = StateUpdate(nothing, nothing, nothing, expected, shared_variance)
        if len(measured):
            update = _updated(
                residuals, measured, loading, expected, shared_variance, tails
            )
        if len(under):
            update = _with_limits(residuals, under, update, lanes)
            if not len(measured):
                surprise = _surprise_of_limits(
                    residuals, under, expected, update.mean, shared_variance, lanes
                )
                update = update._replace(surprise=surprise)

        # what they share is W and the offset; 0 where nothing is unknown before
        gain = before_variance / np.maximum(shared_variance, 1e-300)
        total = total + update.log_likelihood
        mean = (expected + gain * (update.mean - expected)) / scale
        kept_variance = before_variance * (1.0 - gain) + gain**2 * update.variance
        variance = kept_variance / scale**2
        if steps:
            after = update._replace(mean=mean, variance=variance)
            innovations.append(_innovation(len(measured), after, lanes))
    return Filtered(
        np.broadcast_to(total, lanes),
        np.broadcast_to(mean, lanes),
        np.broadcast_to(variance, lanes),
        last,
        innovations,
    )


def _updated(
    residuals: Residuals,
    measured: Index,
    loading: Any,
    expected: Any,
    shared_variance: Any,
    tails: Any,
) -> StateUpdate:
    """Return what the values of an inspection tell of the state."""
    if tails is None:
        sums = _weighted_sums(residuals, measured, loading)
        return update_state(expected, shared_variance, sums)
    updates = []
    for scale in tails.variance:
        wider = residuals._replace(variance=scale * residuals.variance)
        sums = _weighted_sums(wider, measured, loading)
        updates.append(update_state(expected, shared_variance, sums))
    return tails.mixed(updates)


def _lanes_of(residuals: Residuals, rate: Any, loading: Any) -> tuple[int, ...]:
    """Return the shape of all lanes."""
    shapes = [residuals.difference.shape[:-1], residuals.variance.shape[:-1]]
    if loading is not None:
        shapes.append(loading.shape[:-1])
    return np.broadcast_shapes(*shapes, np.shape(rate))


def _with_limits(
    residuals: Residuals, under: Index, update: StateUpdate, lanes: tuple[int, ...]
) -> StateUpdate:
    """Return what is known once values that are only known to be below count, too."""
    mean = np.broadcast_to(update.mean, lanes)
    spread = np.sqrt(np.broadcast_to(update.variance, lanes))
    log_below, mean, variance = below_limits(
        residuals.room, residuals.variance, under, mean, spread
    )
    log_likelihood = update.log_likelihood + log_below
    return update._replace(log_likelihood=log_likelihood, mean=mean, variance=variance)


def _surprise_of_limits(
    residuals: Residuals,
    under: Index,
    expected: Any,
    mean: Array,
    shared_variance: Any,
    lanes: tuple[int, ...],
) -> Array:
    """Return by how much values below limits move what they share, standardised."""
    variance = residuals.variance
    first = variance[..., 0 if variance.shape[-1] == 1 else under[0]]
    whole = np.broadcast_to(shared_variance, lanes) + first
    return np.asarray((mean - expected) / np.sqrt(whole))


def _innovation(count: int, update: StateUpdate, lanes: tuple[int, ...]) -> Innovation:
    """Return an inspection seen from those before it, of all lanes."""
    parts = (np.broadcast_to(np.asarray(part, float), lanes) for part in update)
    return Innovation(count, *parts)


def censored_values(room: Array) -> Flags:
    """Return which values are known by a limit alone, (n,).

    Parameters
    ----------
    room : limits minus model, NaN of values that were seen, (…, n)
    """
    return np.asarray(~np.isnan(room[(0,) * (room.ndim - 1)]))


def _weighted_sums(
    residuals: Residuals, values: Index, loading: Array | None
) -> WeightedSums:
    """Return the sums over some values with their loadings.

    Of one value there is no first: it is what follows from the other two, without what
    rounding leaves.
    """
    n = len(values)
    r = residuals.difference[..., values]
    v = residuals.variance
    v = v if v.shape[-1] == 1 else v[..., values]
    a = np.ones(1) if loading is None else loading[..., values]

    def whole(terms: Array) -> Array:
        return np.asarray(terms.sum(axis=-1) * (n / terms.shape[-1]))

    if n == 1 and loading is None:
        v = v[..., 0]
        return WeightedSums(None, r[..., 0] / v, 1.0 / v, np.log(v) + LOG_TWO_PI)
    return WeightedSums(
        square=None if n == 1 else whole(r * r / v),
        cross=whole(a * r / v),
        precision=whole(a * a / v),
        logs=whole(np.log(v) + LOG_TWO_PI),
    )


def update_state(mean: Any, variance: Any, sums: WeightedSums) -> StateUpdate:
    """Return what values tell of a state.

    With x the state that fits best, chi² = Σ r²/v − (Σ a r/v)²/Σ a²/v + (x −
    mean)²/(variance + 1/Σ a²/v), in which nothing large cancels where the model is far
    off.

    Parameters
    ----------
    mean, variance : of the state before
    sums : over the values
    """
    square, cross, precision, logs = sums
    safe_precision = np.maximum(precision, 1e-300)
    fits = cross / safe_precision
    expected = variance + 1.0 / safe_precision
    scale = 1.0 + variance * precision
    off = fits - mean
    chi = off * off / expected
    chi = chi if square is None else chi + (square - cross * fits)
    return StateUpdate(
        surprise=off / np.sqrt(expected),
        chi_square=chi,
        log_likelihood=-0.5 * (chi + (logs + np.log(scale))),
        mean=mean + variance / expected * off,
        variance=variance / scale,
    )


def with_gain(
    value: Array, model: Array, variance: Array, times: Inspections, error: ErrorModel
) -> Filtered:
    """Return the likelihood of values whose model has an unknown gain, and its law.

    The gain is N(1, s²) before: a state that does not move, by which the model counts
    in each value. Of errors in parts of what is measured the variance grows with the
    gain: its law is then integrated over, up to each inspection.

    Parameters
    ----------
    value, model : (…, n) measured, and the model
    variance : (…, n) or (…, 1) of the independent errors, without those in parts of the
        value
    times : inspections in order of time
    error : with s, and the standard error in parts of gain times model
    """
    state = Filtered(0.0, 1.0, error.gain_sd**2)
    no_limits = np.full_like(value, np.nan)
    if not error.relative or not times:
        residuals = Residuals(value, variance, no_limits)
        return filtered(residuals, times, state, 0.0, model, steps=True)

    v = np.broadcast_to(variance, np.broadcast_shapes(variance.shape, model.shape))
    laws = []
    for n in range(len(times)):
        until = np.concatenate([time.values for time in times[: n + 1]])
        laws.append(
            _integrated_over_gain(
                value[..., until], model[..., until], v[..., until], error
            )
        )

    v = v + (error.relative * laws[-1].mean[..., None] * model) ** 2
    residuals = Residuals(value, v, no_limits)
    result = filtered(residuals, times, state, 0.0, model, steps=True)
    earlier = np.zeros(())
    for n, law in enumerate(laws):
        result.steps[n] = replace(
            result.steps[n],
            log_likelihood=law.log_likelihood - earlier,
            mean=law.mean,
            variance=law.variance,
        )
        earlier = law.log_likelihood
    return Filtered(*laws[-1], result.cycle, result.steps)


class GainLaw(NamedTuple):
    """What is known of a gain.

    Parameters
    ----------
    log_likelihood : of the values
    mean, variance : of the gain
    """

    log_likelihood: Array
    mean: Array
    variance: Array


def _integrated_over_gain(
    value: Array, model: Array, variance: Array, error: ErrorModel
) -> GainLaw:
    """Return ln ∫ Π N(y; γ m, v) N(γ; 1, s²) dγ, and mean and variance of γ.

    Here v = variance + (r γ m)².

    By Gauss and Hermite's rule about the top, which Fisher's scoring finds.
    """
    top, width = _top_of_gain(value, model, variance, error)
    nodes, weights = hermite_e.hermegauss(GAIN_NODES)
    gains = [top + width * node for node in nodes]
    logs = []
    for gain, node, weight in zip(gains, nodes, weights, strict=True):
        m = gain[..., None] * model
        v = variance + (error.relative * m) ** 2
        misfit = np.sum((value - m) ** 2 / v + np.log(v) + LOG_TWO_PI, axis=-1)
        off = misfit + ((gain - 1.0) / error.gain_sd) ** 2
        log_prior_norm = np.log(error.gain_sd)
        logs.append(
            0.5 * (node**2 - off) - log_prior_norm - 0.5 * LOG_TWO_PI + np.log(weight)
        )

    total = logsumexp(logs, axis=0)
    mass = np.exp(np.array(logs) - total)
    mean = np.sum(mass * gains, axis=0)
    spread = np.sum(mass * (np.array(gains) - mean) ** 2, axis=0)
    return GainLaw(total + np.log(width), mean, spread)


def _top_of_gain(
    value: Array, model: Array, variance: Array, error: ErrorModel
) -> tuple[Array, Array]:
    """Return the most probable gain, by Fisher's scoring, and the width of its law."""
    gain = np.ones(model.shape[:-1])
    part = (error.relative * model) ** 2
    prior_variance = error.gain_sd**2
    for _ in range(SCORINGS):
        v = variance + gain[..., None] ** 2 * part
        r = value - gain[..., None] * model
        rise = gain[..., None] * part / v  # half of the slope of ln v
        slope = model * r / v + (r * r / v - 1.0) * rise
        total_slope = np.sum(slope, axis=-1) - (gain - 1.0) / prior_variance
        information = np.sum(model**2 / v + 2.0 * rise**2, axis=-1)
        information = information + 1.0 / prior_variance
        gain = gain + total_slope / information
    return gain, information**-0.5


def below_limits(
    room: Array, variance: Array, values: Index, mean: Array, spread: Array
) -> tuple[Array, Array, Array]:
    """Return log probability that values are below, and mean and variance of u then.

    Parameters
    ----------
    room : (…, n) limits minus model
    variance : (…, n) or (…, 1) of the independent errors
    values : which of the n are meant
    mean, spread : (…) mean and standard deviation of u before
    """
    columns = [0 if variance.shape[-1] == 1 else value for value in values]
    value_sds = [np.sqrt(variance[..., column]) for column in columns]
    if len(values) == 1:
        return _below_one_limit(room[..., values[0]], value_sds[0], mean, spread)

    ratio = max(float(np.max(spread / sd)) for sd in value_sds)
    panels = int(np.clip(PANELS * np.ceil(0.5 * ratio), PANELS, MAX_PANELS))
    z, logs = _normal_rule(panels)
    u = mean[..., None] + spread[..., None] * z
    for value, sd in zip(values, value_sds, strict=True):
        logs = logs + log_ndtr((room[..., value][..., None] - u) / sd[..., None])
    log_probability = logsumexp(logs, axis=-1)
    weight = np.exp(logs - log_probability[..., None])
    mean_below = np.sum(weight * u, axis=-1)
    variance_below = np.sum(weight * (u - mean_below[..., None]) ** 2, axis=-1)
    return log_probability, mean_below, variance_below


def _below_one_limit(
    room: Array, sd: Array, mean: Array, spread: Array
) -> tuple[Array, Array, Array]:
    """Return what `below_limits` does of one value, in closed form."""
    total_sd = np.hypot(sd, spread)
    a = (room - mean) / total_sd
    log_probability = log_ndtr(a)
    hazard = np.exp(-0.5 * a * a - 0.5 * LOG_TWO_PI - log_probability)
    left = 1.0 - (spread / total_sd) ** 2 * hazard * (a + hazard)
    mean_below = mean - spread**2 / total_sd * hazard
    return log_probability, mean_below, spread**2 * left


@cache
def _normal_rule(panels: int) -> tuple[Array, Array]:
    """Return points of a standard normal variable, and logs of their probabilities."""
    nodes, weights = legendre.leggauss(POINTS)
    edges = np.linspace(-REACH, REACH, panels + 1)
    half = 0.5 * np.diff(edges)[:, None]
    z = (0.5 * (edges[1:] + edges[:-1])[:, None] + half * nodes).ravel()
    weight = (half * weights).ravel() * np.exp(-0.5 * z * z)
    return z, np.log(weight / weight.sum())


def smoothed_paths(
    steps: list[Innovation], times: Inspections, rate: Array, rng: Random
) -> Array:
    """Return draws of W at the inspections given all of them, (inspections, …).

    They are drawn backwards, from the last inspection on.

    Parameters
    ----------
    steps : the innovation of each inspection
    times : the inspections
    rate : variance of W per cycle
    rng : of the draws
    """
    paths = np.empty((len(steps), *np.shape(steps[-1].mean)))
    for t in reversed(range(len(steps))):
        mean = steps[t].mean
        variance = steps[t].variance
        if t + 1 < len(steps):
            ahead = rate * (times[t + 1].cycle - times[t].cycle)
            with np.errstate(divide="ignore", invalid="ignore"):
                gain = np.where(variance > 0.0, variance / (variance + ahead), 0.0)
            mean = mean + gain * (paths[t + 1] - mean)
            variance = np.maximum(variance * (1.0 - gain), 0.0)
        paths[t] = mean + np.sqrt(variance) * rng.standard_normal(mean.shape)
    return paths
