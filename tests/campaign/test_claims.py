"""Claims of a campaign, and numbers in its notes: read off stored
runs, failing by name.
"""

import json

import numpy as np
import pytest
import xarray as xr
from made_up import put, run

from wearlab.campaign import CampaignError, load
from wearlab.campaign.claims import filled, spelled_note
from wearlab.cli.app import status_of
from wearlab.figures.plotting import plotted
from wearlab.figures.question import question
from wearlab.query import QueryError
from wearlab.query.formula import AmountError, amount, parse_formula
from wearlab.store import Store
from wearlab.store.netcdf import to_image

FILE = r'''
title   = "Three speeds"
extends = "{base}"
drop    = ["wear"]

[[sweep]]
"operation.speed" = ["800 rpm", "1100 rpm", "3720 rpm"]

[[claim]]
name      = "worn"
quantity  = "max(max_wear_depth, flank)"
select    = {{ speed = 1100, update = -1 }}
value     = "5.5 um"
tolerance = "1 %"
source    = "made up"

[[claim]]
name      = "deepest_at"
quantity  = "largest_at(max_wear_depth[flank=gear, update=-1], speed)"
value     = "3720 rpm"
tolerance = "0 rpm"

[[claim]]
name      = "growth"
quantity  = "max_wear_depth[update=-1] / max_wear_depth[update=1] - 1"
select    = {{ flank = "pinion", speed = "800 rpm" }}
value     = "300 %"
tolerance = "1 %"

[[figure]]
kind = "max-wear"
note = """{{worn:.2f}} µm, by {{growth:+.0f}} %, \
  {{mesh_frequency[speed=800]:.1f Hz}} Hz, \
  {{max(wear_depth / 0):.1f um}}."""
'''


@pytest.fixture
def file(tmp_path, request):
    base = request.config.rootpath / "campaigns" / "base" / "spur_50_50.toml"
    path = tmp_path / "speeds.toml"
    path.write_text(FILE.format(base=base), encoding="utf-8")
    return path


@pytest.fixture
def store(file, tmp_path):
    made = Store(tmp_path / "store")
    made.archive.create()
    for case, speed in zip(load(file).cases, (800.0, 1100.0, 3720.0), strict=True):
        put(made, case.id, run(speed))
    return made


@pytest.fixture
def grid():
    speed = xr.Variable(
        "speed", [800.0, 1100.0], {"units": "rpm", "key": "operation.speed"}
    )
    depth = (
        np.array(
            [
                [[1.0, 3.0, np.nan], [4.0, 2.0, np.nan]],
                [[0.0, 6.0, 7.0], [8.0, 5.0, 9.0]],
            ]
        )
        * 1e-6
    )
    return xr.Dataset(
        {
            "depth": (("speed", "case", "update"), depth, {"units": "m"}),
            "force": (("speed",), [2.0, 4.0], {"units": "N"}),
            "n_updates": (("speed", "case"), [[2, 2], [3, 3]]),
        },
        {
            "speed": speed,
            "case": ["base", "static"],
            "cycle": ("update", [0.0, 1e6, 2e6]),
        },
    )


@pytest.mark.parametrize(
    "text, unit, number",
    [
        ("max(depth)", "um", 7.0),
        ("depth[speed='1100 rpm', case=static, update=-1]", "um", 9.0),
        ("depth[speed=800, update=-1]", "um", 3.0),  # the last state of its own run
        ("depth[speed=1100, cycle=1.2e6]", "um", 6.0),
        ("(depth[update=1] - depth[update=0])[speed=800]", "um", 2.0),
        ("depth[speed=800, update=1] / depth[speed=800, update=0] - 1", "%", 200.0),
        ("largest_at(depth[update=1], speed)", "rpm", 1100.0),
        ("smallest_at(depth[case=static, update=0], speed)", "rpm", 800.0),
        ("mean(force) * 2 - 1 * mean(force)", "N", 3.0),
        ("-range(force) + 3e0 * mean(abs(-force))", "N", 7.0),
        ("sum(force)", "N", 6.0),
        ("sum(depth[speed=800, case=static], update)", "um", 6.0),
        ("min(where(depth[update=0], mean(force) - force))", "um", 1.0),
        ("max(where(depth[speed=800], 1 - cycle / 1e6))", "um", 1.0),
        ("sum(where(force, force - min(force)))", "N", 4.0),  # above, not at, zero
    ],
)
def test_a_formula_has_its_number(grid, text, unit, number):
    assert amount(text, grid, unit) == pytest.approx(number, rel=1e-12)


