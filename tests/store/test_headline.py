"""What a run came to, in words: by hand."""

import pytest

from wearlab.store.outcome import headlines

LIFE = {
    "life": 2e7,
    "error_estimate_life": 4e3,
    "max_wear_depth": 4e-4,
    "error_estimate_wear_depth": 8e-8,
}
FORCES = {
    "mesh_force_max": 8000.0,
    "error_estimate_mesh_force_max": 4.0,
    "ste_peak_to_peak": 1.25e-5,
}


def test_life_comes_before_wear():
    life, wear = headlines({**FORCES, **LIFE, "cycle": 2e7})
    assert (life.text, life.short, life.of) == (
        "2e+07 cycles of life",
        "2e+07 cycles",
        "life",
    )
    assert life.error == pytest.approx(2e-4, rel=1e-12)
    assert (wear.text, wear.short) == (
        "400 µm worn",
        "400 µm",
    ) and wear.error == pytest.approx(2e-4)


def test_hours_stand_beside_cycles():
    life, wear = headlines(
        {
            **LIFE,
            "cycle": 2e7,
            "service_life": 3.6e6 * 1.234567,
            "operating_hours": 7200.0,
        }
    )
    assert (
        life.text == "2e+07 cycles of life = 1,230 h"
        and life.short == "2e+07 cycles = 1,230 h"
    )
    assert wear.text == "400 µm worn after 2 h"


def test_one_wear_state_tells_what_acts_in_the_mesh_and_not_the_wear_it_was_given():
    force, ste, given = headlines({**FORCES, "cycle": 0.0, "max_wear_depth": 1e-5})
    assert (force.short, force.error) == (
        "8000 N in mesh",
        pytest.approx(5e-4, rel=1e-12),
    )
    assert (ste.short, ste.error) == ("12.5 µm STE", None)
    assert given.short == "10 µm"


def test_nothing_to_tell_and_nothing_to_compare_with():
    assert headlines({"verdict": "completed"}) == []
    (still,) = headlines(
        {"cycle": 0.0, "mesh_force_max": 0.0, "error_estimate_mesh_force_max": 1.0}
    )
    assert still.error is None


def test_an_end_that_nobody_asked_for_is_told_and_no_wear_before_all_else():
    none = headlines(
        {
            "cycle": 0.0,
            "ste_peak_to_peak": 1e-5,
            "max_wear_depth": 0.0,
            "end_reason": "no wear",
        }
    )
    assert none[0].short == "no wear" and "nothing wears" in none[0].text
    worn = headlines(
        {"cycle": 1e6, "max_wear_depth": 1e-6, "end_reason": "section vanished"}
    )
    assert [one.short for one in worn] == ["1 µm", "ended: section vanished"]
    for asked in ("cycles", "depth"):
        assert len(headlines({**LIFE, "cycle": 1e6, "end_reason": asked})) == 2


def test_another_attractor_is_told_by_its_largest_force():
    force, _, other = headlines(
        {**FORCES, "cycle": 0.0, "coexisting_force_max": 16922.7}
    )
    assert force.text == "8000 N largest mesh force" and other.error is None
    assert (
        other.text
        == "1.692e+04 N largest mesh force of the worst other attractor found"
    )
    assert (
        headlines({**LIFE, "cycle": 2e7, "coexisting_force_max": 900.0})[2].short
        == "900 N in another attractor"
    )


def test_a_number_stands_with_its_estimated_error_where_there_is_one():
    life, wear = headlines({**LIFE, "cycle": 2e7})
    assert life.with_error == "2e+07 cycles of life (± 0.02 % of the life)"
    assert headlines({"cycle": 0.0, "ste_peak_to_peak": 1.25e-5})[
        0
    ].with_error.endswith("STE")
    assert wear.with_error == "400 µm worn (± 0.02 % of the wear)"
