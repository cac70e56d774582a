"""Are the error estimates of lives over the face honest? Drawn scenes, each beside a
finer one.

``python tests/benchmarks/face_life_estimates.py --seed N [--scenes 100] [--seconds S]
[--still] OUT`` draws pairs and planetary sets with a face - spur or helical, crowned,
relieved, misaligned, every coupling that goes with their stiffness - and lives each to
a depth. Its life and its deepest wear are set beside those of the same scene on more
than twice its nodes and slices, at a tenth of its tolerance over cycles. Rows are added
one by one to the table OUT; asked again, the command goes on where it was. It ends with
the share of errors that their estimates cover, how large these are, and status 1 below
95 %.
"""

import argparse
import csv
import math
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from wearlab.scene import Scene
from wearlab.simulation import simulate
from wearlab.simulation.label import Refused

COLUMNS = (
    "seed",
    "scene",
    "kind",
    "helix",
    "coupling",
    "motion",
    "life_error",
    "life_estimate",
    "depth_error",
    "depth_estimate",
    "seconds",
)
WANTED = 0.95
FINE = {
    "mesh.face_points": 101,
    "numerics.profile_points": 203,
    "numerics.cycle_tolerance": 1e-4,
}
"""What the reference of a scene is run with; a scene of the default tolerance has 41
slices and 101 nodes."""
ROOT, RIM = 2.5, 6.5
"""Modules by which the root of a ring lies outside its reference diameter, and its rim
outside its root, in diameter."""
MOVING = 0.2
"""Share of the pairs that vibrate."""
SOLID = 0.25
"""Share of the pairs whose teeth are of elements, coupled as solid teeth unless by
none."""


def drawn(seed: int, number: int) -> Scene:
    """Return scene ``number`` of a seed."""
    random = np.random.default_rng([seed, number])
    kind = random.choice(
        ["external-pair", "internal-pair", "planetary"], p=[0.6, 0.2, 0.2]
    )
    z1 = int(random.integers(17, 31))
    z2 = int(random.integers(32, 80))
    module = 1e-3 * random.uniform(2.0, 8.0)
    over = random.uniform(4.0, 20.0)
    ring = 2 * z2 + z1 if kind == "planetary" else 2 * z2
    members: dict[str, Any] = {
        "external-pair": {"pinion": {"teeth": z1}, "gear": {"teeth": z2}},
        "internal-pair": {
            "pinion": {"teeth": z1},
            "ring": {"teeth": ring},
        },
        "planetary": {
            "planets": 3,
            "sun": {"teeth": z1},
            "planet": {"teeth": z2},
            "ring": {"teeth": ring},
        },
    }[kind]
    while kind == "planetary" and (z1 + ring) % 3:
        z1 += 1
        ring += 1
        members["sun"]["teeth"], members["ring"]["teeth"] = z1, ring
    first = next(name for name in members if isinstance(members[name], dict))
    if random.random() < 0.6:
        members[first]["lead_crowning"] = f"{random.uniform(-4.0, 20.0):.4g} um"
    if random.random() < 0.5:
        members[first]["tip_relief"] = {
            "amount": f"{random.uniform(2.0, 20.0):.4g} um",
            "length": f"{1e3 * module * 0.5:.4g} mm",
        }
    gears: dict[str, Any] = {
        "kind": str(kind),
        "module": f"{1e3 * module:.6g} mm",
        "face_width": f"{1e3 * over * module:.6g} mm",
        **members,
    }
    helix = 0.0
    if random.random() < 0.7:
        helix = random.uniform(3.0, 25.0)
        gears["helix_angle"] = f"{helix:.4g} deg"
    if "ring" in members:
        root = module * (ring / math.cos(math.radians(helix)) + ROOT)
        members["ring"]["rim_diameter"] = f"{1e3 * (root + RIM * module):.6g} mm"
    line = 10.0 ** random.uniform(4.6, 5.9)  # N/m
    torque = (
        line * over * module * 0.5 * module * z1 * (3.0 if kind == "planetary" else 1.0)
    )
    mesh: dict[str, Any] = {
        "misalignment": f"{random.uniform(-30.0, 30.0):.4g} um",
        "stiffness": {"model": "potential-energy"},
    }
    if random.random() < 0.3:
        mesh["face_coupling"] = "none"
    table: dict[str, Any] = {
        "gears": gears,
        "operation": {"torque": f"{torque:.6g} N*m", "speed": "1000 rpm"},
        "mesh": mesh,
        "wear": {
            "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
            "until": {"depth": f"{random.uniform(2.0, 25.0):.4g} um"},
            "snapshots": {"depth": ["1 um"]},
        },
    }
    if kind != "planetary" and random.random() < MOVING:
        table["dynamics"] = {"model": "torsional"}
        mesh["damping_ratio"] = float(random.uniform(0.03, 0.12))
    if kind != "planetary" and random.random() < SOLID:
        mesh["stiffness"] = {"model": "finite-element"}
    return Scene.from_mapping(table)


