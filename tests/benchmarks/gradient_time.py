"""How long ten derivatives take beside a run: of the first case of
`campaigns/spur_tip_relief.toml`.

``python tests/benchmarks/gradient_time.py [REPEATS]`` prints the least processor time
of each: for a scene that the process has seen, and for others of another face width
each, for which nothing is remembered.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import wearlab as wl
from wearlab.scene import Scene
from wearlab.simulation import simulate

CAMPAIGN = Path(__file__).parents[2] / "campaigns" / "spur_tip_relief.toml"
KEYS = (
    "gears.pinion.tip_relief.amount",
    "gears.gear.tip_relief.amount",
    "gears.pinion.profile_shift_coefficient",
    "gears.gear.profile_shift_coefficient",
    "gears.face_width",
    "operation.torque",
    "operation.speed",
    "mesh.damping_ratio",
    "mesh.stiffness.scale",
    "wear.coefficient.value",
)
REPEATS, ANOTHER = 6, 1e-5


def processor_time(work: Callable[[Scene], Any], scene: Scene) -> float:
    """Return the processor time of one piece of work [s]."""
    begun = time.process_time()
    work(scene)
    return time.process_time() - begun


def ten_derivatives(scene: Scene) -> Any:
    """Return derivatives of life and dynamic factor by the ten numbers."""
    return wl.gradient(scene, ["life", "dynamic_factor"], KEYS, estimate=False)


def main(repeats: int) -> None:
    """Print the times of runs and gradients, taken in turns."""
    scene = wl.load(CAMPAIGN).cases[0].scene
    width = scene.gears.face_width
    unseen = (
        scene.replace("gears.face_width", f"{width * (1.0 + k * ANOTHER)!r} m")
        for k in range(1, 10_000)
    )
    simulate(scene), ten_derivatives(scene)  # which compiles
    seen_run, seen, unseen_run, anew = ([] for _ in range(4))
    for _ in range(repeats):
        unseen_run.append(processor_time(simulate, next(unseen)))
        anew.append(processor_time(ten_derivatives, next(unseen)))
        simulate(scene)
        seen_run.append(processor_time(simulate, scene))
        seen.append(processor_time(ten_derivatives, scene))
    for of, run, gradient in (("seen", seen_run, seen), ("not seen", unseen_run, anew)):
        ratio = min(gradient) / min(run)
        print(
            f"{of}: run {min(run):.3f} s, ten derivatives {min(gradient):.3f} s = "
            f"{ratio:.2f} runs"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else REPEATS)
