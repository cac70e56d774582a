"""wearlab in Python: whatever describes runs is run, opened, tabled and drawn, in one
convention of units.
"""

import numpy as np
import pytest
from matplotlib.text import Text
from scenes import SPUR_50_50

import wearlab as wl
from wearlab.runner.progress import NotebookBar
from wearlab.store.outcome import Outcome

STUDY = {
    "title": "two torques",
    "extends": SPUR_50_50,
    "drop": ["dynamics"],
    "wear": {"load": "static", "until": {"cycles": np.float64(1e7)}},
    "sweep": [{"operation.torque": ["200 N*m", "0.3 kN*m"]}],
}


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    return wl.run(STUDY, tmp_path_factory.mktemp("python") / "store", progress=False)


def test_a_dict_is_run_and_its_grid_has_the_units_of_the_file(report):
    assert (report.done, report.computed) == (2, 2) and repr(report).startswith(
        "<Report: 2 of 2 done; 2 com"
    )
    grid = report.to_xarray()
    assert (
        grid.torque.values.tolist() == [200.0, 300.0]
        and grid.torque.attrs["units"] == "N*m"
    )
    assert grid.max_wear_depth.attrs["units"] == "m"
    assert (
        "two torques" in report.campaign._repr_html_()
        and "done" in report.store._repr_html_()
    )
    assert "2 of 2 done" in report._repr_html_() and report.to_dict()["total"] == 2


def test_the_same_units_wherever_a_value_is_read_and_one_switch_for_si(report):
    """The grid and the query say rpm both, or rad/s both."""
    sweep = [{"operation.speed": ["600 rpm", "1100 rpm"]}]
    campaign = wl.load({**STUDY, "operation": {"torque": "200 N*m"}, "sweep": sweep})
    wl.run(campaign, report.store, progress=False)
    for si, unit, value in (
        (False, "rpm", 600.0),
        (True, "rad/s", 600.0 * 2.0 * np.pi / 60.0),
    ):
        axis = report.store.open(campaign, si=si).speed
        found = report.store.query(
            "speed < 700 rpm", columns=["speed", "max_wear_depth"]
        )
        table = found.to_xarray(si=si)
        frame = found.to_pandas(si=si)
        assert {
            axis.attrs["units"],
            table.speed.attrs["units"],
            frame.attrs["units"]["speed"],
        } == {unit}
        assert axis.values[0] == pytest.approx(value, rel=1e-12)
        assert (
            table.speed.item() == frame.speed.item() == found.to_dict(si=si)["speed"][0]
        )
        assert table.speed.item() == pytest.approx(value, rel=1e-12)
        assert (
            table["max(max_wear_depth)"].attrs["units"] == "m"
        )  # results are SI, as in every dataset
    assert (
        next(iter(found))["speed"] == pytest.approx(600.0)
        and "rpm" in found._repr_html_()
    )


def test_scenes_become_an_axis_that_tells_in_what_they_differ(report):
    scene = wl.load(STUDY).cases[0].scene
    scenes = [
        scene.replace("operation.torque", f"{torque} N*m") for torque in (200, 300)
    ]
    again = wl.run(scenes, report.store, progress=False)
    assert (
        again.computed == 0 and again.total == 2
    )  # they are the runs that the campaign made
    grid = again.to_xarray()
    assert grid.sizes["scene"] == 2 and grid.torque.values == pytest.approx(
        [200.0, 300.0]
    )
    assert grid.torque.attrs["units"] == "N*m"
    alone = wl.run(scene, str(report.store.path), progress=False).to_xarray()
    of_scene = grid.max_wear_depth.isel(scene=0).drop_vars(["scene", "torque"])
    assert alone.max_wear_depth.equals(
        of_scene.isel(update=slice(alone.sizes["update"]))
    )
    assert of_scene.isel(update=slice(alone.sizes["update"], None)).isnull().all()
    assert repr(scene).startswith(
        f"<Scene {scene.id[:10]}: external-pair 50 × 50, 200 N*m, 1100 rpm, quasi"
    )
    assert "gears.module" in scene._repr_html_() and len(repr(wl.load(STUDY))) < 100


