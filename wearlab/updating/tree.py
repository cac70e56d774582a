"""An update as a tree of datasets in ArviZ's layout."""

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearlab import __version__
from wearlab.campaign import Campaign
from wearlab.campaign.update import THICKNESS
from wearlab.schema import VARIABLES
from wearlab.sources import source_hash
from wearlab.units import is_quantity, split
from wearlab.updating.answer import QUANTILES
from wearlab.updating.calibration import calibrated
from wearlab.updating.checking import surprises
from wearlab.updating.draws import Draws
from wearlab.updating.likelihood import Block, inspections_of, log_likelihood
from wearlab.updating.looking import virtual_inspection
from wearlab.updating.outcome import Outcome
from wearlab.updating.posterior import Posterior
from wearlab.updating.predicting import over_cycles, replicated
from wearlab.updating.replay import replayed
from wearlab.updating.study import FACTOR

Array = NDArray[np.float64]
PLACES = 121  # cycles at which the wear is predicted
AHEAD = 1.25  # times the 95 % quantile of the life up to which it is
MOST_VALUES = 2_000_000  # of a variable with a value for each draw and observation
P = np.array(QUANTILES)
CHAIN = ("chain", "draw")
LIFE = {"units": "1", "display_units": "1"}


def tree_of(campaign: Campaign, outcomes: Sequence[Outcome], *, replay: bool, check: int) -> xr.DataTree:
    """Return the tree of an update; several cases stand along the dimension ``case``.

    Parameters
    ----------
    campaign : what was asked
    outcomes : case by case
    replay : also the answers as after every inspection
    check : number of twins that calibrate the study
    """
    each = [_groups(one, replay, check) for one in outcomes]
    names = list(dict.fromkeys(name for groups in each for name in groups))
    if len(each) == 1:
        joined = each[0]
    else:
        labels = xr.Variable("case", [one.study.label for one in outcomes])
        joined = {
            name: xr.concat(
                [groups.get(name, xr.Dataset()) for groups in each],
                dim="case",
                join="outer",
                data_vars="all",
                coords="minimal",
                compat="override",
                combine_attrs="override",
            ).assign_coords(case=labels)
            for name in names
        }
    root = xr.Dataset(attrs=_attributes(campaign, outcomes))
    return xr.DataTree.from_dict({"/": root, **{f"/{name}": one for name, one in joined.items()}})


def _attributes(campaign: Campaign, outcomes: Sequence[Outcome]) -> dict[str, Any]:
    spec = outcomes[0].study.spec
    return {
        "title": campaign.title,
        "references": campaign.reference or "",
        "created_at": datetime.now(UTC).isoformat(timespec="seconds"),
        "date_created": datetime.now(UTC).isoformat(timespec="seconds"),
        "inference_library": "wearlab",
        "inference_library_version": __version__,
        "wearlab_version": __version__,
        "source_hash": source_hash(),
        "discrepancy": spec.discrepancy,
        "seed": spec.seed,
        "Conventions": "CF-1.11, ACDD-1.3",
        **{f"notes_{n}": " | ".join(one.notes) for n, one in enumerate(outcomes) if one.notes},
    }


def _groups(one: Outcome, replay: bool, check: int) -> dict[str, xr.Dataset]:
    rng = np.random.default_rng([one.study.spec.seed, 1])
    post = one.posterior
    found = {
        "posterior": _sample(one, post, one.draws, life_from=one.answer.now),
        "prior": _sample(one, one.prior.posterior, one.prior_draws, life_from=one.answer.now),
        "predictions": _predictions(one, rng),
        "observed_data": _observed(one),
        "sample_stats": _stats(one),
    }
    told = [n for n, block in enumerate(post.blocks) if len(block.rows)]
    if told:
        found["posterior_predictive"] = xr.merge(
            [_replicas(one, n, rng) for n in told], compat="override", combine_attrs="drop"
        )
        found["log_likelihood"] = xr.merge(
            [_pointwise(one, n) for n in told], compat="override", combine_attrs="drop"
        )
    ahead = virtual_inspection(one, rng)
    if ahead is not None:
        found["virtual_inspection"] = ahead
    if replay:
        again = replayed(one.study, post)
        found["predictions"] = (
            found["predictions"].drop_vars(list(again.data_vars), errors="ignore").merge(again)
        )
    if check:
        found["calibration"] = calibrated(one.study, post, check)
    return found


