"""Steps that end where contact changes: parts of the steps of a grid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.between import TablesWithin
from wearlab.mesh.stages import StageGrid

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class Pieces:
    """Steps that end where contact changes, and what they are parts of.

    Parameters
    ----------
    step : (n_steps,) a step of the grid that was solved on, the first of equal ones
    begin, end : (n_steps,) where a piece begins and ends, from the begin of that step [steps]
    """

    step: Index
    begin: Array
    end: Array

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

    pieces: Pieces
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
