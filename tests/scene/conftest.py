import copy

import pytest
from scenes import external_pair

SUPPORT = {"radial_stiffness": "1150 N/um", "damping": "5360 N*s/m"}
TABLE = {
    "gears": external_pair(
        {"teeth": 50, "root_diameter": "140 mm"},
        {"teeth": 50, "root_diameter": "140 mm"},
    ),
    "operation": {"torque": "340 N*m", "speed": "1100 rpm"},
    "mesh": {"damping": "1000 N*s/m"},
    "dynamics": {
        "model": "spur-3dof",
        "supports": {"pinion": SUPPORT, "gear": SUPPORT},
    },
    "wear": {
        "coefficient": {"model": "constant", "value": "9.65e-19 m^2/N"},
        "until": {"cycles": 1e8},
    },
}
FULL = {
    **TABLE,
    "gears": {
        **TABLE["gears"],
        "centre_distance": "150 mm",
        "pinion": {
            "teeth": 50,
            "profile_shift_coefficient": 0.1,
            "roughness_ra": "0.3 um",
            "bore_diameter": "40 mm",
            "tip_relief": {"amount": "10 um", "length": "2 mm", "shape": "parabolic"},
            "profile_crowning": "3 um",
            "profile_slope": "-2 um",
        },
        "gear": {
            "teeth": 50,
            "roughness_ra": "0.4 um",
            "mass": "2.8 kg",
            "inertia": "7300 kg*mm^2",
        },
    },
    "operation": {
        **TABLE["operation"],
        "drive_flank": "left",
        "torque_fluctuation": {"order": 2, "amplitude": "5 N*m", "phase": "90 deg"},
    },
    "mesh": {
        "stiffness": {
            "coupling": "shared",
            "hertz": "weber",
            "correction": [1, 1.1],
            "scale": 0.9,
        },
        "contact": {"engagement": "threshold"},
        "extended_contact": True,
        "face_load_factor": 1.2,
        "excitation": {
            "model": "fourier",
            "stiffness_harmonics": 5,
            "error_harmonics": 3,
            "error": "loaded",
        },
        "normal_backlash": "0 um",
        "damping_ratio": 0.07,
        "damping_in": "always",
    },
    "dynamics": {
        **TABLE["dynamics"],
        "response": {
            "speed": {"from": "800 rpm", "to": "5000 rpm", "points": 9},
            "direction": "up",
        },
    },
    "errors": {
        "seed": 7,
        "slow": "frozen",
        "pinion": {"total_composite": "12 um", "installation": ["3 um", "4 um"]},
        "harmonic": [
            {"mesh": "pinion-gear", "order": 1, "amplitude": "3 um", "phase": "10 deg"}
        ],
    },
    "lubricant": {"viscosity": "0.012 Pa*s", "pressure_viscosity": "1.6e-8 1/Pa"},
    "wear": {
        "coefficient": {
            "model": "constant",
            "value": "9.65e-19 m^2/N",
            "film": True,
            "gear": {"model": "hardness", "k": 1e-7, "hardness": "2.7 GPa"},
        },
        "load": "equivalent",
        "wohler_slope": 6.61,
        "pressure": "peak",
        "projection": "over-cosine",
        "average_over_contact_width": True,
        "initial": {
            "pinion": {"depth": "10 um", "shape": "quadratic"},
            "gear": {"depth": "5 um"},
        },
        "until": {"cycles": 1e8, "depth": "400 um", "flank": "pinion"},
        "snapshots": {"depth": ["10 um", "5 um", "10 um"], "flank": "gear"},
        "step": {"method": "fixed", "size": {"stability": 0.9}},
    },
    "numerics": {"tolerance": 1e-4, "steps_per_period": 200},
    "store": {"variables": ["wear_depth", "mesh_stiffness"]},
}


@pytest.fixture
def table():
    return copy.deepcopy(TABLE)


@pytest.fixture
def full():
    return copy.deepcopy(FULL)
