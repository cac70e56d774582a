"""Natural frequencies, modes, and the speeds at which the mesh excites them."""

from collections.abc import Mapping
from typing import Literal, NamedTuple

import numpy as np
from scipy.linalg import eigh

from wearlab.arrays import Array, Flags
from wearlab.dynamics.system import System

MeshStiffness = Mapping[str, float] | Array | float
RIGID = 1e-6
"""Frequency over the highest one below which a mode is a rigid-body mode."""
ROUNDED = 1e-5
"""The same for a mode of negative square: what centripetal terms leave of a free
rotation."""


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

    def excited(self, threshold: float = 1e-6) -> Flags:
        """Whether a mesh excites each mode, (n_modes,)."""
        return np.asarray((self.participation > threshold).any(axis=1))


def per_mesh(system: System, mesh_stiffness: MeshStiffness) -> Array:
    """Return the stiffness of every mesh, (n_mesh,) [N/m].

    Parameters
    ----------
    system : the equation of motion; a mapping needs its ``meshes`` named
    mesh_stiffness : one value, (n_mesh,) values, or by kind: ``{"sun_planet": …,
        "planet_ring": …}`` [N/m]
    """
    if not isinstance(mesh_stiffness, Mapping):
        return np.broadcast_to(
            np.asarray(mesh_stiffness, float), (len(system.direction),)
        )
    kinds = [name.rpartition("-")[0].replace("-", "_") for name in system.meshes]
    if not kinds or set(kinds) != set(mesh_stiffness):
        wanted = (
            ", ".join(dict.fromkeys(kinds))
            or "one value, this system's mesh has no kind"
        )
        named = ", ".join(mesh_stiffness)
        raise ValueError(
            f"mesh_stiffness names {named}; the system's meshes are: {wanted}"
        )
    return np.array([float(mesh_stiffness[kind]) for kind in kinds])


def natural_frequencies(system: System, mesh_stiffness: MeshStiffness) -> Array:
    """Return the undamped natural frequencies, ascending, (n,) [Hz].

    They are 0 for rigid-body modes. ``(λ² M + λ ω_c G + K − ω_c² K_ω + Σ k_i d_i d_iᵀ)
    φ = 0``, λ = 2πi f: gyroscopic terms count where the system has them.

    Parameters
    ----------
    system : the equation of motion; damping is left out
    mesh_stiffness : mean stiffness of the meshes, see `per_mesh` [N/m]

    Raises
    ------
    ValueError
        When the stiffness is indefinite and the motion diverges.

    References
    ----------
    Lin & Parker 1999, with the gyroscopic terms of the carrier frame; W23 Eqs. 7–14.
    """
    if system.gyroscopic is None:
        return modes(system, mesh_stiffness).frequency
    stiffness = system.in_contact(per_mesh(system, mesh_stiffness))
    square, shapes = eigh(stiffness, system.mass)
    spin = shapes.T @ (system.rotation * system.gyroscopic) @ shapes
    rigid = np.abs(square) <= RIGID**2 * np.abs(square).max()
    free = ~rigid
    # The momentum of a free rotation is conserved: its speed follows from the positions
    # of the other modes, and what it returns to them acts as a spring.
    to_rigid = spin[np.ix_(rigid, free)]
    spring = np.diag(square[free]) + to_rigid.T @ to_rigid
    gyroscopic = spin[np.ix_(free, free)]
    zero = np.zeros_like(spring)
    identity = np.eye(len(spring))
    roots = np.linalg.eigvals(np.block([[zero, identity], [-spring, -gyroscopic]]))
    if roots.real.max() > RIGID * np.abs(roots).max():
        raise ValueError(_diverges(roots.real.max()))
    vibrating = np.sort(np.abs(roots.imag))[::2] / (2.0 * np.pi)
    return np.concatenate([np.zeros(int(rigid.sum())), vibrating])


def _diverges(rate: float) -> str:
    grows = (
        "K − ω_c² K_ω with these mesh stiffnesses is indefinite: a motion grows at "
        f"{rate:.3g} 1/s"
    )
    return f"{grows}; give the members stiffer supports or the carrier a lower speed"


