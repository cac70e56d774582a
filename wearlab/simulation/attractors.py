"""Other attractors of the stored states: looked for there alone, never while wear is stepped."""

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.coexisting import FURTHER, RELEASES, Search, Tries, coexisting
from wearlab.dynamics.extremes import extremes
from wearlab.dynamics.periodic import Periodic
from wearlab.dynamics.response import Response
from wearlab.life.state import WearState
from wearlab.scene.build import Parts
from wearlab.simulation.work import most_searched

Values = dict[str, Any]


def other_attractors(parts: Parts, states: Sequence[WearState]) -> list[Search]:
    """Look for another attractor of each state, where released flanks do not return to the response stored.

    The methods of the papers march from one start alone, and so do errors that turn with their members;
    among the angles of averaged errors nothing is looked for, nor in sets of several meshes, where a march of
    hundreds of periods costs more than a whole life. The bound on the work is shared by the states; what one
    leaves over is the next ones'. States of a life are alike: each tries other releases than those before it,
    and what one has found is looked for in the next, and then in the one before.
    """
    vibration = parts.vibration
    if vibration is None or vibration.hunting > 1 or not isinstance(vibration.method, Periodic):
        return []
    if vibration.slow is not None or len(parts.meshes) > 1:
        return []
    clock, account = time.perf_counter(), parts.coupling.account
    wholes = [
        None
        if state.response is None
        else vibration.on_all_stages(state.response, parts.coupling.touching(state))
        for state in states
    ]
    searches = _searches(wholes, vibration.method, most_searched(vibration.system))
    account.seconds["dynamics"] += time.perf_counter() - clock
    account.counts["period_maps"] += sum(search.periods for search in searches)
    return searches


def _searches(responses: Sequence[Response | None], method: Periodic, left: int) -> list[Search]:
    """Search one state after another with ``left`` integration steps, then back."""
    searches: list[Search] = []
    rival, first = None, 0
    for number, response in enumerate(responses):
        search = Search()
        if response is not None:
            tries = Tries(FURTHER if first else RELEASES, first, rival)
            search = coexisting(response, method, max(left // (len(responses) - number), 0), tries)
            left -= search.periods * len(response.tables.width)
        rival, first = search.rival, first + search.starts
        searches.append(search)
    for number in reversed(range(len(searches) - 1)):
        response, search, rival = responses[number], searches[number], searches[number + 1].rival
        if response is not None and search.rival is None and rival is not None:
            again = coexisting(response, method, max(left, 0), Tries(0, 0, rival))
            left -= again.periods * len(response.tables.width)
            if again.rival is not None:
                searches[number] = again._replace(
                    starts=search.starts, periods=search.periods + again.periods
                )
    return searches


def attractor_values(searches: Sequence[Search]) -> Values:
    """Return what was searched, and period, largest multiplier and range of force of the attractors found."""
    if not searches:
        return {}
    values: Values = {
        "attractor_search": [searched(search) for search in searches],
        "count_attractor_starts": sum(search.starts for search in searches),
        "count_attractor_periods": sum(search.periods for search in searches),
    }
    return values | _values_of([search.rival for search in searches])


def searched(search: Search) -> str:
    """Return in words what a search came to."""
    if search.rival is not None:
        return "another found"
    if search.cut_off:
        return "cut off"
    return "none found" if search.starts else "not looked for"


def _values_of(others: Sequence[Response | None]) -> Values:
    if not any(other is not None for other in others):
        return {}
    meshes = next(len(other.system.direction) for other in others if other is not None)
    rows = np.array(
        [np.full(2 + 2 * meshes, np.nan) if other is None else _described(other) for other in others]
    )
    return {
        "coexisting_period": rows[:, 0],
        "coexisting_multiplier": rows[:, 1],
        "coexisting_force_min": rows[:, 2 : 2 + meshes],
        "coexisting_force_max": rows[:, 2 + meshes :],
    }


def _described(other: Response) -> Array:
    """Return period, largest multiplier, and the smallest and largest force of every mesh."""
    described = extremes(other)
    largest = float(abs(other.multipliers[0])) if len(other.multipliers) else np.nan
    return np.concatenate([[float(other.period), largest], described.least, described.largest])
