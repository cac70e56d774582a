"""Work-precision curves of a scene: of its steady state and of its life.

Of a steady state every knob, every named method and every peer; of a life the steps
over cycles, and the knobs below them.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from copy import copy
from functools import partial
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from wearlab import assembly
from wearlab.accuracy.equation import CyRKIntegrator, starting_state
from wearlab.accuracy.ladder import (
    ENOUGH,
    LONG,
    SHARE,
    Rung,
    WorkPrecision,
    climbed,
    timing,
)
from wearlab.accuracy.steady import (
    Reference,
    Steady,
    relative_error,
    steady,
    stiffest_meshes,
    tight_steps,
)
from wearlab.arrays import Array, Index
from wearlab.dynamics.integrators import count, kernel
from wearlab.dynamics.methods.newmark import Newmark
from wearlab.dynamics.methods.rk4 import RungeKutta4
from wearlab.dynamics.methods.rk45 import RungeKutta45
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.response import Response
from wearlab.gears.specification import GearError
from wearlab.life import adaptive, euler, history, integrate
from wearlab.life.limits import CountedRate, Limits
from wearlab.life.step import Method
from wearlab.scene import Scene, mesh
from wearlab.simulation import companion_runs, life_run

METHODS = ("RK45", "TSIT5", "VERN7", "DOP853")
PEER_TOLERANCES = tuple(10.0 ** -np.arange(3.0, 9.5, 1.0))
LONGEST = 10.0
"""An integration that would take longer is not begun [s]."""


def peers() -> tuple[str, ...]:
    """Return the names of the methods of CyRK, if it is installed.

    Each lands on every known jump.
    """
    return (
        ()
        if missing_peers()
        else tuple(f"CyRK {method}, landing" for method in METHODS)
    )


def missing_peers() -> tuple[str, ...]:
    """Return the peers that are not installed (``pip install wearlab[peers]``)."""
    return () if find_spec("CyRK") is not None else ("CyRK",)


def peer_curves(
    problem: Steady, answer: Reference, report: Callable[[str], None]
) -> Iterator[WorkPrecision]:
    """Yield the curves of the peers over their relative tolerance, where a transient dies in time.

    Parameters
    ----------
    problem, answer : the scene and its answer
    report : told who comes next
    """
    system = answer.response.system
    tables = answer.response.tables
    start = starting_state(
        system, np.einsum("s,sm->m", tables.width, tables.stiffness.sum(axis=3)[:, 1])
    )
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
    """Return the mesh periods until so much is left of a transient.

    Infinite where it does not die.
    """
    largest = answer.multiplier ** (1.0 / len(answer.force))
    return (
        float(np.ceil(np.log(left) / np.log(largest)))
        if 0.0 < largest < 1.0
        else float("inf")
    )


def _rung(
    peer: CyRKIntegrator,
    problem: Steady,
    answer: Reference,
    tolerance: float,
    start: Array,
) -> Rung | None:
    """Return a setting of a peer, None where its integration would take too long."""
    scale = np.abs(answer.response.state).max(axis=(0, 1))
    periods = periods_to(answer, SHARE * tolerance)
    for _ in range(2):  # the first compiles
        begun = time.perf_counter()
        peer.integrate(answer.start, 1, tolerance, scale)
    if periods * (time.perf_counter() - begun) > LONGEST:
        return None
    settling = int(periods)
    settled = peer.integrate(start, settling, tolerance, scale)
    if not np.isfinite(settled).all():
        return Rung(tolerance, float("inf"), float("nan"), float("nan"))
    motion = peer.states(settled, len(answer.force), problem.phase, tolerance, scale)
    seconds = timing(
        lambda: peer.integrate(start, settling + len(answer.force), tolerance, scale)
    )
    error = relative_error(problem.force_of_states(motion), answer.force)
    return Rung(tolerance, error, seconds, float("nan"))


STEPS = (
    8,
    12,
    16,
    20,
    24,
    28,
    32,
    36,
    40,
    44,
    48,
    56,
    64,
    96,
    128,
    192,
    256,
    384,
    448,
    512,
    640,
    768,
    1024,
)
INTEGRATED_STEPS = tuple(2**power for power in range(5, 16))
RELATIVE = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
PROFILE_POINTS = (25, 51, 101, 201, 401, 801, 1601)
PHASE_POINTS = (8, 16, 32, 64, 128, 256, 512)
HARMONICS = (1, 2, 3, 5, 8, 12, 20, 40)
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
FINE = 2.5e-8
"""Error of the steps while other knobs are turned."""
SETTLED = 1e-10

Report = Callable[[str], None]


def steady_curves(
    problem: Steady, answer: Reference, report: Report
) -> Iterator[WorkPrecision]:
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
    turn = (
        count.fastest_rate(problem.vibration.system, stiffest_meshes(problem))
        * problem.vibration.period
    )
    # RK4 is stable while its steps turn the fastest mode by less than 2.78 rad
    stable = tuple(steps for steps in INTEGRATED_STEPS if turn / steps < 2.78)
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
    """Return our default method over its steps: cold, tables included, and warm from a neighbour.

    What a scene prepares once for all its wear states (the look-up of the stages here,
    the polynomials of the mesh for the peers) is not timed, nor the factors that one
    wear state keeps for all its neighbours. The error is that of the worse of both.
    """

    def rung_of(steps: int) -> Rung:
        vibration = problem.with_steps(steps, Periodic())
        response = problem.solve(vibration)
        near = problem.solve(vibration, kinds=problem.near)
        both = response, problem.solve(vibration, near)
        error = max(
            relative_error(problem.force_of(vibration, found), answer.force)
            for found in both
        )
        cold = timing(lambda: problem.solve(vibration))
        warm = timing(lambda: problem.solve(vibration, near))
        return Rung(
            len(response.tables.width),
            error,
            cold,
            response.counts.right_hand_sides,
            warm,
        )

    rungs = climbed(ladder, rung_of)
    return WorkPrecision("periodic", "steps_per_period", "mesh_force", "wearlab", rungs)


def integrated_curve(
    problem: Steady,
    answer: Reference,
    name: str,
    ladder: tuple[int, ...],
    method: Callable[[float], Any],
) -> WorkPrecision:
    """Return a fixed-step method over its steps, integrated until its transient is less than its error."""

    def rung_of(steps: int) -> Rung:
        settled = problem.with_steps(steps, method(SETTLED))
        error = relative_error(
            problem.force_of(settled, problem.solve(settled)), answer.force
        )
        vibration = problem.with_steps(
            steps, method(max(SETTLED, min(1e-2, SHARE * error)))
        )
        return _integrated_rung(
            problem, answer, vibration, len(vibration.sampling.grid.width)
        )

    rungs = climbed(ladder, rung_of, answer.disagreement)
    return WorkPrecision(
        name,
        "steps_per_period",
        "mesh_force",
        "as published",
        rungs,
        f'method = "{name}"',
    )


def adaptive_curve(problem: Steady, answer: Reference) -> WorkPrecision:
    """Return the adaptive Runge–Kutta pair over its tolerance, on tables as fine as that needs."""
    problem.solve(
        problem.with_steps(STEPS[-1], RungeKutta45(relative=1.0, tolerance=1.0))
    )  # compiles

    def rung_of(relative: float) -> Rung:
        method = RungeKutta45(
            relative=relative, tolerance=max(SETTLED, SHARE * relative)
        )
        vibration = problem.with_steps(
            tight_steps(problem, relative, exact=False), method
        )
        return _integrated_rung(problem, answer, vibration, relative)

    rungs = climbed(RELATIVE, rung_of, answer.disagreement)
    return WorkPrecision(
        "rk45", "relative", "mesh_force", "as published", rungs, 'method = "rk45"'
    )


def _integrated_rung(
    problem: Steady, answer: Reference, vibration: Any, setting: float
) -> Rung:
    response, seconds = _timed(lambda: problem.solve(vibration), LONG)
    error = relative_error(problem.force_of(vibration, response), answer.force)
    return Rung(setting, error, seconds, response.counts.right_hand_sides)


def _timed(action: Callable[[], Any], long: float) -> tuple[Any, float]:
    """Return what an action returns and its wall time, of several where one is not ``long`` [s]."""
    begun = time.perf_counter()
    found = action()
    seconds = time.perf_counter() - begun
    return found, timing(action) if seconds < long else seconds


def knob_curves(problem: Steady, report: Report) -> Iterator[WorkPrecision]:
    """Yield the curves of knobs that change the model: the answer of their finest rung is the truth."""
    report("profile_points")
    scene = problem.scene
    fine = scene.replace("numerics.steps_per_period", tight_steps(problem, FINE))
    truth = _solved(fine.replace("numerics.profile_points", 3201))[1]
    yield _knob(fine, "numerics.profile_points", PROFILE_POINTS, truth)
    report("tolerance")
    yield _knob(scene, "numerics.tolerance", TOLERANCES, truth)
    if scene.mesh.of(scene.gears.descriptor.sections[0]).excitation.chosen == "fourier":
        report("harmonics")
        truth = _solved(with_harmonics(fine, 160))[1]
        rungs = climbed(
            HARMONICS,
            lambda count: _knob_rung(with_harmonics(fine, count), count, truth),
        )
        fixed = "error_harmonics alike"
        yield WorkPrecision(
            "harmonics", "stiffness_harmonics", "mesh_force", "wearlab", rungs, fixed
        )


def with_harmonics(scene: Scene, count: int) -> Scene:
    """Return the scene with so many harmonics of all meshes, wherever they are written."""
    wanted = {"excitation": {"stiffness_harmonics": count, "error_harmonics": count}}
    own = [name for name in mesh.OWN_MESHES if getattr(scene.mesh, name) is not None]
    return scene.replace("mesh", dict.fromkeys(own, wanted) if own else wanted)


def _knob(
    scene: Scene, key: str, values: tuple[float, ...], truth: Array
) -> WorkPrecision:
    rungs = climbed(
        values, lambda value: _knob_rung(scene.replace(key, value), value, truth)
    )
    name = key.rpartition(".")[2]
    return WorkPrecision(name, name, "mesh_force", "wearlab", rungs)


def _knob_rung(scene: Scene, setting: float, truth: Array) -> Rung:
    problem, force, response = _solved(scene)
    coupling = problem.parts.coupling
    wear = coupling.unworn()
    seconds = timing(lambda: coupling.evaluate(wear))
    return Rung(
        setting, relative_error(force, truth), seconds, response.counts.right_hand_sides
    )


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
        return float(
            problem.force_of(vibration, response, np.arange(points) / points).max()
        )

    truth = largest(8192)

    def rung_of(points: int) -> Rung:
        return Rung(
            points,
            abs(largest(points) / truth - 1.0),
            timing(lambda: largest(points)),
            points,
        )

    rungs = climbed(PHASE_POINTS, rung_of)
    return WorkPrecision(
        "phase_points", "phase_points", "dynamic_factor", "wearlab", rungs
    )


SECOND_METHOD = 1e-8
MOST_ANALYSES = 200_000


class Wearing(NamedTuple):
    """A scene that wears.

    Parameters
    ----------
    parts : its physics
    wear : (n_entries,) wear of all flanks at cycle 0 [m]
    limits : where the life ends
    """

    parts: assembly.GearModel
    wear: Array
    limits: Limits


class TimedLife(NamedTuple):
    """One life.

    Parameters
    ----------
    cycle : its end [1]
    depth : (n_entries,) wear depth there [m]
    flank : (n_entries,) which flank each entry is on
    analyses : contact analyses it took
    seconds : wall time [s]
    """

    cycle: float
    depth: Array
    flank: Index
    analyses: int
    seconds: float


def wearing(scene: Scene) -> Wearing:
    """Build the life of a scene."""
    parts = assembly.build(scene)
    wear = parts.coupling.flat(life_run.initial_wear(scene, parts))
    return Wearing(
        parts, wear, assembly.wear.build_limits(scene, parts.gears, parts.coupling)
    )


def has_life(scene: Scene) -> bool:
    """Whether a scene wears until something."""
    return (
        scene.wear is not None
        and scene.wear.until is not None
        and scene.wear.coefficient is not None
    )


def lived(problem: Wearing, method: Method, tolerance: float) -> TimedLife:
    """Return the life by a method of stepping over cycles, timed a few times where it is short."""
    given: Any = {"limits": problem.limits, "method": method, "tolerance": tolerance}
    given["max_evaluations"] = MOST_ANALYSES

    def evolved() -> integrate.Life:
        return integrate.integrate(
            history.SetRate(problem.parts.coupling), problem.wear, **given
        )

    life, seconds = _timed(evolved, 0.5)
    flank = companion_runs.flank_of_nodes(problem.parts)
    return TimedLife(
        float(life.cycle[-1]),
        life.depth[-1],
        flank,
        life.count_rate_evaluations,
        seconds,
    )


def second_life(problem: Wearing, end: float) -> TimedLife:
    """Return the life by SciPy's DOP853, which shares no step with ours.

    Parameters
    ----------
    problem : the life
    end : a guess of its end [1]
    """
    begun = time.perf_counter()
    counted = CountedRate(history.SetRate(problem.parts.coupling), MOST_ANALYSES)
    scale = float(problem.limits.depth or 1e-6)
    longest = problem.limits.cycles or 3.0 * end

    def reaches_depth(cycle: float, depth: Array) -> float:
        return float(depth[problem.limits.flank].max()) - (
            problem.limits.depth or np.inf
        )

    reaches_depth.terminal = True  # type: ignore[attr-defined]
    solution = solve_ivp(
        lambda cycle, depth: counted(np.maximum(depth, 0.0)),
        (0.0, longest),
        problem.wear,
        method="DOP853",
        rtol=SECOND_METHOD,
        atol=SECOND_METHOD * scale,
        first_step=1e-4 * end,
        events=reaches_depth if problem.limits.depth is not None else None,
    )
    flank = companion_runs.flank_of_nodes(problem.parts)
    seconds = time.perf_counter() - begun
    return TimedLife(
        float(solution.t[-1]), solution.y[:, -1], flank, counted.count, seconds
    )


def errors(life: TimedLife, reference: TimedLife) -> tuple[float, float]:
    """Return the relative errors of the life and of the wear depth at its end [1].

    On other nodes only the deepest point of each flank is compared.
    """
    mine = life.depth
    exact = reference.depth
    if mine.shape != exact.shape:
        mine = _deepest(life)
        exact = _deepest(reference)
    return abs(life.cycle / reference.cycle - 1.0), float(
        np.abs(mine - exact).max() / exact.max()
    )


def _deepest(life: TimedLife) -> Array:
    """Return the largest wear depth of every flank [m]."""
    return np.array(
        [life.depth[life.flank == flank].max() for flank in np.unique(life.flank)]
    )


CYCLE_TOLERANCES = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5)
EULER_PARTS = (5, 10, 20, 40, 80, 160, 320, 640, 1280, 2560)
"""Euler's thresholds: the largest depth at the end over these."""
OF_LIVES = {
    "numerics.profile_points": (25, 51, 101, 201, 401),
    "numerics.steps_per_period": (32, 64, 128, 256, 512),
    "numerics.tolerance": (1e-2, 1e-3, 1e-4, 1e-5),
}
"""Knobs below the steps over cycles."""
ROUND_OFF = 1e-12
"""A life without larger errors is known exactly: where it ends, the wear does not
change its own rate."""
UNMOVED = 3e-6
"""Cycle tolerance while other knobs are turned."""


