"""What a page tells of loads and wear law, and of wear that a flank begins with."""

from types import SimpleNamespace

import pytest
from made_up import put, run
from scenes import CAMPAIGNS, external_pair

import wearlab as wl
from wearlab.assembly import build
from wearlab.assembly.sheet import sheet
from wearlab.campaign.coercion import campaign_of
from wearlab.report.answer import answer
from wearlab.report.conditions import conditions
from wearlab.report.page import report
from wearlab.store import Store

WEAR = {
    "coefficient": {"model": "constant", "value": "2e-10 mm^3/Nm"},
    "until": {"depth": "20 um"},
}


def study(**more):
    return campaign_of(
        {
            "title": "t",
            "gears": external_pair(
                {"teeth": 19, "profile_shift_coefficient": 0.3},
                31,
                module="2.5 mm",
                face_width="25 mm",
            ),
            "operation": {"torque": "60 N*m", "speed": "1450 rpm"},
            "wear": {"load": "static", **WEAR},
            **more,
        }
    )


def told(campaign):
    return {one.meaning: one.value for one in conditions(campaign).shared}


def test_torque_speed_and_wear_coefficient_are_told():
    found = told(study())
    assert (found["torque on the pinion"], found["speed of the pinion"]) == (
        "60",
        "1450",
    )
    assert found["power"] == "9.111"  # 60 N m × 151.8 rad/s
    assert (
        found["wear coefficient"] == "2e-10"
        and found["wear law"] == "Archard, static load"
    )
    assert found["ends at"] == "20 µm of wear"


def test_what_varies_is_told_case_by_case_and_of_many_cases_as_a_range():
    two = conditions(study(sweep=[{"operation.torque": ["60 N*m", "80 N*m"]}]))
    assert two.heads == ("torque on the pinion [N·m]", "power [kW]")
    assert two.cases == (
        ("torque 60 N·m", ("60", "9.111")),
        ("torque 80 N·m", ("80", "12.15")),
    )
    assert "torque on the pinion" not in {one.meaning for one in two.shared}
    many = study(sweep=[{"operation.torque": [f"{60 + i} N*m" for i in range(30)]}])
    assert (
        told(many)["torque on the pinion"] == "60 to 89 (30 values)"
        and not conditions(many).cases
    )


@pytest.mark.parametrize(
    "name", ["planetary_duty", "planetary_torque", "internal_wear_life"]
)
def test_any_campaign_has_conditions(name):
    found = conditions(wl.load(CAMPAIGNS / f"{name}.toml"))
    words = " ".join([*(one.meaning for one in found.shared), *found.heads])
    assert "wear law" in words and "speed of" in words and "torque on" in words


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """Two torques of a pinion with a measured flank, made up: the
    gear wears deepest.
    """
    folder = tmp_path_factory.mktemp("conditions")
    (folder / "flank.csv").write_text("diameter [mm];depth [um]\n45;3\n50;3\n54;3\n")
    initial = {"pinion": {"file": str(folder / "flank.csv"), "continuation": "hold"}}
    campaign = study(
        wear={"load": "static", **WEAR, "initial": initial},
        sweep=[{"operation.torque": ["60 N*m", "80 N*m"]}],
    )
    store = Store(folder / "store")
    store.archive.create()
    for case, hours in zip(campaign.cases, (100.0, 50.0), strict=True):
        data = run(1000.0)
        data["max_wear_depth"] = data["max_wear_depth"].copy(
            data=[[3e-6, 0.0], [5e-6, 2e-6], [20e-6, 9e-6]]
        )
        data = data.assign(
            life=((), 1e8),
            service_life=((), 3600.0 * hours),
            error_estimate_life=((), 1.3e5),
        )
        put(store, case.id, data)
    return campaign, store


def test_the_flank_and_its_first_wear_are_named(stored):
    campaign, store = stored
    entries = store.archive.entries(case.id for case in campaign.cases)
    said = " ".join(answer(campaign, entries, 2.0, store).sentences)
    assert "20 µm of wear on the pinion is reached after 50 h" in said
    assert (
        "The wear that the pinion begins with (up to 3 µm, as measured in flank.csv) "
        "is part" in said
    )
    assert "estimated at up to 0.13 %" in said and "at most" not in said
    assert "as measured in flank.csv" in " ".join(
        build(campaign.cases[0].scene).validity
    )  # what `show` tells


def test_a_varied_wear_coefficient_gets_no_second_range():
    campaign = study(
        sweep=[
            {"wear.coefficient.value": ["1e-10 mm^3/Nm", "1e-9 mm^3/Nm"], "name": "k"}
        ]
    )
    done = SimpleNamespace(
        state="done",
        summary={
            "operating_hours": 36e4,
            "service_life": 36e4,
            "life": 1e8,
            "error_estimate_life": 1e5,
        },
    )
    found = answer(campaign, {case.id: done for case in campaign.cases}, 3.16)
    assert not any(one.range for one in found.cases)
    assert "varied from case to case" in " ".join(
        found.sentences
    ) and "3.16" not in " ".join(found.sentences)


def test_ends_that_nobody_asked_for_stand_in_the_head():
    campaign = study(
        sweep=[
            {"wear.coefficient.value": ["1e-10 mm^3/Nm", "1e-9 mm^3/Nm"], "name": "k"}
        ]
    )
    nothing = SimpleNamespace(
        state="done", summary={"operating_hours": 0.0, "end_reason": "no wear"}
    )
    vanished = SimpleNamespace(
        state="done",
        summary={
            "operating_hours": 36e4,
            "end_reason": "section vanished",
            "max_wear_depth": 1e-5,
        },
    )
    first, second = (case.id for case in campaign.cases)
    (alone,) = answer(campaign, {first: nothing}, 2.0).sentences
    assert (
        alone.startswith("1 of 1 ended otherwise than asked")
        and "nothing wears off these flanks" in alone
    )
    said = " ".join(answer(campaign, {first: nothing, second: vanished}, 2.0).sentences)
    assert (
        said.count("1 of 2 ended otherwise than asked") == 2
        and "section vanished" in said
    )


def test_page_of_one_run(stored):
    campaign, store = stored
    alone = report(study(wear={"load": "static", **WEAR}), store)
    assert "<b>1</b><span>run</span>" in alone and "over the first" not in alone
    whole = report(campaign, store)
    assert "Operating conditions and wear law" in whole and "over the first" in whole
    assert "of the life" in whole and whole.count("estimated numerical error</th>") == 2


def test_lengths_are_told_to_the_micrometre():
    rows = {row.meaning: row.values for row in sheet(study().cases[0].scene).rows}
    assert rows["base diameter"] == ("44.635", "72.826") and rows[
        "working pressure angle"
    ] == ("21.722",)
