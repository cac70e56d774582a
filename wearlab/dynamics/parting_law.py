"""Meshes whose flanks gain and lose contact, as polynomials over groups of equal steps.

Over a group every pair has polynomials through its stages, of ``k``, of ``k (g + e)`` (with friction of the
same times Λμ and Λμ s) and of ``g + e``, at which it parts. What touches is summed:
``W = k_c d·q + c δ̇ − w_c``.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.compiled import jit_inner
from wearlab.dynamics.power_series import DEGREE

Array = NDArray[np.float64]
Index = NDArray[np.int64]

ERROR, RATE, STIFFNESS, CARRIED = 0, 1, 2, 3
"""Polynomials of a mesh: e, de/dphase, Σ_p k_p and Σ_p k_p e, the last two for its back flank."""


class PartingPlan(NamedTuple):
    """What all wear states of a system on the same steps share.

    Parameters
    ----------
    first, size : (n_groups,) first step of each group, and how many steps
    length : (n_groups,) duration [s]
    fit : (5, 9, 9) by size of the group: coefficients of the polynomial through its stages
    stiffness, damping : (n,) K/M [1/s²], C/M [1/s]
    direction : (n_mesh, n) d [1]
    response : (n_channel, n) M⁻¹ times the force vectors [1/kg]
    mesh_damping : (n_mesh,) [N s/m]
    always : the mesh damping acts in separation, too
    backlash : (n_mesh,) j_bn, inf: no back flank [m]
    load : (n,) M⁻¹ F [m/s²]
    unknown : (n_balance, n) M⁻¹ times the loads of unknown size [m/s²]
    held : (n_balance,) coordinates whose place these take
    scale : (2n,) sizes of the states
    """

    first: Index
    size: Index
    length: Array
    fit: Array
    stiffness: Array
    damping: Array
    direction: Array
    response: Array
    mesh_damping: Array
    always: bool
    backlash: Array
    load: Array
    unknown: Array
    held: Index
    scale: Array


class Polynomials(NamedTuple):
    """The meshes over all groups, coefficients by fractions of the group.

    Parameters
    ----------
    present : (n_groups, n_mesh, n_pairs) whether the pair is in the path
    spring : (n_groups, 2 n_kinds, n_mesh, n_pairs, 9) k and k (g + e), with friction those by Λμ and Λμ s
    reach : (n_groups, n_mesh, n_pairs, 9) g + e [m]
    own : (n_groups, 4, n_mesh, 9) `ERROR`, `RATE`, `STIFFNESS`, `CARRIED`
    """

    present: NDArray[np.bool_]
    spring: Array
    reach: Array
    own: Array


@jit_inner
def fit_values(fit: Any, values: Any, count: int, found: Any) -> None:
    """Write the polynomial through ``count`` values at equal distances."""
    for power in range(DEGREE + 1):
        total = 0.0
        for i in range(count):
            total += fit[power, i] * values[i]
        found[power] = total


@jit_inner(allocates=True)
def fill_polynomials(plan: Any, tables: Any, friction: Any, found: Any) -> None:
    """Fill the polynomials of all groups from the tables; ``friction``: Λμ and Λμ s of all pairs, or None."""
    k, gap, error, rate = tables.stiffness, tables.gap, tables.error, tables.error_rate
    meshes, pairs = k.shape[2], k.shape[3]
    kinds, own, reach = np.empty((6, DEGREE + 1)), np.empty((4, DEGREE + 1)), np.empty(DEGREE + 1)
    for at in range(len(plan.first)):
        count, fit = 2 * plan.size[at] + 1, plan.fit[plan.size[at]]
        first, last = plan.first[at], plan.size[at] - 1
        for m in range(meshes):
            for i in range(count):
                step, x = first + min(i // 2, last), i - 2 * min(i // 2, last)
                own[ERROR, i], own[RATE, i] = error[step, x, m], rate[step, x, m]
                own[STIFFNESS, i], own[CARRIED, i] = 0.0, 0.0
            for p in range(pairs):
                found.present[at, m, p] = k[first, 1, m, p] > 0.0
                if not found.present[at, m, p]:
                    continue
                for i in range(count):
                    step, x = first + min(i // 2, last), i - 2 * min(i // 2, last)
                    stiff, reach[i] = k[step, x, m, p], gap[step, x, m, p] + own[ERROR, i]
                    kinds[0, i], kinds[1, i] = stiff, stiff * reach[i]
                    own[STIFFNESS, i] += stiff
                    own[CARRIED, i] += stiff * own[ERROR, i]
                    if friction is not None:
                        rubs, turns = friction[0][step, x, m, p], friction[1][step, x, m, p]
                        kinds[2, i], kinds[3, i] = stiff * rubs, stiff * rubs * reach[i]
                        kinds[4, i], kinds[5, i] = stiff * turns, stiff * turns * reach[i]
                for kind in range(found.spring.shape[1]):
                    fit_values(fit, kinds[kind], count, found.spring[at, kind, m, p])
                fit_values(fit, reach, count, found.reach[at, m, p])
            for x in range(4):
                fit_values(fit, own[x], count, found.own[at, x, m])


@jit_inner
def touches(contact: Any, m: int) -> bool:
    """Whether any flank of a mesh touches."""
    for p in range(contact.shape[1]):
        if contact[m, p]:
            return True
    return False


@jit_inner
def fill_law(
    plan: Any, polynomials: Any, at: int, period: float, contact: Any, law: Any, damping: Any
) -> None:
    """Fill k_c, then w_c, (2 n_channel, 9), and the damping (n_mesh,) of what touches in a group."""
    meshes, pairs = contact.shape[0], contact.shape[1] - 1
    channels = len(plan.response)
    for channel in range(channels):
        m, kind = channel % meshes, 2 * (channel // meshes)
        for x in range(DEGREE + 1):
            law[channel, x], law[channels + channel, x] = 0.0, 0.0
            for p in range(pairs):
                if contact[m, p]:
                    law[channel, x] += polynomials.spring[at, kind, m, p, x]
                    law[channels + channel, x] += polynomials.spring[at, kind + 1, m, p, x]
    for m in range(meshes):
        damping[m] = plan.mesh_damping[m] if plan.always or touches(contact, m) else 0.0
        for x in range(DEGREE + 1):
            law[channels + m, x] += damping[m] / period * polynomials.own[at, RATE, m, x]
            if contact[m, pairs]:
                stiff = polynomials.own[at, STIFFNESS, m, x]
                law[m, x] += stiff
                law[channels + m, x] += polynomials.own[at, CARRIED, m, x] - plan.backlash[m] * stiff


@jit_inner
def see(plan: Any, polynomials: Any, at: int, state: Any, everything: bool, contact: Any) -> None:
    """Set what touches at the start of a group: by the state, or ``everything`` in the path."""
    meshes, n = plan.direction.shape
    pairs = contact.shape[1] - 1
    for m in range(meshes):
        position = 0.0
        for row in range(n):
            position += plan.direction[m, row] * state[row]
        for p in range(pairs):
            near = everything or position > polynomials.reach[at, m, p, 0]
            contact[m, p] = near and polynomials.present[at, m, p]
        behind = polynomials.own[at, ERROR, m, 0] - plan.backlash[m]
        contact[m, pairs] = not everything and position < behind