def names_of(keys: Sequence[str]) -> dict[str, str]:
    """Return what each unknown is called: its last word; by the whole key where two share it."""
    last = [key.rpartition(".")[2] for key in keys]
    return {
        key: word if last.count(word) == 1 else key.replace(".", "_")
        for key, word in zip(keys, last, strict=True)
    }


def _variable(
    values: Any, units: str, long_name: str, dims: tuple[str, ...] = CHAIN, **more: str
) -> xr.Variable:
    data = np.asarray(values, float)
    return xr.Variable(
        dims, data[None] if dims[0] == "chain" else data, {"units": units, "long_name": long_name, **more}
    )


def _sample(one: Outcome, post: Posterior, draws: Draws, life_from: float) -> xr.Dataset:
    names = names_of(list(one.study.spec.unknown))
    found: dict[str, xr.Variable] = {}
    for key, name in names.items():
        if key == FACTOR:
            found[name] = _variable(draws.factor, "1", "factor on the wear coefficient")
            continue
        written = one.study.drawn[key]
        values = np.array([_number(written[i]) for i in one.which])[draws.run]
        found[name] = _variable(values, one.study.spec.unknown[key].unit or "1", key)
    k = np.array([run.coefficient for run in post.histories])[draws.run] * draws.factor
    found["wear_coefficient"] = _variable(
        k, "m2 N-1", "wear coefficient, the largest along the flank at the first state"
    )
    found["life"] = _variable(draws.life, "1", "cycles to the limit")
    rest = np.maximum(draws.life - life_from, 0.0)
    found["remaining_useful_life"] = _variable(rest, "1", "cycles from the last inspection to the limit")
    for number, block in enumerate(post.blocks):
        for spread, values in ((block.sd, draws.sd[number]), (block.drift, draws.drift[number])):
            if spread is not None and spread.prior is not None:
                about = "standard error of a value" if spread is block.sd else "drift within a million cycles"
                found[spread.name] = _variable(values, _si(block), about)
    return xr.Dataset(found, {"chain": [0], "draw": np.arange(len(draws))})


def _number(value: float | str) -> float:
    return float(split(value)[0]) if is_quantity(value) else float(value)


def _si(block: Block) -> str:
    return block.data.si


def _display(block_or_name: Block | str) -> str:
    name = block_or_name if isinstance(block_or_name, str) else block_or_name.data.quantity
    return "um" if name == THICKNESS else VARIABLES[name].display_units


