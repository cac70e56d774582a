"""Work–precision curves of a steady state: named methods, knobs and peers."""

import time
from collections.abc import Callable, Iterator
from typing import Any

from wearlab.accuracy.knob_curves import knob_curves, phase_points_curve
from wearlab.accuracy.ladder import (
    SINGLE_TIMING,
    TRANSIENT_SHARE,
    Rung,
    WorkPrecision,
    measured_rungs,
    timing,
)
from wearlab.accuracy.peer_curves import peer_curves
from wearlab.accuracy.reference import Reference, stiffest_meshes, tight_steps
from wearlab.accuracy.steady import Steady, relative_error
from wearlab.dynamics.integrators import count
from wearlab.dynamics.methods.newmark import Newmark
from wearlab.dynamics.methods.rk4 import RungeKutta4
from wearlab.dynamics.methods.rk45 import RungeKutta45
from wearlab.dynamics.steady.periodic import Periodic

STEPS = tuple(
    int(steps)
    for steps in """
    8 12 16 20 24 28 32 36 40 44 48 56 64 96 128 192 256 384 448 512 640 768 1024
    """.split()
)
INTEGRATED_STEPS = tuple(2**power for power in range(5, 16))
RELATIVE = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
SETTLED = 1e-10
"""Share of a transient that is left when a method is measured without it [1]."""
RK4_STABLE = 2.78
"""RK4 is stable while its steps turn the fastest mode by less [rad]."""

Report = Callable[[str], None]


def steady_curves(
    problem: Steady, answer: Reference, report: Report
) -> Iterator[WorkPrecision]:
    """Yield the curves of a steady state.

    Parameters
    ----------
    problem, answer : the scene and its answer
    report : called with the name of the curve that comes next
    """
    report("steps_per_period, periodic")
    yield steps_curve(problem, answer)
    vibration = problem.vibration
    if vibration.fluctuation is None:
        yield from peer_curves(problem, answer, report)

    report("steps_per_period, rk4")
    rate = count.fastest_rate(vibration.system, stiffest_meshes(problem))
    turn = rate * vibration.period
    stable = tuple(steps for steps in INTEGRATED_STEPS if turn / steps < RK4_STABLE)
    yield integrated_curve(
        problem, answer, "rk4", stable, lambda left: RungeKutta4(tolerance=left)
    )

    report("steps_per_period, newmark")
    yield integrated_curve(
        problem,
        answer,
        "newmark",
        INTEGRATED_STEPS,
        lambda left: Newmark(tolerance=left),
    )

    report("relative tolerance, rk45")
    yield adaptive_curve(problem, answer)
    yield from knob_curves(problem, report)
    yield phase_points_curve(problem, answer)


def steps_curve(
    problem: Steady, answer: Reference, ladder: tuple[int, ...] = STEPS
) -> WorkPrecision:
    """Return our default method over its steps, from a cold and from a warm start.

    Cold, the tables are included; warm, a neighbouring wear state is known. What a
    scene prepares once for all its wear states (the look-up of the stages here, the
    polynomials of the mesh for the peers) is not timed, nor the factors that one wear
    state keeps for all its neighbours. The error is that of the worse of both.

    Parameters
    ----------
    problem, answer : the scene and its answer
    ladder : steps of a mesh period
    """

    def rung_of(steps: int) -> Rung:
        vibration = problem.with_steps(steps, Periodic())
        response = problem.solve(vibration)
        near = problem.solve(vibration, kinds=problem.near)
        warm_response = problem.solve(vibration, near)
        error = max(
            relative_error(problem.force_of(vibration, response), answer.force),
            relative_error(problem.force_of(vibration, warm_response), answer.force),
        )
        return Rung(
            setting=len(response.tables.width),
            error=error,
            seconds=timing(lambda: problem.solve(vibration)),
            work=response.counts.right_hand_sides,
            warm_seconds=timing(lambda: problem.solve(vibration, near)),
        )

    rungs = measured_rungs(ladder, rung_of)
    return WorkPrecision("periodic", "steps_per_period", "mesh_force", "wearlab", rungs)


def integrated_curve(
    problem: Steady,
    answer: Reference,
    name: str,
    ladder: tuple[int, ...],
    method: Callable[[float], Any],
) -> WorkPrecision:
    """Return a fixed-step method over its steps, its transient less than its error.

    Parameters
    ----------
    problem, answer : the scene and its answer
    name : of the method
    ladder : steps of a mesh period
    method : share of the transient that is left [1] → the method
    """

    def rung_of(steps: int) -> Rung:
        settled = problem.with_steps(steps, method(SETTLED))
        force = problem.force_of(settled, problem.solve(settled))
        error = relative_error(force, answer.force)
        left = max(SETTLED, min(1e-2, TRANSIENT_SHARE * error))
        vibration = problem.with_steps(steps, method(left))
        step_count = len(vibration.sampling.grid.width)
        return _integrated_rung(problem, answer, vibration, step_count)

    rungs = measured_rungs(ladder, rung_of, answer.disagreement)
    return WorkPrecision(
        name,
        "steps_per_period",
        "mesh_force",
        "as published",
        rungs,
        f'method = "{name}"',
    )


def adaptive_curve(problem: Steady, answer: Reference) -> WorkPrecision:
    """Return the adaptive Runge–Kutta pair over its tolerance.

    Its tables are as fine as the tolerance needs.

    Parameters
    ----------
    problem, answer : the scene and its answer
    """
    quickest = RungeKutta45(relative=1.0, tolerance=1.0)
    problem.solve(problem.with_steps(STEPS[-1], quickest))  # compiles

    def rung_of(relative: float) -> Rung:
        left = max(SETTLED, TRANSIENT_SHARE * relative)
        method = RungeKutta45(relative=relative, tolerance=left)
        steps = tight_steps(problem, relative, exact=False)
        vibration = problem.with_steps(steps, method)
        return _integrated_rung(problem, answer, vibration, relative)

    rungs = measured_rungs(RELATIVE, rung_of, answer.disagreement)
    return WorkPrecision(
        "rk45", "relative", "mesh_force", "as published", rungs, 'method = "rk45"'
    )


def _integrated_rung(
    problem: Steady, answer: Reference, vibration: Any, setting: float
) -> Rung:
    """Return the rung of a method that integrates until its transient is small."""
    begin = time.process_time()
    response = problem.solve(vibration)
    seconds = time.process_time() - begin
    if seconds < SINGLE_TIMING:
        seconds = timing(lambda: problem.solve(vibration))

    error = relative_error(problem.force_of(vibration, response), answer.force)
    return Rung(setting, error, seconds, response.counts.right_hand_sides)
