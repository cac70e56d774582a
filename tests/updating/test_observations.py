"""Files of measurements: what is wrong is said in one message with row and column."""

import pytest

from wearlab.campaign import CampaignError
from wearlab.campaign.update import read_update
from wearlab.updating.calendar import Calendar
from wearlab.updating.measurements import UpdateError, read_observations
from wearlab.updating.unit_clock import calendar_of

UNKNOWN = {"wear.coefficient.factor": {"lognormal": {"median": 1.0, "cov": 1.0}}}
GOOD = "# weighed on Mondays\ncycles,loss\n100,1.5\n200,3.0\n"


def section(tmp_path, text=GOOD, **more):
    file = tmp_path / "weighings.csv"
    file.write_text(text)
    block = {
        "file": str(file),
        "quantity": "worn_mass",
        "member": "pinion",
        "columns": {"cycle": "cycles", "value": "loss"},
        "units": {"loss": "mg"},
        "error": {"sd": "1 mg"},
    } | more
    return {"unknown": UNKNOWN, "data": [block]}


def read(tmp_path, text=GOOD, **more):
    return read_observations(read_update(section(tmp_path, text, **more)).data[0])


def test_values_are_si_and_rows_are_those_of_the_file(tmp_path):
    seen = read(tmp_path)
    assert seen.value == pytest.approx([1.5e-6, 3e-6]) and seen.time.tolist() == [
        100.0,
        200.0,
    ]
    assert seen.row.tolist() == [3, 4] and seen.data.error.sd == pytest.approx(1e-6)


def test_hours_and_limits_of_detection(tmp_path):
    text = "h,loss,lod\n10,,0.5\n20,3.0,0.5\n"
    seen = read(
        tmp_path,
        text,
        columns={"hours": "h", "value": "loss", "below": "lod"},
        units={"loss": "mg", "lod": "mg"},
    )
    assert seen.time.tolist() == [36_000.0, 72_000.0] and seen.censored.tolist() == [
        True,
        False,
    ]
    assert seen.below[0] == pytest.approx(5e-7)


def test_semicolons_decimal_commas_and_empty_last_cells_are_read(tmp_path):
    """Was '2 columns instead of 1': the flanks of measuring machines were read so,
    weighings were not.
    """
    text = "Stunden;Verlust;Grenze\n10,5;0,5;\n20;;0,1\n"
    seen = read(
        tmp_path,
        text,
        columns={"hours": "Stunden", "value": "Verlust", "below": "Grenze"},
        units={"Verlust": "g", "Grenze": "g"},
    )
    assert seen.time.tolist() == [37_800.0, 72_000.0] and seen.value[
        0
    ] == pytest.approx(5e-4)
    assert seen.censored.tolist() == [False, True] and seen.below[1] == pytest.approx(
        1e-4
    )


@pytest.mark.parametrize(
    ("text", "more", "said"),
    [
        (
            "cycles,loss\n100,abc\n",
            {},
            "line 2, column 'loss': 'abc' is no number (decimal point)",
        ),
        ("cycles,loss\n100,inf\n", {}, "line 2, column 'loss': 'inf' is not finite"),
        (
            "cycles,loss\n100,1e308\n",
            {},
            "line 2, column 'loss': '1e308' is beyond anything that is measured",
        ),
        (
            "cycles,loss\n1e308,1\n",
            {},
            "line 2, column 'cycles': '1e308' is beyond anything that is measured",
        ),
        (
            f"cycles,loss\n1,2\n3,{'4' * 140_000}\n",
            {},
            "line 3: more than 100,000 characters",
        ),
        (
            "cycles,loss,loss\n1,2,3\n",
            {},
            "line 1: two columns are called 'loss'; rename one",
        ),
        ("cycles,loss\n,1\n", {}, "line 2, column 'cycles': is empty"),
        (
            "cycles,loss\n-5,1\n",
            {},
            "line 2, column 'cycles': -5 is before the first cycle",
        ),
        ("cycles,loss\n50,1\n100,1,2\n", {}, "line 3: 3 columns instead of 2"),
        (
            "cycles,mass\n100,1\n",
            {},
            "line 1: no column 'loss' for value; there are cycles, mass",
        ),
        ("", {}, "no rows under a header"),
        (
            "cycles,loss\n100,\n",
            {},
            "column 'loss': is empty, and no limit of detection",
        ),
        (
            GOOD,
            {"units": {"loss": "mm"}},
            "update.data[0].units.loss: 'mm' is not a unit like 'kg'",
        ),
        (GOOD, {"units": {}}, "column 'loss' needs its unit"),
        (
            GOOD,
            {"units": {"loss": "mg", "lost": "mg"}},
            "units.lost: the file has no such column",
        ),
        (GOOD, {"since": 150.0}, "line 3, column 'cycles': 100 is before since = 150"),
    ],
)
def test_wrong_files_are_refused_with_row_and_column(tmp_path, text, more, said):
    with pytest.raises(UpdateError) as caught:
        read(tmp_path, text, **more)
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(UpdateError, match="cannot be read"):
        read(tmp_path, file=str(tmp_path / "none.csv"))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"quantity": "worn_mas"}, "did you mean 'worn_mass'?"),
        ({"flank": "pinion"}, "give a member or a flank, not both"),
        ({"error": {}}, "update.data[0].error: required"),
        ({"error": {"sd": "1 mm"}}, "error.sd: 'mm' is not a unit like 'kg'"),
        ({"error": {"sd": "0 g"}}, "error.sd: '0 g' must be greater than 0"),
        (
            {"error": {"sd": {"normal": {"mean": "1 g", "sd": "1 g"}}}},
            "error.sd: is negative at times",
        ),
        (
            {"error": {"sd": "1 g", "sdd": 1}},
            "error.sdd: unknown key, did you mean 'sd'?",
        ),
        (
            {"columns": {"cycle": "a", "hours": "b"}},
            "columns: cycle and hours both say when",
        ),
        (
            {"quantity": "wear_depth", "error": {"sd": "1 um"}},
            "wear_depth needs one of the columns diameter",
        ),
        ({"since": "last"}, "since: 'last' is not 'previous', or a cycle"),
    ],
)
def test_wrong_blocks_are_refused(tmp_path, change, said):
    with pytest.raises(CampaignError) as caught:
        read_update(section(tmp_path, **change))
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"unknown": {}}, "update.unknown: required"),
        ({"unknown": {"a.b": 3}}, "update.unknown.a.b: 3 is no distribution"),
        ({"limit": {}}, "update.limit: give either depth or worn_mass"),
        (
            {"limit": {"depth": "1 um", "member": "sun"}},
            "limit: member belongs to worn_mass",
        ),
        ({"discrepancy": "accumulating"}, "'accumulating' needs error.drift"),
        ({"discrepancy": "some"}, "update.discrepancy"),
        ({"draws": 0}, "update.draws: 0 must be at least 1"),
    ],
)
def test_wrong_sections_are_refused(tmp_path, change, said):
    with pytest.raises(CampaignError) as caught:
        read_update(section(tmp_path) | change)
    assert said in str(caught.value)


