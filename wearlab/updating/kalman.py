"""How probable measurements are when their errors are shared or accumulate: a scalar Kalman filter.

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
SCORINGS, GAIN_NODES = 12, 20  # steps to the top of a gain's law, and points over it
PANELS, POINTS, FINEST = (
    14,
    6,
    280,
)  # of the integral over u; the last for u that is spread far wider


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
Compared = tuple[
    Array, Array, Array
]  # measured minus model, variance of errors, limit minus model
Sums = tuple[Array | None, Array, Array, Array]  # Σ r²/v, Σ a r/v, Σ a²/v, Σ ln 2πv


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
    """What the filter knows after the last inspection.

    Every array has the shape of the lanes.

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
        """Return a draw of W at a later cycle for each lane."""
        spread = np.sqrt(self.variance + rate * (cycle - self.cycle))
        return np.asarray(self.mean + spread * rng.standard_normal(np.shape(self.mean)))


def filtered(
    values_compared: Compared,
    times: Inspections,
    state: Filtered,
    rate: Any,
    loading: Any = None,
    steps: bool = False,
) -> Filtered:
    """Return the likelihood of residuals and what is known of W.

    Parameters
    ----------
    values_compared : (…, n) measured minus model, leading dimensions being lanes; (…, n) or (…, 1)
        variance of the independent errors, lanes being broadcast; (…, n) limit minus
        model of values of which only a limit is known, NaN of those that were seen
    times : inspections in order of time
    state : of W before
    rate : variance of W per cycle
    loading : (…, n) by which W and the offset count in a value [1]
    steps : whether each inspection's innovation is kept
    """
    (residual, variance, room) = values_compared
    a = np.ones(1) if loading is None else loading
    lanes = np.broadcast_shapes(
        *(part.shape[:-1] for part in (residual, variance, a)), np.shape(rate)
    )
    limited = censored_values(room)
    # each grows to the lanes that it depends on
    total = state.log_likelihood
    mean = state.mean
    spread = state.variance
    last = state.cycle
    innovations: list[Innovation] = []
    for cycle, values, offset_variance, scale in times:
        expected = scale * mean
        before_spread = scale**2 * (spread + rate * (cycle - last))
        # of W and the offset
        last = cycle
        shared = expected
        shared_spread = before_spread + offset_variance
        whole = shared_spread
        (off, chi, gained) = np.zeros((3, 1))[:, 0]
        under = values[limited[values]]
        measured = values[~limited[values]]
        if len(measured):
            sums = _weighted_sums(residual, variance, measured, loading)
            off, chi, gained, shared, shared_spread = update_state(
                shared, shared_spread, sums
            )
        if len(under):
            wide = [np.broadcast_to(part, lanes) for part in (shared, shared_spread)]
            log_below, shared, shared_spread = below_limits(
                room, variance, under, wide[0], np.sqrt(wide[1])
            )
            gained = gained + log_below
            if not len(measured):
                first = variance[..., 0 if variance.shape[-1] == 1 else under[0]]
                off = (shared - expected) / np.sqrt(wide[1] + first)
        gain = before_spread / np.maximum(
            whole, 1e-300
        )  # 0 where nothing is unknown before
        total = total + gained
        mean = (expected + gain * (shared - expected)) / scale
        spread = (before_spread * (1.0 - gain) + gain**2 * shared_spread) / scale**2
        if steps:
            parts = (
                np.broadcast_to(np.asarray(e, float), lanes)
                for e in (off, chi, gained, mean, spread)
            )
            innovations.append(Innovation(len(measured), *parts))
    total = np.broadcast_to(total, lanes)
    mean = np.broadcast_to(mean, lanes)
    spread = np.broadcast_to(spread, lanes)
    return Filtered(total, mean, spread, last, innovations)


def censored_values(room: Array) -> Flags:
    """Return which values are known by a limit alone."""
    return np.asarray(~np.isnan(room[(0,) * (room.ndim - 1)]))