def test_a_store_that_is_not_there(tmp_path):
    with pytest.raises(wl.StoreError, match="there is no store here"):
        wl.open(tmp_path / "absent")
    assert not (tmp_path / "absent").exists()


def test_what_is_no_campaign():
    with pytest.raises(TypeError, match="int is no campaign"):
        wl.run(3)
    with pytest.raises(TypeError, match="scenes only"):
        wl.run([3])
    with pytest.raises(
        wl.CampaignError,
        match=r"campaign: operaton: unknown key, did you mean 'operation'",
    ):
        wl.load({**STUDY, "operaton": {}})


@pytest.mark.parametrize("of", ["grid", "run", "report"])
def test_a_figure_of_a_grid_of_a_run_and_of_a_report(report, of, tmp_path):
    store = report.store
    shown = {
        "grid": report.to_xarray(),
        "run": store.run(report.campaign.cases[0].id),
        "report": report,
    }[of]
    drawn = wl.figure(shown, "max-wear", title="as asked")
    drawn.savefig(tmp_path / "figure.png")
    assert any(text.get_text() == "as asked" for text in drawn.findobj(Text))
    assert drawn._repr_png_()[:4] == b"\x89PNG"
    with pytest.raises(wl.FigureError, match="no such kind; did you mean 'max-wear'"):
        wl.figure(shown, "max-wea")
    with pytest.raises(wl.FigureError, match="'hu' is no option; did you mean 'hue'"):
        wl.figure(shown, "max-wear", hu="torque")


def test_the_bar_of_notebooks():
    shown = []

    class Handle:
        def update(self, bar):
            shown.append(bar._repr_html_())

    def display(bar):
        shown.append(bar._repr_html_())
        return Handle()

    with NotebookBar(display) as bar:
        bar.step("compiling <it>")
        bar.start(2)
        bar.advance(Outcome("a", "failed", "now", 1.0, "{}"))
        bar.advance(Outcome("b", "done", "now", 1.0, "{}"))
    assert shown[0] == "<span>compiling &lt;it&gt;</span>"
    assert (
        'value="2" max="2"' in shown[-1]
        and "2 of 2 cases" in shown[-1]
        and "1 failed" in shown[-1]
    )


def test_scatter_and_parallel_coordinates_show_what_the_grid_has(report):
    from types import SimpleNamespace

    from wearlab.figures.kind import read
    from wearlab.figures.plotting import plotted

    grid = report.to_xarray()
    last = 1e6 * grid.max_wear_depth.max("update")  # runs differ in their states
    spec = SimpleNamespace(kind="scatter", y="max_wear_depth", x="torque")
    (panel,) = plotted(grid, read(spec, 1, None))[0].panels
    for curve, flank in zip(panel.curves, ("pinion", "gear"), strict=True):
        assert curve.x.tolist() == [200.0, 300.0]
        assert curve.y == pytest.approx(last.sel(flank=flank).values)
    spec = SimpleNamespace(kind="parallel-coordinates", y="max_wear_depth")
    (panel,) = plotted(grid, read(spec, 1, None))[0].panels
    assert sorted(curve.y.tolist() for curve in panel.curves) == [
        [0.0, 0.0],
        [1.0, 1.0],
    ]
    assert [mark.text.split("\n")[0] for mark in panel.marks] == [
        "torque",
        "largest wear depth",
    ]
    assert panel.marks[0].text.endswith("200 … 300 N·m") and panel.marks[
        1
    ].text.endswith("µm")


