"""The forces on the flanks of meshes for given motions, without and with damping.

Elastic pair forces are those of one-sided springs, ``F_p = Σ part k max(0, δ − g)``. A
pair that touches is pressed by ``N_p = max(0, F_p + c (k̃_p/Σ k̃) ẋ_p)`` with ``ẋ_p =
δ̇ − ġ_p``, the back flank by ``max(0, k (−j − δ) − c δ̇)``: damping acts on what
deforms, and flanks do not pull. Where damping acts always, as in the papers, elastic
forces press and the mesh has ``c`` times the rate at which the pair of the least gap
approaches, in separation, too.
"""

from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.compiled import jit
from wearlab.mesh import contact, excitation, profile, stages
from wearlab.mesh.damping import apart_force, contact_force

AT_ONCE = 100_000
"""Pair forces that are found at once: what they take has to fit the memory."""


class Deflections(NamedTuple):
    """Mesh deflection δ and its rate at some instants, (…) each [m], [m/s]."""

    deflection: Array
    rate: Array


class Dashpot(NamedTuple):
    """What a mesh has beside its springs.

    Parameters
    ----------
    damping : c, one value or (…) [N s/m]
    always : it acts in separation, too
    backlash : normal backlash, one value or (…); None: no back flank is modelled [m]
    law : of the meshes, see `wearlab.mesh.damping`; None: viscous
    """

    damping: Array | float
    always: bool = False
    backlash: Array | float | None = None
    law: Any = None


class NormalForces(NamedTuple):
    """Forces of meshes at some instants.

    Parameters
    ----------
    elastic, normal : (…) drive minus back flank, without and with damping [N]
    pair, pair_normal : (…, n_pairs) on each pair's drive flank [N]
    reserve : (…) by how much a pair pushes at most; negative where none does: how far
        from it [N]
    """

    elastic: Array
    normal: Array
    pair: Array
    pair_normal: Array
    reserve: Array


def normal_forces(
    springs: stages.Springs, motion: Deflections, dashpot: Dashpot
) -> NormalForces:
    """Return the forces of meshes (…), rates of gaps by time.

    References
    ----------
    L16 Eq. 6, recentred: contact at δ > 0; W23 Eq. 36: the gaps of worn pairs.
    """
    springs_at = springs.stiffness.shape
    shape = np.broadcast_shapes(motion.deflection.shape, springs_at[:-1])
    at = shape[
        len(shape) - len(springs_at) + 1 :
    ]  # instants and meshes that have springs of their own
    count = int(np.prod(at, dtype=int))
    pairs = springs_at[-1]

    def flat(values: Array | float | None, *last: int) -> Array:
        wide = np.broadcast_to(np.inf if values is None else values, (*at, *last))
        return np.array(wide, float, order="C").reshape(
            count, *last
        )  # one kernel: none is read-only

    part = (
        np.empty((0, pairs, pairs))
        if springs.part is None
        else flat(springs.part, pairs, pairs)
    )
    moved = [
        np.array(np.broadcast_to(each, shape), float, order="C").reshape(-1, count)
        for each in motion
    ]
    values = np.empty((3, len(moved[0]), count))
    each_pair = np.empty((2, len(moved[0]), count, pairs))
    stiffness, gap, pair_rate = (flat(each, pairs) for each in springs[:3])
    own = stages.Springs(stiffness, gap, pair_rate, flat(springs.lead_rate), part)
    always = dashpot.always and dashpot.law is None
    meshes = at[-1] if np.ndim(dashpot.damping) else 1
    beside = Dashpot(flat(dashpot.damping), always, flat(dashpot.backlash), dashpot.law)
    _fill(own, Deflections(*moved), beside, meshes, values, each_pair)
    elastic, normal, reserve = values.reshape(3, *shape)
    pair, pair_normal = each_pair.reshape(2, *shape, pairs)
    return NormalForces(elastic, normal, pair, pair_normal, reserve)