def life_study(scene: Scene, report: Report) -> tuple[tuple[WorkPrecision, ...], float]:
    """Return the curves of a scene's life, and how far a second method is from their reference [1]."""
    report("life, reference")
    problem = wearing(scene)
    answer = lived(problem, adaptive.Adaptive(), 3e-8)
    other = second_life(problem, answer.cycle)
    return tuple(life_curves(scene, problem, answer, report)), max(
        errors(other, answer)
    )


def life_curves(
    scene: Scene, problem: Wearing, answer: TimedLife, report: Report
) -> Iterator[WorkPrecision]:
    """Yield the curves, each for the life and for the wear depth at its end."""
    report("life, cycle_tolerance")
    ours = [
        (tolerance, lived(problem, adaptive.Adaptive(), tolerance))
        for tolerance in CYCLE_TOLERANCES
    ]
    yield from _both("adaptive", "cycle_tolerance", "wearlab", ours, answer)
    report("life, Euler thresholds")
    deepest = float(answer.depth.max())
    published = []
    for parts in EULER_PARTS:
        published.append(
            (deepest / parts, lived(problem, euler.Euler(deepest / parts), 1e-3))
        )
        if published[-1][1].seconds > ENOUGH:
            break
    yield from _both(
        "Euler", "threshold", "as published", published, answer, 'step.method = "euler"'
    )
    vibration = problem.parts.vibration
    exact = vibration is not None and not kernel.is_small(vibration.system)
    # steps of order four, and of order nine in large systems
    finest = {
        "numerics.profile_points": 801,
        "numerics.steps_per_period": 768 if exact else 2048,
    }
    truth = lived(wearing(scene.replace(finest)), adaptive.Adaptive(), UNMOVED)
    for key, values in OF_LIVES.items():
        if scene.dynamics is not None or key != "numerics.steps_per_period":
            report(f"life, {key.rpartition('.')[2]}")
            yield from _knob_of_life(scene, key, values, finest, truth)


