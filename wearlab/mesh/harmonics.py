"""What a periodic quantity is made of, from weighted samples: harmonics, or one that is modulated."""

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
        return self.mean + np.cos(self._angle(phase)[0]) @ self.amplitude

    def rate(self, phase: Array) -> Array:
        """Evaluate d/dφ of the series at phases (…)."""
        angle, orders = self._angle(phase)
        return -np.sin(angle) @ (2 * np.pi * orders * self.amplitude)

    def _angle(self, phase: Array) -> tuple[Array, Array]:
        orders = np.arange(1, len(self.amplitude) + 1)
        return 2 * np.pi * np.multiply.outer(phase, orders) + self.phase, np.asarray(orders, float)


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


class Modulation(NamedTuple):
    """One harmonic with amplitude and frequency modulation, L16 Eqs. 10–13.

    ``f(φ) = mean + (1 + A cos(2πφ + φ_a)) a_1 cos(2πφ + φ_1 + B sin(2πφ + φ_b))``

    Modulating at the mesh frequency itself makes the average of ``f`` differ from ``mean``.

    Parameters
    ----------
    mean : k_mm (0 in the paper's error) [unit of f]
    carrier : amplitude of the fundamental harmonic, k_a1 or e_1 [unit of f]
    carrier_phase : φ_m1 or φ_e1 [rad]
    am, am_phase : amplitude A [1] and initial phase φ_a [rad] of the amplitude modulation
    fm, fm_phase : amplitude B [rad] and initial phase φ_b [rad] of the frequency modulation
    """

    mean: float
    carrier: float
    carrier_phase: float
    am: float
    am_phase: float
    fm: float
    fm_phase: float

    def value(self, phase: Array) -> Array:
        """Evaluate at phases (…) [1]."""
        _, amplitude, argument = self._wave(phase)
        return self.mean + self.carrier * amplitude * np.cos(argument)

    def rate(self, phase: Array) -> Array:
        """Evaluate d/dφ at phases (…)."""
        angle, amplitude, argument = self._wave(phase)
        swing = -self.am * np.sin(angle + self.am_phase)
        turning = 1.0 + self.fm * np.cos(angle + self.fm_phase)
        slope = swing * np.cos(argument) - amplitude * turning * np.sin(argument)
        return 2 * np.pi * self.carrier * slope

    def _wave(self, phase: Array) -> tuple[Array, Array, Array]:
        """Return 2πφ, what amplitude modulation multiplies by, and the modulated angle."""
        angle = 2 * np.pi * np.asarray(phase)
        argument = angle + self.carrier_phase + self.fm * np.sin(angle + self.fm_phase)
        return angle, 1.0 + self.am * np.cos(angle + self.am_phase), argument


def fit(phase: Array, weight: Array, value: Array) -> Modulation:
    """Fit the seven parameters to samples by least squares.

    The modulations are fitted in their Cartesian parts, ``A cos φ_a`` and so on, where the problem has no
    singular point; it is started from the fundamental harmonic with no modulation and with four small
    ones, and the best result is kept, so that equal samples always give equal parameters.

    Parameters
    ----------
    phase, weight : (n,) sample phases and quadrature weights [1]
    value : (n,) samples

    References
    ----------
    L16 Eqs. 10–13.
    """
    from scipy.optimize import least_squares

    first = harmonics(phase, weight, value, 1)
    scale = first.rms
    if scale <= 1e-12 * max(abs(first.mean), 1e-300):
        return Modulation(first.mean, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    root = np.sqrt(weight)
    angle = 2 * np.pi * phase
    cosine, sine = np.cos(angle), np.sin(angle)

    def residual(x: Array) -> Array:
        mean, a, b, c, d, e, f = x
        turn = e * sine + f * cosine
        amplitude = 1.0 + c * cosine + d * sine
        carrier = a * np.cos(angle + turn) - b * np.sin(angle + turn)
        return root * (mean + amplitude * carrier - (value - first.mean) / scale)

    a, b = (first.amplitude[0] / scale) * np.array([np.cos(first.phase[0]), np.sin(first.phase[0])])
    starts = [(0.0, 0.0, 0.0, 0.0), (0.2, 0, 0.2, 0), (-0.2, 0, 0.2, 0), (0, 0.2, 0, 0.2), (0, -0.2, 0, 0.2)]
    solved = [least_squares(residual, np.array([0.0, a, b, *s]), method="lm") for s in starts]
    mean, a, b, c, d, e, f = min(solved, key=lambda s: s.cost).x
    carrier = float(scale * np.hypot(a, b)), float(np.arctan2(b, a))
    am = float(np.hypot(c, d)), float(np.arctan2(-d, c))
    fm = float(np.hypot(e, f)), float(np.arctan2(f, e))
    return Modulation(float(first.mean + scale * mean), *carrier, *am, *fm)
