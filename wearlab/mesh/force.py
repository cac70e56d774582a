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
from wearlab.compiled import jit, jit_inner
from wearlab.mesh import contact, excitation, profile, stages
from wearlab.mesh.damping import apart_force, contact_force

BLOCK_SIZE = 100_000
"""Pair forces that are computed together: they have to fit the memory."""


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


class _Layout(NamedTuple):
    """How motions and springs of any shape are laid out for the kernel.

    Parameters
    ----------
    shape : of the result, motions before springs
    spring_shape : instants and meshes, which have springs of their own
    """

    shape: tuple[int, ...]
    spring_shape: tuple[int, ...]

    @property
    def n_springs(self) -> int:
        """Number of springs."""
        return int(np.prod(self.spring_shape, dtype=int))

    def of_springs(self, values: Array | float, *last: int) -> Array:
        """Return values of all springs, (count, *last)."""
        wide = _as_wide_as(values, (*self.spring_shape, *last))
        return wide.reshape(self.n_springs, *last)

    def of_motions(self, values: Array) -> Array:
        """Return values of all motions, (n_motions, count)."""
        return _as_wide_as(values, self.shape).reshape(-1, self.n_springs)


def _as_wide_as(values: Array | float, shape: tuple[int, ...]) -> Array:
    """Return values in one piece of a shape, as they are where they have it."""
    if np.shape(values) != shape:
        values = np.array(np.broadcast_to(values, shape))
    return np.ascontiguousarray(values, float)


def _layout(springs: stages.Springs, motion: Deflections) -> _Layout:
    """Return the layout of springs (…, n_pairs) under motions (…)."""
    spring_shape = springs.stiffness.shape[:-1]
    shape = np.broadcast_shapes(motion.deflection.shape, spring_shape)
    return _Layout(shape, shape[len(shape) - len(spring_shape) :])


def normal_forces(
    springs: stages.Springs, motion: Deflections, dashpot: Dashpot
) -> NormalForces:
    """Return the forces of meshes.

    Parameters
    ----------
    springs : (…) of the meshes, with rates of gaps by time [m/s]
    motion : (…); may have axes before those of the springs
    dashpot : of the meshes, with values for the axes of the springs

    References
    ----------
    L16 Eq. 6, recentred: contact at δ > 0; W23 Eq. 36: the gaps of worn pairs.
    """
    pairs = springs.stiffness.shape[-1]
    layout = _layout(springs, motion)

    part = np.empty((0, pairs, pairs))
    if springs.part is not None:
        part = layout.of_springs(springs.part, pairs, pairs)
    flat_springs = stages.Springs(
        stiffness=layout.of_springs(springs.stiffness, pairs),
        gap=layout.of_springs(springs.gap, pairs),
        pair_rate=layout.of_springs(springs.pair_rate, pairs),
        lead_rate=layout.of_springs(springs.lead_rate),
        part=part,
    )
    motions = Deflections(
        layout.of_motions(motion.deflection), layout.of_motions(motion.rate)
    )
    backlash = np.inf if dashpot.backlash is None else dashpot.backlash
    flat_dashpot = Dashpot(
        damping=layout.of_springs(dashpot.damping),
        always=dashpot.always and dashpot.law is None,
        backlash=layout.of_springs(backlash),
        law=dashpot.law,
    )
    meshes = layout.spring_shape[-1] if np.ndim(dashpot.damping) else 1

    shape = motions.deflection.shape
    values = np.empty((3, *shape))
    of_pairs = np.empty((2, *shape, pairs))
    scratch = np.empty((3, pairs))
    _fill_forces(flat_springs, motions, flat_dashpot, meshes, scratch, values, of_pairs)

    elastic, normal, reserve = values.reshape(3, *layout.shape)
    pair, pair_normal = of_pairs.reshape(2, *layout.shape, pairs)
    return NormalForces(elastic, normal, pair, pair_normal, reserve)


@jit(counted=False)
def _fill_forces(
    springs: Any,
    motions: Any,
    dashpot: Any,
    meshes: int,
    scratch: Any,
    values: Any,
    of_pairs: Any,
) -> None:
    """Fill the forces of n meshes in m motions.

    Parameters
    ----------
    springs, motions, dashpot : of shape (n, …), (m, n) and (n,)
    meshes : of the damping law; they take turns among the n
    scratch : (3, n_pairs)
    values : (3, m, n) filled with elastic force, normal force and reserve [N]
    of_pairs : (2, m, n, n_pairs) filled with elastic and normal force [N]
    """
    n_motions, n_meshes = motions.deflection.shape
    pairs = springs.stiffness.shape[1]
    spring_force = scratch[0]
    tangent = scratch[1]
    pair_stiffness = scratch[2]

    for i in range(n_motions):
        for j in range(n_meshes):
            deflection = motions.deflection[i, j]
            rate = motions.rate[i, j]
            mesh = j % meshes
            pair = of_pairs[0, i, j]
            pressed = of_pairs[1, i, j]

            whole, strongest, clearance, nearest = _fill_springs(
                springs.stiffness[j], springs.gap[j], deflection, spring_force, tangent
            )
            total = _fill_pairs(
                springs.part, j, spring_force, tangent, pair, pair_stiffness
            )

            reserve = -np.inf
            if dashpot.always:
                for p in range(pairs):
                    pressed[p] = pair[p]
            else:
                reserve = _press_pairs(
                    dashpot.law,
                    mesh,
                    dashpot.damping[j],
                    rate,
                    springs.pair_rate[j],
                    clearance,
                    nearest,
                    total,
                    pair,
                    pair_stiffness,
                    pressed,
                )
            back, back_normal = _back_forces(dashpot, j, mesh, deflection, rate, whole)

            damped = 0.0
            if dashpot.always:
                damped = dashpot.damping[j] * (rate - springs.lead_rate[j])
            values[0, i, j] = _sum(pair) - back
            values[1, i, j] = _sum(pressed) - back_normal + damped
            values[2, i, j] = strongest if reserve == -np.inf else reserve


