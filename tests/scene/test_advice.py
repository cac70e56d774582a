"""Every refusal of a scene beyond its gears: an input, and its advice, taken."""

import copy
import re
from typing import Any

import measured_gear
import pytest
from geometry_refusals import changed
from scene_refusals import SceneRefusal, build_scene, scene_sites
from scenes import external_pair, planetary_set
from thermal_refusals import OF_THERMAL

from wearlab.gears.specification import GearError
from wearlab.scene import SceneError

MESH = {"stiffness": "potential-energy"}
DAMPED = {**MESH, "damping_ratio": 0.07}
TORSIONAL = {"model": "torsional"}
SWEEP = {"speed": {"from": "900 rpm", "to": "1100 rpm", "points": 3}}
CONSTANT = {"model": "constant", "value": "1e-18 m^2/N"}
CALIBRATED = {
    "model": "calibrated",
    "life": 1e7,
    "depth": "100 um",
    "flank": "pinion",
    "torque": "50 N*m",
    "speed": "1000 rpm",
}
PLAIN_WEAR = {"load": "static", "contact_patch": "none"}
WEAR = {**PLAIN_WEAR, "coefficient": CONSTANT, "until": {"cycles": 1e6}}
DUTY = [
    {"torque": "50 N*m", "speed": "1000 rpm", "share": 0.9},
    {"torque": "30 N*m", "speed": "900 rpm", "share": 0.1},
]
REVERSED = [DUTY[0], {"torque": "-30 N*m", "speed": "900 rpm", "share": 0.1}]
STAGES = [
    {"torque": "50 N*m", "speed": "1000 rpm", "cycles": 1e6},
    {"torque": "30 N*m", "speed": "900 rpm", "cycles": 1e6},
]
OPERATION = {"torque": "50 N*m", "speed": "1000 rpm"}
FOURIER = {"model": "fourier", "stiffness_harmonics": 3, "error_harmonics": 3}
FACE = {"misalignment": "0 um"}
"""Gives a scene a face."""


def pair(**sections: Any) -> dict[str, Any]:
    """Return the scene of an external pair of 20 and 40 teeth."""
    base = {"gears": external_pair(20, 40), "operation": OPERATION, "mesh": MESH}
    return copy.deepcopy({**base, **sections})


def moving(**sections: Any) -> dict[str, Any]:
    """Return the scene of a pair that vibrates."""
    return pair(**{"mesh": DAMPED, "dynamics": TORSIONAL, **sections})


def planetary(**sections: Any) -> dict[str, Any]:
    """Return the scene of a planetary set of 24, 24 and 72 teeth."""
    gears = planetary_set(
        24,
        24,
        {"teeth": 72, "rim_diameter": "250 mm"},
        carrier={"mass": "3 kg", "inertia": "0.01 kg*m^2"},
    )
    base = {"gears": gears, "operation": OPERATION, "mesh": MESH}
    return copy.deepcopy({**base, **sections})


def faced(**sections: Any) -> dict[str, Any]:
    """Return the scene of a pair with a face; ``mesh`` adds to its mesh."""
    mesh = {**MESH, **FACE, **sections.pop("mesh", {})}
    return pair(mesh=mesh, **sections)


def duty(*blocks: dict[str, Any]) -> dict[str, Any]:
    """Return the scene of a pair under a duty."""
    return pair(operation={"duty": list(blocks)})


def table(**options: Any) -> dict[str, Any]:
    """Return the scene of a pair under the duty of a file."""
    return pair(operation={"duty": {"file": "duty.csv", **options}})


def pitches(pitch: Any, **sections: Any) -> dict[str, Any]:
    """Return the scene of a pair whose pinion's pitches were measured."""
    errors = {"slow": "hunting", "pinion": {"pitch": pitch}}
    return moving(errors=errors, **sections)


def initial(**flank: Any) -> dict[str, Any]:
    """Return the scene of a pair whose pinion was measured."""
    return pair(wear={**WEAR, "initial": {"pinion": flank}})


def profile(first: float, last: float, depth: float = 3.0, count: int = 21) -> str:
    """Return a table of a measured profile, even in diameter [mm], of one depth."""
    step = (last - first) / (count - 1)
    rows = "".join(f"{first + step * n},{depth}\n" for n in range(count))
    return f"diameter [mm],depth [um]\n{rows}"


def across(first: float, last: float) -> str:
    """Return a table of a measured lead [mm], worn by 3 um."""
    return f"face_position [mm],depth [um]\n{first},3\n0,3\n{last},3\n"


TWENTY = [f"{n % 5} um" for n in range(19)] + ["0 um"]
ONE_TURN = "tooth,F_p [um]\n" + "".join(f"{n},{n % 20}\n" for n in range(1, 21))
DRIFTING = "tooth,F_p [um]\n" + "".join(f"{n},{n}\n" for n in range(1, 21))
SINGLE = "tooth,f_p [um]\n" + "1,5\n" + "".join(f"{n},0\n" for n in range(2, 21))
CLOSED_SINGLE = "tooth,f_p [um]\n1,1.9\n" + "".join(f"{n},-0.1\n" for n in range(2, 21))
HEAD = "torque [N*m],speed [rpm],share [h]\n"
TORQUES = "torque from [N*m],torque to [N*m],speed [rpm],share [h]\n"
SPEEDS = "torque [N*m],speed from [rpm],speed to [rpm],share [h]\n"
CYCLES = "torque [N*m],speed [rpm],cycles\n50,1000,1e6\n"
LOADS = f"{HEAD}50,1000,9\n30,900,1\n"
MKA = measured_gear.mka()
PITCHLESS = re.sub(r"\n  (linke|rechte) Zahnflanke.*", "", MKA, flags=re.DOTALL)
OF_24 = external_pair(24, 40, module="3 mm", face_width="30 mm")