def modes(system: System, mesh_stiffness: MeshStiffness) -> Modes:
    """Solve ``(K − ω_c² K_ω + Σ k_i d_i d_iᵀ) φ = ω² M φ``.

    Parameters
    ----------
    system : the equation of motion; damping and gyroscopic terms are left out
    mesh_stiffness : mean stiffness of the meshes, see `per_mesh` [N/m]

    Raises
    ------
    ValueError
        When the stiffness is indefinite.

    References
    ----------
    Lin & Parker, J. Vib. Acoust. 121 (1999) 316–321, for the planetary matrices.
    """
    d = system.direction
    square, vectors = eigh(
        system.in_contact(per_mesh(system, mesh_stiffness)), system.mass
    )
    participation = (vectors.T @ d.T) ** 2 / np.einsum(
        "mi,ij,mj->m", d, np.linalg.inv(system.mass), d
    )
    largest = np.abs(square).max()
    rigid = (np.abs(square) <= RIGID**2 * largest) | (
        (square < 0.0) & (square >= -(ROUNDED**2) * largest)
    )
    if square[~rigid].min(initial=0.0) < 0.0:
        raise ValueError(_diverges(float(np.sqrt(-square.min()))))
    return Modes(
        np.sqrt(np.where(rigid, 0.0, square)) / (2.0 * np.pi),
        vectors.T.copy(),
        participation,
    )


def critical_speeds(frequency: Array, teeth: float, orders: int = 1) -> Array:
    """Return speeds of a member at which a harmonic of the mesh meets a mode.

    ``order · z Ω/2π = f``: order 1 is the primary resonance, order r the super-harmonic
    at 1/r of its speed.

    Parameters
    ----------
    frequency : (n_modes,) [Hz]
    teeth : mesh periods in one turn of that member z: its teeth, in a pair
    orders : highest harmonic of the mesh frequency

    Returns
    -------
    (orders, n_modes) speeds [rad/s]

    References
    ----------
    ISO 6336-1: main resonance; L16 for the harmonics of the mesh.
    """
    order = np.arange(1, orders + 1)[:, None]
    angular = 2.0 * np.pi * np.asarray(frequency)[None, :]
    return np.asarray(angular / (teeth * order))


Kind = Literal["rigid-body", "rotational", "translational", "planet", "mixed"]
ONE_FREQUENCY = 1e-7
"""Relative distance of two natural frequencies that count as one."""
MOVES = 1e-9
"""Share of a mode's kinetic energy from which a motion takes part in it."""


def mode_kinds(system: System, modes: Modes) -> tuple[Kind, ...]:
    """Return the kind of every mode.

    With equal, equally spaced planets the central members (sun, ring, carrier) only
    turn in a rotational mode, only move in the plane in a translational one (which
    comes in pairs), and stand still in a planet mode; with anything else modes may be
    mixed. Within a group of equal frequencies any combination of shapes is a mode; each
    group is first turned so that its rotations and translations separate.

    Parameters
    ----------
    system : a planetary system
    modes : its modes

    References
    ----------
    Lin & Parker, J. Vib. Acoust. 121 (1999) 316–321.
    """
    turns = system.central & system.turns
    shifts = system.central & ~system.turns
    turns_less_shifts = (turns.astype(float) - shifts)[:, None] * system.mass
    gap = np.diff(modes.frequency)
    ends = np.flatnonzero(gap > ONE_FREQUENCY * modes.frequency[1:]) + 1
    kinds: list[Kind] = []
    for group in np.split(np.arange(len(modes.frequency)), ends):
        shapes = modes.shape[group]
        frequency = modes.frequency[group[0]]
        _, turn = np.linalg.eigh(shapes @ turns_less_shifts @ shapes.T)
        kinds += [
            _kind(shape, system.mass, turns, shifts, frequency)
            for shape in turn.T @ shapes
        ]
    return tuple(kinds)


def _kind(
    shape: Array, mass: Array, turns: Flags, shifts: Flags, frequency: float
) -> Kind:
    """Return the kind of a mode."""
    if frequency == 0.0:
        return "rigid-body"
    energy = shape * (mass @ shape)
    turning = energy[turns].sum() > MOVES
    shifting = energy[shifts].sum() > MOVES
    if turning and shifting:
        return "mixed"
    return "rotational" if turning else "translational" if shifting else "planet"
