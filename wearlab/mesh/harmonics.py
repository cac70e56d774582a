"""Harmonics of a periodic quantity sampled with quadrature weights over one period."""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array


class Harmonics(NamedTuple):
    """``f(φ) = mean + Σ_r amplitude_r cos(2π r φ + phase_r)``.

    Parameters
    ----------
    mean : mean value [unit of f]
    amplitude : (n,) amplitudes of orders 1…n [unit of f]
    phase : (n,) phases in (−π, π] [rad]
    rms : root mean square of f − mean, from the samples, all orders [unit of f]
    """

    mean: float
    amplitude: Array
    phase: Array
    rms: float

    def value(self, phase: Array) -> Array:
        """Evaluate the series at phases (…) [1]."""
        orders = np.arange(1, len(self.amplitude) + 1)
        angle = 2 * np.pi * np.multiply.outer(phase, orders) + self.phase
        return self.mean + np.cos(angle) @ self.amplitude

    def rate(self, phase: Array) -> Array:
        """Evaluate d/dφ of the series at phases (…)."""
        orders = np.arange(1, len(self.amplitude) + 1)
        angle = 2 * np.pi * np.multiply.outer(phase, orders) + self.phase
        return -np.sin(angle) @ (2 * np.pi * orders * self.amplitude)


def harmonics(phase: Array, weight: Array, value: Array, count: int) -> Harmonics:
    """Return the first ``count`` harmonics of samples over one period.

    The integrals ``c_r = 2 ∫ f exp(−2πi r φ) dφ`` are taken with the given weights, so jumps between
    segments cost no accuracy when the samples hold both of their sides.

    Parameters
    ----------
    phase, weight : (n,) sample phases and quadrature weights, the weights summing to 1 [1]
    value : (n,) samples
    count : number of harmonics

    References
    ----------
    L16 Eqs. 7–8: stiffness and error as truncated series.
    """
    mean = float(weight @ value)
    orders = np.arange(1, count + 1)
    kernel = np.exp(-2j * np.pi * np.multiply.outer(orders, phase))
    coefficient = 2.0 * kernel @ (weight * (value - mean))
    rms = float(np.sqrt(float(weight @ (value - mean) ** 2)))
    return Harmonics(mean, np.abs(coefficient), np.angle(coefficient), rms)
