"""What wears, and what acts along the path of contact."""

from wearlab.variable import Variable, VariableGroup

_WEAR = ("update", "flank", "profile")

WORN = {
    "wear_depth": Variable(_WEAR, "m", "um", "wear depth", "along the flank normal"),
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

GROUPS = (
    VariableGroup("wear", "[wear], or initial wear", WORN),
    VariableGroup("along the path", "every run", ON_THE_FLANK),
    VariableGroup("along the path", "[lubricant] and roughness_ra", LUBRICATED),
    VariableGroup("along the path", "[wear]", COEFFICIENT),
)