@pytest.mark.parametrize(
    "text, unit, message",
    [
        ("depht", "um", "did you mean 'depth'"),
        ("depth[update=0]", "um", r"2 numbers, not one: choose along speed \(2\)"),
        ("depth[speed=900, update=0]", "um", "is not there"),
        ("depth[speed=800, update=-4]", "um", "counts from 0 to 2"),
        ("max(depth)", "N", "not a unit like"),
        ("mean(force) * max(depth)", "N", "one side has to be a plain number"),
        ("max(depth, flank)", "um", r"max\(…, flank\)"),
        ("depth[speed=800, update=2]", "um", "no stored run has it"),
        ("sum(depth[speed=800, update=2])", "um", "no stored run has it"),
        ("max(where(force, force - max(force)))", "N", "no stored run has it"),
    ],
)
def test_a_formula_without_a_number_says_why(grid, text, unit, message):
    with pytest.raises(AmountError, match=message):
        amount(text, grid, unit)


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('x')",
        "depth.values",
        "max(depth",
        "depth[speed]",
        "1 +",
        "(" * 200 + "1",
        "- " * 400 + "1",
        "exp(depth)",
        "largest_at(depth)",
        "where(depth)",
        "where(depth, force, speed)",
        "depth; force",
        "depth[speed=(1)]",
        "9" * 2000,
    ],
)
def test_nothing_but_the_grammar_is_read(text):
    with pytest.raises(QueryError):
        parse_formula(text)


def test_braces_that_are_no_placeholders_stay():
    text = r"Depth in $10^{-3}$ and $\mathrm{mm}$, a set {1, 2}"
    assert filled(spelled_note(text, ()), xr.Dataset()) == text


def test_notes_are_filled_from_the_runs(file, store):
    campaign = load(file)
    grid = store.open(campaign)
    asked = question(campaign, campaign.figures[0], 1)
    plot, _, _ = plotted(grid, asked.request)
    note = "5.50 µm, by +300 %, 666.7 Hz, —."
    assert any(note in " ".join(one.split()) for one in plot.notes)
    assert "claim" not in asked.table["note"] and "worn" not in asked.table["note"]


def test_three_numbers_changed_in_a_stored_run_make_three_claims_fail(
    file, store, capsys
):
    """A note that is no longer true is told by its name."""
    command = ["check", str(file), "--claims", "--store", str(store.path)]
    assert status_of(command) == 1  # the dash in the note
    assert "3 of 3 claims hold" in capsys.readouterr().out
    text = file.read_text().replace("{max(wear_depth / 0):.1f um}", "")
    file.write_text(text)
    assert status_of(command) == 0
    ids = [case.id for case in load(file).cases]
    for run_id, place in (
        (ids[0], (1, 0)),
        (ids[1], (2, 1)),
        (ids[1], (1, 1)),
        (ids[2], (2, 1)),
    ):
        path = store.archive.files.path(run_id)
        data = xr.load_dataset(path)
        data["max_wear_depth"][place] = 2e-7
        path.unlink()
        path.write_bytes(to_image(data)[0])
    assert status_of(command) == 2  # the store says that this is not what was written
    assert status_of(["reindex", "--store", str(store.path)]) == 0
    capsys.readouterr()
    assert status_of(command) == 1
    told = capsys.readouterr()
    assert "0 of 3 claims hold" in told.out
    assert all(
        f"fails  {name}: " in told.err for name in ("worn", "deepest_at", "growth")
    )


@pytest.fixture
def kept(file, store, tmp_path, capsys):
    """What the runs say, as the command writes it: three claims hold,
    the note has every number.
    """
    file.write_text(file.read_text().replace("{max(wear_depth / 0):.1f um}", ""))
    assert (
        status_of(
            ["check", str(file), "--claims", "--json", "--store", str(store.path)]
        )
        == 0
    )
    record = tmp_path / "measured.json"
    record.write_text(capsys.readouterr().out)
    return record


def held(file, record, capsys):
    """Return status and words of holding claims against a record, without any store."""
    capsys.readouterr()
    status = status_of(["check", str(file), "--claims", "--measured", str(record)])
    told = capsys.readouterr()
    return status, told.out + told.err


def test_claims_hold_against_what_was_measured(file, kept, capsys):
    status, told = held(file, kept, capsys)
    assert status == 0 and "3 of 3 claims hold" in told
    assert (
        status_of(["check", str(file), "--claims", "--measured", str(kept), "--json"])
        == 0
    )
    again = json.loads(capsys.readouterr().out)
    record = json.loads(kept.read_text())
    assert again == record and len(record["runs"]) == 3


