"""Files of measuring machines: every tooth, both sides, by codes."""

import json
import random
import re
import time

import measured_gear as gear
import numpy as np
import pytest
from scenes import external_pair

from wearlab.cli.app import status_of
from wearlab.scene import Scene
from wearlab.simulation.label import Refused
from wearlab.tables import TableError
from wearlab.tables.measured_flank import read_measured_flank
from wearlab.tables.p40 import PITCH_HEAD, read_measurement

SCENE = {
    "gears": external_pair(24, 36, face_width="30 mm"),
    "operation": {"torque": "150 N*m", "speed": "900 rpm"},
    "mesh": {},
}


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "gear.mka"
    path.write_text(gear.mka(), encoding="utf-8-sig")
    return path


def test_the_mean_profile_stands_evenly_in_the_length_of_roll(file):
    measurement = read_measurement(file)
    places, deviation = measurement.curve("profile", "right", "mean")
    expected = np.array(gear.roll_lengths()[1:-1])
    assert 1e3 * places == pytest.approx(expected, abs=1e-9)
    printed = [gear.deviation(roll) for roll in expected]
    assert 1e6 * deviation == pytest.approx(printed, abs=1e-3)
    assert deviation.min() < -1e-6  # material is missing at the tip

    # evenly in diameter would be far off in the middle
    middle = len(places) // 2
    diameter = 2e3 * np.hypot(places[middle], measurement.base_radius)
    assert abs(diameter - 0.5 * (gear.BEGIN + gear.END)) > 0.2


def test_one_tooth_differs_from_the_mean_by_its_offset(file):
    measurement = read_measurement(file)
    for side, offset in (("right", 1.5), ("left", 1.5)):
        _, mean = measurement.curve("profile", side, "mean")
        _, tooth = measurement.curve("profile", side, 1)
        inner = slice(0, len(mean)) if len(tooth) == len(mean) else slice(1, -1)
        assert 1e6 * (tooth[inner] - mean) == pytest.approx(offset, abs=2e-3)


def test_leads_stand_about_mid_face_with_the_printed_sign(file):
    places, deviation = read_measurement(file).curve("lead", "left", "mean")
    assert 1e3 * places[[0, -1]] == pytest.approx([-13.0, 13.0])
    assert 1e6 * deviation == pytest.approx(
        [gear.lead(1e3 * z) for z in places], abs=2e-3
    )


def test_the_pitch_table_is_of_every_tooth(file):
    pitch = read_measurement(file).pitch["left"]
    assert len(pitch.single) == gear.TEETH
    assert np.cumsum(pitch.single) == pytest.approx(pitch.cumulative, abs=2e-8)
    assert 1e6 * np.ptp(pitch.cumulative) == pytest.approx(12.0, abs=0.11)


def test_a_pitch_table_without_rows_is_refused(file):
    """What stood below its head was cut off: `wearlab profile` ended in a traceback."""
    lines = gear.mka().splitlines()
    head = next(i for i, line in enumerate(lines) if PITCH_HEAD.search(line))
    rows = next(i for i in range(head + 1, len(lines)) if lines[i].split())
    end = next(i for i in range(rows, len(lines)) if not lines[i].split())
    file.write_text("\n".join([*lines[:rows], "", *lines[end:], ""]))
    with pytest.raises(TableError, match="the pitch table"):
        read_measurement(file)


def test_a_pitch_table_may_have_many_columns(file):
    """Rows of six numbers and more below the curves were refused as a curve's."""
    text = re.sub(r"(?m)^( \d+ \S+ \S+ 0\.0)$", r"\1 1.0 2.0 3.0 4.0", gear.mka())
    assert text.count("1.0 2.0 3.0 4.0") == 2 * gear.TEETH
    expected = read_measurement(file).pitch["left"].single
    wider = file.with_name("wider.mka")
    wider.write_text(text, encoding="utf-8-sig")
    assert read_measurement(wider).pitch["left"].single == pytest.approx(expected)


def test_a_number_cut_at_the_end_is_refused_and_the_remedy_helps(file):
    """``0.000`` read silently where ``0.0003`` had been written."""
    text = gear.mka()
    for cut in (1, 2, 3):
        file.write_text(text[:-cut])
        with pytest.raises(TableError, match="half a number"):
            read_measurement(file)
    file.write_text(text[:-1] + "\n")
    assert len(read_measurement(file).pitch["right"].single) == gear.TEETH


