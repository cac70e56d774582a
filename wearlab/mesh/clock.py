"""Meshes on one clock: every mesh of a gear set lags the first by a fraction of the mesh period.

A mesh meets its own phase ``(φ − γ) mod 1`` when the clock shows φ. Meshes of one kind
share their flanks, and so one contact analysis; what differs is the lag and the error
each of them sees.

A `Sampling` holds at which phases an integration asks for the meshes, and what wear
does not change there.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.mesh import harmonics, stages
from wearlab.mesh.profile import (
    SAME_PHASE,
    Lookup,
    ProfileGrid,
    distinct,
    interpolate,
    lookup,
)


class Mesh(NamedTuple):
    """One mesh of a gear set.

    Parameters
    ----------
    kind : which of the set's contact analyses is its own
    lag : γ, phase of the clock at which a pair enters at A, in [0, 1) [1]
    error : prescribed error; its mesh-periodic part is a function of the own phase
    """

    kind: int
    lag: float
    error: harmonics.MeshError


class Instants(NamedTuple):
    """Moments of a mesh period on the clock.

    Parameters
    ----------
    phase : (n,) in [0, 1] [1]
    segment : (n,) smooth segment of the clock each belongs to
    """

    phase: Array
    segment: Index


def of_kind(meshes: Sequence[Mesh], kind: int) -> Index:
    """Return which meshes are of a kind."""
    return np.array(
        [i for i, mesh in enumerate(meshes) if mesh.kind == kind], dtype=np.int64
    )


def breaks_on_clock(grids: Sequence[ProfileGrid], meshes: Sequence[Mesh]) -> Array:
    """Return the phases of the clock between which every mesh is smooth, 0 first and 1 last [1]."""
    lagged = [(grids[mesh.kind].breaks[:-1] + mesh.lag) % 1.0 for mesh in meshes]
    return np.array([*distinct([0.0, *np.concatenate(lagged)]), 1.0])


def own_phase(phase: Array, lag: float) -> Array:
    """Return the phases (n,) of a mesh when the clock shows ``phase``.

    A whole period but round-off is 0.
    """
    return np.asarray(phase - lag - np.floor(phase - lag + SAME_PHASE))


def look(grid: ProfileGrid, lags: Sequence[float], phase: Array) -> Lookup:
    """Return the look-up of clock phases (n,) among the nodes, one mesh after another (n_meshes · n)."""
    return joined([lookup(grid, own_phase(phase, lag)) for lag in lags])


def look_within(
    grid: ProfileGrid, lags: Sequence[float], phase: Array, middle: Array
) -> Lookup:
    """Return the look-up of phases (n, k) that lie within steps about ``middle`` (n,), mesh after mesh."""
    times = []
    for lag in lags:
        turns = np.floor(middle - lag)
        segment = np.searchsorted(grid.breaks, middle - lag - turns, side="right") - 1
        times.append(
            lookup(
                grid, phase - lag - turns[:, None], np.repeat(segment, phase.shape[1])
            )
        )
    return joined(times)


def look_within_each(
    grids: Sequence[ProfileGrid], meshes: Sequence[Mesh], phase: Array, middle: Array
) -> tuple[Lookup, ...]:
    """Return the look-ups of every kind of mesh, see `look_within`."""
    return tuple(
        look_within(
            grid, [mesh.lag for mesh in meshes if mesh.kind == kind], phase, middle
        )
        for kind, grid in enumerate(grids)
    )


def joined(lookups: Sequence[Lookup]) -> Lookup:
    """Return look-ups one after another."""
    return Lookup(*(np.concatenate(parts) for parts in zip(*lookups, strict=True)))


def instants(edges: Array, phase: Array) -> Instants:
    """Return clock phases (n,) with their segments, each the one that begins at or before the phase."""
    segment = np.searchsorted(edges, phase + SAME_PHASE, side="right") - 1
    return Instants(phase, np.clip(segment, 0, len(edges) - 2))


def instants_of(grid: ProfileGrid, lag: float, where: Lookup, edges: Array) -> Instants:
    """Return when, on the clock, a mesh meets its own phases, each on its own side of a break.

    Parameters
    ----------
    grid : nodes of the mesh
    lag : γ [1]
    where : own phases with their segments
    edges : breaks of the clock
    """
    middle = 0.5 * (grid.breaks[where.segment] + grid.breaks[where.segment + 1])
    # how far into its segment a phase is moved to find the segment of the clock it
    # belongs to, of its width
    inside = where.phase + 1e-6 * (middle - where.phase)
    turns = np.floor(inside + lag)
    segment = np.searchsorted(edges, inside + lag - turns, side="right") - 1
    return Instants(where.phase + lag - turns, np.clip(segment, 0, len(edges) - 2))


class Friction(NamedTuple):
    """Sliding friction of the flanks.

    Parameters
    ----------
    coefficient : μ [1]
    sense : for each kind of mesh, +1 where the model's path position is s, −1 where it
        is −s [1]
    """

    coefficient: float
    sense: tuple[float, ...]


class Sampling(NamedTuple):
    """The stages of one integration, and the look-ups that serve them.

    Parameters
    ----------
    grid : the steps, on the clock
    edges : (n_segments + 1,) breaks of the clock between which every mesh is smooth [1]
    meshes : the meshes
    where : for each kind of mesh, look-up of the (n_steps · 3) stages, one mesh of the
        kind after another
    sliding : (n_steps, 3, n_mesh, n_pairs) Λμ of every pair at the stages, 0 out of the
        path; None: no friction [1]
    moment : (n_steps, 3, n_mesh, n_pairs) Λμ times the path position as the model
        counts it [m]

    Wear changes none of it.
    """

    grid: stages.StageGrid
    edges: Array
    meshes: tuple[Mesh, ...]
    where: tuple[Lookup, ...]
    sliding: Array | None = None
    moment: Array | None = None


def sampling(
    grids: Sequence[ProfileGrid],
    meshes: tuple[Mesh, ...],
    edges: Array,
    grid: stages.StageGrid,
    friction: Friction | None = None,
) -> Sampling:
    """Prepare the look-ups of an integrator's stages among the profile nodes of every kind of mesh.

    Sliding turns at the pitch point, where steps end.
    """
    middle = grid.start + 0.5 * grid.width
    where = look_within_each(grids, meshes, grid.phase, middle)
    if friction is None:
        return Sampling(grid, edges, meshes, where)
    sliding, moment = np.zeros(
        (2, *grid.phase.shape, len(meshes), max(nodes.n_pairs for nodes in grids))
    )
    for kind, (nodes, at) in enumerate(zip(grids, where, strict=True)):
        position = interpolate(nodes, at, nodes.contact_position, np.nan)
        s = position.reshape(-1, *grid.phase.shape, nodes.n_pairs).transpose(1, 2, 0, 3)
        own = of_kind(meshes, kind)
        rubs = friction.coefficient * np.nan_to_num(
            np.broadcast_to(np.sign(s[:, 1:2]), s.shape)
        )
        sliding[:, :, own, : nodes.n_pairs] = rubs
        moment[:, :, own, : nodes.n_pairs] = (
            rubs * friction.sense[kind] * np.nan_to_num(s)
        )
    return Sampling(grid, edges, meshes, where, sliding, moment)
