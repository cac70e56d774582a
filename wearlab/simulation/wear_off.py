"""States worn by as much further as their wear may be off, for what that does to the forces."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wearlab.life.limits import StopWear
from wearlab.life.state import WearState
from wearlab.scene.build import Parts
from wearlab.simulation.force_errors import UNKNOWN, ForceErrors, force_errors
from wearlab.simulation.twins import Rougher

Array = NDArray[np.float64]

ALLOWED = 1.0
"""Error by the wear, over that by steps and nodes, up to which nobody asks whether wear levels it."""


@dataclass
class WearOff:
    """The error of the wear along a life, a depth a node with its sign.

    ``e' = Δr + (r(h + e) − r(h))``: what half the nodes change of the rate drives it, and the rate levels it
    as less worn flanks are loaded more. A step between two states takes the drive as it is; where the
    forces feel it, it is redone implicitly with the levelling that the rate shows there, node by node.

    Parameters
    ----------
    share : weight of the change of rate [1]
    """

    share: float
    depth: Array | None = None
    change: Array | None = None
    cycle: float = 0.0

    def errors(
        self, parts: Parts, fine: WearState, twin: Rougher, change: Array | None, stepping: float
    ) -> ForceErrors:
        """Return the errors of the forces of the next state that has a twin.

        Parameters
        ----------
        parts, fine : physics and state
        twin : its rougher twin
        change : (n_rough,) change of the wear rate of all conditions together, None without a wear law [m]
        stepping : error of the depth by the steps over cycles and by what was before [m]
        """
        drive = self._drive(twin, change)
        found = self._tried(parts, fine, twin, drive, stepping)
        if found is None:
            return UNKNOWN
        worse, off, (errors, by_wear) = found
        if drive.any() and by_wear.mesh > ALLOWED * (errors.mesh - by_wear.mesh):
            levelled = self._levelled(twin, worse, off, drive)
            again = self._tried(parts, fine, twin, levelled, stepping)
            if again is not None:
                drive, (_, _, (errors, _)) = levelled, again
        self.depth, self.change, self.cycle = drive, change, twin.cycle
        return errors

    def _drive(self, twin: Rougher, change: Array | None) -> Array:
        """Return the error of the depth when nothing levels it since the state before, (n_rough,)."""
        before = np.zeros_like(twin.wear) if self.depth is None else self.depth
        if change is None:
            return before
        mean = change if self.change is None else 0.5 * (change + self.change)
        return np.asarray(before + self.share * (twin.cycle - self.cycle) * mean)

    def _tried(
        self, parts: Parts, fine: WearState, twin: Rougher, drive: Array, stepping: float
    ) -> tuple[WearState, Array, tuple[ForceErrors, ForceErrors]] | None:
        """Return the twin worn further, by how much, and the errors; None where it responds otherwise."""
        alike = stepping * twin.wear / (twin.wear.max(initial=0.0) or 1.0)
        off = drive - alike if drive @ alike < 0.0 else drive + alike
        if not np.isfinite(off).all():
            return None
        worse, coupling = twin.state, twin.parts.coupling
        if off.any():
            try:
                worse = coupling.evaluate(
                    coupling.split(np.maximum(0.0, twin.wear + off)), twin.state.responses
                )
            except StopWear:
                return None
        if [one.period for one in worse.responses] != [one.period for one in fine.responses]:
            return None
        return worse, off, force_errors(parts, twin.parts, (fine, twin.state, worse), twin.weight)

    def _levelled(self, twin: Rougher, worse: WearState, off: Array, drive: Array) -> Array:
        """Return the error after an implicit step, ``(e₀ + ΔN Δr)/(1 + λ ΔN)``, λ the answer of the rate."""
        if not worse.wears:
            return drive
        coupling = twin.parts.coupling
        answer = coupling.flat(worse.rate) - coupling.flat(twin.state.rate)
        slope = np.divide(-answer, off, out=np.zeros_like(off), where=off != 0.0)
        return np.asarray(drive / (1.0 + np.maximum(0.0, slope) * (twin.cycle - self.cycle)))
