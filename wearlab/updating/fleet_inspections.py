"""Every inspection of a fleet as it was foreseen, beside simple rules."""

from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from wearlab.arrays import Array, Random
from wearlab.updating import layout, sampling
from wearlab.updating.fleet_members import FleetMember
from wearlab.updating.population import Population
from wearlab.updating.scores import truths_inside
from wearlab.updating.unit_states import (
    States,
    UnitState,
    inspections_of_block,
    states_after,
)

IN_SI = ("value", "crps", "foreseen", "by_the_rate", "by_a_line")


def inspection_table(fleet: Population, blanks: States, rng: Random) -> xr.Dataset:
    """Return every inspection that is foreseen, beside two simple rules.

    They are foreseen by what those before and the other units tell. The rules are the
    others' median rate between inspections, and a line through the origin.

    Parameters
    ----------
    fleet : what is known of all units
    blanks : states of the units by what is known of the others alone
    rng : of the draws
    """
    rows: list[dict[str, Any]] = []
    for number, unit in enumerate(fleet.units):
        for block in unit.whole:
            if len(unit.blocks[block].rows):
                rows += _rows_of_block(fleet, number, block, blanks[number], rng)
    if not rows:
        return xr.Dataset()

    columns = layout.stacked(rows)
    columns["first"] = _first_of_blocks(columns)
    columns["flagged"] = columns["check_p"] < sampling.ALARM / len(rows)
    columns |= _simple_rules(columns)
    del columns["begin"]
    main_block = int(np.bincount(columns["block"]).argmax())
    si = {"units": fleet.units[0].blocks[main_block].data.si}
    labelled = {
        name: layout.variable("fleet", name, values, **(si if name in IN_SI else {}))
        for name, values in columns.items()
    }
    return layout.dataset("fleet", labelled, quantile=layout.P)


def _rows_of_block(
    fleet: Population, number: int, block: int, blank: UnitState, rng: Random
) -> list[dict[str, Any]]:
    """Return the inspections of a unit's block, each as it was foreseen."""
    unit = fleet.units[number]
    inspections = inspections_of_block(unit, block)
    first_cycle = inspections[0][0]
    nothing_before = not len(replace(unit, foreseen=block).up_to(first_cycle).cycles)

    # at the very first inspection of a unit the others alone tell what to expect
    states = [blank] if nothing_before else []
    later = [cycle for cycle, *_ in inspections[len(states) :]]
    if later:
        states += states_after(fleet, number, np.array(later), rng, block)

    rows = []
    for state, (cycle, value, count) in zip(states, inspections, strict=True):
        foreseen_state = replace(state, block=block)
        foreseen = foreseen_state.value(cycle, layout.P)
        is_seen = np.isfinite(value)
        p = foreseen_state.two_sided_p(cycle, value, count) if is_seen else np.nan
        crps = foreseen_state.crps(cycle, value, rng) if is_seen else np.nan
        row: dict[str, Any] = {
            "unit_name": unit.name,
            "block": block,
            "cycle": cycle,
            "begin": unit.run.new_cycle,
            "value": value,
            "what": _block_label(unit, block),
            "against": _compared_label(state, unit, block),
            "foreseen": foreseen,
            "check_p": p,
            "crps": crps,
            "higher": value > foreseen[2],
        }
        rows.append(row)
    return rows


def _compared_label(state: UnitState, unit: FleetMember, block: int) -> str:
    """Return with what other block an inspection is compared, "" where with none."""
    if not len(state.unit.cycles) or state.block in (None, block):
        return ""
    return _block_label(unit, state.block)


def _block_label(unit: FleetMember, number: int | None) -> str:
    """Return how messages call what a block measures.

    Nothing where the unit was not measured otherwise.
    """
    assert number is not None
    data = unit.blocks[number].data
    several = sum(len(block.observed) > 0 for block in unit.blocks) > 1
    return f"{data.label.replace('_', ' ')} ({data.file.name})" if several else ""


def _first_of_blocks(columns: dict[str, Array]) -> Array:
    """Return which inspections are the first of a unit's block."""
    block = columns["block"]
    names = columns["unit_name"]
    return np.append(True, (names[1:] != names[:-1]) | (block[1:] != block[:-1]))


def _simple_rules(columns: dict[str, Array]) -> dict[str, Array]:
    """Return what simple rules foresee of each inspection."""
    cycle = columns["cycle"]
    value = columns["value"]
    block = columns["block"]
    names = columns["unit_name"]
    first = columns["first"]
    begin = columns["begin"]
    previous_cycle = np.where(first, begin, np.roll(cycle, 1))
    worn = np.where(first, 0.0, np.roll(value, 1))

    elapsed = cycle - previous_cycle
    with np.errstate(divide="ignore", invalid="ignore"):
        pace = (value - worn) / elapsed
        age = previous_cycle - begin
        line = np.where(age > 0.0, worn / age, np.nan)
    rate = np.full(len(cycle), np.nan)
    for k, name in enumerate(names):
        of_others = (names != name) & (block == block[k]) & np.isfinite(pace)
        if of_others.any():
            rate[k] = np.median(pace[of_others])
    return {
        "by_a_line": line * (cycle - begin),
        "by_the_rate": np.where(first, np.nan, worn + rate * elapsed),
    }


def inspection_scores(rows: xr.Dataset) -> dict[str, float]:
    """Return how what was foreseen did, beside two simple rules.

    Parameters
    ----------
    rows : as `inspection_table` returns them
    """
    if not rows:
        return {}
    # averages over several blocks would mix quantities
    block = rows["block"].values
    in_main_block = block == np.bincount(block).argmax()
    is_seen = np.isfinite(rows["value"].values)
    scored = rows.isel(observation=in_main_block & ~rows["first"].values & is_seen)
    value = scored["value"].values
    if not len(value):
        return {}

    quantiles = scored["foreseen"].values.T
    forecasts = {
        "mean_error": quantiles[2],
        "error_of_rate": scored["by_the_rate"],
        "error_of_line": scored["by_a_line"],
    }
    scores = {
        "replay_count": float(len(value)),
        "replay_crps": float(np.nanmean(scored["crps"])),
    }
    for name, forecast in forecasts.items():
        off = np.abs(np.asarray(forecast) - value)
        scores[f"replay_{name}"] = float(np.nanmean(off))
    return scores | truths_inside(quantiles, value)
