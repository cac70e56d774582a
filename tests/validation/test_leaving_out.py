"""An absent part changes nothing where its effect is zero, and stores less."""

import numpy as np
import pytest
from leaving_out import PARTS, Saving, apart, row, saving, scene

from wearlab.assembly import build
from wearlab.simulation import simulate

NARROW = {"mesh.extended_contact": False}
"""Two pairs a mesh, as in other tests with friction: the same compiled code."""


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.name)
def test_results_are_identical_where_the_effect_is_zero(part):
    if part.name == "friction":
        part = part._replace(present=part.present | NARROW, absent=part.absent | NARROW)
    found = saving(part, turns=1)
    assert found.difference <= part.tolerance
    assert scene(part.present).id != scene(part.absent).id


def test_absent_parts_are_neither_computed_nor_stored():
    by_name = {part.name: part for part in PARTS}
    still = simulate(scene(by_name["dynamics"].absent))
    assert not {"dynamic_mesh_force", "response_period", "natural_frequency"} & set(
        still.variables
    )
    assert still.count_period_maps.item() == 0
    dry = simulate(scene(by_name["film factor"].absent))
    assert not {"film_thickness", "lambda_ratio"} & set(dry.variables)
    unworn = simulate(scene(by_name["the wear law"].absent))
    assert not {"wear_rate", "wear_depth"} & set(unworn.variables)


def test_an_effect_that_is_not_zero_is_seen():
    """The comparison can tell: the same parts with an effect change the results."""
    part = {part.name: part for part in PARTS}["torque fluctuation"]
    wave = {"order": 1, "amplitude": "10 N*m", "phase": "0 deg"}
    assert (
        saving(
            part._replace(present={"operation.torque_fluctuation": wave}), turns=1
        ).difference
        > 1e-3
    )


def test_proven_linear_contact_takes_one_period_map_and_its_check_a_state():
    part = {part.name: part for part in PARTS}[
        "integration until steady (contact proven linear)"
    ]
    maps = []
    for change in (part.absent, part.present):
        parts = build(scene({**change, "mesh.extended_contact": False}))
        maps.append(
            parts.coupling.evaluate(parts.coupling.unworn()).response.counts.period_maps
        )
    linear, marched = maps
    assert linear == 2
    assert marched > 50


def test_a_saving_that_is_no_better_known_than_its_size_is_nil():
    def told(seconds, known):
        return row(Saving("part", seconds, known, (2000, 1000), 0.0, 0.0))[2]

    assert told((2e-3, 1e-3), 0.04) == "50 % ± 4"
    assert told((1e-3, 0.97e-3), 0.002) == "3 % ± 1"
    assert told((1e-3, 0.97e-3), 0.05) == "nil (< 5 %)"
    assert told((1e-3, 1.002e-3), 0.0) == "nil (< 1 %)"
    assert told((1e-3, 1.002e-3), 0.12) == "nil (< 12 %)"
    assert told((1e-3, 1.1e-3), 0.01) == "-10 % ± 1"
    turns = np.array([[2.0, 1.0], [9.0, 1.5], [2.0, 1.2], [9.0, 1.5]])
    assert apart([turns[:2], turns[2:]]) == pytest.approx(0.1)
    assert apart([turns, turns[:0]]) == 1.0