def _predictions(one: Outcome, rng: np.random.Generator) -> xr.Dataset:
    post, answer = one.posterior, one.answer
    life = answer.life(P)
    run = post.histories[0]
    end = life[-1] if np.isfinite(life[-1]) else life[2]
    last = max(
        AHEAD * float(min(end, 4.0 * life[2])) if np.isfinite(end) else run.end, answer.now, run.start + 1.0
    )
    cycles = np.linspace(run.start, last, PLACES)
    along = ("cycle", "quantile")
    hours = run.seconds_per_cycle
    found = {
        "life_quantile": _variable(life, "1", "cycles to the limit", ("quantile",)),
        "remaining_useful_life_quantile": _variable(
            answer.remaining(P), "1", "cycles from the last inspection to the limit", ("quantile",)
        ),
        "factor_quantile": _variable(answer.factor(P), "1", "factor on the wear coefficient", ("quantile",)),
        "prior_life_quantile": _variable(
            one.prior.life(P), "1", "cycles to the limit, before", ("quantile",)
        ),
        "prior_factor_quantile": _variable(
            one.prior.factor(P), "1", "factor on the wear coefficient, before", ("quantile",)
        ),
        "now": xr.Variable((), answer.now, {"units": "1", "long_name": "cycle of the last inspection"}),
        "seconds_per_cycle": xr.Variable((), hours, {"units": "s", "long_name": "operating time of a cycle"}),
        "limit": xr.Variable(
            (),
            run.level,
            {
                "units": VARIABLES[one.study.limit.quantity].units,
                "quantity": one.study.limit.quantity,
                "where": one.study.limit.where or "",
            },
        ),
    }
    quantity = one.study.limit.quantity
    for name in run.beside:
        drifting = answer.drifting if name == quantity else None
        each = over_cycles(post, one.draws, name, cycles, drifting, rng)
        before = over_cycles(one.prior.posterior, one.prior_draws, name, cycles, drifting, rng)
        meta = {"display_units": VARIABLES[name].display_units}
        for prefix, values in (("", each), ("prior_", before)):
            found[f"{prefix}{name}_quantile"] = _variable(
                np.quantile(values, P, axis=1).T,
                VARIABLES[name].units,
                VARIABLES[name].long_name,
                along,
                **meta,
            )
    return xr.Dataset(found, {"quantile": P, "cycle": cycles})


def _observed(one: Outcome) -> xr.Dataset:
    found: dict[str, xr.Variable] = {}
    coords: dict[str, xr.Variable] = {}
    run = one.posterior.histories[0]
    for number, block in enumerate(one.posterior.blocks):
        name, dim = _name(one, number), f"observation_{_name(one, number)}"
        about = {"units": _si(block), "display_units": _display(block), "file": block.data.file.name}
        found[name] = xr.Variable(dim, block.seen.value, about)
        coords[f"cycle_{name}"] = xr.Variable(dim, run.asked[number].cycle, {"units": "1"})
        sd = np.hypot(np.median(one.draws.sd[number]), block.seen.sd)
        sd = np.hypot(sd, block.data.error.relative * np.nan_to_num(block.seen.value))
        found[f"sd_{name}"] = xr.Variable(
            dim, np.hypot(sd, block.data.error.offset_sd), {**about, "long_name": "error, posterior median"}
        )
        if block.seen.censored.any():
            found[f"below_{name}"] = xr.Variable(dim, block.seen.below, about)
        if block.seen.place_kind is not None:
            coords[f"{block.seen.place_kind}_{name}"] = xr.Variable(dim, block.seen.place)
    found["observed_life"] = xr.Variable(
        (), _observed_life(one), {"units": "1", "long_name": "cycle at which the limit was measured"}
    )
    return xr.Dataset(found, coords)


def _observed_life(one: Outcome) -> float:
    """Return the cycle at which measurements of the limit's own quantity reach it, NaN where they do not."""
    limit, run = one.study.limit, one.posterior.histories[0]
    for number, block in enumerate(one.posterior.blocks):
        same = block.data.quantity == limit.quantity and limit.where in (None, block.data.where)
        if not same or block.data.since is not None or block.seen.censored.any():
            continue
        cycle, value = run.asked[number].cycle, block.seen.value
        order = np.argsort(cycle, kind="stable")
        cycle, value = cycle[order], value[order]
        over = np.flatnonzero(value >= limit.value * (1.0 - 1e-9))
        if len(over):
            i = int(over[0])
            if i == 0:
                return float(cycle[0])
            share = (limit.value - value[i - 1]) / (value[i] - value[i - 1])
            return float(cycle[i - 1] + min(share, 1.0) * (cycle[i] - cycle[i - 1]))
    return float("nan")


