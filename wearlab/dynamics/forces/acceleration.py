"""Accelerations of a response at any instant, from the equation of motion."""

from dataclasses import replace
from functools import cache

import numpy as np
from numpy.polynomial import Legendre

from wearlab.arrays import Array, Index
from wearlab.dynamics.orbits.response import Response, accelerations, coordinates_at, step_of
from wearlab.mesh.stages import StageGrid, parabola

NODES = 4
"""Nodes within a step, its ends among them."""


def mesh_acceleration_at(
    response: Response, grid: StageGrid, phase: Array, segment: Index | None = None
) -> Array:
    """Return the relative acceleration of both bodies along each line of action, (n_kept, n_mesh, n) [m/s²].

    ``d·q̈`` with ``q̈ = M⁻¹(F − Σ d W − friction − C q̇ − K q)``: all forces at that instant, nothing is
    differentiated. It is the acceleration of the mesh deflection δ, less that of a prescribed error.

    Parameters
    ----------
    response : the response
    grid : the steps it was computed on
    phase : (n,) [1]
    segment : (n,) the smooth segment each phase belongs to, which decides at breaks
    """
    step = step_of(grid, phase, segment)
    x = (phase - grid.start[step]) / grid.width[step]
    state = np.concatenate(coordinates_at(response, grid, phase, segment), axis=1).transpose(0, 2, 1)
    tables = response.tables
    error, error_rate = response.within.errors(step, x)
    given = response.within.springs(step, x)._asdict() | {"error": error, "error_rate": error_rate}
    given |= {name: parabola(table, step, x) for name in ("fluctuation", "sliding", "moment")
              if (table := getattr(tables, name)) is not None}  # fmt: skip
    at_points = {
        name: np.repeat(values[:, None], 3, axis=1) for name, values in given.items() if values is not None
    }
    points = replace(
        response,
        state=np.concatenate([state, state[:, -1:]], axis=1),
        tables=response.tables._replace(width=grid.width[step], **at_points),
    )
    by_mesh = accelerations(points)[:, :, 0] @ response.system.direction.T
    return np.ascontiguousarray(by_mesh.transpose(0, 2, 1))


def within_steps(grid: StageGrid, nodes: int = NODES) -> tuple[Array, Index, Array]:
    """Return phases within and at both ends of all steps, their segments, and weights of a mean over them.

    Lobatto's rule, of order ``2 nodes − 2`` on each smooth segment: (nodes · n_steps,) each. A wave that
    turns by θ within a step takes some θ/2 nodes beside the first few.
    """
    place, share = lobatto(nodes)
    phase = grid.start[:, None] + grid.width[:, None] * place
    weight = grid.width[:, None] * share
    return phase.ravel(), np.repeat(grid.segment, nodes), weight.ravel() / weight.sum()


@cache
def lobatto(nodes: int) -> tuple[Array, Array]:
    """Return the nodes of Lobatto's rule on [0, 1] and their weights, (nodes,) each.

    Ends, and between them the extremes of the Legendre polynomial P of degree ``n − 1``; weights
    ``1/(n (n − 1) P²)``.

    References
    ----------
    Abramowitz & Stegun, Handbook of Mathematical Functions, 1964, 25.4.32.
    """
    polynomial = Legendre.basis(nodes - 1)
    place = np.concatenate([[-1.0], np.sort(polynomial.deriv().roots().real), [1.0]])
    return 0.5 + 0.5 * place, 1.0 / (nodes * (nodes - 1) * polynomial(place) ** 2)
