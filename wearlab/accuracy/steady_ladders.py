"""Work–precision curves of a steady state: every knob, every named method, every peer."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.accuracy.cells import Motion, starting_state
from wearlab.accuracy.ladder import Curve, Rung, best_time
from wearlab.accuracy.peers import Peer, peers
from wearlab.accuracy.reference import Reference, reference, tight_steps
from wearlab.accuracy.steady import Steady, relative_error, steady
from wearlab.accuracy.transient import periods_to, transient
from wearlab.dynamics.methods import Newmark, Periodic, RungeKutta4, RungeKutta45
from wearlab.dynamics.response import Response
from wearlab.scene import Scene

Array = NDArray[np.float64]

STEPS = (32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024)
NEWMARK_STEPS = (32, 64, 128, 256, 512, 1024, 2048, 4096)
RELATIVE = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
PROFILE_POINTS = (25, 51, 101, 201, 401, 801, 1601)
FINEST_PROFILE = 3201
PHASE_POINTS = (8, 16, 32, 64, 128, 256, 512)
FINEST_PHASE = 8192
HARMONICS = (1, 2, 3, 5, 8, 12, 20, 40)
MOST_HARMONICS = 160
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
SETTLED = 1e-10
SHARE = 0.3
"""Part of a method's own error that is left of the transient when it stops."""
ENOUGH = 10.0
"""A peer that takes longer for a rung is not asked for a finer one [s]."""

Report = Callable[[str], None]


def steady_curves(problem: Steady, known: Reference, report: Report) -> Iterator[Curve]:
    """Yield the curves of a steady state.

    Parameters
    ----------
    problem, known : the scene and its answer
    report : told what comes next
    """
    report("steps_per_period, periodic")
    yield steps_curve(problem, known)
    if problem.vibration.fluctuation is None:
        yield from peer_curves(problem, known, report)
    report("steps_per_period, rk4")
    yield marched_curve(problem, known, "rk4", STEPS, lambda left: RungeKutta4(tolerance=left))
    report("steps_per_period, newmark")
    yield marched_curve(problem, known, "newmark", NEWMARK_STEPS, lambda left: Newmark(tolerance=left))
    report("relative tolerance, rk45")
    yield adaptive_curve(problem, known)
    if len(problem.parts.meshes) == 1:
        yield from knob_curves(problem.scene, report)
        yield phase_points_curve(problem, known)


def steps_curve(problem: Steady, known: Reference, ladder: tuple[int, ...] = STEPS) -> Curve:
    """Return our default method over its steps: cold, tables included, and warm from a neighbour.

    What a scene prepares once for all its wear states (the look-up of the stages here, the polynomials of the
    mesh for the peers) is not timed.
    """
    rungs = []
    for steps in ladder:
        vibration = problem.with_steps(steps, Periodic())
        response = problem.solve(vibration)
        near = problem.solve_near(vibration)
        rungs.append(
            Rung(
                len(vibration.stages.grid.width),
                relative_error(problem.force_of(vibration, response), known.force),
                best_time(lambda v=vibration: problem.solve(v)),  # type: ignore[misc]
                response.counts.right_hand_sides,
                best_time(lambda v=vibration, s=near: problem.solve(v, s)),  # type: ignore[misc]
            )
        )
    return Curve("periodic", "steps_per_period", "mesh_force", "wearlab", tuple(rungs))


def marched_curve(
    problem: Steady,
    known: Reference,
    name: str,
    ladder: tuple[int, ...],
    method: Callable[[float], Any],
) -> Curve:
    """Return a fixed-step method over its steps, marched until its transient is less than its error."""
    rungs = []
    for steps in ladder:
        settled = problem.with_steps(steps, method(SETTLED))
        error = _error(problem, known, settled)
        vibration = problem.with_steps(steps, method(max(SETTLED, min(1e-2, SHARE * error))))
        rungs.append(_rung(problem, known, vibration, len(vibration.stages.grid.width)))
    return Curve(name, "steps_per_period", "mesh_force", "as published", tuple(rungs), f'method = "{name}"')


def adaptive_curve(problem: Steady, known: Reference) -> Curve:
    """Return the adaptive Runge–Kutta pair over its tolerance, on tables as fine as that needs."""
    rungs = []
    for relative in RELATIVE:
        steps = int(np.ceil(tight_steps(problem) * (1e-10 / relative) ** 0.25))
        method = RungeKutta45(relative=relative, tolerance=max(SETTLED, SHARE * relative))
        rungs.append(_rung(problem, known, problem.with_steps(steps, method), relative))
    return Curve("rk45", "relative", "mesh_force", "as published", tuple(rungs), 'method = "rk45"')


def _error(problem: Steady, known: Reference, vibration: Any) -> float:
    return relative_error(problem.force_of(vibration, problem.solve(vibration)), known.force)


def _rung(problem: Steady, known: Reference, vibration: Any, setting: float) -> Rung:
    response = problem.solve(vibration)
    error = relative_error(problem.force_of(vibration, response), known.force)
    seconds = best_time(lambda: problem.solve(vibration), most=5)
    return Rung(setting, error, seconds, response.counts.right_hand_sides)


def knob_curves(scene: Scene, report: Report) -> Iterator[Curve]:
    """Yield the curves of knobs that change the model: the answer of their finest rung is the truth."""
    report("profile_points")
    steps = tight_steps(steady(scene)) // 4
    fine = scene.replace("numerics.steps_per_period", steps)
    truth = _solved(fine.replace("numerics.profile_points", FINEST_PROFILE))[1]
    yield _knob(fine, "numerics.profile_points", PROFILE_POINTS, truth)
    report("tolerance")
    yield _knob(scene, "numerics.tolerance", TOLERANCES, truth)
    if scene.mesh.excitation.model == "fourier":
        report("harmonics")
        yield harmonics_curve(fine)


