"""A wear rate that keeps the states it was asked for, so that steps taken again need not ask anew."""

import numpy as np

from wearlab.arrays import Array
from wearlab.life.coupling import Coupling
from wearlab.life.history import SetRate
from wearlab.life.state import Wear, WearState

ROUNDING = 1e-15
"""Of depths, over the deepest: a hundred-millionth of what derivatives move them by."""


class RecordedRate(SetRate):
    """The wear rate of all flanks, and every state in which it was evaluated.

    Parameters
    ----------
    coupling : contact, dynamics and wear of the gear set
    wear : of every kind of mesh at cycle 0, whose state is evaluated in full [m]
    """

    def __init__(self, coupling: Coupling, wear: Wear) -> None:
        super().__init__(coupling)
        first = coupling.evaluate(wear)
        self.states: list[tuple[Array, WearState]] = [(coupling.flat(wear), first)]
        self.responses = first.responses

    def evaluate(self, depth: Array) -> WearState:
        """Return the state at depths (n_entries,), from the last orbits."""
        state, same = self.nearest(depth)
        if not (same and len(self.states) == 1):
            state = super().evaluate(depth)
            self.states.append((np.array(depth), state))
        return state

    def nearest(self, depth: Array) -> tuple[WearState, bool]:
        """Return the state kept nearest to depths (n_entries,), and whether only rounding lies between."""
        apart = [float(np.abs(known - depth).max(initial=0.0)) for known, _ in self.states]
        nearest = int(np.argmin(apart))
        rounding = ROUNDING * float(np.abs(depth).max(initial=0.0))
        return self.states[nearest][1], apart[nearest] <= rounding
