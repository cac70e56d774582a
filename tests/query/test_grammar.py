import json
from array import array
from functools import partial

import pytest

from wearlab.query import Key, QueryError, Vocabulary, read_column, read_condition
from wearlab.query.grammar import LONGEST, tokens
from wearlab.query.keys import differences, flat, quantity_at, scene_key

SCENE = {
    "operation": {"torque": 340.0, "speed": 100.0},
    "gears": {"pinion": {"teeth": 50}, "gear": {"teeth": 20}},
    "mesh": {"stiffness": {"model": "potential-energy"}},
    "wear": {"coefficient": {"film": True}},
    "errors": {"harmonic": [{"order": 1, "amplitude": 2e-6}]},
}
VALUES = dict(flat(SCENE)) | {
    "life": 2e7,
    "status": "done",
    "started": "2026-03-01T10:00:00",
}
VOCABULARY = Vocabulary(
    [
        *(scene_key(name, isinstance(value, str)) for name, value in flat(SCENE)),
        *(
            Key("life", unit="1"),
            Key("depth", unit="m", display_unit="um", history=True),
        ),
        *(Key("status", "text"), Key("started", "date"), Key("separation", unit="1")),
    ],
    {"date": "started"},
)


def answer(text):
    return read_condition(text, VOCABULARY).holds(VALUES)


def refused(text):
    with pytest.raises(QueryError) as caught:
        read_condition(text, VOCABULARY)
    return caught.value


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("torque > 339 N*m", True),
        ("torque > 341 N*m", False),
        ("torque >= 0.34 kN*m and torque <= 340 N m", True),
        ("operation.torque = 340 Nm", True),
        ("scene.operation.torque != 340 N*m", False),
        ("300 N*m < torque < 350 N*m", True),
        ("300 N*m < torque < 330 N*m", False),
        ("400 N*m > torque", True),
        ("speed > 954 rpm and speed < 956 1/min", True),  # 100 rad/s is 954.93 rpm
        ("speed between 90 rad/s and 110 rad/s", True),
        ("speed not between 90 rad/s and 110 rad/s", False),
        ("life < 2e7", False),
        ("life <= 2e7 cycles", True),
        ("life < 3e7 or torque > 1 MN*m and life > 3e7", True),  # and binds closer
        ("(life < 3e7 or torque > 1 MN*m) and life > 3e7", False),
        ("not life < 3e7", False),
        ("not not (life < 3e7)", True),
        ("pinion.teeth in [49, 50]", True),
        ("pinion.teeth in (49, 51)", False),
        ("pinion.teeth not in [49, 51]", True),
        ("pinion.teeth > gear.teeth", True),
        ("model = potential-energy", True),
        ("model = 'potential-energy' and status = done", True),
        ("model contains 'ENERGY'", True),
        ("film", True),
        ("not film", False),
        ("film = false", False),
        ("amplitude > 1 um and harmonic.0.order = 1", True),
        ("started >= 2026-03-01 and started = 2026-03-01", True),
        ("started > 2026-03-01", False),
        ("date < 2026-03-01T09:30", False),
        ("separation > 0.1", None),
        ("separation > 0.1 and life > 1", None),
        ("separation > 0.1 and life < 1", False),
        ("separation > 0.1 or life > 1", True),
        ("not separation > 0.1", None),
        ("separation is missing and life is not missing", True),
        ("torque > 0", True),
    ],
)
def test_conditions(text, expected):
    assert answer(text) is expected


@pytest.mark.parametrize(
    ("text", "said", "at"),
    [
        ("torqe > 3 N*m", "unknown name 'torqe'; did you mean 'torque'", 0),
        (
            "life > 1 and teeth > 3",
            "may mean 'gears.gear.teeth' or 'gears.pinion.teeth'",
            13,
        ),
        ("torque > 3", "needs a unit, such as '340 N*m'", 9),
        ("depth > 3", "needs a unit, such as '1 um'", 8),
        ("torque > 3 um", "'um' is not a unit like 'N*m'", 9),
        ("speed > 25 Hz", "neither radians nor revolutions", 8),
        ("life > 'a'", "'life' is a number", 7),
        ("status > 3", "'status' is a text", 9),
        ("life contains 'a'", "contains no text", 0),
        ("torque > speed", "different units", 9),
        ("torque >", "expected a name or a value, but it ends", 8),
        ("torque 3 N*m", "expected a comparison", 7),
        ("torque > 3 N*m life", "'N*m life' is not a known unit", 9),
        ("(life > 1", "expected ')', but it ends", 9),
        ("life > 1)", "expected 'and', 'or' or the end, not ')'", 8),
        ("life in 3", "expected a list in [ ], not '3'", 8),
        ("life in [3; 4]", "';' belongs nowhere", 10),
        ("1 < 2", "nothing is asked", 0),
        ("status = 'x", "does not end", 9),
        ("life; DROP TABLE runs", "';' belongs nowhere", 4),
        ("__import__('os')", "unknown name", 0),
        ("life.__class__ > 1", "unknown name", 0),
        ("first_cycle(life > 3) > 1", "not kept along a life; there are 'depth'", 0),
        ("first_cycle(depth = 3 um) > 1", "one comparison with < or >", 0),
        ("", "expected a name or a value, but it ends", 0),
    ],
)
def test_refusals_point_at_the_place(text, said, at):
    error = refused(text)
    if "__import__" not in text:
        assert said in error.reason
        assert error.position == at
    assert str(error).endswith(f"\n  {text}\n  {' ' * error.position}^")


