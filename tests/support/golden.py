"""A few scenes and what they come to: results that may move only together with the version of the model.

``python tests/support/golden.py`` writes ``tests/golden/results.json`` anew, for a person to review.
"""

import json
import math
import sys
from pathlib import Path
from typing import Any

from wearlab.scene import MODEL_VERSION, Scene
from wearlab.simulate import simulate

FILE = Path(__file__).parents[1] / "golden" / "results.json"
SAME = 1e-5  # relative: solvers stop elsewhere on other machines, models move further
RESULTS = ("max_wear_depth", "life", "worn_mass", "contact_ratio", "dynamic_factor", "max_bearing_force")
ALONG_PHASE = ("mesh_stiffness", "static_transmission_error", "dynamic_mesh_force")

PAIR: dict[str, Any] = {
    "gears": {
        "kind": "external-pair",
        "module": "3 mm",
        "face_width": "20 mm",
        "pinion": {"teeth": 50},
        "gear": {"teeth": 40, "profile_shift_coefficient": 0.1},
    },
    "operation": {"torque": "340 N*m", "speed": "1100 rpm"},
}
RING: dict[str, Any] = {
    **PAIR["gears"],
    "kind": "internal-pair",
    "ring": {"teeth": 100, "rim_diameter": "340 mm"},
}
SET: dict[str, Any] = {
    "kind": "planetary",
    "module": "3 mm",
    "face_width": "20 mm",
    "planets": 3,
    "sun": {"teeth": 24},
    "planet": {"teeth": 24},
    "ring": {"teeth": 72, "rim_diameter": "250 mm"},
    "carrier": {"mass": "3 kg", "inertia": "0.01 kg*m^2"},
}
WEAR: dict[str, Any] = {
    "coefficient": {"model": "constant", "value": "9.65e-19 m^2/N"},
    "until": {"depth": "10 um"},
    "load": "static",
}
SCENES: dict[str, dict[str, Any]] = {
    "worn external pair": {**PAIR, "wear": WEAR},
    "vibrating external pair": {
        **PAIR,
        "mesh": {"damping_ratio": 0.05, "normal_backlash": "100 um"},
        "dynamics": {"model": "torsional"},
    },
    "worn internal pair": {**PAIR, "gears": {k: v for k, v in RING.items() if k != "gear"}, "wear": WEAR},
    "worn planetary set": {**PAIR, "gears": SET, "wear": WEAR},
}


def results(table: dict[str, Any]) -> dict[str, Any]:
    """Return the identity of a scene and some of its results, SI."""
    scene = Scene.from_mapping(table)
    run = simulate(scene)
    found: dict[str, Any] = {"id": scene.id}
    for name in RESULTS:
        if name in run:
            found[name] = float(run[name].max())
    for name in ALONG_PHASE:
        if name in run:
            found[f"{name} mean"] = float(run[name].mean())
            found[f"{name} range"] = float(run[name].max() - run[name].min())
    return found


def moved(old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    """Return the names of what is another result than it was."""
    numbers = {name for name in {*old, *new} if name != "id"}
    return sorted(
        name
        for name in numbers
        if name not in old
        or name not in new
        or not math.isclose(old[name], new[name], rel_tol=SAME, abs_tol=1e-15)
    )


def main() -> None:
    """Write the results anew; refuse where they moved and the version of the model did not."""
    old = json.loads(FILE.read_text()) if FILE.exists() else {"model_version": 0, "scenes": {}}
    scenes = {name: results(table) for name, table in SCENES.items()}
    if old["model_version"] == MODEL_VERSION:
        for name, known in old["scenes"].items():
            if name in scenes and (what := moved(known, scenes[name])):
                sys.exit(f"{name}: {', '.join(what)} moved: raise MODEL_VERSION in wearlab/scene/identity.py")
    FILE.parent.mkdir(exist_ok=True)
    FILE.write_text(json.dumps({"model_version": MODEL_VERSION, "scenes": scenes}, indent=1) + "\n")


if __name__ == "__main__":
    main()