@jit_inner(counted=False)
def _sum(values):  # type: ignore[no-untyped-def]
    """Return the sum of values, one after another."""
    total = 0.0
    for value in values:
        total += value
    return total


@jit_inner(counted=False)
def _fill_springs(  # type: ignore[no-untyped-def]
    stiffness, gap, deflection, force, tangent
):
    """Fill force and tangent stiffness of one-sided springs at a deflection.

    Returns the stiffness of all springs; the largest ``k (δ − g)``, negative where none
    touches; the least clearance; and the spring that has it, −1: none is in the path.
    """
    whole = 0.0
    strongest = -np.inf
    least_clearance = np.inf
    nearest = -1
    for p in range(len(stiffness)):
        k = stiffness[p]
        compression = deflection - gap[p]
        force[p] = 0.0
        tangent[p] = 0.0
        whole += k
        if k > 0.0:
            strongest = max(strongest, k * compression)
            if compression > 0.0:
                force[p] = k * compression
                tangent[p] = k
            if -compression < least_clearance:
                least_clearance = -compression
                nearest = p
    return whole, strongest, least_clearance, nearest


@jit_inner(counted=False)
def _fill_pairs(  # type: ignore[no-untyped-def]
    part, j, force, tangent, pair, pair_stiffness
):
    """Fill elastic force and tangent stiffness of pairs from those of springs.

    Returns the sum of the stiffnesses. ``part`` is empty where springs are pairs.
    """
    pairs = len(force)
    total = 0.0
    for p in range(pairs):
        if part.shape[0] == 0:
            pair[p] = force[p]
            pair_stiffness[p] = tangent[p]
        else:
            pair[p] = 0.0
            pair_stiffness[p] = 0.0
            for q in range(pairs):
                pair[p] += force[q] * part[j, q, p]
                pair_stiffness[p] += tangent[q] * part[j, q, p]
        total += pair_stiffness[p]
    return total


@jit_inner(counted=False)
def _press_pairs(  # type: ignore[no-untyped-def]
    law,
    mesh,
    damping,
    rate,
    pair_rate,
    clearance,
    nearest,
    total,
    pair,
    pair_stiffness,
    pressed,
):
    """Fill the normal forces of pairs with damping, and return the reserve.

    Pairs that touch share the damping by their stiffness. Where none does, the nearest
    pair may press through its clearance.
    """
    reserve = -np.inf
    for p in range(len(pair)):
        push = 0.0
        approach = rate - pair_rate[p]
        stiffness = pair_stiffness[p]
        if stiffness != 0.0:
            share = damping * (stiffness / total if total > 0.0 else 0.0)
            push = contact_force(law, mesh, pair[p], stiffness, share, approach)[0]
            reserve = max(reserve, push)
        elif total == 0.0 and p == nearest:
            push = apart_force(law, mesh, clearance, approach)[0]
            reserve = push if push > 0.0 else reserve
        pressed[p] = max(push, 0.0)
    return reserve


@jit_inner(counted=False)
def _back_forces(  # type: ignore[no-untyped-def]
    dashpot, j, mesh, deflection, rate, whole
):
    """Return the elastic and the normal force of the back flank.

    The elastic force ``k max(0, −j_bn − δ)`` begins where the drive contact has moved
    back by the backlash.
    """
    clearance = dashpot.backlash[j] + deflection
    elastic = whole * max(0.0, -clearance)
    if dashpot.always:
        return elastic, elastic
    normal = _press_back(
        dashpot.law, mesh, dashpot.damping[j], rate, whole, clearance, elastic
    )
    return elastic, normal


@jit_inner(counted=False)
def _press_back(  # type: ignore[no-untyped-def]
    law, mesh, damping, rate, whole, clearance, elastic
):
    """Return the normal force of the back flank with damping."""
    if elastic > 0.0:
        return max(0.0, contact_force(law, mesh, elastic, whole, damping, -rate)[0])
    if 0.0 <= clearance < np.inf and whole > 0.0:
        return apart_force(law, mesh, clearance, -rate)[0]
    return elastic


def flank_forces(
    flanks: excitation.MeshFlanks,
    where: profile.Lookup,
    motion: Deflections,
    dashpot: Dashpot,
    period: float,
) -> NormalForces:
    """Return the forces of a mesh at phases, for one motion or several periods of it.

    The force of a series is divided among the pairs by their share of the static load.

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
        periods = max(1, BLOCK_SIZE // springs.stiffness.size)
        blocks = []
        for start in range(0, len(motion.deflection), periods):
            block = slice(start, start + periods)
            part = Deflections(motion.deflection[block], motion.rate[block])
            blocks.append(normal_forces(springs, part, dashpot))
        forces = NormalForces(*map(np.concatenate, zip(*blocks, strict=True)))
    if flanks.series is None:
        return forces
    share = load_share(flanks.analysis.quasistatic(flanks.nodes, where))
    return forces._replace(
        pair=forces.pair * share, pair_normal=forces.pair_normal * share
    )


def load_share(state: contact.Quasistatic) -> Array:
    """Return each pair's share of the static force, 0 without load, (n, n_pairs) [1].

    Parameters
    ----------
    state : the mesh under its static load at n phases
    """
    total = state.force.sum(axis=1, keepdims=True)
    no_load = np.zeros_like(state.force)
    return np.divide(state.force, total, out=no_load, where=total > 0.0)