@pytest.mark.parametrize("line", ["left/1" * 20_000, "fp " * 40_000])
def test_a_long_line_is_no_head_of_a_curve(file, line):
    """Its reading took time with the square of its length."""
    file.write_text(gear.mka() + line + "\n")
    begin = time.process_time()
    assert len(read_measurement(file).traces) == 13
    assert time.process_time() - begin < 1.0


def test_traces_beside_a_tooth_are_not_its_curve(file):
    measurement = read_measurement(file)
    assert measurement.teeth("profile", "right") == (1, 9, 17)
    assert sum(not trace.is_main for trace in measurement.traces) == 1


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("LVORZ: 1", "LVORZ: 0", "code 178 says LVORZ 0"),
        (" 178 :Vorzeichen: LVORZ: 1: DIN\n", "", "code 178 says nothing"),
        ("  41 :da", "  40 :da", "code 41 is missing"),
        ("/ 33  Values", "/ 34  Values", "34 values are announced and 33 follow"),
        ("/ 33  Values", "/ 99999999  Values", "points of one curve"),
        ("HEADER KS.MK", "HEADER XX.MK", "gear.mka"),
        ("UNDEFINED -2147483.648", "UNDEFINED none", "-2.14748e.06 um is no deviation"),
        ("  23 :", "  24 :", "code 24 stands twice, with .0 and 20.0"),
        (": 69.0 69.0", ": 69.0 abc", "code 41 says 69.0 abc"),
        ("1 right / 33  Values", "1 rihgt / 33  Values", "cannot be read as the head"),
        ("Tooth-No.: 1 right / 33  Values / z= 15.0\n", "", "belong to no curve"),
        ("Tooth-No.: 9 right / 33", "Tooth-No.: 1 right / 33", "more than one profile"),
        ("Tooth-No.: 9 right / 33", "Tooth-No.: 99 right / 33", "a curve of tooth 99"),
        ("\nProfil:", "\nProfile of 2:", "stands under no title"),
        ("\nFlankenlinie:", "\nOf a line:", "title of a profile says x ="),
        ("\n 20 ", "\n 21 ", "are not 1, 2, 3"),
    ],
)
def test_what_is_not_understood_is_refused(file, old, new, message):
    file.write_text(gear.mka().replace(old, new, 1))
    with pytest.raises(TableError, match=message):
        read_measured_flank({"file": str(file), "side": "right"})


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "say which side"),
        ({"side": "right", "teeth": 4}, "teeth with one: 1, 9, 17"),
        ({"side": "right", "x": "diameter"}, "over roll_length"),
        ({"side": "right", "y": "depth"}, "holds deviations"),
        (
            {"side": "right", "units": {"deviation": "um"}},
            "leave out columns, units, sheet and decimal",
        ),
    ],
)
def test_what_does_not_fit_the_file_is_refused(file, options, message):
    with pytest.raises(TableError, match=message):
        read_measured_flank({"file": str(file), **options})


def test_a_side_belongs_to_a_machine_file(tmp_path):
    path = tmp_path / "flank.csv"
    path.write_text("diameter [mm],deviation [um]\n70,0\n76,-3\n")
    with pytest.raises(TableError, match="side belong to a measuring machine's file"):
        read_measured_flank({"file": str(path), "side": "right"})


def test_gde_is_named(tmp_path):
    path = tmp_path / "gear.xml"
    path.write_text('<?xml version="1.0"?><gear_data_exchange xmlns="GDE"/>')
    with pytest.raises(TableError, match="GDE file"):
        read_measured_flank({"file": str(path), "side": "right"})


