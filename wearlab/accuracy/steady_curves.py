"""Work-precision curves of a steady state: every knob, every named method, every peer."""

import time
from collections.abc import Callable, Iterator
from copy import copy
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np

from wearlab.accuracy.equation import CyRKIntegrator, starting_state
from wearlab.accuracy.ladder import LONG, SHARE, Rung, WorkPrecision, climbed, timing
from wearlab.accuracy.steady import Reference, Steady, relative_error, steady, stiffest_meshes, tight_steps
from wearlab.arrays import Array
from wearlab.dynamics.methods import Newmark, Periodic, RungeKutta4, RungeKutta45
from wearlab.dynamics.orbits.response import Response
from wearlab.dynamics.steps.count import fastest_rate
from wearlab.scene import Scene, mesh

METHODS = ("RK45", "TSIT5", "VERN7", "DOP853")
PEER_TOLERANCES = tuple(10.0 ** -np.arange(3.0, 9.5, 1.0))
LONGEST = 10.0
"""An integration that would take longer is not begun [s]."""


def peers() -> tuple[str, ...]:
    """Return the names of the methods of CyRK, if it is installed; each lands on every known jump."""
    return () if missing_peers() else tuple(f"CyRK {method}, landing" for method in METHODS)


def missing_peers() -> tuple[str, ...]:
    """Return the peers that are not installed (``pip install wearlab[peers]``)."""
    return () if find_spec("CyRK") is not None else ("CyRK",)


def peer_curves(problem: Steady, answer: Reference, report: Callable[[str], None]) -> Iterator[WorkPrecision]:
    """Yield the curves of the peers over their relative tolerance, where a transient dies in time.

    Parameters
    ----------
    problem, answer : the scene and its answer
    report : told who comes next
    """
    system, tables = answer.response.system, answer.response.tables
    start = starting_state(system, np.einsum("s,sm->m", tables.width, tables.stiffness.sum(axis=3)[:, 1]))
    if not peers():
        return
    first = CyRKIntegrator(problem.motion(system), METHODS[0])
    for name, method in zip(peers(), METHODS, strict=True):
        report(name)
        peer = copy(first)
        peer.method = method
        rung_of = partial(_rung, peer, problem, answer, start=start)
        if rungs := climbed(PEER_TOLERANCES, rung_of, answer.disagreement):
            yield WorkPrecision(name, "relative", "mesh_force", "peer", rungs)


def periods_to(answer: Reference, left: float) -> float:
    """Return the mesh periods until so much is left of a transient; infinite where it does not die."""
    largest = answer.multiplier ** (1.0 / len(answer.force))
    return float(np.ceil(np.log(left) / np.log(largest))) if 0.0 < largest < 1.0 else float("inf")


def _rung(
    peer: CyRKIntegrator, problem: Steady, answer: Reference, tolerance: float, start: Array
) -> Rung | None:
    """Return a setting of a peer, None where its integration would take too long."""
    scale, periods = np.abs(answer.response.state).max(axis=(0, 1)), periods_to(answer, SHARE * tolerance)
    for _ in range(2):  # the first compiles
        begun = time.perf_counter()
        peer.integrate(answer.start, 1, tolerance, scale)
    if periods * (time.perf_counter() - begun) > LONGEST:
        return None
    count = int(periods)
    settled = peer.integrate(start, count, tolerance, scale)
    if not np.isfinite(settled).all():
        return Rung(tolerance, float("inf"), float("nan"), float("nan"))
    motion = peer.states(settled, len(answer.force), problem.phase, tolerance, scale)
    seconds = timing(lambda: peer.integrate(start, count + len(answer.force), tolerance, scale))
    return Rung(
        tolerance, relative_error(problem.force_of_states(motion), answer.force), seconds, float("nan")
    )


