"""How much longer steady states take whose flanks part than those whose flanks touch: one set, equally worn.

``python tests/validation/parted_time.py FILE`` takes the first case of a campaign that moves, a planetary
set, its sun and planets worn, at several speeds, under its torque and under shares of it, under which flanks
part. All at the scene's own steps, in processor time: cold over cold, and from a wear state 0.1 µm more worn
over the same, each over the median of the states at that speed whose flanks touch. It prints a line for
every state and the median and the largest ratio.
"""

import sys
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from processor_time import least

from wearlab.accuracy.steady import Steady, steady
from wearlab.scene import Scene

SPEEDS = (0.6, 0.8, 1.0, 1.3, 1.6, 2.0)
SHARES = (1.5, 1.0, 0.5, 0.3, 0.2, 0.1, 0.05, 0.02)
"""Speeds over that of the case, and torques over that of the case."""
WORN = {
    "sun": {"depth": "2 um", "shape": "quadratic"},
    "planet-sun": {"depth": "0.7 um", "shape": "quadratic"},
}


class StateTime(NamedTuple):
    """One steady state.

    Parameters
    ----------
    speed, torque : over those of the case [1]
    parts : whether a flank parts
    period : mesh periods after which it repeats, 0: it does not
    cold, warm : processor times [s]
    """

    speed: float
    torque: float
    parts: bool
    period: int
    cold: float
    warm: float


def state_time(problem: Steady, speed: float, torque: float) -> StateTime:
    """Return the times of the steady state of a problem."""
    vibration = problem.vibration
    found, near = problem.solve(vibration), problem.solve_near(vibration)
    cold = least(lambda: problem.solve(vibration))
    warm = least(lambda: problem.solve(vibration, near))
    return StateTime(speed, torque, found.counts.newton_iterations != 1, found.period, cold, warm)


def states(scene: Scene) -> Iterator[StateTime]:
    """Yield the times at all speeds and torques."""
    here, load = scene.operation.speed, scene.operation.torque
    assert here is not None and load is not None
    worn = scene.replace("wear", {"initial": WORN})
    for speed in SPEEDS:
        for share in SHARES:
            moved = worn.replace("operation.speed", f"{speed * here} rad/s")
            yield state_time(steady(moved.replace("operation.torque", f"{share * load} N*m")), speed, share)


def ratios(found: list[StateTime]) -> np.ndarray:
    """Return cold and warm times of parted states over those of touching ones at their speed, (n, 2)."""
    rows = []
    for speed in dict.fromkeys(one.speed for one in found):
        here = [one for one in found if one.speed == speed]
        touching = [(one.cold, one.warm) for one in here if not one.parts]
        parted = [(one.cold, one.warm) for one in here if one.parts]
        if touching and parted:
            rows.append(np.array(parted) / np.median(touching, axis=0))
    return np.concatenate(rows)


def main(file: str) -> None:
    """Print all states and their ratios."""
    from wearlab.campaign import load

    scene = next(case.scene for case in load(file).cases if case.scene.dynamics is not None)
    found = []
    for one in states(scene):
        found.append(one)
        what = ("parts" if one.parts else "touches") + ("" if one.period == 1 else f", period {one.period}")
        told = f"{1e3 * one.cold:8.2f} ms cold {1e3 * one.warm:8.2f} ms warm"
        print(f"speed × {one.speed:<4g} torque × {one.torque:<5g}{told}  {what}", flush=True)
    over = ratios(found)
    for name, column in zip(("cold", "warm"), over.T, strict=True):
        median, most = np.median(column), column.max()
        print(
            f"{name}: {len(column)} parted states take {median:.1f} × as long (median), {most:.1f} × at most"
        )


if __name__ == "__main__":
    main(sys.argv[1])
