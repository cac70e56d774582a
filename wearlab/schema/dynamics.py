"""Variables of the dynamics, at one speed and over speed."""

from wearlab.variable import Variable, VariableGroup

_RESPONSE = ("update", "mesh", "mesh_period", "phase")
_STATE = ("update", "mesh")

MOTION = {
    "dynamic_mesh_force": Variable(
        _RESPONSE, "N", "N", "dynamic mesh force", "elastic; drive minus back flank, 0 in separation"
    ),
    "normal_mesh_force": Variable(
        _RESPONSE, "N", "N", "normal force of the mesh", "with damping; drive minus back flank; it wears"
    ),
    "mesh_damping_force": Variable(
        _RESPONSE, "N", "N", "damping force of the mesh", "normal less elastic force"
    ),
    "mesh_deflection": Variable(_RESPONSE, "m", "um", "mesh deflection δ = d·q − e"),
    "mesh_deflection_rate": Variable(_RESPONSE, "m s-1", "mm/s", "rate of the mesh deflection"),
    "dynamic_transmission_error": Variable(
        _RESPONSE,
        "m",
        "um",
        "dynamic transmission error r_b1 θ1 − r_b2 θ2",
        "of rotations beside the carrier's",
    ),
    "pair_force": Variable(
        ("update", "mesh", "pair", "mesh_period", "phase"),
        "N",
        "N",
        "elastic force on each pair's drive flank",
    ),
    "pair_normal_force": Variable(
        ("update", "mesh", "pair", "mesh_period", "phase"),
        "N",
        "N",
        "normal force on each pair's drive flank",
        "with damping, never negative; it wears",
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
    "normal_force_factor": Variable(_STATE, "1", "1", "largest normal over static mesh force"),
    "separation_fraction": Variable(_STATE, "1", "%", "fraction of time in which no drive flank pushes"),
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
        "mesh periods per period of the worst other attractor found",
        "worst by its largest force; 0: aperiodic; NaN: released flanks return to the response stored",
    ),
    "coexisting_multiplier": Variable(
        ("update",), "1", "1", "largest modulus of the Floquet multipliers of the worst other attractor found"
    ),
    "coexisting_force_min": Variable(
        _STATE, "N", "N", "smallest mesh force of the worst other attractor found"
    ),
    "coexisting_force_max": Variable(
        _STATE,
        "N",
        "N",
        "largest mesh force of the worst other attractor found",
        "a search, not a bound: what no release reaches stays unknown",
    ),
    "rival_period": Variable(
        ("update", "rival"),
        "1",
        "1",
        "mesh periods per period of every other attractor found",
        "by falling largest force; 0: aperiodic; NaN: no further one",
    ),
    "rival_multiplier": Variable(
        ("update", "rival"), "1", "1", "largest modulus of the Floquet multipliers of every attractor found"
    ),
    "rival_force_min": Variable(
        (*_STATE, "rival"), "N", "N", "smallest mesh force of every other attractor found"
    ),
    "rival_force_max": Variable(
        (*_STATE, "rival"), "N", "N", "largest mesh force of every other attractor found"
    ),
    "attractor_search": Variable(
        ("update",),
        "",
        "",
        "what the search for another attractor came to",
        "none found, another found, cut off by its bound on the work, not looked for",
    ),
}

MODE_KINDS = {
    "mode_kind": Variable(
        ("mode",), "", "", "what moves: rigid-body, rotational, translational, planet or mixed"
    ),
}

FRICTION = {
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
}

ON_REQUEST = {
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
}

MODES = {
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
}

GROUPS: tuple[VariableGroup, ...] = (
    VariableGroup("dynamics", "[dynamics]", MOTION),
    VariableGroup("dynamics", "[dynamics]", MODE_KINDS),
    VariableGroup("dynamics", "dynamics.friction", FRICTION),
    VariableGroup("dynamics", "[dynamics], where [store] variables names it", ON_REQUEST),
    VariableGroup("dynamics", "[dynamics]", MODES),
)


_OVER_SPEED = ("mesh", "direction", "response_speed")

OVER_SPEED = {
    "response_speed": Variable(("response_speed",), "rad s-1", "rpm", "speed of the input member"),
    "response_dynamic_factor": Variable(_OVER_SPEED, "1", "1", "largest dynamic over static mesh force"),
    "response_force_peak_to_peak": Variable(_OVER_SPEED, "N", "N", "range of the dynamic mesh force"),
    "response_force_rms": Variable(_OVER_SPEED, "N", "N", "RMS of the dynamic mesh force fluctuation"),
    "response_dte_peak_to_peak": Variable(_OVER_SPEED, "m", "um", "range of the dynamic transmission error"),
    "response_dte_rms": Variable(_OVER_SPEED, "m", "um", "RMS of the dynamic transmission error fluctuation"),
    "response_separation_fraction": Variable(
        _OVER_SPEED, "1", "%", "fraction of time in which no drive flank pushes"
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
}

GROUPS += (VariableGroup("response over speed", "dynamics.response", OVER_SPEED),)
