"""An update is planned, listed, shown, cited, drawn and reported as runs are."""

import json

import pytest

import wearlab as wl
from wearlab.cli.app import status_of
from wearlab.figures.drawing import draw
from wearlab.report.page import report
from wearlab.store import StoreError, updates
from wearlab.updating import update
from wearlab.updating.report_text import text_of


@pytest.fixture
def told(campaign, store, tree, capsys):
    def run(*words, file=True):
        status = status_of(
            [words[0], *([str(campaign.path)] if file else []), *words[1:]]
        )
        out = capsys.readouterr()
        return status, out.out, out.err

    return run


def test_check_tells_what_was_measured(told):
    status, out, _ = told("check")
    assert (
        status == 0
        and "3 values of worn mass pinion in weighings.csv" in out
        and "limit:" in out
    )
    reach = next(line for line in out.splitlines() if ", at " in line)
    assert " g, " in reach and reach.endswith((" h", " cycles"))


def test_plan_says_which_runs_an_update_needs(told, store, tmp_path):
    assert (
        "made before, it would be read" in told("plan", "--store", str(store.path))[1]
    )
    assert "base: 1 runs, 1 new" in told("plan", "--store", str(tmp_path / "none"))[1]


def test_it_is_listed_shown_and_cited(told, store, tree):
    name = str(tree.attrs["id"])
    place = str(store.path)
    assert name[:10] in told("ls", "--updates", "--store", place, file=False)[1]
    listed = json.loads(
        told("ls", "--updates", "--json", "--store", place, file=False)[1]
    )
    assert listed[-1]["runs"] == str(tree.attrs["runs"]).split()
    shown = told("show", name[:8], "--store", place, file=False)[1]
    assert (
        "remaining life at 1.5e+08 cycles" in shown and "posterior_predictive" in shown
    )
    assert f"Update {name}" in told("cite", name[:8], "--store", place, file=False)[1]


def test_a_wrong_file_is_one_message_for_check_and_plan(told, campaign):
    text = campaign.path.read_text()
    other = campaign.path.with_name("wrong.toml")
    other.write_text(text.replace('loss = "mg"', 'loss = "s"'))
    for command in ("check", "plan"):
        status, _, said = told(command, str(other), file=False)
        assert (
            status == 2 and len(said.strip().splitlines()) == 1 and "units.loss" in said
        )


def test_figures_and_report_hold_the_update(campaign, store, tree, tmp_path):
    from dataclasses import replace

    from wearlab.campaign.campaign import FigureSpec

    kinds = (
        "posterior-fan",
        "remaining-life",
        "marginals",
        "pairs",
        "residuals",
        "look-next",
    )
    drawn = replace(campaign, figures=tuple(FigureSpec(kind=kind) for kind in kinds))
    assert len(draw(drawn, store, tmp_path)) == len(kinds)
    page = report(replace(campaign, figures=(FigureSpec(kind="posterior-fan"),)), store)
    assert "What the measurements say" in page and "remaining life at" in page
    assert "data:image/png" in page and "cannot be drawn" not in page


def test_a_window_shows_answer_and_figures(store, tree):
    pytest.importorskip("bokeh")
    from urllib.request import urlopen

    from wearlab.browsing.window import browse
    from wearlab.updating.report_text import answers

    window = browse(store)

    def page(path, more=""):
        with urlopen(
            f"http://127.0.0.1:{window.port}/{path}?token={window.token}{more}"
        ) as answer:
            return answer.read()

    try:
        name = str(tree.attrs["id"])
        (answer,) = answers(tree)
        assert answer in page("updates").decode()
        shown = page("update", f"&id={name}").decode()
        places = [
            shown.index(f">{title}")
            for title in ("Wear to come", "Remaining life", "When to look")
        ]
        assert answer in shown and places == sorted(places) and "The fleet" not in shown
        assert page("update.png", f"&id={name}&kind=posterior-fan").startswith(
            b"\x89PNG"
        )
    finally:
        window.stop()


