"""Papers' scenes by the defaults of model version 3 and by today's: vibration,
transmission error, life.

Version 3 took up the load at A by a jump and took the stiffness from the
potential-energy method; both are named options since. Nothing else differs between the
two.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from wearlab.campaign import load
from wearlab.scene import Scene
from wearlab.simulation import simulate

BASE = Path(__file__).parents[2] / "campaigns" / "base"
WAYS: dict[str, dict[str, Any]] = {
    "version 3": {
        "stiffness": {"model": "potential-energy"},
        "extended_contact": False,
    },
    "today": {"stiffness": {"model": "finite-element"}, "extended_contact": True},
}
DEPTH = "20 um"
"""At which a life ends here."""
DAMPED = {"damping_ratio": 0.07}
WEAR = {
    "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
    "load": "instant",
    "until": {"depth": DEPTH},
}


class Benchmark(NamedTuple):
    """A paper's scene: the file of its gears, and what makes it move."""

    file: str
    changes: dict[str, Any]


def speeds(
    name: str, file: str, each: tuple[int, ...], **changes: Any
) -> dict[str, Benchmark]:
    """Return a scene at several speeds."""
    return {
        f"{name}, {speed} rpm": Benchmark(
            file, {**changes, "operation.speed": f"{speed} rpm"}
        )
        for speed in each
    }


SCENES = {
    **speeds("L16", "spur_50_50.toml", (800, 1100, 1860, 2200, 3720)),
    **speeds(
        "Y23",
        "internal_40_100.toml",
        (1000,),
        **{"mesh.damping_ratio": 0.07, "dynamics": {"model": "torsional"}},
    ),
    **speeds(
        "W23",
        "planetary_ngw11_vibration.toml",
        (300, 1500),
        **{"mesh.damping_ratio": 0.07},
    ),
    **speeds(
        "B23",
        "planetary_friction.toml",
        (100, 400),
        **{
            "mesh.damping_ratio": 0.07,
            "dynamics": {
                "model": "planetary-torsional",
                "friction": {"coefficient": 0.1},
            },
        },
    ),
}


class Changed(NamedTuple):
    """One scene by one set of defaults.

    Parameters
    ----------
    way : which defaults
    factor : dynamic factor of the mesh that has the largest [1]
    ste : largest range of the static transmission error of its meshes [m]
    life : cycles until the deepest flank is worn so deep as `DEPTH` [1]
    """

    way: str
    factor: float
    ste: float
    life: float


def scene_of(benchmark: Benchmark) -> Scene:
    """Return the scene of a benchmark, unworn, by the paper's own
    choices of its mesh.
    """
    scene: Scene = load(BASE / benchmark.file).cases[0].scene
    for key, value in {**benchmark.changes, "wear": WEAR}.items():
        scene = scene.replace(key, value)
    return scene


def of_scene(name: str) -> Iterator[Changed]:
    """Yield what either set of defaults says of a scene."""
    for way, mesh in WAYS.items():
        scene = scene_of(SCENES[name])
        for key, value in mesh.items():
            scene = scene.replace(f"mesh.{key}", value)
        run = simulate(scene)
        first = run.isel(update=0)
        yield Changed(
            way,
            float(first.dynamic_factor.max()),
            float(first.ste_peak_to_peak.max()),
            float(run.life),
        )