def _weighted_sums(
    residual: Array, variance: Array, values: Index, loading: Array | None
) -> Sums:
    """Return Σ r²/v, Σ a r/v, Σ a²/v and Σ ln 2πv of some values with their loadings a.

    Of one value there is no first: it is what follows from the other two, without what
    rounding leaves.
    """
    r = residual[..., values]
    n = len(values)
    v = variance if variance.shape[-1] == 1 else variance[..., values]
    a = np.ones(1) if loading is None else loading[..., values]

    def whole(terms: Array) -> Array:
        return np.asarray(terms.sum(axis=-1) * (n / terms.shape[-1]))

    if n == 1 and loading is None:
        return (
            None,
            r[..., 0] / v[..., 0],
            1.0 / v[..., 0],
            np.log(v[..., 0]) + LOG_TWO_PI,
        )
    square = None if n == 1 else whole(r * r / v)
    return square, whole(a * r / v), whole(a * a / v), whole(np.log(v) + LOG_TWO_PI)


def update_state(
    mean: Any, spread: Any, sums: Sums
) -> tuple[Array, Array, Array, Array, Array]:
    """Return what values tell of a state: surprise, chi², their log likelihood, its mean and variance after.

    With x the state that fits best, chi² = Σ r²/v − (Σ a r/v)²/Σ a²/v + (x −
    mean)²/(spread + 1/Σ a²/v), in which nothing large cancels where the model is far
    off.

    Parameters
    ----------
    mean, spread : of the state before, and its variance
    sums : Σ r²/v, Σ a r/v, Σ a²/v, Σ ln 2πv
    """
    square, cross, precision, logs = sums
    safe_precision = np.maximum(precision, 1e-300)
    fits = cross / safe_precision
    expected = spread + 1.0 / safe_precision
    scale = 1.0 + spread * precision
    off = fits - mean
    chi = off * off / expected
    chi = chi if square is None else chi + (square - cross * fits)
    likelihood = -0.5 * (chi + (logs + np.log(scale)))
    return (
        off / np.sqrt(expected),
        chi,
        likelihood,
        mean + spread / expected * off,
        spread / scale,
    )


def with_gain(
    value: Array, model: Array, variance: Array, times: Inspections, error: ErrorModel
) -> Filtered:
    """Return the likelihood of values whose model has an unknown gain, N(1, s²), and the gain's law.

    It is a state that does not move, by which the model counts in each value. Of errors
    in parts of what is measured the variance grows with the gain: its law is then
    integrated over, up to each inspection.

    Parameters
    ----------
    value, model : (…, n) measured, and the model
    variance : (…, n) or (…, 1) of the independent errors, without those in parts of the
        value
    times : inspections in order of time
    error : with s, and the standard error in parts of gain times model
    """
    state = Filtered(0.0, 1.0, error.gain_sd**2)
    room = np.full_like(value, np.nan)
    if not error.relative or not times:
        return filtered((value, variance, room), times, state, 0.0, model, steps=True)
    v = np.broadcast_to(variance, np.broadcast_shapes(variance.shape, model.shape))
    until = [
        np.concatenate([inspection.values for inspection in times[: n + 1]])
        for n in range(len(times))
    ]
    laws = [
        _integrated_over_gain(value[..., n], model[..., n], v[..., n], error)
        for n in until
    ]
    v = v + (error.relative * laws[-1][1][..., None] * model) ** 2
    result = filtered((value, v, room), times, state, 0.0, model, steps=True)
    earlier = np.zeros(())
    for n, (logs, mean, spread) in enumerate(laws):
        result.steps[n] = replace(
            result.steps[n], log_likelihood=logs - earlier, mean=mean, variance=spread
        )
        earlier = logs
    return Filtered(*laws[-1], result.cycle, result.steps)