OF_RULES: dict[str, SceneRefusal] = {
    "rules._meshes_of_the_set.1": SceneRefusal(
        planetary(
            mesh={
                **DAMPED,
                "damping_in": "always",
                "planet_ring": {"damping_in": "contact"},
            },
            dynamics={"model": "planetary-torsional"},
        ),
        {
            r"give it once, as mesh.damping_in, and leave it out of both": {
                "mesh.damping_in": "contact",
                "mesh.planet_ring": None,
            }
        },
    ),
    "rules._meshes_of_the_set.2": SceneRefusal(
        pair(mesh={**MESH, "sun_planet": {"damping_ratio": 0.05}}),
        {r"write it under \[mesh\]": {"mesh.sun_planet": None}},
    ),
    "rules._meshes_of_the_set.3": SceneRefusal(
        pair(operation={**OPERATION, "load_torque": "zero"}),
        {"leave it out": {"operation.load_torque": None}},
    ),
    "rules._harmonics.1": SceneRefusal(
        planetary(
            errors={
                "harmonic": [{"mesh": "sun-planet-4", "order": 1, "amplitude": "2 um"}]
            }
        ),
        {
            r"meshes 1 to (\d)": {
                "errors.harmonic": [
                    {"mesh": "sun-planet-3", "order": 1, "amplitude": "2 um"}
                ]
            }
        },
    ),
    "rules._pins.1": SceneRefusal(
        planetary(
            errors={
                "planet": {"planet_position": ["5 um"]},
                "carrier": {"planet_position": ["5 um"]},
            }
        ),
        {"give the pins' tolerances in one place": {"errors.planet": None}},
    ),
    "rules._pitches.1": SceneRefusal(
        pitches(
            TWENTY,
            dynamics={**TORSIONAL, "response": SWEEP},
            wear={"coefficient": CONSTANT},
        )
        | {"errors": {"pinion": {"pitch": TWENTY}}},
        {
            "give errors.slow = 'hunting', not 'averaged', and leave out "
            "dynamics.response": {
                "errors.slow": "hunting",
                "dynamics.response": None,
            }
        },
    ),
    "rules._pitches.2": SceneRefusal(
        pitches(["1 um", "0 um"]),
        {"give one for each": {"errors.pinion.pitch": TWENTY}},
    ),
    "rules._pitches.3": SceneRefusal(
        moving(
            errors={
                "slow": "hunting",
                "pinion": {"pitch": TWENTY, "total_composite": "9 um"},
            }
        ),
        {"leave out total_composite": {"errors.pinion.total_composite": None}},
    ),
    "rules._friction.1": SceneRefusal(
        moving(
            mesh={**DAMPED, "excitation": FOURIER},
            dynamics={**TORSIONAL, "friction": {"coefficient": 0.05}},
        ),
        {"give mesh.excitation = 'pairs'": {"mesh.excitation": "pairs"}},
    ),
    "rules._moving_parts.1": SceneRefusal(
        moving(mesh=MESH),
        {
            "give 'damping' such as '1000 N": {"mesh.damping": "1000 N*s/m"},
            "or 'damping_ratio'": {"mesh.damping_ratio": 0.05},
        },
    ),
    "rules._moving_parts.2": SceneRefusal(
        moving(mesh={**DAMPED, "damping_law": "hunt-crossley", "damping_in": "always"}),
        {"leave it out": {"mesh.damping_in": None}},
    ),
    "rules._moving_parts.3": SceneRefusal(
        planetary(
            gears=planetary_set(24, 24, {"teeth": 72, "rim_diameter": "250 mm"}),
            mesh=DAMPED,
            dynamics={"model": "planetary-torsional"},
        ),
        {
            r"such as '(2.8 kg)'(?s:.*)such as '(11000 kg\*mm\^2)'": {
                "gears.carrier": {"mass": "2.8 kg", "inertia": "11000 kg*mm^2"}
            }
        },
    ),
    "rules._response.1": SceneRefusal(
        moving(
            dynamics={
                **TORSIONAL,
                "response": {
                    "speed": {"from": "1100 rpm", "to": "900 rpm", "points": 3}
                },
            }
        ),
        {
            'direction = "down" goes the other way': {
                "dynamics.response": {**SWEEP, "direction": "down"}
            }
        },
    ),
    "rules._response.2": SceneRefusal(
        moving(dynamics={**TORSIONAL, "method": "rk4", "response": SWEEP}),
        {"needs method 'periodic'": {"dynamics.method": "periodic"}},
    ),
    "rules._response.3": SceneRefusal(
        pitches(TWENTY, dynamics={**TORSIONAL, "response": SWEEP}),
        {
            "give 'averaged'": {"errors.slow": "averaged", "errors.pinion": None},
            "or 'frozen' without errors.pinion.pitch": {
                "errors.slow": "frozen",
                "errors.pinion": None,
            },
            "or leave it out": {"dynamics.response": None},
        },
    ),
    "rules._fluctuation.1": SceneRefusal(
        planetary(
            operation={
                **OPERATION,
                "torque_fluctuation": {"order": 1, "amplitude": "5 N*m"},
            },
            mesh=DAMPED,
            dynamics={"model": "planetary-torsional"},
        ),
        {"leave it out": {"operation.torque_fluctuation": None}},
    ),
    "rules._fluctuation.2": SceneRefusal(
        moving(
            operation={
                **OPERATION,
                "torque_fluctuation": {"order": 0.5, "amplitude": "5 N*m"},
            },
            dynamics={**TORSIONAL, "response": SWEEP},
        ),
        {"give whole orders": {"operation.torque_fluctuation.order": 2}},
    ),
    "rules._requested.1": SceneRefusal(
        planetary(store={"variables": ["mesh_deflection_orders"]}),
        {
            r"model = '([\w-]+)' with mesh.damping_ratio and mass and inertia": {
                "dynamics": {"model": "{0}"},
                "mesh.damping_ratio": 0.05,
            },
            r"leave it out of \[store\] variables": {"store": None},
        },
    ),
    "rules._requested.2": SceneRefusal(
        moving(
            dynamics={**TORSIONAL, "response": SWEEP},
            store={"variables": ["mesh_deflection_orders"]},
        ),
        {"leave one out": {"store": None}, "": {"dynamics.response": None}},
    ),
    "rules._extended.1": SceneRefusal(
        pair(mesh={**MESH, "contact": "algorithm-1", "extended_contact": True}),
        {
            "give mesh.contact = '(displacement)'": {"mesh.contact": "{0}"},
            "or '(exact)'": {"mesh.contact": "{0}"},
            "or leave it out": {"mesh.extended_contact": None},
        },
    ),
    "rules._extended.2": SceneRefusal(
        pair(
            mesh={
                "stiffness": {
                    "model": "constant",
                    "value": "400 N/um",
                    "of": "mesh",
                },
                "extended_contact": True,
            }
        ),
        {
            "give of = 'pair'": {"mesh.stiffness.of": "pair"},
            "or leave it out": {"mesh.extended_contact": None},
        },
    ),
    "rules._start.1": SceneRefusal(
        pair(wear=WEAR, start={"run": "0" * 20, "replace": ["ring"]}),
        {"there are pinion, gear": {"start.replace": ["gear"]}},
    ),
    "rules._start.2": SceneRefusal(
        pair(
            wear={**WEAR, "initial": {"pinion": {"depth": "2 um", "shape": "uniform"}}},
            start={"run": "0" * 20},
        ),
        {"leave one out": {"start": None}, "": {"wear.initial": None}},
    ),
    "rules._conditions.1": SceneRefusal(
        planetary(operation={"duty": REVERSED}),
        {
            "leave such rows out": {
                "operation.duty": [{**REVERSED[0], "share": 1.0}],
            },
            "as a scene of their own with the other drive_flank": {
                "operation": {
                    "torque": "30 N*m",
                    "speed": "900 rpm",
                    "drive_flank": "left",
                }
            },
        },
    ),
    "rules._conditions.2": SceneRefusal(
        moving(operation={"duty": DUTY}, dynamics={**TORSIONAL, "response": SWEEP}),
        {"leave one out": {"dynamics.response": None}, "": {"operation": OPERATION}},
    ),
    "rules._conditions.3": SceneRefusal(
        pair(operation={"stage": STAGES}),
        {"need wear.coefficient": {"wear": {**PLAIN_WEAR, "coefficient": CONSTANT}}},
    ),
    "rules._conditions.4": SceneRefusal(
        pair(
            operation={"stage": [STAGES[0], {**OPERATION}]},
            wear={**PLAIN_WEAR, "coefficient": CONSTANT},
        ),
        {
            "the last stage needs 'cycles'": {"operation.stage": STAGES},
            "or give wear.until": {"wear.until": {"cycles": 3e6}},
        },
    ),
    "rules._calibrated.1": SceneRefusal(
        pair(wear={**WEAR, "coefficient": {"pinion": CALIBRATED, "gear": CONSTANT}}),
        {"one coefficient for all members": {"wear.coefficient": CALIBRATED}},
    ),
    "rules._calibrated.2": SceneRefusal(
        pair(wear={**WEAR, "coefficient": {**CALIBRATED, "flank": "sun"}}),
        {"there are pinion, gear": {"wear.coefficient.flank": "gear"}},
    ),
    "rules._back_limits.1": SceneRefusal(
        pair(wear={**WEAR, "until": {"depth": "20 um", "flank": "pinion-back"}}),
        {"give '(pinion)'": {"wear.until.flank": "pinion"}},
    ),
    "rules._limits.1": SceneRefusal(
        pair(wear={**PLAIN_WEAR, "until": {"cycles": 1e6}}),
        {
            'model = "constant", value = "9.65e-19 m': {
                "wear.coefficient": {"model": "constant", "value": "9.65e-19 m^2/N"}
            }
        },
    ),
    "rules._limits.2": SceneRefusal(
        pair(
            wear={
                **PLAIN_WEAR,
                "coefficient": CONSTANT,
                "snapshots": {"cycles": [1e5]},
            }
        ),
        {"snapshots need 'until'": {"wear.until": {"cycles": 1e6}}},
    ),
    "rules._initial.1": SceneRefusal(
        pair(wear={**WEAR, "initial": {"sun": {"depth": "2 um", "shape": "uniform"}}}),
        {
            "there are pinion, gear": {
                "wear.initial": {"gear": {"depth": "2 um", "shape": "uniform"}}
            }
        },
    ),
    "rules._initial.2": SceneRefusal(
        pair(wear={**PLAIN_WEAR, "initial": {"pinion": {"depth": "2 um"}}}),
        {
            "needs 'wear.coefficient'": {"wear.coefficient": CONSTANT},
            "or give 'quadratic'": {"wear.initial.pinion.shape": "quadratic"},
            "or 'uniform'": {"wear.initial.pinion.shape": "uniform"},
        },
    ),
    "rules._one_planet.1": SceneRefusal(
        planetary(
            wear={
                **WEAR,
                "initial": {"sun": {"depth": "2 um", "shape": "uniform", "planet": 1}},
            }
        ),
        {"leave it out": {"wear.initial.sun.planet": None}},
    ),
    "rules._one_planet.2": SceneRefusal(
        planetary(
            wear={
                **WEAR,
                "initial": {
                    "planet-sun": {"depth": "2 um", "shape": "uniform", "planet": 4}
                },
            }
        ),
        {r"planets 1 to (\d)": {"wear.initial.planet-sun.planet": 3}},
    ),
    "rules._one_planet.3": SceneRefusal(
        planetary(
            wear={
                **WEAR,
                "initial": {
                    "planet-sun": {
                        "depth": "2 um",
                        "shape": "uniform",
                        "planet": 2,
                        "sides": "both",
                    }
                },
            }
        ),
        {
            "give sides = 'drive'": {"wear.initial.planet-sun.sides": "drive"},
            "or leave planet out": {"wear.initial.planet-sun.planet": None},
        },
    ),
    "rules._one_planet.4": SceneRefusal(
        planetary(
            mesh={**MESH, **FACE},
            wear={
                **WEAR,
                "initial": {
                    "planet-sun": {"depth": "2 um", "shape": "uniform", "planet": 2}
                },
            },
        ),
        {
            "leave it out": {"wear.initial.planet-sun.planet": None},
            "or mesh.sun_planet.misalignment and": {"mesh.misalignment": None},
        },
    ),
    "rules._projection.1": SceneRefusal(
        pair(
            mesh={**MESH, "contact": "exact"},
            wear={**WEAR, "projection": "over-cosine"},
        ),
        {
            "give mesh.contact = 'displacement'": {"mesh.contact": "displacement"},
            "or projection = 'normal'": {"wear.projection": "normal"},
        },
    ),
    "rules._projection.2": SceneRefusal(
        faced(wear={**WEAR, "projection": "over-cosine"}),
        {
            "give projection = 'normal'": {"wear.projection": "normal"},
            "or leave mesh.misalignment out": {"mesh.misalignment": None},
        },
    ),
    "rules._rating.1": SceneRefusal(
        planetary(rating={"application_factor": 1.25}),
        {"leave it out": {"rating": None}},
    ),
    "rules._face.1": SceneRefusal(
        faced(errors={"pinion": {"total_composite": "10 um"}}),
        {
            r"leave \[errors\] out": {"errors": None},
            "or leave mesh.misalignment out and give mesh.face_load_factor": {
                "mesh.misalignment": None,
                "mesh.face_load_factor": 1.2,
            },
        },
    ),
    "rules._face.2": SceneRefusal(
        faced(wear=WEAR, start={"run": "0" * 20}),
        {
            "give wear.initial instead": {
                "start": None,
                "wear.initial": {"pinion": {"depth": "2 um", "shape": "uniform"}},
            }
        },
    ),
    "rules._face.3": SceneRefusal(
        faced(wear={**WEAR, "coefficient": CALIBRATED}),
        {"give the coefficient's value": {"wear.coefficient": CONSTANT}},
    ),
    "rules._measured.1": SceneRefusal(
        initial(file="lead.csv"),
        {
            "give mesh.face_points, such as 41": {"mesh.face_points": 41},
            "or a file of one profile": {
                "wear.initial.pinion.file": "profile.csv",
            },
        },
        {"lead.csv": across(-10.0, 10.0), "profile.csv": profile(56.5, 66.0)},
    ),
    "rules._measured.2": SceneRefusal(
        faced(
            wear={**WEAR, "initial": {"pinion": {"file": "lead.csv", "sides": "both"}}}
        ),
        {"give 'drive'": {"wear.initial.pinion.sides": "drive"}},
        {"lead.csv": across(-10.0, 10.0)},
    ),
    "rules._in_motion.1": SceneRefusal(
        moving(
            mesh={**DAMPED, **FACE},
            dynamics={**TORSIONAL, "friction": {"coefficient": 0.05}},
        ),
        {"leave it out": {"dynamics.friction": None}},
    ),
    "rules._in_motion.2": SceneRefusal(
        moving(mesh={**DAMPED, **FACE}, dynamics={**TORSIONAL, "response": SWEEP}),
        {"sweep operation.speed instead": {"dynamics.response": None}},
    ),
    "rules._in_motion.3": SceneRefusal(
        moving(mesh={**DAMPED, **FACE, "excitation": FOURIER}),
        {
            "give 'pairs'": {"mesh.excitation": "pairs"},
            "or leave it out": {"mesh.excitation": None},
        },
    ),
    "rules._in_motion.4": SceneRefusal(
        moving(
            mesh={**DAMPED, **FACE},
            wear={
                "contact_patch": "none",
                "coefficient": CONSTANT,
                "load": "equivalent",
                "wohler_slope": 6.6,
            },
        ),
        {
            "give wear.load = 'instant'": {
                "wear.load": "instant",
                "wear.wohler_slope": None,
            },
            "or 'static', and leave it out": {
                "wear.load": "static",
                "wear.wohler_slope": None,
            },
        },
    ),
    "rules._mesh_of_a_face.1": SceneRefusal(
        faced(mesh={"face_load_factor": 1.2}),
        {
            "leave one out": {"mesh.face_load_factor": None},
            "": {"mesh.misalignment": None},
        },
    ),
    "rules._mesh_of_a_face.2": SceneRefusal(
        faced(
            mesh={"stiffness": {"model": "constant", "value": "400 N/um", "of": "mesh"}}
        ),
        {"give 'pair'": {"mesh.stiffness.of": "pair"}},
    ),
    "rules._mesh_of_a_face.3": SceneRefusal(
        faced(
            mesh={"stiffness": {"model": "potential-energy", "load_direction": "worn"}}
        ),
        {
            "give 'ideal'": {"mesh.stiffness.load_direction": "ideal"},
            "or leave it out": {"mesh.stiffness.load_direction": None},
        },
    ),
    "rules._mesh_of_a_face.4": SceneRefusal(
        faced(
            mesh={
                "stiffness": {"model": "constant", "value": "400 N/um", "of": "pair"},
                "face_coupling": "pasternak",
            }
        ),
        {
            "give 'none'": {"mesh.face_coupling": "none"},
            "or another mesh.stiffness": {"mesh.stiffness": "potential-energy"},
        },
    ),
    "rules._mesh_of_a_face.5": SceneRefusal(
        faced(mesh={"face_coupling": "elements"}),
        {
            "mesh.stiffness = 'finite-element': give that": {
                "mesh.stiffness": "finite-element"
            },
            "or 'pasternak'": {"mesh.face_coupling": "pasternak"},
        },
    ),
    "rules._mesh_of_a_face.6": SceneRefusal(
        faced(mesh={"contact": "exact"}),
        {"give 'displacement'": {"mesh.contact": "displacement"}},
    ),
}
OF_RULES["rules._rating.2"] = SceneRefusal(
    pair(
        gears=external_pair(
            {"teeth": 20, "roughness_ra": "0.4 um"},
            {"teeth": 40, "roughness_ra": "0.4 um"},
        ),
        rating={"application_factor": 1.25, "allowable_contact_stress": "1500 MPa"},
    ),
    {
        "the safety against pitting also takes": {
            "rating.allowable_contact_stress": None
        }
    },
)