def test_a_million_rows_are_read_in_seconds(tmp_path):
    """Took minutes: a parser for every line, and a call for every cell."""
    import time

    text = "cycles,loss\n" + "".join(f"{n},{n * 1e-3:.4f}\n" for n in range(1, 300_001))
    clock = time.process_time()
    seen = read(tmp_path, text)
    assert len(seen) == 300_000 and seen.value[-1] == pytest.approx(300e-6)
    assert time.process_time() - clock < 6.0


DATED = "Datum;Verlust [mg]\n30.06.2026;140,5\n30.12.2026;265\n"
CALENDAR = {"date": "2026-01-01", "hours": 1000, "hours_per_year": 3652.425}


def dated(tmp_path, text=DATED, calendar=CALENDAR, **more):
    block = section(
        tmp_path,
        text,
        columns={"date": "Datum", "value": "Verlust [mg]"},
        units={},
        **more,
    ) | {"calendar": calendar}
    spec = read_update(block)
    return read_observations(spec.data[0], spec.calendar and Calendar.of(spec.calendar))


def test_dates_become_operating_hours_and_units_stand_in_the_header(tmp_path):
    """Ten hours a day from 1,000 hours on 1 January: 30 June is 180 days later."""
    seen = dated(tmp_path)
    assert seen.clock == "hours" and seen.time / 3600.0 == pytest.approx(
        [2800.0, 4630.0]
    )
    assert seen.value == pytest.approx([140.5e-6, 265e-6])


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (
            {"calendar": {"date": "2026-01-01", "hours_per_year": 3000}},
            "dates need update.calendar",
        ),
        (
            {"text": "Datum,Verlust [mg]\n03/04/2026,1\n"},
            'date_format = "%d/%m/%Y" or "%m/%d/%Y"',
        ),
        (
            {"text": "Datum,Verlust [mg]\n2025-01-01,1\n"},
            "line 2, column 'Datum': 2025-01-01 is before the first",
        ),
    ],
)
def test_dates_of_two_meanings_are_refused(tmp_path, more, said):
    with pytest.raises(UpdateError) as caught:
        dated(tmp_path, **more)
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_the_format_of_dates_can_be_said(tmp_path):
    seen = dated(tmp_path, "Datum,Verlust [mg]\n03/04/2026,1\n", date_format="%m/%d/%Y")
    assert seen.time[0] / 3600.0 == pytest.approx(1000.0 + 62 * 10.0)


@pytest.mark.parametrize(
    "text",
    [
        "date,hours,loss_mg\n2026-03-01,10,1.5\n2026-03-02,20,3\n",
        "Datum;Betriebsstunden;Masseverlust [mg]\n01.03.2026;10;1,5\n02.03.2026;20;3\n",
        "operating hours,mass loss (mg)\n10,1.5\n20,3\n",
    ],
)
def test_usual_names_of_columns_need_no_mapping(tmp_path, text):
    """Was "no column 'cycle' for time", then the same of the value."""
    seen = read(tmp_path, text, columns={}, units={})
    assert seen.time.tolist() == [36_000.0, 72_000.0] and seen.value == pytest.approx(
        [1.5e-6, 3e-6]
    )
    days = calendar_of(
        read_update(section(tmp_path, text, columns={}, units={})).data[0], None, None
    )
    assert (days is not None) == ("2026" in text)
