"""Campaigns pair by pair: partners by label and place, whatever unit a file wrote."""

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from made_up import SPEEDS, Axis, Campaign, Case, put
from made_up import run as made

from wearlab.comparison import CompareError, compare
from wearlab.comparison.campaigns import side
from wearlab.comparison.rows import PAIR_HEADS
from wearlab.store import Store


def run(speed):
    data = made(speed)
    return data[
        [
            name
            for name in ("mesh_stiffness", "dynamic_mesh_force", "wear_depth", "life")
            if name in data
        ]
    ]


@pytest.fixture(scope="module")
def store(tmp_path_factory) -> Store:
    store = Store(tmp_path_factory.mktemp("compare") / "store")
    store.archive.create()
    for index, speed in enumerate((*SPEEDS, None)):
        put(store, f"{index}" * 20, run(speed))
        worse = run(speed)
        worse["mesh_stiffness"] = worse["mesh_stiffness"] * (1.0 + 0.01 * (index + 1))
        put(store, f"{index + 4}" * 20, worse)
    return store


def campaign(first: int, speeds=SPEEDS, units="rpm") -> Campaign:
    cases = [Case("base", f"{first + i}" * 20, {"speed": i}) for i in range(3)]
    axes = (Axis("speed", tuple(speeds), units, "operation.speed"),)
    return Campaign(
        (*cases, Case("static", f"{first + 3}" * 20)), axes, f"from {first}"
    )


def stiffness(found):
    return found["largest_relative_difference"].sel(quantity="mesh_stiffness").values


def test_pairs_by_label_and_place(store):
    found = compare(campaign(0), campaign(4), store=store)
    assert found["pair"].values.tolist() == [
        "speed = 800 rpm",
        "speed = 1100 rpm",
        "speed = 3720 rpm",
        "static",
    ]
    worse = 0.01 * np.arange(1, 5)
    np.testing.assert_allclose(stiffness(found), worse / (1.0 + worse))
    assert found["run_id"].values[1].tolist() == ["1" * 20, "5" * 20]
    assert np.isnan(
        found["largest_relative_difference"].sel(quantity="dynamic_mesh_force")[-1]
    )
    assert json.loads(found.attrs["only_a"]) == json.loads(found.attrs["only_b"]) == []


def test_a_grid_is_compared_like_its_campaign(store):
    found = compare(store.open(campaign(0)), store.open(campaign(4)))
    named = compare(campaign(0), campaign(4), store=store)
    np.testing.assert_allclose(
        found["largest_relative_difference"], named["largest_relative_difference"]
    )
    assert found["run_id"].values.tolist() == named["run_id"].values.tolist()


def test_at_most_five_missing_runs_are_named(store):
    many = campaign(0)
    speeds = (*SPEEDS, *range(4000, 4009))
    lacking = tuple(
        Case("base", f"f{i}" * 10, {"speed": i}) for i in range(3, len(speeds))
    )
    axes = (Axis("speed", speeds, "rpm", "operation.speed"),)
    many = replace(many, cases=(*many.cases, *lacking), axes=axes)
    said = ["speed = 4000 rpm: missing", "speed = 4004 rpm: missing", "and 4 more"]
    for found in (
        compare(campaign(0), many, store=store),
        compare(store.open(campaign(0)), store.open(many)),
    ):
        named = json.loads(found.attrs["only_b"])
        assert [named[0], *named[4:]] == said and len(named) == 6
    some = store.open(many).isel(speed=[0, 1, 3])
    assert (
        json.loads(compare(store.open(campaign(0)), some).attrs["only_b"]) == said[:1]
    )


def test_the_unit_of_the_file_does_not_matter(store):
    other = campaign(4, [v / 60 for v in SPEEDS], "rev/s")
    found = compare(
        campaign(0),
        replace(other, axes=(replace(other.axes[0], units="rev/s"),)),
        store=store,
    )
    assert found.sizes["pair"] == 4


def test_what_has_no_partner_is_named(store):
    other = campaign(4, (800.0, 1200.0, 3720.0))
    other = replace(
        other,
        cases=(*other.cases[:2], replace(other.cases[2], id="f" * 20), other.cases[3]),
    )
    found = compare(campaign(0), other, store=store)
    assert found["pair"].values.tolist() == ["speed = 800 rpm", "static"]
    assert json.loads(found.attrs["only_a"]) == ["speed = 1100 rpm", "speed = 3720 rpm"]
    assert json.loads(found.attrs["only_b"]) == [
        "speed = 1200 rpm",
        "speed = 3720 rpm: missing",
    ]
    with pytest.raises(CompareError, match=r"no run of 'from 0' has a partner"):
        compare(campaign(0), replace(other, cases=other.cases[1:2]), store=store)


def test_lives_in_a_table_of_pairs_have_their_unit():
    assert PAIR_HEADS[1:3] == ("life A [cycles]", "life B [cycles]")


def test_by_id(store):
    found = compare("0", "4", store=store)
    assert float(
        found["largest_relative_difference"].sel(quantity="mesh_stiffness")
    ) == pytest.approx(0.01 / 1.01)


def test_a_case_that_shares_a_run_with_the_base_takes_no_place_from_it():
    """Was: the base lost its 900 rpm, and the case stood at 800 rpm."""
    own = json.dumps({"as built": {"speed": 900.0}})
    computed = (("speed", "case"), [[True, False], [True, True]], {"own_values": own})
    grid = xr.Dataset(
        {
            "run_id": (("speed", "case"), [["a", "b"], ["b", "b"]]),
            "status": (("speed", "case"), np.full((2, 2), "done")),
        },
        {
            "speed": ("speed", [800.0, 900.0], {"units": "rpm"}),
            "case": ["base", "as built"],
            "computed": computed,
        },
    )
    named = {member.name: member.id for member in side(grid, None, "A").members}
    assert named == {"speed = 800 rpm": "a", "speed = 900 rpm": "b", "as built": "b"}
