"""Mesh forces anywhere within the steps of a response, from what the solver's own tables were taken of."""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.dynamics.response import Response

FAR = 1.0
"""Clearance of a pair that is out of the path [m]."""


class ForcesWithin(NamedTuple):
    """Meshes anywhere within the steps, (n_kept, …, n_mesh).

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


def forces_within(response: Response, x: Array, kept: slice = slice(None)) -> ForcesWithin:
    """Return the forces of all meshes at fractions x (n_fractions,) of every step, (…, n_steps, …)."""
    steps = len(response.tables.width)
    forces = forces_at(response, np.tile(np.arange(steps), len(x)), np.repeat(x, steps), kept)
    return ForcesWithin(*(force.reshape(len(force), len(x), steps, -1) for force in forces))


def forces_at(response: Response, step: Index, fraction: Array, kept: slice = slice(None)) -> ForcesWithin:
    """Return the forces of all meshes at fractions of steps, both (n,).

    ``W = Σ_p k_p max(0, δ − g_p) − Σ_p k_p max(0, −j_bn − δ)``, damping ``c δ̇``: the path's polynomials
    give d·q, and what the tables were taken of k, g and e.

    Parameters
    ----------
    response : the response
    step, fraction : where, (n,) [1]
    kept : which of the kept periods
    """
    system, path = response.system, response.approach
    path = path._replace(coefficient=path.coefficient[:, kept])
    position, velocity = (
        state.reshape(-1, len(step), len(system.direction)) for state in path.at(step, fraction)
    )
    error, error_rate = response.within.errors(step, fraction)
    delta, rate = position - error, velocity - error_rate / response.mesh_period
    stiffness, gap = response.within.springs(step, fraction)
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
