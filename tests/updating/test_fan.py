"""The fan shows what was below a limit of detection.

The ranks say of how many twins they are.
"""

import numpy as np
import pytest
import xarray as xr
from matplotlib.dates import ConciseDateFormatter

from wearlab.figures.kind import FigureRequest
from wearlab.figures.kinds.update import (
    measured_profiles,
    posterior_fan,
    rank_histogram,
    remaining_life,
)
from wearlab.figures.layout import compose
from wearlab.figures.render import draw
from wearlab.figures.updated import DATE, REST, Updated
from wearlab.updating import report_text
from wearlab.updating.calendar import day_text

ASK = FigureRequest("figure", "posterior-fan")


def test_a_weighing_below_the_limit_of_detection_is_drawn():
    cycle = np.array([0.0, 1e6])
    q = np.linspace(0.05, 0.95, 5)
    wear = (
        ("cycle", "quantile"),
        np.outer([0.0, 1.0], np.linspace(0.8, 1.2, 5)) * 1e-3,
    )
    limit = xr.Variable((), 1e-3, {"quantity": "worn_mass"})
    predictions = xr.Dataset(
        {
            "worn_mass_quantile": wear,
            "prior_worn_mass_quantile": wear,
            "limit": limit,
            "seconds_per_cycle": 1.0,
        },
        {"cycle": cycle, "quantile": q},
    )
    told = {
        "worn_mass_sun": [np.nan, 5e-4],
        "sd_worn_mass_sun": [1e-5, 1e-5],
        "below_worn_mass_sun": [1e-4, np.nan],
    }
    observed = xr.Dataset(
        {name: ("observation", values) for name, values in told.items()},
        {"cycle_worn_mass_sun": ("observation", [1e5, 5e5])},
    )
    update = Updated({}, {"predictions": predictions, "observed_data": observed})
    (bar,) = [
        s
        for s in posterior_fan.series(update, ASK)
        if s.text == "below the limit of detection"
    ]
    assert bar.x.tolist() == [1e5, 1e5] and bar.y[0] == 0.0 and bar.y[1] > 0.0


def test_ranks_say_of_how_many_twins():
    ranks = xr.Dataset({"life_rank": ("twin", np.linspace(0.0, 1.0, 37))})
    series = list(rank_histogram.series(Updated({}, {"calibration": ranks}), ASK))
    assert series[0].y_scale.label == "twins, of 37"


def calendared(
    dates=("2025-01-01T00:00:00", "2026-01-01T00:00:00"), cycles=(0.0, 36.5e4)
):
    """Return an update of one look at a flank, a thousand cycles a day from the first
    of January on.
    """
    q = [0.05, 0.25, 0.5, 0.75, 0.95]
    predictions = xr.Dataset(
        {
            "remaining_useful_life_quantile": ("quantile", np.linspace(1e4, 3e4, 5)),
            "calendar_cycle": ("calendar_place", np.array(cycles)),
            "calendar_date": ("calendar_place", np.array(dates, object)),
            "seconds_per_cycle": 3.6,
            "now": 3.1e4,
        },
        {"cycle": [0.0, 1e5], "quantile": q},
    )
    position = [0.2, 0.1, 0.15]
    name = "wear_depth_sun"
    observed = xr.Dataset(
        {
            name: (
                "observation",
                [3e-6, 1e-6, 2e-6],
                {"units": "m", "display_units": "um"},
            )
        },
        {
            f"cycle_{name}": ("observation", [3.1e4] * 3),
            f"diameter_{name}": ("observation", position, {"units": "m"}),
        },
    )
    made = np.array([[2e-6, 3e-6, 4e-6], [2e-6, 3e-6, 4e-6]])[None]
    predictive = xr.Dataset(
        {name: (("chain", "draw", "observation"), made, observed[name].attrs)}
    )
    posterior = xr.Dataset(
        {"remaining_useful_life": ("draw", np.linspace(1e4, 3e4, 99))}
    )
    return Updated(
        {},
        {
            "predictions": predictions,
            "posterior": posterior,
            "observed_data": observed,
            "posterior_predictive": predictive,
        },
    )


def day_of(text):
    return float(np.datetime64(text, "D").astype(int))


def test_cycles_are_dates_where_there_is_a_calendar_and_go_on_beyond_it():
    series = list(remaining_life.series(calendared(), ASK))
    assert {s.x_scale for s in series} == {DATE}
    levels = [float(s.x[0]) for s in series if s.style == "level"]
    assert levels == pytest.approx(
        [day_of("2025-02-11"), day_of("2025-02-21"), day_of("2025-03-03")]
    )
    assert calendared().calendar(730e3) == pytest.approx(day_of("2027-01-01"))
    plot = compose(series, ASK, remaining_life, {"case": ""}, [])
    (panel,) = plot.panels
    assert panel.dates and panel.x_label == "Date" and panel.hours is None
    (axes,) = [axes for axes in draw(plot).axes if axes.get_xlabel() == "Date"]
    assert isinstance(axes.xaxis.get_major_formatter(), ConciseDateFormatter)


def test_a_standstill_of_a_record_takes_days_and_no_cycles():
    dates = (
        "2025-01-01T00:00:00",
        "2025-02-01T00:00:00",
        "2025-04-01T00:00:00",
        "2025-05-01T00:00:00",
    )
    days = calendared(dates, (0.0, 31e3, 31e3, 61e3)).calendar
    assert days(np.array([30e3, 32e3])) == pytest.approx(
        [day_of("2025-01-31"), day_of("2025-04-02")]
    )


def test_dates_beyond_the_calendar_of_man_stay_cycles():
    far = calendared(cycles=(0.0, 1.0))
    assert far.calendar is None
    assert {s.x_scale for s in remaining_life.series(far, ASK)} == {REST}


def test_profiles_are_drawn_in_the_order_of_their_places_beside_what_is_expected():
    shade, line, points = measured_profiles.series(calendared(), ASK)
    assert points.x.tolist() == [100.0, 150.0, 200.0] and points.y == pytest.approx(
        [1.0, 2.0, 3.0]
    )
    assert line.y == pytest.approx([3.0, 4.0, 2.0]) and shade.style == "area"
    assert (
        points.key["inspection"].text == "2025-02-01" and points.x_scale.units == "mm"
    )


def test_a_date_comes_before_hours_and_these_before_cycles():
    predictions = calendared()["predictions"]
    assert (
        report_text._at(3.1e4, 1e-3, report_text.calendar_of(predictions))
        == "2025-02-01 = 31 h = 31000 cycles"
    )
    assert report_text._at(3.1e4, 1e-3, None).strip() == "31000 cycles = 31 h"


def test_midnight_that_rounding_moved_by_a_second_is_no_day_earlier():
    days = calendared(("2024-12-31T23:59:59", "2026-01-01T00:00:00")).calendar
    assert (
        days(0.0) == day_of("2025-01-01") and day_text(float(days(0.0))) == "2025-01-01"
    )
