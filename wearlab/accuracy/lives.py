"""A life as a problem, and its work-precision curves: steps over cycles, and the knobs below them."""

import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from wearlab.accuracy.ladder import ENOUGH, Rung, WorkPrecision, timing
from wearlab.arrays import Array, Index
from wearlab.dynamics.steps.kernel import is_small
from wearlab.gears.specification import GearError
from wearlab.life import adaptive, euler, history, integrate, record
from wearlab.life.limits import CountedRate, Limits
from wearlab.scene import Scene
from wearlab.scene.build import Parts, build
from wearlab.scene.build.wear import build_limits
from wearlab.simulation import living, twins

TIGHT = 3e-8
SECOND_METHOD = 1e-8
MOST_ANALYSES = 200_000
SHORT = 0.5
"""A life that takes longer is timed once [s]."""


class Wearing(NamedTuple):
    """A scene that wears.

    Parameters
    ----------
    parts : its physics
    wear : (n_entries,) wear of all flanks at cycle 0 [m]
    limits : where the life ends
    """

    parts: Parts
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
    parts = build(scene)
    wear = parts.coupling.flat(living.initial_wear(scene, parts))
    return Wearing(parts, wear, build_limits(scene, parts.gears, parts.coupling))


def has_life(scene: Scene) -> bool:
    """Whether a scene wears until something."""
    return scene.wear is not None and scene.wear.until is not None and scene.wear.coefficient is not None


def lived(problem: Wearing, method: integrate.Method, tolerance: float) -> TimedLife:
    """Return the life by a method of stepping over cycles, timed a few times where it is short."""
    begun = time.perf_counter()
    life = _evolved(problem, method, tolerance)
    seconds = time.perf_counter() - begun
    if seconds < SHORT:
        seconds = timing(lambda: _evolved(problem, method, tolerance))
    flank = twins.flank_of_nodes(problem.parts)
    return TimedLife(float(life.cycle[-1]), life.depth[-1], flank, life.count_rate_evaluations, seconds)


def _evolved(problem: Wearing, method: integrate.Method, tolerance: float) -> record.Life:
    return integrate.integrate(
        history.SetRate(problem.parts.coupling),
        problem.wear,
        limits=problem.limits,
        method=method,
        tolerance=tolerance,
        most_evaluations=MOST_ANALYSES,
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
        return float(depth[problem.limits.flank].max()) - (problem.limits.depth or np.inf)

    reaches_depth.terminal = True  # type: ignore[attr-defined]
    solution = solve_ivp(
        lambda cycle, depth: counted(np.maximum(depth, 0.0)), (0.0, longest), problem.wear,
        method="DOP853", rtol=SECOND_METHOD, atol=SECOND_METHOD * scale, first_step=1e-4 * end,
        events=reaches_depth if problem.limits.depth is not None else None,
    )  # fmt: skip
    flank, seconds = twins.flank_of_nodes(problem.parts), time.perf_counter() - begun
    return TimedLife(float(solution.t[-1]), solution.y[:, -1], flank, counted.count, seconds)


def errors(life: TimedLife, reference: TimedLife) -> tuple[float, float]:
    """Return the relative errors of the life and of the wear depth at its end [1].

    On other nodes only the deepest point of each flank is compared.
    """
    mine, exact = life.depth, reference.depth
    if mine.shape != exact.shape:
        mine, exact = _deepest(life), _deepest(reference)
    depth = np.abs(mine - exact).max() / exact.max()
    return abs(life.cycle / reference.cycle - 1.0), float(depth)


def _deepest(life: TimedLife) -> Array:
    """Return the largest wear depth of every flank [m]."""
    return np.array([life.depth[life.flank == flank].max() for flank in np.unique(life.flank)])


CYCLE_TOLERANCES = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5)
EULER_PARTS = (5, 10, 20, 40, 80, 160, 320, 640, 1280, 2560)
"""Euler's thresholds: the largest depth at the end over these."""
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5)
PROFILE_POINTS = (25, 51, 101, 201, 401)
STEPS = (32, 64, 128, 256, 512)
ROUND_OFF = 1e-12
"""A life without larger errors is known exactly: where it ends, the wear does not change its own rate."""
STEADY = 3e-6
"""Cycle tolerance while other knobs are turned."""
FINEST_PROFILE = 801
FINEST_STEPS, FINEST_EXACT_STEPS = 2048, 768
"""Steps of a mesh period while other knobs are turned: of order four, and of order nine in large systems."""

