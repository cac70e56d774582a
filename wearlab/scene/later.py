"""What campaign files may say one day, and this version refuses by name."""

PLANETARY = "planetary gear sets"
FRICTION = "friction and power"

LATER_KEYS: dict[str, dict[str, str]] = {
    "": {
        "start": "continuing another run",
    },
    "gears": {"helix_angle": "helical gears"},
    "operation": {
        "power": FRICTION,
        "fixed": PLANETARY,
        "load_torque": PLANETARY,
        "duty": "duty cycles",
        "stage": "stages of operation",
    },
    "mesh": {
        "face_load_factor": PLANETARY,
        "sun_planet": PLANETARY,
        "planet_ring": PLANETARY,
    },
    "errors.pinion": {"planet_position": PLANETARY},
    "errors.gear": {"planet_position": PLANETARY},
    "dynamics": {"friction": FRICTION, "rotation": PLANETARY},
    "lubricant": dict.fromkeys(
        ("kinematic_viscosity_40", "kinematic_viscosity_100", "density", "temperature"),
        "viscosity at a temperature",
    ),
    "wear.initial.pinion": dict.fromkeys(
        ("file", "x", "y", "direction", "units", "zero", "smooth"), "measured flanks"
    ),
    "wear.initial.gear": dict.fromkeys(
        ("file", "x", "y", "direction", "units", "zero", "smooth"), "measured flanks"
    ),
}

LATER_CHOICES: dict[str, dict[str, str]] = {
    "dynamics": {"planetary": PLANETARY, "planetary-torsional": FRICTION},
    "wear.coefficient": {"calibrated": "calibrated coefficients"},
}


def later(what: str) -> str:
    """Return the sentence that refuses it."""
    return f"{what}: not part of this version of wearlab"
