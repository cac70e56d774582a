"""Single and mesh stiffness of ISO 6336-1 in every printed digit, and
its face load factor.
"""

import math

import pytest
from reference_pairs import ISO, NREL, both, pair_of

from wearlab.gears.iso import (
    Rack,
    Tooth,
    face_load_factor,
    mesh_stiffness,
    single_stiffness,
    theoretical_stiffness,
    virtual_teeth,
)


@pytest.mark.parametrize(("case", "digits"), [(ISO, 5), (NREL, 3)])
def test_every_printed_digit_of_the_stiffness(case, digits):
    pair, turned, given = pair_of(case)
    angle = math.radians(float(given["normal_pressure_angle"]))
    beta = turned.angle
    shifts = both(given.get("shift_1/shift_2", given.get("shift")))
    if case == ISO:  # the report computes with what it prints, three decimals
        shifts = [round(x, 3) for x in shifts]
    first, second = (
        Tooth(*pair) for pair in zip(both(given["teeth"]), shifts, strict=True)
    )
    rack = Rack(angle, float(given["tool_dedendum"]), beta)
    factor = float(given.get("body_factor_C_R", 1.0))
    single = single_stiffness(first, second, rack, body_factor=factor)
    whole = mesh_stiffness(single, pair.contact_ratio)
    found = {
        "single_stiffness": single,
        "mesh_stiffness_alpha": whole.alpha,
        "mesh_stiffness_beta": whole.beta,
    }
    if case == ISO:
        found["theoretical_single_stiffness"] = theoretical_stiffness(
            first, second, rack
        )
        teeth = [round(virtual_teeth(z, beta, angle), 3) for z in both(given["teeth"])]
        assert teeth == both(given["virtual_teeth"])
    assert {name: round(value / 1e9, digits) for name, value in found.items()} == {
        name: float(given[name]) for name in found
    }


def test_the_face_load_factor_is_continuous_where_contact_begins_to_leave_the_end():
    stiffness, load = 15e9, 250e3
    full = 2.0 * load / stiffness
    assert face_load_factor(full, load, stiffness) == pytest.approx(2.0, rel=1e-14)
    assert face_load_factor(full * (1.0 + 1e-9), load, stiffness) == pytest.approx(
        2.0, rel=1e-8
    )
