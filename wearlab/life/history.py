"""A life of one pair of flanks: march the wear, then evaluate in full every state that is kept."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.response import Response
from wearlab.life.limits import Limits, Snapshots, StopWear
from wearlab.life.march import Life, Method, evolve
from wearlab.life.state import Coupling, WearState
from wearlab.life.step import Node
from wearlab.life.worn import worn

Array = NDArray[np.float64]

MOST_EVALUATIONS = 5_000
"""Bound on the rates of one life at a tolerance of 1e-3; an ordinary life takes about a hundred."""


Memory = tuple[Response | None, float]


class History(NamedTuple):
    """The kept wear states of a life.

    Parameters
    ----------
    cycle : (m,) cycles of the kept states [1]
    state : the states, each in full
    life : the march that led through them, None when nothing wears on
    worn_first : the marches that made the initial wear
    """

    cycle: Array
    state: tuple[WearState, ...]
    life: Life | None
    worn_first: tuple[Life, ...] = ()


class PairRate:
    """The wear rate of both flanks as the march sees it: flat, and with the last orbit as its memory.

    Parameters
    ----------
    coupling : contact, dynamics and wear of the pair
    """

    def __init__(self, coupling: Coupling) -> None:
        self.coupling = coupling
        self.response: Response | None = None
        self.noise = 0.0

    def __call__(self, depth: Array) -> Array:
        """Return the wear per cycle at depths (2 n,), both (2 n,) [m]."""
        state = self.coupling.evaluate(depth.reshape(2, -1), self.response)
        if state.rate is None:
            raise ValueError("a scene without a wear law has no wear rate")
        self.response, self.noise = state.response, state.noise
        return state.rate.ravel()

    def remember(self) -> Memory:
        """Return the last orbit, and the noise of its rate."""
        return self.response, self.noise

    def recall(self, memory: Memory) -> None:
        """Put an earlier orbit back."""
        self.response, self.noise = memory


def single_state(coupling: Coupling, wear: Array) -> History:
    """Return the history of a scene in which nothing wears on: its one state, for wear (2, n) [m]."""
    return History(np.zeros(1), (coupling.evaluate(wear),), None)


def worn_by_law(
    coupling: Coupling, wear: Array, depths: dict[int, float], *, tolerance: float
) -> tuple[Array, tuple[Life, ...]]:
    """Return wear (2, n) [m] with each named flank (0 driving, 1 driven) worn to its depth by this law."""
    n = wear.shape[1]
    flanks = {gear: (slice(gear * n, (gear + 1) * n), depth) for gear, depth in depths.items()}
    flat, lives = worn(PairRate(coupling), wear.ravel(), flanks, tolerance=tolerance)
    return flat.reshape(2, -1), lives


def history(
    coupling: Coupling,
    wear: Array,
    *,
    limits: Limits,
    method: Method,
    snapshots: Snapshots,
    tolerance: float,
    progress: Callable[[Node], None] | None = None,
) -> History:
    """March the wear of a pair to its limit and evaluate every kept state.

    Parameters
    ----------
    coupling : contact, dynamics and wear of the pair
    wear : (2, n) wear depth at cycle 0, (driving, driven) [m]
    limits, method, snapshots, tolerance, progress : see :func:`wearlab.life.march.evolve`

    Notes
    -----
    A kept state starts from the orbit at the last accepted state before it, so that asking for further
    snapshots changes none of the others.
    """
    rate = PairRate(coupling)
    rate.response = coupling.evaluate(wear).response
    anchors: list[tuple[float, Response | None]] = [(-np.inf, rate.response)]

    def accepted(node: Node) -> None:
        anchors.append((node.cycle, rate.response))
        if progress is not None:
            progress(node)

    life = evolve(
        rate,
        wear.ravel(),
        limits=limits,
        method=method,
        snapshots=snapshots,
        tolerance=tolerance,
        progress=accepted,
        most_evaluations=int(MOST_EVALUATIONS * max(1.0, (1e-3 / tolerance) ** 0.5)),
    )
    cycles, depths = life.updates()
    states = [
        _in_full(coupling, depth.reshape(2, -1), _orbit_before(anchors, cycle))
        for cycle, depth in zip(cycles, depths, strict=True)
    ]
    kept = [i for i, state in enumerate(states) if state is not None]
    return History(cycles[kept], tuple(state for state in states if state is not None), life)


def _orbit_before(anchors: list[tuple[float, Response | None]], cycle: float) -> Response | None:
    return [orbit for reached, orbit in anchors if reached < cycle][-1]


def _in_full(coupling: Coupling, wear: Array, start: Response | None) -> WearState | None:
    """Return the state, or None when the gears can no longer run in it (it ended the life)."""
    try:
        return coupling.evaluate(wear, start)
    except StopWear:
        return None