def test_an_update_belongs_to_its_measurements_not_to_a_title(
    campaign, store, tree, tmp_path
):
    """Was found by the campaign's title: a page showed the answer to
    another file's measurements.
    """
    from wearlab.campaign import load

    folder = campaign.path.parent
    text = campaign.path.read_text()
    renamed = folder / "renamed.toml"
    other = folder / "other.toml"
    renamed.write_text(text.replace(f'"{campaign.title}"', '"Another title"'))
    data = next(one.name for one in folder.glob("*.csv"))
    weighed = (folder / data).read_text().splitlines()
    (folder / "more.csv").write_text("\n".join(weighed[:-1]) + "\n")
    other.write_text(text.replace(data, "more.csv"))
    assert load(renamed).title == "Another title" and "remaining life at" in report(
        load(renamed), store
    )
    page = report(load(other), store)
    assert "remaining life at" not in page and "wearlab update FILE makes it" in page


def test_an_update_comes_along_with_its_runs(store, tree, tmp_path):
    from wearlab.store import Store
    from wearlab.store.merging import merge
    from wearlab.store.updates import read_update

    mine = Store(tmp_path / "mine")
    made = merge(mine, store)
    assert made.updates >= 1 and not made.damaged and mine.verify() == []
    kept = read_update(mine, str(tree.attrs["id"]))
    assert kept is not None and kept.identical(
        read_update(store, str(tree.attrs["id"]))
    )
    assert merge(mine, store).updates == 0


def test_a_catalogue_from_before_updates_had_a_subject_is_read_and_written(
    store, tree, tmp_path
):
    import shutil
    import sqlite3
    from contextlib import closing

    from wearlab.store import Store
    from wearlab.store.updates import kept_updates

    shutil.copytree(store.path, tmp_path / "old")
    with closing(sqlite3.connect(tmp_path / "old" / "catalogue.sqlite")) as catalogue:
        catalogue.execute("ALTER TABLE updates DROP COLUMN subject")
        catalogue.commit()
    old = Store(tmp_path / "old")
    assert {one.subject for one in kept_updates(old).values()} == {""}
    assert old.reindex() == []
    assert kept_updates(old)[str(tree.attrs["id"])].subject == tree.attrs["subject"]


def test_a_warning_of_several_cases_names_its_case(tree):
    import xarray as xr

    from wearlab.updating.report_text import text_of

    def doubled(node):
        group = node.to_dataset()
        return xr.concat([group, group], "case").assign_coords(case=["old", "new"])

    groups = {name: doubled(node) for name, node in tree.children.items()}
    groups["sample_stats"] = groups["sample_stats"].assign(
        notes=("case", ["", "look at the units"])
    )
    both = xr.DataTree.from_dict(groups)
    assert [line for line in text_of(both) if "! " in line] == [
        "  ! case new: look at the units"
    ]


def test_many_inspections_that_are_off_are_summed_up(campaign, store, tmp_path):
    """Was two hundred warnings in a row, the one of their course behind them."""
    loss = [2.0 * k if k < 30 else 8.0 * k - 180.0 for k in range(1, 61)]
    rows = "".join(f"{1e6 * k},{value}\n" for k, value in enumerate(loss, 1))
    (tmp_path / "weighings.csv").write_text("cycles,loss\n" + rows)
    (tmp_path / "many.toml").write_text(campaign.path.read_text())
    text = [
        line.strip()
        for line in text_of(
            update(wl.load(tmp_path / "many.toml"), store, progress=False)
        )
    ]
    assert sum(line.startswith("! the inspection at") for line in text) == 3
    assert any(
        "more of the 60 inspections of worn mass pinion" in line for line in text
    )
    assert (
        sum("as expected" in line or "than expected (" in line for line in text) == 24
    )
    assert any(line.startswith("! the course of worn mass") for line in text)


def test_an_update_with_what_none_holds_is_one_message(tree):
    """Cycles that neither rise nor fall ended in a traceback."""
    odd = tree.copy()
    predictions = odd["predictions"].to_dataset()
    odd["predictions"] = predictions.drop_vars("remaining_useful_life_quantile")
    message = "update abc: its file holds what no update does"
    with pytest.raises(StoreError, match=message), updates.understanding("abc"):
        text_of(odd)
