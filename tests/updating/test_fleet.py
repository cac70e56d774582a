"""Units of one design in one table: a day and an interval each, and
what contradicts what.
"""

import json
from dataclasses import replace
from datetime import date

import numpy as np
import pytest
from conftest import STATIC

import wearlab as wl
from wearlab.campaign import CampaignError
from wearlab.campaign.campaign import FigureSpec
from wearlab.cli.app import status_of
from wearlab.figures import FigureError
from wearlab.figures.drawing import draw
from wearlab.report.page import report
from wearlab.store.updates import kept_updates, verify_updates
from wearlab.updating import UpdateError, population, update
from wearlab.updating.calendar import day_text
from wearlab.updating.cases import studies
from wearlab.updating.report_text import alerts, answers, fleet_tables, text_of
from wearlab.updating.unit_clock import calendar_of

TODAY = date(2026, 1, 1)
HEAD, _, BLOCK = STATIC.partition("[[update.data]]")
FLEET = f"""{HEAD}
[[update.data]]
file     = "fleet.csv"
quantity = "worn_mass"
member   = "pinion"
columns  = {{ unit = "box", date = "date", hours = "hours", value = "loss" }}
units    = {{ hours = "h", loss = "mg" }}
error    = {{ sd = "5 mg" }}
[[update.unit]]
name     = "new"
calendar = {{ date = "2026-01-01", hours = 0, hours_per_year = 6000 }}
"""
ROWS = """box,date,hours,loss
A,2025-01-01,280,140
A,2026-01-01,840,390
B,2025-01-01,280,180
B,2025-07-02,560,345
B,2026-01-01,840,500
C,2025-01-01,280,110
C,2026-01-01,840,300
D,2025-01-01,280,150
D,2026-01-01,840,420
"""


def fleet(folder, rows=ROWS, text=FLEET):
    (folder / "fleet.csv").write_text(rows)
    (folder / "fleet.toml").write_text(text)
    return wl.load(folder / "fleet.toml")


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return wl.Store(tmp_path_factory.mktemp("store"))


@pytest.fixture(scope="module")
def kept(tmp_path_factory, store):
    campaign = fleet(tmp_path_factory.mktemp("fleet"))
    return campaign, update(campaign, store, replay=True, today=TODAY, progress=False)


def test_every_unit_gets_a_day_and_an_interval(kept, store):
    campaign, tree = kept
    predictions = tree["predictions"].to_dataset()
    assert predictions["unit"].values.tolist() == ["A", "B", "C", "D", "new"]
    days = predictions["end_of_life_quantile"].values.astype("datetime64[D]")
    assert (np.diff(days.astype(int), axis=1) >= 0).all() and (
        days[:, 4] > days[:, 0]
    ).all()
    pace = dict(zip("ABCD", predictions["pace"].values, strict=False))
    assert pace["B"] > pace["D"] > pace["C"]
    wide = np.ptp(np.log(predictions["factor_quantile"].values[:, [0, 4]]), axis=1)
    assert wide[4] > 1.5 * wide[:4].max()  # not yet measured
    text = "\n".join(text_of(tree))
    assert "open B first" in text and "!" not in text and "not measured" in text
    assert "inspections foreseen from those before" in text
    assert len(answers(tree)) == 7
    assert any(
        line.startswith("A: the limit is reached on 20") for line in answers(tree)
    )
    assert (
        update(campaign, store, replay=True, today=TODAY, progress=False).attrs["id"]
        == tree.attrs["id"]
    )
    assert set(kept_updates(store)[tree.attrs["id"]].summary) == set(
        predictions["unit"].values
    )
    assert list(verify_updates(store)) == []


