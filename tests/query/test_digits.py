"""Equality of quantities: what a file wrote is found again, in its
own unit and in every other.
"""

import re
from pathlib import Path
from random import Random

import numpy as np
import pytest

from wearlab.materials.grades import SCALES
from wearlab.query import Key, Vocabulary, read_condition
from wearlab.query.evaluate import COMPARED, alike, index_of_quantity, met
from wearlab.units import KINDS, UnitError, convert, quantity, rounded

TOUR = (Path(__file__).parents[2] / "docs" / "tour.md").read_text().replace("\\*", "*")
UNITS = sorted(
    {
        (kind.name, unit)
        for kind in KINDS.values()
        for unit in kind.units
        if unit not in SCALES
    }
)
HOLDING = {"<": False, "<=": True, ">": False, ">=": True, "=": True, "!=": False}


def drawn(dice, kind):
    """Return a plausible number of a kind in SI, with few digits as
    people write them.
    """
    low = max(kind.low, 1e-20)
    high = min(kind.high, 1e20)
    value = low * (high / low) ** dice.uniform(0.2, 0.8)
    return float(f"{value:.{dice.randint(1, 9)}g}")


def written(dice, name, unit):
    """Return a quantity of a kind as somebody writes it in a unit, and what a scene
    keeps of it.
    """
    while True:
        value = convert(drawn(dice, KINDS[name]), KINDS[name].unit, _own(unit))
        text = f"{value:.{dice.randint(1, 7)}g} {unit}"
        try:
            return text, rounded(quantity(text, name))
        except UnitError:
            continue  # beyond what is plausible


def _own(unit):
    return {"1/min": "rpm"}.get(unit, unit)


def asked(name, condition, value):
    vocabulary = Vocabulary([Key("x", "number", KINDS[name].unit, name)])
    return read_condition(condition, vocabulary).holds({"x": value})


@pytest.mark.parametrize(("name", "unit"), UNITS)
def test_what_was_written_is_met_by_every_operator(name, unit):
    """Over a thousand values are drawn in all, each asked for as it
    was written, and in SI.
    """
    dice = Random(f"{name} {unit}")
    for _ in range(15):
        text, kept = written(dice, name, unit)
        for told in (text, f"{kept!r} {KINDS[name].unit}"):
            for sign, wanted in HOLDING.items():
                assert asked(name, f"x {sign} {told}", kept) is wanted, (
                    sign,
                    told,
                    kept,
                )
                assert asked(name, f"{told} {sign} x", kept) is wanted, (
                    sign,
                    told,
                    kept,
                )
            assert asked(name, f"x in [{told}]", kept) and asked(
                name, f"x between {told} and {told}", kept
            )
            assert asked(name, f"x not in [{told}]", kept) is False


@pytest.mark.parametrize(("name", "unit"), UNITS)
def test_what_was_written_is_met_in_every_other_unit(name, unit):
    dice = Random(f"{unit} {name}")
    for other in set(KINDS[name].units) - set(SCALES):
        for _ in range(3):
            _, kept = written(dice, name, unit)
            said = f"{convert(kept, KINDS[name].unit, _own(other))!r} {other}"
            assert asked(
                name, f"x = {said} and x <= {said} and not x > {said}", kept
            ), (said, kept)


def test_every_unit_of_the_tour_is_among_them():
    known = {unit for _, unit in UNITS} | {"r/min", "rev/min", "min^-1"}
    quoted = {unit for unit in re.findall(r'"-?\d[\d.eE+-]* ([^"\d\s][^"\s]*)"', TOUR)}
    assert quoted and quoted <= known | {"rad", "um", "degC"}


def test_neighbours_in_the_last_digit_are_others():
    for kept in (1.0, 9.99999999999, 115.191730632, 1.23456789012e-19):
        step = 10.0 ** (int(f"{kept:.11e}".split("e")[1]) - 11)
        for other in (kept + step, kept - step if kept > 1.0 else kept + 2 * step):
            other = rounded(other)
            assert other != kept
            assert not met("=", other, kept) and met("!=", other, kept)
            assert met("<", kept, other) is (kept < other) and met(
                "<=", other, kept
            ) is (other < kept)


@pytest.mark.parametrize("value", [0.0, float("inf"), 12345678901234567, 2.0**60])
def test_some_numbers_are_only_themselves(value):
    assert set(alike(value)) <= {value}
    assert not met("=", np.nextafter(value, 1.0), value) and met("=", value, value)


def test_the_limits_agree_with_rounding():
    dice = Random(3)
    for _ in range(1000):
        value = dice.uniform(1.0, 10.0) * 10.0 ** dice.randint(-20, 11)
        other = value * (
            1.0
            + dice.choice((0.0, 1e-13, 1e-12, 3e-12, 1e-11, 1e-10))
            * dice.uniform(-1, 1)
        )
        for sign in COMPARED:
            if sign != "contains" and abs(rounded(value) - rounded(other)) != 0.0:
                assert met(sign, rounded(other), value) is COMPARED[sign](
                    rounded(other), rounded(value)
                )


SPEEDS = (800.0, 1100.0, 3720.0)


@pytest.mark.parametrize(
    ("asked", "found"),
    [
        *(
            (1100, 1),
            (1100.0, 1),
            ("1100 rpm", 1),
            ("115.191730632 rad/s", 1),
            ("62 rev/s", 2),
        ),
        *(
            ("1100 1/min", 1),
            ("1100 min^-1", 1),
            ("18.3333333333 rev/s", 1),
            ("800 r/min", 0),
        ),
        *(
            (1100.0000001, None),
            ("1100 Hz", None),
            ("1101 rpm", None),
            (True, None),
            ("fast", None),
        ),
    ],
)
def test_places_on_an_axis(asked, found):
    assert index_of_quantity(asked, SPEEDS, "rpm", "operation.speed") == found


def test_labels_are_found_as_they_are():
    assert index_of_quantity("new", ("old", "new"), None) == 1
    assert index_of_quantity("1100 rpm", ("old", "1100 rpm"), None) == 1
    assert index_of_quantity(True, (1, True), None) == 1
