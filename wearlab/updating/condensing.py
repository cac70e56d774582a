"""How probable very many values with independent errors are: from bins of them.

Between two states of a run the model m is a cubic of the cycle, and the variance v of a
value is smooth in it. What a bin of values of neighbouring cycles adds to the
likelihood is therefore known from twelve cycles,

    Σ w (y − m)²/v + ln v = Σ_k (Y2_k − 2 d_k Y1_k + d_k² Y0_k)/v_k + N_k ln v_k,   d_k
    = m(t_k) − c,

with the sums Y and N of `bins`, and c the bin's mean: exact where v does not change in
a bin, to 1e-6 where the model changes by less than a tenth. A bin in which it changes
by more, or in which a state of the run falls, is compared value by value.
"""

from collections.abc import Sequence

import numpy as np

from wearlab.arrays import Array, Flags, Index
from wearlab.updating import kalman
from wearlab.updating.bins import Condensed, bin_size
from wearlab.updating.data_blocks import Block
from wearlab.updating.run_curves import ObservationPoints, RunHistory

MANY = 4000  # values from which independent ones are condensed
NUMBERS_AT_ONCE = 400_000  # of all factors and values, that are worked on together
SMOOTH = 0.1  # relative change of the model in a bin up to which its variance is smooth


def condenses(block: Block, points: ObservationPoints, sd: Array) -> bool:
    """Whether the values are very many, and their errors differ by the model alone.

    Parameters
    ----------
    block : observations
    points : where they stand on a run
    sd : standard deviations of a value that are asked for [SI]
    """
    observed = block.observed
    rows = block.rows
    error = block.data.error
    bin_values = bin_size(len(rows)) * points.curve.value.shape[-1]
    if len(rows) <= MANY or bin_values > len(rows):
        return False

    independent = (
        not block.shares
        and not block.counts_since
        and not observed.censored[rows].any()
    )
    variance_goes_with_gain = error.gain_sd and error.relative
    if not independent or variance_goes_with_gain:
        return False
    if not observed.sd[rows].any():
        return True
    return not block.relative and bool((sd == sd.flat[0]).all())


def one_by_one(block: Block, run: RunHistory, number: int) -> bool:
    """Whether values have to be compared one by one.

    They have where they share an error, or where their errors differ by more than the
    model says.

    Parameters
    ----------
    block : observations
    run : a stored run
    number : place of the block in the run's points
    """
    sds = [1.0] if block.sd.prior is None else [1.0, 2.0]
    return not condenses(block, run.points[number], np.array(sds))


