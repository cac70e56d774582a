"""One wear state as a function of time that any integrator can call, compiled.

Our own methods read tables at their stages; a foreign integrator asks at times of its own. So the mesh is
written as polynomials of degree four on cells that end wherever anything in it bends: at the profile nodes,
the jumps and the points of a given table. Everything sits in one flat array, as C callbacks want it.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.structure import force_vectors
from wearlab.dynamics.system import System
from wearlab.life.vibration import Vibration
from wearlab.mesh.excitation import Friction, Touching, stage_tables, stages
from wearlab.mesh.stages import StageGrid, StageTables

Array = NDArray[np.float64]

DEGREE = 4
GUIDES_PER_CELL = 4
NEVER = 1e300
"""A backlash that no motion reaches: no back flank."""

# Where things stand in the flat array.
N, MESHES, PAIRS, CELLS, GUIDES, PERIOD, GATED, DIAGONAL, HAS_ERROR, RUBS = range(10)
HEADER = 10
CELLS_PER_SEGMENT = 96
"""Cells of a segment of a set of several meshes, whose nodes together are too many."""


class Motion(NamedTuple):
    """The equation of motion of one wear state.

    Parameters
    ----------
    flat : everything, in one array: header, structure, cell edges, guide, coefficients
    breaks : (n_segments + 1,) phases between which the mesh is smooth [1]
    first_cell : (n_segments + 1,) cell with which each segment begins
    n, meshes : coordinates and meshes
    pairs : pairs in the path of a mesh
    period : duration of a mesh period [s]
    """

    flat: Array
    breaks: Array
    first_cell: NDArray[np.int64]
    n: int
    meshes: int
    pairs: int
    period: float


class Tables(NamedTuple):
    """What the flat array of a :class:`Motion` holds, each part in its shape; divided by the masses.

    Parameters
    ----------
    stiffness, damping : (n, n) of supports
    direction : (n_mesh, n) of the mesh deflections
    mesh_damping : (n_mesh,) [N s/m]
    backlash : (n_mesh,) normal backlash [m]
    load : (n,)
    response : (channels, n) acceleration by a unit mesh force, then by its friction
    edges, per_width : (n_cells + 1,), (n_cells,) phases at which cells begin, one over their widths [1]
    guide : (n_guides,) cell that holds each of even phases
    coefficients : (n_cells, n_mesh, quantities, 5) stiffness and gap of every pair, friction, error and rate
    """

    stiffness: Array
    damping: Array
    direction: Array
    mesh_damping: Array
    backlash: Array
    load: Array
    response: Array
    edges: Array
    per_width: Array
    guide: NDArray[np.int64]
    coefficients: Array


def tables_of(given: Motion) -> Tables:
    """Return the parts of the flat array."""
    n, meshes, cells, flat = given.n, given.meshes, int(given.first_cell[-1]), given.flat
    rubs, guides = flat[RUBS] > 0.0, int(flat[GUIDES])
    quantities = (4 if rubs else 2) * given.pairs + 2
    shapes: list[tuple[int, ...]] = [
        (n, n), (n, n), (meshes, n), (meshes,), (meshes,), (n,), ((3 if rubs else 1) * meshes, n),
        (cells + 1,), (cells,), (guides,), (cells, meshes, quantities, DEGREE + 1),
    ]  # fmt: skip
    ends = HEADER + np.cumsum([int(np.prod(shape)) for shape in shapes])
    parts = [
        np.ascontiguousarray(flat[end - int(np.prod(shape)) : end].reshape(shape))
        for end, shape in zip(ends, shapes, strict=True)
    ]
    given_parts: list[Any] = [*parts[:-2], parts[-2].astype(np.int64), parts[-1]]
    return Tables(*given_parts)


def motion(
    kinds: Sequence[Touching], vibration: Vibration, system: System, friction: Friction | None
) -> Motion:
    """Write a wear state as a :class:`Motion`.

    Parameters
    ----------
    kinds : contact of the wear state of every kind of mesh, and what the excitation was fitted to
    vibration : the dynamics; its slow errors must not turn (no hunting)
    system : its structure with all loads known
    friction : of the flanks, None without
    """
    breaks = vibration.stages.edges
    edges, segment = _edges(kinds, vibration)
    width = np.diff(edges)
    halves = StageGrid(
        np.stack([edges[:-1], edges[:-1] + 0.5 * width], 1).ravel(),
        np.repeat(0.5 * width, 2),
        np.repeat(segment, 2),
    )
    given = vibration.stages
    grids = [one.analysis.grid for one in kinds]
    tables = stage_tables(kinds, stages(grids, given.meshes, breaks, halves, friction), None)
    coefficients = np.stack([_polynomials(one) for one in _quantities(tables)], axis=1)
    (meshes, pairs), cells = tables.stiffness.shape[2:], len(width)
    inverse = np.linalg.inv(system.mass)
    stiffness, damping = inverse @ system.total_stiffness, inverse @ system.total_damping
    marks = np.arange(GUIDES_PER_CELL * cells) / (GUIDES_PER_CELL * cells)
    guide = np.searchsorted(edges, marks, "right") - 1
    header = np.zeros(HEADER)
    header[[N, MESHES, PAIRS, CELLS, GUIDES]] = len(system.load), meshes, pairs, cells, len(guide)
    header[[PERIOD, GATED, RUBS]] = vibration.period, not system.damping_always, tables.sliding is not None
    header[DIAGONAL] = all(np.count_nonzero(m - np.diag(m.diagonal())) == 0 for m in (stiffness, damping))
    header[HAS_ERROR] = np.any(tables.error != 0.0)
    vectors = force_vectors(system)[1] @ inverse.T
    backlash = np.full(meshes, NEVER) if system.backlash is None else system.backlash
    parts = [header, stiffness, damping, system.direction, system.mesh_damping, backlash]
    parts += [inverse @ system.load, vectors, edges, 1.0 / width, guide.astype(float), coefficients]
    return Motion(
        np.concatenate([np.ravel(part) for part in parts]),
        breaks,
        np.searchsorted(edges, breaks - 1e-12),
        len(system.load),
        meshes,
        pairs,
        vibration.period,
    )


def _quantities(tables: StageTables) -> list[Array]:
    """Return for each mesh: stiffness and gap of its pairs, their friction, error and its rate."""
    found: list[Array] = []
    for m in range(tables.stiffness.shape[2]):
        found += list(np.moveaxis(tables.stiffness[:, :, m], 2, 0))
        found += list(np.moveaxis(tables.gap[:, :, m], 2, 0))
        if tables.sliding is not None and tables.moment is not None:
            found += list(np.moveaxis(tables.sliding[:, :, m], 2, 0))
            found += list(np.moveaxis(tables.moment[:, :, m], 2, 0))
        found += [tables.error[:, :, m], tables.error_rate[:, :, m]]
    return found


def _edges(kinds: Sequence[Touching], vibration: Vibration) -> tuple[Array, NDArray[np.int64]]:
    """Return cell edges (n_cells + 1,) and the smooth segment of each cell.

    One mesh bends at its nodes; of several meshes the bends are too many and too small to be told.
    """
    inner = np.empty(0)
    if len(vibration.stages.meshes) == 1:
        analysis = kinds[0].analysis
        inner = analysis.grid.phase_nodes[0]
        inner = np.concatenate([inner, analysis.stiffness.bends])
    edges, segments = [vibration.stages.edges[:1]], []
    for index, (low, high) in enumerate(pairwise(vibration.stages.edges)):
        inside = np.unique(np.round(inner[(inner > low + 1e-9) & (inner < high - 1e-9)], 12))
        if not len(inner):
            inside = np.linspace(low, high, CELLS_PER_SEGMENT + 1)[1:-1]
        edges += [inside, np.array([high])]
        segments += [index] * (len(inside) + 1)
    return np.concatenate(edges), np.array(segments)


def _polynomials(values: Array) -> Array:
    """Return the coefficients (n_cells, 5), constant first, through five even points a cell.

    Parameters
    ----------
    values : (2 n_cells, 3) at start, middle and end of every half cell
    """
    five = np.concatenate([values[0::2], values[1::2, 1:]], axis=1)
    matrix = np.vander(np.linspace(0.0, 1.0, DEGREE + 1), increasing=True)
    return np.ascontiguousarray(np.linalg.solve(matrix, five.T).T)


def starting_state(system: System, mean: Array) -> Array:
    """Return the static equilibrium at mean mesh stiffnesses (n_mesh,), at rest, (2n,): a first guess."""
    d = system.direction
    q = np.linalg.lstsq(system.total_stiffness + d.T @ (mean[:, None] * d), system.load, rcond=1e-12)[0]
    return np.concatenate([q, np.zeros(len(q))])
