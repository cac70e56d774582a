"""Floquet multipliers of a period map."""

import numpy as np
from scipy.linalg.lapack import dgeev

from wearlab.arrays import Array, Complex
from wearlab.dynamics.balance import Balance, true_derivative
from wearlab.dynamics.system import System


def multipliers_of(system: System, balance: Balance, derivative: Array) -> Complex:
    """Return the multipliers, largest first; position and speed of a free rotation are left out.

    Parameters
    ----------
    system, balance : what moves, and its loads of unknown size
    derivative : (2n, 2n) of the period map, these loads in the columns of the coordinates held

    References
    ----------
    Floquet, Ann. Sci. Éc. Norm. Supér. 12 (1883) 47–88.
    """
    free = len(balance.held)
    matrix = true_derivative(system, balance, derivative) if free else derivative
    real, imaginary, *_ = dgeev(matrix, compute_vl=0, compute_vr=0)
    multipliers = real + 1j * imaginary
    if free:
        multipliers = multipliers[abs(multipliers - 1.0).argsort()[2 * free :]]
    return np.asarray(multipliers[abs(multipliers).argsort()[::-1]], np.complex128)