def _integrated_over_gain(
    y: Array, model: Array, variance: Array, error: ErrorModel
) -> tuple[Array, Array, Array]:
    """Return ln ∫ Π N(y; γ m, v) N(γ; 1, s²) dγ with v = own + (r γ m)², and mean and variance of γ.

    By Gauss and Hermite's rule about the top, which Fisher's scoring finds.
    """
    gain = np.ones(model.shape[:-1])
    gain_sd = error.gain_sd
    relative = error.relative
    for _ in range(SCORINGS):
        m = gain[..., None] * model
        part = (relative * model) ** 2
        v = variance + gain[..., None] ** 2 * part
        r = y - m
        rise = gain[..., None] * part / v  # half of the slope of ln v
        slope = (
            np.sum(model * r / v + (r * r / v - 1.0) * rise, axis=-1)
            - (gain - 1.0) / gain_sd**2
        )
        information = np.sum(model**2 / v + 2.0 * rise**2, axis=-1) + 1.0 / gain_sd**2
        gain = gain + slope / information
    nodes, weights = hermite_e.hermegauss(GAIN_NODES)
    width = information**-0.5
    logs = []
    gains = [gain + width * node for node in nodes]
    for gain_node, node, weight in zip(gains, nodes, weights, strict=True):
        m = gain_node[..., None] * model
        v = variance + (relative * m) ** 2
        off = (
            np.sum((y - m) ** 2 / v + np.log(v) + LOG_TWO_PI, axis=-1)
            + ((gain_node - 1.0) / gain_sd) ** 2
        )
        logs.append(
            0.5 * (node**2 - off) - np.log(gain_sd) - 0.5 * LOG_TWO_PI + np.log(weight)
        )
    total = logsumexp(logs, axis=0)
    mass = np.exp(np.array(logs) - total)
    mean = np.sum(mass * gains, axis=0)
    return (
        total + np.log(width),
        mean,
        np.sum(mass * (np.array(gains) - mean) ** 2, axis=0),
    )


def below_limits(
    room: Array, variance: Array, values: Index, mean: Array, spread: Array
) -> tuple[Array, ...]:
    """Return log probability that all these values are below, and mean and variance of u given that.

    Parameters
    ----------
    room : (…, n) limits minus model
    variance : (…, n) or (…, 1) of the independent errors
    values : which of the n are meant
    mean, spread : (…) mean and standard deviation of u before
    """
    value_sds = [
        np.sqrt(variance[..., 0 if variance.shape[-1] == 1 else value])
        for value in values
    ]
    if len(values) == 1:  # in closed form
        total_sd = np.hypot(value_sds[0], spread)
        a = (room[..., values[0]] - mean) / total_sd
        log_probability = log_ndtr(a)
        hazard = np.exp(-0.5 * a * a - 0.5 * LOG_TWO_PI - log_probability)
        left = 1.0 - (spread / total_sd) ** 2 * hazard * (a + hazard)
        return log_probability, mean - spread**2 / total_sd * hazard, spread**2 * left
    ratio = max(float(np.max(spread / row)) for row in value_sds)
    z, logs = _normal_rule(int(np.clip(PANELS * np.ceil(0.5 * ratio), PANELS, FINEST)))
    u = mean[..., None] + spread[..., None] * z
    for value, sd in zip(values, value_sds, strict=True):
        logs = logs + log_ndtr((room[..., value][..., None] - u) / sd[..., None])
    log_probability = logsumexp(logs, axis=-1)
    weight = np.exp(logs - log_probability[..., None])
    mean_below = np.sum(weight * u, axis=-1)
    return (
        log_probability,
        mean_below,
        np.sum(weight * (u - mean_below[..., None]) ** 2, axis=-1),
    )


@cache
def _normal_rule(panels: int) -> tuple[Array, Array]:
    """Return points of a standard normal variable and the logs of their probabilities."""
    nodes, weights = legendre.leggauss(POINTS)
    edges = np.linspace(-REACH, REACH, panels + 1)
    half = 0.5 * np.diff(edges)[:, None]
    z = (0.5 * (edges[1:] + edges[:-1])[:, None] + half * nodes).ravel()
    weight = (half * weights).ravel() * np.exp(-0.5 * z * z)
    return z, np.log(weight / weight.sum())


def smoothed_paths(
    steps: list[Innovation], times: Inspections, rate: Array, rng: Random
) -> Array:
    """Return draws of W at the inspections given all of them, (inspections, …): drawn backwards."""
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
