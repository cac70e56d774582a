"""Scenes of all kinds, drawn over decades: what the error estimates of runs are scored
on.

Three decades of load, mesh frequencies from far below a resonance to twice above it,
damping ratios of 0.005 to 0.2, backlash of none, 0 and 1 nm to 1 mm, every load that
wears, reliefs, errors of the meshes and of the members, friction. Every planetary set
has errors.
"""

from typing import Any

import numpy as np
from face_life_estimates import drawn as over_face

from wearlab.scene import Scene

Table = dict[str, Any]
KINDS = ("external-pair", "internal-pair", "planetary")
ROUND = 25
"""Scenes of a round: what each is, is drawn from its own number alone."""
INTERNAL = (1, 5, 9, 13, 17, 21)
PLANETARY = (3, 7, 11, 15, 19, 23)
FACE = (2, 6, 10, 14, 18, 22)
"""Which of a round are internal pairs, planetary sets in motion, and gears of any kind
with a face; the others are external pairs."""

PAIR_MOTION = ("none", "torsional", "spur-3dof")
SET_MOTION = ("planetary-torsional", "planetary")
GROUNDED = ("ring", "carrier")
LOADS = ("instant", "equivalent", "static")
TOLERANCES = (3e-3, 1e-3, 3e-4)

LOAD = (1e5, 1e8)
"""Force of a mesh over its module and face width, three decades [Pa]."""
SPEED_RATIO = (0.05, 2.2)
"""Mesh frequency over the natural frequency of a mesh on its own."""
DAMPING = (0.005, 0.2)
BACKLASH = (1e-9, 1e-3)
DEPTH = (0.5, 20.0)
"""Wear at the end of the life [µm]."""
RELIEF = (1.0, 15.0)
ERROR = (0.2, 5.0)
"""Amounts of tip relief and amplitudes of prescribed errors [µm]."""
FRICTION = (0.01, 0.2)
MESH_STIFFNESS, DENSITY = 1.4e10, 7830.0
"""Of a unit of face width [Pa], and of steel: roughly where the resonance lies."""
RIM = 8.5
"""Outer diameter of a ring over its module, less its teeth."""


def draw_any(seed: int, number: int) -> Scene:
    """Return scene ``number`` of a seed.

    Of 25, six are internal pairs, six planetary sets in motion, six have a face.
    """
    place = number % ROUND
    if place in FACE:
        return over_face(seed, number)
    kinds = dict.fromkeys(INTERNAL, internal_pair) | dict.fromkeys(
        PLANETARY, planetary_set
    )
    table = kinds.get(place, external_pair)(np.random.default_rng([seed, number]))
    return Scene.from_mapping(table)


def small_scenes() -> list[Scene]:
    """Return short scenes that between them need everything that scenes may need
    compiled.

    Under a hundredth of the load teeth part, and the orbit is found another way.
    """
    tables = [
        kind(np.random.default_rng(1), one)
        for kind in (external_pair, internal_pair)
        for one in PAIR_MOTION
    ]
    tables += [planetary_set(np.random.default_rng(1), motion) for motion in SET_MOTION]
    found = []
    for table in tables:
        for friction in (False, True):
            for share in (1.0, 0.01):
                if table.get("dynamics") is None and (friction or share < 1.0):
                    continue
                found.append(Scene.from_mapping(_small(table, friction, share)))
    return found


def _small(table: Table, friction: bool, share: float) -> Table:
    """Return a scene of a drawn one that takes a moment, with some of its load."""
    torque = share * float(table["operation"]["torque"].split()[0])
    small = table | {"operation": table["operation"] | {"torque": f"{torque} N*m"}}
    small["wear"] = {"coefficient": table["wear"]["coefficient"]}
    if share == 1.0:
        small["wear"]["until"] = {"depth": "0.3 um"}
    if "dynamics" in table:
        small["dynamics"] = {
            key: value for key, value in table["dynamics"].items() if key != "friction"
        }
        small["dynamics"] |= {"friction": {"coefficient": 0.1}} if friction else {}
    return small


