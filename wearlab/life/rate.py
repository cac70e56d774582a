"""A wear rate that is counted, bounded and checked; and can be put back where it was."""

from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.life.limits import OutOfEvaluations, StopWear
from wearlab.life.runge_kutta import Rate


class CountedRate:
    """``rate(h)`` with a count and checks.

    A rate may have more: ``work``, the ``noise`` of the last one, a rate under the ``still`` load; a memory
    (the last orbits), which a rejected step must not leave on another branch: ``remember()``,
    ``recall(memory)`` and what it holds by identity, ``shared``; and an account of work that another process
    may have done in part: ``accounted()``, ``account_for(done)``.

    Parameters
    ----------
    rate : h (n,) [m] -> dh/dN (n,) [m per cycle], ≥ 0; raises StopWear when the gears can no longer run
    most : bound on the evaluations
    most_work : bound on the work they take, where the rate counts it

    Raises
    ------
    OutOfEvaluations
        When a bound is reached.
    StopWear
        When the rate says so, or is not finite.
    """

    def __init__(self, rate: Rate, most: int, most_work: float = np.inf) -> None:
        self.rate, self.most, self.count = rate, most, 0
        self.first_work, self.most_work = self.work, self.work + most_work

    def __call__(self, h: Array) -> Array:
        """Return the rate at h, (n,) [m per cycle]."""
        if self.count >= self.most:
            raise OutOfEvaluations("evaluation limit")
        if self.work >= self.most_work:
            raise OutOfEvaluations("work limit")
        self.count += 1
        r = np.asarray(self.rate(h), float)
        if r.shape != h.shape:
            raise ValueError(f"wear rate of shape {r.shape} for depths of shape {h.shape}")
        if not np.all(np.isfinite(r)):
            raise StopWear("wear rate not finite")
        if r.size and r.min() < 0.0:
            raise ValueError(f"wear rate {r.min():.3g} m per cycle is negative: wear cannot refill a flank")
        return r

    @property
    def work(self) -> float:
        """Work done so far, 0 unless the rate says otherwise."""
        return float(getattr(self.rate, "work", 0.0))

    @property
    def share_of_work(self) -> float:
        """Share of the evaluations or of the work allowed that is done, the larger of both [1]."""
        work = (self.work - self.first_work) / (self.most_work - self.first_work)
        return max(work, self.count / self.most)

    def grant(self, share: float) -> None:
        """Allow more work, a share of all that was allowed."""
        self.most_work += share * (self.most_work - self.first_work)

    def affords(self, each: float) -> float:
        """Return how many more evaluations the bounds allow of which each takes so much work."""
        return min((self.most_work - self.work) / each, float(self.most - self.count))

    @property
    def noise(self) -> float:
        """Standard error of the last rate, 0 unless the rate says otherwise [m per cycle]."""
        return float(getattr(self.rate, "noise", 0.0))

    @property
    def still(self) -> Rate | None:
        """The rate under the static load, cheap and smooth beside it; None where there is none."""
        return getattr(self.rate, "still", None)

    @property
    def shared(self) -> tuple[Any, ...]:
        """Objects of the rate that are told apart by identity, none unless it says otherwise."""
        return tuple(getattr(self.rate, "shared", ()))

    def put_down(self) -> tuple[int, Any, Any]:
        """Return evaluations, account and memory, to be taken up by another process."""
        return self.count, self._asked("accounted"), self.remember()

    def take_up(self, kept: tuple[int, Any, Any]) -> None:
        """Go on counting, and remembering, from where another process put it down."""
        self.count, done, memory = kept
        self._asked("account_for", done)
        self.recall(memory)

    def remember(self) -> Any:
        """Return the rate's memory, None when it has none."""
        return self._asked("remember")

    def recall(self, memory: Any) -> None:
        """Put the rate's memory back."""
        self._asked("recall", memory)

    def _asked(self, name: str, *given: Any) -> Any:
        """Return what the rate answers, None where it does not know the question."""
        answer = getattr(self.rate, name, None)
        return None if answer is None else answer(*given)
