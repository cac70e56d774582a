"""Whatever a campaign holds is drawn with defaults: many places, samples, cases.

Nothing goes unsaid.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from made_up import Axis, Campaign, Case, put, run

from wearlab.figures import KINDS, FigureError
from wearlab.figures.drawing import draw
from wearlab.figures.kind import read
from wearlab.figures.kinds.cycles import joined
from wearlab.figures.kinds.distributions import QUANTILE_BANDS
from wearlab.figures.kinds.results import listed, ranked
from wearlab.figures.layout import MAX_PANELS
from wearlab.figures.plot import MAX_NAMES, Scale, Series
from wearlab.figures.plotting import plotted
from wearlab.figures.render import rendered
from wearlab.figures.wording import Label
from wearlab.schema import VARIABLES
from wearlab.store import Store

COUNT = 30
TORQUES = tuple(100.0 + 10.0 * i for i in range(COUNT))
GRIDS = {}
MODES = ("natural_frequency", "critical_speed")
ORDINARY = [
    name
    for name, kind in KINDS.items()
    if name != "line" and set(kind.needs) <= set(VARIABLES)
]
"""Kinds that draw runs, not what an update made of them."""


def made(index):
    """Return a run that wears the faster the higher its index, so
    that no two share their cycles.
    """
    data = run(1000.0 + index)
    cycle = data["cycle"] * (1.0 + 0.01 * index)
    life = np.array(1e8 * (1.0 + 0.01 * index))
    hours = cycle / 60.0 / (1000.0 + index) * 3600.0
    changed = {
        "cycle": ("update", cycle.values, data["cycle"].attrs),
        "operating_hours": ("update", hours.values, data["operating_hours"].attrs),
        "life": ((), life, data["life"].attrs),
    }
    return data.assign(changed)


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    store = Store(tmp_path_factory.mktemp("many") / "store")
    store.archive.create()
    for index in range(COUNT):
        put(store, f"{index:032d}", made(index))
    return store


def swept(count, axis=None):
    axis = axis or Axis("torque", TORQUES[:count], "N*m", "operation.torque")
    return Campaign(
        tuple(Case("base", f"{i:032d}", {axis.name: i}) for i in range(count)), (axis,)
    )


def sampled(count=COUNT):
    order = np.random.default_rng(1).permutation(count)
    values = tuple(float(v) for v in 1e-15 * (1.0 + order))
    return swept(count, Axis("sample", values, "m^2/N", "wear.coefficient.value"))


def plot_of(store, campaign, **wishes):
    of = store, repr(campaign)
    if of not in GRIDS:
        GRIDS[of] = store.open(campaign)
    return plotted(GRIDS[of], read(SimpleNamespace(**wishes), 1, None))[0]


def seen(store, campaign, **wishes):
    plot = plot_of(store, campaign, **wishes)
    assert rendered(plot, {"Title": plot.title})[:4] == b"\x89PNG"
    return plot


@pytest.mark.parametrize("kind", ORDINARY)
def test_every_kind_draws_any_number_of_places(many, kind):
    """Three of every kind are rendered in `test_drawing`."""
    for count in (4, 7):
        assert plot_of(many, swept(count), kind=kind).panels


@pytest.mark.parametrize("kind", ORDINARY)
def test_every_kind_draws_samples(many, kind):
    plot = seen(many, sampled(MAX_NAMES + 1), kind=kind)
    assert len(plot.panels) <= MAX_PANELS
    assert len(plot.legend) <= 16


def test_two_axes_and_two_flanks_fold_into_panels(many):
    """Was KeyError: 4, the columns."""
    plot = plot_of(many, swept(4), kind="wear-profile")
    assert (plot.rows, plot.columns) == (4, 2)
    assert [panel.title for panel in plot.panels[:2]] == [
        "(a) 100 N·m, pinion",
        "(b) 100 N·m, gear",
    ]
    assert len(plot.panels) == 8


def test_three_things_more_than_there_are_roles(many):
    axes = (
        Axis("torque", TORQUES[:3], "N*m", "operation.torque"),
        Axis("ratio", (1.0, 2.0), None, "x.ratio"),
    )
    cases = tuple(
        Case("base", f"{2 * i + j:032d}", {"torque": i, "ratio": j})
        for i in range(3)
        for j in range(2)
    )
    plot = plot_of(many, Campaign(cases, axes), kind="wear-profile")
    curves = [curve for panel in plot.panels for curve in panel.curves]
    assert len(curves) == 3 * 2 * 2 * 3
    assert any(
        "100 N·m" in panel.title and "ratio 2" in panel.title for panel in plot.panels
    )


def test_samples_become_bands(many):
    """Was KeyError: 300, the columns."""
    plot = seen(many, sampled(), kind="wear-profile", select={"flank": "gear"})
    (panel,) = plot.panels
    assert {curve.style for curve in panel.curves} == {"area", "line"}
    assert any("5–95 %" in note and f"{COUNT} runs" in note for note in plot.notes)


def test_many_places_get_a_bar_of_colours_instead_of_a_legend(many):
    plot = seen(many, swept(COUNT), kind="max-wear")
    assert plot.legend == () and plot.bar is not None
    assert plot.bar.label == "torque (N·m)" and (plot.bar.low, plot.bar.high) == (
        100.0,
        390.0,
    )
    (panel,) = plot.panels
    assert len(panel.curves) == COUNT
    assert len({curve.pen.colour for curve in panel.curves}) == COUNT


def test_what_has_many_places_takes_the_hue_from_what_has_few(many):
    plot = plot_of(many, swept(COUNT), kind="mesh-force")
    assert plot.bar is not None and len(plot.panels) == 3
    assert (
        len(
            {
                curve.pen.colour
                for curve in plot.panels[0].curves
                if curve.style == "line"
            }
        )
        == COUNT
    )


def test_too_many_panels_are_thinned_and_it_is_said(many):
    plot = plot_of(many, swept(COUNT), kind="mesh-force", hue="update", cols="torque")
    assert len(plot.panels) == MAX_PANELS
    assert any(f"{MAX_PANELS} of {COUNT} places shown" in note for note in plot.notes)


def test_points_of_panels_that_are_thinned_are_told(many, tmp_path):
    """They were dropped without a word."""
    path = tmp_path / "points.csv"
    rows = [f"0.5,100,{torque}" for torque in TORQUES]
    path.write_text("\n".join(["x,y [N],torque", *rows]) + "\n")
    asked = {"kind": "mesh-force", "hue": "update", "cols": "torque"}
    plot = plot_of(many, swept(COUNT), **asked, published=path)
    curves = [curve for panel in plot.panels for curve in panel.curves]
    drawn = [curve for curve in curves if curve.style == "published"]
    (note,) = [note for note in plot.notes if "places shown" in note]
    assert len(drawn) == MAX_PANELS
    assert f"; {COUNT - MAX_PANELS} published points of others are left out" in note


def test_wear_states_of_runs_that_wear_differently_are_told_by_their_cycles(many):
    """Were "wear state 0" to "wear state 2"."""
    plot = plot_of(many, swept(2), kind="wear-profile", select={"flank": "gear"})
    assert [entry.text.split(" (")[0] for entry in plot.legend] == [
        "unworn",
        "3 million cycles",
        "3.03 million cycles",
        "100 million cycles",
        "101 million cycles",
    ]
    panels = [
        panel.title for panel in plot_of(many, swept(4), kind="along-path").panels
    ]
    assert panels[0] == "(a) unworn"
    assert (
        panels[1].startswith("(b) last state: 100 million cycles")
        and "103 million cycles" in panels[1]
    )


def test_wear_states_tell_hours_and_so_does_an_axis(many):
    plot = plot_of(many, swept(1), kind="wear-profile", select={"flank": "gear"})
    assert [entry.text for entry in plot.legend][1] == "3 million cycles (50 h)"
    (panel,) = plot_of(many, swept(1), kind="max-wear").panels
    assert panel.hours == pytest.approx(
        1e6 / 60.0 / 1000.0
    )  # the axis shows millions of cycles
    assert (
        plot_of(many, swept(2), kind="max-wear").panels[0].hours is None
    )  # other speeds, other hours


def test_a_case_that_is_not_drawn_is_named(store, campaign, plot):
    assert any(
        "static" in note and "select.case" in note for note in plot(kind="tvms").notes
    )
    assert not plot(kind="tvms", select={"case": "base"}).notes
    assert not plot(kind="max-wear").notes  # draws them all


def test_many_cases_are_told_by_their_order(many):
    cases = tuple(Case(f"variant {i}", f"{i:032d}") for i in range(COUNT))
    plot = seen(many, Campaign(cases), kind="max-wear")
    assert plot.legend == () and plot.bar is not None
    assert "variant 0 … variant 29" in plot.bar.label


@pytest.mark.parametrize(
    "kind, y, title",
    [
        ("wear-profile", "flank_deviation", "Flank deviation along the flank"),
        ("max-wear", "dynamic_factor", "Dynamic factor"),
        (
            "histogram",
            "service_life",
            "Distribution of the operating time to the depth limit",
        ),
        ("wear-profile", "wear_depth", "Wear depth along the flank"),
    ],
)
def test_the_title_tells_what_is_drawn(many, kind, y, title):
    assert plot_of(many, swept(3), kind=kind, y=y).title.startswith(title)


def test_another_variable_must_run_along_what_the_kind_shows(many):
    with pytest.raises(
        FigureError, match=r"y = 'life' does not run along profile.*kind = \"line\""
    ):
        plot_of(many, swept(2), kind="wear-profile", y="life")


def test_a_line_over_places_on_the_flank_is_of_what_runs_along_it(many):
    with pytest.raises(
        FigureError, match=r"x = 'diameter' does not run along max_wear_depth; valid: "
    ):
        plot_of(many, swept(2), kind="line", y="max_wear_depth", x="diameter")


@pytest.mark.parametrize("figure", ["max-wear", "quantile-bands"])
def test_over_wear_states_x_has_one_number_for_each(many, figure):
    """Was a fault of broadcasting."""
    with pytest.raises(
        FigureError,
        match=r"x = 'diameter' is not one number per wear state; leave it out",
    ):
        plot_of(many, swept(4), kind=figure, x="diameter")


def test_a_run_at_its_limit_is_not_flat():
    """Depths v·n to a limit of 1 at rates 1…99: the median ends where the fiftieth run
    has reached it.
    """
    depth = Scale("depth", "um")
    life = Scale("life", "1")
    run_of = QUANTILE_BANDS.series.__globals__["OfRun"]
    rates = np.arange(1.0, 100.0)
    runs = [
        run_of(
            {},
            np.array([0.0, 1.0 / v]),
            np.array([0.0, 1.0]),
            life,
            depth,
            ended="above",
        )
        for v in rates
    ]
    *_, median = QUANTILE_BANDS.joined(runs)
    assert median.x[-1] == pytest.approx(1.0 / 50.0, rel=0.1)
    np.testing.assert_allclose(median.y, 50.0 * median.x, atol=1e-12)


def test_x_is_found_by_the_key_that_was_swept(many):
    """Was refused: the block has a name of its own."""
    plot = plot_of(many, sampled(), kind="line", y="life", x="value")
    (panel,) = plot.panels
    assert panel.x_label == "Wear coefficient ($10^{-14}$\N{NO-BREAK SPACE}m²/N)"
    (curve,) = panel.curves
    assert (
        curve.style == "dots" and len(curve.x) == COUNT
    )  # drawn at random: no line joins them


def test_one_number_a_run_is_drawn_over_the_sweep(many):
    (panel,) = plot_of(many, swept(4), kind="line", y="life").panels
    assert panel.x_label == "Torque (N·m)" and panel.curves[0].x.tolist() == list(
        TORQUES[:4]
    )


def test_sensitivity_ranks_sweeps_and_samples(many):
    """Was an empty figure where no case is named 'what: value'."""
    plot = seen(many, swept(4), kind="sensitivity")
    assert [entry.text for entry in plot.legend] == ["mean of the base runs"]
    assert plot.panels[0].names == ("torque",)
    (line, _) = plot.panels[0].curves
    np.testing.assert_allclose(line.x, [100.0, 101.0, 102.0, 103.0])
    plot = seen(many, sampled(), kind="sensitivity")
    assert plot.panels[0].names == ("wear coefficient",)
    with pytest.raises(FigureError, match="nothing varies"):
        seen(many, swept(1), kind="sensitivity")
    with pytest.raises(FigureError, match="nothing varies"):
        ranked([])


def test_cases_stand_beside_their_names_in_the_order_of_the_file(many):
    plot = seen(many, swept(4), kind="cases", y="life")
    (panel,) = plot.panels
    assert panel.names == tuple(f"{torque:g} N·m" for torque in TORQUES[:4])
    points, base = panel.curves
    np.testing.assert_allclose(points.x, [100.0, 101.0, 102.0, 103.0])
    assert points.y.tolist() == [1.0, 2.0, 3.0, 4.0] and base.x.tolist() == [
        100.0,
        100.0,
    ]
    assert plot.title == "Cycles to the depth limit"
    with pytest.raises(FigureError, match="cannot be told by name"):
        listed([named(number) for number in range(100)])


def test_names_on_the_abscissa_are_refused_with_a_remedy():
    """Was an empty figure."""
    with pytest.raises(FigureError, match='kind = "cases"'):
        joined([replace(named(1), x=np.array([np.nan]))], "case")


def named(number):
    """Return a point of `cases` as a run yields it."""
    key = {"run": Label(str(number), str(number))}
    return Series(
        key,
        np.array([1.0]),
        np.zeros(1),
        Scale("life", "1"),
        Scale("run", "1"),
        "points",
    )


def test_a_fault_of_ours_in_one_figure_stops_no_other(many, monkeypatch, tmp_path):
    def broken(run, ask):
        raise KeyError(4)

    monkeypatch.setitem(KINDS, "tvms", KINDS["tvms"]._replace(series=broken))
    figures = tuple(SimpleNamespace(kind=kind) for kind in ("tvms", "max-wear"))
    with pytest.raises(
        FigureError, match=r"figure 1 \(tvms\): a fault of wearlab.*KeyError: 4"
    ) as caught:
        draw(replace(swept(3), figures=figures), many, tmp_path)
    assert [path.name for path in caught.value.drawn] == ["02-max-wear.png"]


def test_what_is_not_sampled_is_never_a_band(many):
    """Was: three modes of four torques, "median and 5–95 % of up to 12 runs"."""
    plot = plot_of(many, swept(5), kind="natural-modes")
    assert not any("Median" in note for note in plot.notes)
    assert {entry.style for entry in plot.legend} == {"line", "points", "reference"}


def test_states_of_few_samples_are_left_out_and_it_is_said(many):
    """Was: a state of one run out of 300, between those of all."""
    put(many, "e" * 32, _with_a_state_more(made(0)))
    first, *others = sampled().cases
    campaign = replace(sampled(), cases=(replace(first, id="e" * 32), *others))
    plot = plot_of(many, campaign, kind="wear-profile", select={"flank": "gear"})
    assert len(plot.legend) == 3
    assert "Not drawn: 1 wear state that less than half of the runs have." in plot.notes


def _with_a_state_more(data):
    more = data.isel({"update": [0, 1, 2, 2]})
    times = {"cycle": [0.0, 3e6, 5e7, 1e8], "operating_hours": [0.0, 180.0, 3e3, 6e3]}
    new = {
        name: ("update", np.array(values), data[name].attrs)
        for name, values in times.items()
    }
    return more.assign_coords(cycle=new["cycle"]).assign(
        operating_hours=new["operating_hours"]
    )


def test_a_set_that_turns_freely_and_one_under_a_duty_have_modes(many, tmp_path):
    """Were 0 Hz divided by 0 rpm, an empty figure; and a fault of ours."""
    store = Store(tmp_path / "store")
    store.archive.create()
    free = made(0)
    for name in MODES:
        free[name] = free[name] * xr.DataArray([0.0, 1.0, 1.0], dims="mode")
    put(store, f"{0:032d}", free)
    duty = made(1)
    for name in (*MODES, "mesh_frequency"):
        duty[name] = duty[name].expand_dims(duty=2).copy()
    put(store, f"{1:032d}", duty)
    for index, modes in ((0, 2), (1, 3)):
        cases = (Case("base", f"{index:032d}"),)
        (panel,) = plot_of(store, Campaign(cases), kind="natural-modes").panels
        level = [curve for curve in panel.curves if curve.style == "reference"]
        assert len({float(curve.y[0]) for curve in level}) == modes
        assert all(np.isfinite(curve.y).all() for curve in panel.curves)


def test_natural_frequencies_that_differ_stand_side_by_side(many, tmp_path):
    store = Store(tmp_path / "store")
    store.archive.create()
    for index in range(2):
        data = made(index)
        for name in MODES:
            data[name] = data[name] * (1.0 + index)
        put(store, f"{index:032d}", data)
    assert len(plot_of(store, swept(2), kind="natural-modes").panels) == 2


def test_many_speeds_of_a_response_are_thinned_and_it_is_said(many, tmp_path):
    """Was refused: too many to tell apart."""
    store = Store(tmp_path / "store")
    store.archive.create()
    data = run(1000.0).isel(response_speed=[0, 1, 2, 3, 4, 5, 5, 5])
    speeds = (
        "response_speed",
        np.linspace(80.0, 180.0, 8),
        data["response_speed"].attrs,
    )
    put(store, f"{0:032d}", data.assign_coords(response_speed=speeds))
    plot = plot_of(store, swept(1), kind="poincare")
    assert (
        "6 of 8 speeds are drawn, spread over all; select.response_speed names others."
        in plot.notes
    )


def test_what_is_absent_says_what_makes_it(store, campaign, plot):
    with pytest.raises(
        FigureError,
        match=r"no selected run has dynamic_mesh_force; it takes \[dynamics\]",
    ):
        plot(kind="mesh-force", select={"case": "static"})


def test_a_distribution_of_two_says_which_figure(many):
    with pytest.raises(
        FigureError,
        match=r"figure 1 \(histogram\): a distribution needs at least 3 runs",
    ):
        plot_of(many, swept(2), kind="histogram")
