"""The equivalent load of Miner's rule, which L16 hands to its static contact analysis."""

import numpy as np
from numpy.typing import ArrayLike


def equivalent_load(load: ArrayLike, slope: float, weight: ArrayLike | None = None) -> float:
    """Return ``(Σ n T^l / Σ n)^(1/l)``, between the mean (l = 1) and the maximum (l → ∞).

    Computed on loads divided by their maximum, so that a steep Wöhler line does not overflow.

    Parameters
    ----------
    load : samples of the load (force or torque) over a period, ≥ 0; separation is 0, any shape
    slope : slope l of the Wöhler line, ≥ 1 [1]
    weight : times of occurrence or quadrature weights of the samples, broadcast [equal]

    Returns
    -------
    the equivalent load, in the unit of ``load``

    Raises
    ------
    ValueError
        When the slope is below 1 or a load is negative.

    Notes
    -----
    L16 Eq. 25. Archard's wear is linear in the load, so the mean would do; any l > 1 can only raise it.
    """
    T = np.asarray(load, float)
    if not slope >= 1.0:
        raise ValueError(f"Wöhler slope {slope:g} is below 1: an equivalent load cannot lie below the mean")
    if np.any(T < 0.0):
        raise ValueError(f"load {T.min():.3g} is negative: a flank cannot pull")
    largest = float(T.max())
    if largest == 0.0:
        return 0.0
    n = np.broadcast_to(1.0 if weight is None else np.asarray(weight, float), T.shape)
    return largest * float(np.sum(n * (T / largest) ** slope) / np.sum(n)) ** (1.0 / slope)
