"""Work–precision curves of a life: its steps over cycles, and the knobs below them."""

from collections.abc import Callable, Iterator
from contextlib import suppress

from wearlab.accuracy.ladder import LONGEST_RUNG, Role, Rung, WorkPrecision
from wearlab.accuracy.life import (
    TimedLife,
    WearProblem,
    errors,
    integrated_life,
    second_life,
    wear_problem,
)
from wearlab.dynamics.integrators.kernel import is_small
from wearlab.gears.specification import GearError
from wearlab.life import adaptive, euler
from wearlab.scene import Scene

CYCLE_TOLERANCES = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5)
EULER_PARTS = (5, 10, 20, 40, 80, 160, 320, 640, 1280, 2560)
"""Largest depth at the end over Euler's threshold."""
KNOBS = {
    "numerics.profile_points": (25, 51, 101, 201, 401),
    "numerics.steps_per_period": (32, 64, 128, 256, 512),
    "numerics.tolerance": (1e-2, 1e-3, 1e-4, 1e-5),
}
"""Knobs below the steps over cycles."""
ROUND_OFF = 1e-12
"""A life without larger errors is known exactly: where it ends, the wear does not
change its own rate."""
REFERENCE_TOLERANCE = 3e-8
"""Cycle tolerance of the reference."""
FINE_TOLERANCE = 3e-6
"""Cycle tolerance while other knobs are turned."""


def life_study(
    scene: Scene, report: Callable[[str], None]
) -> tuple[tuple[WorkPrecision, ...], float]:
    """Return the curves of a scene's life, and how far a second method is off [1].

    Parameters
    ----------
    scene : that wears, see `wearlab.accuracy.life.has_life`
    report : called with the name of the curve that comes next
    """
    report("life, reference")
    problem = wear_problem(scene)
    answer = integrated_life(problem, adaptive.Adaptive(), REFERENCE_TOLERANCE)
    second = second_life(problem, answer.cycle)
    curves = tuple(life_curves(scene, problem, answer, report))
    return curves, max(errors(second, answer))


def life_curves(
    scene: Scene,
    problem: WearProblem,
    answer: TimedLife,
    report: Callable[[str], None],
) -> Iterator[WorkPrecision]:
    """Yield the curves, each for the life and for the wear depth at its end.

    Parameters
    ----------
    scene, problem : the scene, and its life
    answer : the reference
    report : called with the name of the curve that comes next
    """
    yield from method_curves(problem, answer, report)

    finest = _finest_settings(problem)
    finest_problem = wear_problem(scene.replace(finest))
    truth = integrated_life(finest_problem, adaptive.Adaptive(), FINE_TOLERANCE)
    for key, values in KNOBS.items():
        if scene.dynamics is not None or key != "numerics.steps_per_period":
            report(f"life, {key.rpartition('.')[2]}")
            yield from _knob_of_life(scene, key, values, finest, truth)


def method_curves(
    problem: WearProblem, answer: TimedLife, report: Callable[[str], None]
) -> Iterator[WorkPrecision]:
    """Yield the curves of adaptive steps and of Euler's, for the life and the depth.

    Parameters
    ----------
    problem : the life
    answer : the reference
    report : called with the name of the curve that comes next
    """
    report("life, cycle_tolerance")
    adaptive_lives = [
        (tolerance, integrated_life(problem, adaptive.Adaptive(), tolerance))
        for tolerance in CYCLE_TOLERANCES
    ]
    yield from _curves_of(
        "adaptive", "cycle_tolerance", "wearlab", adaptive_lives, answer
    )

    report("life, Euler thresholds")
    euler_lives = _euler_lives(problem, answer)
    fixed = 'step.method = "euler"'
    yield from _curves_of(
        "Euler", "threshold", "as published", euler_lives, answer, fixed
    )


def _euler_lives(
    problem: WearProblem, answer: TimedLife
) -> list[tuple[float, TimedLife]]:
    """Return Euler's thresholds and lives, until one takes long."""
    deepest = float(answer.depth.max())
    lives: list[tuple[float, TimedLife]] = []
    for parts in EULER_PARTS:
        threshold = deepest / parts
        life = integrated_life(problem, euler.Euler(threshold), 1e-3)
        lives.append((threshold, life))
        if life.seconds > LONGEST_RUNG:
            break
    return lives


def _finest_settings(problem: WearProblem) -> dict[str, int]:
    """Return nodes and steps of the reference of the knobs.

    Steps are of order four, in large systems of order nine.
    """
    vibration = problem.parts.vibration
    exact = vibration is not None and not is_small(vibration.system)
    return {
        "numerics.profile_points": 801,
        "numerics.steps_per_period": 768 if exact else 2048,
    }


def _knob_of_life(
    scene: Scene,
    key: str,
    values: tuple[float, ...],
    finest: dict[str, int],
    truth: TimedLife,
) -> Iterator[WorkPrecision]:
    """Yield the curve of a knob that changes the rate of wear.

    All other knobs are at their finest. The tolerance moves all the others, as it does
    in a run. What ends the life is exact: the error of the other quantity counts.
    """
    name = key.rpartition(".")[2]
    lives = []
    for value in values:
        fixed = {} if name == "tolerance" else finest
        with suppress(GearError):  # so few steps are refused
            problem = wear_problem(scene.replace({**fixed, key: value}))
            tolerance = float(value) if name == "tolerance" else FINE_TOLERANCE
            life = integrated_life(problem, adaptive.Adaptive(), tolerance)
            lives.append((float(value), life))

    ends_by_cycles = wear_problem(scene).limits.depth is None
    quantity = "wear_depth" if ends_by_cycles else "life"
    for curve in _curves_of(name, name, "wearlab", lives, truth):
        if curve.quantity == quantity:
            yield curve


def _curves_of(
    name: str,
    knob: str,
    role: Role,
    lives: list[tuple[float, TimedLife]],
    answer: TimedLife,
    fixed: str = "",
) -> Iterator[WorkPrecision]:
    """Yield the curves of life and wear depth of settings and their lives.

    A quantity that is exact at every setting has none.
    """
    for index, quantity in enumerate(("life", "wear_depth")):
        rungs = tuple(
            Rung(setting, errors(life, answer)[index], life.seconds, life.analyses)
            for setting, life in lives
        )
        if any(rung.error > ROUND_OFF for rung in rungs):
            yield WorkPrecision(name, knob, quantity, role, rungs, fixed)
