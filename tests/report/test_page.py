"""One page per campaign: everything on it, nothing fetched, nothing a
stranger wrote becomes markup.
"""

import base64
import re
from dataclasses import replace
from html.parser import HTMLParser
from types import SimpleNamespace

import pytest
from made_up import put, run
from scenes import SPUR_50_50

import wearlab as wl
from wearlab.cli.app import status_of
from wearlab.report.page import drawn, remarks, report
from wearlab.store import Store
from wearlab.store.outcome import Comparison, Outcome, place

EVIL = '<script>alert(1)</script> & "quotes"'
STUDY = f"""
title = '''{EVIL}'''
extends = "{SPUR_50_50.as_posix()}"

[metadata]
author = "Ada <b>Lovelace</b>"
licence = "CC-BY-4.0"

[[sweep]]
"operation.speed" = ["800 rpm", "1100 rpm", "1860 rpm"]

[[case]]
label = "<img src=x onerror=alert(2)>"
"operation.torque" = "300 N*m"
expect = {{ verdict = "completed" }}

[[figure]]
kind = "max-wear"
title = "Wear </figure><script>"

[[figure]]
kind = "line"
y = "worn_mass"
select = {{ speed = 1860 }}
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The campaign and a store: two speeds done, one failed, the case refused with what
    it expects missed.
    """
    folder = tmp_path_factory.mktemp("page")
    (folder / "study.toml").write_text(STUDY)
    campaign = wl.load(folder / "study.toml")
    store = Store(folder / "store")
    store.archive.create()
    flags = "bore_diameter <assumed>\nroot profile radial"
    for case, speed in zip(campaign.cases[:2], (800.0, 1100.0), strict=True):
        data = run(speed).assign(
            verdict=((), "completed"), validity=((), flags), run_time_total=((), 1.5)
        )
        data = data.assign(
            iso_pitting_safety=("flank", [1.2824, 1.3272]),
            ste_peak_to_peak=(("update", "mesh"), [[4e-6], [5e-6], [3e-6]]),
        )
        put(store, case.id, data.assign_attrs(commit="c0ffee"))
    store.archive.catalogue.record(
        [
            Outcome(
                campaign.cases[2].id,
                "failed",
                "2026-01-02T03",
                0.1,
                "{}",
                reason="Traceback\nBoom: <i>no</i>",
            ),
            Outcome(
                campaign.cases[3].id,
                "refused",
                "2026-01-02T03",
                0.1,
                "{}",
                reason="teeth lose each other",
            ),
        ]
    )
    members = [(case.id, case.label, place(campaign, case)) for case in campaign.cases]
    key = store.archive.catalogue.record_campaign(
        campaign.title, None, str(campaign.path), members
    )
    missed = Comparison("refused", "completed", "refused", False)
    store.archive.catalogue.record_comparisons(key, [None, None, None, missed])
    return campaign, store