def external_pair(rng: np.random.Generator, motion: str | None = None) -> Table:
    """Draw a pinion and a gear; ``motion`` is drawn unless it is given."""
    module = float(rng.choice([1.0, 2.0, 3.0, 4.0, 6.0, 8.0]))
    teeth = [int(count) for count in rng.integers(20, 61, size=2)]
    width = _width(rng, module)
    gears = {
        "kind": "external-pair",
        "module": f"{module} mm",
        "face_width": f"{width} mm",
        "pinion": {"teeth": teeth[0]},
        "gear": {"teeth": teeth[1]},
    }
    _relieve(rng, gears, ("pinion", "gear"), module)
    masses = [_mass(module, width, count) for count in teeth]
    speed = _mesh_frequency(rng, width, masses) / teeth[0]
    table = _loaded(
        rng,
        gears,
        _force(rng, module, width) * 0.5e-3 * module * teeth[0],
        speed,
        "pinion",
    )
    drawn = str(rng.choice(PAIR_MOTION, p=[0.15, 0.35, 0.5]))
    return _moving(rng, table, motion or drawn, ("pinion", "gear"), 0.1)


def internal_pair(rng: np.random.Generator, motion: str | None = None) -> Table:
    """Draw a pinion in a ring; ``motion`` is drawn unless it is given."""
    module = _module(rng)
    pinion = int(rng.integers(24, 41))
    ring = pinion + int(rng.integers(30, 81))
    width = _width(rng, module)
    gears = {
        "kind": "internal-pair",
        "module": f"{module} mm",
        "face_width": f"{width} mm",
        "pinion": {"teeth": pinion},
        "ring": _ring(module, ring),
    }
    _relieve(rng, gears, ("pinion",), module)
    speed = _mesh_frequency(rng, width, [_mass(module, width, pinion)]) / pinion
    table = _loaded(
        rng,
        gears,
        _force(rng, module, width) * 0.5e-3 * module * pinion,
        speed,
        "pinion",
    )
    drawn = str(rng.choice(PAIR_MOTION, p=[0.15, 0.35, 0.5]))
    return _moving(rng, table, motion or drawn, ("pinion", "ring"), 0.1)


def planetary_set(rng: np.random.Generator, motion: str | None = None) -> Table:
    """Draw a planetary set in motion, with three planets or four.

    ``motion`` is drawn unless it is given.
    """
    module = _module(rng)
    planets = int(rng.choice([3, 4], p=[0.75, 0.25]))
    sun, planet = (
        int(count) for count in rng.integers(18, 31 if planets == 3 else 25, size=2)
    )
    planet += (
        -(sun + planet) % planets
    )  # an even spacing has a multiple of them on 2 (sun + planet)
    ring = sun + 2 * planet
    width = _width(rng, module)
    gears = {
        "kind": "planetary",
        "module": f"{module} mm",
        "face_width": f"{width} mm",
        "planets": planets,
        "sun": {"teeth": sun},
        "planet": {"teeth": planet},
        "ring": _ring(module, ring),
        "carrier": {
            "mass": f"{2.0 * (module / 3.0) ** 3} kg",
            "inertia": f"{0.01 * (module / 3.0) ** 5} kg*m^2",
        },
    }
    _relieve(rng, gears, ("sun", "planet"), module)
    masses = [_mass(module, width, sun) / planets, _mass(module, width, planet)]
    speed = _mesh_frequency(rng, width, masses) * (sun + ring) / (sun * ring)
    torque = planets * _force(rng, module, width) * 0.5e-3 * module * sun
    table = _loaded(rng, gears, torque, speed, "sun")
    return _moving(
        rng,
        table,
        motion or str(rng.choice(SET_MOTION)),
        ("sun", "planet", "ring", "carrier"),
        0.4,
    )


