"""Damping laws whose normal force is not linear in the motion, as compiled code takes them.

A law is a named tuple with arrays over the meshes, and two functions of one flank: one for flanks that touch,
one for the pair of least clearance of a mesh whose flanks are apart. Each returns the normal force and its
derivatives by compression and by rate of approach. The viscous law is built into the steps.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba.extending import overload

from wearlab.arrays import Array
from wearlab.compiled import UNCOUNTED, jit
from wearlab.mesh.stages import Springs

LAWS: dict[type, tuple[Callable[..., Any], Callable[..., Any]]] = {}
"""Of every law's tuple its two functions, see `register`."""


def register(law: type, in_contact: Callable[..., Any], apart: Callable[..., Any]) -> None:
    """Say how the forces of a law are found.

    Parameters
    ----------
    law : the named tuple
    in_contact : of (law, mesh, elastic force [N], its stiffness [N/m], the flank's part of c [N s/m], rate of
        approach [m/s]); returns the normal force [N], its derivatives by compression [N/m] and rate [N s/m]
    apart : of (law, mesh, clearance [m], rate of approach [m/s]); the same of flanks that are apart
    """
    LAWS[law] = in_contact, apart


def contact_force(law: Any, m: Any, force: Any, stiffness: Any, part: Any, rate: Any) -> Any:
    """Return the normal force of a flank that touches and its derivatives, see `register`."""
    return LAWS[type(law)][0](law, m, force, stiffness, part, rate)


@overload(contact_force, jit_options=UNCOUNTED, strict=False)
def _choose_contact(law: Any, *rest: Any) -> Any:
    return LAWS[law.instance_class][0]


def apart_force(law: Any, m: Any, clearance: Any, rate: Any) -> Any:
    """Return the normal force of flanks that are apart and its derivatives, see `register`."""
    return LAWS[type(law)][1](law, m, clearance, rate)


@overload(apart_force, jit_options=UNCOUNTED, strict=False)
def _choose_apart(law: Any, *rest: Any) -> Any:
    return LAWS[law.instance_class][1]


def forces_by_law(
    law: Any, springs: Springs, motion: tuple[Array, Array], backlash: Array, damping: Array
) -> tuple[Array, Array, Array, Array]:
    """Return elastic and normal forces of pairs (…, n_mesh, n_pairs), then of back flanks (…, n_mesh).

    Parameters
    ----------
    law : the damping law, over n_mesh meshes
    springs : the flanks at the instants (…, n_mesh, n_pairs), rates of gaps by time
    motion : deflection and its rate (…, n_mesh) [m], [m/s]
    backlash, damping : (n_mesh,) normal backlash, infinite without back flanks [m], and c [N s/m]
    """
    shape = np.broadcast_shapes(motion[0].shape, springs.stiffness.shape[:-1])
    meshes, pairs = shape[-1], springs.stiffness.shape[-1]

    def flat(values: Array, *last: int) -> Array:
        return np.ascontiguousarray(np.broadcast_to(values, (*shape, *last))).reshape(-1, meshes, *last)

    part = np.empty((0, 0, 0, 0)) if springs.part is None else flat(springs.part, pairs, pairs)
    instants = int(np.prod(shape[:-1], dtype=int))
    pair, normal = np.zeros((2, instants, meshes, pairs))
    back, back_normal = np.zeros((2, instants, meshes))
    _fill(
        law, flat(springs.stiffness, pairs), flat(springs.gap, pairs), flat(springs.pair_rate, pairs), part,
        flat(motion[0]), flat(motion[1]), np.broadcast_to(backlash, (meshes,)).astype(float),
        np.broadcast_to(damping, (meshes,)).astype(float), pair, normal, back, back_normal,
    )  # fmt: skip
    of_pairs = (*shape, pairs)
    return pair.reshape(of_pairs), normal.reshape(of_pairs), back.reshape(shape), back_normal.reshape(shape)


@jit
def _fill(
    law: Any, stiffness: Any, gap: Any, gap_rate: Any, part: Any, deflection: Any, rate: Any, backlash: Any,
    damping: Any, pair: Any, normal: Any, back: Any, back_normal: Any,
) -> None:  # fmt: skip
    """Fill the forces of every instant and mesh; ``part`` is empty where springs are pairs."""
    instants, meshes, pairs = stiffness.shape
    tangent = np.zeros(pairs)
    for i in range(instants):
        for m in range(meshes):
            tangent[:] = 0.0
            every, lead, least = 0.0, -1, np.inf
            for j in range(pairs):
                k, clearance = stiffness[i, m, j], gap[i, m, j] - deflection[i, m]
                every += k
                if k > 0.0 and clearance < least:
                    lead, least = j, clearance
                if k > 0.0 and clearance < 0.0:
                    for p in range(pairs):
                        share = part[i, m, j, p] if len(part) > 0 else (1.0 if p == j else 0.0)
                        tangent[p] += share * k
                        pair[i, m, p] -= share * k * clearance
            total = tangent.sum()
            for p in range(pairs):
                if tangent[p] != 0.0:
                    own = damping[m] * tangent[p] / total
                    approach = rate[i, m] - gap_rate[i, m, p]
                    normal[i, m, p] = contact_force(law, m, pair[i, m, p], tangent[p], own, approach)[0]
            if total == 0.0 and lead >= 0:
                approach = rate[i, m] - gap_rate[i, m, lead]
                normal[i, m, lead] = apart_force(law, m, least, approach)[0]
            clearance = backlash[m] + deflection[i, m]
            if clearance < 0.0:
                back[i, m] = -every * clearance
                back_normal[i, m] = contact_force(law, m, back[i, m], every, damping[m], -rate[i, m])[0]
            elif clearance < np.inf and every > 0.0:
                back_normal[i, m] = apart_force(law, m, clearance, -rate[i, m])[0]
