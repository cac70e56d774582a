"""The error of the wear along a life, and states worn by as much further, for what that does to the forces.

``e' = Δr + (r(h + e) − r(h))``: what half the steps and nodes change of the rate drives the error, and the
rate levels it, as flanks that are worn too little carry more: over tens of micrometres the drive alone adds
up to twenty times what is left of it. One look at the rate of a state worn by its error tells how fast,
``g = e·Δr(e)/e·e``. A step between two states takes the drive as it is; where it would be levelled many times
over within the step and is no longer small, an implicit step, see `levelled`.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.specification import GearError
from wearlab.life.limits import StopWear
from wearlab.life.state import WearState
from wearlab.simulation.levelled import levelled
from wearlab.simulation.twins import Rougher

WORN_FORCE_SHARE = 1.2
"""Weight of the error of the wear in what wear changes of the forces, set on seed 1."""
WORTH, LEVELS = 0.01, 5.0
"""Error by the drive alone, over the depth, and exponent −g ΔN from which an implicit step is taken."""


class WornFurther(NamedTuple):
    """The error of the wear at one state.

    Parameters
    ----------
    cycle : of the state [1]
    error : (n_rough,) error of the wear with its sign [m]
    drive : (n_rough,) change of the rate by half the steps and nodes, None without a wear law [m per cycle]
    worse : the twin worn by as much further, in every condition; None where it responds otherwise
    between : what every second node does not tell of the wear between them [m]
    """

    cycle: float
    error: Array
    drive: Array | None
    worse: tuple[WearState | None, ...]
    between: float = 0.0


class ErrorOfWear:
    """The error of the wear from state to state.

    Parameters
    ----------
    weight : shares of the cycles that the conditions have [1]
    """

    def __init__(self, weight: Array) -> None:
        self.weight = weight
        self.before: WornFurther | None = None

    def next(self, joint: Rougher, twins: Sequence[Rougher], stepping: float) -> WornFurther:
        """Return the error at the next state that has twins.

        Parameters
        ----------
        joint : its rougher twin in all conditions together
        twins : in each
        stepping : error of the depth by the steps over cycles and by what was before [m]
        """
        error = self._driven(joint)
        off = _further(joint, error, stepping)
        worse = _worn_by(twins, off)
        if self._is_levelled(joint, error, off, self._answer(twins, worse)):
            step = joint.cycle - (self.before.cycle if self.before else 0.0)
            error = levelled(error, step, lambda off: self._answer(twins, _worn_by(twins, off)))
            again = _worn_by(twins, _further(joint, error, stepping))
            worse = worse if None in again else again
        self.before = WornFurther(joint.cycle, error, joint.rate, worse, joint.between)
        return self.before

    def _driven(self, joint: Rougher) -> Array:
        """Return the error when nothing levels it since the state before, (n_rough,) [m]."""
        before = self.before
        start = np.zeros_like(joint.wear) if before is None else before.error
        if joint.rate is None:
            return start
        mean = joint.rate
        if before is not None and before.drive is not None:
            mean = 0.5 * (joint.rate + before.drive)
        return np.asarray(start + (joint.cycle - (before.cycle if before else 0.0)) * mean)

    def _is_levelled(self, joint: Rougher, error: Array, off: Array, answer: Array | None) -> bool:
        """Whether the rate levels the error many times over within the step, and it is worth asking how."""
        if answer is None or float(np.abs(error).max()) <= WORTH * float(joint.wear.max(initial=0.0)):
            return False
        step = joint.cycle - (self.before.cycle if self.before else 0.0)
        return bool(-float(off @ answer) * step >= LEVELS * float(off @ off) > 0.0)

    def _answer(self, twins: Sequence[Rougher], worse: Sequence[WearState | None]) -> Array | None:
        """Return what further wear changes of the rate of all conditions, None where it cannot be told."""
        total: Array | None = None
        for share, twin, moved in zip(self.weight, twins, worse, strict=True):
            if moved is None or not (moved.wears and twin.state.wears):
                return None
            coupling = twin.parts.coupling
            own = share * (coupling.flat(moved.rate) - coupling.flat(twin.state.rate))
            total = own if total is None else total + own
        return total


def _further(joint: Rougher, error: Array, stepping: float) -> Array:
    """Return by how much the twin is worn further: the error, and that of the steps alike the wear."""
    own = WORN_FORCE_SHARE * error
    alike = stepping * joint.wear / (joint.wear.max(initial=0.0) or 1.0)
    return np.asarray(own - alike if own @ alike < 0.0 else own + alike)


def _worn_by(twins: Sequence[Rougher], off: Array) -> tuple[WearState | None, ...]:
    """Return the twins worn by so much further, None where one responds otherwise or not at all."""
    states: list[WearState | None] = []
    for twin in twins:
        worse: WearState | None = twin.state
        if not np.isfinite(off).all():
            worse = None
        elif off.any():
            coupling = twin.parts.coupling
            try:
                worse = coupling.evaluate(
                    coupling.split(np.maximum(0.0, twin.wear + off)), twin.state.responses
                )
                if [response.period for response in worse.responses] != [
                    response.period for response in twin.state.responses
                ]:
                    worse = None
            except (StopWear, GearError):
                worse = None
        states.append(worse)
    return tuple(states)
