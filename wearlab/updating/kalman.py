"""How probable measurements are when their errors are shared or accumulate: a scalar Kalman filter.

The wear strays from the model's by a Wiener process W whose variance grows by ``rate`` a cycle; an inspection
sees it with one offset of its own and one independent error a value, y = m + a W + offset + error; a is the
scale of what is measured, by which quantities of one unit stray together. The values of one inspection are
replaced by their weighted mean, which is sufficient for W. Values below a limit of detection come after the
others: given what an inspection's values share, u, they are independent, so that p(y) = p(those seen)
E[Π Φ((limit − m − u)/σ)], one integral over u for each inspection. Afterwards u is replaced by the normal law
of equal mean and variance, which is exact without a drift.
"""

from dataclasses import dataclass, field
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import hermite_e, legendre
from scipy.special import log_ndtr, logsumexp

from wearlab.arrays import Array, Flags, Index, Random

LOG_TWO_PI = float(np.log(2.0 * np.pi))
REACH = 7.0  # standard deviations of u that are integrated over
SCORINGS, GAIN_NODES = 12, 20  # steps to the top of a gain's law, and points over it
PANELS, POINTS, FINEST = 14, 6, 280  # of the integral over u; the last for u that is spread far wider


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


class Hidden(NamedTuple):
    """Values of which only a limit is known: which (n,), and limit minus model (…, n), finite elsewhere."""

    which: Flags
    room: Array