def test_three_numbers_changed_in_what_was_measured_make_three_claims_fail(
    file, kept, capsys
):
    record = json.loads(kept.read_text())
    for one, number in zip(record["claims"], (5.4, 800.0, 301.5), strict=True):
        one["measured"] = number
    kept.write_text(json.dumps(record))
    status, told = held(file, kept, capsys)
    assert status == 1 and "0 of 3 claims hold" in told
    assert all(f"fails  {name}: " in told for name in ("worn", "deepest_at", "growth"))


@pytest.mark.parametrize(
    "old, new, message",
    [
        (
            '"3720 rpm"]',
            '"3730 rpm"]',
            "1 of 3 runs were not measured, or with another scene or model "
            "version, the first base, speed=3730 rpm; measure anew",
        ),
        (
            ', "3720 rpm"]',
            "]",
            "1 runs that were measured are no longer of the campaign; measure anew",
        ),
        (
            "max(max_wear_depth, flank)",
            "min(max_wear_depth, flank)",
            "fails  worn: not measured, or by another formula",
        ),
        (
            "{worn:.2f} µm",
            "{worn:.3f} µm",
            "figure 1 (max-wear): note: {((max(max_wear_depth, flank))",
        ),
    ],
    ids=["another scene", "a run less", "another formula", "another number of a note"],
)
def test_what_was_measured_of_something_else_does_not_count(
    file, kept, capsys, old, new, message
):
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new))
    status, told = held(file, kept, capsys)
    assert status == 1 and message in told and "measure anew" in told


def test_another_model_version_makes_all_claims_fail(file, kept, capsys, monkeypatch):
    monkeypatch.setattr("wearlab.scene.identity.MODEL_VERSION", 5)
    status, told = held(file, kept, capsys)
    assert (
        status == 1
        and "0 of 3 claims hold" in told
        and "3 of 3 runs were not measured" in told
    )


@pytest.mark.parametrize(
    "text, message",
    [
        ("{", "Invalid JSON"),
        ('{"runs": [], "numbers": {}}', "claims: Field required"),
        (
            '{"runs": [], "numbers": {}, "claims": [{"name": "a", "formula": "", '
            '"unit": "", "measured": "x"}]}',
            "claims: 0: measured: Input should be a valid number",
        ),
        (None, "No such file"),
    ],
)
def test_what_is_no_record_is_refused(file, tmp_path, capsys, text, message):
    record = tmp_path / "measured.json"
    if text is not None:
        record.write_text(text)
    status, told = held(file, record, capsys)
    assert status == 2 and message in told and str(record) in told
    assert (
        status_of(["check", str(file), "--measured", str(record)]) == 2
    )  # without --claims


@pytest.mark.parametrize(
    "old, new, message",
    [
        ('"deepest_at"', '"worn"', r"claim\[1\].name: 'worn' stands twice"),
        (
            '"0 rpm"',
            '"0 um"',
            r"claim\[1\].tolerance: '0 um' is not in rpm, the unit of the value",
        ),
        ("{worn:.2f}", "{worm:.2f}", r"figure 1 \(.*\): note: 'worm' is no variable"),
        (
            "{worn:.2f}",
            "{wor}",
            r"figure\[0\].note: \{wor\}: no claim is called so, did you mean 'worn'",
        ),
        ("{worn:.2f}", "{worn:two}", r"'two' is no format such as"),
        ("{worn:.2f}", "{exp(worn):.2f}", r"no function 'exp'"),
        (
            "max(max_wear_depth, flank)",
            "max(max_wear_dept, flank)",
            "did you mean 'max_wear_depth'",
        ),
        (
            "max(max_wear_depth, flank)",
            "max(max_wear_depth",
            r"quantity: no formula: '\(' was never closed",
        ),
        (
            "tolerance = ",
            "tolerence = ",
            r"claim\[0\].tolerence: unknown key, did you mean 'tolerance'",
        ),
    ],
)
def test_what_is_wrong_with_claims_is_refused(file, old, new, message, capsys):
    file.write_text(file.read_text().replace(old, new, 1))
    assert status_of(["check", str(file)]) == 2
    with pytest.raises(AssertionError, match=message):
        raise AssertionError(capsys.readouterr().err)
    if "is no variable" not in message and "did you mean 'max_wear" not in message:
        with pytest.raises(CampaignError):
            load(file)


def test_the_sign_of_a_claim_keeps_its_unit(file):
    claim = next(one for one in load(file).claims if one.unit)
    told = spelled_note(f"falls by {{-{claim.name}:.1f}}", [claim])
    assert told.endswith(f":.1f {claim.unit}}}")
