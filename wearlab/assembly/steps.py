"""Integration steps of a mesh period: as stated, or as the tolerance needs."""

from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.assembly.on_clock import OnClock
from wearlab.dynamics import methods, system
from wearlab.dynamics.integrators import count, kernel
from wearlab.gears import specification
from wearlab.mesh import contact, stages
from wearlab.mesh.clock import Mesh, locate_within_steps
from wearlab.scene import Scene

RESOLVED = 0.3
"""Share of the tolerance that the stages may miss of mesh stiffness and error."""
RISE = 1.5
MAX_STEPS = 30_000
"""Steps of a mesh period beyond which a motion is refused: it is quasi-static."""
MAX_FOR_MESH = 2000
"""Steps beyond which a finer mesh table is no reason for more."""


def steps_grid(
    scene: Scene, clock: OnClock, system: system.System, stiffness: Array, period: float
) -> stages.StageGrid:
    """Return the steps of a mesh period: as stated, or as the tolerance needs."""
    dynamics: Any = scene.dynamics
    breaks = clock.edges[:-1]
    tolerance = scene.numerics.tolerance
    steps_stated = scene.numerics.steps_per_period
    turned = count.fastest_rate(system, stiffness) * period
    method = methods.method_named(dynamics.method)
    exact = method.exact_when_large and not kernel.is_small(system)
    slow = (
        count.graded_steps(system, stiffness, period, tolerance, breaks, steps_stated)
        if exact
        else None
    )
    if slow is not None:
        return slow
    if steps_stated is not None:
        if not exact:
            _check_stability(method, steps_stated, turned)
        return stages.stage_grid(breaks, steps_stated)
    if turned > MAX_STEPS * (count.EXACT_LARGEST if exact else count.STABLE):
        raise specification.GearError(
            f"a mesh period lasts {period:.3g} s, in which the fastest mode turns by "
            f"{turned:.3g} rad: that takes more than {MAX_STEPS} steps; so slow a "
            "motion is quasi-static: drop [dynamics], raise the speed, or give "
            "numerics.steps_per_period"
        )
    rule = count.exact_steps_per_period if exact else count.steps_per_period
    steps = min(rule(system, stiffness, period, tolerance, len(breaks)), MAX_STEPS)
    grid = stages.stage_grid(breaks, steps)
    while (
        len(grid.width) < MAX_FOR_MESH
        and _largest_unresolved(clock, grid) > RESOLVED * tolerance
    ):
        steps = int(np.ceil(RISE * steps))
        grid = stages.stage_grid(breaks, steps)
    return grid


def _check_stability(
    method: type[methods.IntegrationMethod], steps: int, turned: float
) -> None:
    """Refuse steps of a period that are too few for a method to be stable.

    Parameters
    ----------
    method : of integration
    steps : of a mesh period
    turned : angle of the fastest mode in a mesh period [rad]
    """
    limit = method.stability
    if limit is None:
        return
    beyond = turned / (limit.turn * steps)
    if beyond > 1.0:
        raise specification.GearError(
            f"numerics.steps_per_period = {steps} is beyond the stability of "
            f"{limit.method} by a factor {beyond:.3g}: give {int(np.ceil(turned))} or "
            "more, or leave it out"
        )


def _largest_unresolved(clock: OnClock, grid: stages.StageGrid) -> float:
    """Return the largest share of a mesh stiffness or error that a grid misses [1]."""
    return max(
        (unresolved(clock.analyses[mesh.kind], mesh, grid) for mesh in clock.meshes),
        default=0.0,
    )


def unresolved(
    analysis: contact.ContactAnalysis, mesh: Mesh, grid: stages.StageGrid
) -> float:
    """Return the share of mesh stiffness and of error that a grid's stages miss [1].

    Three stages of a step say as much as the parabola through them. Its mean distance
    from the curve, taken at the quarters of each step, is compared with the mean
    stiffness and with the size of the error: a steep ramp in a table, or an error of
    high order, needs more steps than the motion does.
    """
    ends = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
    phase = grid.start[:, None] + grid.width[:, None] * ends
    where = locate_within_steps(
        analysis.grid, [mesh.lag], phase, grid.start + 0.5 * grid.width
    )
    compliance, _, _ = analysis.at(analysis.unworn[0], where)
    stiffness = (1.0 / compliance).sum(axis=1).reshape(phase.shape)
    error = mesh.error.value(where.phase).reshape(phase.shape)
    return max(
        _missed(stiffness, grid.width, stiffness.mean()),
        _missed(error, grid.width, np.ptp(error)),
    )


def _missed(values: Array, width: Array, size: float) -> float:
    """Return how far values (n, 5) are from parabolas through 1st, 3rd and 5th [1]."""
    quarters = values[:, ::2] @ np.array(
        [[0.375, -0.125], [0.75, 0.75], [-0.125, 0.375]]
    )
    distance = np.abs(quarters - values[:, [1, 3]]).mean(axis=1)
    return float(width @ distance / size) if size > 0.0 else 0.0
