"""An outside march of W23's planetary set whose pins are off: load factors of the
planets, and the life of each.

    python tests/benchmarks/outside_planets.py --seeds 3 4 5 --pin 20 --depth 6

As `outside_march.py`: own equations of motion, own sliding and Archard's law. A pin
that is off pushes its planet by the stiffness of its bearing times the displacement;
every planet has flanks of its own; sun and ring wear by the mean of what their meshes
do.
"""

import argparse
import time
from typing import Any, NamedTuple

import numpy as np
from outside_march import Motion, Outside, scene_at
from outside_set import PLANETS
from scipy.interpolate import PchipInterpolator

from wearlab.scene import Scene
from wearlab.simulation import simulate

FIRST, SHARE = 0.25, 1.0 / 12.0
"""Wear of the first step of the midpoint rule, and of the longest, over the limit."""


class PlanetLives(NamedTuple):
    """Load factors on unworn flanks (n,), and the cycles (n,) at which every planet has
    the depth on its flank with the sun.
    """

    load_factor: np.ndarray
    life: np.ndarray


def scene_of(torque: float, pin: float, seed: int, depth: float, patch: str) -> Scene:
    """Return W23's set with pins off by so much [um], to a depth [um] of a planet."""
    position = {"planet_position": [f"{pin} um"]}
    return scene_at(torque, patch).replace(
        {
            "errors": {"slow": "frozen", "seed": seed, "planet": position},
            "wear.until": {"depth": f"{depth} um", "flank": "planet-sun"},
        }
    )


def marched(outside: Outside, depth: float) -> PlanetLives:
    """Return what a march says of the planets, up to a depth of the last [m]."""
    wear = list(outside.coupling.unworn())
    cycles = [0.0]
    depths = [np.zeros(PLANETS)]
    factors: Any = None
    longest = FIRST * SHARE * depth
    while depths[-1].min() < depth:
        motion = outside.steady(tuple(wear))
        forces = outside.tooth_forces(motion)
        if factors is None:
            factors = load_factors(motion)
        fed = outside.pointwise(forces)
        step = longest / max(float(fed[n][1].max()) for n in range(PLANETS))
        middle = outside.grown(wear, forces, 0.5 * step)
        halfway = outside.tooth_forces(outside.steady(tuple(middle)))
        wear = outside.grown(wear, halfway, step)
        cycles.append(cycles[-1] + step)
        depths.append(np.array([float(wear[n][1].max()) for n in range(PLANETS)]))
        longest = min(1.5 * longest, SHARE * depth)
    of_planets = np.array(depths).T
    lives = [PchipInterpolator(reached, cycles)(depth) for reached in of_planets]
    return PlanetLives(factors, np.array(lives, float))


def load_factors(motion: Motion) -> np.ndarray:
    """Return the mean normal force of the sun's meshes over that of all, (n,)."""
    of_meshes = motion.normal.sum(axis=3)
    at_sun = np.einsum("s,sem->m", 0.5 * motion.width, of_meshes)[:PLANETS]
    return np.asarray(at_sun / at_sun.mean())


def main() -> None:
    """Print load factors and lives of all planets, outside and the run's own."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--torque", type=float, default=90.0, help="[N m]")
    parser.add_argument("--pin", type=float, default=20.0, help="pins are off by [um]")
    parser.add_argument("--seeds", type=int, nargs="*", default=[3])
    parser.add_argument("--depth", type=float, default=6.0, help="of a planet [um]")
    parser.add_argument("--steps", type=int, default=600, help="of a mesh period")
    parser.add_argument("--patch", default="elastic", choices=["elastic", "following"])
    asked = parser.parse_args()
    for seed in asked.seeds:
        began = time.perf_counter()
        scene = scene_of(asked.torque, asked.pin, seed, asked.depth, asked.patch)
        run = simulate(scene)
        outside = Outside(scene, asked.steps)
        ours = marched(outside, 1e-6 * asked.depth)
        factors = run.mesh_load_factor.values[0, :PLANETS]
        lives = run.planet_life.values
        estimate = float(run.error_estimate_life) / float(run.life)
        differ = lives / ours.life - 1.0
        print(
            f"seed {seed}, {asked.torque:g} N m, pins off by "
            f"{np.hypot(*outside.pins.T) * 1e6} um\n"
            f"  load factor outside {ours.load_factor}, off by "
            f"{factors - ours.load_factor}\n"
            f"  life outside {ours.life}, off by {differ}; estimate of the run "
            f"{estimate:.2%}; {time.perf_counter() - began:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    main()