OF_OPERATION: dict[str, SceneRefusal] = {
    "operation._middle.read.1": SceneRefusal(
        duty({**DUTY[0], "share": 1.0, "torque": ["1 N*m", "2 N*m", "3 N*m"]}),
        {
            "give two values": {
                "operation.duty": [
                    {**DUTY[0], "torque": ["1 N*m", "2 N*m"], "share": 1}
                ]
            },
            "or one": {"operation.duty": [{**DUTY[0], "share": 1.0}]},
        },
    ),
    "operation._middle.read.2": SceneRefusal(
        duty({**DUTY[0], "share": 1.0, "torque": ["-10 N*m", "20 N*m"]}),
        {
            "split it at 0 into two conditions": {
                "operation.duty": [
                    {**DUTY[0], "torque": ["-10 N*m", "0 N*m"], "share": 0.5},
                    {**DUTY[0], "torque": ["0 N*m", "20 N*m"], "share": 0.5},
                ]
            }
        },
    ),
    "operation.DutyBlock._check.1": SceneRefusal(
        duty(OPERATION),
        {
            f"give .*'{key}'": {"operation.duty": [{**OPERATION, key: value}]}
            for key, value in (("share", 1.0), ("hours", 20.0), ("cycles", 1e6))
        },
    ),
    "operation._blocks.1": SceneRefusal(
        pair(operation={"duty": "duty.csv"}),
        {r'write duty = \{ file = "(.*)" \}': {"operation.duty": {"file": "{0}"}}},
        {"duty.csv": LOADS},
    ),
    "operation._blocks.2": SceneRefusal(
        pair(operation={"duty": {**DUTY[0], "share": 1.0}}),
        {
            "give file, sheet": {"operation.duty": {"file": "duty.csv"}},
            "or a list of {torque, speed, share}": {
                "operation.duty": [{**DUTY[0], "share": 1.0}]
            },
        },
        {"duty.csv": LOADS},
    ),
    "operation._blocks.3": SceneRefusal(
        pair(operation={"duty": {"units": {"share": "h"}}}),
        {"'file' is required": {"operation.duty.file": "duty.csv"}},
        {"duty.csv": LOADS},
    ),
    "operation._shares.1": SceneRefusal(
        duty({**OPERATION, "share": 0.5}, {**OPERATION, "hours": 9.0}),
        {
            "give one of them in all conditions": {
                "operation.duty": [
                    {**OPERATION, "hours": 9.0},
                    {**OPERATION, "hours": 9.0},
                ]
            }
        },
    ),
    "operation._shares.2": SceneRefusal(
        duty(
            {**OPERATION, "cycles": 1e6}, {**OPERATION, "speed": "0 rpm", "cycles": 1}
        ),
        {
            "give its 'speed'": {
                "operation.duty": [
                    {**OPERATION, "cycles": 1e6},
                    {**OPERATION, "speed": "5 rpm", "cycles": 1},
                ]
            },
            "or 'hours' in all conditions": {
                "operation.duty": [
                    {**OPERATION, "hours": 16.0},
                    {**OPERATION, "speed": "0 rpm", "hours": 1},
                ]
            },
        },
    ),
    "operation._shares.3": SceneRefusal(
        duty({**OPERATION, "share": 0.5}),
        {
            "mend them": {"operation.duty": [{**OPERATION, "share": 1.0}]},
            "or give 'hours' in place of 'share'": {
                "operation.duty": [{**OPERATION, "hours": 0.5}]
            },
        },
    ),
    "operation._some_loaded.1": SceneRefusal(
        duty({**OPERATION, "torque": "0 N*m", "share": 1.0}),
        {
            "give one that loads turning gears": {
                "operation.duty": [{**OPERATION, "share": 1.0}]
            }
        },
    ),
    "operation._labels.1": SceneRefusal(
        pair(operation={"stage": []}, wear=WEAR),
        {"give torque, speed and cycles of each": {"operation.stage": STAGES}},
    ),
    "operation._labels.2": SceneRefusal(
        pair(operation={"stage": [OPERATION, STAGES[1]]}, wear=WEAR),
        {"stage 1 needs 'cycles'": {"operation.stage": STAGES}},
    ),
    "operation._labels.3": SceneRefusal(
        pair(
            operation={"stage": [{**stage, "label": "a"} for stage in STAGES]},
            wear=WEAR,
        ),
        {"give each its own": {"operation.stage": STAGES}},
    ),
    "operation.TorqueFluctuation._check.1": SceneRefusal(
        moving(operation={**OPERATION, "torque_fluctuation": {"amplitude": "5 N*m"}}),
        {
            "give its 'order'": {"operation.torque_fluctuation.order": 1},
            "or its 'frequency', \"(25 Hz)\"": {
                "operation.torque_fluctuation.frequency": "{0}"
            },
        },
    ),
    "operation.Operation._complete.1": SceneRefusal(
        planetary(operation={**OPERATION, "fixed": "sun"}),
        {
            "give input = '(ring)' or": {"operation.input": "{0}"},
            "or '(carrier)'": {"operation.input": "{0}"},
        },
    ),
    "operation.Operation._known_members.1": SceneRefusal(
        pair(operation={**OPERATION, "fixed": "gear"}),
        {"leave it out": {"operation.fixed": None}},
    ),
    "operation.Operation._known_members.2": SceneRefusal(
        pair(operation={**OPERATION, "input": "ring"}),
        {"there are pinion, gear": {"operation.input": "gear"}},
    ),
    "operation.Operation._one_alternative.1": SceneRefusal(
        pair(operation={**OPERATION, "power": "20 kW"}),
        {"leave one out": {"operation.power": None}, "": {"operation.torque": None}},
    ),
    "operation.Operation._check.1": SceneRefusal(
        pair(operation={**OPERATION, "input": "gear", "output": "gear"}),
        {"give each a member of its own": {"operation.output": "pinion"}},
    ),
    "operation.Operation._check.2": SceneRefusal(
        pair(operation={"torque": "0 N*m", "power": "20 kW"}),
        {
            "give speed in place of power": {"operation": {**OPERATION}},
            "or a torque": {"operation.torque": "340 N*m"},
        },
    ),
    "operation.Operation._check.3": SceneRefusal(
        pair(operation={"torque": "50 N*m"}),
        {
            "such as '(340 N.m)' and '(1100 rpm)'": {
                "operation": {"torque": "340 N*m", "speed": "1100 rpm"}
            },
            "or power with one of them": {"operation.power": "20 kW"},
        },
    ),
    "operation.Operation._leave_to_conditions.1": SceneRefusal(
        pair(operation={"duty": DUTY, "stage": STAGES}, wear=WEAR),
        {
            "give one of 'duty'": {"operation.stage": None},
            "and 'stage'": {"operation.duty": None},
        },
    ),
    "operation.Operation._leave_to_conditions.2": SceneRefusal(
        pair(operation={**OPERATION, "torque": "60 N*m", "duty": DUTY}),
        {
            r"leave operation.torque out": {
                "operation.torque": None,
                "operation.speed": None,
            },
        },
    ),
    "limits._of_the_set.1": SceneRefusal(
        pair(wear={**WEAR, "until": {"depth": "9 um", "flank": "sun"}}),
        {"there are pinion, gear": {"wear.until.flank": "gear"}},
    ),
    "limits.Until._check.1": SceneRefusal(
        pair(wear={**WEAR, "until": {}}),
        {
            "'cycles'": {"wear.until.cycles": 1e6},
            "'mesh_cycles'": {"wear.until.mesh_cycles": 1e6},
            "'hours'": {"wear.until.hours": 100},
            "'depth'": {"wear.until.depth": "9 um"},
        },
    ),
    "limits.Until._check.2": SceneRefusal(
        pair(wear={**WEAR, "until": {"cycles": 1e6, "flank": "gear"}}),
        {"'flank' belongs to a 'depth'": {"wear.until.depth": "9 um"}},
    ),
    "limits.SnapshotOptions._check.1": SceneRefusal(
        pair(wear={**WEAR, "snapshots": {}}),
        {
            "'cycles'": {"wear.snapshots.cycles": [1e5]},
            "'mesh_cycles'": {"wear.snapshots.mesh_cycles": [1e5]},
            "'depth'": {"wear.snapshots.depth": ["2 um"]},
        },
    ),
    "start._identity.1": SceneRefusal(
        pair(wear=WEAR, start={"run": "abc"}),
        {"20 hexadecimal digits": {"start.run": "0" * 20}},
    ),
    "start.Start._check.1": SceneRefusal(
        pair(wear=WEAR, start={"cycle": 0}),
        {"give 'run'": {"start.run": "0" * 20}},
    ),
    "mesh.Misalignment._check.1": SceneRefusal(
        pair(mesh={**MESH, "misalignment": {}}),
        {
            "such as '(20 um)'": {"mesh.misalignment": "20 um"},
            "value": {"mesh.misalignment.value": "20 um"},
            "or in_plane and out_of_plane": {
                "mesh.misalignment": {"in_plane": "5 um", "out_of_plane": "5 um"}
            },
        },
    ),
    "mesh.Misalignment._check.2": SceneRefusal(
        pair(
            mesh={
                **MESH,
                "misalignment": {
                    "torque": ["90 N*m", "10 N*m"],
                    "value": ["9 um", "1 um"],
                },
            }
        ),
        {
            "sort it, and the values with it": {
                "mesh.misalignment": {
                    "torque": ["10 N*m", "90 N*m"],
                    "value": ["1 um", "9 um"],
                }
            }
        },
    ),
    "mesh.Misalignment._check.3": SceneRefusal(
        pair(
            mesh={
                **MESH,
                "misalignment": {"torque": ["10 N*m", "90 N*m"], "value": ["9 um"]},
            }
        ),
        {
            "one for each torque": {"mesh.misalignment.value": ["1 um", "9 um"]},
            "or one": {"mesh.misalignment": "9 um"},
        },
    ),
    "coefficient._per_member.1": SceneRefusal(
        pair(wear={**WEAR, "coefficient": {"sun": CONSTANT}}),
        {
            "there are pinion, gear": {
                "wear.coefficient": {"pinion": CONSTANT, "gear": CONSTANT}
            }
        },
    ),
}

