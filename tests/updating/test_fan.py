"""The fan shows what was below a limit of detection; the ranks say of how many twins they are."""

import numpy as np
import xarray as xr

from wearlab.figures.kind import Ask
from wearlab.figures.kinds.update import Updated, posterior_fan, rank_histogram

ASK = Ask("figure", "posterior-fan")


def test_a_weighing_below_the_limit_of_detection_is_drawn():
    cycle, q = np.array([0.0, 1e6]), np.linspace(0.05, 0.95, 5)
    wear = (("cycle", "quantile"), np.outer([0.0, 1.0], np.linspace(0.8, 1.2, 5)) * 1e-3)
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
    (bar,) = [s for s in posterior_fan.series(update, ASK) if s.text == "below the limit of detection"]
    assert bar.x.tolist() == [1e5, 1e5] and bar.y[0] == 0.0 and bar.y[1] > 0.0


def test_ranks_say_of_how_many_twins():
    ranks = xr.Dataset({"life_rank": ("twin", np.linspace(0.0, 1.0, 37))})
    series = list(rank_histogram.series(Updated({}, {"calibration": ranks}), ASK))
    assert series[0].up.label == "twins, of 37"
