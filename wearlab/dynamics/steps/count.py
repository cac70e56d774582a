"""How many steps a mesh period takes: a rule, never the user's guess."""

import numpy as np

from wearlab.arrays import Array, Complex
from wearlab.dynamics.steps.propagator import companion, normalised
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageGrid, graded_grid

RIGID = 1e-5
"""Size of the eigenvalues of a free rotation, over the largest."""
STABLE = 1.0
ERROR_CONSTANT = 0.06
FLOOR = 6.0
STEPS_PER_SEGMENT = 6
EXACT_ERROR_CONSTANT = 2.5e-5
EXACT_ORDER = 6.0
EXACT_LARGEST = 2.0
EXACT_FLOOR = 12.0
EXACT_STEPS_PER_SEGMENT = 4
GRADED_FROM = 1000
"""Steps of a mesh period below which all are alike."""


def fastest_rate(system: System, mesh_stiffness: Array | float) -> float:
    """Return the largest modulus of the eigenvalues of the equation of motion, all meshes in contact [1/s].

    Parameters
    ----------
    system : the one form
    mesh_stiffness : stiffness of every mesh, (n_mesh,) or one value, the largest of a period [N/m]
    """
    return float(np.abs(_eigenvalues(system, mesh_stiffness)).max())


def slowest_decay(system: System, mesh_stiffness: Array | float) -> float:
    """Return the rate at which the most lightly damped vibration decays, all meshes in contact [1/s].

    Free rotations, which do not vibrate, are left out.

    Parameters
    ----------
    system, mesh_stiffness : as for `fastest_rate`
    """
    eigenvalues = _eigenvalues(system, mesh_stiffness)
    vibrating = eigenvalues[np.abs(eigenvalues) > RIGID * np.abs(eigenvalues).max()]
    return max(0.0, float((-vibrating.real).min()))


def _eigenvalues(system: System, mesh_stiffness: Array | float) -> Complex:
    """Return the eigenvalues of the equation of motion, (2n,) [1/s]."""
    k = np.broadcast_to(np.asarray(mesh_stiffness, float), (len(system.direction),))
    matrices = system.mass, system.total_stiffness, system.total_damping, system.direction
    both = normalised(*matrices, system.mesh_damping, k)
    return np.asarray(np.linalg.eigvals(companion(*both)), np.complex128)


def exact_steps_per_period(
    system: System,
    mesh_stiffness_max: Array | float,
    period: float,
    tolerance: float,
    segments: int = 1,
) -> int:
    """Return the exact steps of a mesh period that keep their error near ``tolerance``.

    Exact steps of the linear part know no limit of stability, and free vibration costs no accuracy. What they
    interpolate, by the five stages of two steps, is the force by which a mesh differs from its mean, ``(k(φ)
    − k̄) δ``: δ vibrates after every pair that enters. The error is about ``2.5e-5 (ω h)⁶`` (measured, W23
    and B23 sets), ω the fastest rate with the stiffest mesh. The mesh itself has to be resolved, too: no
    fewer than ``12 tolerance^(−1/6)`` steps, and four a segment.

    Parameters
    ----------
    system, mesh_stiffness_max, period, tolerance, segments : as for `steps_per_period`
    """
    step_angle = min(EXACT_LARGEST, (tolerance / EXACT_ERROR_CONSTANT) ** (1.0 / EXACT_ORDER))
    wanted = fastest_rate(system, mesh_stiffness_max) * period / step_angle
    floor = EXACT_FLOOR * tolerance ** (-1.0 / EXACT_ORDER)
    return int(np.ceil(max(wanted, floor, EXACT_STEPS_PER_SEGMENT * segments)))


def graded_steps(
    system: System,
    mesh_stiffness_max: Array | float,
    period: float,
    tolerance: float,
    breaks: Array,
    steps: int | None = None,
) -> StageGrid | None:
    """Return exact steps that grow after every break, None where equal ones are no more.

    A jump makes all modes ring. A time t later those have died out to the tolerance whose rate is above
    ``ln(1/tolerance)/(ζ t)``, ζ the least damping ratio, and steps need to follow the others alone.

    Parameters
    ----------
    system, mesh_stiffness_max, period, tolerance : as for `steps_per_period`
    breaks : phases at which something jumps [1]
    steps : how many there are to be, all longer or shorter alike; None: as many as needed
    """
    equal = exact_steps_per_period(system, mesh_stiffness_max, period, tolerance, len(breaks))
    rates = _eigenvalues(system, mesh_stiffness_max)
    size = np.abs(rates)
    vibrates = size > RIGID * size.max()
    ratio = float((-rates.real[vibrates] / size[vibrates]).min())
    if equal < GRADED_FROM or ratio <= 0.0:
        return None
    alike = np.log(1.0 / tolerance) * equal / (ratio * float(size.max()) * period)
    grid = graded_grid(breaks, 1.0 / equal, alike)
    if len(grid.width) >= equal:
        return None
    if steps is not None:
        share = steps / len(grid.width)
        grid = graded_grid(breaks, 1.0 / (share * equal), share * alike)
    return grid


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

    References
    ----------
    Hairer & Wanner 1996, §IV.2: the interval of stability of Kutta 1901.
    """
    step_angle = min(STABLE, (tolerance / ERROR_CONSTANT) ** 0.25)
    wanted = fastest_rate(system, mesh_stiffness_max) * period / step_angle
    return int(np.ceil(max(wanted, FLOOR * tolerance**-0.25, STEPS_PER_SEGMENT * segments)))
