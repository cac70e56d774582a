"""The largest eigenvalue of ∂r/∂h: how fast the shortest waves of a wear profile relax."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array

RADIUS_SAFETY = 1.15
"""Margin on the spectral radius, which a power iteration tells from below."""
MOST_ITERATIONS = 15
KRYLOV = 16
FOUND = 0.3
"""Residual of an approximate eigenvalue, over the spectral radius seen, up to which it counts as found."""


class Spectrum(NamedTuple):
    """The dominant eigenvalue of ∂r/∂h.

    Parameters
    ----------
    radius : ρ = |λ|max [1/cycle]
    alignment : −v·Jv/(|v||Jv|): 1 for a real decaying λ, less off the axis [1]
    direction : (n,) its vector, for the next estimate
    """

    radius: float
    alignment: float
    direction: Array

    @property
    def is_real(self) -> bool:
        """Whether the fastest part simply decays (static load does, dynamics may not)."""
        return self.alignment > 0.96


def spectrum(
    rate: Callable[[Array], Array],
    h: Array,
    start: Array,
    *,
    amplitude: float,
    tolerance: float = 0.05,
    iterations: int = MOST_ITERATIONS,
) -> Spectrum:
    """Return the dominant eigenvalue by power iteration with differences of the rate.

    ``J v ≈ (r(h + δ(1 + v)) − r(h + δ))/δ`` with max|v| = 1: the probe never refills a flank.

    Parameters
    ----------
    rate : r(h)
    h : (n,) depth [m]
    start : (n,) first direction: the last spectrum's, or random
    amplitude : δ, small beside the elastic deflection and large beside the noise of r [m]
    tolerance : relative change of ρ at which to stop
    iterations : bound on the evaluations
    """
    base = rate(h + amplitude)
    radius, alignment = 0.0, 1.0
    v = start
    for _ in range(iterations):
        largest = float(np.abs(v).max())
        if largest == 0.0:
            return Spectrum(0.0, 1.0, start)
        v = v / largest
        Jv = (rate(h + amplitude * (1.0 + v)) - base) / amplitude
        length, previous = float(np.linalg.norm(Jv)), radius
        radius = length / float(np.linalg.norm(v))
        if length == 0.0:
            return Spectrum(0.0, 1.0, v)
        alignment = -float(v @ Jv) / (length * float(np.linalg.norm(v)))
        v = Jv
        if abs(radius - previous) <= tolerance * radius:
            break
    return Spectrum(radius, alignment, v)


def growth_rate(
    rate: Callable[[Array], Array], h: Array, start: Array, *, amplitude: float, iterations: int = KRYLOV
) -> float:
    """Return the largest growth rate among the waves of a profile, the largest Re λ of ∂r/∂h, at least 0.

    Arnoldi's method with differences of the rate, as in :func:`spectrum`; of its values only those count
    whose residual is small, because those of a non-normal matrix may lie far from any eigenvalue.

    Parameters
    ----------
    rate, h, start, amplitude : as for :func:`spectrum`
    iterations : evaluations, the size of the Krylov space
    """
    length = float(np.linalg.norm(start))
    if length == 0.0:
        return 0.0
    base = rate(h + amplitude)
    basis, upper = [start / length], np.zeros((iterations + 1, iterations))
    for k in range(iterations):
        v = basis[-1]
        largest = float(np.abs(v).max())
        w = (rate(h + amplitude * (1.0 + v / largest)) - base) * (largest / amplitude)
        for _ in range(2):  # twice is enough for orthogonality to rounding
            for i, vector in enumerate(basis):
                share = float(vector @ w)
                upper[i, k] += share
                w = w - share * vector
        upper[k + 1, k] = length = float(np.linalg.norm(w))
        if length <= 1e-10 * float(np.abs(upper).max()):
            iterations = k + 1
            break
        basis.append(w / length)
    values, vectors = np.linalg.eig(upper[:iterations, :iterations])
    residual = upper[iterations, iterations - 1] * np.abs(vectors[-1])
    eigenvalues = values[residual <= FOUND * np.abs(values)]
    return max(0.0, float(eigenvalues.real.max(initial=0.0)))


def random_direction(r: Array) -> Array:
    """Return random signs weighted by the rate (a node that does not wear does not relax), (n,)."""
    signs = np.random.default_rng(20160501).choice([-1.0, 1.0], size=r.shape)
    return np.asarray(signs * (np.abs(r) + 1e-3 * float(np.abs(r).max(initial=0.0))))
