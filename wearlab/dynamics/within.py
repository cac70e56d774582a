"""Mesh forces anywhere within the steps of a response, from what the solver's own tables were taken of."""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.dynamics.response import Response

FAR = 1.0
"""Clearance of a pair that is out of the path [m]."""


class ForcesWithin(NamedTuple):
    """Meshes at fractions of every step, (n_kept, n_fractions, n_steps, n_mesh).

    Fraction 0 of a step and fraction 1 of the one before are the two sides of a jump.

    Parameters
    ----------
    elastic : drive minus back flank force [N]
    damping : of the mesh, 0 in separation unless it always acts [N]
    clearance : of the drive flanks, that of the pair nearest to contact: negative while one touches [m]
    """

    elastic: Array
    damping: Array
    clearance: Array


def forces_within(
    response: Response, x: Array, kept: slice = slice(None), steps: Index | None = None
) -> ForcesWithin:
    """Return the forces of all meshes at fractions of steps.

    ``W = Σ_p k_p max(0, δ − g_p) − Σ_p k_p max(0, −j_bn − δ)``, damping ``c δ̇``: the path's polynomials
    give d·q, and what the tables were taken of k, g and e.

    Parameters
    ----------
    response : the response
    x : (n_fractions,) [1]
    kept : which of the kept periods
    steps : (n_steps,) which steps; None: all
    """
    system, tables = response.system, response.tables
    steps = np.arange(len(tables.width)) if steps is None else steps
    shape = (len(x), len(steps), len(system.direction))
    at, fraction = np.tile(steps, len(x)), np.repeat(x, len(steps))
    path = response.approach
    path = path._replace(coefficient=path.coefficient[:, kept])
    position, velocity = path.at(at, fraction)
    error, error_rate = response.within.errors(at, fraction)
    delta = (position - error).reshape(-1, *shape)
    rate = (velocity - error_rate / response.mesh_period).reshape(-1, *shape)
    stiffness, gap = (one.reshape(*shape, -1) for one in response.within.springs(at, fraction))
    present = stiffness > 0.0
    apart = np.where(present, gap - delta[..., None], FAR)
    elastic = (stiffness * np.where(present, np.maximum(-apart, 0.0), 0.0)).sum(axis=-1)
    clearance = apart.min(axis=-1)
    touching = clearance < 0.0
    if system.backlash is not None:
        back = stiffness.sum(axis=-1) * np.maximum(0.0, -system.backlash - delta)
        elastic, touching = elastic - back, touching | (back > 0.0)
    gate = 1.0 if system.damping_always else touching
    return ForcesWithin(elastic, system.mesh_damping * rate * gate, clearance)
