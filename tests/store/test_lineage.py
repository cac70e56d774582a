"""From which runs a run goes on, as told by the catalogue, ``show``,
``cite`` and ``prune``.
"""

import json

import pytest

from wearlab.cli.commands.ls import show
from wearlab.store import Store
from wearlab.store.description import describe
from wearlab.store.netcdf import to_image
from wearlab.store.outcome import Outcome
from wearlab.store.provenance import bibtex, children, citation, facts_of, lineage
from wearlab.store.pruning import prunable
from wearlab.store.upkeep import verify

FIRST = "a" * 20
SECOND = "b" * 20
THIRD = "c" * 20
GONE = "d" * 20
FOURTH = "f" * 20


def outcome(run_id, start, **attributes):
    import xarray as xr

    scene = json.dumps(
        {"operation": {"torque": 7.0}} | ({"start": start} if start else {})
    )
    data = xr.Dataset(
        {"life": 1.0},
        {"cycle": ("update", [0.0, 5e3])},
        attrs={"id": run_id, "scene": scene, **attributes},
    )
    return Outcome(
        run_id, "done", "2026-01-01", 1.0, scene, *to_image(data), **describe(data)
    )


@pytest.fixture
def store(tmp_path):
    store = Store(tmp_path / "store")
    store.archive.create()
    with store.archive.presence() as presence:
        store.archive.save(
            [
                outcome(FIRST, {"run": GONE, "life_fraction": 0.5}),
                outcome(
                    SECOND,
                    {"run": FIRST, "cycle": 2e7, "replace": ["pinion"]},
                    parent_cycle="2e7",
                ),
                outcome(THIRD, {"run": SECOND}, parent_cycle="1234567.0"),
            ],
            presence.token,
        )
    who = {
        "author": "A. Author",
        "orcid": "0000-0002-1825-0097",
        "licence": "CC-BY-4.0",
    }
    store.archive.catalogue.record_campaign(
        "More torque", "doi:10/x", None, [(SECOND, "base", {"speed": "9 rpm"})]
    )
    store.archive.catalogue.record_campaign(
        "Tail", None, None, [(THIRD, "base", {})], who
    )
    return store


def test_a_chain_is_told_to_its_end(store):
    steps = lineage(store, store.archive.find(THIRD))
    assert [step.run for step in steps] == [SECOND, FIRST, GONE]
    assert [step.at for step in steps] == [
        "cycle 1.23457e+06",
        "cycle 2e+07",
        "0.5 of its life",
    ]
    assert steps[0].name == "More torque, base, speed=9 rpm" and steps[1].replaced == (
        "pinion",
    )
    assert str(steps[1]) == f"run {FIRST} from cycle 2e+07, new flanks: pinion"
    assert str(steps[2]).endswith("from 0.5 of its life, not in this store")
    assert children(store, FIRST) == [SECOND] and children(store, THIRD) == []


def test_runs_that_continue_themselves_end(store):
    with store.archive.presence() as presence:
        store.archive.save([outcome(GONE, {"run": GONE})], presence.token)
    assert len(lineage(store, store.archive.find(GONE))) <= 100


def test_the_cycle_of_the_parent_can_be_asked_for(store):
    assert store.query("parent_cycle > 1e6", columns=("parent_cycle",))[
        "parent_cycle"
    ] == [2e7, 1234567.0]


def test_show_and_cite_tell_who_and_from_where(store):
    told = "\n".join(map(str, show(THIRD, store).text))
    assert (
        "goes on from" in told
        and FIRST in told
        and "A. Author" in told
        and "CC-BY-4.0" in told
    )
    assert show(FIRST, store).content["continued by"] == [SECOND]
    facts = facts_of(store, THIRD)
    assert "A. Author (ORCID 0000-0002-1825-0097). (2026). Tail" in citation(facts)
    assert f"It goes on from run {SECOND}" in citation(
        facts
    ) and "Licence: CC-BY-4.0." in citation(facts)
    assert f"goes on from run {SECOND}" in bibtex(
        facts
    ) and "licence CC-BY-4.0" in bibtex(facts)


def test_what_a_kept_run_goes_on_from_stays(store):
    with store.archive.presence() as presence:
        store.archive.save([outcome("e" * 20, None)], presence.token)
    store.archive.catalogue.record_campaign("More torque", None, None, [])
    assert [run.id for run in prunable(store)] == ["e" * 20]


def calibrated_on(store, cycles):
    with store.archive.presence() as presence:
        found = [
            outcome(FOURTH, None),
            outcome("e" * 20, None, calibration=FOURTH, calibration_life=cycles),
        ]
        store.archive.save(found, presence.token)


@pytest.mark.parametrize(("cycles", "problems"), [("5000.0", 0), ("5001.0", 1)])
def test_a_calibration_that_became_another_is_told(store, cycles, problems):
    calibrated_on(store, cycles)
    found = list(verify(store))
    assert len(found) == problems
    assert all(
        "e" * 20 in str(one.path) and f"calibrated by run {FOURTH}" in one.message
        for one in found
    )
