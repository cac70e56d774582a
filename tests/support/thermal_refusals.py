"""Refusals of ``[thermal]`` and of wear beyond the path, each with its advice taken."""

from typing import Any

from scene_refusals import SceneRefusal
from scenes import external_pair
from warm_pair import COEFFICIENTS, MODULI, TEMPERATURES, warm_table

ROW = {"torque": "1 N*m", "speed": "900 rpm", "share": 1.0}
HALF = {**ROW, "share": 0.5}
CALIBRATED = {
    "model": "calibrated",
    "life": 1e6,
    "depth": "20 um",
    "flank": "gear",
    "torque": "1.5 N*m",
    "speed": "1000 rpm",
}
STEEL_WHEEL = {"gears__gear": {"teeth": 40}, "wear": None}
OVER_TEMPERATURE = {
    "model": "over-temperature",
    "temperature": TEMPERATURES,
    "value": COEFFICIENTS,
}
MODULUS = "gears.gear.material.youngs_modulus"


def beyond(**mesh: Any) -> dict[str, Any]:
    """Return the scene of a pair that is to wear beyond A and E."""
    return {
        "gears": external_pair(20, 40),
        "operation": {"torque": "50 N*m", "speed": "1000 rpm"},
        "mesh": {"stiffness": "potential-energy", **mesh},
        "wear": {
            "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
            "beyond_path": True,
        },
    }


OF_THERMAL = {
    "thermal.tables_need_thermal.1": SceneRefusal(
        warm_table(thermal=None, wear=None),
        {
            r"needs \[thermal\] with ambient and friction": {
                "thermal": {"ambient": "20 degC", "friction": 0.2}
            },
            "or give one value": {MODULUS: "2.8 GPa"},
        },
    ),
    "thermal.thermal_rules.1": SceneRefusal(
        warm_table(
            gears={
                "kind": "internal-pair",
                "module": "2 mm",
                "face_width": "10 mm",
                "pinion": {"teeth": 20},
                "ring": {"teeth": 70, "rim_diameter": "170 mm"},
            },
            wear=None,
        ),
        {"leave it out": {"thermal": None}},
    ),
    "thermal.thermal_rules.2": SceneRefusal(
        warm_table(mesh__face_points=5),
        {
            "leave it out, or mesh.face_points": {"mesh.face_points": None},
            "leave it out,": {
                "thermal": None,
                "wear": None,
                MODULUS: "2.8 GPa",
                "mesh.stiffness": None,
            },
        },
    ),
    "thermal.thermal_rules.3": SceneRefusal(
        warm_table(operation={"duty": [HALF, {**HALF, "torque": "-1 N*m"}]}),
        {
            "leave rows of operation.duty with negative torque out": {
                "operation.duty": [ROW]
            }
        },
    ),
    "thermal.thermal_rules.4": SceneRefusal(
        warm_table(operation={"duty": [ROW]}, thermal__relative_duty=0.5),
        {"leave it out": {"thermal.relative_duty": None}},
    ),
    "thermal.thermal_rules.5": SceneRefusal(
        warm_table(wear__coefficient=CALIBRATED),
        {
            "give a value": {
                "wear.coefficient": {"model": "constant", "value": "1e-6 mm^3/Nm"}
            },
            "or 'over-temperature'": {"wear.coefficient": OVER_TEMPERATURE},
        },
    ),
    "thermal._materials.1": SceneRefusal(
        warm_table(gears__gear={"teeth": 40, "material": "POM"}),
        {
            r"such as youngs_modulus = \{ temperature = \['20 degC', '60 degC'\]": {
                "gears.gear.material": {
                    "name": "POM",
                    "youngs_modulus": {
                        "temperature": ["20 degC", "60 degC"],
                        "value": ["2.9 GPa", "1.9 GPa"],
                    },
                }
            },
            "or one value, which is then held": {
                "gears.gear.material": {"name": "POM", "youngs_modulus": "2.8 GPa"}
            },
        },
    ),
    "thermal._materials.2": SceneRefusal(
        warm_table(**STEEL_WHEEL),
        {
            r"such as gear = \{ flank = 6300, root = 895 \}": {
                "thermal.heat_transfer": {"gear": {"flank": 6300, "root": 895}}
            },
            r"or leave \[thermal\] out": {"thermal": None},
        },
    ),
    "thermal._friction.1": SceneRefusal(
        warm_table(
            dynamics={"model": "torsional", "friction": {"coefficient": 0.05}},
            mesh={"damping_ratio": 0.05},
        ),
        {
            r"coefficient, ([\d.]+), one number: give both the same": {
                "thermal.friction": 0.05
            },
            "give both the same": {"dynamics.friction.coefficient": 0.2},
        },
    ),
    "thermal._stiffness.1": SceneRefusal(
        warm_table(mesh__stiffness={"model": "constant", "value": "1e8 N/m"}),
        {
            "give true to let it fall": {"mesh.stiffness.follows_modulus": True},
            "or another stiffness": {"mesh.stiffness": "vdi-2736"},
        },
    ),
    "heat.as_warm_as_surroundings.1": SceneRefusal(
        warm_table(thermal__ambient="10 degC"),
        {
            "give values down to": {
                f"{MODULUS}.temperature": ["10 degC", *TEMPERATURES],
                f"{MODULUS}.value": ["3.1 GPa", *MODULI],
                "wear.coefficient.gear.temperature": ["10 degC", *TEMPERATURES],
                "wear.coefficient.gear.value": ["0.8e-6 mm^3/Nm", *COEFFICIENTS],
            }
        },
    ),
    "models.Housing._check.1": SceneRefusal(
        warm_table(thermal__housing={"area": "0.01 m^2"}),
        {
            "give 'open'": {"thermal.housing": "open"},
            r"resistance = '([^']+)', area = '([^']+)'": {
                "thermal.housing": {"resistance": "{0}", "area": "{1}"}
            },
        },
    ),
    "models.Housing._check.2": SceneRefusal(
        warm_table(thermal__housing="closed"),
        {
            r"such as \{ model = '(\w+)', area = '([^']+)'": {
                "thermal.housing": {"model": "{0}", "area": "{1}"}
            }
        },
    ),
    "rules._beyond_path.1": SceneRefusal(
        beyond(contact="displacement"),
        {
            "give mesh.contact = '(exact)'": {"mesh.contact": "{0}"},
            "or beyond_path = false": {"wear.beyond_path": False},
        },
    ),
    "rules._beyond_path.2": SceneRefusal(
        beyond(contact="exact", extended_contact=False),
        {
            "leave mesh.extended_contact out": {"mesh.extended_contact": None},
            "or give beyond_path = false": {"wear.beyond_path": False},
        },
    ),
}
"""By the place of the refusal in the package."""
