"""One table: every variable of a dataset, its dimensions, unit, display unit and meaning.

Nothing else in wearlab spells a unit or a long name; labelling, figures, tables and exports read them here.
"""

from typing import NamedTuple

from wearlab.results import RESULTS
from wearlab.variable import Variable as Variable


class Dimension(NamedTuple):
    """What a dimension counts."""

    name: str
    meaning: str


DIMENSIONS = (
    Dimension("update", "wear states: the initial one, snapshots, the end"),
    Dimension("flank", "flanks that wear"),
    Dimension("profile", "nodes on the path of contact; two at one position where wear may jump"),
    Dimension("mesh", "gear meshes"),
    Dimension("phase", "fraction of one mesh period, 0 when a pair enters contact at A"),
    Dimension("mesh_period", "successive mesh periods of the response"),
    Dimension("pair", "tooth pairs in contact, leading first"),
    Dimension("member", "gears"),
    Dimension("harmonic", "order of the mesh frequency"),
    Dimension("mode", "natural modes, by ascending frequency"),
    Dimension("axis", "x, y"),
    Dimension("multiplier", "Floquet multipliers, by descending modulus"),
    Dimension("part", "real and imaginary part"),
    Dimension("error_angle", "quadrature over the angles of the members"),
    Dimension("step", "accepted steps over cycles"),
    Dimension("response_speed", "speeds of the input member at which the response is followed"),
    Dimension("direction", "up, down: the order in which the speeds are passed"),
    Dimension("strobe", "states once per mesh period"),
    Dimension("order", "frequency over the mesh frequency"),
    Dimension("jump", "jumps of the response, in the order in which they are met"),
    Dimension("end", "where a pair engages, where it leaves"),
    Dimension("duty", "conditions of operation that take turns"),
    Dimension("stage", "conditions of operation in order"),
    Dimension("edge", "the last speed before a jump, the first after it"),
)

_WEAR = ("update", "flank", "profile")
_MESH = ("update", "mesh", "phase")
_PAIR = ("update", "mesh", "pair", "phase")
_TURNING = ("update", "member", "mesh", "pair", "phase")
_RESPONSE = ("update", "mesh", "mesh_period", "phase")
_STATE = ("update", "mesh")
_OVER_SPEED = ("mesh", "direction", "response_speed")

