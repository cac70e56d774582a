"""Are the estimated errors of derivatives honest? Drawn pairs, beside a thirtieth of
their tolerance.

``python tests/benchmarks/gradient_errors.py --seed N [--scenes 10]`` prints how many
errors are below their estimates, and the median of estimate over error, of elasticities
above 1e-6; after every scene, so that an interruption loses none.
"""

import argparse

import numpy as np
from drawn_scenes import draw_any
from estimate_rows import one_state
from numpy.typing import NDArray
from processor_time import OutOfTime, bounded

import wearlab as wl
from wearlab.gradients import GradientError
from wearlab.scene import Scene
from wearlab.simulation import simulate

KEYS = ("operation.torque", "gears.face_width", "gears.pinion.tip_relief.amount")
MOVING = ("operation.speed", "mesh.damping_ratio")
LEAST, LONGEST, FINER = 1e-6, 60.0, 30.0


def main() -> None:
    """Print the row of a seed."""
    reader = argparse.ArgumentParser(description=__doc__)
    reader.add_argument("--seed", type=int, required=True)
    reader.add_argument("--scenes", type=int, default=10)
    asked = reader.parse_args()
    found = []
    for number in range(asked.scenes):
        scene = draw_any(asked.seed, number)
        if scene.gears.kind == "planetary":
            continue
        if scene.wear is not None and scene.wear.snapshots is not None:
            scene = scene.replace("wear.snapshots", None)
        simulate(one_state(scene))  # compiled before any clock runs
        try:
            with bounded(LONGEST):
                found.append(errors(scene))
        except (GradientError, OutOfTime) as reason:
            print(number, type(reason).__name__, reason, flush=True)
            continue
        tell(found)


def tell(found: list[NDArray[np.float64]]) -> None:
    """Print what the scenes so far come to."""
    size, error, estimate = np.concatenate(found, axis=1)
    counts = size > LEAST
    below = int(np.sum(error[counts] <= estimate[counts]))
    ratio = np.median(estimate[counts] / np.maximum(error[counts], 1e-300))
    off = error[counts] / size[counts]
    print(
        f"{len(found)} scenes, {below} of {counts.sum()} errors below their estimate, ",
        end="",
    )
    print(f"{ratio:.1f} times the error in the median; ", end="")
    print(
        f"errors {np.median(off):.2%} of the derivative in the median, "
        f"{off.max():.0%} at most",
        flush=True,
    )


def errors(scene: Scene) -> NDArray[np.float64]:
    """Return the elasticities of a scene to a fine tolerance, their errors and
    estimates, (3, n) [1].
    """
    keys = [*KEYS[:2], *(KEYS[2:] if scene.gears.pinion.tip_relief else ())]
    of = ["life"]
    if scene.dynamics is not None:
        keys = [*keys, *MOVING]
        of = [*of, "dynamic_factor"]
    own = wl.gradient(scene, of, keys)
    fine = wl.gradient(
        scene.replace("numerics.tolerance", scene.numerics.tolerance / FINER),
        of,
        keys,
        estimate=False,
    )
    rows = []
    for name in of:
        last = {} if name == "life" else {"update": -1}
        scale = np.abs(own.parameter_value.values) / abs(
            float(np.ravel(fine[name].isel(last))[0])
        )
        true, told, sure = (
            np.ravel(data[word].isel(last)) * scale
            for data, word in (
                (fine, f"d_{name}"),
                (own, f"d_{name}"),
                (own, f"error_estimate_d_{name}"),
            )
        )
        rows.append(np.stack([np.abs(true), np.abs(told - true), sure]))
    return np.concatenate(rows, axis=1)


if __name__ == "__main__":
    main()