OF_TABLES: dict[str, SceneRefusal] = {
    "duty_file.load_table_of.1": SceneRefusal(
        table(columns={"time": "share"}),
        {
            "torque, speed and one of share": {
                "operation.duty.columns": {"share": "share"}
            }
        },
        {"duty.csv": LOADS},
    ),
    "duty_file.middle_of.1": SceneRefusal(
        table(),
        {
            "split it at 0 into two conditions": {
                "file:duty.csv": f"{TORQUES}-10,0,1000,1\n0,20,1000,1\n"
            }
        },
        {"duty.csv": f"{TORQUES}-10,20,1000,1\n"},
    ),
    "duty_file.ranges_of.1": SceneRefusal(
        table(columns={"torque": ["a", "b"]}),
        {"name two that are there": {"operation.duty.columns.torque": ["low", "high"]}},
        {"duty.csv": "low [N*m],high [N*m],speed [rpm],share [h]\n10,20,1000,1\n"},
    ),
    "duty_file.with_middles.1": SceneRefusal(
        table(),
        {"write both in one": {"file:duty.csv": f"{TORQUES}10,20000,1000,1\n"}},
        {
            "duty.csv": "torque from [N*m],torque to [kN*m],speed [rpm],share [h]\n"
            "10,20,1000,1\n"
        },
    ),
    "duty_file.with_middles.2": SceneRefusal(
        table(),
        {
            "split it at 0 into two conditions": {
                "file:duty.csv": f"{SPEEDS}10,-20,0,1\n10,0,20,1\n"
            }
        },
        {"duty.csv": f"{SPEEDS}10,-20,20,1\n"},
    ),
    "duty_file._time_key.1": SceneRefusal(
        table(columns={"share": "share", "hours": "h"}),
        {
            "give one of share": {"operation.duty.columns": {"share": "share"}},
            "and hours": {"operation.duty.columns": {"hours": "h"}},
        },
        {"duty.csv": "torque [N*m],speed [rpm],share,h\n50,1000,0.9,9\n30,900,0.1,1\n"},
    ),
    "duty_file._times_of_cycles.1": SceneRefusal(
        table(),
        {
            "give its speed": {"file:duty.csv": f"{CYCLES}30,5,5\n"},
            "or a column of hours": {
                "file:duty.csv": "torque [N*m],speed [rpm],hours\n50,1000,9\n30,0,5\n"
            },
            "or delete the row": {"file:duty.csv": CYCLES},
        },
        {"duty.csv": f"{CYCLES}30,0,5\n"},
    ),
    "duty_file._refuse_other_cycles.1": SceneRefusal(
        table(),
        {
            r'columns = { hours = "(hours)" }': {
                "operation.duty.columns": {"hours": "{0}"}
            },
            r'or { cycles = "(cycles)" }': {
                "operation.duty.columns": {"cycles": "{0}"}
            },
        },
        {"duty.csv": "torque [N*m],speed [rpm],hours,cycles\n50,1000,1,1e6\n"},
    ),
    "duty_file._refuse_rows.1": SceneRefusal(
        table(),
        {
            "mend it": {"file:duty.csv": LOADS},
            "or delete the row": {"file:duty.csv": f"{HEAD}50,1000,9\n"},
        },
        {"duty.csv": f"{HEAD}50,1000,9\n30,900,-1\n"},
    ),
    "duty_file._refuse_rows.2": SceneRefusal(
        table(),
        {"give each condition its time": {"file:duty.csv": LOADS}},
        {"duty.csv": f"{HEAD}50,1000,0\n30,900,0\n"},
    ),
    "duty_file._refuse_lacking.1": SceneRefusal(
        table(),
        {
            r"columns = { (share) = \"…\" }": {
                "operation.duty.columns": {"share": "part"}
            }
        },
        {"duty.csv": "torque [N*m],speed [rpm],part\n50,1000,1\n"},
    ),
    "duty_file._refuse_lacking.2": SceneRefusal(
        table(),
        {
            r'units = { torque = "(.*)", speed = "(.*)" }': {
                "operation.duty.units": {"torque": "{0}", "speed": "{1}"}
            }
        },
        {"duty.csv": "torque,speed,share\n50,1000,0.9\n30,900,0.1\n"},
    ),
    "duty_file._shares.1": SceneRefusal(
        table(),
        {
            "mend a share": {
                "file:duty.csv": "torque [N*m],speed [rpm],share\n50,1000,1\n"
            },
            r'units = { share = "(h)" }': {"operation.duty.units": {"share": "{0}"}},
        },
        {"duty.csv": "torque [N*m],speed [rpm],share\n50,1000,0.5\n30,900,0.1\n"},
    ),
    "pitch_table.PitchTable._check.1": SceneRefusal(
        pitches([]), {"or a list of F_p": {"errors.pinion.pitch": TWENTY}}
    ),
    "pitch_table.PitchTable._check.2": SceneRefusal(
        pitches({"file": "p.csv", "quantity": "f_p"}),
        {
            "give f_p less its mean": {"file:p.csv": CLOSED_SINGLE},
            "or F_p with quantity = '(F_p)'": {
                "errors.pinion.pitch.quantity": "{0}",
                "file:p.csv": ONE_TURN,
            },
        },
        {"p.csv": SINGLE.replace("1,5", "1,40")},
    ),
    "pitch_table.PitchTable._check.3": SceneRefusal(
        pitches({"file": "p.csv"}),
        {
            "count F_p from the last tooth on": {"file:p.csv": ONE_TURN},
            "or give quantity = '(f_p)' where these are single": {
                "errors.pinion.pitch.quantity": "{0}",
                "file:p.csv": CLOSED_SINGLE,
            },
        },
        {"p.csv": DRIFTING},
    ),
    "pitch_table._read.1": SceneRefusal(
        pitches({"file": "p.csv", "units": 5}),
        {"give units = '(um)'": {"errors.pinion.pitch.units": "{0}"}},
        {"p.csv": ONE_TURN},
    ),
    "pitch_table._read.2": SceneRefusal(
        pitches({"file": "p.csv", "quantity": "Fp"}),
        {"not one of '(F_p)'": {"errors.pinion.pitch.quantity": "{0}"}},
        {"p.csv": ONE_TURN},
    ),
    "pitch_table._read.3": SceneRefusal(
        pitches({"file": "p.csv", "side": "left"}),
        {"leave it out": {"errors.pinion.pitch.side": None}},
        {"p.csv": ONE_TURN},
    ),
    "pitch_table._require_order.1": SceneRefusal(
        pitches({"file": "p.csv"}),
        {"number teeth 1, 2, 3": {"file:p.csv": ONE_TURN}},
        {"p.csv": ONE_TURN.replace("\n2,", "\nZ2,")},
    ),
    "pitch_table._require_order.2": SceneRefusal(
        pitches({"file": "p.csv"}),
        {
            "give each tooth once, sorted by its number from 1 on": {
                "file:p.csv": ONE_TURN
            }
        },
        {"p.csv": ONE_TURN.replace("\n2,", "\n22,")},
    ),
    "pitch_table._of_machine.1": SceneRefusal(
        pitches({"file": "p.mka", "side": "left", "units": "um"}, gears=OF_24),
        {"leave out units": {"errors.pinion.pitch.units": None}},
        {"p.mka": MKA},
    ),
    "pitch_table._of_machine.2": SceneRefusal(
        pitches({"file": "p.mka", "side": "left"}, gears=OF_24),
        {
            "export the measurement with its pitches": {"file:p.mka": MKA},
            "or give a list of F_p": {"errors.pinion.pitch": ["1 um"] * 23 + ["0 um"]},
        },
        {"p.mka": PITCHLESS},
    ),
    "pitch_table._of_machine.3": SceneRefusal(
        pitches({"file": "p.mka"}, gears=OF_24),
        {
            "side = '(left)'": {"errors.pinion.pitch.side": "{0}"},
            "or side = '(right)'": {"errors.pinion.pitch.side": "{0}"},
        },
        {"p.mka": MKA},
    ),
    "errors.ErrorHarmonic._known_mesh.1": SceneRefusal(
        planetary(errors={"harmonic": [{"order": 1, "amplitude": "2 um"}]}),
        {
            "required: '(sun-planet)' or '(planet-ring)'": {
                "errors.harmonic": [
                    {"mesh": "sun-planet", "order": 1, "amplitude": "2 um"}
                ]
            },
            "one of them by its number": {
                "errors.harmonic": [
                    {"mesh": "sun-planet-2", "order": 1, "amplitude": "2 um"}
                ]
            },
        },
    ),
    "errors.ErrorHarmonic._known_mesh.2": SceneRefusal(
        planetary(
            errors={"harmonic": [{"mesh": "sun-ring", "order": 1, "amplitude": "2 um"}]}
        ),
        {
            "there are sun-planet": {
                "errors.harmonic": [
                    {"mesh": "sun-planet", "order": 1, "amplitude": "2 um"}
                ]
            }
        },
    ),
    "errors.ErrorsSection._of_the_set.1": SceneRefusal(
        pair(errors={"sun": {"total_composite": "9 um"}}),
        {"there are pinion, gear": {"errors": {"pinion": {"total_composite": "9 um"}}}},
    ),
}

