"""How many steps a mesh period takes: a rule, never the user's guess."""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Complex
from wearlab.dynamics.integrators.propagator import companion, normalised
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageGrid, StageTables, graded_grid

RIGID = 1e-5
"""Size of the eigenvalues of a free rotation, over the largest."""
REMEMBERED = 1e-6
"""Share of a motion that is left when it has died out."""
STABLE = 1.0
"""Largest ω h of Runge–Kutta steps, whose stability asks ω h < 2.78."""
EXACT_LARGEST = 2.0
"""Largest ω h of exact steps."""
GRADED_FROM = 1000
"""Steps of a mesh period below which all are alike."""


PerMesh = Array | float


def fastest_rate(system: System, mesh_stiffness: PerMesh) -> float:
    """Return the largest modulus of the eigenvalues, all meshes in contact [1/s].

    Parameters
    ----------
    system : the equation of motion
    mesh_stiffness : stiffness of every mesh, (n_mesh,) or one value, the largest of a
        period [N/m]
    """
    return float(np.abs(_eigenvalues(system, mesh_stiffness)).max())


def settling_periods(system: System, tables: StageTables, period: float) -> float:
    """Return the mesh periods in which the slowest free motion dies out, in contact.

    Infinite without damping. Free rotations, which do not vibrate, are left out.

    Parameters
    ----------
    system, tables, period : as for `wearlab.dynamics.steady.periodic.Periodic.solve`;
        the mean mesh stiffness counts
    """
    slowest = float((-_vibrating(system, tables.mean_stiffness).real).min())
    if slowest <= 0.0:
        return np.inf
    return float(-np.log(REMEMBERED) / (slowest * period))


def _vibrating(system: System, mesh_stiffness: PerMesh) -> Complex:
    """Return the eigenvalues but those of free rotations [1/s]."""
    rates = _eigenvalues(system, mesh_stiffness)
    return rates[np.abs(rates) > RIGID * np.abs(rates).max()]


def _eigenvalues(system: System, mesh_stiffness: PerMesh) -> Complex:
    """Return the eigenvalues of the equation of motion, (2n,) [1/s]."""
    k = np.broadcast_to(np.asarray(mesh_stiffness, float), (len(system.direction),))
    stiffness, damping = normalised(system, k)
    eigenvalues = np.linalg.eigvals(companion(stiffness, damping))
    return np.asarray(eigenvalues, np.complex128)


class StepRule(NamedTuple):
    """How many steps a mesh period takes.

    Their error is about ``constant (ω h)^order``.

    Parameters
    ----------
    constant, order : of the error, ω the fastest rate with the stiffest mesh
    largest : ω h at most
    floor : a slow system still has to resolve the mesh: no fewer than ``floor
        tolerance^(−1/order)`` steps
    per_segment : steps at least in each smooth segment of the mesh period
    """

    constant: float
    order: float
    largest: float
    floor: float
    per_segment: int

    def steps(
        self,
        system: System,
        stiff: PerMesh,
        period: float,
        tolerance: float,
        segments: int = 1,
    ) -> int:
        """Return the steps of a mesh period that keep their error near ``tolerance``.

        Parameters
        ----------
        system : the equation of motion
        stiff : largest stiffness of every mesh over the period, (n_mesh,) or one value
            [N/m]
        period : duration of a mesh period [s]
        tolerance : relative error wanted in the mesh force [1]
        segments : smooth segments of the mesh period
        """
        step_angle = min(
            self.largest, (tolerance / self.constant) ** (1.0 / self.order)
        )
        for_motion = fastest_rate(system, stiff) * period / step_angle
        for_mesh = self.floor * tolerance ** (-1.0 / self.order)
        for_segments = self.per_segment * segments
        return int(np.ceil(max(for_motion, for_mesh, for_segments)))


steps_per_period = StepRule(
    constant=0.06, order=4.0, largest=STABLE, floor=6.0, per_segment=6
).steps
"""Of Runge–Kutta steps, error measured on the benchmark pair; see Hairer & Wanner 1996,
§IV.2."""
exact_steps_per_period = StepRule(
    constant=2.5e-5, order=6.0, largest=EXACT_LARGEST, floor=12.0, per_segment=4
).steps
"""Of exact steps of the linear part, error measured on W23's and B23's sets.

They know no limit of stability, and free vibration costs no accuracy. What they
interpolate, by the five stages of two steps, is the force by which a mesh differs from
its mean, ``(k(φ) − k̄) δ``: δ vibrates after every pair that enters. """


def graded_steps(
    system: System,
    stiff: PerMesh,
    period: float,
    tolerance: float,
    breaks: Array,
    steps: int | None = None,
) -> StageGrid | None:
    """Return exact steps that grow after every break, None: equal ones are as few.

    A jump makes all modes ring. A time t later those have died out to the tolerance
    whose rate is above ``ln(1/tolerance)/(ζ t)``, ζ the least damping ratio, and steps
    need to follow the others alone.

    Parameters
    ----------
    system, stiff, period, tolerance : as for `steps_per_period`
    breaks : phases at which something jumps [1]
    steps : how many there are to be, all longer or shorter alike; None: as many as
        needed
    """
    equal_steps = exact_steps_per_period(system, stiff, period, tolerance, len(breaks))
    rates = _vibrating(system, stiff)
    size = np.abs(rates)
    damping_ratio = float((-rates.real / size).min())
    if equal_steps < GRADED_FROM or damping_ratio <= 0.0:
        return None

    fastest = float(size.max())
    steps_to_die = (
        np.log(1.0 / tolerance) * equal_steps / (damping_ratio * fastest * period)
    )
    grid = graded_grid(breaks, 1.0 / equal_steps, steps_to_die)
    if len(grid.width) >= equal_steps:
        return None

    if steps is not None:
        share = steps / len(grid.width)
        grid = graded_grid(breaks, 1.0 / (share * equal_steps), share * steps_to_die)
    return grid
