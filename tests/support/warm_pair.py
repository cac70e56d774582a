"""A steel pinion on a plastic wheel that friction warms, whose life an independent
script has computed (unchanged with half and double the nodes), and the tables of it.
"""

import copy
from typing import Any

from wearlab.scene import Scene

TEMPERATURES = ["20 degC", "60 degC", "100 degC", "120 degC"]
MODULI = ["2.9 GPa", "1.9 GPa", "1.1 GPa", "0.8 GPa"]
COEFFICIENTS = ["1e-6 mm^3/Nm", "2e-6 mm^3/Nm", "4e-6 mm^3/Nm", "6e-6 mm^3/Nm"]

TABLE: dict[str, Any] = {
    "gears": {
        "kind": "external-pair",
        "module": "2 mm",
        "face_width": "10 mm",
        "pinion": {"teeth": 20},
        "gear": {
            "teeth": 40,
            "material": {
                "youngs_modulus": {"temperature": TEMPERATURES, "value": MODULI},
                "poisson_ratio": 0.35,
                "density": "1410 kg/m^3",
            },
        },
    },
    "operation": {"torque": "1.5 N*m", "speed": "1000 rpm"},
    "mesh": {
        "stiffness": "vdi-2736",
        "contact": "displacement",
        "extended_contact": False,
    },
    "thermal": {"ambient": "20 degC", "friction": 0.2},
    "wear": {
        "coefficient": {
            "pinion": {"model": "constant", "value": "0 mm^3/Nm"},
            "gear": {
                "model": "over-temperature",
                "temperature": TEMPERATURES,
                "value": COEFFICIENTS,
            },
        },
        "contact_patch": "none",
        "until": {"cycles": 5e7},
        "snapshots": {"cycles": [1e6, 5e6, 2e7]},
    },
}

KST_E: dict[str, Any] = {
    "gears": {
        "kind": "external-pair",
        "module": "1 mm",
        "centre_distance": "52 mm",
        "face_width": "15 mm",
        "material": {
            "youngs_modulus": "210 GPa",
            "poisson_ratio": 0.3,
            "density": "7850 kg/m^3",
        },
        "pinion": {"teeth": 51, "tip_diameter": "52.894 mm", "face_width": "17 mm"},
        "gear": {
            "teeth": 52,
            "tip_diameter": "54.022 mm",
            "usable_tip_diameter": "53.788 mm",
            "material": {
                "youngs_modulus": "4156 MPa",
                "poisson_ratio": 0.34,
                "density": "1140 kg/m^3",
            },
        },
    },
    "operation": {"torque": "7.85 N*m", "speed": "2250 rpm"},
    "mesh": {"stiffness": "vdi-2736", "extended_contact": False},
}
"""The pair of the kst-E report: steel on plastic; its tips end in chamfers."""


def warm_table(**changes: Any) -> dict[str, Any]:
    """Return the table with changes, ``thermal__friction = 0.3``; None takes out."""
    table = copy.deepcopy(TABLE)
    for key, value in changes.items():
        *path, last = key.split("__")
        inner = table
        for part in path:
            inner = inner[part]
        if value is None:
            inner.pop(last, None)
        else:
            inner[last] = value
    return table


def warm_pair(**changes: Any) -> Scene:
    """Return the scene of `warm_table`."""
    return Scene.from_mapping(warm_table(**changes))
