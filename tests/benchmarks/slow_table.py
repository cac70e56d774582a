"""The largest mesh force of slow sets over the static one, which nothing that jumps
brings to 1.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

from wearlab.scene import Scene
from wearlab.simulation import simulate

SPEED = "5 rpm"
WAYS: dict[str, dict[str, Any]] = {
    "default": {},
    "jump at A and E": {"extended_contact": False},
}
SIZE: dict[str, Any] = {"module": "3 mm", "face_width": "20 mm"}
PINION = {"teeth": 24}
RING = {"teeth": 72, "rim_diameter": "250 mm"}
CARRIER = {"mass": "3 kg", "inertia": "0.01 kg*m^2"}
PLANETARY = {
    "planets": 3,
    "sun": PINION,
    "planet": PINION,
    "ring": RING,
    "carrier": CARRIER,
}
SETS: dict[str, tuple[dict[str, Any], str]] = {
    "external pair": (
        {"kind": "external-pair", "pinion": PINION, "gear": PINION},
        "torsional",
    ),
    "internal pair": (
        {"kind": "internal-pair", "pinion": PINION, "ring": RING},
        "torsional",
    ),
    "planetary set": ({"kind": "planetary", **PLANETARY}, "planetary-torsional"),
}


class Slow(NamedTuple):
    """One way in: the largest over the static mesh force of a slow set, that of the
    worst mesh [1].
    """

    way: str
    ratio: float


def of_set(kind: str) -> Iterator[Slow]:
    """Yield what every way in says of a kind of gear set at 5 rpm."""
    gears, model = SETS[kind]
    for way, mesh in WAYS.items():
        run = simulate(
            Scene.from_mapping(
                {
                    "gears": SIZE | gears,
                    "operation": {"torque": "200 N*m", "speed": SPEED},
                    "mesh": {
                        "damping_ratio": 0.05,
                        "normal_backlash": "100 um",
                        **mesh,
                    },
                    "dynamics": {"model": model},
                }
            )
        )
        yield Slow(way, float((run.mesh_force_max / run.static_mesh_force).max()))
