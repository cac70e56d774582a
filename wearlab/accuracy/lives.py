"""A life as a problem: how long the flanks last, and how worn they are, at given settings."""

import time
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from wearlab.accuracy.ladder import timing
from wearlab.arrays import Array, Index
from wearlab.life.adaptive import Adaptive
from wearlab.life.counted import CountedRate
from wearlab.life.history import SetRate
from wearlab.life.limits import Limits
from wearlab.life.march import Method, evolve
from wearlab.life.record import Life
from wearlab.scene import Scene
from wearlab.scene.build import Parts, build
from wearlab.scene.build.wear import build_limits
from wearlab.simulation.run import initial_wear
from wearlab.simulation.twins import flank_of_nodes

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
    saw_tooth : whether steps were longer than the stability limit
    """

    cycle: float
    depth: Array
    flank: Index
    analyses: int
    seconds: float
    saw_tooth: bool


def wearing(scene: Scene) -> Wearing:
    """Build the life of a scene."""
    parts = build(scene)
    wear = parts.coupling.flat(initial_wear(scene, parts))
    return Wearing(parts, wear, build_limits(scene, parts.gears, parts.coupling))


def has_life(scene: Scene) -> bool:
    """Whether a scene wears until something."""
    return scene.wear is not None and scene.wear.until is not None and scene.wear.coefficient is not None


def lived(problem: Wearing, method: Method, tolerance: float) -> TimedLife:
    """Return the life by a method of stepping over cycles, timed a few times where it is short."""
    begun = time.perf_counter()
    life = _evolved(problem, method, tolerance)
    seconds = time.perf_counter() - begun
    if seconds < SHORT:
        seconds = timing(lambda: _evolved(problem, method, tolerance))
    return TimedLife(
        float(life.cycle[-1]),
        life.depth[-1],
        flank_of_nodes(problem.parts),
        life.count_rate_evaluations,
        seconds,
        life.saw_tooth,
    )


def _evolved(problem: Wearing, method: Method, tolerance: float) -> Life:
    return evolve(
        SetRate(problem.parts.coupling),
        problem.wear,
        limits=problem.limits,
        method=method,
        tolerance=tolerance,
        most_evaluations=MOST_ANALYSES,
    )


def tight_life(problem: Wearing) -> TimedLife:
    """Return the life to about ``TIGHT``, by the default method."""
    return lived(problem, Adaptive(), TIGHT)


def second_life(problem: Wearing, end: float) -> TimedLife:
    """Return the life by SciPy's DOP853, which shares no step with ours.

    Parameters
    ----------
    problem : the life
    end : a guess of its end [1]
    """
    begun = time.perf_counter()
    rate = CountedRate(SetRate(problem.parts.coupling), MOST_ANALYSES)
    scale = float(problem.limits.depth or 1e-6)
    longest = problem.limits.cycles or 3.0 * end

    def reaches_depth(cycle: float, depth: Array) -> float:
        return float(depth[problem.limits.flank].max()) - (problem.limits.depth or np.inf)

    reaches_depth.terminal = True  # type: ignore[attr-defined]
    solution = solve_ivp(
        lambda cycle, depth: rate(np.maximum(depth, 0.0)), (0.0, longest), problem.wear,
        method="DOP853", rtol=SECOND_METHOD, atol=SECOND_METHOD * scale, first_step=1e-4 * end,
        events=reaches_depth if problem.limits.depth is not None else None,
    )  # fmt: skip
    return TimedLife(
        float(solution.t[-1]),
        solution.y[:, -1],
        flank_of_nodes(problem.parts),
        rate.count,
        time.perf_counter() - begun,
        saw_tooth=False,
    )


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