OF_WEAR: dict[str, SceneRefusal] = {
    "errors.at_angles.1": SceneRefusal(
        planetary(
            mesh=DAMPED,
            dynamics={"model": "planetary-torsional"},
            wear={"contact_patch": "none", "coefficient": CONSTANT},
            errors={"slow": "hunting", "planet": {"pitch": ["1 um", *["0 um"] * 23]}},
        ),
        {
            r"leave \[wear\] out": {"wear": None},
            "or give errors.planet.total_composite in their place": {
                "errors.slow": "averaged",
                "errors.planet": {"total_composite": "2 um"},
            },
        },
    ),
    "measured_profile.over_face.1": SceneRefusal(
        faced(
            wear={
                **WEAR,
                "initial": {
                    "pinion": {
                        "file": "lead.csv",
                        "zero": "pitch",
                        "continuation": "hold",
                    }
                },
            }
        ),
        {
            "give '(as-measured)'": {"wear.initial.pinion.zero": "{0}"},
            "or '(max)'": {"wear.initial.pinion.zero": "{0}"},
        },
        {"lead.csv": across(-10.0, 10.0)},
    ),
    "measured_profile.over_face.2": SceneRefusal(
        faced(wear={**WEAR, "initial": {"pinion": {"file": "lead.csv"}}}),
        {
            "measure all of the face": {"file:lead.csv": across(-10.0, 10.0)},
            **{
                f"continuation = .*'({how})'": {
                    "wear.initial.pinion.continuation": "{0}"
                }
                for how in ("hold", "slope", "zero")
            },
        },
        {"lead.csv": across(-5.0, 5.0)},
    ),
    "measured_profile._worn.1": SceneRefusal(
        initial(file="profile.csv"),
        {
            "check the sign": {"file:profile.csv": profile(56.5, 66.0)},
            "or choose zero = '(max)'": {"wear.initial.pinion.zero": "{0}"},
        },
        {"profile.csv": profile(56.5, 66.0, depth=-3.0)},
    ),
    "measured_profile.path_position.1": SceneRefusal(
        initial(file="profile.csv"),
        {
            "leave out points off the involute": {
                "file:profile.csv": profile(56.5, 66.0)
            }
        },
        {"profile.csv": profile(50.0, 66.0)},
    ),
    "measured_profile._check_cover.1": SceneRefusal(
        initial(file="profile.csv"),
        {
            "measure all of it": {"file:profile.csv": profile(56.5, 66.0)},
            **{
                f"continuation = .*'({how})'": {
                    "wear.initial.pinion.continuation": "{0}"
                }
                for how in ("hold", "slope", "zero")
            },
        },
        {"profile.csv": profile(60.0, 65.0)},
    ),
    "measured_profile._check_cover.2": SceneRefusal(
        initial(file="profile.csv"),
        {r"give (\d) or more": {"file:profile.csv": profile(56.5, 66.0, count=6)}},
        {"profile.csv": profile(56.5, 66.0, count=4)},
    ),
    "wear_checks.check_limits.1": SceneRefusal(
        pair(wear={**WEAR, "until": {"depth": "9 mm"}}),
        {
            "look at its unit": {"wear.until.depth": "20 um"},
            "or give less": {"wear.until.depth": "1 mm"},
        },
    ),
    "wear_checks.check_initial_wear.1": SceneRefusal(
        initial(depth="9 mm", shape="uniform"),
        {"give less initial wear": {"wear.initial.pinion.depth": "9 um"}},
    ),
}