def test_a_value_that_contradicts_the_others_is_told_and_left_out_beside(
    tmp_path, store, kept
):
    rows = ROWS.replace("B,2026-01-01,840,500", "B,2026-01-01,840,1500")
    costs = "planned = 1, failure = 9"
    priced = FLEET.replace("[update]", f"[update]\ndecision = {{ {costs} }}", 1)
    tree = update(fleet(tmp_path, rows, priced), store)
    text = "\n".join(text_of(tree))
    change = {
        row[0]: row[-1] for row in fleet_tables(tree)[0][2]
    }  # that of the others goes on to be advised
    assert change["B"] == "now" and all(
        change[name].startswith("20") for name in ("A", "C", "D", "new")
    )
    assert "! B at 840 h: much more wear than" in text and "leaving out" in text
    clean = kept[1]["predictions"]["life_quantile"].sel(unit="A").values
    spoilt = tree["predictions"]["life_quantile"].sel(unit="A").values
    without = tree["predictions_without"]["life_quantile"].sel(unit="A").values
    assert np.ptp(np.log(without[[0, 4]])) < np.ptp(np.log(spoilt[[0, 4]]))
    assert without[2] == pytest.approx(clean[2], rel=0.15)


def test_an_extra_table_that_is_refused_does_not_refuse_the_update(
    tmp_path, monkeypatch
):
    """Without a flagged row, or with other errors, units may contradict each other."""
    fit = population.fit_population
    calls = []

    def first_alone(*arguments):
        calls.append(arguments)
        if len(calls) > 1:
            raise UpdateError("update.population: the units contradict each other")
        return fit(*arguments)

    monkeypatch.setattr(population, "fit_population", first_alone)
    rows = ROWS.replace("B,2026-01-01,840,500", "B,2026-01-01,840,1500")
    tree = update(fleet(tmp_path, rows), wl.Store(tmp_path / "store"), progress=False)
    assert len(calls) == 3
    assert not {"predictions_without", "predictions_robust"} & {*tree.children}
    text = "\n".join(text_of(tree))
    assert "! B at 840 h: much more wear than" in text and "leaving out" not in text


def test_a_clean_fleet_is_rarely_flagged(kept):
    assert not kept[1]["observed_data"]["flagged"].values.any()


def test_hours_of_a_year_come_from_the_columns(tmp_path):
    first = studies(fleet(tmp_path))[0]
    days = calendar_of(first.observations[0].data, "A", None)
    assert day_text(days.day[-1]) == "2026-01-01" and days.time[-1] == 840.0
    assert (
        days.a_year == pytest.approx(560.0 * 365.2425 / 365.0)
        and first.calendar.a_year == days.a_year
    )


def test_a_table_with_dates_alone_goes_by_the_calendar_of_one_with_hours(tmp_path):
    """Was refused, with the hours of these days in the other table."""
    dates = (
        'quantity = "worn_mass"\nmember = "gear"\nfile = "dates.csv"\nerror = { sd = '
        '"5 mg" }\n'
    )
    dates += 'columns = { date = "date", value = "loss" }\nunits = { loss = "mg" }\n'
    hours = FLEET.partition("[[update.unit]]")[0].replace('unit = "box", ', "")
    (tmp_path / "dates.csv").write_text("date,loss\n2025-07-02,100\n2026-01-01,200\n")
    made = fleet(
        tmp_path, ROWS.partition("B,")[0], hours + "\n[[update.data]]\n" + dates
    )
    (study,) = studies(made)
    half = (
        840.0 - 560.0 * 183.0 / 365.0
    )  # 183 days before the last inspection, at the pace between the two
    assert study.observations[1].time / 3600.0 == pytest.approx([half, 840.0])