STEPS = (8, 12, 16, 20, 24, 28, 32, 36, 40, 44, 48, 56, 64, 96, 128, 192, 256, 384, 448, 512, 640, 768, 1024)
INTEGRATED_STEPS = tuple(2**power for power in range(5, 16))
STABLE_TURN = 2.78  # rad: RK4 is stable while its steps turn the fastest mode by less
RELATIVE = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
PROFILE_POINTS = (25, 51, 101, 201, 401, 801, 1601)
FINEST_PROFILE = 3201
PHASE_POINTS = (8, 16, 32, 64, 128, 256, 512)
FINEST_PHASE = 8192
HARMONICS = (1, 2, 3, 5, 8, 12, 20, 40)
MOST_HARMONICS = 160
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
FINE = 2.5e-8
"""Error of the steps while other knobs are turned."""
SETTLED = 1e-10

Report = Callable[[str], None]


def steady_curves(problem: Steady, answer: Reference, report: Report) -> Iterator[WorkPrecision]:
    """Yield the curves of a steady state.

    Parameters
    ----------
    problem, answer : the scene and its answer
    report : told what comes next
    """
    report("steps_per_period, periodic")
    yield steps_curve(problem, answer)
    if problem.vibration.fluctuation is None:
        yield from peer_curves(problem, answer, report)
    report("steps_per_period, rk4")
    turn = fastest_rate(problem.vibration.system, stiffest_meshes(problem)) * problem.vibration.period
    stable = tuple(steps for steps in INTEGRATED_STEPS if turn / steps < STABLE_TURN)
    yield integrated_curve(problem, answer, "rk4", stable, lambda left: RungeKutta4(tolerance=left))
    report("steps_per_period, newmark")
    yield integrated_curve(problem, answer, "newmark", INTEGRATED_STEPS, lambda left: Newmark(tolerance=left))
    report("relative tolerance, rk45")
    yield adaptive_curve(problem, answer)
    yield from knob_curves(problem, report)
    yield phase_points_curve(problem, answer)


def steps_curve(problem: Steady, answer: Reference, ladder: tuple[int, ...] = STEPS) -> WorkPrecision:
    """Return our default method over its steps: cold, tables included, and warm from a neighbour.

    What a scene prepares once for all its wear states (the look-up of the stages here, the polynomials of the
    mesh for the peers) is not timed, nor the factors that one wear state keeps for all its neighbours. The
    error is that of the worse of both.
    """

    def rung_of(steps: int) -> Rung:
        vibration = problem.with_steps(steps, Periodic())
        response, near = problem.solve(vibration), problem.solve(vibration, kinds=problem.near)
        both = response, problem.solve(vibration, near)
        return Rung(
            len(response.tables.width),
            max(relative_error(problem.force_of(vibration, found), answer.force) for found in both),
            timing(lambda: problem.solve(vibration)),
            response.counts.right_hand_sides,
            timing(lambda: problem.solve(vibration, near)),
        )

    rungs = climbed(ladder, rung_of)
    return WorkPrecision("periodic", "steps_per_period", "mesh_force", "wearlab", rungs)


def integrated_curve(
    problem: Steady, answer: Reference, name: str, ladder: tuple[int, ...], method: Callable[[float], Any]
) -> WorkPrecision:
    """Return a fixed-step method over its steps, integrated until its transient is less than its error."""

    def rung_of(steps: int) -> Rung:
        settled = problem.with_steps(steps, method(SETTLED))
        error = relative_error(problem.force_of(settled, problem.solve(settled)), answer.force)
        vibration = problem.with_steps(steps, method(max(SETTLED, min(1e-2, SHARE * error))))
        return _integrated_rung(problem, answer, vibration, len(vibration.sampling.grid.width))

    rungs = climbed(ladder, rung_of, answer.disagreement)
    return WorkPrecision(name, "steps_per_period", "mesh_force", "as published", rungs, f'method = "{name}"')


