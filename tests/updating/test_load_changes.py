"""A record that ends under another load than the scene has: said, not silent."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import STATIC
from made import RATE, ErrorModel, history, observed
from made import study as made_study

import wearlab as wl
from wearlab.updating import layout
from wearlab.updating.answers import outcome_of
from wearlab.updating.cases import studies
from wearlab.updating.load_changes import load_change
from wearlab.updating.measurements import OperatingRecord

RPM = np.pi / 30.0
BY_HOURS = """[update.record]
file    = "record.csv"
columns = { hours = "hours" }
units   = { hours = "h", torque = "N*m", speed = "rpm" }
"""
CYCLES = np.array([1e5, 2e5, 3e5])


def record(*rows, mixed=False):
    torque, rpm = np.array(rows, float).T
    time = 3600.0 * np.arange(len(rows) + 1.0)
    return OperatingRecord(time, torque, RPM * rpm, None, mixed, "")


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """340 N m at 1100 rpm."""
    folder = tmp_path_factory.mktemp("scene")
    (folder / "weighings.csv").write_text("cycles,loss\n5e7,140\n")
    (folder / "weighed.toml").write_text(STATIC)
    return wl.load(folder / "weighed.toml").cases[0].scene


def test_what_ran_last_is_compared_with_what_goes_on(scene):
    change = load_change(record((340, 1100), (408, 1100), (0, 0)), scene)
    assert change.last.torque == 408.0 and change.ahead.torque == 340.0
    assert change.last.rpm == pytest.approx(1100.0)
    harder = scene.replace("operation.torque", "408 N*m")
    assert load_change(record((340, 1100), (408, 1100)), harder) is None
    assert load_change(record((408, 1100), (341, 1101)), scene) is None
    assert load_change(record((340, 900)), scene).last.rpm == pytest.approx(900.0)


def test_without_order_or_work_nothing_is_said(scene):
    assert load_change(record((408, 1100), mixed=True), scene) is None
    assert load_change(record((0, 0)), scene) is None
    assert load_change(None, scene) is None


def test_a_load_that_goes_on_as_it_ended_is_no_change(tmp_path):
    """Twenty per cent more since January, and the file as it was: was silent."""
    (tmp_path / "record.csv").write_text(
        "hours,torque,speed\n0,340,1100\n500,408,1100\n1000,,\n"
    )
    (tmp_path / "weighings.csv").write_text("hours,loss\n300,140\n900,420\n")
    text = STATIC.replace('cycle = "cycles"', 'hours = "hours"')
    text = text.replace("[[update.data]]", f"{BY_HOURS}[[update.data]]", 1)
    changes = []
    for torque in (340, 408):
        file = tmp_path / f"at_{torque}.toml"
        file.write_text(f'{text}\n[operation]\ntorque = "{torque} N*m"\n')
        asked = studies(wl.load(file))[0]
        changes.append(load_change(asked.record, asked.scene))
    assert changes[0].last.torque == 408.0 and changes[1] is None


def test_the_note_of_a_gear_set_stands_at_the_top(scene):
    seen = (observed(CYCLES, RATE * CYCLES, ErrorModel(1e-4)),)
    prior = {"lognormal": {"median": 1.0, "cov": 14.0}}
    asked = replace(made_study(prior, seen, draws=200), scene=scene)
    harder = replace(asked, record=record((340, 1100), (408, 1100)))
    (note,) = outcome_of(harder, (history(seen),)).notes
    assert "ends with 408 N m at 1100 rpm, and days from then on count with" in note
    as_before = replace(asked, record=record((408, 1100), (340, 1100)))
    assert outcome_of(as_before, (history(seen),)).notes == ()


def test_the_note_of_a_fleet_names_its_units(scene):
    change = load_change(record((408, 1100)), scene)
    units = [{"name": f"G{n}", "load_change": change} for n in range(1, 6)]
    values = {"units": units, "nothing": False, "resolved": True}
    (line,) = layout.rendered("fleet_notes.txt", values)
    assert line.startswith("the record of G1, G2, G3 and 2 others ends with another")
    assert "G1 with 408 N m at 1100 rpm, and days from then on count with 340" in line