def test_a_scene_of_its_own_is_a_run_of_its_own(tmp_path):
    own = (
        FLEET
        + '[[update.unit]]\nname = "C"\nscene = { "operation.torque" = "300 N*m" }\n'
    )
    made = {study.label: study.scene.id for study in studies(fleet(tmp_path, text=own))}
    assert made["A"] == made["B"] != made["C"]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('name     = "new"', 'nam = "new"', "update.unit[0].name: required"),
        (
            'name     = "new"',
            'name = "new"\nscene = { "operation.torqe" = 1 }',
            "update.unit[0].scene.operation",
        ),
        (
            "[[update.unit]]",
            "[update.population]\nspread = 3\n[[update.unit]]",
            "update.population.spread",
        ),
        (
            "[[update.unit]]",
            '[update.population]\npower = "x"\n[[update.unit]]',
            "update.population.power",
        ),
        (
            "[[update.unit]]",
            "[update.population]\npowr = 1.0\n[[update.unit]]",
            "did you mean 'power'?",
        ),
        (
            'unit = "box", date',
            "date",
            "update.data[0].columns.unit: required of a fleet",
        ),
        (
            'sd = "5 mg"',
            'sd = "5 mg", drift = "1 mg"',
            "of a fleet, use update.population.straying",
        ),
    ],
)
def test_what_a_fleet_cannot_have_is_one_line(tmp_path, old, new, said):
    assert old in FLEET
    with pytest.raises(CampaignError) as caught:
        fleet(tmp_path, text=FLEET.replace(old, new))
    assert any(said in line for line in caught.value.problems), caught.value.problems


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "C,2025-01-01,280",
            ",2025-01-01,280",
            "line 7, column 'box': is empty: which unit",
        ),
        ("2026-01-01,840,390", "2025-01-03,840,390", "line 3: unit 'A' ran"),
        ("box,date", "gear box,date", "no column 'box' for unit"),
    ],
)
def test_a_wrong_row_is_one_line(tmp_path, old, new, said):
    with pytest.raises(UpdateError, match=said):
        studies(fleet(tmp_path, ROWS.replace(old, new)))


def test_commands_know_a_fleet(kept, store, capsys):
    campaign, tree = kept
    place = str(store.path)
    assert status_of(["update", str(campaign.path), "--replay", "--store", place]) == 0
    assert "open B first" in capsys.readouterr().out
    assert status_of(["ls", "--updates", "--json", "--store", place]) == 0
    assert {row["id"] for row in json.loads(capsys.readouterr().out)} >= {
        tree.attrs["id"]
    }
    assert status_of(["check", str(campaign.path)]) == 0
    said = capsys.readouterr().out
    assert "update of 5 units" in said and said.count("limit: ") == 1
    assert (
        "measured: 9 values of worn mass pinion in fleet.csv: A 2, B 3, C 2, D 2, new 0"
        in said
    )
    assert (
        status_of(["update", str(campaign.path), "--check", "5", "--store", place]) == 2
    )
    assert "--replay scores" in capsys.readouterr().err
    assert "open B first" in report(campaign, store)


def test_its_figure_has_a_line_a_unit(kept, store, tmp_path):
    campaign, _ = kept
    (made,) = draw(
        replace(campaign, figures=(FigureSpec(kind="fleet"),)), store, tmp_path
    )
    assert made.stat().st_size > 10_000
    with pytest.raises(FigureError, match="no update of this campaign"):
        draw(
            replace(campaign, figures=(FigureSpec(kind="posterior-fan"),)),
            store,
            tmp_path,
        )


DEPTHS = """
[[update.data]]
file     = "depths.csv"
quantity = "max_wear_depth"
flank    = "pinion"
columns  = { unit = "box", hours = "hours", value = "depth" }
units    = { hours = "h", depth = "um" }
error    = { sd = "1 um" }
[[update.data]]"""


def test_units_that_are_measured_differently_are_told_by_their_own_measurements(
    tmp_path, store
):
    (tmp_path / "depths.csv").write_text(
        "box,hours,depth\nE,280,5\nE,840,12.5\nF,280,6\nF,840,14\n"
    )
    rows = ROWS.replace("B,2026-01-01,840,500", "B,2026-01-01,840,1500")
    tree = update(
        fleet(tmp_path, rows, FLEET.replace("[[update.data]]", DEPTHS, 1)),
        store,
        today=TODAY,
        progress=False,
    )
    text = text_of(tree)
    assert any("! B at 840 h: much more wear" in line for line in text)
    table = [
        line.split() for line in text if "%" in line and line.split()[0] in "ABCDEF"
    ]
    assert table[0][0] == "B" and table[0][4] == "passed"
    assert not any("never" in line for line in text)
    assert any("open B first: the limit has been passed" in line for line in text)
    assert any("B: the limit has been passed" in line for line in answers(tree))
    observed = tree["observed_data"].to_dataset()
    assert set(observed["unit_name"].values) == set("ABCDEF")
    line = observed["by_the_rate"].values[observed["unit_name"].values == "E"]
    assert (
        np.nanmax(np.abs(line)) < 1e-3
    )  # a depth is foreseen by the depths of others, not by masses


