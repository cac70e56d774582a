"""The forces on the flanks of meshes for given motions, without and with damping.

Elastic pair forces are those of one-sided springs, ``F_p = Σ part k max(0, δ − g)``. A pair that touches is
pressed by ``N_p = max(0, F_p + c (k̃_p/Σ k̃) ẋ_p)`` with ``ẋ_p = δ̇ − ġ_p``, the back flank by ``max(0, k (−j
− δ) − c δ̇)``: damping acts on what deforms, and flanks do not pull. Where damping acts always, as in the
papers, elastic forces press and the mesh has ``c`` times the rate at which the pair of the least gap
approaches, in separation, too.
"""

from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.mesh.contact import Quasistatic
from wearlab.mesh.damping import forces_by_law
from wearlab.mesh.excitation import MeshFlanks
from wearlab.mesh.profile import Lookup
from wearlab.mesh.stages import Springs
from wearlab.mesh.tabulation import pair_springs

AT_ONCE = 100_000
"""Pair forces that are found at once: what they take has to fit the memory."""
FAR = -1.0
"""Compression of a pair that is out of the path [m]."""


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
    reserve : (…) by how much a pair pushes at most; negative where none does: how far from it [N]
    """

    elastic: Array
    normal: Array
    pair: Array
    pair_normal: Array
    reserve: Array


def normal_forces(springs: Springs, motion: Deflections, dashpot: Dashpot) -> NormalForces:
    """Return the forces of meshes (…), rates of gaps by time.

    References
    ----------
    L16 Eq. 6, recentred: contact at δ > 0; W23 Eq. 36: the gaps of worn pairs.
    """
    if dashpot.law is not None:
        return _nonlinear_forces(springs, motion, dashpot)
    stiffness, gap, pair_rate, lead_rate, part = springs
    deflection, rate = motion
    c = np.asarray(dashpot.damping)
    x = deflection[..., None] - gap
    in_contact = (stiffness > 0.0) & (x > 0.0)
    pair, tangent = stiffness * np.where(in_contact, x, 0.0), np.where(in_contact, stiffness, 0.0)
    if part is not None:
        pair = (pair[..., None, :] @ part)[..., 0, :]
        tangent = (tangent[..., None, :] @ part)[..., 0, :]
    present = tangent != 0.0
    far = _far(stiffness, x)
    if dashpot.always:
        pressed, reserve = pair, far
        extra: Array | float = c * (rate - lead_rate)
    else:
        total = tangent.sum(axis=-1, keepdims=True)
        share = np.divide(tangent, total, out=np.zeros_like(tangent), where=total > 0.0)
        pressed = pair + c[..., None] * share * (rate[..., None] - pair_rate)
        reserve = np.where(present.any(axis=-1), np.where(present, pressed, -np.inf).max(axis=-1), far)
        pressed, extra = np.where(present, np.maximum(pressed, 0.0), 0.0), 0.0
    back, back_normal = _back_forces(stiffness, motion, dashpot)
    return NormalForces(
        pair.sum(axis=-1) - back, pressed.sum(axis=-1) - back_normal + extra, pair, pressed, reserve
    )


def _far(stiffness: Array, x: Array) -> Array:
    """Return how far the nearest pair of a mesh is from contact, as a force, (…) [N]."""
    far = stiffness * np.where(stiffness > 0.0, x, FAR)
    return np.asarray(np.where(stiffness > 0.0, far, -np.inf).max(axis=-1))


def _nonlinear_forces(springs: Springs, motion: Deflections, dashpot: Dashpot) -> NormalForces:
    """Return the forces of meshes whose damping law is not viscous."""
    single = np.ndim(dashpot.damping) == 0  # of one mesh at instants (…, n)
    backlash = np.inf if dashpot.backlash is None else dashpot.backlash
    forces = forces_by_law(
        dashpot.law,
        springs.each(lambda values: values[:, None]) if single else springs,
        (motion.deflection[..., None], motion.rate[..., None]) if single else motion,
        np.asarray(backlash, float),
        np.asarray(dashpot.damping, float),
    )
    pair, normal, back, back_normal = forces
    if single:
        pair, normal, back, back_normal = (
            pair[..., 0, :],
            normal[..., 0, :],
            back[..., 0],
            back_normal[..., 0],
        )
    pushed, total = normal.max(axis=-1), normal.sum(axis=-1) - back_normal
    far = _far(springs.stiffness, motion.deflection[..., None] - springs.gap)
    reserve = np.where(pushed > 0.0, pushed, np.minimum(far, 0.0))
    return NormalForces(pair.sum(axis=-1) - back, total, pair, normal, reserve)


def _back_forces(stiffness: Array, motion: Deflections, dashpot: Dashpot) -> tuple[Array, Array]:
    """Return elastic and normal force of the back flanks, ``k max(0, −j_bn − δ)`` else 0, (…) [N].

    References
    ----------
    L16 Eq. 6, recentred: back contact begins where drive contact ends at −j_bn.
    """
    if dashpot.backlash is None:
        nothing = np.zeros_like(motion.deflection)
        return nothing, nothing
    elastic = stiffness.sum(axis=-1) * np.maximum(0.0, -dashpot.backlash - motion.deflection)
    damped = 0.0 if dashpot.always else np.asarray(dashpot.damping) * motion.rate
    return elastic, np.where(elastic > 0.0, np.maximum(0.0, elastic - damped), 0.0)


def flank_forces(
    flanks: MeshFlanks, where: Lookup, motion: Deflections, dashpot: Dashpot, period: float
) -> NormalForces:
    """Return the forces of a mesh at phases for motions (…, n); a series' by the pairs' static share.

    Parameters
    ----------
    flanks : of the mesh
    where : the phases
    motion : (n,) or (n_periods, n) there
    dashpot : of the mesh
    period : duration of a mesh period [s]
    """
    springs = pair_springs(flanks, where).per(period)
    if motion.deflection.ndim == 1:
        forces = normal_forces(springs, motion, dashpot)
    else:
        many = max(1, AT_ONCE // springs.stiffness.size)
        blocks = [
            normal_forces(springs, Deflections(*(each[at : at + many] for each in motion)), dashpot)
            for at in range(0, len(motion.deflection), many)
        ]
        forces = NormalForces(*map(np.concatenate, zip(*blocks, strict=True)))
    if flanks.series is None:
        return forces
    share = load_share(flanks.analysis.quasistatic(flanks.nodes, where))
    return forces._replace(pair=forces.pair * share, pair_normal=forces.pair_normal * share)


def load_share(state: Quasistatic) -> Array:
    """Return each pair's share of the static force, 0 without load, (n, n_pairs) [1]."""
    total = state.force.sum(axis=1, keepdims=True)
    return np.divide(state.force, total, out=np.zeros_like(state.force), where=total > 0.0)