@jit
def _fill(
    springs: Any, motion: Any, dashpot: Any, meshes: int, values: Any, each_pair: Any
) -> None:
    """Fill elastic and normal force, reserve (3, m, n) of m motions, and forces of pairs (2, m, n, n_pairs).

    The back flank, ``k max(0, −j_bn − δ)``, begins where drive contact ends at −j_bn;
    ``meshes``: of the damping law, they take turns among the n.
    """
    stiffness, gap, pair_rate, lead_rate, part = springs
    deflection, rate = motion
    damping, always, backlash, law = dashpot
    pairs = stiffness.shape[1]
    spring = np.empty(pairs)
    tangent = np.empty(pairs)
    for i in range(deflection.shape[0]):
        for j in range(deflection.shape[1]):
            moved = deflection[i, j]
            speed = rate[i, j]
            c = damping[j]
            m = j % meshes
            far = -np.inf
            least = np.inf
            lead = -1
            whole = 0.0
            for p in range(pairs):
                k = stiffness[j, p]
                x = moved - gap[j, p]
                spring[p], tangent[p] = (
                    (k * x, k) if k > 0.0 and x > 0.0 else (0.0, 0.0)
                )
                whole += k
                if k > 0.0:
                    far = max(far, k * x)
                    least, lead = (-x, p) if -x < least else (least, lead)
            pair = each_pair[0, i, j]
            pressed = each_pair[1, i, j]
            total = 0.0
            for p in range(pairs):
                pair[p], pressed[p] = spring[p], tangent[p]
                if part.shape[0] > 0:
                    pair[p], pressed[p] = 0.0, 0.0
                    for q in range(pairs):
                        pair[p] += spring[q] * part[j, q, p]
                        pressed[p] += tangent[q] * part[j, q, p]
                total += pressed[p]
            elastic = 0.0
            normal = 0.0
            reserve = -np.inf
            for p in range(pairs):
                elastic += pair[p]
                own = pressed[p]
                push = 0.0
                approach = speed - pair_rate[j, p]
                if not always and own != 0.0:
                    share = c * (own / total if total > 0.0 else 0.0)
                    push = contact_force(law, m, pair[p], own, share, approach)[0]
                    reserve = max(reserve, push)
                elif not always and total == 0.0 and p == lead:
                    push = apart_force(law, m, least, approach)[0]
                    reserve = push if push > 0.0 else reserve
                pressed[p] = pair[p] if always else max(push, 0.0)
                normal += pressed[p]
            clearance = backlash[j] + moved
            back = whole * max(0.0, -clearance)
            behind = back
            if not always and back > 0.0:
                behind = max(0.0, contact_force(law, m, back, whole, c, -speed)[0])
            elif not always and 0.0 <= clearance < np.inf and whole > 0.0:
                behind = apart_force(law, m, clearance, -speed)[0]
            values[0, i, j] = elastic - back
            values[1, i, j] = (
                normal - behind + (c * (speed - lead_rate[j]) if always else 0.0)
            )
            values[2, i, j] = far if reserve == -np.inf else reserve


def flank_forces(
    flanks: excitation.MeshFlanks,
    where: profile.Lookup,
    motion: Deflections,
    dashpot: Dashpot,
    period: float,
) -> NormalForces:
    """Return the forces of a mesh at phases for motions (…, n).

    A series' by the pairs' static share.

    Parameters
    ----------
    flanks : of the mesh
    where : the phases
    motion : (n,) or (n_periods, n) there
    dashpot : of the mesh
    period : duration of a mesh period [s]
    """
    springs = excitation.pair_springs(flanks, where).per(period)
    if motion.deflection.ndim == 1:
        forces = normal_forces(springs, motion, dashpot)
    else:
        many = max(1, AT_ONCE // springs.stiffness.size)
        blocks = [
            normal_forces(
                springs,
                Deflections(*(each[at : at + many] for each in motion)),
                dashpot,
            )
            for at in range(0, len(motion.deflection), many)
        ]
        forces = NormalForces(*map(np.concatenate, zip(*blocks, strict=True)))
    if flanks.series is None:
        return forces
    share = load_share(flanks.analysis.quasistatic(flanks.nodes, where))
    return forces._replace(
        pair=forces.pair * share, pair_normal=forces.pair_normal * share
    )


def load_share(state: contact.Quasistatic) -> Array:
    """Return each pair's share of the static force, 0 without load, (n, n_pairs) [1]."""
    total = state.force.sum(axis=1, keepdims=True)
    return np.divide(
        state.force, total, out=np.zeros_like(state.force), where=total > 0.0
    )
