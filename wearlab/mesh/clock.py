"""Meshes on one clock: a mesh lags the first by a part of the mesh period.

When the clock shows φ, a mesh is at its own phase ``(φ − γ) mod 1``. Meshes of one kind
share their flanks, and so one contact analysis; they differ by their lag and by their
error.

A `Sampling` holds at which phases an integration asks for the meshes, and what wear
does not change there.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.compiled import jit
from wearlab.mesh import harmonics, stages
from wearlab.mesh.profile import (
    SAME_PHASE,
    Lookup,
    ProfileGrid,
    distinct,
    interpolate,
    lookup,
)

INTO_SEGMENT = 1e-6
"""How far a phase is moved towards the middle of its segment, over the distance."""
ROUNDED = 1e-12
"""Difference of phases that is rounding [1]."""


class Mesh(NamedTuple):
    """One mesh of a gear set.

    Parameters
    ----------
    kind : number of the set's contact analysis that holds for it
    lag : γ, phase of the clock at which a pair enters at A, in [0, 1) [1]
    error : prescribed error; its mesh-periodic part is a function of the mesh's phase
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


class StepLookup(NamedTuple):
    """Where the meshes of a kind are within steps; meshes that are alike share a place.

    Planets meet the same phases, all at once or one after another.

    Parameters
    ----------
    where : look-up of all phases of some steps, one step after another
    number : (n_meshes, n) which of them each mesh meets in each step
    """

    where: Lookup
    number: Index

    def write(self, values: Array, table: Array, meshes: Index) -> None:
        """Write values at the phases looked up into the table of all meshes of a set.

        Parameters
        ----------
        values : (n_looked_up · stages[, …]); what they have of further axes, two at
            most, the table has as long or longer
        table : (n, stages, n_mesh[, …])
        meshes : numbers of these meshes in the set
        """
        stages = table.shape[1]
        wide = (1, 1, *values.shape[1:])[-2:]
        table_wide = (1, 1, *table.shape[3:])[-2:]
        _fill_meshes(
            values.reshape(-1, stages, *wide),
            self.number,
            meshes,
            table.reshape(*table.shape[:3], *table_wide),
        )

    def within(self, grid: ProfileGrid, fractions: Array) -> "StepLookup":
        """Return the look-up of the same steps at fractions of them.

        Parameters
        ----------
        grid : nodes of the kind
        fractions : (k,) of a step [1]
        """
        start, _, end = self.where.phase.reshape(-1, 3).T
        phases = start[:, None] + (end - start)[:, None] * fractions
        segment = np.repeat(self.where.segment[::3], len(fractions))
        return StepLookup(lookup(grid, phases, segment), self.number)

    def each_once(self, stages: int) -> "StepLookup":
        """Return the look-up in which steps that are alike stand once.

        Parameters
        ----------
        stages : phases of a step
        """
        where = self.where
        phases = np.round(where.phase.reshape(-1, stages) / ROUNDED).astype(np.int64)
        segment = where.segment[::stages]
        _, first, same = np.unique(
            np.column_stack([segment, phases]),
            axis=0,
            return_index=True,
            return_inverse=True,
        )
        kept = (first[:, None] * stages + np.arange(stages)).ravel()
        once = Lookup(
            phase=where.phase[kept],
            segment=where.segment[kept],
            offset=where.offset[kept],
            weight=where.weight[kept],
        )
        return StepLookup(once, same.ravel()[self.number])


@jit(counted=False)
def _fill_meshes(values: Array, number: Index, meshes: Index, table: Array) -> None:
    """Fill (n, stages, n_mesh, rows, columns) from (n_looked_up, stages, …) values."""
    n_meshes, n = number.shape
    _, stages, rows, columns = values.shape
    for step in range(n):
        for stage in range(stages):
            for m in range(n_meshes):
                place = table[step, stage, meshes[m]]
                value = values[number[m, step], stage]
                for row in range(rows):
                    for column in range(columns):
                        place[row, column] = value[row, column]


def of_kind(meshes: Sequence[Mesh], kind: int) -> Index:
    """Return the numbers of the meshes of a kind, (n,).

    Parameters
    ----------
    meshes : all meshes of the set
    kind : number of the kind
    """
    numbers = [number for number, mesh in enumerate(meshes) if mesh.kind == kind]
    return np.array(numbers, dtype=np.int64)


def breaks_on_clock(grids: Sequence[ProfileGrid], meshes: Sequence[Mesh]) -> Array:
    """Return the clock phases between which every mesh is smooth, 0 first, 1 last [1].

    Parameters
    ----------
    grids : nodes of each kind of mesh
    meshes : all meshes of the set
    """
    breaks = [(grids[mesh.kind].breaks[:-1] + mesh.lag) % 1.0 for mesh in meshes]
    return np.array([*distinct([0.0, *np.concatenate(breaks)]), 1.0])


def _phase_of_mesh(phase: Array, lag: float) -> Array:
    """Return the phases (n,) of a mesh when the clock shows ``phase``, in [0, 1).

    A phase that misses a whole period by round-off is 0.
    """
    return np.asarray(phase - lag - np.floor(phase - lag + SAME_PHASE))


def locate(grid: ProfileGrid, lags: Sequence[float], phase: Array) -> Lookup:
    """Locate clock phases among the nodes, for one mesh after another, (n_meshes · n).

    Parameters
    ----------
    grid : nodes of the meshes' kind
    lags : γ of each mesh [1]
    phase : (n,) phases of the clock [1]
    """
    return concatenate([lookup(grid, _phase_of_mesh(phase, lag)) for lag in lags])


