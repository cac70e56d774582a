"""Which states of a life are kept in full: those asked for, others as far as their work
is paid for.
"""

from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from wearlab.life.adaptive import Adaptive
from wearlab.life.coupled import StartingPoint
from wearlab.life.history import halving, history
from wearlab.life.integrate import integrate
from wearlab.life.limits import Limits, Snapshots


class Worn:
    """Ten nodes that wear each at its own rate, the less the deeper.

    Every full state costs 100 of work.
    """

    accounts: tuple[Any, ...] = ()
    shared: tuple[Any, ...] = ()
    follows = False

    def __init__(self) -> None:
        self.work = 0

    def rate_only(self) -> "Worn":
        return Worn()  # the march has an account of its own here

    def static_only(self) -> None:
        return None

    def flat(self, wear: Any) -> Any:
        return wear

    def split(self, flat: Any) -> Any:
        return flat

    def evaluate(self, wear: Any, start: Any = None) -> Any:
        self.work += 100
        rate = np.linspace(1.0, 2.0, 10) * np.exp(-wear / 3e-6) * 1e-12
        return SimpleNamespace(
            wear=wear,
            rate=rate,
            rate_beyond=None,
            wears=True,
            responses=(),
            start=StartingPoint((), ()),
            noise=0.0,
        )


def lived(**asked: Any) -> Any:
    """Return a life of these nodes."""
    limits = Limits(cycles=5e6)
    wanted = {"snapshots": Snapshots(), **asked}
    integration = partial(integrate, limits=limits, method=Adaptive(), tolerance=1e-5)
    worn: Any = Worn()
    return history(worn, np.zeros(10), integration, **wanted)


def test_halving_goes_through_all_and_the_middle_first() -> None:
    assert halving(7) == [3, 1, 5, 0, 2, 4, 6]
    assert sorted(halving(12)) == list(range(12))
    assert halving(0) == []


def test_states_that_nobody_asked_for_are_kept_as_far_as_their_work_is_paid_for() -> (
    None
):
    whole = lived()
    bounded = lived(kept_work=250.0)
    assert len(whole.cycle) == len(whole.life.cycle) > 8
    assert len(bounded.cycle) == len(bounded.samples.cycle) + 3
    assert set(bounded.cycle) < set(whole.cycle)
    assert bounded.cycle[[0, -1]].tolist() == whole.cycle[[0, -1]].tolist()
    assert bounded.samples.cycle.tolist() == whole.samples.cycle.tolist()
    assert np.all(np.diff(bounded.cycle) > 0.0)


def test_snapshots_are_kept_whatever_they_cost() -> None:
    cycles = tuple(np.linspace(5e5, 4.5e6, 9))
    found = lived(snapshots=Snapshots(cycles=cycles), kept_work=0.0)
    assert found.cycle.tolist() == [0.0, *cycles, 5e6]
