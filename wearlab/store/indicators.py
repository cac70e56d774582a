"""What condition monitoring takes from a signal over whole mesh periods."""

import numpy as np
from numpy.typing import NDArray

ORDERS = 5
INDICATORS = {
    "mean": "",
    "rms": "",
    "peak_to_peak": "",
    "crest_factor": "1",
    "kurtosis": "1",
}
"""Name → unit, "" for that of the signal."""


def indicators(signal: NDArray[np.float64]) -> dict[str, float]:
    """Return indicators of a periodic signal and its amplitudes at the first mesh orders.

    mean x̄; rms √⟨(x−x̄)²⟩; peak_to_peak max x − min x; crest_factor max|x−x̄|/rms; kurtosis ⟨(x−x̄)⁴⟩/rms⁴;
    order_k 2|X_k|, X the discrete Fourier transform of the mean mesh period.

    Parameters
    ----------
    signal : x at equally spaced phases of whole mesh periods, (periods, phases)

    Returns
    -------
    In the unit of the signal, crest factor and kurtosis without; NaN of no signal, and of the shape of one
    that does not move.
    """
    if not signal.size:
        return dict.fromkeys([*INDICATORS, *_orders()], float("nan"))
    mean = float(signal.mean())
    moving = signal - mean
    rms = float(np.sqrt(np.mean(moving**2)))
    still = rms <= 1e-12 * max(abs(mean), 1e-300)
    spectrum = np.fft.rfft(signal.mean(axis=0)) / signal.shape[1]
    amplitudes = 2.0 * np.abs(spectrum[1 : ORDERS + 1])
    return {
        "mean": mean,
        "rms": rms,
        "peak_to_peak": float(np.ptp(signal)),
        "crest_factor": float("nan") if still else float(np.max(np.abs(moving)) / rms),
        "kurtosis": float("nan") if still else float(np.mean(moving**4) / rms**4),
        **dict(zip(_orders(), map(float, amplitudes), strict=False)),
    }


def _orders() -> list[str]:
    return [f"order_{order}" for order in range(1, ORDERS + 1)]
