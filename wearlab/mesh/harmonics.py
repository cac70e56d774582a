"""Periodic quantities: harmonics, a modulated wave, prescribed errors of a mesh.

Errors are harmonics of the mesh frequency, and once-per-revolution parts of its
members, ``e(φ) = Σ_r a_r sin(2π r φ + p_r) + Σ_m slow_m sin(θ_m)`` with, per member
(W23 Eqs. 28–30), ``½(F_i′ − f_i′) sin θ + ½ f_i′ sin zθ`` and installation tolerances
``Σ_q Δe_q sin θ_q``. Every initial angle is drawn once, from the seed.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array

FIT_STARTS = (
    (0.0, 0.0, 0.0, 0.0),
    (0.2, 0.0, 0.2, 0.0),
    (-0.2, 0.0, 0.2, 0.0),
    (0.0, 0.2, 0.0, 0.2),
    (0.0, -0.2, 0.0, 0.2),
)
"""Modulations from which `fit` starts: A cos φ_a, A sin φ_a, B cos φ_b, B sin φ_b."""
ANGLES = 8
"""Angles of the members over which slow errors are averaged."""


@dataclass(frozen=True)
class Waves:
    """``f(φ) = Σ amplitude sin(2π order φ + phase)``.

    Parameters
    ----------
    order : (n,) orders [1]
    amplitude : (n,) amplitudes [unit of f]
    phase : (n,) phases [rad]
    """

    order: Array
    amplitude: Array
    phase: Array

    def value(self, phase: Array) -> Array:
        """Evaluate at phases (…) [1]."""
        if not len(self.order):
            return np.zeros(np.shape(phase))
        return np.asarray(np.sin(self._angle(phase)) @ self.amplitude)

    def rate(self, phase: Array) -> Array:
        """Evaluate d/dφ at phases (…)."""
        if not len(self.order):
            return np.zeros(np.shape(phase))
        slope = 2 * np.pi * self.order * self.amplitude
        return np.asarray(np.cos(self._angle(phase)) @ slope)

    def _angle(self, phase: Array) -> Array:
        return np.asarray(2 * np.pi * np.multiply.outer(phase, self.order) + self.phase)


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
        return self.mean + self._waves.value(phase)

    def rate(self, phase: Array) -> Array:
        """Evaluate d/dφ of the series at phases (…)."""
        return self._waves.rate(phase)

    @property
    def _waves(self) -> Waves:
        return Waves(
            np.arange(1.0, len(self.amplitude) + 1.0),
            self.amplitude,
            self.phase + 0.5 * np.pi,
        )


def harmonics(phase: Array, weight: Array, value: Array, count: int) -> Harmonics:
    """Return the first ``count`` harmonics of samples over one period.

    The integrals ``c_r = 2 ∫ f exp(−2πi r φ) dφ`` are taken with the given weights, so
    jumps between segments cost no accuracy when the samples hold both of their sides.

    Parameters
    ----------
    phase, weight : (n,) sample phases and quadrature weights, the weights summing to 1
        [1]
    value : (n,) samples
    count : number of harmonics

    References
    ----------
    L16 Eqs. 7–8: stiffness and error as truncated series.
    """
    mean = float(weight @ value)
    deviation = value - mean
    orders = np.arange(1, count + 1)
    kernel = np.exp(-2j * np.pi * np.multiply.outer(orders, phase))
    coefficient = 2.0 * kernel @ (weight * deviation)
    rms = float(np.sqrt(float(weight @ deviation**2)))
    return Harmonics(mean, np.abs(coefficient), np.angle(coefficient), rms)


class Modulation(NamedTuple):
    """One harmonic with amplitude and frequency modulation, L16 Eqs. 10–13.

    ``f(φ) = mean + (1 + A cos(2πφ + φ_a)) a_1 cos(2πφ + φ_1 + B sin(2πφ + φ_b))``

    Modulating at the mesh frequency itself makes the average of ``f`` differ from
    ``mean``.

    Parameters
    ----------
    mean : k_mm (0 in the paper's error) [unit of f]
    carrier : amplitude of the fundamental harmonic, k_a1 or e_1 [unit of f]
    carrier_phase : φ_m1 or φ_e1 [rad]
    am, am_phase : amplitude A [1] and initial phase φ_a [rad] of the amplitude
        modulation
    fm, fm_phase : amplitude B [rad] and initial phase φ_b [rad] of the frequency
        modulation
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
        """Return 2πφ, the factor of amplitude modulation, and the modulated angle."""
        angle = 2 * np.pi * np.asarray(phase)
        argument = angle + self.carrier_phase + self.fm * np.sin(angle + self.fm_phase)
        return angle, 1.0 + self.am * np.cos(angle + self.am_phase), argument


class _Samples(NamedTuple):
    """Samples to which a modulated wave is fitted, less their mean and over their rms.

    Parameters
    ----------
    phase : (n,) [1]
    root_weight : (n,) square roots of the quadrature weights [1]
    value : (n,) [1]
    """

    phase: Array
    root_weight: Array
    value: Array

    def residual(self, parameters: Array) -> Array:
        """Return the weighted misfit of a modulated wave, (n,) [1].

        Parameters
        ----------
        parameters : (7,) mean, and in Cartesian parts carrier, amplitude and frequency
            modulation
        """
        mean, a, b, c, d, e, f = parameters
        angle = 2 * np.pi * self.phase
        cosine = np.cos(angle)
        sine = np.sin(angle)
        turn = e * sine + f * cosine
        amplitude = 1.0 + c * cosine + d * sine
        carrier = a * np.cos(angle + turn) - b * np.sin(angle + turn)
        return self.root_weight * (mean + amplitude * carrier - self.value)


def fit(phase: Array, weight: Array, value: Array) -> Modulation:
    """Fit the seven parameters to samples by least squares.

    The modulations are fitted in their Cartesian parts, ``A cos φ_a`` and so on, where
    the problem has no singular point; it is started from the fundamental harmonic with
    no modulation and with four small ones, and the best result is kept, so that equal
    samples always give equal parameters.

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

    samples = _Samples(phase, np.sqrt(weight), (value - first.mean) / scale)
    direction = np.array([np.cos(first.phase[0]), np.sin(first.phase[0])])
    fundamental = (first.amplitude[0] / scale) * direction
    fits = []
    for modulation in FIT_STARTS:
        start = np.array([0.0, *fundamental, *modulation])
        fits.append(least_squares(samples.residual, start, method="lm"))

    mean, a, b, c, d, e, f = min(fits, key=lambda result: result.cost).x
    return Modulation(
        mean=float(first.mean + scale * mean),
        carrier=float(scale * np.hypot(a, b)),
        carrier_phase=float(np.arctan2(b, a)),
        am=float(np.hypot(c, d)),
        am_phase=float(np.arctan2(-d, c)),
        fm=float(np.hypot(e, f)),
        fm_phase=float(np.arctan2(f, e)),
    )


class MemberError(NamedTuple):
    """Errors of one gear.

    Parameters
    ----------
    teeth : number of teeth
    total_composite, tooth_composite : F_i′ and f_i′ [m]
    installation : tolerances Δe_q, each with a random direction [m]
    eccentricity : distance of the toothing's axis from the axis it turns about [m]
    composite : what F_i′ − f_i′ comes from, ``runout`` of the toothing or its ``pitch``
    measured : waves of measured pitches along the line of action, ``a cos(2π k φ/z +
        p)`` of the mesh phase φ: (k, a [m], p [rad])
    """

    teeth: int
    total_composite: float = 0.0
    tooth_composite: float = 0.0
    installation: tuple[float, ...] = ()
    eccentricity: float = 0.0
    composite: str = "runout"
    measured: tuple[tuple[int, float, float], ...] = ()


class Realisation(NamedTuple):
    """Errors of one member, drawn.

    Parameters
    ----------
    mesh : mesh harmonics (order, amplitude [m], phase [rad])
    runout : once-per-revolution parts of an axis that runs out (teeth of the member,
        amplitude [m], initial angle [rad]); infinitely many teeth: at rest in the
        carrier
    pitch : those of pitches that add up over the teeth, likewise
    measured : of measured pitches (waves to a turn, teeth of the member, amplitude [m],
        initial angle of the wave [rad])
    """

    mesh: tuple[tuple[float, float, float], ...]
    runout: tuple[tuple[float, float, float], ...]
    pitch: tuple[tuple[float, float, float], ...] = ()
    measured: tuple[tuple[int, int, float, float], ...] = ()

    @property
    def slow(self) -> tuple[tuple[float, float, float], ...]:
        """All that repeats after a revolution: (mesh periods, amplitude, angle)."""
        waves = (
            (teeth / order, size, start) for order, teeth, size, start in self.measured
        )
        return (*self.runout, *self.pitch, *waves)

    @property
    def acts(self) -> bool:
        """Whether any part is other than nought."""
        return any(size != 0.0 for _, size, _ in (*self.mesh, *self.slow))

    def turned(self, angle: float) -> "Realisation":
        """Return the member seen from another side: its slow parts lead by an angle.

        Parameters
        ----------
        angle : by which they lead [rad]
        """
        measured = tuple(
            (order, teeth, size, start + order * angle)
            for order, teeth, size, start in self.measured
        )
        return self._replace(
            runout=_turned(self.runout, angle),
            pitch=_turned(self.pitch, angle),
            measured=measured,
        )

    def at_other_mesh(self, angle: float) -> "Realisation":
        """Return a planet as its other mesh has it.

        Its axis, displaced, displaces both meshes at once, along directions that are
        ``angle`` apart. A tooth comes there half a turn later, with its other flank:
        pitches change their sign twice. Measured pitches, of which the other side is
        taken to be alike, do so in odd orders of the turn, in even ones once.

        Parameters
        ----------
        angle : by which the other mesh's direction makes a runout lead [rad]
        """
        measured = tuple(
            (order, teeth, size, start + np.pi * (order + 1))
            for order, teeth, size, start in self.measured
        )
        return self._replace(runout=_turned(self.runout, angle), measured=measured)

    def of(self, amplitude: float, angle: float) -> "Realisation":
        """Return this with another error, which is at rest in the carrier.

        Parameters
        ----------
        amplitude : of the error, 0: none [m]
        angle : its phase [rad]
        """
        if amplitude == 0.0:
            return self
        at_rest = (np.inf, amplitude, angle)
        return self._replace(runout=(*self.runout, at_rest))


def _turned(
    parts: tuple[tuple[float, float, float], ...], angle: float
) -> tuple[tuple[float, float, float], ...]:
    """Return parts (teeth, amplitude, initial angle) that lead by an angle."""
    return tuple((teeth, size, start + angle) for teeth, size, start in parts)


AT_REST = Realisation((), ())
"""No error, to which errors at rest in the carrier are added."""


def realised(member: MemberError, random: np.random.Generator) -> Realisation:
    """Draw the initial angles of a member: of its toothing and of each tolerance.

    Parameters
    ----------
    member : errors of the gear
    random : draws the angles

    References
    ----------
    W23 Eqs. 28–32.
    """
    turn = 2 * np.pi
    start = random.uniform(0.0, turn)
    directions = random.uniform(0.0, turn, len(member.installation))

    of_teeth: tuple[tuple[float, float, float], ...] = ()
    if member.tooth_composite:
        of_teeth = ((1.0, 0.5 * member.tooth_composite, member.teeth * start),)

    composite: tuple[tuple[float, float, float], ...] = ()
    if member.total_composite:
        amplitude = 0.5 * (member.total_composite - member.tooth_composite)
        composite = ((member.teeth, amplitude, start),)

    axis: list[tuple[float, float, float]] = []
    for tolerance, direction in zip(member.installation, directions, strict=True):
        axis.append((member.teeth, tolerance, direction))
    if member.eccentricity:
        axis.append((member.teeth, member.eccentricity, random.uniform(0.0, turn)))

    # a cosine begins a quarter of its wave ahead of a sine
    measured = tuple(
        (order, member.teeth, size, start + 0.5 * np.pi)
        for order, size, start in member.measured
    )
    if member.composite == "pitch":
        return Realisation(of_teeth, tuple(axis), composite, measured)
    return Realisation(of_teeth, (*composite, *axis), measured=measured)


@dataclass(frozen=True)
class MeshError(Waves):
    """The prescribed error of one mesh, one realisation: waves of the mesh period [m].

    Parameters
    ----------
    slow : once-per-revolution parts, of orders 1/z of the members that turn
    """

    slow: Waves

    def slow_at(self, turns: Mapping[int, Array]) -> Array:
        """Return the once-per-revolution part of the error, (n,) [m].

        Parameters
        ----------
        turns : (n,) angles of the members, by tooth number, in turns [1]
        """
        rows = []
        for order in self.slow.order:
            is_at_rest = order == 0.0
            rows.append(np.zeros(ANGLES) if is_at_rest else turns[round(1.0 / order)])
        turned = np.reshape(rows, (len(rows), ANGLES))
        angle = 2 * np.pi * turned + self.slow.phase[:, None]
        return np.asarray(self.slow.amplitude @ np.sin(angle))


def mesh_error(
    members: tuple[MemberError, ...],
    harmonics: tuple[tuple[int, float, float], ...] = (),
    seed: int = 0,
    parts: tuple[Realisation, ...] = (),
) -> MeshError:
    """Return one realisation of the errors of a mesh.

    Parameters
    ----------
    members : the two gears, to be drawn
    harmonics : prescribed (order, amplitude [m], phase [rad]) of the mesh frequency
    seed : seed of the initial angles, one θ0 ~ U[0, 2π) per gear and one per tolerance
    parts : members that are drawn already

    References
    ----------
    W23 Eqs. 28–32; one θ0 a realisation, not drawn anew at every step.
    """
    random = np.random.default_rng(seed)
    drawn = [*(realised(member, random) for member in members), *parts]
    mesh = [(float(r), size, start) for r, size, start in harmonics]
    mesh += [part for deviation in drawn for part in deviation.mesh]
    slow = [part for deviation in drawn for part in deviation.slow]
    order, amplitude, phase = np.array(mesh, float).reshape(-1, 3).T
    teeth, slow_amplitude, slow_phase = np.array(slow, float).reshape(-1, 3).T
    slow_waves = Waves(1.0 / teeth, slow_amplitude, slow_phase)
    return MeshError(order, amplitude, phase, slow_waves)


def quadrature(teeth: Iterable[int]) -> dict[int, Array]:
    """Return equally weighted angles of members by tooth number, in turns [1].

    A rank-1 lattice: the members with the k-th of the tooth numbers stand at ``i k /
    8`` turns, i = 0…7. Means, squares and products of two once-per-revolution errors of
    up to three tooth numbers are averaged exactly.

    Parameters
    ----------
    teeth : numbers of teeth of the members; members with equal ones turn together

    References
    ----------
    W23 Eqs. 28–32, for the errors whose angles these are.
    """
    return {
        z: (np.arange(ANGLES) * k / ANGLES) % 1.0
        for k, z in enumerate(sorted(set(teeth)), start=1)
    }


def extremes_over_turn(values: Array, teeth: Iterable[int]) -> Array:
    """Return smallest and largest of what slow errors move, over a whole turn, (2, n).

    On the angles of `quadrature` the k-th of the tooth numbers makes a wave of order k.
    Each is taken at its crest, for members of other tooth numbers come to all angles
    with one another; what is no such wave is added as it was found.

    Parameters
    ----------
    values : (8, n) at the angles of `quadrature`
    teeth : numbers of teeth of the members

    References
    ----------
    W23 Eqs. 28–32, for the errors that move them.

    >>> angle = 2.0 * np.pi * (np.arange(8) / 8.0) + 0.3
    >>> extremes = extremes_over_turn(1.0 + np.sin(angle)[:, None], [20])
    >>> print(np.abs(np.round(extremes.T, 12)))
    [[0. 2.]]
    """
    members = len(set(teeth))
    coefficient = np.fft.rfft(values, axis=0) / ANGLES
    mean = values.mean(axis=0)
    waves = 2.0 * np.abs(coefficient[1 : members + 1]).sum(axis=0)

    unexplained = coefficient.copy()
    unexplained[: members + 1] = 0.0
    rest = np.fft.irfft(ANGLES * unexplained, ANGLES, axis=0)
    reach = waves + np.abs(rest).max(axis=0)
    return np.stack([mean - reach, mean + reach])
