"""Units whose sheets contradict each other: what holds if either is right."""

from typing import Any

import numpy as np
import xarray as xr

from wearlab.arrays import Random
from wearlab.updating import layout
from wearlab.updating.cases import Subject, Subjects
from wearlab.updating.fleet_members import FleetMember
from wearlab.updating.population import Population
from wearlab.updating.unit_states import state_of_reading

DOUBTED = (
    0.5  # probability that some sheet has a scale of its own, from which it is told
)
NOT_SHOWN = 0.005  # probability of a reading below which it is left out


def sheet_table(studies: Subjects, fleet: Population, rng: Random) -> xr.Dataset:
    """Return the answers of units by each reading of sheets that contradict each other.

    Nothing where there are none.

    Parameters
    ----------
    studies : the units in service
    fleet : what is known of all units, those in service first
    rng : of the draws
    """
    rows = []
    for number, study in enumerate(studies):
        probability = fleet.reading_probabilities(number)
        if 1.0 - probability[0] < DOUBTED:
            continue
        for reading in range(1, len(probability)):
            if probability[reading] > NOT_SHOWN:
                rows.append(_row(study, fleet, number, reading, rng))
    return layout.joined(rows, "sheet") if rows else xr.Dataset()


def _row(
    study: Subject, fleet: Population, number: int, reading: int, rng: Random
) -> xr.Dataset:
    """Return the answer of a unit if one of its sheets has a scale of its own."""
    unit = fleet.units[number]
    state = state_of_reading(fleet, number, reading, rng)
    days = layout.calendar_of(study, unit.run, unit.now)
    factor = np.quantile(state.factor, layout.P)
    lives = layout.lives(state.lives, factor, unit.run, days, study.spec.today)
    sound = unit.readings[reading].unit
    aside = unit.readings[reading].aside
    assert aside is not None
    row: dict[str, Any] = {
        "unit_name": unit.name,
        "right": _labels(sound),
        "doubted": _labels(aside),
        "probability": float(fleet.reading_probabilities(number)[reading]),
    }
    names = ("life_quantile", "remaining_useful_life_quantile", "factor_quantile")
    row |= {name: lives[name] for name in names}
    row["seconds_per_cycle"] = lives["seconds_per_cycle"]
    no_days = np.array([""] * len(layout.P), dtype=object)
    row["end_of_life_quantile"] = lives.get("end_of_life_quantile", no_days)
    return layout.dataset("sheets", row, quantile=layout.P)


def _labels(unit: FleetMember) -> str:
    """Return how messages call the sheets that count."""
    labels = [
        f"{block.data.label.replace('_', ' ')} ({block.data.file.name})"
        for block in unit.blocks
        if len(block.rows)
    ]
    return " and ".join(dict.fromkeys(labels))
