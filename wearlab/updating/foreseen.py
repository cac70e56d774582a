"""The group of predictions: life, remaining life, depth and mass over the cycles, by their quantiles."""

import numpy as np
import xarray as xr

from wearlab.schema import VARIABLES
from wearlab.updating.answer import QUANTILES
from wearlab.updating.calendar import days_of
from wearlab.updating.layout import variable
from wearlab.updating.outcome import UpdateOutcome
from wearlab.updating.predicting import over_cycles

PLACES = 121  # cycles at which the wear is predicted
AHEAD = 1.25  # times the 95 % quantile of the life up to which it is
P = np.array(QUANTILES)


def predictions(outcome: UpdateOutcome, rng: np.random.Generator) -> xr.Dataset:
    """Return exact quantiles of life and remaining life, and those of draws of depth and mass over cycles."""
    post, answer = outcome.posterior, outcome.answer
    life = answer.life(P)
    run = post.histories[0]
    end = life[-1] if np.isfinite(life[-1]) else life[2]
    last = max(
        AHEAD * float(min(end, 4.0 * life[2])) if np.isfinite(end) else run.end, answer.now, run.start + 1.0
    )
    cycles = np.linspace(run.start, last, PLACES)
    along = ("cycle", "quantile")
    hours = run.seconds_per_cycle
    variables = {
        "life_quantile": variable(life, "1", "cycles to the limit", ("quantile",)),
        "remaining_useful_life_quantile": variable(
            answer.remaining(P), "1", "cycles from the last inspection to the limit", ("quantile",)
        ),
        "factor_quantile": variable(answer.factor(P), "1", "factor on the wear coefficient", ("quantile",)),
        "prior_life_quantile": variable(
            outcome.prior.life(P), "1", "cycles to the limit, before", ("quantile",)
        ),
        "prior_factor_quantile": variable(
            outcome.prior.factor(P), "1", "factor on the wear coefficient, before", ("quantile",)
        ),
        "now": xr.Variable((), answer.now, {"units": "1", "long_name": "cycle of the last inspection"}),
        "seconds_per_cycle": xr.Variable((), hours, {"units": "s", "long_name": "operating time of a cycle"}),
        "limit": xr.Variable(
            (),
            run.level,
            {
                "units": VARIABLES[outcome.study.limit.quantity].units,
                "long_name": "wear that ends the life",
                "quantity": outcome.study.limit.quantity,
                "where": outcome.study.limit.where or "",
            },
        ),
    }
    days = outcome.study.spec.days
    if days is not None:
        about = f"day on which the limit is reached, at {days.hours_per_year:g} operating hours a year"
        ends = days_of(days, answer.remaining(P), answer.now - run.start, hours)
        variables["end_of_life_quantile"] = xr.Variable("quantile", ends, {"long_name": about})
    quantity = outcome.study.limit.quantity
    for name in run.beside:
        drifting = answer.drifting if name == quantity else None
        each = over_cycles(post, outcome.draws, name, cycles, drifting, rng)
        before = over_cycles(outcome.prior.posterior, outcome.prior_draws, name, cycles, drifting, rng)
        meta = {"display_units": VARIABLES[name].display_units}
        for prefix, values in (("", each), ("prior_", before)):
            variables[f"{prefix}{name}_quantile"] = variable(
                np.quantile(values, P, axis=1).T,
                VARIABLES[name].units,
                VARIABLES[name].long_name,
                along,
                **meta,
            )
    told = {"quantile": "probability of less", "cycle": "cycle"}
    coords = {"quantile": P, "cycle": cycles}
    return xr.Dataset(
        variables,
        {n: (n, values, {"units": "1", "long_name": told[n]}) for n, values in coords.items()},
    )
