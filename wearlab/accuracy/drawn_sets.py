"""Scenes of internal pairs and planetary sets, drawn as `wearlab.accuracy.drawn` draws external pairs."""

from typing import Any

import numpy as np

Table = dict[str, Any]
TOLERANCES = (3e-3, 1e-3, 3e-4)
PAIR_MOTION = ("none", "torsional", "spur-3dof")
GROUNDED = ("ring", "carrier")
SET_MOTION = ("none", "planetary-torsional", "planetary")


def internal_pair(rng: np.random.Generator, motion: str | None = None) -> Table:
    """Draw a pinion in a ring; ``motion`` is drawn unless it is given."""
    module, pinion = _module(rng), int(rng.integers(24, 41))
    ring = pinion + int(rng.integers(30, 81))
    width = _width(rng, module)
    drawn = str(rng.choice(PAIR_MOTION, p=[0.3, 0.3, 0.4]))
    gears = {
        "kind": "internal-pair",
        "module": f"{module} mm",
        "face_width": f"{width} mm",
        "pinion": {"teeth": pinion},
        "ring": _ring(module, ring),
    }
    table = _loaded(rng, gears, _torque(rng, module, width, pinion), _speed(rng, module, pinion))
    return _moving(rng, table, motion or drawn, ("pinion", "ring"))


def planetary_set(rng: np.random.Generator, motion: str | None = None) -> Table:
    """Draw a planetary set with three planets; ``motion`` is drawn unless it is given."""
    module, sun = _module(rng), int(rng.integers(18, 31))
    planet = int(rng.integers(18, 31))
    planet += -(sun + planet) % 3  # three planets can be assembled evenly
    width = _width(rng, module)
    drawn = str(rng.choice(SET_MOTION, p=[0.4, 0.3, 0.3]))
    gears = {
        "kind": "planetary",
        "module": f"{module} mm",
        "face_width": f"{width} mm",
        "planets": 3,
        "sun": {"teeth": sun},
        "planet": {"teeth": planet},
        "ring": _ring(module, sun + 2 * planet),
        "carrier": {
            "mass": f"{2.0 * (module / 3.0) ** 3} kg",
            "inertia": f"{0.01 * (module / 3.0) ** 5} kg*m^2",
        },
    }
    torque = 3.0 * _torque(rng, module, width, sun)
    table = _loaded(rng, gears, torque, 0.5 * _speed(rng, module, sun), "sun")
    if rng.random() < 0.5:
        table["wear"]["load"] = "static"
    return _moving(rng, table, motion or drawn, ("sun", "planet", "ring", "carrier"))


def _module(rng: np.random.Generator) -> float:
    return float(rng.choice([2.0, 3.0, 4.0]))


def _width(rng: np.random.Generator, module: float) -> float:
    return float(rng.uniform(5.0, 10.0)) * module


def _torque(rng: np.random.Generator, module: float, width: float, teeth: int) -> float:
    """Return a torque in N·m: 20 to 90 MPa times module and face width as the force of a mesh."""
    return float(rng.uniform(20.0, 90.0)) * 1e-3 * module**2 * width * teeth / 2.0


def _speed(rng: np.random.Generator, module: float, teeth: int) -> float:
    """Return a speed in rpm, that of a pinion of 150 mm between 300 and 4000 rpm."""
    return float(np.exp(rng.uniform(np.log(300.0), np.log(4000.0)))) * 150.0 / (module * teeth)


def _ring(module: float, teeth: int) -> Table:
    """Return a ring whose tips are short enough for every pinion, with a rim of three modules."""
    return {"teeth": teeth, "tip_alteration": "wang-2023", "rim_diameter": f"{module * (teeth + 8.5)} mm"}


def _loaded(
    rng: np.random.Generator, gears: Table, torque: float, speed: float, flank: str = "pinion"
) -> Table:
    depth = float(np.exp(rng.uniform(np.log(1.0), np.log(20.0))))
    return {
        "gears": gears,
        "operation": {"torque": f"{torque} N*m", "speed": f"{speed} rpm"},
        "mesh": {
            "damping_ratio": float(rng.uniform(0.04, 0.12)),
            "normal_backlash": "100 um",
            "stiffness": {"model": "potential-energy", "coupling": str(rng.choice(["shared", "none"]))},
        },
        "wear": {
            "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
            "until": {"depth": f"{depth} um", "flank": flank},
            "snapshots": {"depth": [f"{depth / 3.0} um"], "flank": flank},
        },
        "numerics": {"tolerance": float(rng.choice(TOLERANCES))},
    }


def _moving(rng: np.random.Generator, table: Table, motion: str, members: tuple[str, ...]) -> Table:
    """Return a table with its motion; what was drawn for another motion is drawn all the same."""
    bearing = {"radial_stiffness": f"{float(rng.uniform(300, 1500))} N/um", "damping_ratio": 0.06}
    if motion != "none":
        table["dynamics"] = {"model": motion}
        if motion in ("spur-3dof", "planetary"):
            grounded = bearing | {"tangential_stiffness": "50 N/um"}
            table["dynamics"]["supports"] = {
                member: grounded if member in GROUNDED else bearing for member in members
            }
    else:
        table["wear"]["load"] = "static"
    return table
