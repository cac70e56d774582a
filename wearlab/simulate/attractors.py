"""Other attractors of the stored states: looked for there alone, never while wear is stepped."""

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.coexisting import coexisting
from wearlab.dynamics.periodic import Periodic
from wearlab.dynamics.response import Response, step_forces
from wearlab.life.state import WearState
from wearlab.scene.build import Parts

Array = NDArray[np.float64]
Values = dict[str, Any]


def other_attractors(parts: Parts, states: Sequence[WearState]) -> list[Response | None]:
    """Return another attractor of each state, None where released flanks return to the response stored.

    The methods of the papers march from one start alone, and so do errors that turn with their members;
    among the angles of averaged errors nothing is looked for, nor in sets of several meshes, where a march of
    hundreds of periods costs more than a whole life.
    """
    vibration = parts.vibration
    if vibration is None or vibration.hunting > 1 or not isinstance(vibration.method, Periodic):
        return []
    if vibration.slow is not None or len(parts.meshes) > 1:
        return []
    clock, account = time.perf_counter(), parts.coupling.account
    found = [_other(state.response, vibration.method) for state in states]
    account.seconds["dynamics"] += time.perf_counter() - clock
    account.counts["period_maps"] += sum(one.counts.period_maps for one in found if one is not None)
    return found


def _other(response: Response | None, method: Periodic) -> Response | None:
    return None if response is None else coexisting(response, method)


def attractor_values(others: Sequence[Response | None]) -> Values:
    """Return period, largest multiplier and range of force of the other attractors, when there is one."""
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
    force = step_forces(other).elastic
    largest = float(abs(other.multipliers[0])) if len(other.multipliers) else np.nan
    over = (0, 1, 2)
    return np.concatenate([[float(other.period), largest], force.min(axis=over), force.max(axis=over)])
