"""Quantities as a file wrote them: kept beside a campaign, told of a run, no part of
what a run is.
"""

import json

from scenes import external_pair

import wearlab as wl
from wearlab.campaign.campaign import with_figures
from wearlab.report import run as told

TABLE = {
    "title": "as written",
    "gears": external_pair(24, 53, face_width="0.03 m", pressure_angle="20 deg"),
    "operation": {"torque": "0.18 kN*m", "speed": "900 1/min"},
    "sweep": [{"operation.torque": ["0.18 kN*m", "250 Nm"]}],
}
USUAL = {**TABLE, "operation": {"torque": "180 N*m", "speed": "900 rpm"}}
USUAL["sweep"] = [{"operation.torque": ["180 N*m", "250 N*m"]}]


def scene(case):
    return dict(told.flat(json.loads(case.scene.canonical())))


def recorded(tmp_path, table):
    campaign = wl.load(table)
    store = wl.Store(tmp_path / "store")
    store.archive.create()
    members = [(case.id, case.label, {}) for case in campaign.cases]
    store.archive.catalogue.record_campaign(
        campaign.title, None, None, members, {}, with_figures(campaign)
    )
    return campaign, store


def test_a_scene_is_told_as_its_file_wrote_it(tmp_path):
    campaign, store = recorded(tmp_path, TABLE)
    first, second = campaign.cases
    written = told.written_in(store, second.id)
    shown = {
        key: told.in_file_units(key, value, written)
        for key, value in scene(second).items()
    }
    assert (
        shown["operation.torque"] == "250 Nm"
        and shown["operation.speed"] == "900 1/min"
    )
    assert shown["gears.face_width"] == "0.03 m" and shown["gears.module"] == "3 mm"
    value = scene(first)["operation.torque"]
    assert told.in_file_units("operation.torque", value, written) == "0.18 kN*m"
    assert (
        told.in_file_units("operation.torque", 200.0, written) == "0.2 kN*m"
    )  # derived: in the file's unit
    assert (
        told.in_file_units("operation.torque", value, {}) == "180 N*m"
    )  # nothing is recorded


def test_what_was_written_is_no_part_of_a_run(tmp_path):
    assert [c.id for c in wl.load(TABLE).cases] == [c.id for c in wl.load(USUAL).cases]


def test_lists_and_short_forms_are_told_too():
    written = {
        "mesh.misalignment": ["0.02 mm"],
        "wear.snapshots.depth": ["2 um", "0.005 mm"],
    }
    assert told.in_file_units("mesh.misalignment.value", [2e-5], written) == "[0.02 mm]"
    assert (
        told.in_file_units("wear.snapshots.depth", [2e-6, 5e-6], written)
        == "[2 um, 0.005 mm]"
    )


def test_what_a_store_says_wrongly_is_left_out():
    written = {"operation.torque": ["340 mm", None, "x" * 10_000, "1e400 N*m"]}
    assert told.in_file_units("operation.torque", 340.0, written) == "340 N*m"
