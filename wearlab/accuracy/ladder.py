"""Work–precision curves: one knob turned step by step, its cost and its error."""

import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from itertools import pairwise
from typing import Any, Literal, NamedTuple

import numpy as np

from wearlab.gears.specification import GearError

Role = Literal["wearlab", "as published", "peer"]
Cost = Literal["seconds", "warm_seconds", "work"]

ORDER_FLOOR = 10.0
"""Smallest error that an order is read off, over the uncertainty of the reference."""
ORDER_CEILING = 0.1
"""Largest relative error that an order is read off."""
SLOPE_SPREAD = 4.0
"""Largest over least slope of a curve that has an order."""
TRANSIENT_SHARE = 0.3
"""Part of a method's own error that is left of the transient when it stops [1]."""

LONGEST_RUNG = 5.0
"""No finer setting is tried after one that took longer [s]."""
RESOLVED = 3.0
"""Smallest error that the reference resolves, over its uncertainty."""

SINGLE_TIMING = 2.0
"""An action that takes longer is timed once [s]."""
MIN_REPETITIONS = 7
"""Processor times that a median is taken of, at least."""


class Rung(NamedTuple):
    """One setting of a knob.

    Parameters
    ----------
    setting : value of the knob
    error : relative error against the reference [1]
    seconds : processor time, the median of several where it is short [s]
    work : right-hand sides of a steady state, contact analyses of a life [1]
    warm_seconds : processor time from the answer of a neighbouring wear state; NaN:
        not measured [s]
    """

    setting: float
    error: float
    seconds: float
    work: float
    warm_seconds: float = np.nan


def measured_rungs(
    settings: Iterable[float],
    rung_of: Callable[[Any], Rung | None],
    uncertainty: float | None = None,
) -> tuple[Rung, ...]:
    """Measure the settings of a knob until one is fine enough or takes too long.

    Parameters
    ----------
    settings : of the knob, coarse to fine; settings that gears refuse are left out
    rung_of : setting → rung, None where it would take too long
    uncertainty : relative uncertainty of the reference [1]; None: all settings are
        measured
    """
    rungs: list[Rung] = []
    for setting in settings:
        with suppress(GearError):
            rung = rung_of(setting)
            if rung is None:
                break
            rungs.append(rung)

            if uncertainty is None:
                continue
            if rung.seconds > LONGEST_RUNG or is_unresolved(rung, uncertainty):
                break
    return tuple(rungs)


def is_unresolved(rung: Rung, uncertainty: float) -> bool:
    """Whether the error of a rung is too small for the reference to tell it.

    Parameters
    ----------
    rung : measured setting of a knob
    uncertainty : relative uncertainty of the reference [1]
    """
    return rung.error < RESOLVED * uncertainty


class WorkPrecision(NamedTuple):
    """A work–precision curve.

    Parameters
    ----------
    name : what is drawn, such as "rk4" or "CyRK VERN7"
    knob : name of the setting, such as "steps_per_period"
    quantity : whose error it is: "mesh_force", "wear_depth", "life" …
    role : wearlab's default method, a method named as published, or a peer
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
        """Return the observed order, the median slope of the finest three pairs.

        ``|d log error / d log setting|``; NaN where fewer than two pairs of rungs show
        a slope, or where slopes differ by more than `SLOPE_SPREAD`.

        Parameters
        ----------
        uncertainty : relative uncertainty of the reference [1]
        """
        floor = ORDER_FLOOR * uncertainty
        resolved = [rung for rung in self.rungs if floor < rung.error < ORDER_CEILING]
        slopes = [
            _slope(coarse, fine)
            for coarse, fine in pairwise(resolved)
            if coarse.setting != fine.setting and coarse.error > fine.error
        ]
        finest = slopes[-3:]
        if len(finest) < 2 or not max(finest) <= SLOPE_SPREAD * min(finest):
            return float("nan")
        return float(np.median(finest))

    def cheapest(self, error: float) -> Rung | None:
        """Return the fastest rung that is accurate enough, if all finer ones are, too.

        Parameters
        ----------
        error : relative error allowed [1]

        Returns
        -------
        the rung; None where there is none
        """
        accurate: list[Rung] = []
        for rung in reversed(self.rungs):
            if not rung.error <= error:
                break
            accurate.append(rung)
        return min(accurate, key=lambda rung: rung.seconds, default=None)

    def cost_to(self, error: float, cost: Cost = "seconds") -> float:
        """Return the processor time [s] or the work [1] to a relative error.

        Parameters
        ----------
        error : relative error [1]
        cost : which field of `Rung` is read; see `interpolated`
        """
        errors = [rung.error for rung in self.rungs]
        costs = [getattr(rung, cost) for rung in self.rungs]
        return interpolated(errors, costs, error)


def _slope(coarse: Rung, fine: Rung) -> float:
    """Return ``|d log error / d log setting|`` between two rungs."""
    log_error = np.log(coarse.error / fine.error)
    log_setting = np.log(coarse.setting / fine.setting)
    return float(abs(log_error / log_setting))


def interpolated(
    errors: Sequence[float], costs: Sequence[float], error: float
) -> float:
    """Return the least cost to reach an error, by a straight line in logarithms.

    NaN when no rung reaches it. A coarsest rung that is already good enough costs what
    it costs.

    Parameters
    ----------
    errors : of the rungs, from coarse to fine [1]
    costs : of the rungs, in any unit
    error : to be reached [1]
    """
    points = [
        (rung_error, rung_cost)
        for rung_error, rung_cost in zip(errors, costs, strict=True)
        if np.isfinite(rung_error) and np.isfinite(rung_cost)
    ]
    candidates = [rung_cost for rung_error, rung_cost in points if rung_error <= error]
    for (coarse_error, coarse_cost), (fine_error, fine_cost) in pairwise(points):
        if fine_error <= error < coarse_error and fine_error > 0.0:
            share = np.log(coarse_error / error) / np.log(coarse_error / fine_error)
            growth = np.log(fine_cost / coarse_cost)
            candidates.append(float(np.exp(np.log(coarse_cost) + share * growth)))
    return min(candidates, default=float("nan"))


def timing(
    action: Callable[[], object], *, max_repetitions: int = 51, budget: float = 0.15
) -> float:
    """Return the median of at least seven processor times [s].

    Whatever else the machine does meanwhile does not count.
    The first call is not counted, unless it is long.

    Parameters
    ----------
    action : what is timed
    max_repetitions : of the action
    budget : no further repetition after this time [s]
    """
    first = _processor_time(action)
    if first > SINGLE_TIMING:
        return first

    times: list[float] = []
    while len(times) < MIN_REPETITIONS or (
        len(times) < max_repetitions and sum(times) < budget
    ):
        times.append(_processor_time(action))
    return float(np.median(times))


def _processor_time(action: Callable[[], object]) -> float:
    """Return the processor time of one call [s]."""
    begin = time.process_time()
    action()
    return time.process_time() - begin
