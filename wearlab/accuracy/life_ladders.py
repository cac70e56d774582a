"""Work–precision curves of a life: stepping over cycles, and the knobs below it."""

from collections.abc import Callable, Iterator
from contextlib import suppress

from wearlab.accuracy.ladder import ENOUGH, Rung, WorkPrecision
from wearlab.accuracy.lives import TimedLife, Wearing, errors, lived, second_life, tight_life, wearing
from wearlab.dynamics.structure import in_registers
from wearlab.gears.specification import GearError
from wearlab.life.adaptive import Adaptive
from wearlab.life.euler import Euler
from wearlab.scene import Scene

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
    known = tight_life(problem)
    other = second_life(problem, known.cycle)
    return tuple(life_curves(scene, problem, known, report)), max(errors(other, known))


def life_curves(scene: Scene, problem: Wearing, known: TimedLife, report: Report) -> Iterator[WorkPrecision]:
    """Yield the curves, each for the life and for the wear depth at its end."""
    report("life, cycle_tolerance")
    ours = [(tolerance, lived(problem, Adaptive(), tolerance)) for tolerance in CYCLE_TOLERANCES]
    yield from _both("adaptive", "cycle_tolerance", "wearlab", ours, known)
    report("life, Euler thresholds")
    deepest = float(known.depth.max())
    published = []
    for parts in EULER_PARTS:
        published.append((deepest / parts, lived(problem, Euler(deepest / parts), TOLERANCES[1])))
        if published[-1][1].seconds > ENOUGH:
            break
    yield from _both("Euler", "threshold", "as published", published, known, 'step.method = "euler"')
    finest = finest_settings(problem)
    truth = lived(wearing(_with(scene, finest)), Adaptive(), STEADY)
    knobs = [("numerics.profile_points", PROFILE_POINTS), ("numerics.tolerance", TOLERANCES)]
    if scene.dynamics is not None:
        knobs.insert(1, ("numerics.steps_per_period", STEPS))
    for key, values in knobs:
        report(f"life, {key.rpartition('.')[2]}")
        yield from _knob(scene, key, values, finest, truth)


def finest_settings(problem: Wearing) -> dict[str, int]:
    """Return the settings of the knobs that are not turned."""
    vibration = problem.parts.vibration
    exact = vibration is not None and not in_registers(vibration.system)
    steps = FINEST_EXACT_STEPS if exact else FINEST_STEPS
    return {"numerics.profile_points": FINEST_PROFILE, "numerics.steps_per_period": steps}


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
        turned = (scene if alone else _with(scene, finest)).replace(key, value)
        with suppress(GearError):  # so few steps are refused
            cells.append(
                (float(value), lived(wearing(turned), Adaptive(), float(value) if alone else STEADY))
            )
    counts = "wear_depth" if wearing(scene).limits.depth is None else "life"
    yield from (c for c in _both(name, name, "wearlab", cells, truth) if c.quantity == counts)


def _with(scene: Scene, values: dict[str, int]) -> Scene:
    for key, value in values.items():
        scene = scene.replace(key, value)
    return scene


def _both(
    name: str, knob: str, role: str, pairs: list[tuple[float, TimedLife]], known: TimedLife, fixed: str = ""
) -> Iterator[WorkPrecision]:
    for index, quantity in enumerate(("life", "wear_depth")):
        rungs = tuple(
            Rung(setting, errors(solved, known)[index], solved.seconds, solved.analyses)
            for setting, solved in pairs
        )
        if any(rung.error > ROUND_OFF for rung in rungs):
            yield WorkPrecision(name, knob, quantity, role, rungs, fixed)  # type: ignore[arg-type]
