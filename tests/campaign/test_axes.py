import math

import pytest

from wearlab.campaign import CampaignError
from wearlab.campaign.axes import read_axes


def axis(block):
    (one,) = read_axes([block])
    return one


def refused(*blocks):
    with pytest.raises(CampaignError) as caught:
        read_axes(list(blocks))
    (line,) = caught.value.problems
    return line


def test_values_stay_in_the_unit_of_the_file():
    one = axis({"operation.speed": ["800 rpm", "1.1e3 rpm", "1860rpm"]})
    assert (one.name, one.units, one.key) == ("speed", "rpm", "operation.speed")
    assert one.values == (800.0, 1100.0, 1860.0)
    assert one.written == {"operation.speed": ("800 rpm", "1.1e3 rpm", "1860rpm")}


def test_other_units_of_an_axis_follow_the_first():
    one = axis({"operation.torque": ["340 N*m", "0.5 kNm"]})
    assert one.values == (340.0, 500.0) and one.units == "N*m"
    assert "need one unit" in refused({"operation.torque": ["340 N*m", "3 mm"]})


@pytest.mark.parametrize(
    ("values", "stored"),
    [
        ([1, 2.5], (1, 2.5)),
        (["rk4", "rk45"], ("rk4", "rk45")),
        ([True, False], (True, False)),
    ],
)
def test_plain_values(values, stored):
    one = axis({"dynamics.method": values})
    assert one.values == stored and one.units is None


def test_nested_tables_are_dotted_keys():
    assert axis({"operation": {"speed": ["1 rpm"]}}).written == {
        "operation.speed": ("1 rpm",)
    }


def test_tables_need_labels():
    tables = [{"model": "constant", "value": "1 N/um"}, "potential-energy"]
    assert "labels = [...]" in refused({"mesh.stiffness": tables})
    one = axis({"mesh.stiffness": tables, "labels": ["soft", "computed"]})
    assert one.values == ("soft", "computed") and one.written[
        "mesh.stiffness"
    ] == tuple(tables)
    assert "no list of 2 texts" in refused(
        {"mesh.stiffness": tables, "labels": ["soft"]}
    )


def test_keys_of_a_block_advance_together():
    one = axis(
        {
            "gears.pinion.teeth": [20, 30],
            "gears.gear.teeth": [40, 60],
            "operation.torque": ["1 N*m", "2 N*m"],
        }
    )
    assert one.name == "teeth" and one.values == (20, 30)
    assert set(one.coordinates) == {"gear_teeth", "torque"}
    assert one.coordinates["gear_teeth"].values == (40, 60)
    assert (one.coordinates["torque"].units, one.coordinates["torque"].key) == (
        "N*m",
        "operation.torque",
    )
    assert "gears.gear.teeth has 1" in refused(
        {"gears.pinion.teeth": [20, 30], "gears.gear.teeth": [40]}
    )


@pytest.mark.parametrize(
    ("generator", "values"),
    [
        (
            {"linspace": [800, 1200, 5], "unit": "rpm"},
            (800.0, 900.0, 1000.0, 1100.0, 1200.0),
        ),
        ({"linspace": [0.1, 0.5, 5]}, (0.1, 0.2, 0.3, 0.4, 0.5)),
        ({"linspace": [3, 1, 3]}, (3.0, 2.0, 1.0)),
        ({"linspace": [3, 3, 1]}, (3.0,)),
        ({"logspace": [1, 1000, 4], "unit": "N*m"}, (1.0, 10.0, 100.0, 1000.0)),
        ({"integers": [3, 6]}, (3, 4, 5, 6)),
        ({"integers": [3, 3]}, (3,)),
    ],
)
def test_generators(generator, values):
    one = axis({"a.b": generator})
    assert one.values == values and one.units == generator.get("unit")
    if "unit" in generator:
        assert one.written["a.b"][0] == f"{values[0]!r} {generator['unit']}"


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ([], "sweep[0].a.b: an empty sweep"),
        ("3 mm", "sweep[0].a.b: '3 mm' is no list of values"),
        ({"linspace": [1, 2]}, "[first, last, how many]"),
        ({"linspace": [1, 2, 0]}, "0 values from 1 to 2"),
        ({"linspace": [1, 2, 1]}, "1 values from 1 to 2"),
        ({"linspace": [1, 2, 2.5]}, "2.5 values"),
        ({"linspace": [1, math.nan, 3]}, "is not [first, last"),
        ({"linspace": ["1 rpm", "2 rpm", 3]}, "is not [first, last"),
        ({"linspace": [1, 2, 3], "units": "rpm"}, "'units' does not belong"),
        ({"logspace": [0, 2, 3]}, "must be greater than 0"),
        ({"integers": [4, 3]}, "whole numbers"),
        ({"integers": [1, 2.5]}, "whole numbers"),
        ({"integers": [1, 2], "unit": "mm"}, "'unit' does not belong"),
        ({"lognormal": {"median": 1, "cov": 0.1}}, "add sample = {method"),
        ([1, math.nan], "not finite"),
        ([1, "a"], "mixes"),
        ([1, 2, 1.0], "stands twice"),
        (["1 rpm", "1.0 rpm"], "stands twice"),
    ],
)
def test_wrong_values_are_refused(value, said):
    assert said in refused({"a.b": value})


def test_a_block_without_keys_is_empty():
    assert "an empty sweep" in refused({})
    assert "an empty sweep" in refused({"name": "x"})
    assert "an empty sweep" in refused({"sample": {"method": "sobol"}})
    assert "at the top of the file" in refused({"a.b": [1], "exclude": "a > 1"})


@pytest.mark.parametrize(
    "key",
    [{"integers": [1, 10**12]}, {"linspace": [0, 1, 1e9]}, {"logspace": [1, 2, 1e9]}],
)
def test_absurd_axes_are_counted_not_expanded(key):
    assert "more than 100,000" in refused({"a.b": key})


def test_an_absurd_product_is_counted_not_expanded():
    said = refused(*({f"a.{name}": {"integers": [1, 2000]}} for name in "uvw"))
    assert (
        "u 2000 × v 2000 × w 2000 = 8,000,000,000 cases" in said and "sample = " in said
    )


def test_names():
    assert axis({"operation.speed": ["1 rpm"], "name": "n_1"}).name == "n_1"
    assert "is no name" in refused({"operation.speed": ["1 rpm"], "name": "n 1"})
    assert "is no name" in refused({"operation.speed": ["1 rpm"], "name": 3})


@pytest.mark.parametrize("word", ["phase", "flank", "case", "cycle", "wear_depth"])
def test_names_of_the_dataset_are_taken(word):
    assert "give the block another name" in refused({f"a.{word}": [1, 2]})
    assert axis({f"a.{word}": [1, 2], "name": "mine"}).name == "mine"


def test_two_axes_of_one_name():
    assert "that of another axis: give the block another name" in refused(
        {"a.x": [1]}, {"b.x": [1]}
    )
    assert [
        one.name for one in read_axes([{"a.x": [1]}, {"b.x": [1], "name": "y"}])
    ] == ["x", "y"]


@pytest.mark.parametrize("other", ["a.x", "a.x.y", "a"])
def test_no_key_is_swept_twice(other):
    assert "sweeps 'a.x' already" in refused({"a.x": [1]}, {other: [1], "name": "y"})


def test_a_sweep_is_a_list_of_tables():
    with pytest.raises(CampaignError, match=r"write \[\[sweep\]\]"):
        read_axes({"operation.speed": ["1 rpm"]})
