"""Prescribed errors of a mesh: harmonics of the mesh frequency, and once-per-revolution parts of its members.

``e(φ) = Σ_r a_r sin(2π r φ + p_r) + Σ_m slow_m sin(θ_m)`` with, per member (W23 Eqs. 28–30),
``½(F_i′ − f_i′) sin θ + ½ f_i′ sin zθ`` and installation tolerances ``Σ_q Δe_q sin θ_q``. Every initial
angle is drawn once from the seed and never again.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class MemberError(NamedTuple):
    """Errors of one gear.

    Parameters
    ----------
    teeth : number of teeth
    total_composite, tooth_composite : F_i′ and f_i′ [m]
    installation : tolerances Δe_q, each with a random direction [m]
    """

    teeth: int
    total_composite: float = 0.0
    tooth_composite: float = 0.0
    installation: tuple[float, ...] = ()


class MeshError(NamedTuple):
    """The prescribed error of one mesh, one realisation.

    Parameters
    ----------
    order, amplitude, phase : (n,) mesh harmonics: orders [1], amplitudes [m], phases [rad]
    member_teeth, slow_amplitude, slow_phase : (k,) once-per-revolution parts: teeth of the member that
        turns, amplitude [m], initial angle [rad]
    """

    order: Array
    amplitude: Array
    phase: Array
    member_teeth: Array
    slow_amplitude: Array
    slow_phase: Array

    def value(self, phase: Array) -> Array:
        """Return the mesh-periodic part at phases (…) [m]."""
        if not len(self.order):
            return np.zeros(np.shape(phase))
        angle = 2 * np.pi * np.multiply.outer(phase, self.order) + self.phase
        return np.sin(angle) @ self.amplitude

    def rate(self, phase: Array) -> Array:
        """Return d/dφ of the mesh-periodic part at phases (…) [m]."""
        if not len(self.order):
            return np.zeros(np.shape(phase))
        angle = 2 * np.pi * np.multiply.outer(phase, self.order) + self.phase
        return np.cos(angle) @ (2 * np.pi * self.order * self.amplitude)

    def slow(self, turned: Array) -> Array:
        """Return the once-per-revolution part after ``turned`` mesh periods (…) [m]."""
        angle = 2 * np.pi * np.multiply.outer(turned, 1.0 / self.member_teeth) + self.slow_phase
        return np.sin(angle) @ self.slow_amplitude

    def slow_rate(self, turned: Array) -> Array:
        """Return d/dφ of the once-per-revolution part after ``turned`` mesh periods (…) [m]."""
        angle = 2 * np.pi * np.multiply.outer(turned, 1.0 / self.member_teeth) + self.slow_phase
        return np.cos(angle) @ (2 * np.pi / self.member_teeth * self.slow_amplitude)


def mesh_error(
    members: tuple[MemberError, ...], harmonics: tuple[tuple[int, float, float], ...] = (), seed: int = 0
) -> MeshError:
    """Draw one realisation of the errors of a mesh.

    Parameters
    ----------
    members : the two gears
    harmonics : prescribed (order, amplitude [m], phase [rad]) of the mesh frequency
    seed : seed of the initial angles, one θ0 ~ U[0, 2π) per gear and one per tolerance
    """
    random = np.random.default_rng(seed)
    mesh = [(float(order), amplitude, phase) for order, amplitude, phase in harmonics]
    slow: list[tuple[float, float, float]] = []
    for member in members:
        start = random.uniform(0.0, 2 * np.pi)
        directions = random.uniform(0.0, 2 * np.pi, len(member.installation))
        if member.tooth_composite:
            mesh.append((1.0, 0.5 * member.tooth_composite, member.teeth * start))
        if member.total_composite:
            amplitude = 0.5 * (member.total_composite - member.tooth_composite)
            slow.append((member.teeth, amplitude, start))
        slow.extend((member.teeth, t, d) for t, d in zip(member.installation, directions, strict=True))
    return MeshError(*np.array(mesh, float).reshape(-1, 3).T, *np.array(slow, float).reshape(-1, 3).T)


ANGLES = 8
"""Angles of the members over which slow errors are averaged."""
MOST_TRIED = 400


@lru_cache
def turns_of(teeth: tuple[int, ...], count: int) -> tuple[int, ...]:
    """Return ``count`` numbers of mesh periods after which the members stand at well spread angles.

    The members pass through angles ``t / z`` together, along one closed line: samples every τ mesh periods
    lie on it, and τ is the one whose samples keep farthest apart on the torus of all angles.

    Parameters
    ----------
    teeth : numbers of teeth of the members
    count : how many
    """
    period = math.lcm(*teeth)
    index = np.arange(1, count)
    best, chosen = -1.0, 1
    for step in np.unique(np.linspace(1, period, min(period, MOST_TRIED)).astype(int)):
        apart = np.multiply.outer(index * step, 1.0 / np.array(teeth))
        distance = float(np.linalg.norm(apart - np.round(apart), axis=1).min())
        if distance > best + 1e-12:
            best, chosen = distance, int(step)
    return tuple(int(k) * chosen for k in range(count))


def quadrature(teeth: Sequence[int], count: int = ANGLES) -> Array:
    """Return the mesh periods turned at which slow errors are averaged with equal weights, (count,) [1]."""
    return np.array(turns_of(tuple(sorted(set(teeth))), count), float)
