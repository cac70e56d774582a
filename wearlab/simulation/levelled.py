"""What is left of an error of the wear that the rate levels, over a long step."""

from collections.abc import Callable

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from wearlab.arrays import Array

MOST_ANSWERS, CLOSE = 10, 0.05
"""Most rates that one step asks for, and the residual over the drive at which it asks for no more."""


def levelled(drive: Array, step: float, answer: Callable[[Array], Array | None]) -> Array:
    """Return the error at the end of an implicit step, ``(1 − ΔN ∂r/∂h) e = drive``, by a Krylov method.

    The derivative is taken over as much as the drive: gaps close and open within it. The drive itself comes
    back where the rate does not tell, or levels nothing.

    Parameters
    ----------
    drive : (n,) error when nothing levels it [m]
    step : ΔN [1]
    answer : what an error (n,) [m] changes of the rate (n,) [m per cycle], None where it cannot be told
    """
    size, told = float(np.abs(drive).max(initial=0.0)), True

    def product(v: Array) -> Array:
        nonlocal told
        unit = float(np.abs(v).max()) / size
        answered = answer(v / unit) if unit > 0.0 and told else None
        if answered is None:
            told = told and unit == 0.0
            return v
        return np.asarray(v - step * unit * answered)

    if size == 0.0:
        return drive
    system = LinearOperator((len(drive), len(drive)), matvec=product, dtype=np.float64)
    error, _ = gmres(system, drive, rtol=CLOSE, restart=MOST_ANSWERS, maxiter=1)
    return np.asarray(error) if told and float(np.abs(error).max()) < size else drive
