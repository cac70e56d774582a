"""A calibration is a run: lived once, kept, named by those that rest on it, found by
the next campaign.
"""

import pytest
from scenes import external_pair

from wearlab.campaign.coercion import campaign_of
from wearlab.cli.commands.ls import show
from wearlab.runner import run
from wearlab.runner.plan import plan
from wearlab.runner.preparation import calibrations
from wearlab.runner.worker import Task
from wearlab.scene import Scene, calibrating
from wearlab.simulation import calibration as simulating
from wearlab.store import Store
from wearlab.store.export import export_attributes
from wearlab.store.merging import merge
from wearlab.store.outcome import CALIBRATION, Outcome
from wearlab.store.provenance import bibtex, children, citation, facts_of
from wearlab.store.pruning import prunable

PAIR = {
    "gears": external_pair(25, 30),
    "operation": {"torque": "100 N*m", "speed": "1100 rpm"},
    "mesh": {"stiffness": "potential-energy"},
}
GIVEN = {
    "model": "calibrated",
    "life": 1e7,
    "depth": "1 um",
    "flank": "pinion",
    "torque": "340 N*m",
    "speed": "1100 rpm",
}
WEAR = {
    "coefficient": GIVEN,
    "until": {"depth": "1 um", "flank": "pinion"},
    "load": "static",
}


def campaign(torque):
    return {
        **PAIR,
        "title": f"at {torque}",
        "operation": {**PAIR["operation"], "torque": torque},
        "wear": WEAR,
    }


def scene(torque):
    return Scene.from_mapping(
        {key: value for key, value in campaign(torque).items() if key != "title"}
    )


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A store with one campaign that is calibrated, its run, and the
    run that calibrated it.
    """
    simulating._LIVES.clear()
    store = Store(tmp_path_factory.mktemp("calibrating") / "store")
    report = run(campaign("170 N*m"), store, workers=1, progress=False)
    assert (report.total, report.done, report.computed) == (1, 1, 1)
    assert not simulating._LIVES  # the store has it: the run did not live it again
    return store, scene("170 N*m").id, calibrating(scene("170 N*m")).id


def test_the_run_names_what_calibrated_it(kept):
    store, own, by = kept
    assert set(store.archive.entries()) == {own, by}
    data = store.run(own)
    assert (
        data.attrs["calibration"] == by
        and float(data.attrs["calibration_life"]) == store.run(by).life
    )
    assert show(own, store).content["calibrated by"] == by
    assert (
        show(by, store).content["calibrates"]
        == [own]
        == children(store, by, CALIBRATION)
    )
    facts = facts_of(store, own)
    assert f"calibrated by run {by}." in citation(
        facts
    ) and f"calibrated by run {by}" in bibtex(facts)


def test_the_stored_scene_is_the_calibration(kept):
    store, _, by = kept
    again = Scene.from_canonical(store.archive.entries([by])[by].scene)
    assert again.id == by and calibrating(again) is None


def test_the_next_campaign_finds_it(kept, monkeypatch):
    store, _, by = kept
    planned = plan(campaign_of(campaign("340 N*m")), store)
    assert [one.id for one in planned.runs] == [scene("340 N*m").id]
    monkeypatch.setattr(
        simulating, "_calibration_life", None
    )  # nothing may be lived again
    report = run(campaign("340 N*m"), store, workers=1, progress=False)
    assert report.computed == 1 and len(store.archive.entries()) == 3
    found = store.run(scene("340 N*m").id)
    assert found.attrs["calibration"] == by and float(found.life) == pytest.approx(
        1e7, rel=1e-5
    )


def test_a_plan_counts_it_where_it_is_missing(tmp_path):
    planned = plan(campaign_of(campaign("340 N*m")), Store(tmp_path / "none"))
    assert [one.label for one in planned.runs] == ["base", "calibration"]


def test_it_stays_as_long_as_what_rests_on_it(kept, tmp_path):
    store, _, by = kept
    copy = Store(tmp_path / "copy")
    assert by in merge(copy, store).copied
    assert prunable(copy) == []
    for run_id in {*copy.archive.entries()} - {by}:
        copy.archive.catalogue.forget([run_id])
    assert [one.id for one in prunable(copy)] == [by]


def test_exports_name_it(kept):
    store, _, by = kept
    assert (
        export_attributes(campaign_of(campaign("170 N*m")), store)["calibration"] == by
    )


def test_a_store_elsewhere_lives_it_again(kept, tmp_path):
    store, own, by = kept
    elsewhere = Store(tmp_path / "elsewhere")
    run(campaign("170 N*m"), elsewhere, workers=1, progress=False)
    assert (
        elsewhere.run(own).attrs["calibration_life"]
        == store.run(own).attrs["calibration_life"]
    )
    assert set(elsewhere.archive.entries()) == {own, by}


def test_a_calibration_that_failed_is_tried_again_though_its_campaign_is_complete(
    kept, tmp_path
):
    store, _, by = kept
    copy = Store(tmp_path / "copy")
    merge(copy, store)
    known = copy.archive.entries([by])[by]
    copy.archive.catalogue.record(
        [
            Outcome(
                by,
                "failed",
                "2026-01-01",
                0.0,
                known.scene,
                reason="the worker process died",
            )
        ]
    )
    assert run(campaign("170 N*m"), copy, workers=1, progress=False).ok
    assert copy.archive.heads([by])[by].state == "failed"
    assert run(campaign("170 N*m"), copy, workers=1, progress=False, retry=True).ok
    assert copy.archive.heads([by])[by].state == "done" and copy.verify() == []


def test_equal_needs_are_one_run():
    tasks = [Task(str(i), scene(f"{i} N*m")) for i in (100, 200, 300)]
    needed = calibrations(tasks)
    assert len(needed) == 3 and len({task.id for task in needed.values()}) == 1
