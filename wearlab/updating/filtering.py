"""How probable measurements are when their errors are shared or accumulate: a scalar Kalman filter.

The wear strays from the model's by a Wiener process W whose variance grows by ``rate`` a cycle; an inspection
sees it with one offset of its own and one independent error a value,

    y = m + W + offset + error.

Values of one inspection are replaced by their weighted mean, which is sufficient for W; what they scatter
about it is accounted for apart, so that an inspection costs the same with one value or with a thousand.
Values below a limit of detection come after the others of their inspection, see `censoring`.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.arrays import Array
from wearlab.updating.censoring import Hidden, below

LOG_TWO_PI = float(np.log(2.0 * np.pi))


@dataclass(frozen=True)
class Inspection:
    """The values taken at one time: when [cycles], and which."""

    cycle: float
    values: NDArray[np.intp]


@dataclass
class Filtered:
    """What the filter knows after the last inspection; every array has the shape of the lanes.

    Parameters
    ----------
    log_likelihood : of all values
    mean, variance : of W
    cycle : of the last inspection
    steps : for each inspection its surprise (below), where it was asked for
    """

    log_likelihood: Array
    mean: Array
    variance: Array
    cycle: float
    steps: list["Inspected"] = field(default_factory=list)


@dataclass(frozen=True)
class Inspected:
    """One inspection, seen from those before it.

    Parameters
    ----------
    count : of its values, without those below a limit of detection
    surprise : difference of its mean from what was expected, over the standard deviation expected; of values
        below their limits the difference that they make to what is expected
    chi_square : sum of all squared standard differences of its values
    log_likelihood : of its values, given those before
    before : mean of W just before it
    mean, variance : of W after it
    """

    count: int
    surprise: Array
    chi_square: Array
    log_likelihood: Array
    before: Array
    mean: Array
    variance: Array


class SharedError(NamedTuple):
    """Errors that values have in common.

    Parameters
    ----------
    offset_variance : of the error that an inspection's values share
    rate : (…) variance of W per cycle
    start : cycle at which W is 0
    """

    offset_variance: float
    rate: Array
    start: float


def filtered(
    residual: Array,
    variance: Array,
    inspections: list[Inspection],
    shared_error: SharedError,
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
    shared_error : what values have in common
    hidden : values of which only a limit is known
    steps : whether each inspection's surprise is kept
    """
    offset_variance, rate, start = shared_error
    lanes = np.broadcast_shapes(residual.shape[:-1], variance.shape[:-1], np.shape(rate))
    total, mean, spread = (np.zeros(()) for _ in range(3))  # each grows to the lanes that it depends on
    kept: list[Inspected] = []
    last = start
    for inspection in inspections:
        before, before_spread = mean, spread + rate * (inspection.cycle - last)
        last = inspection.cycle
        under = inspection.values[:0] if hidden is None else hidden.among(inspection.values)
        told = inspection.values if not len(under) else np.setdiff1d(inspection.values, under)
        whole = before_spread + offset_variance  # of W and the offset together
        shared, shared_spread = before, whole
        off, expected, chi, gained = (np.zeros(()) for _ in range(4))
        if len(told):
            off, expected, chi, gained = _gained(residual, variance, told, shared, shared_spread)
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
        mean = before + gain * (shared - before)
        spread = before_spread * (1.0 - gain) + gain**2 * shared_spread
        if steps:
            each = (off, chi, gained, before, mean, spread)
            kept.append(
                Inspected(len(told), *[np.broadcast_to(np.asarray(part, float), lanes) for part in each])
            )
    total = np.broadcast_to(total, lanes)
    return Filtered(total, np.broadcast_to(mean, lanes), np.broadcast_to(spread, lanes), last, kept)


def _gained(
    residual: Array, variance: Array, values: NDArray[np.intp], before: Array, spread: Array
) -> tuple[Array, Array, Array, Array]:
    """Return how far an inspection's mean is off, its variance expected, chi square and log likelihood.

    Parameters
    ----------
    residual, variance : as in `filtered`
    values : of the inspection
    before, spread : mean and variance of what all of them share
    """
    r = residual[..., values]
    v = variance if variance.shape[-1] == 1 else variance[..., values]
    n = len(values)
    precision = np.sum(1.0 / v, axis=-1) * (n if v.shape[-1] == 1 else 1)
    own = 1.0 / precision
    average = np.sum(r / v, axis=-1) * own
    logs = np.sum(np.log(v), axis=-1) * (n if v.shape[-1] == 1 else 1)
    expected = spread + own
    off = average - before
    constant = logs - np.log(own) + np.log(expected) + n * LOG_TWO_PI
    chi = off * off / expected
    if n > 1:
        chi = chi + np.sum(r * r / v, axis=-1) - average * average * precision
    return off, expected, chi, -0.5 * (chi + constant)


def smoothed_paths(
    steps: list[Inspected], cycles: list[float], rate: Array, rng: np.random.Generator
) -> Array:
    """Return draws of W at the inspections given all of them, (inspections, …): drawn backwards.

    Parameters
    ----------
    steps : of the filter, lanes are draws
    cycles : of the inspections
    rate : (…) variance of W per cycle
    """
    lanes = np.shape(steps[-1].mean)
    paths = np.empty((len(steps), *lanes))
    paths[-1] = steps[-1].mean + np.sqrt(steps[-1].variance) * rng.standard_normal(lanes)
    for t in range(len(steps) - 2, -1, -1):
        ahead = rate * (cycles[t + 1] - cycles[t])
        with np.errstate(divide="ignore", invalid="ignore"):
            gain = np.where(steps[t].variance > 0.0, steps[t].variance / (steps[t].variance + ahead), 0.0)
        mean = steps[t].mean + gain * (paths[t + 1] - steps[t].mean)
        spread = steps[t].variance * (1.0 - gain)
        paths[t] = mean + np.sqrt(np.maximum(spread, 0.0)) * rng.standard_normal(lanes)
    return paths
