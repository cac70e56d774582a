"""How many steps a mesh period takes: a rule, never the user's guess."""

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.system import System

Array = NDArray[np.float64]

STABLE = 1.0
ERROR_CONSTANT = 0.06
FLOOR = 6.0
STEPS_PER_SEGMENT = 6


def fastest_rate(system: System, mesh_stiffness: Array | float) -> float:
    """Return the largest modulus of the eigenvalues of the equation of motion, all meshes in contact [1/s].

    Parameters
    ----------
    system : the one form
    mesh_stiffness : stiffness of every mesh, (n_mesh,) or one value, the largest of a period [N/m]
    """
    n = len(system.load)
    d = system.direction
    k = np.broadcast_to(np.asarray(mesh_stiffness, float), (len(d),))
    stiffness = system.total_stiffness + d.T @ (k[:, None] * d)
    damping = system.total_damping + d.T @ np.diag(system.mesh_damping) @ d
    companion = np.block(
        [[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(system.mass, np.hstack([stiffness, damping]))]]
    )
    return float(np.abs(np.linalg.eigvals(companion)).max())


def steps_per_period(
    system: System,
    mesh_stiffness_max: Array | float,
    period: float,
    tolerance: float,
    segments: int = 1,
) -> int:
    """Return the steps of a mesh period that keep RK4 stable and its error near ``tolerance``.

    The relative error of a step h is about ``0.06 (ω h)⁴`` (measured, benchmark pair), ω the fastest rate
    with the stiffest mesh; stability asks ω h < 2.78 and gets ω h ≤ 1. A slow system still has to resolve the
    excitation: no fewer than ``6 tolerance^(−1/4)`` steps, and six a segment.

    Parameters
    ----------
    system : the one form
    mesh_stiffness_max : largest stiffness of every mesh over the period, (n_mesh,) or one value [N/m]
    period : duration of a mesh period [s]
    tolerance : relative error wanted in the mesh force [1]
    segments : smooth segments of the mesh period
    """
    step_angle = min(STABLE, (tolerance / ERROR_CONSTANT) ** 0.25)
    wanted = fastest_rate(system, mesh_stiffness_max) * period / step_angle
    return int(np.ceil(max(wanted, FLOOR * tolerance**-0.25, STEPS_PER_SEGMENT * segments)))
