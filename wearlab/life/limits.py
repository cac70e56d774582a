"""When a life ends, and the states asked for on the way."""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Index

Flanks = slice | Index
"""Which of the flanks, along their axis."""

EVERYWHERE = slice(None)


class StopWear(Exception):
    """Raised by a rate when the worn gears can no longer run; carries the physical reason.

    Parameters
    ----------
    reason : for instance "section vanished" or "unbounded motion"
    """

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


WORN_OUT = "depth"
"""End of a life that reached its depth limit."""
ALL_CYCLES = "cycles"
"""End of a life that ran all its cycles."""
ENDS_OF_WORK = ("evaluation limit", "work limit")
"""Ends of a life whose bound on its rates, or on the right-hand sides they take, was reached before."""


class OutOfEvaluations(Exception):
    """A bound on the work of a life is reached; carries which.

    Parameters
    ----------
    reason : one of `ENDS_OF_WORK`
    """

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


class Limits(NamedTuple):
    """Ends of a life; the first one reached counts.

    Parameters
    ----------
    cycles : last cycle, or None [1]
    depth : largest depth allowed on the flank, or None [m]
    flank : the entries of h that the depth limit looks at
    """

    cycles: float | None = None
    depth: float | None = None
    flank: Flanks = EVERYWHERE

    def checked(self) -> "Limits":
        """Return the limits, or raise ValueError when there is none or one is not positive."""
        given = [limit for limit in (self.cycles, self.depth) if limit is not None]
        if not given:
            raise ValueError("a life needs a limit: cycles or depth")
        if not all(np.isfinite(limit) and limit > 0.0 for limit in given):
            raise ValueError(f"limits of a life must be positive and finite, not {given}")
        return self


class Snapshots(NamedTuple):
    """States asked for on the way; asking changes nothing else.

    Parameters
    ----------
    cycles : cycles of the snapshots
    depths : largest depths on the flank at which to take one [m]
    flank : the entries of h that the depths refer to
    only : whether nothing between is kept, even where none of them is left
    """

    cycles: tuple[float, ...] = ()
    depths: tuple[float, ...] = ()
    flank: Flanks = EVERYWHERE
    only: bool = False

    @property
    def asked(self) -> bool:
        """Whether states were asked for."""
        return bool(self.cycles or self.depths or self.only)
