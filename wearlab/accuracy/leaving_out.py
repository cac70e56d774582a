"""What each absent part of a scene saves, and that leaving it out changes nothing: a table to print.

``python -m wearlab.accuracy.leaving_out`` runs one wearing state of a spur pair in pairs of scenes. In the
first of each pair a part is present but without effect, in the second it is absent. The results agree; time
and bytes of the stored run do not. Linear contact is not an option but a proof: where no gap can open, the
period map is affine and one pass finds the orbit that a march finds in hundreds of periods.
"""

import time
from typing import Any, NamedTuple

import numpy as np

from wearlab.scene import Scene

REPEATS = 5
SHORTEST = 0.05
"""Processor time of one measurement [s]; both scenes take turns, so that a busy machine slows both."""
BASE: dict[str, Any] = {
    "gears": {
        "kind": "external-pair",
        "module": "3 mm",
        "face_width": "20 mm",
        "pinion": {"teeth": 50, "roughness_ra": "0.3 um"},
        "gear": {"teeth": 50, "roughness_ra": "0.3 um"},
    },
    "operation": {"torque": "340 N*m", "speed": "1860 rpm"},
    "mesh": {"damping": "1000 N*s/m"},
    "dynamics": {"model": "torsional"},
    "wear": {
        "coefficient": {"model": "constant", "value": "9.65e-19 m^2/N"},
        "load": "instant",
    },
}
Change = dict[str, Any]


class Part(NamedTuple):
    """A part, as a change of the base scene that has no effect, and the change that leaves it out.

    Parameters
    ----------
    name : what is left out
    present, absent : dotted key → value as a campaign file writes it, None: no such key
    tolerance : largest relative difference of results that counts as none; 0: not a bit
    """

    name: str
    present: Change
    absent: Change
    tolerance: float


EVEN = {"mesh.stiffness": {"model": "constant", "value": "300 N/um", "of": "mesh"}}
THIN_OIL = {"viscosity": "1e-5 Pa*s", "pressure_viscosity": "1e-8 1/Pa"}
PARTS = (
    Part("dynamics", EVEN, EVEN | {"wear.load": "static", "dynamics": None, "mesh.damping": None}, 1e-9),
    Part("friction", {"dynamics.friction": {"coefficient": 0.0}}, {}, 1e-12),
    Part("back contact", {"mesh.normal_backlash": "1 mm"}, {}, 0.0),
    Part("film factor", {"lubricant": THIN_OIL, "wear.coefficient.film": True}, {}, 0.0),
    Part(
        "torque fluctuation",
        {"operation.torque_fluctuation": {"order": 1, "amplitude": "0 N*m", "phase": "0 deg"}},
        {},
        0.0,
    ),
    Part("events (contact proven linear)", {"dynamics.method": "rk4"}, {}, 1e-5),
    Part("wear over cycles", {"wear.until": {"cycles": 1e6}}, {}, 1e-12),
    Part("the wear law", {}, {"wear": None}, 0.0),
)
COMPARED = ("dynamic_mesh_force", "tooth_force", "wear_rate", "wear_depth")


class Saving(NamedTuple):
    """What leaving a part out saves.

    Parameters
    ----------
    name : the part
    seconds, size : (present, absent) time of contact, dynamics and wear [s], and bytes of the stored run
    difference : largest relative difference of what both scenes compute, in the first state [1]
    tolerance : what counts as none [1]
    """

    name: str
    seconds: tuple[float, float]
    size: tuple[int, int]
    difference: float
    tolerance: float


def scene(change: Change) -> Scene:
    """Return the base scene with a change."""
    changed = Scene.from_mapping(BASE)
    for key, value in change.items():
        if value is not None:
            changed = changed.replace(key, value)
    for key, value in change.items():
        if value is None:
            changed = changed.replace(key, None)
    return changed


def saving(part: Part, repeats: int = REPEATS) -> Saving:
    """Run both scenes of a part, compiled before, and return what its absence saves."""
    from wearlab.simulate import simulate
    from wearlab.store.image import to_image

    scenes = scene(part.present), scene(part.absent)
    datasets = [simulate(one) for one in scenes]
    seconds = np.median([[_timed(one) for one in scenes] for _ in range(repeats)], axis=0)
    sizes = [len(to_image(dataset)[0]) for dataset in datasets]
    return Saving(
        part.name,
        (float(seconds[0]), float(seconds[1])),
        (sizes[0], sizes[1]),
        _difference(datasets[0], datasets[1]),
        part.tolerance,
    )


def _timed(one: Scene) -> float:
    """Return the processor time of one run without estimates and the search for further attractors [s].

    Short runs are repeated until the clock can tell them.
    """
    begun, done = time.process_time(), 0
    while done == 0 or time.process_time() - begun < SHORTEST:
        _run(one)
        done += 1
    return (time.process_time() - begun) / done


def _run(one: Scene) -> None:
    """Build a scene, let it live, and work out everything that is stored of its states."""
    from wearlab.scene.build import build
    from wearlab.simulate import static, vibration
    from wearlab.simulate.run import live

    parts = build(one)
    states = live(one, parts).state
    static.mesh_values(parts, states)
    static.path_values(parts, states)
    if parts.vibration is not None:
        vibration.dynamic_values(parts, states)


def _difference(first: Any, second: Any) -> float:
    """Return the largest relative difference of the compared variables in the states both have."""
    found = [np.inf]
    for name in COMPARED:
        if name in first and name in second:
            a, b = first[name].values[:1], second[name].values[:1]
            scale = np.abs(a).max()
            found.append(float(np.abs(a - b).max() / scale) if scale > 0.0 else float(np.abs(b).max()))
    if "wear_depth" in first and "wear_depth" in second and first.sizes["update"] == second.sizes["update"]:
        a, b = first.wear_depth.values[-1], second.wear_depth.values[-1]
        found.append(float(np.abs(a - b).max() / (np.abs(a).max() or 1.0)))
    return max(found[1:], default=np.inf)


def main() -> None:
    """Print the table."""
    print(f"{'left out':<32}{'time':>18}{'saved':>8}{'kB':>14}{'saved':>8}{'difference':>13}")
    for part in PARTS:
        found = saving(part)
        (slow, fast), (large, small) = found.seconds, found.size
        print(
            f"{found.name:<32}{1e3 * slow:8.2f} → {1e3 * fast:4.2f} ms{1 - fast / slow:8.0%}"
            f"{large / 1e3:7.0f} → {small / 1e3:4.0f}{1 - small / large:8.0%}{found.difference:13.1e}"
        )


if __name__ == "__main__":
    main()
