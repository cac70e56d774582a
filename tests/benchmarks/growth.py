"""How the time of runs grows with their size: exponents, and a figure.

``python tests/benchmarks/growth.py [FOLDER [PART…]]`` times one thing after the other
in this process, each the least of several repeats of processor time: a spur run over
stored phases, a wear state over profile points, a cold steady state over coordinates
(up to 60: sets of up to 17 planets, every member with three; flanks touch throughout)
and over planets, a life over its cycles, a campaign over its runs. The exponent is the
slope of the last half of the points. Times are kept in FOLDER/growth.json, so that
parts may be timed one by one; the figure shows all.
"""

import json
import sys
import tempfile
from collections.abc import Callable, Sequence
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from processor_time import least

import wearlab as wl
from wearlab.assembly import build
from wearlab.scene import Scene
from wearlab.simulation import simulate

matplotlib.use("Agg")
SPUR = {
    "gears": {
        "kind": "external-pair",
        "module": "3 mm",
        "face_width": "20 mm",
        "pinion": {"teeth": 28},
        "gear": {"teeth": 41},
    },
    "operation": {"torque": "150 N*m", "speed": "1900 rpm"},
    "mesh": {"damping_ratio": 0.08},
    "dynamics": {"model": "torsional"},
}
WEAR = {"coefficient": {"model": "constant", "value": "1e-18 m^2/N"}}
TOUCHING: dict[str, Any] = {
    "stiffness": {"model": "potential-energy", "coupling": "none"},
    "extended_contact": False,
}
"""Meshes whose flanks touch throughout, so that sets of all sizes move alike."""
BEARING = {"radial_stiffness": "800 N/um", "damping_ratio": 0.06}


class Growth(NamedTuple):
    """What grows: name, its sizes, and the processor time at each [s]."""

    name: str
    sizes: list[float]
    seconds: list[float]

    @property
    def exponent(self) -> float:
        """Slope of the time over the size, log over log, of the last
        half of the points.
        """
        half = len(self.sizes) // 2
        return float(
            np.polyfit(np.log(self.sizes[half:]), np.log(self.seconds[half:]), 1)[0]
        )


def spur(**more: Any) -> Scene:
    """Return the spur pair with further sections."""
    return Scene.from_mapping({**SPUR, **more})


def planetary(planets: int, model: str) -> Scene:
    """Return a set of so many planets on the least sun with room for them, all of whose
    meshes are in phase.

    Teeth of sun and ring are multiples of the planets: otherwise a period breaks at
    other instants in every mesh, and what grows is the number of steps.
    """
    planet = next(teeth for teeth in count(24) if 2 * teeth % planets == 0)
    apart = (planet + 6) / np.sin(np.pi / planets) - planet
    sun = planets * int(np.ceil(max(24.0, apart) / planets))
    ring = sun + 2 * planet
    gears = {
        "kind": "planetary",
        "module": "3 mm",
        "face_width": "20 mm",
        "planets": planets,
        "sun": {"teeth": sun},
        "planet": {"teeth": planet},
        "ring": {
            "teeth": ring,
            "rim_diameter": f"{3.0 * (ring + 8.5)} mm",
            "tip_alteration": "wang-2023",
        },
        "carrier": {"mass": "2 kg", "inertia": "0.01 kg*m^2"},
    }
    held = {**BEARING, "tangential_stiffness": "50 N/um"}
    supports = {"sun": BEARING, "planet": BEARING, "ring": held, "carrier": held}
    return Scene.from_mapping(
        {
            "gears": gears,
            "operation": {"torque": f"{60.0 * planets} N*m", "speed": "900 rpm"},
            "mesh": {"damping_ratio": 0.08, **TOUCHING},
            "dynamics": {
                "model": model,
                **({"supports": supports} if model == "planetary" else {}),
            },
        }
    )


def steady(scene: Scene) -> tuple[int, float]:
    """Return the coordinates of a scene and the time of its wear state with a cold
    steady response [s].
    """
    parts = build(scene)
    coupling = parts.coupling
    unworn = parts.coupling.unworn()
    assert parts.vibration is not None
    return len(parts.vibration.system.load), least(lambda: coupling.evaluate(unworn))


def grown(name: str, sizes: Sequence[float], of: Callable[[Any], float]) -> Growth:
    """Return the times of all sizes."""
    return Growth(name, list(sizes), [of(size) for size in sizes])