VARIABLES: dict[str, Variable] = {
    # coordinates
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
    "duty_torque": Variable(("duty",), "N m", "N*m", "torque on the input member"),
    "duty_speed": Variable(("duty",), "rad s-1", "rpm", "speed of the input member"),
    "duty_share": Variable(("duty",), "1", "%", "share of the operating time"),
    "stage_torque": Variable(("stage",), "N m", "N*m", "torque on the input member"),
    "stage_speed": Variable(("stage",), "rad s-1", "rpm", "speed of the input member"),
    "update_stage": Variable(("update",), "", "", "stage that led to the state"),
    "flank_side": Variable(("flank",), "", "", "side of the tooth that is loaded"),
    # wear
    "wear_depth": Variable(_WEAR, "m", "um", "wear depth", "along the flank normal"),
    "wear_rate": Variable(_WEAR, "m", "um", "wear depth per cycle"),
    "flank_deviation": Variable(
        _WEAR,
        "m",
        "um",
        "flank deviation",
        "−(modifications + wear), as a measuring machine prints",
    ),
    "worn_mass": Variable(("update", "member"), "kg", "g", "mass worn off, all teeth"),
    # along the path
    "tooth_force": Variable(_WEAR, "N", "N", "normal force on the tooth at each point of its flank"),
    "contact_pressure": Variable(_WEAR, "Pa", "MPa", "Hertzian contact pressure"),
    "sliding_velocity": Variable(_WEAR, "m s-1", "m/s", "sliding velocity", "own minus mating surface"),
    "specific_sliding": Variable(_WEAR, "1", "1", "specific sliding", "1 − v_other/v_own"),
    "film_thickness": Variable(_WEAR, "m", "um", "minimum film thickness", "Dowson–Higginson"),
    "lambda_ratio": Variable(_WEAR, "1", "1", "lambda ratio", "film thickness over composite roughness"),
    "effective_wear_coefficient": Variable(_WEAR, "m2 N-1", "m^2/N", "wear coefficient where it acts"),
    # mesh
    "mesh_stiffness": Variable(
        _MESH, "N m-1", "N/um", "time-varying mesh stiffness", "tangent, loaded pairs"
    ),
    "secant_stiffness": Variable(_MESH, "N m-1", "N/um", "secant mesh stiffness F/(δ − e)"),
    "static_transmission_error": Variable(_MESH, "m", "um", "static transmission error under load"),
    "unloaded_transmission_error": Variable(_MESH, "m", "um", "unloaded transmission error"),
    "pair_stiffness": Variable(_PAIR, "N m-1", "N/um", "stiffness of one tooth pair"),
    "load_share": Variable(_PAIR, "1", "1", "share of the static mesh force"),
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
        "by the largest unloaded error, with wear of this shape; missing without wear or up to 1 mm",
    ),
    "mesh_frequency": Variable(("mesh",), "Hz", "Hz", "mesh frequency"),
    "contact_ratio": Variable(("mesh",), "1", "1", "transverse contact ratio"),
    "mesh_phase_offset": Variable(("mesh",), "1", "1", "phase of the mesh on the common clock"),
    "static_mesh_force": Variable(("mesh",), "N", "N", "static normal force of the mesh"),
    "stiffness_mean": Variable(_STATE, "N m-1", "N/um", "mean mesh stiffness"),
    "stiffness_rms": Variable(_STATE, "N m-1", "N/um", "RMS of the mesh stiffness fluctuation"),
    "stiffness_harmonics": Variable(
        (*_STATE, "harmonic"), "N m-1", "N/um", "harmonic amplitude of the mesh stiffness"
    ),
    "stiffness_harmonics_phase": Variable(
        (*_STATE, "harmonic"), "rad", "deg", "harmonic phase of the mesh stiffness"
    ),
    "ste_mean": Variable(_STATE, "m", "um", "mean static transmission error"),
    "ste_rms": Variable(_STATE, "m", "um", "RMS of the static transmission error fluctuation"),
    "ste_peak_to_peak": Variable(_STATE, "m", "um", "range of the static transmission error"),
    "ste_harmonics": Variable(
        (*_STATE, "harmonic"), "m", "um", "harmonic amplitude of the static transmission error"
    ),
    "ste_harmonics_phase": Variable(
        (*_STATE, "harmonic"), "rad", "deg", "harmonic phase of the static transmission error"
    ),
    "excitation_stiffness": Variable(
        _MESH, "N m-1", "N/um", "mesh stiffness as the dynamics received it", "series excitations only"
    ),
    "excitation_error": Variable(
        _MESH, "m", "um", "transmission error as the dynamics received it", "series excitations only"
    ),
    "slow_error": Variable(
        ("mesh", "error_angle"), "m", "um", "once-per-revolution error", "constant over one mesh period"
    ),
    "error_weight": Variable(("error_angle",), "1", "1", "quadrature weight of the error angle"),
    # dynamics
    "dynamic_mesh_force": Variable(
        _RESPONSE, "N", "N", "dynamic mesh force", "elastic; drive minus back flank, 0 in separation"
    ),
    "mesh_damping_force": Variable(_RESPONSE, "N", "N", "damping force of the mesh"),
    "mesh_deflection": Variable(_RESPONSE, "m", "um", "mesh deflection δ = d·q − e"),
    "mesh_deflection_rate": Variable(_RESPONSE, "m s-1", "mm/s", "rate of the mesh deflection"),
    "dynamic_transmission_error": Variable(
        _RESPONSE, "m", "um", "dynamic transmission error r_b1 θ1 − r_b2 θ2"
    ),
    "pair_force": Variable(
        ("update", "mesh", "pair", "mesh_period", "phase"), "N", "N", "force on each pair's drive flank"
    ),
    "bearing_force": Variable(
        ("update", "member", "axis", "mesh_period", "phase"),
        "N",
        "N",
        "force of the bearing on the member",
        "a pair: y along the line of action, as the driving gear pushes the driven; a planetary set: x, y of "
        "the carrier's frame, a planet's bearing that on its pin, against the centrifugal force too",
    ),
    "dte_harmonics": Variable(
        (*_STATE, "harmonic"), "m", "um", "harmonic amplitude of the dynamic transmission error"
    ),
    "dte_rms": Variable(_STATE, "m", "um", "RMS of the dynamic transmission error fluctuation"),
    "poincare_deflection": Variable(
        ("update", "mesh", "mesh_period"), "m", "um", "mesh deflection once per mesh period"
    ),
    "poincare_rate": Variable(
        ("update", "mesh", "mesh_period"), "m s-1", "mm/s", "rate of the mesh deflection once per mesh period"
    ),
    "mesh_force_min": Variable(
        _STATE, "N", "N", "smallest dynamic mesh force", "of all steps, both sides of every jump"
    ),
    "mesh_force_max": Variable(
        _STATE, "N", "N", "largest dynamic mesh force", "of all steps, both sides of every jump"
    ),
    "dynamic_factor": Variable(
        _STATE, "1", "1", "largest dynamic over static mesh force", "of all steps, both sides of every jump"
    ),
    "separation_fraction": Variable(_STATE, "1", "%", "fraction of time without drive-flank contact"),
    "mesh_load_factor": Variable(
        _STATE, "1", "1", "mean force of a mesh over the mean of its kind", "1: the planets share alike"
    ),
    "equivalent_load": Variable(_STATE, "N m", "N*m", "equivalent torque by Miner's rule (L16 Eq. 25)"),
    "response_period": Variable(("update",), "1", "1", "mesh periods per response period", "0: aperiodic"),
    "floquet_multiplier": Variable(
        ("update", "multiplier", "part"), "1", "1", "Floquet multipliers of the response"
    ),
    "attractor": Variable(
        ("update",), "1", "1", "branch of the response", "changes where the response jumps"
    ),
    "coexisting_period": Variable(
        ("update",),
        "1",
        "1",
        "mesh periods per period of another attractor",
        "0: aperiodic; NaN: released flanks return to the response stored",
    ),
    "coexisting_multiplier": Variable(
        ("update",), "1", "1", "largest modulus of the Floquet multipliers of the other attractor"
    ),
    "coexisting_force_min": Variable(_STATE, "N", "N", "smallest mesh force of the other attractor"),
    "coexisting_force_max": Variable(_STATE, "N", "N", "largest mesh force of the other attractor"),
    "attractor_search": Variable(
        ("update",),
        "",
        "",
        "what the search for another attractor came to",
        "none found, another found, cut off by its bound on the work, not looked for",
    ),
    # response over speed
    "response_speed": Variable(("response_speed",), "rad s-1", "rpm", "speed of the input member"),
    "response_dynamic_factor": Variable(_OVER_SPEED, "1", "1", "largest dynamic over static mesh force"),
    "response_force_peak_to_peak": Variable(_OVER_SPEED, "N", "N", "range of the dynamic mesh force"),
    "response_force_rms": Variable(_OVER_SPEED, "N", "N", "RMS of the dynamic mesh force fluctuation"),
    "response_dte_peak_to_peak": Variable(_OVER_SPEED, "m", "um", "range of the dynamic transmission error"),
    "response_dte_rms": Variable(_OVER_SPEED, "m", "um", "RMS of the dynamic transmission error fluctuation"),
    "response_separation_fraction": Variable(
        _OVER_SPEED, "1", "%", "fraction of time without drive-flank contact"
    ),
    "response_orbit_period": Variable(
        _OVER_SPEED[1:], "1", "1", "mesh periods per response period", "0: aperiodic"
    ),
    "response_multiplier": Variable(
        _OVER_SPEED[1:], "1", "1", "largest modulus of the Floquet multipliers", "over one response period"
    ),
    "response_dte_orders": Variable(
        (*_OVER_SPEED, "order"), "m", "um", "order amplitude of the dynamic transmission error"
    ),
    "response_force_orders": Variable(
        (*_OVER_SPEED, "order"), "N", "N", "order amplitude of the dynamic mesh force"
    ),
    "response_poincare_deflection": Variable(
        (*_OVER_SPEED, "strobe"), "m", "um", "mesh deflection once per mesh period"
    ),
    "response_poincare_rate": Variable(
        (*_OVER_SPEED, "strobe"), "m s-1", "mm/s", "rate of the mesh deflection once per mesh period"
    ),
    "response_jump_speed": Variable(
        ("direction", "jump", "edge"), "rad s-1", "rpm", "speeds between which the response jumps"
    ),
    "response_jump_extent": Variable(
        ("direction", "jump", "edge"), "m", "um", "range of the mesh deflection before and after a jump"
    ),
    "mode_kind": Variable(
        ("mode",), "", "", "what moves: rigid-body, rotational, translational, planet or mixed"
    ),
    "friction_force": Variable(
        _RESPONSE, "N", "N", "friction on the driving flank", "positive in recess, negative in approach"
    ),
    "efficiency": Variable(("update",), "1", "%", "output over input power"),
    "energy_input": Variable(("update",), "W", "W", "mean power of the loads that drive"),
    "energy_output": Variable(("update",), "W", "W", "mean power that loads and torsional supports take"),
    "energy_friction": Variable(("update",), "W", "W", "mean power lost in tooth friction"),
    "energy_bearing_damping": Variable(("update",), "W", "W", "mean power lost in the dampers of supports"),
    "energy_mesh_damping": Variable(("update",), "W", "W", "mean power lost in the dampers of the meshes"),
    "energy_parametric": Variable(
        ("update",), "W", "W", "mean power that changing mesh stiffness takes from the motion", "−Σ ½ k̇ x²"
    ),
    "energy_moving_gaps": Variable(
        ("update",), "W", "W", "mean power that moving gaps and errors take from the motion", "Σ F (ġ + ė)"
    ),
    "energy_stored": Variable(
        ("update",), "W", "W", "mean power that goes into the motion", "0 unless the response is aperiodic"
    ),
    "residual_energy": Variable(
        ("update",), "1", "1", "power that the terms do not account for, over the input power"
    ),
    # on request
    "mesh_acceleration": Variable(
        _RESPONSE, "m s-2", "m/s^2", "relative acceleration of both bodies along the line of action", "d·q̈"
    ),
    "mesh_acceleration_orders": Variable(
        (*_STATE, "order"), "m s-2", "m/s^2", "order amplitude of the mesh acceleration"
    ),
    "mesh_acceleration_rms": Variable(_STATE, "m s-2", "m/s^2", "RMS of the mesh acceleration"),
    "mesh_acceleration_peak_to_peak": Variable(_STATE, "m s-2", "m/s^2", "range of the mesh acceleration"),
    "mesh_acceleration_crest_factor": Variable(
        _STATE, "1", "1", "largest magnitude of the mesh acceleration over its RMS"
    ),
    "mesh_acceleration_kurtosis": Variable(
        _STATE, "1", "1", "kurtosis of the mesh acceleration", "mean a⁴ over the square of mean a²"
    ),
    "mesh_acceleration_harmonic_energy": Variable(
        _STATE,
        "m2 s-4",
        "m^2/s^4",
        "mean square of the mesh acceleration at whole mesh orders",
        "of its average over the mesh periods",
    ),
    "mesh_acceleration_sideband_energy": Variable(
        _STATE,
        "m2 s-4",
        "m^2/s^4",
        "mean square of the mesh acceleration between the mesh orders",
        "of what does not repeat every mesh period: slow errors that turn, subharmonics, aperiodic motion",
    ),
    "mesh_deflection_orders": Variable(
        (*_STATE, "order"), "m", "um", "order amplitude of the mesh deflection"
    ),
    "natural_frequency": Variable(("mode",), "Hz", "Hz", "natural frequency at the mean mesh stiffness"),
    "critical_speed": Variable(
        ("mode",), "rad s-1", "rpm", "speed of the input member at which mesh and natural frequency meet"
    ),
    "mode_participation": Variable(
        ("mesh", "mode"),
        "1",
        "1",
        "share of a mode in the compliance the mesh sees",
        "0: the mesh does not excite it",
    ),
    # life
    "life": Variable((), "1", "1", "cycles to the depth limit"),
    "remaining_useful_life": Variable(("update",), "1", "1", "cycles left to the depth limit"),
    "service_life": Variable((), "s", "h", "operating time to the depth limit"),
    "end_reason": Variable((), "", "", "why the run ended"),
    "calibrated_wear_coefficient": Variable(
        (), "m2 N-1", "m^2/N", "wear coefficient calibrated on one life", "before factor and film"
    ),
    # trust
    "estimate_quality": Variable(
        (),
        "",
        "",
        "whether the error estimates can be trusted",
        "as usual; doubtful, and what speaks against them",
    ),
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
    # each in a file of its own
    **{result.name: result.variable for result in RESULTS},
}

ON_REQUEST = (
    *(name for name in VARIABLES if name.startswith("mesh_acceleration")),
    "mesh_deflection_orders",
)
"""Variables that are computed only when ``[store] variables`` names them."""


def attributes(name: str) -> dict[str, str]:
    """Return the CF attributes of a variable: units, display_units, long_name, and comment if any."""
    variable = VARIABLES[name]
    named = {
        "units": variable.units,
        "display_units": variable.display_units,
        "long_name": variable.long_name,
        "comment": variable.comment,
    }
    return {key: value for key, value in named.items() if value}