def test_a_report_names_what_was_refused_and_why():
    from wearlab.runner.report import CaseReport, Report

    refused = CaseReport(
        "a" * 20, "thin", "refused", "Traceback\ngears: teeth are pointed"
    )
    report = Report(2, 2, 1, 0, 1, 3.0, (refused,))
    assert (
        str(report)
        == "1 of 2 done, 1 refused; 2 tried in 3.0 s\n  thin: refused: gears: teeth "
        "are pointed"
    )
    assert str(Report(2, 1, 2, 0, 0, 3.0)) == "2 of 2 done; 1 computed in 3.0 s"
    assert (
        repr(Report(2, 2, 1, 0, 1, 3.0, (refused,)))
        == "<Report: 1 of 2 done, 1 refused; 2 tried in 3.0 s>"
    )


FORMULAS = {
    "max(max_wear_depth)": lambda run: run.max_wear_depth.max(),
    "min(max_wear_depth[update=-1])": lambda run: run.max_wear_depth[-1].min(),
    "max_wear_depth[flank='pinion', update=-1]": lambda run: run.max_wear_depth.sel(
        flank="pinion"
    )[-1],
    "ste_peak_to_peak[update=0]": lambda run: run.ste_peak_to_peak[0].squeeze(),
    "max(wear_depth) - min(wear_depth)": lambda run: np.ptp(run.wear_depth.values),
}


def test_columns_are_written_as_in_claims(report):
    """The larger of two safeties is not shown under the name of both."""
    columns = list(FORMULAS)
    table = report.store.query("status = done", columns=columns)
    assert [column.name for column in table.columns] == ["id", "status", *columns]
    assert [column.unit for column in table.columns[2:]] == ["m"] * len(columns)
    for text, of_run in FORMULAS.items():
        expected = [float(of_run(report.store.run(run))) for run in table["id"]]
        np.testing.assert_allclose(table[text], expected, rtol=1e-12)
    heads, _ = table.displayed()
    assert heads[3] == "min(max_wear_depth[update=-1]) [um]"


def test_a_bare_column_says_which_of_its_values_it_shows(report):
    table = report.store.query("", columns=["max_wear_depth", "wear_depth", "life"])
    names = ["id", "status", "max(max_wear_depth)", "max(wear_depth)", "life"]
    assert [column.name for column in table.columns] == names
    np.testing.assert_allclose(table["max(max_wear_depth)"], table["max(wear_depth)"])
    with pytest.raises(KeyError, match=r"there are id, status, max\(max_wear_depth\)"):
        _ = table["max_wear_depth"]


def test_sorting_and_conditions_take_formulas(report):
    least = "min(max_wear_depth[update=-1])"
    deepest = report.store.query("", columns=["torque"], sort=f"-{least}")
    assert deepest["torque"][0] == 300.0
    *_, second, largest = report.store.query("", columns=[least], sort=least)[least]
    middle = f"{1e6 * (second + largest) / 2} um"
    found = report.store.query(f"{least} > {middle} and torque > 1 N*m")
    assert found["operation.torque"] == [300.0] and found[least] == [largest]
    assert found.notes == ()
    (note,) = report.store.query("max_wear_depth > 1 nm").notes
    assert "max_wear_depth has several values" in note
    assert report.store.query("first_cycle(max_wear_depth > 1 nm) > 1").notes == ()


@pytest.mark.parametrize(
    ("column", "reason"),
    [
        (
            "wear_depth[update=-1, flank=pinion]",
            "numbers, not one: choose along profile",
        ),
        ("max_wear_depth[flank='sun']", "flank = sun: is not there"),
        ("min(max_wear_deph)", "unknown name 'max_wear_deph'; did you mean"),
        ("min(operation.torque)", "nothing here|no formula|no variable"),
        ("min(verdict)", "'verdict' is no variable of numbers"),
        ("min(life", "never closed|no formula"),
    ],
)
def test_a_formula_that_gives_no_number_is_refused(report, column, reason):
    from wearlab.query import QueryError

    with pytest.raises(QueryError, match=reason):
        report.store.query("", columns=[column])
    with pytest.raises(QueryError):
        report.store.query(f"{column} > 0")
