"""Whether the force that wears carries the load: drawn scenes in motion, unworn and
worn.

    python tests/benchmarks/momentum.py --seed 1 --scenes 100

At every coordinate the mean of normal forces, springs, dashpots and friction is held
against the load, over the largest load; of an aperiodic motion less the change of
momentum. Where coupled pairs change order of engagement within a step, stiffness jumps
and the step takes a parabola: what this leaves falls with steps, which are refined
until it is below the bar or a motion takes longer than allowed.
"""

import argparse
import sys
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from drawn_scenes import draw_any
from processor_time import OutOfTime, bounded

from wearlab.assembly import GearModel, build
from wearlab.dynamics.forces.mesh_forces import extremes
from wearlab.gears.specification import GearError
from wearlab.life.coupled import Wear
from wearlab.life.limits import StopWear
from wearlab.scene import Scene

sys.path[:0] = [str(Path(__file__).parents[1] / "support")]
from momentum_balance import unbalanced  # noqa: E402

FINER = (4, 16, 64)
MOST = 8000
"""Steps over those of a run, one after another until the balance is within the bar, and
the most of them."""
WORN = 5e-6
"""Depth of the drawn wear [m]."""


def built(scene: Scene, finer: int) -> GearModel:
    """Return the physics of a scene with more steps a period."""
    vibration = build(scene).vibration
    assert vibration is not None
    steps = min(MOST, finer * len(vibration.sampling.grid.width))
    return build(scene.replace("numerics.steps_per_period", steps))


class Balance(NamedTuple):
    """How well the forces of a motion carry the load: the largest share left, with
    steps a period.
    """

    off: float = np.inf
    steps: int = 0
    apart: float = np.nan
    period: int = -1


def balance(
    scene: Scene, flanks: str, number: int, bar: float, longest: float
) -> Balance:
    """Return the balance with the steps it takes to be within the bar, or with the most
    that time allows.
    """
    found = Balance()
    for finer in FINER:
        try:
            with bounded(longest):
                found = _balance(built(scene, finer), flanks, number)
        except OutOfTime:
            break
        if found.off < bar or found.steps > MOST // 4:
            break
    return found


def _balance(parts: GearModel, flanks: str, number: int) -> Balance:
    unworn = parts.coupling.unworn()
    state = (
        unworn if flanks == "unworn" else worn(unworn, np.random.default_rng(number))
    )
    response = parts.coupling.evaluate(state).response
    assert response is not None
    apart = float(extremes(response).separated.max())
    return Balance(
        float(np.abs(unbalanced(response)).max()),
        len(response.tables.width),
        apart,
        response.period,
    )


def worn(unworn: Wear, rng: np.random.Generator) -> Wear:
    """Return flanks worn by a smooth drawn profile each."""
    return tuple(
        np.array([_profile(len(depth), rng) for depth in kind]) for kind in unworn
    )


def _profile(points: int, rng: np.random.Generator) -> np.ndarray:
    x = np.linspace(-1.0, 1.0, points)
    return (
        WORN
        * rng.uniform()
        * (1.0 + np.cos(np.pi * rng.uniform(0.5, 2.0) * x + rng.uniform(0.0, 6.0)))
    )


def main() -> int:
    """Print a line for each state, then the shares."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scenes", type=int, default=100)
    parser.add_argument(
        "--first", type=int, default=0, help="number of the first scene of the seed"
    )
    parser.add_argument("--bar", type=float, default=1e-6)
    parser.add_argument(
        "--longest", type=float, default=300.0, help="processor time of a motion [s]"
    )
    asked = parser.parse_args()
    left = []
    number = asked.first - 1
    while len(left) < 2 * asked.scenes:
        number += 1
        scene = draw_any(asked.seed, number)
        began = time.perf_counter()
        if scene.dynamics is None:
            continue
        kind = f"{scene.gears.kind}, {scene.dynamics.model}"
        for flanks in ("unworn", "worn"):
            try:
                found = balance(scene, flanks, number, asked.bar, asked.longest)
            except (GearError, StopWear) as error:
                print(f"{number}: refused: {error}")
                break
            left.append(found)
            mark = (
                ""
                if found.off < asked.bar
                else "  MISSED"
                if found.steps
                else "  OUT OF TIME"
            )
            print(
                f"{number}: {found.off:.2g}  {kind}, {flanks}, period {found.period}, "
                f"apart {found.apart:.1%}, {found.steps} steps{mark}"
            )
        print(f"    {time.perf_counter() - began:.1f} s", flush=True)
    off, steps, apart, period = np.array(left).T
    print(
        f"{len(off)} states, {np.sum(steps == 0)} of them out of time, "
        f"{np.mean(apart > 0.0):.0%} with contact lost, {np.mean(period == 0):.0%} "
        "aperiodic: "
        f"{np.mean(off < asked.bar):.1%} within {asked.bar:g}, median "
        f"{np.median(off):.1g}, "
        f"worst {off.max():.2g}"
    )
    return int((off >= asked.bar).any())


if __name__ == "__main__":
    sys.exit(main())
