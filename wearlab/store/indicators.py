"""What condition monitoring takes from a signal over whole mesh periods."""

import numpy as np

from wearlab.arrays import Array

ORDERS = 5
STILL = 1e-12  # of the mean: what moves less does not move
INDICATORS = {
    "mean": "",
    "rms": "",
    "peak_to_peak": "",
    "crest_factor": "1",
    "kurtosis": "1",
}
"""Name → unit, "" for that of the signal."""


def indicators(signal: Array) -> dict[str, Array]:
    """Return indicators of periodic signals and their amplitudes at the first mesh orders.

    mean x̄; rms √⟨(x−x̄)²⟩; peak_to_peak max x − min x; crest_factor max|x−x̄|/rms; kurtosis ⟨(x−x̄)⁴⟩/rms⁴;
    order_k 2|X_k|, X the discrete Fourier transform of the mean mesh period.

    Parameters
    ----------
    signal : x at equally spaced phases of whole mesh periods, (..., periods, phases); a period that is not
        finite throughout only pads and is left out

    Returns
    -------
    One number a signal (...), in the unit of the signal, crest factor and kurtosis without; NaN of no period,
    and of the shape of what does not move.
    """
    held = np.isfinite(signal).all(axis=-1, keepdims=True)
    reached = held.sum(axis=(-2, -1))
    periods = np.where(reached > 0, reached, np.nan)
    count = periods * signal.shape[-1]
    kept = np.where(held, signal, 0.0)
    mean = kept.sum(axis=(-2, -1)) / count
    moving = np.where(held, signal - mean[..., None, None], 0.0)
    rms = np.sqrt((moving**2).sum(axis=(-2, -1)) / count)
    shaped = np.where(rms > STILL * np.maximum(np.abs(mean), 1e-300), rms, np.nan)
    highest = np.max(signal, axis=(-2, -1), where=held, initial=-np.inf)
    lowest = np.min(signal, axis=(-2, -1), where=held, initial=np.inf)
    one_period = kept.sum(axis=-2) / periods[..., None]
    amplitudes = 2.0 * np.abs(np.fft.rfft(one_period)[..., 1 : ORDERS + 1]) / signal.shape[-1]
    return {
        "mean": mean,
        "rms": rms,
        "peak_to_peak": np.where(np.isfinite(periods), highest - lowest, np.nan),
        "crest_factor": np.abs(moving).max(axis=(-2, -1), initial=0.0) / shaped,
        "kurtosis": (moving**4).sum(axis=(-2, -1)) / count / shaped**4,
        **{f"order_{k}": amplitudes[..., k - 1] for k in range(1, amplitudes.shape[-1] + 1)},
    }