class Outline(HTMLParser):
    """Tags, addresses and text of a page."""

    def __init__(self, page):
        super().__init__()
        self.tags = []
        self.addresses = []
        self.text = ""
        self.open = []
        self.feed(page)
        self.text = re.sub(r"\s+", " ", self.text)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.addresses += [
            value
            for name, value in attributes
            if name in ("src", "href", "data", "action")
        ]
        assert not [name for name, _ in attributes if name.startswith("on")]
        if tag not in ("meta", "img", "source", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


@pytest.fixture(scope="module")
def page(study):
    return report(*study)


def test_nothing_is_fetched_and_nothing_runs(page):
    found = Outline(page)
    assert found.open == [] and "script" not in found.tags
    assert all(
        one.startswith(("#", "data:image/png;base64,")) for one in found.addresses
    )
    assert "@import" not in page and "url(" not in page
    assert "default-src 'none'" in page
    assert found.tags.count("img") == 1


def test_safeties_and_transmission_errors_are_told_unworn_and_worn(page):
    unworn = "<th>range of transmission error unworn [µm]</th>"
    worn = "<th>range of transmission error worn [µm]</th>"
    assert "<th>S_H pinion</th><th>S_H gear</th>" in page
    assert f"{unworn}{worn}" in page
    cells = re.findall(r'data-head="S_H (?:pinion|gear)" class="tight">([^<]+)', page)
    assert cells == ["1.282", "1.327"] * 2
    error = 'data-head="range of transmission error {} [µm]" class="tight">{}<'
    assert error.format("unworn", 4) in page and error.format("worn", 3) in page


def test_names_stay_text(page):
    assert EVIL in Outline(page).text
    assert "onerror=alert(2)>" in Outline(page).text
    assert "Boom: <i>no</i>" in Outline(page).text
    assert "Ada <b>Lovelace</b>" in Outline(page).text


def test_what_it_tells(page, study):
    text = Outline(page).text
    campaign, _ = study
    for case in campaign.cases:
        assert case.id[:10] in text
    for told in (
        "800, 1100, 1860 rpm",
        "Left out:",
        "dynamics: spur-3dof, periodic",
        "µm worn",
        "failed",
        "teeth lose each other",
        "refused",
        "0 of 1 as expected",
        "bore_diameter <assumed> (2 runs)",
        "c0ffee",
        "CC-BY-4.0",
        "select = { speed = 1860 }",  # the campaign file itself
        "spur_50_50.toml",
    ):
        assert told in text, told


def test_remarks_that_differ_in_one_number_are_one(study):
    campaign, store = study
    entries = store.archive.entries(case.id for case in campaign.cases[:2])
    one, other = entries.values()
    said = {
        "one": [
            "path longer by 9 %",
            "path longer by 43 %",
            "h_f = 1.2, at most 2",
            "R_q = 1.25 R_a",
        ],
        "other": ["path longer by 12 %", "h_f = 1.3, at most 3", "R_q = 1.25 R_a"],
    }
    told = {
        name: replace(entry, summary={"validity": "\n".join(said[name])}, warnings=())
        for name, entry in (("one", one), ("other", other))
    }
    assert set(remarks(told)) == {
        ("path longer by 9 to 43 %", 2),
        ("R_q = 1.25 R_a", 2),
        ("h_f = 1.2, at most 2", 1),
        ("h_f = 1.3, at most 3", 1),
    }


def test_figures_are_in_the_page(page):
    uri = next(one for one in Outline(page).addresses if one.startswith("data:"))
    assert base64.b64decode(uri.partition(",")[2])[:4] == b"\x89PNG"
    assert "figure 2 (line): none of its runs is there" in Outline(page).text


def test_equal_stores_give_equal_pages(page, study):
    assert report(*study) == page


def test_the_command(study, tmp_path, capsys):
    campaign, store = study
    words = [
        "report",
        str(campaign.path),
        "--store",
        str(store.path),
        "--out",
        str(tmp_path / "a" / "b.html"),
    ]
    assert status_of(words) == 0
    assert (
        (tmp_path / "a" / "b.html")
        .read_text(encoding="utf-8")
        .startswith("<!doctype html>")
    )
    assert capsys.readouterr().out.strip() == str(tmp_path / "a" / "b.html")
    assert (
        status_of(["report", str(campaign.path), "--store", str(tmp_path / "none")])
        == 2
    )


def test_a_figure_of_one_column_is_drawn_once_and_light(study, page):
    """Every figure was there twice, in true colours: 2.7 MB for a page."""
    campaign, store = study
    assert "<picture>" not in page and len(page) < 250_000
    profiles = campaign.figures[0].model_copy(update={"kind": "wear-profile"})
    (one,) = drawn(replace(campaign, figures=(profiles,)), store)
    assert one.small and one.small != one.uri
    assert base64.b64decode(one.uri.partition(",")[2])[25] == 3  # colours by a palette


def test_assumptions_stand_in_the_order_of_the_run():
    """Was another order in every process: a page made again was another page."""
    lines = [
        f"{word}: assumed"
        for word in ("pinion", "gear", "ring", "sun", "carrier", "oil", "bore", "rim")
    ]
    entry = SimpleNamespace(
        id="a", warnings=["last"], summary={"validity": "\n".join(lines)}
    )
    assert [line for line, _ in remarks({"a": entry})] == [*lines, "last"]