def condensed_log_likelihood(
    block: Block, run: RunHistory, points: ObservationPoints, factor: Array, sd: Array
) -> Array:
    """Return the log likelihood of very many values, and mean and variance of the gain.

    Both are 0 without a gain. Factors go along the first of the lanes only.
    """
    bins, log_variances = block.bins(points, float(np.ravel(sd)[0]))
    sd = np.ones(1) if block.observed.sd[block.rows].any() else sd
    shape = np.broadcast_shapes(np.shape(factor), np.shape(sd))
    flat = np.ravel(factor)
    spread = np.broadcast_to(sd, shape).reshape(flat.size, -1)
    piece_count = max(flat.size * bins.node.size // NUMBERS_AT_ONCE, 1)
    pieces = np.array_split(np.arange(flat.size), piece_count)
    parts = [
        _piece_sums(bins, run, points, flat[chosen], spread[chosen], block)
        for chosen in pieces
    ]
    totals = np.concatenate(parts, axis=1).reshape(-1, *shape)
    gain_sd = block.data.error.gain_sd
    if not gain_sd:
        logs, chi = totals
        total = -0.5 * (chi + logs + log_variances)
        return np.stack([total, np.zeros(shape), np.zeros(shape)])
    sums = kalman.WeightedSums(
        square=totals[1],
        cross=totals[2],
        precision=totals[3],
        logs=totals[0] + log_variances,
    )
    state = kalman.update_state(1.0, gain_sd**2, sums)
    return np.stack([state.log_likelihood, state.mean, state.variance])


def _piece_sums(
    bins: Condensed,
    run: RunHistory,
    points: ObservationPoints,
    factor: Array,
    sd: Array,
    block: Block,
) -> Array:
    """Return sums of values for a few factors, (sums, factors, deviations).

    Σ ln 2πv and Σ (y − m)²/v; with a gain Σ ln 2πv, Σ y²/v, Σ m y/v and Σ m²/v.
    """
    has_gain = block.data.error.gain_sd > 0.0
    run_cycle = run.equivalent_cycle(bins.node, factor[:, None, None], points.clock)
    model = points.curve.at(run_cycle, bins.column)
    smooth = _smooth_bins(bins, run, points, factor)
    if block.relative:
        smallest = np.abs(model).min(axis=-1)
        largest = np.abs(model).max(axis=-1)
        smooth &= largest - smallest <= SMOOTH * smallest

    by_bin = smooth[..., None]
    terms = [
        np.where(by_bin, sums, 0.0) for sums in _sums_of_bins(bins, model, has_gain)
    ]
    counts = by_bin * bins.many
    total = _summed_over_bins(terms, counts, model, sd, block.relative)

    lane, uneven = np.nonzero(~smooth)
    pieces = max(len(lane) * bins.value.shape[1] // NUMBERS_AT_ONCE, 1)
    lane_pieces = np.array_split(lane, pieces)
    bin_pieces = np.array_split(uneven, pieces)
    for lanes, chosen in zip(lane_pieces, bin_pieces, strict=True):
        cycle = bins.cycle[chosen]
        run_cycle = run.equivalent_cycle(cycle, factor[lanes, None], points.clock)
        model = points.curve.at(run_cycle, bins.column[chosen])
        terms = _sums_of_values(bins, chosen, model, has_gain)
        counts = bins.real[chosen][:, None]
        piece_sums = _summed_over_bins(
            terms, counts, model[:, None], sd[lanes], block.relative
        )
        np.add.at(total, np.s_[:, lanes], piece_sums)  # type: ignore[arg-type]
    return total


def _sums_of_bins(bins: Condensed, model: Array, has_gain: bool) -> list[Array]:
    """Return Σ w (y − m)² of bins; with a gain Σ w y², m Σ w y, m² Σ w."""
    zeroth, once, twice = bins.moment
    centre = bins.centre
    if not has_gain:
        off = model - centre
        return [twice + off * (off * zeroth - 2.0 * once)]
    square = twice + centre * (centre * zeroth + 2.0 * once)
    first = once + centre * zeroth
    return [np.broadcast_to(square, model.shape), model * first, model * model * zeroth]


def _smooth_bins(
    bins: Condensed, run: RunHistory, points: ObservationPoints, factor: Array
) -> Flags:
    """Return in which bins the model is one cubic, without a state of the run."""
    ends = bins.cycle[:, [0, -1]]
    run_cycle = run.equivalent_cycle(ends, factor[:, None, None], points.clock)
    state = np.searchsorted(points.curve.cycle[1:], run_cycle, side="right")
    return np.asarray(state[..., 0] == state[..., 1])


def _sums_of_values(
    bins: Condensed, chosen: Index, model: Array, has_gain: bool
) -> list[Array]:
    """Return w (y − m)² of the values of some bins; with a gain w y², w m y, w m²."""
    value = bins.value[chosen]
    weight = bins.weight[chosen]
    if has_gain:
        squares = [value * value, model * value, model * model]
    else:
        squares = [(value - model) ** 2]
    return [(weight * square)[:, None] for square in squares]


def _summed_over_bins(
    sums: Sequence[Array], count: Array, model: Array, sd: Array, relative: float
) -> Array:
    """Return Σ count ln 2πv and sums over v, of bins and their places.

    The result is (1 + sums, lanes, deviations).
    """
    parts = [np.broadcast_to(count, sums[0].shape), *sums]
    if not relative:  # all have one variance
        parts = [terms.sum(axis=(1, 2), keepdims=True) for terms in parts]
        model = np.zeros((1, 1, 1))
    counts = parts[0]
    model_variance = (relative * model) ** 2
    total = np.empty((len(parts), *sd.shape))
    for j, column in enumerate(sd.T):
        sd_variance = column[:, None, None] ** 2
        variance = np.where(counts != 0.0, sd_variance + model_variance, 1.0)
        logs = counts * np.log(2.0 * np.pi * variance)
        total[0, :, j] = logs.sum(axis=(1, 2))
        for k, terms in enumerate(parts[1:], 1):
            total[k, :, j] = (terms / variance).sum(axis=(1, 2))
    return total
