"""What holds the members: springs and dampers to ground or to another member, and the forces they exert."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array


class Support(NamedTuple):
    """One spring and damper that acts on a member, between it and ground or another member.

    The force on the member along its axis is ``preload − k d·q − c r·q̇``: a planet's bearing gives way by
    ``x_planet − x_pin``, so that d and r have entries of both.

    Parameters
    ----------
    member : name of the member it acts on
    axis : "x" or "y" of a translation, "u" of a rotation seen at the member's radius
    give : (n,) d, by how much it gives way with the coordinates [1]
    slip : (n,) r, by how much its rate follows the coordinates' rates [1]
    stiffness : k [N/m]
    damping : c [N s/m]
    preload : force on the member at q = 0, in balance with loads that the equation of motion leaves out [N]
    """

    member: str
    axis: str
    give: Array
    slip: Array
    stiffness: float
    damping: float
    preload: float = 0.0

    @property
    def bears(self) -> bool:
        """Whether it is a bearing, against a translation."""
        return self.axis in ("x", "y")


class MemberSupport(NamedTuple):
    """What holds a member of a planetary set, alike in every direction.

    Parameters
    ----------
    radial_stiffness : k_x = k_y; of a planet its bearing on the pin [N/m]
    tangential_stiffness : torsional support k_u at the base radius, the carrier's at the pin circle [N/m]
    radial_damping, tangential_damping : of the same [N s/m]
    """

    radial_stiffness: float = 0.0
    tangential_stiffness: float = 0.0
    radial_damping: float = 0.0
    tangential_damping: float = 0.0


FREE = MemberSupport()


def damping_by_ratio(ratio: float, stiffness: float, mass: float) -> float:
    """Return ``c = 2 ζ √(k m)`` of a spring and the mass (I/r², effective mass) it holds [N s/m].

    References
    ----------
    Kahraman & Singh 1990 for a mesh; W23 Table 1 gives the ratios ζ of supports.
    """
    return 2.0 * ratio * float(np.sqrt(stiffness * mass))


def damping_or_ratio(
    damping: float | None, ratio: float | None, stiffness: float | None, mass: float
) -> float:
    """Return a damping that is given, or what follows from its ratio [N s/m]."""
    return float(damping) if damping is not None else damping_by_ratio(ratio or 0.0, stiffness or 0.0, mass)


def grounded(coordinates: Sequence[str], name: str, stiffness: float, damping: float) -> tuple[Support, ...]:
    """Return the support of one coordinate against ground; none where nothing holds it.

    Parameters
    ----------
    coordinates : names of all coordinates
    name : the coordinate, such as ``"ring.x"``
    stiffness, damping : k [N/m], c [N s/m]
    """
    if stiffness == 0.0 and damping == 0.0:
        return ()
    own = np.array([float(coordinate == name) for coordinate in coordinates])
    member, _, axis = name.rpartition(".")
    return (Support(member, axis, own, own, stiffness, damping),)


def stiffness_of(supports: Sequence[Support], count: int) -> Array:
    """Return ``K = Σ k d dᵀ`` of supports, (count, count) [N/m]."""
    stiffness = np.zeros((count, count))
    for support in supports:
        stiffness += support.stiffness * np.outer(support.give, support.give)
    return stiffness


def damping_of(supports: Sequence[Support], count: int) -> Array:
    """Return ``C = Σ c r rᵀ`` of supports, (count, count) [N s/m]."""
    damping = np.zeros((count, count))
    for support in supports:
        damping += support.damping * np.outer(support.slip, support.slip)
    return damping


def support_force(support: Support, position: Array, velocity: Array) -> Array:
    """Return the force of a support on its member, ``preload − k d·q − c r·q̇`` (n_kept, n_instants) [N].

    Parameters
    ----------
    support : the support
    position, velocity : (n_kept, n, n_instants) coordinates q [m] and q̇ [m/s]
    """
    given = support.stiffness * np.einsum("i,kij->kj", support.give, position)
    return np.asarray(
        support.preload - given - support.damping * np.einsum("i,kij->kj", support.slip, velocity)
    )


def bearing_forces(
    supports: Sequence[Support], members: Sequence[str], position: Array, velocity: Array
) -> Array:
    """Return the force of the bearings on each member, (n_members, 2, n_kept, n_instants) along x and y [N].

    Parameters
    ----------
    supports : of the system; those against rotation exert no force
    members : names of the members wanted, 0 for those that none of the supports holds
    position, velocity : (n_kept, n, n_instants) coordinates q [m] and q̇ [m/s]
    """
    force = np.zeros((len(members), 2, len(position), position.shape[-1]))
    for support in supports:
        if support.bears and support.member in members:
            force[members.index(support.member), "xy".index(support.axis)] += support_force(
                support, position, velocity
            )
    return force