def locate_within_steps(
    grid: ProfileGrid, lags: Sequence[float] | Array, phase: Array, middle: Array
) -> Lookup:
    """Locate clock phases within steps among the nodes, for one mesh after another.

    All phases of a step are located in the segment in which its middle lies.

    Parameters
    ----------
    grid : nodes of the meshes' kind
    lags : γ of each mesh [1]
    phase : (n, k) phases of the clock, k in each step [1]
    middle : (n,) phases of the middles of the steps [1]
    """
    lookups = []
    for lag in lags:
        turns = np.floor(middle - lag)
        segment = np.searchsorted(grid.breaks, middle - lag - turns, side="right") - 1
        phase_of_mesh = phase - lag - turns[:, None]
        lookups.append(lookup(grid, phase_of_mesh, np.repeat(segment, phase.shape[1])))
    return concatenate(lookups)


def locate_kinds_within_steps(
    grids: Sequence[ProfileGrid], meshes: Sequence[Mesh], phase: Array, middle: Array
) -> tuple[StepLookup, ...]:
    """Locate clock phases for the meshes of every kind, see `locate_within_steps`.

    Parameters
    ----------
    grids : nodes of each kind of mesh
    meshes : all meshes of the set
    phase, middle : as there
    """
    lookups = []
    for kind, grid in enumerate(grids):
        lags = [mesh.lag for mesh in meshes if mesh.kind == kind]
        distinct_lags, same = np.unique(lags, return_inverse=True)
        where = locate_within_steps(grid, distinct_lags, phase, middle)
        number = np.arange(len(distinct_lags) * len(phase)).reshape(-1, len(phase))
        lookups.append(StepLookup(where, number[same]))
    return tuple(lookups)


def concatenate(lookups: Sequence[Lookup]) -> Lookup:
    """Return one look-up that holds several, one after another."""
    return Lookup(*(np.concatenate(arrays) for arrays in zip(*lookups, strict=True)))


def instants(edges: Array, phase: Array) -> Instants:
    """Return clock phases with their segments: a phase on a break begins a segment.

    Parameters
    ----------
    edges : breaks of the clock [1]
    phase : (n,) phases of the clock [1]
    """
    segment = np.searchsorted(edges, phase + SAME_PHASE, side="right") - 1
    return Instants(phase, np.clip(segment, 0, len(edges) - 2))


def instants_of(grid: ProfileGrid, lag: float, where: Lookup, edges: Array) -> Instants:
    """Return when, on the clock, a mesh is at given phases, on the same side of breaks.

    Parameters
    ----------
    grid : nodes of the mesh
    lag : γ [1]
    where : phases of the mesh with their segments
    edges : breaks of the clock [1]
    """
    low = grid.breaks[where.segment]
    high = grid.breaks[where.segment + 1]
    middle = 0.5 * (low + high)

    # a phase on a break is moved a little into its segment of the mesh: this shows to
    # which segment of the clock it belongs
    inside = where.phase + INTO_SEGMENT * (middle - where.phase)
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
    where : for each kind of mesh, look-up of the stages of its steps
    sliding : (n_steps, 3, n_mesh, n_pairs) Λμ of every pair at the stages, 0 out of the
        path; None: no friction [1]
    moment : (n_steps, 3, n_mesh, n_pairs) Λμ times the path position as the model
        counts it [m]

    Wear changes none of it.
    """

    grid: stages.StageGrid
    edges: Array
    meshes: tuple[Mesh, ...]
    where: tuple[StepLookup, ...]
    sliding: Array | None = None
    moment: Array | None = None


def sampling(
    grids: Sequence[ProfileGrid],
    meshes: tuple[Mesh, ...],
    edges: Array,
    grid: stages.StageGrid,
    friction: Friction | None = None,
) -> Sampling:
    """Locate an integrator's stages among the profile nodes of every kind of mesh.

    Parameters
    ----------
    grids : nodes of each kind of mesh
    meshes : all meshes of the set
    edges : breaks of the clock [1]
    grid : steps of the integration
    friction : of the flanks; None: they slide without
    """
    middle = grid.start + 0.5 * grid.width
    stages = grid.phase.shape[1]
    located = locate_kinds_within_steps(grids, meshes, grid.phase, middle)
    where = tuple(lookup.each_once(stages) for lookup in located)
    if friction is None:
        return Sampling(grid, edges, meshes, where)

    n_pairs = max(nodes.n_pairs for nodes in grids)
    shape = (*grid.phase.shape, len(meshes), n_pairs)
    sliding = np.zeros(shape)
    moment = np.zeros(shape)

    for kind, (nodes, lookups) in enumerate(zip(grids, where, strict=True)):
        position = interpolate(nodes, lookups.where, nodes.contact_position, np.nan)
        s = position.reshape(-1, stages, nodes.n_pairs)

        # sliding turns at the pitch point, where steps end: within a step it has the
        # sense of its middle stage
        sense = np.broadcast_to(np.sign(s[:, 1:2]), s.shape)
        factor = friction.coefficient * np.nan_to_num(sense)
        lever = factor * friction.sense[kind] * np.nan_to_num(s)
        numbers = of_kind(meshes, kind)
        lookups.write(factor.reshape(-1, nodes.n_pairs), sliding, numbers)
        lookups.write(lever.reshape(-1, nodes.n_pairs), moment, numbers)

    return Sampling(grid, edges, meshes, where, sliding, moment)
