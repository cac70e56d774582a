"""One wear state as a function of time that any integrator can call, compiled.

Our own methods read tables at their stages; a foreign integrator asks at times of its own. So the mesh is
written as polynomials of degree four on cells that end wherever anything in it bends: at the profile nodes,
the jumps and the points of a given table. Everything sits in one flat array, as C callbacks want it.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.life.vibration import Vibration
from wearlab.mesh.contact import ContactAnalysis
from wearlab.mesh.excitation import Touching, stage_tables, stages
from wearlab.mesh.stages import StageGrid
from wearlab.mesh.stiffness import GivenStiffness

Array = NDArray[np.float64]

DEGREE = 4
GUIDES_PER_CELL = 4
NEVER = 1e300
"""A backlash that no motion reaches: no back flank."""

# Where things stand in the flat array.
N, PAIRS, CELLS, GUIDES, PERIOD, BACKLASH, GATED, MESH_DAMPING, DIAGONAL, HAS_ERROR = range(10)
HEADER = 10


class Motion(NamedTuple):
    """The equation of motion of one wear state.

    Parameters
    ----------
    flat : everything, in one array: header, structure, cell edges, guide, coefficients
    breaks : (n_segments + 1,) phases between which the mesh is smooth [1]
    first_cell : (n_segments + 1,) cell with which each segment begins
    n : coordinates
    pairs : pairs in the path
    period : duration of a mesh period [s]
    """

    flat: Array
    breaks: Array
    first_cell: NDArray[np.int64]
    n: int
    pairs: int
    period: float


def motion(mesh: Touching, vibration: Vibration) -> Motion:
    """Write a wear state as a :class:`Motion`.

    Parameters
    ----------
    mesh : contact of the wear state, and what the excitation was fitted to
    vibration : the dynamics; its slow errors must not turn (no hunting)
    """
    analysis = mesh.analysis
    edges, segment = _edges(analysis)
    width = np.diff(edges)
    halves = StageGrid(
        np.stack([edges[:-1], edges[:-1] + 0.5 * width], 1).ravel(),
        np.repeat(0.5 * width, 2),
        np.repeat(segment, 2),
    )
    given = vibration.stages
    tables = stage_tables([mesh], stages([analysis.grid], given.meshes, given.edges, halves), None)
    cells, pairs = len(width), tables.stiffness.shape[3]
    quantities = [
        *(tables.stiffness[:, :, 0, p] for p in range(pairs)),
        *(tables.gap[:, :, 0, p] for p in range(pairs)),
        tables.error[:, :, 0],
        tables.error_rate[:, :, 0],
    ]
    coefficients = np.stack([_polynomials(values) for values in quantities], axis=1)
    system = vibration.system
    inverse = np.linalg.inv(system.mass)
    stiffness, damping = inverse @ system.total_stiffness, inverse @ system.total_damping
    marks = np.arange(GUIDES_PER_CELL * cells) / (GUIDES_PER_CELL * cells)
    guide = np.searchsorted(edges, marks, "right") - 1
    header = np.zeros(HEADER)
    header[[N, PAIRS, CELLS, GUIDES]] = len(system.load), pairs, cells, len(guide)
    header[[PERIOD, MESH_DAMPING]] = vibration.period, system.mesh_damping[0]
    header[BACKLASH] = NEVER if system.backlash is None else system.backlash[0]
    header[GATED] = not system.damping_always
    header[DIAGONAL] = all(np.count_nonzero(m - np.diag(m.diagonal())) == 0 for m in (stiffness, damping))
    header[HAS_ERROR] = np.any(tables.error != 0.0)
    parts = [header, stiffness, damping, system.direction[0], inverse @ system.direction[0]]
    parts += [inverse @ system.load, edges, 1.0 / width, guide.astype(float), coefficients]
    breaks = analysis.grid.breaks
    return Motion(
        np.concatenate([np.ravel(part) for part in parts]),
        breaks,
        np.searchsorted(edges, breaks - 1e-12),
        len(system.load),
        pairs,
        vibration.period,
    )


def _edges(analysis: ContactAnalysis) -> tuple[Array, NDArray[np.int64]]:
    """Return cell edges (n_cells + 1,) and the smooth segment of each cell."""
    grid = analysis.grid
    inner: Array = grid.phase_nodes[0]
    if isinstance(analysis.stiffness, GivenStiffness):
        inner = np.concatenate([inner, analysis.stiffness.curve.x % 1.0])
    edges, segments = [grid.breaks[:1]], []
    for index, (low, high) in enumerate(pairwise(grid.breaks)):
        inside = np.unique(np.round(inner[(inner > low + 1e-9) & (inner < high - 1e-9)], 12))
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


def starting_state(given: Motion, vibration: Vibration) -> Array:
    """Return the static equilibrium at the mean mesh stiffness, at rest, (2n,): a good first guess."""
    system = vibration.system
    cells, n = int(given.flat[CELLS]), given.n
    first = HEADER + 2 * n * n + 3 * n + (cells + 1) + cells + int(given.flat[GUIDES])
    shape = (cells, 2 * given.pairs + 2, DEGREE + 1)
    mean = given.flat[first:].reshape(shape)[:, : given.pairs, 0].sum(axis=1).mean()
    d = system.direction[0]
    q = np.linalg.solve(system.total_stiffness + mean * np.outer(d, d), system.load)
    return np.concatenate([q, np.zeros(n)])
