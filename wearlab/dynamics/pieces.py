"""Steps that end where contact changes: parts of the steps of a grid."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.dynamics.between import TablesWithin
from wearlab.mesh.stages import StageGrid


@dataclass(frozen=True)
class StepParts:
    """Steps that end where contact changes, and what they are parts of.

    Parameters
    ----------
    place : (n_steps, 4) a step of the grid that was solved on, the first of equal ones; where a piece begins
        and ends, from the begin of that step [steps]; as `wearlab.dynamics.parting_kernel.small_orbit` has it
    """

    place: Array

    @cached_property
    def step(self) -> Index:
        """(n_steps,) a step of the grid that was solved on, the first of equal ones."""
        return self.place[:, 0].astype(np.int64)

    @property
    def begin(self) -> Array:
        """(n_steps,) where a piece begins, from the begin of that step [steps]."""
        return self.place[:, 1]

    @property
    def end(self) -> Array:
        """(n_steps,) where a piece ends, from the begin of that step [steps]."""
        return self.place[:, 2]

    def of(self, grid: StageGrid) -> StageGrid:
        """Return the pieces as steps of the mesh period."""
        width = grid.width[self.step]
        start = grid.start[self.step] + self.begin * width
        return StageGrid(start, (self.end - self.begin) * width, grid.segment[self.step])


@dataclass(frozen=True)
class WithinPieces:
    """What the tables of pieces were taken of, see `wearlab.dynamics.between.TablesWithin`.

    Parameters
    ----------
    pieces : the steps
    whole : what the tables of the steps were taken of that they are parts of
    """

    pieces: StepParts
    whole: TablesWithin

    def errors(self, step: Index, fraction: Array) -> tuple[Array, Array]:
        """Return prescribed errors and their rates by phase [m]."""
        return self.whole.errors(*self._place(step, fraction))

    def springs(self, step: Index, fraction: Array) -> tuple[Array, Array]:
        """Return stiffness [N/m] and gap [m] of all pairs."""
        return self.whole.springs(*self._place(step, fraction))

    def _place(self, step: Index, fraction: Array) -> tuple[Index, Array]:
        begin, end = self.pieces.begin[step], self.pieces.end[step]
        return self.pieces.step[step], begin + fraction * (end - begin)