def harmonics_curve(scene: Scene) -> Curve:
    """Return the curve over the harmonics of stiffness and error together, against very many."""

    def with_harmonics(count: int) -> Scene:
        return scene.replace("mesh.excitation.stiffness_harmonics", count).replace(
            "mesh.excitation.error_harmonics", count
        )

    truth = _solved(with_harmonics(MOST_HARMONICS))[1]
    rungs = tuple(_knob_rung(with_harmonics(count), count, truth) for count in HARMONICS)
    return Curve("harmonics", "stiffness_harmonics", "mesh_force", "wearlab", rungs, "error_harmonics alike")


def _knob(scene: Scene, key: str, values: tuple[float, ...], truth: Array) -> Curve:
    rungs = tuple(_knob_rung(scene.replace(key, value), value, truth) for value in values)
    name = key.rpartition(".")[2]
    return Curve(name, name, "mesh_force", "wearlab", rungs)


def _knob_rung(scene: Scene, setting: float, truth: Array) -> Rung:
    problem, force, response = _solved(scene)
    coupling = problem.parts.coupling
    wear = coupling.unworn()
    seconds = best_time(lambda: coupling.evaluate(wear), most=5)
    return Rung(setting, relative_error(force, truth), seconds, response.counts.right_hand_sides)


def _solved(scene: Scene) -> tuple[Steady, Array, Response]:
    """Return problem, force and response; of a scene, at its own settings."""
    problem = steady(scene)
    response = problem.solve(problem.vibration)
    force = problem.force_of(problem.vibration, response)
    return problem, force, response


def phase_points_curve(problem: Steady, known: Reference) -> Curve:
    """Return the error of the dynamic factor over the number of stored phases."""
    response = known.response
    vibration = problem.with_steps(tight_steps(problem), Periodic())

    def largest(points: int) -> float:
        return float(problem.force_of(vibration, response, np.arange(points) / points).max())

    truth = largest(FINEST_PHASE)
    rungs = tuple(
        Rung(n, abs(largest(n) / truth - 1.0), best_time(lambda n=n: largest(n)), n)  # type: ignore[misc]
        for n in PHASE_POINTS
    )
    return Curve("phase_points", "phase_points", "dynamic_factor", "wearlab", rungs)


def peer_curves(problem: Steady, known: Reference, report: Report) -> Iterator[Curve]:
    """Yield the curves of the peers, each told how many mesh periods to march."""
    system, tables = known.response.system, known.response.tables
    given = problem.motion(system)
    mean = np.einsum("s,sm->m", tables.width, tables.stiffness.sum(axis=3)[:, 1])
    cold = starting_state(system, mean)
    tight = problem.with_steps(len(known.response.tables.width) // 4, Periodic())
    warm = problem.solve_near(tight).state[0, 0]
    left = transient(problem, known, cold), transient(problem, known, warm)
    scale = np.abs(known.response.state).max(axis=(0, 1))
    for peer in peers():
        report(peer.name)
        rungs: list[Rung] = []
        for tolerance in peer.tolerances:
            rungs.append(_peer_rung(problem, known, given, peer, tolerance, (cold, warm), left, scale))
            if rungs[-1].seconds > ENOUGH:
                break
        yield Curve(peer.name, "relative", "mesh_force", "peer", tuple(rungs))


def _peer_rung(
    problem: Steady,
    known: Reference,
    given: Motion,
    peer: Peer,
    tolerance: float,
    starts: tuple[Array, Array],
    left: tuple[Array, Array],
    scale: Array,
) -> Rung:
    """Find the error that marching on and on would leave, then march as long as that is worth."""
    floor = _peer_error(problem, known, given, peer, tolerance, known.start, periods_to(left[0], 1e-3), scale)
    worth = SHARE * floor if np.isfinite(floor) else 1e-3
    count = periods_to(left[0], worth)
    error = _peer_error(problem, known, given, peer, tolerance, starts[0], count, scale)
    ends = [(n + len(known.force)) * given.period for n in (count, periods_to(left[1], worth))]
    cold, warm = (
        best_time(partial(peer.march, given, start, end, tolerance, scale, None), most=8)
        for start, end in zip(starts, ends, strict=True)
    )
    return Rung(tolerance, error, cold, float("nan"), warm)


def _peer_error(
    problem: Steady,
    known: Reference,
    given: Motion,
    peer: Peer,
    tolerance: float,
    start: Array,
    count: int,
    scale: Array,
) -> float:
    periods = len(known.force)
    turns = count + np.arange(periods)[:, None] + problem.phase
    states = peer.march(
        given, start, (count + periods) * given.period, tolerance, scale, turns.ravel() * given.period
    )
    if len(states) != turns.size:
        return float("inf")
    return relative_error(problem.force_of_states(states.reshape(*turns.shape, -1)), known.force)


def steady_study(scene: Scene, report: Report) -> tuple[tuple[Curve, ...], float, float]:
    """Return the curves of a scene's steady state, the disagreement of its reference, its multiplier.

    Raises
    ------
    Unsuited
        When the response is aperiodic or its slow errors turn.
    """
    problem = steady(scene)
    report("reference")
    known = reference(problem)
    return tuple(steady_curves(problem, known, report)), known.disagreement, known.multiplier
