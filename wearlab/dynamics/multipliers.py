"""Floquet multipliers of a period map."""

import numpy as np
from scipy.linalg.lapack import dgeev

from wearlab.arrays import Array, Complex
from wearlab.dynamics.balance import Balance, true_derivative
from wearlab.dynamics.system import System


def multipliers_of(system: System, balance: Balance | None, derivative: Array, sections: int = 1) -> Complex:
    """Return the multipliers, largest first; position and speed of a free rotation are left out.

    Parameters
    ----------
    system, balance : what moves, and its loads of unknown size
    derivative : (2n, 2n) of the period map, these loads in the columns of the coordinates held
    sections : of the mesh period, over the first of which the map goes, turned back; see `over_sections`

    References
    ----------
    Floquet, Ann. Sci. Éc. Norm. Supér. 12 (1883) 47–88.
    """
    if balance is not None and not len(balance.held):
        balance = None
    matrix = derivative if balance is None else true_derivative(system, balance, derivative)
    matrix = over_sections(system, matrix, sections)
    real, imaginary, *_ = dgeev(matrix, compute_vl=0, compute_vr=0)
    multipliers = real + 1j * imaginary
    if balance is not None:
        multipliers = multipliers[abs(multipliers - 1.0).argsort()[2 * len(balance.held) :]]
    return np.asarray(multipliers[abs(multipliers).argsort()[::-1]], np.complex128)


def judged(
    system: System, balance: Balance | None, derivative: Array, margin: float, sections: int = 1
) -> tuple[Complex, bool] | None:
    """Return the multipliers of an orbit and whether it attracts; None: it repels.

    Parameters
    ----------
    system, balance, derivative, sections : as for `multipliers_of`
    margin : an orbit attracts when max |μ| < 1 − margin, and repels unless max |μ| ≤ 1 + margin
    """
    multipliers = multipliers_of(system, balance, derivative, sections)
    largest = abs(multipliers[0])
    return (multipliers, bool(largest < 1.0 - margin)) if largest <= 1.0 + margin else None


def over_sections(system: System, derivative: Array, sections: int) -> Array:
    """Return the derivative of the map over a mesh period, ``P = Rᵐ Qᵐ``, from that over a section.

    Parameters
    ----------
    system : what is turned into itself
    derivative : (2n, 2n) Q, of the map over a section, turned back
    sections : m; 1: that is the period

    References
    ----------
    Floquet 1883: its eigenvalues are the multipliers.
    """
    if sections == 1 or system.symmetry is None:
        return derivative
    turn = np.kron(np.eye(2), np.linalg.matrix_power(system.symmetry.turn, sections))
    return np.asarray(turn @ np.linalg.matrix_power(derivative, sections))
