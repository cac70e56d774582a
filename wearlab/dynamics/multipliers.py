"""Floquet multipliers of a period map."""

import numpy as np
from scipy.linalg.lapack import dgeev

from wearlab.arrays import Array, Complex
from wearlab.dynamics.balance import Balance, true_derivative
from wearlab.dynamics.system import System


def multipliers_of(system: System, balance: Balance | None, derivative: Array) -> Complex:
    """Return the multipliers, largest first; position and speed of a free rotation are left out.

    Parameters
    ----------
    system, balance : what moves, and its loads of unknown size
    derivative : (2n, 2n) of the period map, these loads in the columns of the coordinates held

    References
    ----------
    Floquet, Ann. Sci. Éc. Norm. Supér. 12 (1883) 47–88.
    """
    if balance is not None and not len(balance.held):
        balance = None
    matrix = derivative if balance is None else true_derivative(system, balance, derivative)
    real, imaginary, *_ = dgeev(matrix, compute_vl=0, compute_vr=0)
    found = real + 1j * imaginary
    if balance is not None:
        found = found[abs(found - 1.0).argsort()[2 * len(balance.held) :]]
    return np.asarray(found[abs(found).argsort()[::-1]], np.complex128)