Report = Callable[[str], None]


def life_study(scene: Scene, report: Report) -> tuple[tuple[WorkPrecision, ...], float]:
    """Return the curves of a scene's life, and how far a second method is from their reference [1]."""
    report("life, reference")
    problem = wearing(scene)
    answer = lived(problem, adaptive.Adaptive(), TIGHT)
    other = second_life(problem, answer.cycle)
    return tuple(life_curves(scene, problem, answer, report)), max(errors(other, answer))


def life_curves(scene: Scene, problem: Wearing, answer: TimedLife, report: Report) -> Iterator[WorkPrecision]:
    """Yield the curves, each for the life and for the wear depth at its end."""
    report("life, cycle_tolerance")
    ours = [(tolerance, lived(problem, adaptive.Adaptive(), tolerance)) for tolerance in CYCLE_TOLERANCES]
    yield from _both("adaptive", "cycle_tolerance", "wearlab", ours, answer)
    report("life, Euler thresholds")
    deepest = float(answer.depth.max())
    published = []
    for parts in EULER_PARTS:
        published.append((deepest / parts, lived(problem, euler.Euler(deepest / parts), TOLERANCES[1])))
        if published[-1][1].seconds > ENOUGH:
            break
    yield from _both("Euler", "threshold", "as published", published, answer, 'step.method = "euler"')
    vibration = problem.parts.vibration
    exact = vibration is not None and not is_small(vibration.system)
    finest = {
        "numerics.profile_points": FINEST_PROFILE,
        "numerics.steps_per_period": FINEST_EXACT_STEPS if exact else FINEST_STEPS,
    }
    truth = lived(wearing(scene.replace(finest)), adaptive.Adaptive(), STEADY)
    knobs = [("numerics.profile_points", PROFILE_POINTS), ("numerics.tolerance", TOLERANCES)]
    if scene.dynamics is not None:
        knobs.insert(1, ("numerics.steps_per_period", STEPS))
    for key, values in knobs:
        report(f"life, {key.rpartition('.')[2]}")
        yield from _knob(scene, key, values, finest, truth)


def _knob(
    scene: Scene, key: str, values: tuple[float, ...], finest: dict[str, int], truth: TimedLife
) -> Iterator[WorkPrecision]:
    """Yield the curve of a knob that changes the rate of wear itself, all others at their finest.

    The tolerance moves all the others, as it does in a run. What ends the life is exact, the other counts.
    """
    name = key.rpartition(".")[2]
    cells = []
    for value in values:
        alone = name == "tolerance"
        turned = (scene if alone else scene.replace(finest)).replace(key, value)
        with suppress(GearError):  # so few steps are refused
            cells.append(
                (float(value), lived(wearing(turned), adaptive.Adaptive(), float(value) if alone else STEADY))
            )
    counts = "wear_depth" if wearing(scene).limits.depth is None else "life"
    yield from (c for c in _both(name, name, "wearlab", cells, truth) if c.quantity == counts)


def _both(
    name: str, knob: str, role: str, pairs: list[tuple[float, TimedLife]], answer: TimedLife, fixed: str = ""
) -> Iterator[WorkPrecision]:
    for index, quantity in enumerate(("life", "wear_depth")):
        rungs = tuple(
            Rung(setting, errors(solved, answer)[index], solved.seconds, solved.analyses)
            for setting, solved in pairs
        )
        if any(rung.error > ROUND_OFF for rung in rungs):
            yield WorkPrecision(name, knob, quantity, role, rungs, fixed)  # type: ignore[arg-type]
