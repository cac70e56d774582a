"""Natural frequencies, modes, and the speeds at which the mesh excites them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from wearlab.dynamics.system import System

Array = NDArray[np.float64]


class Modes(NamedTuple):
    """Modes of a system with constant mesh stiffness.

    Parameters
    ----------
    frequency : (n,) natural frequencies, ascending [Hz]; 0 for a rigid-body mode
    shape : (n_modes, n) mass-normalised mode shapes φ, ``φᵀ M φ = 1`` [kg^−½]
    participation : (n_modes, n_mesh) share of each mesh's compliance mass in a mode,
        ``(dᵀφ)²/(dᵀ M⁻¹ d)``, which sums to 1 over the modes [1]
    """

    frequency: Array
    shape: Array
    participation: Array

    def excited(self, threshold: float = 1e-6) -> NDArray[np.bool_]:
        """Whether a mesh excites each mode, (n_modes,)."""
        return np.asarray((self.participation > threshold).any(axis=1))


def modes(system: System, mesh_stiffness: Array | float) -> Modes:
    """Solve ``(K − ω_c² K_ω + Σ k_i d_i d_iᵀ) φ = ω² M φ``.

    Parameters
    ----------
    system : the one form; damping and gyroscopic terms are left out
    mesh_stiffness : mean stiffness of each mesh, (n_mesh,) or one value [N/m]

    Returns
    -------
    Modes
    """
    d = system.direction
    k = np.broadcast_to(np.asarray(mesh_stiffness, float), (len(d),))
    stiffness = system.total_stiffness + d.T @ (k[:, None] * d)
    square, vectors = eigh(stiffness, system.mass)
    mobility = np.einsum("mi,ij,mj->m", d, np.linalg.inv(system.mass), d)
    participation = (vectors.T @ d.T) ** 2 / mobility
    return Modes(np.sqrt(np.maximum(square, 0.0)) / (2.0 * np.pi), vectors.T.copy(), participation)


def critical_speeds(frequency: Array, teeth: int, orders: int = 1) -> Array:
    """Return speeds of the reference gear at which a harmonic of the mesh meets a mode.

    ``order · z Ω/2π = f``: order 1 is the primary resonance, order r the super-harmonic at 1/r of its speed.

    Parameters
    ----------
    frequency : (n_modes,) [Hz]
    teeth : teeth of the reference gear z
    orders : highest harmonic of the mesh frequency

    Returns
    -------
    (orders, n_modes) speeds [rad/s]
    """
    order = np.arange(1, orders + 1)[:, None]
    speeds: Array = 2.0 * np.pi * np.asarray(frequency)[None, :] / (teeth * order)
    return speeds
