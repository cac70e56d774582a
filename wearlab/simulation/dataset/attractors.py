"""Other attractors that were found beside the stored responses."""

from collections.abc import Sequence

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.forces.mesh_forces import extremes
from wearlab.dynamics.steady import coexisting
from wearlab.dynamics.steady.response import Response
from wearlab.simulation import label
from wearlab.simulation.attractors import Searched


def attractor_values(searches: Sequence[Searched]) -> label.Values:
    """Return what was searched, and period, multiplier and forces of the attractors.

    Of the worst beside each state, and of all of them along ``rival``.

    Parameters
    ----------
    searches : what the search beside each state came to, () when none was searched
    """
    if not searches:
        return {}
    outcomes = [searched.search for searched in searches]
    values: label.Values = {
        "attractor_search": [outcome(search) for search in outcomes],
        "count_attractor_starts": sum(search.starts for search in outcomes),
        "count_attractor_periods": sum(search.periods for search in outcomes),
    }
    if not any(searched.rivals for searched in searches):
        return values

    by_rival = _values_by_rival(searches)
    for name, of_rivals in by_rival.items():
        values[f"coexisting_{name}"] = of_rivals[..., 0]
    for name, of_rivals in by_rival.items():
        values[f"rival_{name}"] = of_rivals
    return values


def _values_by_rival(searches: Sequence[Searched]) -> dict[str, Array]:
    """Return period, multiplier and forces of all rivals, along the last axis."""
    rows = [[_described(rival) for rival in searched.rivals] for searched in searches]
    width = max(len(description) for row in rows for description in row)
    described = label.padded([np.reshape(row, (-1, width)) for row in rows])

    smallest, largest = np.split(described[..., 2:], 2, axis=-1)
    return {
        "period": described[..., 0],
        "multiplier": described[..., 1],
        "force_min": smallest.transpose(0, 2, 1),
        "force_max": largest.transpose(0, 2, 1),
    }


def outcome(search: coexisting.Search) -> str:
    """Return in words what a search came to.

    Parameters
    ----------
    search : a search beside one state
    """
    if search.rival is not None:
        return "another found"
    if search.cut_off:
        return "cut off"
    return "none found" if search.starts else "not looked for"


def _described(rival: Response) -> Array:
    """Return period, largest multiplier, smallest and largest force of every mesh."""
    forces = extremes(rival)
    multiplier = float(abs(rival.multipliers[0])) if len(rival.multipliers) else np.nan
    first = [float(rival.period), multiplier]
    return np.concatenate([first, forces.least, forces.largest])
