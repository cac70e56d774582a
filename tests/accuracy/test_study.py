"""What is told of a study: comparison, cheapest setting, dataset, figures."""

import json

import matplotlib
import numpy as np
import pytest
import xarray as xr

from wearlab.accuracy import pages as table
from wearlab.accuracy.ladder import Rung, WorkPrecision
from wearlab.accuracy.pages import pages
from wearlab.accuracy.study import (
    Study,
    cheapest_setting,
    comparison,
    dataset,
    knob_settings,
    netcdf,
)
from wearlab.cli.commands.compare import _accuracy_content
from wearlab.figures.plot import Curve, Panel, Pen, Plot
from wearlab.figures.render import SETTINGS, draw, part_texts, rendered


def curve(
    name, knob, role, power, speed, quantity="mesh_force", settings=(50, 100, 200, 400)
):
    rungs = tuple(
        Rung(
            s,
            1.3e7 * s**-power if role != "peer" else 10.0 * s,
            speed * s,
            10.0 * s,
            0.5 * speed * s,
        )
        for s in settings
    )
    return WorkPrecision(name, knob, quantity, role, rungs)


@pytest.fixture(scope="module")
def found(loaded):
    curves = (
        curve("periodic", "steps_per_period", "wearlab", 5.0, 1e-6),
        curve("newmark", "steps_per_period", "as published", 4.0, 1e-5),
        curve("CyRK VERN7", "relative", "peer", 0.0, 2e-1, settings=(1e-2, 1e-3)),
        WorkPrecision(
            "SciPy RK45",
            "relative",
            "mesh_force",
            "peer",
            (
                Rung(1e-3, 1e-2, 1e-2, 1.0, 1e-2),
                Rung(1e-5, 1e-4, 4e-2, 1.0, 2e-2),
                Rung(1e-7, 1e-7, 9e-2, 1.0, 9e-2),
            ),
        ),
        WorkPrecision(
            "harmonic balance",
            "harmonics",
            "mesh_force",
            "peer",
            (Rung(40, 9e-4, 3e-3, np.nan, 2e-3),),
        ),
        curve("adaptive", "cycle_tolerance", "wearlab", 5.0, 1e-3, "life"),
        curve("Euler", "threshold", "as published", 4.0, 1e-3, "life"),
    )
    one = Study("800 rpm", loaded, curves, {"mesh_force": 1e-11, "life": 1e-9}, 0.6, ())
    return [
        one,
        Study("static", loaded, curves[5:], {"life": 1e-9}, np.nan, ("nothing moves",)),
    ]


def test_ours_is_compared_with_the_fastest_peer_that_gets_there(found):
    told = comparison(found[0], 1e-3)
    assert told.name == "harmonic balance"  # another never gets there
    assert told.peer == pytest.approx(3e-3)
    steps = 1.3e10**0.2
    assert told.ours == pytest.approx(1e-6 * steps, rel=1e-6)
    assert comparison(found[1], 1e-3) is None


def test_cheapest_setting_and_every_knob(found):
    chosen, rung = cheapest_setting(found[0], "mesh_force", 1e-3)
    assert (chosen.name, rung.setting) == ("periodic", 200)
    assert cheapest_setting(found[0], "mesh_force", 1e-9) is None
    assert knob_settings(found[0], "life", 1e-3) == {"cycle_tolerance": 200}


def test_dataset_is_labelled_and_read_back(found, tmp_path):
    made = dataset("two cases", found, 0.0)
    (tmp_path / "accuracy.nc").write_bytes(netcdf(made))
    with xr.open_dataset(tmp_path / "accuracy.nc") as read:
        assert dict(read.sizes) == {
            "case": 2,
            "curve": 7,
            "rung": 4,
            "requested_error": 2,
            "quantity_compared": 2,
        }
        ours = read.isel(curve=int(np.flatnonzero(read.name == "periodic")[0])).sel(
            case="800 rpm"
        )
        assert ours.error.values == pytest.approx(
            [r.error for r in found[0].curves[0].rungs]
        )
        assert float(ours.observed_order) == pytest.approx(5.0)
        assert np.isnan(read.error.sel(case="static")[0]).all()
        assert (
            read.run_time.attrs["units"] == "s" and read.attrs["title"] == "two cases"
        )
        assert "nothing moves" in read.attrs["notes"]
        assert all("long_name" in read[name].attrs for name in read.data_vars)