def campaign_of(runs: int) -> float:
    """Return the least time of campaigns of so many runs in one process, each into a
    fresh store [s].
    """
    return least(lambda: campaign(runs))


def campaign(runs: int) -> None:
    """Run a campaign of so many runs in one process, into a fresh store."""
    still = {key: value for key, value in SPUR.items() if key != "dynamics"}
    scenes = [
        Scene.from_mapping(
            {**still, "operation": {"torque": f"{100.0 + k} N*m", "speed": "1900 rpm"}}
        )
        for k in range(runs)
    ]
    with tempfile.TemporaryDirectory() as folder:
        wl.run(scenes, Path(folder) / "store", workers=0)


def over_coordinates() -> Growth:
    """Return the time of a cold steady state over the coordinates of
    pairs and planetary sets.
    """
    cases = [spur(dynamics={"model": "torsional"})]
    cases += [
        spur(
            dynamics={
                "model": "spur-3dof",
                "supports": {"pinion": BEARING, "gear": BEARING},
            }
        )
    ]
    cases += [planetary(planets, "planetary") for planets in (2, 3, 5, 8, 12, 17)]
    coordinates, seconds = zip(*map(steady, cases), strict=True)
    return Growth("coordinates", list(map(float, coordinates)), list(seconds))


def over_cycles() -> Growth:
    """Return the time of a life over its cycles."""
    lives = spur(wear={**WEAR, "until": {"cycles": 1e5}})

    def of(cycles: float) -> float:
        return least(lambda: simulate(lives.replace("wear.until.cycles", cycles)))

    return grown("cycles", [1e6, 1e7, 3e7, 1e8], of)


PARTS: dict[str, Callable[[], Growth]] = {
    "phases": lambda: grown(
        "stored phases",
        [128, 512, 2048, 8192],
        lambda n: least(lambda: simulate(spur(numerics={"phase_points": n}))),
    ),
    "points": lambda: grown(
        "profile points",
        [101, 201, 401, 801, 1601],
        lambda n: steady(spur(wear=WEAR).replace("numerics.profile_points", n))[1],
    ),
    "coordinates": over_coordinates,
    "planets": lambda: grown(
        "planets",
        [2, 3, 4, 6, 8],
        lambda n: steady(planetary(n, "planetary-torsional"))[1],
    ),
    "cycles": over_cycles,
    "runs": lambda: grown("runs", [4, 8, 16, 32, 64], campaign_of),
}


def kept(folder: Path, parts: Sequence[str]) -> list[Growth]:
    """Time these parts anew, keep them beside those timed before, and
    return all in order.
    """
    file = folder / "growth.json"
    known = json.loads(file.read_text()) if file.exists() else {}
    for part in parts:
        known[part] = PARTS[part]()._asdict()
        file.write_text(json.dumps(known, indent=1))
    return [Growth(**known[part]) for part in PARTS if part in known]


def figure(found: Sequence[Growth], file: Path) -> None:
    """Draw time over size, one panel each, with the slope of the last half."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter

    drawn = Figure((9.0, 5.2), layout="constrained")
    panels = drawn.subplots(2, 3).flat
    for axes in panels[len(found) :]:
        axes.set_axis_off()
    for axes, one in zip(panels, found, strict=False):
        half = len(one.sizes) // 2
        axes.loglog(one.sizes, one.seconds, "o-", color="#0072B2", ms=4)
        slope = np.array(one.sizes[half:])
        last = one.seconds[-1] * (slope / slope[-1]) ** one.exponent
        axes.loglog(slope, last, "--", color="black", lw=0.8)
        axes.set_title(f"{one.name}: exponent {one.exponent:.2f}", size=9)
        axes.set_ylabel("processor time in s", size=8)
        axes.tick_params(labelsize=7, which="both")
        axes.xaxis.set_minor_formatter(NullFormatter())
        turned = 60 if len(one.sizes) > 6 else 0
        axes.set_xticks(one.sizes, [f"{size:g}" for size in one.sizes], rotation=turned)
        axes.set_ylim(0.5 * min(one.seconds), 2.0 * max(one.seconds))
    drawn.savefig(file, dpi=150)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    found = kept(folder, sys.argv[2:] or list(PARTS))
    for one in found:
        told = ", ".join(
            f"{size:g}: {1e3 * second:.3g}"
            for size, second in zip(one.sizes, one.seconds, strict=True)
        )
        print(f"{one.name:16s} exponent {one.exponent:5.2f}   ms at {told}")
    figure(found, folder / "growth.png")
    print(folder / "growth.png")
