"""A few scenes and what they come to, and every default: what may move only with the
version of the model.

``python tests/support/golden.py`` writes ``tests/golden/results.json`` and
``defaults.json`` anew, for a person to review; ``--unreleased`` lets them move where no
release has carried the version yet.
"""

import json
import math
import sys
from pathlib import Path
from typing import Any

from scenes import external_pair, planetary_set

from wearlab.options import Part
from wearlab.scene import MODEL_VERSION, Scene
from wearlab.scene.identity import canonical
from wearlab.scene.sections import Sections, parts_in
from wearlab.simulation import simulate

FILE = Path(__file__).parents[1] / "golden" / "results.json"
DEFAULTS = FILE.with_name("defaults.json")
SAME = 1e-5  # relative: solvers stop elsewhere on other machines, models move further
RESULTS = (
    "max_wear_depth",
    "life",
    "worn_mass",
    "contact_ratio",
    "dynamic_factor",
    "max_bearing_force",
)
ALONG_PHASE = ("mesh_stiffness", "static_transmission_error", "dynamic_mesh_force")

PAIR: dict[str, Any] = {
    "gears": external_pair(50, {"teeth": 40, "profile_shift_coefficient": 0.1}),
    "operation": {"torque": "340 N*m", "speed": "1100 rpm"},
}
RING: dict[str, Any] = {
    **PAIR["gears"],
    "kind": "internal-pair",
    "ring": {"teeth": 100, "rim_diameter": "340 mm"},
}
SET: dict[str, Any] = planetary_set(
    24,
    24,
    {"teeth": 72, "rim_diameter": "250 mm"},
    carrier={"mass": "3 kg", "inertia": "0.01 kg*m^2"},
)
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
    "worn internal pair": {
        **PAIR,
        "gears": {k: v for k, v in RING.items() if k != "gear"},
        "wear": WEAR,
    },
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
    last = run.isel(update=-1)  # how many there are before it is a matter of rounding
    for name in ALONG_PHASE:
        if name in run:
            found[f"{name} mean"] = float(last[name].mean())
            found[f"{name} range"] = float(last[name].max() - last[name].min())
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


def defaults(part: type[Part] = Sections, above: str = "") -> dict[str, Any]:
    """Return the default of every option of a scene, by dotted key
    with the models chosen.
    """
    found: dict[str, Any] = {}
    for name, field in part.model_fields.items():
        if field.exclude or name == part.chooser:
            continue
        if not field.is_required():
            given = field.get_default(call_default_factory=True)
            plain = given.model_dump() if isinstance(given, Part) else given
            found[above + name] = json.loads(canonical({"": plain})).get("")
        for inner in parts_in(field.annotation):
            chooser = inner.model_fields.get(inner.chooser)
            model = "" if chooser is None else f"[{chooser.annotation.__args__[0]}]"
            found |= defaults(inner, f"{above}{name}{model}.")
    return found


def moved_defaults(old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    """Return the options that were there and have another default now.

    A new option moves nothing.
    """
    return sorted(
        name for name in old if name not in new or not _holds(old[name], new[name])
    )


def _holds(old: Any, new: Any) -> bool:
    if isinstance(old, dict) and isinstance(new, dict):
        return all(key in new and _holds(inner, new[key]) for key, inner in old.items())
    return bool(old == new)


def main() -> None:
    """Write all anew.

    Refuse where something moved and the version of the model did not.
    """
    old = (
        json.loads(FILE.read_text())
        if FILE.exists()
        else {"model_version": 0, "scenes": {}}
    )
    kept = json.loads(DEFAULTS.read_text()) if DEFAULTS.exists() else {}
    scenes = {name: results(table) for name, table in SCENES.items()}
    if old["model_version"] == MODEL_VERSION and "--unreleased" not in sys.argv[1:]:
        what = moved_defaults(kept, defaults())
        what += [
            f"{name}: {one}"
            for name in old["scenes"]
            for one in moved(old["scenes"][name], scenes[name])
        ]
        if what:
            sys.exit(
                f"{', '.join(what)} moved: raise MODEL_VERSION in "
                "wearlab/scene/identity.py"
            )
    FILE.parent.mkdir(exist_ok=True)
    FILE.write_text(
        json.dumps({"model_version": MODEL_VERSION, "scenes": scenes}, indent=1) + "\n"
    )
    DEFAULTS.write_text(json.dumps(defaults(), indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    main()
