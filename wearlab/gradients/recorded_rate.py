"""A wear rate that records the states it is evaluated in."""

import numpy as np

from wearlab.arrays import Array
from wearlab.life import coupled, history
from wearlab.life.coupling import Coupling

ROUNDING = 1e-15
"""Of depths, over the deepest: a hundred-millionth of what derivatives move them by."""


class RecordedRate(history.SetRate):
    """The wear rate of all flanks, and every state in which it was evaluated.

    Parameters
    ----------
    coupling : contact, dynamics and wear of the gear set
    wear : of every kind of mesh at cycle 0, whose state is evaluated in full [m]
    """

    def __init__(self, coupling: Coupling, wear: coupled.Wear) -> None:
        super().__init__(coupling)
        first = coupling.evaluate(wear)
        begun = coupling.flat(wear)
        self.states = [(begun, first)]
        self.note(begun, first)

    def evaluate(self, depth: Array) -> coupled.WearState:
        """Return the state at depths (n_entries,), from the last orbits."""
        state, is_same = self.nearest(depth)
        if is_same and len(self.states) == 1:
            return state
        state = super().evaluate(depth)
        self.states.append((np.array(depth), state))
        return state

    def nearest(self, depth: Array) -> tuple[coupled.WearState, bool]:
        """Return the recorded state nearest to depths, and whether it is the same.

        It is the same if only rounding lies between.

        Parameters
        ----------
        depth : (n_entries,) [m]
        """
        distances = [
            float(np.abs(recorded - depth).max(initial=0.0))
            for recorded, _ in self.states
        ]
        nearest = int(np.argmin(distances))
        rounding = ROUNDING * float(np.abs(depth).max(initial=0.0))
        return self.states[nearest][1], distances[nearest] <= rounding