def test_figures_are_the_same_bytes_twice(found):
    made = dataset("two cases", found, 0.0)
    drawn = pages(made)
    assert list(drawn) == ["work-precision", "knobs", "life", "life-time"]
    assert [len(plot.panels) for plot in drawn.values()] == [1, 1, 2, 2]
    for plot in drawn.values():
        image = rendered(plot, {"Title": "two"})
        assert image == rendered(plot, {"Title": "two"}) and image[:4] == b"\x89PNG"
    assert drawn["work-precision"].legend[0].text == "periodic"
    assert drawn["work-precision"].panels[0].curves[0].x == pytest.approx(
        [0.05, 0.1, 0.2, 0.4]
    )  # ms


def test_pages_of_a_life_tell_slope_default_and_how_well_the_reference_is_known(loaded):
    adaptive = WorkPrecision(
        "adaptive",
        "cycle_tolerance",
        "life",
        "wearlab",
        tuple(
            Rung(s, 8e-2 * n**-4.0, n * 1e-2, n)
            for s, n in ((1e-1, 2), (1e-2, 4), (1e-3, 8), (1e-4, 16))
        ),
    )
    euler = WorkPrecision(
        "Euler",
        "threshold",
        "life",
        "as published",
        tuple(Rung(1e-6 / n, 9e-2 / n, n * 1e-2, n) for n in (5, 10, 20, 40)),
    )

    def panel(apart, file="life"):
        made = dataset(
            "t",
            [Study("one", loaded, (adaptive, euler), {"life": apart}, np.nan, ())],
            0.0,
        )
        (only,) = pages(made)[file].panels
        return only

    ours, ring, theirs = panel(3e-9).curves  # the second method is far below the curves
    assert (ours.text, theirs.text, ring.style) == ("4.0", "1.0", "published")
    assert (ring.x.item(), ring.y.item()) == (8, pytest.approx(8e-2 * 8**-4.0))
    ours, _, _, unsure = panel(5e-5).curves
    assert ours.text == "" and unsure.y == pytest.approx(
        5e-5
    )  # two points tell no slope
    ours, ring, _ = panel(3e-9, "life-time").curves
    assert ours.text == "" and ring.x == pytest.approx(0.08)


def test_tables_have_a_cell_for_every_head(found):
    for heads, rows in table.tables(found, None).values():
        assert rows and all(len(row) == len(heads) for row in rows)
    asked = table.cheapest_rows(found, 1e-3)[0]
    assert "periodic, steps_per_period = 200" in asked


def test_machines_read_every_rung_as_numbers(found):
    told = json.loads(json.dumps(_accuracy_content(found, 1e-3, []), allow_nan=False))
    assert len(told["curves"]) == sum(
        len(curve.rungs) for one in found for curve in one.curves
    )
    last = [row for row in told["curves"] if row["name"] == "SciPy RK45"][-1]
    assert (last["case"], last["setting"], last["error"], last["seconds"]) == (
        "800 rpm",
        1e-7,
        1e-7,
        9e-2,
    )
    assert told["Cheapest setting"]


def test_orders_beside_curves_that_end_at_one_place_do_not_overlap():
    x = np.array([1.0, 10.0])
    curves = tuple(
        Curve(x, np.array([1e-2, 1e-6]), Pen("#000000"), "line-points", f"{k}.0")
        for k in range(9)
    )
    panel = Panel(0, 0, "", "time", "error", curves)
    figure = draw(Plot("", (panel,), 1, 1, logarithmic=True, logarithmic_across=True))
    part_texts(figure)
    (ax,) = figure.axes
    boxes = [text.get_window_extent() for text in ax.texts]
    assert len(boxes) == 9
    assert not any(
        one.overlaps(two) for k, one in enumerate(boxes) for two in boxes[:k]
    )
    assert all(box.y0 >= ax.get_window_extent().y0 for box in boxes)


@pytest.mark.parametrize(
    "ends", [(1e-5, 1e-2), (0.02, 20.0), (14.0, 1500.0), (1e-3, 2e-2), (1.0, 3e5)]
)
def test_labels_along_a_logarithmic_abscissa_do_not_overlap(ends):
    curves = (
        Curve(np.array(ends), np.array([1e-2, 1e-4]), Pen("#000000"), "line-points"),
    )
    panels = tuple(Panel(0, k, "", "time", "error", curves) for k in range(3))
    with matplotlib.rc_context(SETTINGS):
        figure = draw(Plot("", panels, 1, 3, logarithmic=True, logarithmic_across=True))
        figure.canvas.draw()
    for ax in figure.axes:
        labels = [
            one
            for one in ax.get_xticklabels()
            if ends[0] <= one.get_position()[0] <= ends[1]
        ]
        boxes = [one.get_window_extent() for one in labels if one.get_text()]
        assert len(boxes) > 1
        assert not any(
            one.overlaps(two) for k, one in enumerate(boxes) for two in boxes[:k]
        )