def adaptive_curve(problem: Steady, answer: Reference) -> WorkPrecision:
    """Return the adaptive Runge–Kutta pair over its tolerance, on tables as fine as that needs."""
    problem.solve(problem.with_steps(STEPS[-1], RungeKutta45(relative=1.0, tolerance=1.0)))  # compiles

    def rung_of(relative: float) -> Rung:
        method = RungeKutta45(relative=relative, tolerance=max(SETTLED, SHARE * relative))
        vibration = problem.with_steps(tight_steps(problem, relative, exact=False), method)
        return _integrated_rung(problem, answer, vibration, relative)

    rungs = climbed(RELATIVE, rung_of, answer.disagreement)
    return WorkPrecision("rk45", "relative", "mesh_force", "as published", rungs, 'method = "rk45"')


def _integrated_rung(problem: Steady, answer: Reference, vibration: Any, setting: float) -> Rung:
    begun = time.perf_counter()
    response = problem.solve(vibration)
    seconds = time.perf_counter() - begun
    error = relative_error(problem.force_of(vibration, response), answer.force)
    if seconds < LONG:
        seconds = timing(lambda: problem.solve(vibration))
    return Rung(setting, error, seconds, response.counts.right_hand_sides)


def knob_curves(problem: Steady, report: Report) -> Iterator[WorkPrecision]:
    """Yield the curves of knobs that change the model: the answer of their finest rung is the truth."""
    report("profile_points")
    scene = problem.scene
    fine = scene.replace("numerics.steps_per_period", tight_steps(problem, FINE))
    truth = _solved(fine.replace("numerics.profile_points", FINEST_PROFILE))[1]
    yield _knob(fine, "numerics.profile_points", PROFILE_POINTS, truth)
    report("tolerance")
    yield _knob(scene, "numerics.tolerance", TOLERANCES, truth)
    if scene.mesh.of(scene.gears.descriptor.sections[0]).excitation.chosen == "fourier":
        report("harmonics")
        truth = _solved(with_harmonics(fine, MOST_HARMONICS))[1]
        rungs = climbed(HARMONICS, lambda count: _knob_rung(with_harmonics(fine, count), count, truth))
        fixed = "error_harmonics alike"
        yield WorkPrecision("harmonics", "stiffness_harmonics", "mesh_force", "wearlab", rungs, fixed)


def with_harmonics(scene: Scene, count: int) -> Scene:
    """Return the scene with so many harmonics of all meshes, wherever they are written."""
    wanted = {"excitation": {"stiffness_harmonics": count, "error_harmonics": count}}
    own = [name for name in mesh.OWN_MESHES if getattr(scene.mesh, name) is not None]
    return scene.replace("mesh", dict.fromkeys(own, wanted) if own else wanted)


def _knob(scene: Scene, key: str, values: tuple[float, ...], truth: Array) -> WorkPrecision:
    rungs = climbed(values, lambda value: _knob_rung(scene.replace(key, value), value, truth))
    name = key.rpartition(".")[2]
    return WorkPrecision(name, name, "mesh_force", "wearlab", rungs)


def _knob_rung(scene: Scene, setting: float, truth: Array) -> Rung:
    problem, force, response = _solved(scene)
    coupling = problem.parts.coupling
    wear = coupling.unworn()
    seconds = timing(lambda: coupling.evaluate(wear))
    return Rung(setting, relative_error(force, truth), seconds, response.counts.right_hand_sides)


def _solved(scene: Scene) -> tuple[Steady, Array, Response]:
    """Return problem, force and response; of a scene, at its own settings."""
    problem = steady(scene)
    response = problem.solve(problem.vibration)
    return problem, problem.force_of(problem.vibration, response), response


def phase_points_curve(problem: Steady, answer: Reference) -> WorkPrecision:
    """Return the error of the dynamic factor over the number of stored phases."""
    response = answer.response
    vibration = problem.with_steps(tight_steps(problem), Periodic())

    def largest(points: int) -> float:
        return float(problem.force_of(vibration, response, np.arange(points) / points).max())

    truth = largest(FINEST_PHASE)

    def rung_of(points: int) -> Rung:
        return Rung(points, abs(largest(points) / truth - 1.0), timing(lambda: largest(points)), points)

    rungs = climbed(PHASE_POINTS, rung_of)
    return WorkPrecision("phase_points", "phase_points", "dynamic_factor", "wearlab", rungs)
