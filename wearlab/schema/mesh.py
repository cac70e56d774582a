"""What a mesh is and carries without motion: stiffness, transmission errors, angles of contact."""

from wearlab.variable import Variable, VariableGroup

_MESH = ("update", "mesh", "phase")
_PAIR = ("update", "mesh", "pair", "phase")
_TURNING = ("update", "member", "mesh", "pair", "phase")
_STATE = ("update", "mesh")

QUASISTATIC = {
    "mesh_stiffness": Variable(
        _MESH, "N m-1", "N/um", "time-varying mesh stiffness", "tangent, loaded pairs"
    ),
    "secant_stiffness": Variable(_MESH, "N m-1", "N/um", "secant mesh stiffness F/(δ − e)"),
    "static_transmission_error": Variable(_MESH, "m", "um", "static transmission error under load"),
    "unloaded_transmission_error": Variable(_MESH, "m", "um", "unloaded transmission error"),
    "pair_stiffness": Variable(_PAIR, "N m-1", "N/um", "stiffness of one tooth pair"),
    "load_share": Variable(_PAIR, "1", "1", "share of the static mesh force"),
}

EXACT = {
    "contact_angle": Variable(
        _TURNING,
        "rad",
        "rad",
        "angle of the touching point on the flank",
        "roll angle − half tooth angle (ring: half space angle) at the base circle; Y23's α1, α1′",
    ),
    "rotation_angle": Variable(
        _TURNING,
        "rad",
        "rad",
        "rotation of the tooth's centre line from the line of centres",
        "a ring's: of the tooth space's; each pair as if it touched alone; Y23's φ1, φ2",
    ),
    "rotation_lag": Variable(
        _PAIR, "rad", "rad", "rotation by which a pair lags the leading one", "of the driven gear; Y23's Δφ2"
    ),
    "engaged": Variable(_PAIR, "1", "1", "whether the pair is engaged", "by mesh.contact.engagement"),
    "meshing_range": Variable(
        ("update", "member", "mesh", "end"),
        "rad",
        "rad",
        "rotation at which a pair engages and leaves",
        "at the stored phases, from A to E unless contact is extended; `validity` says where it stops",
    ),
    "contact_range": Variable(
        ("update", "member", "mesh", "end"),
        "rad",
        "rad",
        "contact angle at which a pair engages and leaves",
        "at the stored phases, from A to E unless contact is extended; `validity` says where it stops",
    ),
    "single_contact_share": Variable(
        _STATE,
        "1",
        "%",
        "share of the mesh period with one pair engaged",
        "by load; with engagement = threshold by Y23's rule, flank on flank also beyond A and E",
    ),
    "lone_meshing_range": Variable(
        ("update", "member", "mesh", "end"),
        "rad",
        "rad",
        "rotation over which a pair alone would touch",
        "flank on flank, with a common tangent",
    ),
    "lone_contact_range": Variable(
        ("update", "member", "mesh", "end"), "rad", "rad", "contact angle over which a pair alone would touch"
    ),
    "contact_loss": Variable(
        ("update", "member", "mesh"), "1", "%", "share of the active flank that never touches"
    ),
    "unloaded_transmission_angle": Variable(
        _MESH, "rad", "rad", "unloaded transmission error of the driven gear", "Y23 Eq. 62"
    ),
    "first_order_excess": Variable(
        _STATE,
        "1",
        "%",
        "by how much first-order contact overestimates the unloaded error",
        "largest of min(h₁ + h₂) over the path of contact, against the largest of the exact form",
    ),
    "first_order_depth": Variable(
        _STATE,
        "m",
        "um",
        "wear depth beyond which first-order contact is 5 % off",
        "by the largest unloaded error, with wear of this shape; missing without wear, and where both agree "
        "up to 1 mm or up to the deepest wear that the flanks can have",
    ),
}


def _over_wear(prefix: str, words: str, units: str, shown: str) -> dict[str, Variable]:
    """Return what tells the course of a quantity over a mesh period in numbers."""
    harmonics = (*_STATE, "harmonic")
    return {
        f"{prefix}_mean": Variable(_STATE, units, shown, f"mean {words}"),
        f"{prefix}_rms": Variable(_STATE, units, shown, f"RMS of the {words} fluctuation"),
        f"{prefix}_harmonics": Variable(harmonics, units, shown, f"harmonic amplitude of the {words}"),
        f"{prefix}_harmonics_phase": Variable(harmonics, "rad", "deg", f"harmonic phase of the {words}"),
    }


IN_NUMBERS = {
    "mesh_frequency": Variable(("mesh",), "Hz", "Hz", "mesh frequency"),
    "contact_ratio": Variable(("mesh",), "1", "1", "transverse contact ratio"),
    "mesh_phase_offset": Variable(("mesh",), "1", "1", "phase of the mesh on the common clock"),
    "static_mesh_force": Variable(("mesh",), "N", "N", "static normal force of the mesh"),
    **_over_wear("stiffness", "mesh stiffness", "N m-1", "N/um"),
    **_over_wear("ste", "static transmission error", "m", "um"),
    "ste_peak_to_peak": Variable(_STATE, "m", "um", "range of the static transmission error"),
    "ste_max": Variable(_STATE, "m", "um", "largest static transmission error"),
}

SERIES = {
    "excitation_stiffness": Variable(
        _MESH, "N m-1", "N/um", "mesh stiffness as the dynamics received it", "series excitations only"
    ),
    "excitation_error": Variable(
        _MESH, "m", "um", "transmission error as the dynamics received it", "series excitations only"
    ),
}

SLOW_ERRORS = {
    "slow_error": Variable(
        ("mesh", "error_angle"), "m", "um", "once-per-revolution error", "constant over one mesh period"
    ),
    "error_weight": Variable(("error_angle",), "1", "1", "quadrature weight of the error angle"),
}

GROUPS = (
    VariableGroup("mesh", "every run", QUASISTATIC),
    VariableGroup("mesh", 'mesh.contact = "exact" or "algorithm-1"', EXACT),
    VariableGroup("mesh", "every run", IN_NUMBERS),
    VariableGroup("mesh", "mesh.excitation by series", SERIES),
    VariableGroup("mesh", "[errors]", SLOW_ERRORS),
)