@dataclass(frozen=True)
class Innovation:
    """One inspection, seen from those before it.

    Parameters
    ----------
    count : of its values, without those below a limit of detection
    surprise : difference of its mean from what was expected, over the standard deviation expected
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
    """What the filter knows after the last inspection; every array has the shape of the lanes.

    Parameters
    ----------
    log_likelihood : of all values
    mean, variance : of W
    cycle : of the last inspection, of each lane where they differ
    steps : the innovation of each inspection, where it was asked for
    """

    log_likelihood: Array
    mean: Array
    variance: Array
    cycle: Any
    steps: list[Innovation] = field(default_factory=list)


def filtered(
    residual: Array,
    variance: Array,
    inspections: list[Inspection],
    rate: Array,
    start: float,
    *,
    hidden: Hidden | None = None,
    steps: bool = False,
) -> Filtered:
    """Return the likelihood of residuals and what is known of W.

    Parameters
    ----------
    residual : (…, n) measured minus model; leading dimensions are lanes
    variance : (…, n) or (…, 1) of the independent errors; lanes are broadcast
    inspections : in order of time
    rate, start : variance of W per cycle, and the cycle at which it is 0
    hidden : values of which only a limit is known
    steps : whether each inspection's innovation is kept
    """
    last: Any = start
    lanes = np.broadcast_shapes(residual.shape[:-1], variance.shape[:-1], np.shape(rate))
    total, mean, spread = (np.zeros(()) for _ in range(3))  # each grows to the lanes that it depends on
    kept: list[Innovation] = []
    for inspection in inspections:
        scale, values = inspection.scale, inspection.values
        before, before_spread = scale * mean, scale**2 * (spread + rate * (inspection.cycle - last))
        last = inspection.cycle
        under = values[:0] if hidden is None else values[hidden.which[values]]
        told = values if not len(under) else np.setdiff1d(values, under)
        whole = before_spread + inspection.offset_variance  # of W and the offset together
        shared, shared_spread = before, whole
        off, chi, gained = (np.zeros(()) for _ in range(3))
        if len(told):
            off, expected, chi, gained = _mean_of(residual, variance, told, shared, shared_spread)
            gain = shared_spread / expected
            shared, shared_spread = shared + gain * off, shared_spread * (1.0 - gain)
            off = off / np.sqrt(expected)
        if hidden is not None and len(under):
            wide = [np.broadcast_to(part, lanes) for part in (shared, shared_spread)]
            log_below, shared, shared_spread = below(hidden.room, variance, under, wide[0], np.sqrt(wide[1]))
            gained = gained + log_below
            if not len(told):
                own = variance[..., 0 if variance.shape[-1] == 1 else under[0]]
                off = (shared - before) / np.sqrt(wide[1] + own)
        with np.errstate(invalid="ignore"):
            gain = np.where(whole > 0.0, before_spread / whole, 0.0)
        total = total + gained
        mean = (before + gain * (shared - before)) / scale
        spread = (before_spread * (1.0 - gain) + gain**2 * shared_spread) / scale**2
        if steps:
            each = (off, chi, gained, mean, spread)
            kept.append(Innovation(len(told), *(np.broadcast_to(np.asarray(e, float), lanes) for e in each)))
    total, mean, spread = (np.broadcast_to(part, lanes) for part in (total, mean, spread))
    return Filtered(total, mean, spread, last, kept)


def with_gain(
    value: Array,
    model: Array,
    variance: Array,
    inspections: list[Inspection],
    gain_sd: float,
    relative: float = 0.0,
) -> Filtered:
    """Return the likelihood of values whose model has an unknown gain 1 + g, g ~ N(0, s²), and g's law.

    Given the inspections before it, g is normal; the values of one add to its precision Σ m²/v. Of errors in
    parts of what is measured v grows with the gain: g's law is then integrated over.

    Parameters
    ----------
    value, model : (…, n) measured, and the model
    variance : (…, n) or (…, 1) of the independent errors, without those in parts of the value
    inspections : in order of time
    gain_sd : s
    relative : standard error in parts of (1 + g) m
    """
    v = np.broadcast_to(variance, np.broadcast_shapes(variance.shape, model.shape))
    total, g, steps = np.zeros(v.shape[:-1]), np.zeros(v.shape[:-1]), []
    spread = np.full(v.shape[:-1], gain_sd**2)
    until = np.zeros(0, np.intp)
    for values in (inspection.values for inspection in inspections):
        m, y = np.broadcast_to(model, v.shape)[..., values], value[..., values]
        weight = 1.0 / (v[..., values] + (relative * (1.0 + g[..., None]) * m) ** 2)
        sums = (np.sum(each * weight, axis=-1) for each in (y * y, m * y, m * m))
        before, wide, (chi, log_scale, g, spread) = g, spread, gain_after(g, spread, *sums)
        gained = -0.5 * (chi + np.sum(LOG_TWO_PI - np.log(weight), axis=-1) + log_scale)
        whole, r = np.sum(weight, axis=-1), y - m * (1.0 + before[..., None])
        mean, share = np.sum(r * weight, axis=-1) / whole, np.sum(m * weight, axis=-1) / whole
        off = mean / np.sqrt(1.0 / whole + wide * share**2)
        if relative:
            until = np.append(until, values)
            every = np.broadcast_to(model, v.shape)[..., until]
            logs, g, spread = _over_gain(value[..., until], every, v[..., until], gain_sd, relative)
            gained = logs - total
        total = total + gained
        steps.append(Innovation(len(values), off, chi, gained, g, spread))
    return Filtered(total, g, spread, inspections[-1].cycle if inspections else 0.0, steps)


def _over_gain(
    y: Array, model: Array, own: Array, gain_sd: float, relative: float
) -> tuple[Array, Array, Array]:
    """Return ln ∫ Π N(y; γ m, v) N(γ; 1, s²) dγ with v = own + (r γ m)², and mean and variance of γ − 1.

    By Gauss and Hermite's rule about the top, which Fisher's scoring finds.
    """
    gain = np.ones(model.shape[:-1])
    for _ in range(SCORINGS):
        m, part = gain[..., None] * model, (relative * model) ** 2
        v, r = own + gain[..., None] ** 2 * part, y - m
        rise = gain[..., None] * part / v  # half of the slope of ln v
        slope = np.sum(model * r / v + (r * r / v - 1.0) * rise, axis=-1) - (gain - 1.0) / gain_sd**2
        information = np.sum(model**2 / v + 2.0 * rise**2, axis=-1) + 1.0 / gain_sd**2
        gain = gain + slope / information
    width, logs, gains = information**-0.5, [], []
    for node, weight in zip(*hermite_e.hermegauss(GAIN_NODES), strict=True):
        gains.append(gain + width * node)
        m = gains[-1][..., None] * model
        v = own + (relative * m) ** 2
        each = np.sum((y - m) ** 2 / v + np.log(v) + LOG_TWO_PI, axis=-1)
        each = each + ((gains[-1] - 1.0) / gain_sd) ** 2 + 2.0 * np.log(gain_sd) + LOG_TWO_PI
        logs.append(-0.5 * each + 0.5 * node**2 + np.log(weight))
    total = logsumexp(logs, axis=0)
    mass = np.exp(np.array(logs) - total)
    mean = np.sum(mass * gains, axis=0)
    return total + np.log(width), mean - 1.0, np.sum(mass * (np.array(gains) - mean) ** 2, axis=0)


def gain_after(g: Any, spread: Any, square: Array, cross: Array, precision: Array) -> tuple[Array, ...]:
    """Return chi² of values, ln |V| beyond that of their own errors, and mean and variance of g after them.

    With γ the gain that fits best, chi² = Σ y²/v − (Σ m y/v)²/Σ m²/v + (γ − 1 − g)²/(s² + 1/Σ m²/v), in which
    nothing large cancels where the model is far off.

    Parameters
    ----------
    g, spread : mean and variance s² before
    square, cross, precision : Σ y²/v, Σ m y/v, Σ m²/v
    """
    scale, least = 1.0 + spread * precision, np.maximum(precision, 1e-300)
    fits = cross / least
    chi = square - cross * fits + (fits - 1.0 - g) ** 2 / (spread + 1.0 / least)
    return chi, np.log(scale), g + spread * (cross - (1.0 + g) * precision) / scale, spread / scale


def _mean_of(
    residual: Array, variance: Array, values: Index, before: Array, spread: Array
) -> tuple[Array, Array, Array, Array]:
    """Return how far an inspection's mean is off, its variance expected, chi square and log likelihood."""
    r = residual[..., values]
    v = variance if variance.shape[-1] == 1 else variance[..., values]
    if len(values) == 1:  # nothing large cancels where an error is small
        off, expected = r[..., 0] - before, spread + v[..., 0]
        chi = off * off / expected
        return off, expected, chi, -0.5 * (chi + np.log(expected) + LOG_TWO_PI)
    n, times = len(values), len(values) if v.shape[-1] == 1 else 1
    precision = np.sum(1.0 / v, axis=-1) * times
    own = 1.0 / precision
    average = np.sum(r / v, axis=-1) * own
    expected = spread + own
    off = average - before
    constant = np.sum(np.log(v), axis=-1) * times - np.log(own) + np.log(expected) + n * LOG_TWO_PI
    chi = off * off / expected + np.sum(r * r / v, axis=-1) - average * average * precision
    return off, expected, chi, -0.5 * (chi + constant)


