"""Variables of wear, and of how long flanks last."""

from wearlab.variable import Variable, VariableGroup

_WEAR = ("update", "flank", "profile")

WORN = {
    "wear_depth": Variable(_WEAR, "m", "um", "wear depth", "along the flank normal"),
    "wear_slope": Variable(
        _WEAR,
        "1",
        "1",
        "slope of the wear depth",
        "of the depth across the tooth over the height along its centre line; Y23 Eqs. 20 and 23",
    ),
    "wear_rate": Variable(_WEAR, "m", "um", "wear depth per cycle"),
    "flank_deviation": Variable(
        _WEAR, "m", "um", "flank deviation", "−(modifications + wear), as a measuring machine prints"
    ),
    "worn_mass": Variable(("update", "member"), "kg", "g", "mass worn off, all teeth"),
}

ON_THE_FLANK = {
    "tooth_force": Variable(_WEAR, "N", "N", "normal force on the tooth at each point of its flank"),
    "contact_pressure": Variable(_WEAR, "Pa", "MPa", "Hertzian contact pressure"),
    "sliding_velocity": Variable(_WEAR, "m s-1", "m/s", "sliding velocity", "own minus mating surface"),
    "specific_sliding": Variable(_WEAR, "1", "1", "specific sliding", "1 − v_other/v_own"),
}

LUBRICATED = {
    "film_thickness": Variable(_WEAR, "m", "um", "minimum film thickness", "Dowson–Higginson"),
    "lambda_ratio": Variable(_WEAR, "1", "1", "lambda ratio", "film thickness over composite roughness"),
}

COEFFICIENT = {
    "effective_wear_coefficient": Variable(_WEAR, "m2 N-1", "m^2/N", "wear coefficient where it acts"),
}

GROUPS: tuple[VariableGroup, ...] = (
    VariableGroup("wear", "[wear], or initial wear", WORN),
    VariableGroup("along the path", "every run", ON_THE_FLANK),
    VariableGroup("along the path", "[lubricant] and roughness_ra", LUBRICATED),
    VariableGroup("along the path", "[wear]", COEFFICIENT),
)


LIFE = {
    "life": Variable((), "1", "1", "cycles to the depth limit"),
    "remaining_useful_life": Variable(("update",), "1", "1", "cycles left to the depth limit"),
    "service_life": Variable((), "s", "h", "operating time to the depth limit"),
    "end_reason": Variable((), "", "", "why the run ended"),
    "calibrated_wear_coefficient": Variable(
        (), "m2 N-1", "m^2/N", "wear coefficient calibrated on one life", "before factor and film"
    ),
    "estimate_quality": Variable(
        (),
        "",
        "",
        "whether the error estimates can be trusted",
        "as usual; doubtful, and what speaks against them",
    ),
}

TRUST = {
    "verdict": Variable((), "", "", "what the run amounts to"),
    "validity": Variable(
        (), "", "", "assumed values and limits of validity that this run touches, one a line"
    ),
    "model_error": Variable(
        (),
        "",
        "",
        "known departures of this scene's models, with size and source, one a line",
        "beside error_estimate_*, which is of the numerics alone",
    ),
    "error_estimate_wear_depth": Variable(
        ("update",), "m", "um", "estimated numerical error of the wear depth"
    ),
    "error_estimate_life": Variable((), "1", "1", "estimated numerical error of the life, in cycles"),
    "error_estimate_wear_coefficient": Variable(
        (), "m2 N-1", "m^2/N", "estimated numerical error of the calibrated wear coefficient"
    ),
    "error_estimate_mesh_force": Variable(
        ("update",), "N", "N", "estimated numerical error of the mesh force at any instant"
    ),
    "error_estimate_mesh_force_max": Variable(
        ("update",),
        "N",
        "N",
        "estimated numerical error of the largest mesh force",
        "over the static force that of the dynamic factor",
    ),
    "error_estimate_bearing_force": Variable(
        ("update",), "N", "N", "estimated numerical error of the bearing forces at any instant"
    ),
    "residual_mean_force": Variable(
        ("update",), "1", "1", "mean of elastic and damping force over the static force, minus one"
    ),
    "residual_load_share": Variable(("update",), "1", "1", "sum of the load shares minus one"),
    "residual_orbit": Variable(("update",), "1", "1", "how far the orbit is from closing, relative"),
    "run_time_contact": Variable((), "s", "s", "time spent in contact analysis"),
    "run_time_dynamics": Variable((), "s", "s", "time spent in dynamics"),
    "run_time_wear": Variable((), "s", "s", "time spent on wear rates and steps"),
    "run_time_estimates": Variable((), "s", "s", "time spent on the estimates of the error"),
    "run_time_total": Variable((), "s", "s", "time spent on the run, labelling included"),
    "count_contact_analyses": Variable((), "1", "1", "contact analyses"),
    "count_period_maps": Variable((), "1", "1", "period maps integrated"),
    "count_right_hand_sides": Variable((), "1", "1", "right-hand sides evaluated"),
    "count_attractor_starts": Variable((), "1", "1", "starts of the searches for other attractors"),
    "count_attractor_periods": Variable((), "1", "1", "mesh periods integrated in these searches"),
    "count_wear_steps": Variable((), "1", "1", "accepted steps over cycles"),
    "count_rejected_steps": Variable((), "1", "1", "rejected steps over cycles"),
    "count_steps_per_period": Variable((), "1", "1", "integration steps in one mesh period"),
    "steps_cycle": Variable(("step",), "1", "1", "cycle at the end of each accepted step"),
}

GROUPS += (
    VariableGroup("life", "wear.until", LIFE),
    VariableGroup("trust", "every run", TRUST),
)
