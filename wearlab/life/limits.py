"""The limits of a life, its snapshots, and its wear rate with count and checks."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array, Index

Rate = Callable[[Array], Array]
"""Depths h (n,) [m] to dh/dN (n,) [m per cycle]."""
Flanks = slice | Index
"""Which of the flanks, along their axis."""

EVERYWHERE = slice(None)
LANDED = 1e-10


class Ended(Exception):
    """A life cannot go on; carries the reason.

    Parameters
    ----------
    reason : for instance "section vanished" or "unbounded motion"; or one of
        `ENDS_OF_WORK`
    detail : the reason in a sentence with its numbers, "" where there are none
    """

    def __init__(self, reason: str, detail: str = "") -> None:
        super().__init__(reason)
        self.reason = reason
        self.detail = detail


class StopWear(Ended):
    """Raised by a rate when the worn gears can no longer run.

    Carries the physical reason.
    """


class OutOfEvaluations(Ended):
    """A bound on the work of a life is reached; carries which."""


TOO_WARM = "temperature"
"""End of a life whose teeth would become warmer than is known, or allowed."""
WORN_OUT = "depth"
"""End of a life that reached its depth limit."""
ALL_CYCLES = "cycles"
"""End of a life that ran all its cycles."""
ENDS_OF_WORK = ("evaluation limit", "work limit")
"""Ends of a life whose bound on its rates, or on the right-hand sides they take, was
reached before."""


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

    def reached(self, cycle: float, depth: Array) -> str:
        """Return which limit a state, (n,) [m], has reached; an empty text: none.

        Parameters
        ----------
        cycle : of the state [1]
        depth : (n,) its depth [m]
        """
        if self.depth is not None and depth[self.flank].max() >= self.depth * (
            1.0 - LANDED
        ):
            return WORN_OUT
        return (
            ALL_CYCLES
            if self.cycles is not None and cycle >= self.cycles * (1.0 - 1e-14)
            else ""
        )

    def checked(self) -> "Limits":
        """Return the limits; ValueError when there is none or one is not positive."""
        limits = [limit for limit in (self.cycles, self.depth) if limit is not None]
        if not limits:
            raise ValueError("a life needs a limit: cycles or depth")
        if not all(np.isfinite(limit) and limit > 0.0 for limit in limits):
            raise ValueError(
                f"limits of a life must be positive and finite, not {limits}"
            )
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


class CountedRate:
    """``rate(h)`` with a count and checks.

    A rate may have more: ``work``, the ``noise`` of the last one, a rate under the
    ``still`` load, cheap and smooth beside it; a memory (the last orbits), which a
    rejected step must not leave on another branch: ``remember()``, ``recall(memory)``
    and what it holds by identity, ``shared``; what it changes when a state is accepted,
    ``accept(h)``; and an account of work that another
    process may have done in part: ``accounted()``, ``account_for(done)``.

    Parameters
    ----------
    rate : h (n,) [m] -> dh/dN (n,) [m per cycle], ≥ 0; raises StopWear when the gears
        can no longer run
    most : bound on the evaluations
    max_work : bound on the work they take, where the rate counts it

    Raises
    ------
    OutOfEvaluations
        When a bound is reached.
    StopWear
        When the rate says so, or is not finite.
    """

    def __init__(
        self, rate: Rate, max_evaluations: int, max_work: float = np.inf
    ) -> None:
        self.rate = rate
        self.max_evaluations = max_evaluations
        self.count = 0
        self.still: Rate | None = getattr(rate, "still", None)
        self.shared = tuple(getattr(rate, "shared", ()))
        self.first_work = self.work
        self.max_work = self.work + max_work

    def __call__(self, h: Array) -> Array:
        """Return the rate at h, (n,) [m per cycle]."""
        if self.count >= self.max_evaluations:
            raise OutOfEvaluations("evaluation limit")
        if self.work >= self.max_work:
            raise OutOfEvaluations("work limit")
        self.count += 1
        r = np.asarray(self.rate(h), float)
        if r.shape != h.shape:
            raise ValueError(
                f"wear rate of shape {r.shape} for depths of shape {h.shape}"
            )
        if not np.all(np.isfinite(r)):
            raise StopWear("wear rate not finite")
        if r.size and r.min() < 0.0:
            raise ValueError(
                f"wear rate {r.min():.3g} m per cycle is negative: wear cannot refill "
                "a flank"
            )
        return r

    @property
    def work(self) -> float:
        """Work done so far, 0 unless the rate says otherwise."""
        return float(getattr(self.rate, "work", 0.0))

    def grant(self, share: float) -> None:
        """Allow more work, a share of all that was allowed.

        Parameters
        ----------
        share : of all the work that was allowed [1]
        """
        self.max_work += share * (self.max_work - self.first_work)

    @property
    def noise(self) -> float:
        """Standard error of the last rate, 0 unless the rate has one [m per cycle]."""
        return float(getattr(self.rate, "noise", 0.0))

    def save_state(self) -> tuple[int, Any, Any]:
        """Return evaluations, account and memory, to be taken up by another process."""
        return self.count, self._asked("accounted"), self.remember()

    def restore(self, state: tuple[int, Any, Any]) -> None:
        """Go on counting, and remembering, from where another process put it down."""
        self.count, account, memory = state
        self._asked("account_for", account)
        self.recall(memory)

    def accept(self, h: Array) -> None:
        """Tell the rate that the state of its last evaluation was accepted, at h [m].

        Parameters
        ----------
        h : (n,) depths of that state
        """
        self._asked("accept", h)

    def remember(self) -> Any:
        """Return the rate's memory, None when it has none."""
        return self._asked("remember")

    def recall(self, memory: Any) -> None:
        """Put the rate's memory back."""
        self._asked("recall", memory)

    def _asked(self, name: str, *arguments: Any) -> Any:
        """Return what the rate answers, None where it does not know the question."""
        answer = getattr(self.rate, name, None)
        return None if answer is None else answer(*arguments)