def test_hostile_lengths_and_depths_are_refused():
    assert "more than" in refused("life > 1 or " * LONGEST).reason
    assert "nested deeper" in refused("(" * 1000 + "life > 1" + ")" * 1000).reason
    assert "nested deeper" in refused("not " * 900 + "life > 1").reason


def test_all_values_of_both_sides_of_an_equality_are_asked_for():
    """Of the right side the smallest and the largest were all that was compared."""
    several = [Key(name, "number", "m", any_value=True) for name in ("first", "second")]
    vocabulary = Vocabulary([*several, Key("one", "number", "m")])
    read = partial(read_condition, vocabulary=vocabulary)
    assert read("first = second").whole == {"first", "second"}
    assert read("one != second").whole == {"second"}
    assert read("first < second").whole == set()
    middle = {"first[*]": (3.0,), "second[*]": (1.0, 3.0, 5.0), "first": 3.0}
    assert read("first = second").holds({**middle, "second": 5.0})


def test_first_cycle_binds_its_inner_unit():
    condition = read_condition("first_cycle(depth > 20 um) < 1e7 cycles", VOCABULARY)
    assert [key.name for key in condition.keys] == ["depth", "depth()", "cycle()"]
    for cycle, met in (
        (0.999999e7, True),
        (1.000001e7, False),
    ):  # at which the line is at 20 um
        line = {
            "depth()": array("d", [0.0, 40e-6]).tobytes(),
            "cycle()": array("d", [0.0, 2 * cycle]).tobytes(),
        }
        assert condition.holds(line) is met
    column = read_column("first_cycle(depth > 0.02 mm)", VOCABULARY)
    assert column.key.name == "depth" and column.limit == pytest.approx(20e-6)
    assert read_column("torque", VOCABULARY).name == "operation.torque"
    with pytest.raises(QueryError, match="a column is a name"):
        read_column("3", VOCABULARY)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("3 N*m and", "N*m"),
        ("3 N m", "N m"),
        ("3N*m)", "N*m"),
        ("3 mm^3/(N*m) or", "mm^3/(N*m)"),
        ("3 1/min", "1/min"),
        ("3 m s-1", "m s-1"),
        ("3 min^-1 and", "min^-1"),
        ("3 m²", "m²"),
        ("3 or", ""),
        ("3 ]", ""),
    ],
)
def test_units_end_where_words_begin(text, unit):
    assert tokens(text)[0].unit == unit


def test_kinds_of_scene_values():
    assert quantity_at("operation.speed") == "speed"
    assert (
        quantity_at("errors.harmonic.0.amplitude")
        == quantity_at("errors.harmonic.3.amplitude")
        == "depth"
    )
    assert quantity_at("gears.pinion.teeth") is None
    assert quantity_at("no.such.key") is None


def test_scenes_that_differ_in_a_hardness_are_told_apart_in_a_unit_that_converts():
    """Was "'HRC' is not a known unit": a scale is no unit, and runs
    could not be compared.
    """
    a = json.dumps({"wear": {"coefficient": {"hardness": 6000000000.0}}})
    b = json.dumps({"wear": {"coefficient": {"hardness": 7500000000.0}}})
    assert [tuple(each) for each in differences(a, b)] == [
        ("wear.coefficient.hardness", 6.0, 7.5, "GPa")
    ]


@pytest.mark.parametrize(
    ("condition", "holds"),
    [
        ("gears.module = 20 DP", True),
        ("gears.module < 10 DP", True),
        ("gears.module = 10 DP", False),
    ],
)
def test_diametral_pitches_stand_for_modules_in_conditions(condition, holds):
    """25.4 mm over 20 are 1.27 mm."""
    vocabulary = Vocabulary([Key("gears.module", "number", "m", "length")])
    asked = read_condition(condition, vocabulary)
    assert asked.holds({"gears.module": 1.27e-3}) is holds
