"""The life of a scene as a problem, integrated by wearlab and by a second method."""

import time
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from wearlab import assembly
from wearlab.accuracy.ladder import timing
from wearlab.arrays import Array, Index
from wearlab.life import history, integrate
from wearlab.life.limits import CountedRate, Limits
from wearlab.life.step import Method
from wearlab.scene import Scene
from wearlab.simulation import companion_runs, initial_wear

SECOND_TOLERANCE = 1e-8
"""Relative tolerance of the second method, SciPy's DOP853."""
MAX_ANALYSES = 200_000
SHORT_LIFE = 0.5
"""A life that takes less is timed a few times [s]."""


class WearProblem(NamedTuple):
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
    seconds : processor time [s]
    """

    cycle: float
    depth: Array
    flank: Index
    analyses: int
    seconds: float


def wear_problem(scene: Scene) -> WearProblem:
    """Build the life of a scene.

    Parameters
    ----------
    scene : that wears, see `has_life`
    """
    parts = assembly.build(scene)
    wear = parts.coupling.flat(initial_wear.initial_wear(scene, parts))
    limits = assembly.life.build_limits(scene, parts.gears, parts.coupling)
    return WearProblem(parts, wear, limits)


def has_life(scene: Scene) -> bool:
    """Whether a scene wears until something."""
    return (
        scene.wear is not None
        and scene.wear.until is not None
        and scene.wear.coefficient is not None
    )


def integrated_life(
    problem: WearProblem, method: Method, tolerance: float
) -> TimedLife:
    """Return the life by a method of stepping over cycles.

    It is timed a few times where it is short.

    Parameters
    ----------
    problem : the life
    method : of stepping over cycles
    tolerance : relative tolerance of the steps [1]
    """

    def integrate_once() -> integrate.Life:
        return integrate.integrate(
            history.SetRate(problem.parts.coupling),
            problem.wear,
            limits=problem.limits,
            method=method,
            tolerance=tolerance,
            max_evaluations=MAX_ANALYSES,
        )

    begin = time.process_time()
    life = integrate_once()
    seconds = time.process_time() - begin
    if seconds < SHORT_LIFE:
        seconds = timing(integrate_once)

    return TimedLife(
        cycle=float(life.cycle[-1]),
        depth=life.depth[-1],
        flank=companion_runs.flank_of_nodes(problem.parts),
        analyses=life.count_rate_evaluations,
        seconds=seconds,
    )


def second_life(problem: WearProblem, end: float) -> TimedLife:
    """Return the life by SciPy's DOP853, which shares no step with ours.

    Parameters
    ----------
    problem : the life
    end : a guess of its end [1]
    """
    begin = time.process_time()
    limits = problem.limits
    rate = CountedRate(history.SetRate(problem.parts.coupling), MAX_ANALYSES)
    scale = float(limits.depth or 1e-6)
    longest = limits.cycles or 3.0 * end

    def reaches_depth(cycle: float, depth: Array) -> float:
        return float(depth[limits.flank].max()) - (limits.depth or np.inf)

    reaches_depth.terminal = True  # type: ignore[attr-defined]

    def rate_at(cycle: float, depth: Array) -> Array:
        worn = np.maximum(depth, 0.0)
        found = rate(worn)
        rate.accept(worn)
        return found

    solution = solve_ivp(
        rate_at,
        (0.0, longest),
        problem.wear,
        method="DOP853",
        rtol=SECOND_TOLERANCE,
        atol=SECOND_TOLERANCE * scale,
        first_step=1e-4 * end,
        events=reaches_depth if limits.depth is not None else None,
    )
    flank = companion_runs.flank_of_nodes(problem.parts)
    return TimedLife(
        cycle=float(solution.t[-1]),
        depth=solution.y[:, -1],
        flank=flank,
        analyses=rate.count,
        seconds=time.process_time() - begin,
    )


def errors(life: TimedLife, reference: TimedLife) -> tuple[float, float]:
    """Return the relative errors of the life and of the wear depth at its end [1].

    On other nodes only the deepest point of each flank is compared.

    Parameters
    ----------
    life : whose errors are asked for
    reference : the answer
    """
    depth = life.depth
    exact = reference.depth
    if depth.shape != exact.shape:
        depth = _deepest(life)
        exact = _deepest(reference)

    life_error = abs(life.cycle / reference.cycle - 1.0)
    depth_error = float(np.abs(depth - exact).max() / exact.max())
    return life_error, depth_error


def _deepest(life: TimedLife) -> Array:
    """Return the largest wear depth of every flank [m]."""
    flanks = np.unique(life.flank)
    return np.array([life.depth[life.flank == flank].max() for flank in flanks])