def below(
    room: Array, variance: Array, values: Index, mean: Array, spread: Array
) -> tuple[Array, Array, Array]:
    """Return log probability that all these values are below, and mean and variance of u given that.

    Parameters
    ----------
    room : (…, n) limits minus model
    variance : (…, n) or (…, 1) of the independent errors
    values : which of the n are meant
    mean, spread : (…) mean and standard deviation of u before
    """
    own = [np.sqrt(variance[..., 0 if variance.shape[-1] == 1 else value]) for value in values]
    if len(values) == 1:  # in closed form
        both = np.hypot(own[0], spread)
        a = (room[..., values[0]] - mean) / both
        log_probability = log_ndtr(a)
        hazard = np.exp(-0.5 * a * a - 0.5 * LOG_TWO_PI - log_probability)
        left = 1.0 - (spread / both) ** 2 * hazard * (a + hazard)
        return log_probability, mean - spread**2 / both * hazard, spread**2 * left
    ratio = max(float(np.max(spread / row)) for row in own)
    z, logs = _normal_rule(int(np.clip(PANELS * np.ceil(0.5 * ratio), PANELS, FINEST)))
    u = mean[..., None] + spread[..., None] * z
    for value, sd in zip(values, own, strict=True):
        logs = logs + log_ndtr((room[..., value][..., None] - u) / sd[..., None])
    log_probability = logsumexp(logs, axis=-1)
    weight = np.exp(logs - log_probability[..., None])
    after = np.sum(weight * u, axis=-1)
    return log_probability, after, np.sum(weight * (u - after[..., None]) ** 2, axis=-1)


@cache
def _normal_rule(panels: int) -> tuple[Array, Array]:
    """Return points of a standard normal variable and the logs of their probabilities."""
    nodes, weights = legendre.leggauss(POINTS)
    edges = np.linspace(-REACH, REACH, panels + 1)
    half = 0.5 * np.diff(edges)[:, None]
    z = (0.5 * (edges[1:] + edges[:-1])[:, None] + half * nodes).ravel()
    weight = (half * weights).ravel() * np.exp(-0.5 * z * z)
    return z, np.log(weight / weight.sum())


def smoothed_paths(steps: list[Innovation], cycles: list[float], rate: Array, rng: Random) -> Array:
    """Return draws of W at the inspections given all of them, (inspections, …): drawn backwards."""
    paths = np.empty((len(steps), *np.shape(steps[-1].mean)))
    for t in reversed(range(len(steps))):
        mean, variance = steps[t].mean, steps[t].variance
        if t + 1 < len(steps):
            ahead = rate * (cycles[t + 1] - cycles[t])
            with np.errstate(divide="ignore", invalid="ignore"):
                gain = np.where(variance > 0.0, variance / (variance + ahead), 0.0)
            mean, variance = mean + gain * (paths[t + 1] - mean), np.maximum(variance * (1.0 - gain), 0.0)
        paths[t] = mean + np.sqrt(variance) * rng.standard_normal(mean.shape)
    return paths