def test_a_flank_begins_as_it_was_measured(file):
    measured = {"file": str(file), "side": "right"}
    initial = {"initial": {"pinion": measured}}
    with pytest.raises(Refused, match="continuation"):
        _depth(Scene.from_mapping({**SCENE, "wear": initial}))

    measured["continuation"] = "hold"
    scene = Scene.from_mapping({**SCENE, "wear": initial})
    depth = _depth(scene)
    assert depth.max() > 5e-6  # the relief at the tip counts as worn
    measured_too = {**measured, "teeth": "mean"}
    same = Scene.from_mapping({**SCENE, "wear": {"initial": {"pinion": measured_too}}})
    assert same.id == scene.id

    left = {**measured, "side": "left"}
    unworn = _depth(
        Scene.from_mapping({**SCENE, "wear": {"initial": {"pinion": left}}})
    )
    assert abs(unworn).max() < 1e-9


def _depth(scene):
    import wearlab as wl

    run = wl.simulate(scene)
    pinion = run.sel(flank="pinion").isel(update=0)
    return pinion.wear_depth.to_numpy()


def test_profile_lists_and_draws_a_machine_file(file, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert status_of(["profile", "gear.mka", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["profile, right"].startswith("teeth 1, 9, 17; 31 points, diameter")
    assert facts["pitch, left"] == "24 teeth, F_p 12.000 um"
    assert (tmp_path / "gear.png").read_bytes().startswith(b"\x89PNG")

    assert status_of(["profile", "gear.mka", "--units", "deviation=um"]) == 2
    assert "leave out" in capsys.readouterr().err


def test_values_keep_their_side(tmp_path, capsys):
    """What was not measured on the left is not taken from the right."""
    head = gear.mka().replace("KS.MK.FILE", "KS.MW.FILE").split("Profil:")[0]
    rows = (
        " 26711 :Fa............. :  3.2 :  4.1\n"
        " 26712 :ffa............ : -9999 : 2.0\n"
        " 26713 :fHa............ : 8999 : 1.0\n"
    )
    path = tmp_path / "gear.mew"
    path.write_text(f"{head}\n{rows}", encoding="utf-8-sig")
    assert status_of(["profile", str(path)]) == 0
    shown = capsys.readouterr().out
    assert "26711 Fa 3.2, 4.1" in " ".join(shown.split())
    assert "not measured, 2" in shown
    assert "not available, 1" in shown
    measurement = read_measurement(path)
    assert measurement.number(26712, "right") == 2.0
    with pytest.raises(TableError, match="code 26712, left side: not measured"):
        measurement.number(26712, "left")
    with pytest.raises(TableError, match=r"no curves: export the curves .* \(\.mka\)"):
        measurement.curve("profile", "left", "mean")


def test_a_side_that_was_not_measured_has_no_panel(file, tmp_path, monkeypatch):
    """Leads of the left side alone ended in a traceback."""
    heads = re.compile(r"\nTooth-No\.: \d+ right / 21 [^\n]*\n[^T]*(?=\n)")
    file.write_text(heads.sub("", gear.mka()))
    measurement = read_measurement(file)
    assert measurement.teeth("lead", "left") and not measurement.teeth("lead", "right")
    monkeypatch.chdir(tmp_path)
    assert status_of(["profile", "gear.mka"]) == 0
    assert (tmp_path / "gear.png").read_bytes().startswith(b"\x89PNG")


def test_damaged_files_are_read_or_refused(file):
    """Three hundred damaged files: each is read, or costs one line."""
    chance = random.Random(56)
    original = gear.mka().encode()
    refused = 0
    for _ in range(300):
        letters = bytearray(original)
        for _ in range(chance.randrange(1, 6)):
            place = chance.randrange(len(letters))
            if chance.random() < 0.5:
                letters[place] = chance.randrange(256)
            else:
                del letters[place : place + chance.randrange(1, 80)]
        file.write_bytes(letters)
        try:
            read_measured_flank({"file": str(file), "side": "right"})
        except TableError as error:
            refused += 1
            assert "\n" not in str(error)
    assert 0 < refused < 300


@pytest.mark.parametrize("options", [{"sheet": "Messung"}, {"decimal": ","}])
def test_options_of_tables_are_refused_beside_a_machines_file(tmp_path, options):
    """Was: ignored without a word."""
    path = tmp_path / "gear.mka"
    path.write_text("HEADER KS.MK.FILE\n 178 :sign : LVORZ 1\n", encoding="utf-8")
    with pytest.raises(TableError, match="leave out columns, units, sheet and decimal"):
        read_measured_flank({"file": str(path), "side": "left", **options})
