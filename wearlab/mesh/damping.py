"""Damping laws as compiled code takes them.

A law is a named tuple with arrays over the meshes, and two functions of one flank: one
for flanks that touch, one for the pair of least clearance of a mesh whose flanks are
apart. Each returns the normal force and its derivatives by compression and by rate of
approach. ``None`` is the viscous law, built into the steps.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from wearlab.compiled import by_type


def viscous(
    law: Any, m: Any, force: float, stiffness: float, part: float, rate: float
) -> Any:
    """Return ``F + c ẋ`` and its derivatives, also where that pulls.

    Parameters and returns are those of `register`.
    """
    return force + part * rate, stiffness, part


def no_force(
    law: Any, m: Any, clearance: float, rate: float
) -> tuple[float, float, float]:
    """Return three zeros: flanks that are apart exert nothing.

    Parameters and returns are those of `register`.
    """
    return 0.0, 0.0, 0.0


class FlankForces(NamedTuple):
    """The two functions of a damping law, see `register`."""

    in_contact: Callable[..., Any]
    out_of_contact: Callable[..., Any]


LAWS: dict[type, FlankForces] = {type(None): FlankForces(viscous, no_force)}
"""The functions of every law, by the type of its tuple."""


def register(
    law: type, in_contact: Callable[..., Any], apart: Callable[..., Any]
) -> None:
    """Make the functions of a damping law known to compiled code.

    Parameters
    ----------
    law : type of the named tuple
    in_contact : of (law, mesh, elastic force [N], its stiffness [N/m], the flank's part
        of c [N s/m], rate of approach [m/s]); returns the normal force [N], its
        derivatives by compression [N/m] and rate [N s/m]
    apart : of (law, mesh, clearance [m], rate of approach [m/s]); the same of flanks
        that are apart
    """
    LAWS[law] = FlankForces(in_contact, apart)


def _forces_of(law: Any) -> FlankForces:
    """Return the functions of a law, by the type that numba knows of it."""
    return LAWS[getattr(law, "instance_class", type(None))]


contact_force = by_type(lambda law, *arguments: _forces_of(law).in_contact)
"""Return the normal force of a flank that touches and its derivatives, see
`register`."""
apart_force = by_type(lambda law, *arguments: _forces_of(law).out_of_contact)
"""Return the normal force of flanks that are apart and its derivatives, see
`register`."""