@pytest.mark.parametrize(
    "date", ["2026-01-01,840", "2026-01-15,863"], ids=["same day", "later"]
)
def test_two_files_that_contradict_are_told_and_two_that_agree_are_not(
    tmp_path, store, kept, date
):
    """Was silence, and the limit of the unit passed: its depth was a
    mean with what was weighed.
    """
    first = studies(kept[0])[0]
    run = store.open(first.campaign("", first.scenes), si=True).squeeze("draw")
    worn = run["worn_mass"].sel(member="pinion")
    depth = run["max_wear_depth"].sel(flank="pinion")
    agreed = float(np.interp(390e-6 * float(date[11:]) / 840.0, worn, depth)) * 1e6
    columns = 'columns  = { unit = "box", hours = "hours", value = "depth" }'
    dated = DEPTHS.replace(
        columns, columns.replace("hours =", 'date = "date", hours =')
    )
    weighed, _, new = FLEET.partition("[[update.unit]]")
    text = weighed + dated.removesuffix("[[update.data]]") + "[[update.unit]]" + new
    said = []
    for times in (1.0, 1.5):
        (tmp_path / "depths.csv").write_text(
            f"box,date,hours,depth\nA,{date},{times * agreed:.2f}\n"
        )
        tree = update(fleet(tmp_path, text=text), store, progress=False)
        said.append([line.strip() for line in text_of(tree) if line.startswith("  ! ")])
        assert (tree["observed_data"]["unit_name"].values == "A").sum() == 3
    assert said[0] == [] and len(said[1]) == 4
    expected = (
        f"! A at {date[11:]} h: max wear depth pinion (depths.csv) shows much more "
        "wear than "
    )
    assert said[1][0].startswith(
        expected + "worn mass pinion (fleet.csv) leads to expect"
    )
    assert "the two contradict each other" in said[1][0]
    weighed_file = "worn mass pinion (fleet.csv)"
    assert said[1][1].startswith("! A: max wear depth pinion (depths.csv) and worn")
    assert f"! A, if {weighed_file} is right" in said[1][2]
    assert "limit reached on 20" in said[1][2]
    assert "! A, if max wear depth pinion (depths.csv) is right" in said[1][3]
    assert "predictions_without" not in tree.children
    sheets = tree["predictions_by_sheet"].to_dataset()
    right = list(sheets["right"].values).index(weighed_file)
    life = sheets["life_quantile"].values[right, 2]
    assert life == pytest.approx(
        kept[1]["predictions"]["life_quantile"].sel(unit="A").values[2], rel=0.05
    )
    assert report_alerts(tree) == said[1]


def report_alerts(tree):
    return [f"! {line}" for line in alerts(text_of(tree))]


def test_what_is_foreseen_of_an_inspection_does_not_know_it(tmp_path, store, kept):
    """The middle one of three, a fifth higher."""
    changed = update(
        fleet(tmp_path, ROWS.replace("560,345", "560,420")), store, progress=False
    )
    found = []
    for tree in (kept[1], changed):
        rows = tree["observed_data"].to_dataset()
        (at,) = np.flatnonzero(
            (rows["unit_name"].values == "B")
            & (rows["value"] > 3.3e-4)
            & (rows["value"] < 4.5e-4)
        )
        found.append(rows["foreseen"].values[at])
    assert found[1][2] == pytest.approx(found[0][2], rel=0.03)
