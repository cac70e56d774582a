"""Ladders: one knob turned step by step, what each step costs and how wrong it still is."""

import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from itertools import pairwise
from typing import Any, Literal, NamedTuple

import numpy as np

from wearlab.gears.specification import GearError

Role = Literal["wearlab", "as published", "peer"]
Cost = Literal["seconds", "warm_seconds", "work"]

FLOOR = 10.0
"""Errors below this many times the uncertainty of the reference say nothing of the
order."""
ALIKE = 4.0
"""Slopes that differ by more than this factor are no order."""
COARSEST = 0.1
"""Errors above this say nothing of the order either."""
SHARE = 0.3
"""Part of a method's own error that is left of the transient when it stops [1]."""

ENOUGH = 5.0
"""What takes longer for a rung is not asked for a finer one [s]."""
TOLD = 3.0
"""Nor is what errs by less than this many times what the reference is sure of."""


class Rung(NamedTuple):
    """One setting of a knob.

    Parameters
    ----------
    setting : value of the knob
    error : relative error against the reference [1]
    seconds : wall time, the median of several where it is short [s]
    work : right-hand sides of a steady state, contact analyses of a life [1]
    warm_seconds : wall time from the answer of a neighbouring wear state; NaN: not
        measured [s]
    """

    setting: float
    error: float
    seconds: float
    work: float
    warm_seconds: float = np.nan


def climbed(
    settings: Iterable[float],
    rung_of: Callable[[Any], Rung | None],
    uncertainty: float | None = None,
) -> tuple[Rung, ...]:
    """Return the rungs of a ladder, coarse to fine, up to the first that is fine enough or cannot be had.

    Parameters
    ----------
    settings : of the knob; those that are refused are left out
    rung_of : setting → rung, None where it would take too long
    uncertainty : relative uncertainty of the reference [1]; None: all rungs are wanted
    """
    rungs: list[Rung] = []
    for setting in settings:
        with suppress(GearError):
            rung = rung_of(setting)
            if rung is None:
                break
            rungs.append(rung)
            # the next would take too long, or tell nothing
            if uncertainty is not None and (
                rung.seconds > ENOUGH or told(rung, uncertainty)
            ):
                break
    return tuple(rungs)


def told(rung: Rung, uncertainty: float) -> bool:
    """Whether a rung errs by so little that the reference can tell no more."""
    return rung.error < TOLD * uncertainty


class WorkPrecision(NamedTuple):
    """A work–precision curve.

    Parameters
    ----------
    name : what is drawn, such as "rk4" or "CyRK VERN7"
    knob : name of the setting, such as "steps_per_period"
    quantity : whose error it is: "mesh_force", "wear_depth", "life" …
    role : wearlab's default road, a method named as published, or a peer
    rungs : from coarse to fine
    fixed : what was set besides, as text, such as 'dynamics.method = "rk4"'; empty:
        nothing
    """

    name: str
    knob: str
    quantity: str
    role: Role
    rungs: tuple[Rung, ...]
    fixed: str = ""

    def order(self, uncertainty: float) -> float:
        """Return the observed order |d log error / d log setting|, the median of the finest three; NaN: few.

        Parameters
        ----------
        uncertainty : relative uncertainty of the reference [1]
        """
        told = [r for r in self.rungs if FLOOR * uncertainty < r.error < COARSEST]
        falling = [
            (a, b)
            for a, b in pairwise(told)
            if a.setting != b.setting and a.error > b.error
        ]
        finest = [
            abs(np.log(a.error / b.error) / np.log(a.setting / b.setting))
            for a, b in falling
        ][-3:]
        alike = len(finest) >= 2 and max(finest) <= ALIKE * min(finest)
        return float(np.median(finest)) if alike else float("nan")

    def cheapest(self, error: float) -> Rung | None:
        """Return the fastest rung that is good enough, where all finer ones are, too.

        None: there is none.
        """
        good: list[Rung] = []
        for rung in reversed(self.rungs):
            if not rung.error <= error:
                break
            good.append(rung)
        return min(good, key=lambda rung: rung.seconds, default=None)

    def cost_to(self, error: float, cost: Cost = "seconds") -> float:
        """Return the wall time [s] or the work [1] to a relative error.

        See `interpolated`.
        """
        return interpolated(
            [r.error for r in self.rungs], [getattr(r, cost) for r in self.rungs], error
        )


def interpolated(
    errors: Sequence[float], costs: Sequence[float], error: float
) -> float:
    """Return the least cost to reach ``error``, between rungs by a straight line in logarithms.

    NaN when no rung reaches it. A coarsest rung that is already good enough costs what
    it costs.
    """
    known = [
        (e, c)
        for e, c in zip(errors, costs, strict=True)
        if np.isfinite(e) and np.isfinite(c)
    ]
    reached = [c for e, c in known if e <= error]
    for (e1, c1), (e2, c2) in pairwise(known):
        if e2 <= error < e1 and e2 > 0.0:
            share = np.log(e1 / error) / np.log(e1 / e2)
            reached.append(float(np.exp(np.log(c1) + share * np.log(c2 / c1))))
    return min(reached, default=float("nan"))


LONG = 2.0  # what takes longer is timed once [s]
LEAST = 7  # times that a median is taken of


def timing(
    action: Callable[[], object], *, most: int = 51, budget: float = 0.15
) -> float:
    """Return the median of at least seven wall times [s].

    The first call is not counted, unless it is long.

    Parameters
    ----------
    action : what is timed
    most : repetitions
    budget : stop between them after this time [s]
    """
    begun = time.perf_counter()
    action()
    first = time.perf_counter() - begun
    if first > LONG:
        return first
    taken: list[float] = []
    while len(taken) < LEAST or (len(taken) < most and sum(taken) < budget):
        begun = time.perf_counter()
        action()
        taken.append(time.perf_counter() - begun)
    return float(np.median(taken))