REFUSALS = {**OF_RULES, **OF_OPERATION, **OF_TABLES, **OF_WEAR, **OF_THERMAL}


@pytest.mark.parametrize("site", scene_sites(), ids=lambda site: site.name)
def test_every_refusal_of_a_scene_raises_and_its_advice_leads_on(site, tmp_path):
    assert site.name in REFUSALS, "no entry in the walk: add an input and its advice"
    refusal = REFUSALS[site.name]
    write(tmp_path, refusal.files)
    with pytest.raises((GearError, SceneError)) as raised:
        build_scene(refusal.scene, tmp_path)
    message = str(raised.value)
    assert site.text.search(message), message
    assert refusal.advice, "a refusal without a remedy"
    for words, change in refusal.advice.items():
        found = re.search(words, message)
        assert found, f"{words!r} is not in {message!r}"
        of_files = {
            key.removeprefix("file:"): text
            for key, text in change.items()
            if key.startswith("file:")
        }
        write(tmp_path, {**refusal.files, **of_files})
        in_scene = {
            key: value for key, value in change.items() if not key.startswith("file:")
        }
        advised = changed(refusal.scene, in_scene, found.groups())
        assert advised != refusal.scene or of_files, "it recommends what is there"
        build_scene(advised, tmp_path)


def test_walk_over_scenes_has_no_refusal_that_is_gone():
    assert set(REFUSALS) == {site.name for site in scene_sites()}


def write(folder, files):
    """Write files beside a campaign."""
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
