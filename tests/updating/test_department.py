"""A maintenance engineer asks: twelve gearboxes, dates, weighings, a load record; which
to open first?
"""

import re
from datetime import date
from html import unescape

import numpy as np
import pytest
from scenes import CAMPAIGNS

import wearlab as wl
from wearlab.report.page import report
from wearlab.updating import update
from wearlab.updating.report_text import answers, fleet_about, fleet_tables, text_of

END = date(2026, 6, 30)
CAMPAIGN = CAMPAIGNS / "update_department.toml"


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return wl.Store(tmp_path_factory.mktemp("store"))


@pytest.fixture(scope="module")
def tree(store):
    return update(wl.load(CAMPAIGN), store, progress=False)


def true_days():
    text = (
        (CAMPAIGN.parent / "measured" / "department_weighings.csv")
        .read_text()
        .splitlines()[1]
    )
    return {
        pair.split()[0]: date.fromisoformat(pair.split()[1])
        for pair in text.strip("# ").split(", ")
    }


def test_every_gearbox_gets_a_day_that_is_true_of_its_own_loads(tree):
    """Truths are real runs with the loads as stages, coefficients
    drawn outside of the code.
    """
    truth = true_days()
    predictions = tree["predictions_without"].to_dataset()
    days = predictions["end_of_life_quantile"].values.astype("datetime64[D]")
    names = predictions["unit"].values.tolist()
    assert names == list(truth) and len(names) == 12
    worn_out = (
        predictions["end_passed"].values > 0.3
    )  # then its day is the last one known, or a later one
    inside = [
        days[k, 0] <= np.datetime64(truth[n]) <= days[k, 4]
        or (worn_out[k] and truth[n] < END)
        for k, n in enumerate(names)
    ]
    assert sum(inside) >= 9, dict(zip(names, inside, strict=True))
    weighed = [k for k, name in enumerate(names) if name not in ("G06", "G12")]
    off = [
        abs(int((days[k, 2] - np.datetime64(truth[names[k]])).astype(int)))
        for k in weighed
        if truth[names[k]] > END
    ]
    assert np.median(off) < 60, off


def test_the_page_says_which_two_to_open_first_and_why_and_what_contradicts_what(tree):
    text = "\n".join(text_of(tree))
    assert sum(line.strip().startswith("G") for line in text_of(tree)) >= 12
    _, heads, rows = fleet_tables(tree)[0]
    predictions = tree["predictions"].to_dataset()
    names = predictions["unit"].values
    lower = predictions["end_of_life_quantile"].values[:, 0]
    overdue = predictions["passed_today"].values > 0.5
    assert overdue.any() and not overdue.all() and str(predictions["today"].values)
    order = np.lexsort((lower, ~overdue))
    assert [row[0] for row in rows] == names[order].tolist()
    assert len(heads) == len(rows[0])
    assert "! G06 at " in text and "look at the reading, its unit and its hours" in text
    assert (
        "if the readings above that are marked ! are wrong, leaving out those:" in text
    )
    said = answers(tree)
    assert any(
        line.startswith("if the readings marked ! are wrong: open ") for line in said
    )
    first, second, *_ = (line for line in said if line.startswith("open "))
    assert "first: " in first and "next: " in second and first.count(";") >= 1
    soonest = sorted(true_days().items(), key=lambda pair: pair[1])[:5]
    without = text.partition("leaving out")[2]
    opened = [
        line.split()[1]
        for line in without.splitlines()
        if line.strip().startswith("open ")
    ]
    assert set(opened[:2]) & {name for name, _ in soonest}


def test_the_report_leads_with_what_contradicts_and_has_a_day_for_each(tree, store):
    """Before the tables: the reading to look at, what to open if it
    is right, and if it is wrong.
    """
    page = unescape(report(wl.load(CAMPAIGN), store))
    answer = page.partition('id="answer"')[2].partition("</section>")[0]
    leads = re.findall(r'<p class="lead">(.*?)</p>', answer)
    assert leads[0].startswith("! G06 at ")
    assert leads[1].startswith("! the record of G01, G03, G05 and 3 others ends with")
    assert leads[2].startswith("open ")
    tables = fleet_tables(tree)
    assert len(tables) == 2 and tables[1][0] in answer
    for row in (row for *_, rows in tables for row in rows):
        assert all(f">{cell}</td>" in answer for cell in row)
    assert fleet_about(tree) in answer and "60 µm of wear on the pinion" in answer