def _knob_of_life(
    scene: Scene,
    key: str,
    values: tuple[float, ...],
    finest: dict[str, int],
    truth: TimedLife,
) -> Iterator[WorkPrecision]:
    """Yield the curve of a knob that changes the rate of wear itself, all others at their finest.

    The tolerance moves all the others, as it does in a run. What ends the life is
    exact, the other counts.
    """
    name = key.rpartition(".")[2]
    cells = []
    for value in values:
        finer = {} if name == "tolerance" else finest
        with suppress(GearError):  # so few steps are refused
            problem = wearing(scene.replace({**finer, key: value}))
            steps = float(value) if name == "tolerance" else UNMOVED
            cells.append((float(value), lived(problem, adaptive.Adaptive(), steps)))
    counts = "wear_depth" if wearing(scene).limits.depth is None else "life"
    yield from (
        c for c in _both(name, name, "wearlab", cells, truth) if c.quantity == counts
    )


def _both(
    name: str,
    knob: str,
    role: str,
    pairs: list[tuple[float, TimedLife]],
    answer: TimedLife,
    fixed: str = "",
) -> Iterator[WorkPrecision]:
    for index, quantity in enumerate(("life", "wear_depth")):
        rungs = tuple(
            Rung(at, errors(one, answer)[index], one.seconds, one.analyses)
            for at, one in pairs
        )
        if any(rung.error > ROUND_OFF for rung in rungs):
            yield WorkPrecision(name, knob, quantity, role, rungs, fixed)  # type: ignore[arg-type]
