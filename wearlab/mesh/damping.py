"""Damping laws as compiled code takes them.

A law is a named tuple with arrays over the meshes, and two functions of one flank: one
for flanks that touch, one for the pair of least clearance of a mesh whose flanks are
apart. Each returns the normal force and its derivatives by compression and by rate of
approach. ``None`` is the viscous law, built into the steps.
"""

from collections.abc import Callable
from typing import Any

from wearlab.compiled import by_type


def viscous(
    law: Any, m: Any, force: float, stiffness: float, part: float, rate: float
) -> Any:
    """Return ``F + c ẋ`` and its derivatives, also where that pulls."""
    return force + part * rate, stiffness, part


def nothing(
    law: Any, m: Any, clearance: float, rate: float
) -> tuple[float, float, float]:
    """Return that flanks which are apart exert nothing."""
    return 0.0, 0.0, 0.0


LAWS: dict[type, tuple[Callable[..., Any], Callable[..., Any]]] = {
    type(None): (viscous, nothing)
}
"""Of every law's tuple its two functions, see `register`."""


def register(
    law: type, in_contact: Callable[..., Any], apart: Callable[..., Any]
) -> None:
    """Say how the forces of a law are found.

    Parameters
    ----------
    law : the named tuple
    in_contact : of (law, mesh, elastic force [N], its stiffness [N/m], the flank's part
        of c [N s/m], rate of approach [m/s]); returns the normal force [N], its
        derivatives by compression [N/m] and rate [N s/m]
    apart : of (law, mesh, clearance [m], rate of approach [m/s]); the same of flanks
        that are apart
    """
    LAWS[law] = in_contact, apart


contact_force = by_type(
    lambda law, *rest: LAWS[getattr(law, "instance_class", type(None))][0]
)
"""Return the normal force of a flank that touches and its derivatives, see
`register`."""
apart_force = by_type(
    lambda law, *rest: LAWS[getattr(law, "instance_class", type(None))][1]
)
"""Return the normal force of flanks that are apart and its derivatives, see
`register`."""