def _name(one: Outcome, number: int) -> str:
    """Return what the values of a block are called: quantity and place, and its number where two share it."""
    names = [block.name.replace("-", "_") for block in one.posterior.blocks]
    return names[number] if names.count(names[number]) == 1 else f"{names[number]}_{number + 1}"


def _some(one: Outcome, values: int) -> Draws:
    """Return as many draws as can be kept with so many values each."""
    count = max(min(len(one.draws), MOST_VALUES // max(values, 1)), 1)
    d = one.draws
    return Draws(
        d.run[:count],
        d.factor[:count],
        tuple(x[:count] for x in d.sd),
        tuple(x[:count] for x in d.drift),
        d.life[:count],
    )


def _replicas(one: Outcome, number: int, rng: np.random.Generator) -> xr.Dataset:
    block, name = one.posterior.blocks[number], _name(one, number)
    draws = _some(one, len(block.rows))
    values = replicated(one.posterior, draws, number, rng)
    about = "measurements as they could have come out"
    variable = _variable(values, _si(block), about, (*CHAIN, f"observation_{name}"))
    padded = np.full((1, len(one.draws), values.shape[1]), np.nan, np.float32)
    padded[0, : len(draws)] = variable.values[0]
    short = len(draws) < len(one.draws)
    data = xr.Variable(variable.dims, padded if short else variable.values, variable.attrs)
    return xr.Dataset({name: data}, {"chain": [0], "draw": np.arange(len(one.draws))})


def _pointwise(one: Outcome, number: int) -> xr.Dataset:
    """Return the log likelihood of each inspection given those before it; their sum is that of the block."""
    post, name = one.posterior, _name(one, number)
    block = post.blocks[number]
    times = inspections_of(block, post.histories[0], number)
    coords = {"chain": [0], "draw": np.arange(len(one.draws))}
    if len(times) > 500 or block.seen.censored.any():
        values = np.empty(len(one.draws))
        for i in np.unique(one.draws.run):
            mine = one.draws.of_run(int(i))
            for some in np.array_split(mine, max(len(mine) * len(block.rows) // MOST_VALUES, 1)):
                values[some] = log_likelihood(
                    block,
                    post.histories[int(i)],
                    number,
                    one.draws.factor[some],
                    one.draws.sd[number][some],
                    one.draws.drift[number][some],
                ).log_likelihood
        about = "log likelihood of all its values together"
        return xr.Dataset({name: _variable(values, "1", about)}, coords)
    steps = surprises(post, one.draws, number)
    values = np.stack([step.log_likelihood for step in steps], axis=-1)
    about = "log likelihood of an inspection given those before it"
    dim = f"inspection_{name}"
    coords |= {f"cycle_{name}": (dim, [t.cycle for t in times])}
    return xr.Dataset({name: _variable(values, "1", about, (*CHAIN, dim))}, coords)


def _stats(one: Outcome) -> xr.Dataset:
    found: dict[str, Any] = {name: xr.Variable((), value) for name, value in one.stats.items()}
    coords: dict[str, Any] = {}
    for number in range(len(one.posterior.blocks)):
        own = [check for check in one.checks if check.block == number]
        if own:
            name = _name(one, number)
            dim = f"inspection_{name}"
            found[f"check_p_{name}"] = xr.Variable(
                dim,
                [check.p for check in own],
                {"units": "1", "long_name": "probability of values at least as far off"},
            )
            found[f"check_{name}"] = xr.Variable(dim, [check.words for check in own])
            coords[f"cycle_{name}"] = xr.Variable(dim, [check.cycle for check in own])
    weight = one.posterior.weight
    if len(weight) > 1:
        found["run_weight"] = xr.Variable("run", weight, {"long_name": "posterior probability of each run"})
        found["run_id"] = xr.Variable("run", [run.id for run in one.posterior.histories])
    found["notes"] = xr.Variable((), " | ".join(one.notes))
    return xr.Dataset(found, coords)
