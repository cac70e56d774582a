"""The response over the speed of the input member."""

from wearlab.variable import Variable, VariableGroup

_OVER_SPEED = ("mesh", "direction", "response_speed")

OVER_SPEED = {
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
}

GROUPS = (VariableGroup("response over speed", "dynamics.response", OVER_SPEED),)
