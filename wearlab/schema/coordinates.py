"""Along what results stand: cycles, times, places on flanks, conditions of operation."""

from wearlab.variable import Variable, VariableGroup

EVERYWHERE = {
    "cycle": Variable(("update",), "1", "1", "revolutions of the reference gear relative to the carrier"),
    "mesh_cycles": Variable(("update",), "1", "1", "mesh cycles since the initial state"),
    "operating_hours": Variable(("update",), "s", "h", "operating time since the initial state"),
    "preset_depth": Variable(
        ("update", "flank"),
        "m",
        "um",
        "wear depth by which a state was asked for",
        "on the flank that it was asked for on; NaN where cycles or the steps of the life told when",
    ),
    "load_cycles": Variable(("update", "flank"), "1", "1", "load cycles of one tooth flank"),
    "path_position": Variable(
        ("flank", "profile"),
        "m",
        "mm",
        "position on the path of contact",
        "0 at the pitch point, positive towards recess",
    ),
    "diameter": Variable(("flank", "profile"), "m", "mm", "diameter of the contact point"),
    "roll_angle": Variable(("flank", "profile"), "rad", "deg", "roll angle of the contact point"),
    "distance_to_pitch_circle": Variable(
        ("flank", "profile"),
        "m",
        "mm",
        "radial distance from the operating pitch circle",
        "positive towards the tip",
    ),
    "characteristic_point": Variable(
        ("flank", "profile"),
        "",
        "",
        "name of the point of contact A, B, C, D or E, or empty",
        "along the profile alone where both flanks of a pair share their nodes",
    ),
    "phase": Variable(("phase",), "1", "1", "mesh phase", "equally spaced: a jump lies between two of them"),
}

CONDITIONS = {
    "duty_torque": Variable(("duty",), "N m", "N*m", "torque on the input member"),
    "duty_speed": Variable(("duty",), "rad s-1", "rpm", "speed of the input member"),
    "duty_share": Variable(("duty",), "1", "%", "share of the operating time"),
    "stage_torque": Variable(("stage",), "N m", "N*m", "torque on the input member"),
    "stage_speed": Variable(("stage",), "rad s-1", "rpm", "speed of the input member"),
    "update_stage": Variable(("update",), "", "", "stage that led to the state"),
}

SIDES = {
    "flank_side": Variable(("flank",), "", "", "side of the tooth that is loaded"),
}

GROUPS = (
    VariableGroup("coordinates", "every run", EVERYWHERE),
    VariableGroup("coordinates", "operation.duty or operation.stage", CONDITIONS),
    VariableGroup("coordinates", "every run", SIDES),
)
