"""Harmonic balance with alternating frequency and time, for the same mesh force as
every other method.

The state enters a mesh force by its deflection alone. With a mean stiffness k̄ kept on
the linear side,

    ``(Z(ω) + Σ D_i (k̄_i + iω c_i) d_i) q = F + Σ D_i ((k̄_i + iω c_i) e_i − N_i(δ))``,
    ``δ_i = d_i q − e_i``, ``N_i = Σ_j k_j max(0, δ − g_j) − back contact − k̄ δ − c δ̇
    [parted]``

so the unknowns are the harmonics of the mesh deflections, 2 H + 1 a mesh, whatever the
number of coordinates. N is taken in time at even phases, its derivative by a Toeplitz
matrix of the harmonics of the tangent stiffness: Newton's method with the exact
derivative (but for damping of parted flanks).

Source: Cameron & Griffin, J. Appl. Mech. 56 (1989) 149–154; for gears Kahraman &
Blankenship, J. Appl. Mech. 64 (1997) 217–226.
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve

from wearlab.accuracy.equation import Motion
from wearlab.mesh.force import Deflections

Array = NDArray[np.float64]
Harmonics = NDArray[np.complex128]

OVERSAMPLING = 8
"""Samples of a period for each harmonic, so that what is truncated hardly folds
back."""
MAX_TURNS = 40
SETTLED = 1e-9
"""What is missing of the balance, over the deflection, at which Newton's method ends
[1]."""


class MeshSamples(NamedTuple):
    """The mesh at even phases of ``periods`` mesh periods.

    Parameters
    ----------
    stiffness, gap : (n_mesh, n_pairs, n_samples) [N/m], [m]
    error : (n_mesh, n_samples) [m]
    gap_rate, lead_rate : (n_mesh, n_pairs, n_samples), (n_mesh, n_samples) [m/s]
    """

    stiffness: Array
    gap: Array
    error: Array
    gap_rate: Array
    lead_rate: Array


class HarmonicBalance:
    """The balance of one wear state at so many harmonics.

    Building it is not timed, as the cells are not.

    Parameters
    ----------
    given : the equation of motion, without friction
    harmonics : of the orbit's own period
    periods : mesh periods of the orbit
    """

    def __init__(self, given: Motion, harmonics: int, periods: int) -> None:
        if given.rubs or given.shared:
            raise ValueError(
                "harmonic balance is written for uncoupled pairs without friction"
            )
        self.given, self.harmonics, self.periods = given, harmonics, periods
        self.gated = given.gated
        count = 2 ** int(np.ceil(np.log2(OVERSAMPLING * harmonics)))
        self.mesh = sampled(given, periods * np.arange(count) / count % 1.0)
        self.mean = self.mesh.stiffness.sum(axis=1).mean(axis=1)
        self.frequency = 2 * np.pi / (given.period * periods) * np.arange(harmonics + 1)

    def linear(self) -> tuple[Harmonics, Harmonics]:
        """Return δ without N and the receptances −∂δ/∂N, harmonics first: (H + 1, m),
        (H + 1, m, m).
        """
        t = self.given
        omega = self.frequency
        n = len(t.push)
        m = len(t.backlash)
        feed = self.mean + 1j * omega[:, None] * t.mesh_damping
        column = t.per_force[:m].T
        impedance = np.zeros((len(omega), n, n), complex)
        impedance += t.stiffness - omega[:, None, None] ** 2 * np.eye(n)
        impedance += 1j * omega[:, None, None] * t.damping
        impedance += np.einsum("im,hm,mj->hij", column, feed, t.direction)
        error = self._harmonics(self.mesh.error).T
        push = np.einsum("im,hm->hi", column, feed * error)
        push[0] += t.push
        both = np.linalg.solve(
            impedance,
            np.concatenate([push[..., None], column + 0.0 * feed[:, :1, None]], 2),
        )
        found = np.einsum("mi,hik->hmk", t.direction, both)
        return found[..., 0] - error, found[..., 1:]

    def solve(self, start: Harmonics | None = None) -> Harmonics | None:
        """Return the harmonics of the mesh deflections (n_mesh, H + 1) [m], None where
        Newton fails.

        Parameters
        ----------
        start : (n_mesh, H + 1) first guess; the linear response where left out
        """
        free, receptance, real = self._parts
        delta = free.T if start is None else start
        factors = None
        known = np.empty(0)
        for _ in range(MAX_TURNS):
            force, tangent = self._remainder(delta)
            missing = (
                free.T
                - np.einsum("hmk,kh->mh", receptance, self._harmonics(force))
                - delta
            )
            if np.abs(missing).max() <= SETTLED * np.abs(delta).max():
                return delta
            if factors is None or not np.array_equal(
                tangent, known
            ):  # while flanks touch it never changes
                jacobian = real @ _toeplitz(
                    self._harmonics(tangent, 2 * self.harmonics)
                )
                jacobian[np.diag_indices(len(jacobian))] += 1.0
                factors = lu_factor(jacobian, overwrite_a=True, check_finite=False)
                known = tangent
            step = np.asarray(
                lu_solve(factors, _stacked(missing), check_finite=False), np.float64
            )
            delta = delta + _unstacked(step, len(self.given.backlash))
        return None

    @cached_property
    def _parts(self) -> tuple[Harmonics, Harmonics, Array]:
        """What wear and Newton's steps leave as it is: `linear`, and
        its matrix on stacked harmonics.
        """
        free, receptance = self.linear()
        return free, receptance, _real_matrix(receptance)

    def deflection(self, delta: Harmonics, phase: Array) -> Array:
        """Return the mesh deflections (n_periods, n_mesh, n_phases)
        [m] at phases in [0, 1).
        """
        turns = (np.arange(self.periods)[:, None] + phase) / self.periods
        waves = np.exp(2j * np.pi * np.arange(self.harmonics + 1) * turns[..., None])
        waves[..., 1:] *= 2.0
        return np.einsum("pth,mh->pmt", waves, delta).real

    def motions(self, delta: Harmonics, phase: Array) -> Deflections:
        """Return the same as motions of which the deflections alone are told."""
        deflection = self.deflection(delta, phase)
        return Deflections(deflection, np.zeros_like(deflection))

    def harmonics_of(self, deflection: Array) -> Harmonics:
        """Return the harmonics of deflections (n_mesh, n_t) [m] at
        even phases of the orbit.
        """
        return self._harmonics(deflection)

    def _harmonics(self, samples: Array, most: int | None = None) -> Harmonics:
        most = self.harmonics if most is None else most
        found: Harmonics = np.fft.rfft(samples, axis=-1, norm="forward")[
            ..., : most + 1
        ]
        return found

    def _remainder(self, delta: Harmonics) -> tuple[Array, Array]:
        """Return N and its derivative by δ in time, (n_mesh, n_samples)."""
        count = self.mesh.error.shape[1]
        here = np.fft.irfft(delta, count, axis=-1, norm="forward")
        rate = np.fft.irfft(1j * self.frequency * delta, count, axis=-1, norm="forward")
        c = self.given.mesh_damping[:, None]
        approach = here[:, None] - self.mesh.gap
        k = np.where(approach > 0.0, self.mesh.stiffness, 0.0)
        tangent = k.sum(axis=1)
        pressed = k * approach
        if self.gated:  # the linear side has c times the rate of δ already
            share = np.divide(
                k, tangent[:, None], out=np.zeros_like(k), where=tangent[:, None] > 0.0
            )
            damped = pressed + c[:, None] * share * (rate[:, None] - self.mesh.gap_rate)
            force = (
                np.where(k > 0.0, np.maximum(damped, 0.0), 0.0).sum(axis=1) - c * rate
            )
        else:
            force = pressed.sum(axis=1) - c * self.mesh.lead_rate
        back = -self.given.backlash[:, None] - here
        if (back > 0.0).any():
            every = self.mesh.stiffness.sum(axis=1)
            normal = every * back - (c * rate if self.gated else 0.0)
            force = force - np.where(back > 0.0, np.maximum(normal, 0.0), 0.0)
            tangent = tangent + (back > 0.0) * every
        return force - self.mean[:, None] * here, tangent - self.mean[:, None]


def sampled(given: Motion, phase: Array) -> MeshSamples:
    """Return stiffness, gaps and errors at phases in [0, 1)."""
    edges = given.edges
    pairs = given.pairs
    cell = np.clip(np.searchsorted(edges, phase, side="right") - 1, 0, len(edges) - 2)
    u = (phase - edges[cell]) / np.diff(edges)[cell]
    powers = u[:, None] ** np.arange(given.coefficients.shape[-1])
    values = np.einsum("tmqc,tc->mqt", given.coefficients[cell], powers)
    rate = values[:, 2 * pairs : 3 * pairs]
    lead = values[:, -3]
    stiffness = np.maximum(values[:, :pairs], 0.0)
    gap = values[:, pairs : 2 * pairs]
    return MeshSamples(
        stiffness, gap, values[:, -2], rate / given.period, lead / given.period
    )


def _stacked(values: Harmonics) -> Array:
    """Return harmonics (m, H + 1) as mean, real parts, imaginary parts of every mesh,
    (m (2 H + 1),).
    """
    return np.concatenate([values.real, values.imag[:, 1:]], axis=1).ravel()


def _unstacked(values: Array, meshes: int) -> Harmonics:
    """Return what `_stacked` was given."""
    rows = values.reshape(meshes, -1)
    most = rows.shape[1] // 2
    found = rows[:, : most + 1].astype(complex)
    found[:, 1:] += 1j * rows[:, most + 1 :]
    return found


def _real_matrix(receptance: Harmonics) -> Array:
    """Return receptances (H + 1, m, m) as a matrix on stacked harmonics."""
    most = len(receptance) - 1
    m = receptance.shape[1]
    size = 2 * most + 1
    found = np.zeros((m, size, m, size))
    h = np.arange(most + 1)
    found[:, h, :, h] = receptance.real
    h = h[1:]
    tail = np.arange(most + 1, size)
    found[:, tail, :, tail] = receptance[1:].real
    found[:, h, :, tail] = -receptance[1:].imag
    found[:, tail, :, h] = receptance[1:].imag
    return found.reshape(m * size, m * size)


def _toeplitz(tangent: Harmonics) -> Array:
    """Return the matrix on stacked harmonics that multiplies by a function of time,
    block by mesh.

    ``(k δ)_h = Σ_m k_{h−m} δ_m + k_{h+m} δ_m*`` over m ≥ 1, and ``k_h δ_0``.

    Parameters
    ----------
    tangent : (m, 2 H + 1) harmonics of the functions
    """
    meshes = len(tangent)
    most = (tangent.shape[1] - 1) // 2
    size = 2 * most + 1
    h = np.arange(most + 1)
    apart = h[:, None] - h
    over = h[:, None] + h
    near = np.where(
        apart >= 0, tangent[:, np.abs(apart)], tangent[:, np.abs(apart)].conj()
    )
    far = tangent[:, over]
    far[:, :, 0] = 0.0
    both = near + far
    difference = near - far
    found = np.zeros((meshes, size, meshes, size))
    for mesh in range(meshes):
        block = found[mesh, :, mesh]
        block[: most + 1, : most + 1] = both[mesh].real
        block[: most + 1, most + 1 :] = -difference[mesh, :, 1:].imag
        block[most + 1 :, : most + 1] = both[mesh, 1:].imag
        block[most + 1 :, most + 1 :] = difference[mesh, 1:, 1:].real
    return found.reshape(meshes * size, meshes * size)
