"""The equation of motion of every dynamic model, as plain arrays."""

from typing import Any, NamedTuple, Self

import numpy as np

from wearlab.arrays import Array, Flags
from wearlab.dynamics.supports import AXES, Support, damping_of, stiffness_of


class System(NamedTuple):
    """A vibrating structure with mesh forces between its coordinates.

    ``M q̈ + (C + ω_c G) q̇ + (K − ω_c² K_ω) q + Σ_i d_i W_i = F`` with ``δ_i = d_i·q −
    e_i`` and W_i the normal forces of the mesh's flanks, drive minus back, see
    `wearlab.mesh.force`. What is ``None`` is absent.

    Tooth friction adds ``Σ_i Σ_p Λμ_p N_p (f0_i + s_p f1_i)`` to the left-hand side,
    N_p the normal force on the drive flank of pair p and s_p its path position: lever
    arms are linear in s, so two constant vectors a mesh say all. The kinematic
    direction d stays. Friction on back flanks is left out: they carry load in rattle
    alone.

    Parameters
    ----------
    coordinates : names of q, e.g. ``("pinion.y", "gear.y", "mesh.x")``
    mass, damping, stiffness : (n, n) M [kg], C [N s/m], K [N/m]
    direction : (n_mesh, n) d [1]
    load : (n,) constant load F [N]
    mesh_damping : (n_mesh,) c [N s/m]
    damping_always : the mesh damping acts in separation too (the papers), not only
        while flanks touch
    backlash : (n_mesh,) normal backlash j_bn [m]: back contact at δ < −j_bn; None: no
        back flank
    fluctuation_direction : (n,) load that the tabulated fluctuation multiplies [N], or
        None
    gyroscopic, centripetal : (n, n) G [kg], K_ω [kg], or None
    rotation : ω_c [rad/s]
    meshes : names of the meshes, e.g. ``("sun-planet-1", …, "planet-ring-N")``; ()
        where one needs no name
    friction_constant, friction_slope : (n_mesh, n) f0 [1], f1 [1/m], or None without
        friction
    balance : (n,) a load of unknown size that keeps the mean speed of a system free to
        turn; None: the loads given must be in balance [1]
    supports : what holds the members; they make up C and K and say which force a
        bearing exerts
    damping_law : of the meshes, where their normal force is not linear in the motion,
        see `wearlab.mesh.damping`; None: viscous
    """

    coordinates: tuple[str, ...]
    mass: Array
    damping: Array
    stiffness: Array
    direction: Array
    load: Array
    mesh_damping: Array
    damping_always: bool
    backlash: Array | None = None
    fluctuation_direction: Array | None = None
    gyroscopic: Array | None = None
    centripetal: Array | None = None
    rotation: float = 0.0
    meshes: tuple[str, ...] = ()
    friction_constant: Array | None = None
    friction_slope: Array | None = None
    balance: Array | None = None
    supports: tuple[Support, ...] = ()
    damping_law: Any = None

    @classmethod
    def on(
        cls,
        supports: tuple[Support, ...],
        coordinates: tuple[str, ...],
        mass: Any,
        **options: Any,
    ) -> Self:
        """Return the system of masses on supports: ``C = Σ c r rᵀ``, ``K = Σ k d dᵀ``.

        Parameters
        ----------
        supports : springs and dampers
        coordinates : their names
        mass : (n,) mass of every coordinate [kg]
        options : the other fields of a system
        """
        damping = damping_of(supports, len(coordinates))
        stiffness = stiffness_of(supports, len(coordinates))
        inertia = np.diag(np.array(mass, float))
        return cls(
            coordinates, inertia, damping, stiffness, **options, supports=supports
        )

    def __hash__(self) -> int:
        """Return a hash by identity.

        Systems do not change, and caches remember results of one system.
        """
        return id(self)

    def __eq__(self, other: object) -> bool:
        return self is other

    @property
    def on_bearings(self) -> bool:
        """Whether a member moves on its support."""
        return any(support.axis in AXES for support in self.supports)

    @property
    def turns(self) -> Flags:
        """Which coordinates are rotations, seen at their member's radius, (n,)."""
        return np.array([name.endswith(".u") for name in self.coordinates])

    @property
    def central(self) -> Flags:
        """Which coordinates are of other members than planets, (n,)."""
        return np.array([not name.startswith("planet-") for name in self.coordinates])

    @property
    def total_damping(self) -> Array:
        """C + ω_c G, (n, n) [N s/m]."""
        return (
            self.damping
            if self.gyroscopic is None
            else self.damping + self.rotation * self.gyroscopic
        )

    @property
    def total_stiffness(self) -> Array:
        """K − ω_c² K_ω, (n, n) [N/m]."""
        if self.centripetal is None:
            return self.stiffness
        return self.stiffness - self.rotation**2 * self.centripetal

    @property
    def force_vectors(self) -> tuple[Array, Array]:
        """Direction and force vector of every channel, (n_channel, n) each [1]."""
        if self.friction_constant is None or self.friction_slope is None:
            return self.direction, self.direction
        vectors = [self.direction, self.friction_constant, self.friction_slope]
        return np.vstack([self.direction] * 3), np.vstack(vectors)

    def in_contact(self, mesh_stiffness: Array) -> Array:
        """Return ``K − ω_c² K_ω + Σ k_i d_i d_iᵀ``, all in contact, (n, n) [N/m].

        Parameters
        ----------
        mesh_stiffness : (n_mesh,) k_i [N/m]
        """
        d = self.direction
        return self.total_stiffness + d.T @ (mesh_stiffness[:, None] * d)