def _decades(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _module(rng: np.random.Generator) -> float:
    return float(rng.choice([2.0, 3.0, 4.0]))


def _width(rng: np.random.Generator, module: float) -> float:
    return float(rng.uniform(5.0, 10.0)) * module


def _force(rng: np.random.Generator, module: float, width: float) -> float:
    """Return the force of a mesh [N], of lengths in mm."""
    return _decades(rng, *LOAD) * 1e-6 * module * width


def _mass(module: float, width: float, teeth: int) -> float:
    """Return the inertia of a disc over the square of its radius
    [kg], of lengths in mm.
    """
    return 0.5 * np.pi * DENSITY * 1e-3 * width * (0.5e-3 * module * teeth) ** 2


def _mesh_frequency(
    rng: np.random.Generator, width: float, masses: list[float]
) -> float:
    """Return a mesh frequency below, in or above the resonance of a
    mesh [Hz], width in mm.
    """
    effective = 1.0 / sum(1.0 / mass for mass in masses)
    natural = float(np.sqrt(MESH_STIFFNESS * 1e-3 * width / effective)) / (2.0 * np.pi)
    return _decades(rng, *SPEED_RATIO) * natural


def _ring(module: float, teeth: int) -> Table:
    """Return a ring whose tips are short enough for every pinion,
    with a rim of three modules.
    """
    return {
        "teeth": teeth,
        "tip_alteration": "wang-2023",
        "rim_diameter": f"{module * (teeth + RIM)} mm",
    }


def _relieve(
    rng: np.random.Generator, gears: Table, members: tuple[str, ...], module: float
) -> None:
    """Give two in five sets tip reliefs."""
    if rng.random() < 0.4:
        for member in members:
            gears[member]["tip_relief"] = {
                "amount": f"{_decades(rng, *RELIEF)} um",
                "length": f"{float(rng.uniform(0.4, 0.8)) * module} mm",
                "shape": str(rng.choice(["linear", "parabolic"])),
            }


def _loaded(
    rng: np.random.Generator, gears: Table, torque: float, speed: float, flank: str
) -> Table:
    """Return a scene under a torque [N m] and a speed [Hz] that wears its flanks."""
    depth = _decades(rng, *DEPTH)
    table: Table = {
        "gears": gears,
        "operation": {"torque": f"{torque} N*m", "speed": f"{60.0 * speed} rpm"},
        "mesh": {
            "damping_ratio": _decades(rng, *DAMPING),
            **_backlash(rng),
            **_stiffness(rng),
        },
        "wear": {
            "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
            "until": {"depth": f"{depth} um", "flank": flank},
            "load": str(rng.choice(LOADS, p=[0.6, 0.2, 0.2])),
        },
        "numerics": {"tolerance": float(rng.choice(TOLERANCES, p=[0.2, 0.6, 0.2]))},
    }
    if table["wear"]["load"] == "equivalent":
        table["wear"]["wohler_slope"] = float(rng.uniform(3.0, 10.0))
    if rng.random() < 0.5:
        table["wear"]["snapshots"] = {"depth": [f"{depth / 3.0} um"], "flank": flank}
    return table


def _backlash(rng: np.random.Generator) -> Table:
    drawn = rng.random()
    if drawn < 0.15:
        return {}
    return {
        "normal_backlash": "0 um" if drawn < 0.25 else f"{_decades(rng, *BACKLASH)} m"
    }


def _stiffness(rng: np.random.Generator) -> Table:
    drawn = rng.random()
    if drawn < 0.6:
        return {}  # that of the finite elements, which is the default
    return {
        "stiffness": {
            "model": "potential-energy",
            "coupling": "shared" if drawn < 0.8 else "none",
        }
    }


def _moving(
    rng: np.random.Generator,
    table: Table,
    motion: str,
    members: tuple[str, ...],
    frictional: float,
) -> Table:
    """Return a scene with its motion, errors and friction.

    Without motion the static force wears.
    """
    if motion == "none":
        table["wear"]["load"] = "static"
        return table
    table["dynamics"] = {"model": motion}
    if motion in ("spur-3dof", "planetary"):
        bearing = {
            "radial_stiffness": f"{_decades(rng, 200.0, 2000.0)} N/um",
            "damping_ratio": _decades(rng, 0.02, 0.2),
        }
        held = bearing | {"tangential_stiffness": "50 N/um"}
        grounded = GROUNDED if motion == "planetary" else ()
        table["dynamics"]["supports"] = {
            one: held if one in grounded else bearing for one in members
        }
    if rng.random() < frictional:
        table["dynamics"]["friction"] = {"coefficient": _decades(rng, *FRICTION)}
    drawn = rng.random()
    order = int(rng.integers(1, 4))
    amplitude = _decades(rng, *ERROR)
    if drawn < 0.4:
        table["errors"] = {
            "harmonic": [{"order": order, "amplitude": f"{amplitude} um"}]
        }
        if len(members) > 2:
            table["errors"]["harmonic"][0]["mesh"] = "sun-planet"
        else:
            table["errors"]["harmonic"][0]["mesh"] = "-".join(members)
    elif drawn < 0.45 and len(members) == 2:
        table["errors"] = {members[0]: {"total_composite": f"{amplitude} um"}}
    elif len(members) > 2:
        table["errors"] = {
            "harmonic": [
                {"order": order, "amplitude": f"{amplitude} um", "mesh": "planet-ring"}
            ]
        }
    return table
