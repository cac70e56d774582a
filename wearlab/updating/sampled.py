"""Groups with draws: prior and posterior, measurements made up from them, their log likelihoods."""

import numpy as np
import xarray as xr

from wearlab.updating.checking import surprises
from wearlab.updating.draws import Draws
from wearlab.updating.layout import (
    CHAIN,
    INSPECTED,
    display_of,
    draws_of,
    name_of,
    names_of,
    si_unit,
    variable,
)
from wearlab.updating.likelihood import inspections_of, log_likelihood
from wearlab.updating.outcome import UpdateOutcome
from wearlab.updating.posterior import Posterior
from wearlab.updating.predicting import replicated
from wearlab.updating.study import FACTOR, plain

MOST_VALUES = 2_000_000  # of a variable with a value for each draw and observation


def sample(outcome: UpdateOutcome, post: Posterior, draws: Draws, life_from: float) -> xr.Dataset:
    """Return equally probable draws of everything unknown, and of the life counted from a cycle."""
    names = names_of(list(outcome.study.spec.unknown))
    variables: dict[str, xr.Variable] = {}
    for key, name in names.items():
        if key == FACTOR:
            variables[name] = variable(draws.factor, "1", "factor on the wear coefficient")
            continue
        written = outcome.study.drawn[key]
        values = np.array([plain(written[i]) for i in outcome.which])[draws.run]
        own = outcome.study.spec.unknown[key].unit
        scale, unit = si_unit(own)
        variables[name] = variable(scale * values, unit, key, display_units=own or "1")
    k = np.array([run.coefficient for run in post.histories])[draws.run] * draws.factor
    variables["wear_coefficient"] = variable(
        k, "m2 N-1", "wear coefficient, the largest along the flank at the first state"
    )
    variables["life"] = variable(draws.life, "1", "cycles to the limit")
    rest = np.maximum(draws.life - life_from, 0.0)
    variables["remaining_useful_life"] = variable(rest, "1", "cycles from the last inspection to the limit")
    for number, block in enumerate(post.blocks):
        for spread, values in ((block.sd, draws.sd[number]), (block.drift, draws.drift[number])):
            if spread is not None and spread.prior is not None:
                about = "standard error of a value" if spread is block.sd else "drift within a million cycles"
                variables[spread.name] = variable(
                    values, block.data.si, about, display_units=display_of(block)
                )
    return xr.Dataset(variables, draws_of(len(draws)))


def _some(outcome: UpdateOutcome, values: int) -> Draws:
    """Return as many draws as can be kept with so many values each."""
    count = max(min(len(outcome.draws), MOST_VALUES // max(values, 1)), 1)
    d = outcome.draws
    return Draws(
        d.run[:count],
        d.factor[:count],
        tuple(x[:count] for x in d.sd),
        tuple(x[:count] for x in d.drift),
        d.life[:count],
    )


def replicas(outcome: UpdateOutcome, number: int, rng: np.random.Generator) -> xr.Dataset:
    """Return measurements of a block as they could have come out, of every draw; of fewer for very many."""
    block, name = outcome.posterior.blocks[number], name_of(outcome, number)
    draws = _some(outcome, max(len(each.rows) for each in outcome.posterior.blocks))
    values = replicated(outcome.posterior, draws, number, rng)
    about = "measurements as they could have come out"
    data = variable(
        values, block.data.si, about, (*CHAIN, f"observation_{name}"), display_units=display_of(block)
    )
    return xr.Dataset({name: data}, draws_of(len(draws)))


def pointwise(outcome: UpdateOutcome, number: int) -> xr.Dataset:
    """Return the log likelihood of each inspection given those before it; their sum is that of the block."""
    post, name = outcome.posterior, name_of(outcome, number)
    block = post.blocks[number]
    times = inspections_of(block, post.histories[0], number)
    coords = draws_of(len(outcome.draws))
    if len(times) > 500:
        values = np.empty(len(outcome.draws))
        for i in np.unique(outcome.draws.run):
            mine = outcome.draws.of_run(int(i))
            for some in np.array_split(mine, max(len(mine) * len(block.rows) // MOST_VALUES, 1)):
                values[some] = log_likelihood(
                    block,
                    post.histories[int(i)],
                    number,
                    outcome.draws.lanes(number, some),
                ).log_likelihood
        about = "log likelihood of all its values together"
        return xr.Dataset({name: variable(values, "1", about)}, coords)
    steps = surprises(post, outcome.draws, number)
    values = np.stack([step.log_likelihood for step in steps], axis=-1)
    about = "log likelihood of an inspection given those before it"
    dim = f"inspection_{name}"
    coords[f"cycle_{name}"] = xr.Variable(dim, [t.cycle for t in times], INSPECTED)
    return xr.Dataset({name: variable(values, "1", about, (*CHAIN, dim))}, coords)