def row(seed: int, number: int, still: bool) -> dict[str, Any] | None:
    """Return the errors of one scene beside their estimates, None where the gears
    cannot be, or move.
    """
    begun = time.process_time()
    scene = drawn(seed, number)
    if still and scene.dynamics is not None:
        return None
    try:
        run = simulate(scene)
        fine = simulate(scene.replace({key: value for key, value in FINE.items()}))
    except Refused:
        return None
    if run["end_reason"].item() != "depth" or fine["end_reason"].item() != "depth":
        return None
    cycle = float(min(run["cycle"][-1], fine["cycle"][-1]))
    deepest = [
        float(
            np.interp(
                cycle, one["cycle"].values, one["max_wear_depth"].max("flank").values
            )
        )
        for one in (run, fine)
    ]
    coupling = scene.mesh.face_coupling
    return {
        "seed": seed,
        "scene": number,
        "kind": scene.gears.kind,
        "helix": scene.gears.helix_angle or 0.0,
        "coupling": "default" if coupling is None else coupling.chosen,
        "motion": "still" if scene.dynamics is None else scene.dynamics.chosen,
        "life_error": abs(float(run["life"]) - float(fine["life"]))
        / float(fine["life"]),
        "life_estimate": float(run["error_estimate_life"]) / float(fine["life"]),
        "depth_error": abs(deepest[0] - deepest[1]),
        "depth_estimate": float(run["error_estimate_wear_depth"].values[-1]),
        "seconds": round(time.process_time() - begun, 1),
    }


def main() -> int:
    """Add rows to the table, and tell the share of covered errors."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--scenes", type=int, default=100)
    parser.add_argument(
        "--seconds", type=float, default=np.inf, help="when to begin no further scene"
    )
    parser.add_argument(
        "--still", action="store_true", help="no scene that vibrates: they take minutes"
    )
    parser.add_argument("out", type=Path)
    asked = parser.parse_args()
    begun = time.monotonic()
    known: list[dict[str, Any]] = []
    if asked.out.exists():
        known = list(csv.DictReader(asked.out.read_text().splitlines()))
    else:
        asked.out.write_text(",".join(COLUMNS) + "\n")
    done = {int(one["scene"]) for one in known if int(one["seed"]) == asked.seed}
    for number in range(10 * asked.scenes):
        if len(known) >= asked.scenes or time.monotonic() - begun > asked.seconds:
            break
        found = None if number in done else row(asked.seed, number, asked.still)
        if found is not None:
            known.append(found)
            with asked.out.open("a", newline="") as file:
                csv.DictWriter(file, COLUMNS).writerow(found)
    covered = {}
    for what in ("life", "depth"):
        error = np.array([float(one[f"{what}_error"]) for one in known])
        estimate = np.array([float(one[f"{what}_estimate"]) for one in known])
        covered[what] = float(np.mean(error <= estimate))
        print(
            f"{what}: {100.0 * covered[what]:.1f} % of {len(known)} errors are within "
            f"their estimates, which are {np.median(estimate / error):.1f} times the "
            "error in the median"
        )
    return 0 if known and min(covered.values()) >= WANTED else 1


if __name__ == "__main__":
    sys.exit(main())
