"""The error of a life: what its steps leave behind, carried along where wear accelerates."""

import numpy as np

from wearlab.arrays import Array
from wearlab.life.step import Step


class AccumulatedError:
    """The error of the depth, step after step.

    ``total``: (n,) what has a sign, added up and amplified [m]; ``scatter``: what has another sign in every
    step, the root of its squares [m]; ``local``, ``largest``: of every state, the error of the step that led
    there and the error so far [m].

    Parameters
    ----------
    size : entries of the depth
    noise : standard error of the first rate [m per cycle]
    """

    def __init__(self, size: int, noise: float) -> None:
        self.total, self.scatter, self.noise = np.zeros(size), 0.0, noise
        self.local, self.largest = [0.0], [0.0]

    def heard(self, noise: float) -> float:
        """Return the noise of the rates of the steps just made, given that of the last one [m per cycle]."""
        before, self.noise = self.noise, noise
        return max(before, noise)

    def add(self, step: Step, noise: float) -> None:
        """Count a step, at rates of this standard error [m per cycle]."""
        self.total = self.total * step.growth + step.error
        self.local.append(float(np.abs(step.error).max(initial=0.0)))
        self.scatter = float(np.hypot(self.scatter * step.growth, np.hypot(step.scatter, step.size * noise)))
        self.largest.append(self._now())

    def doubt(self, doubt: Array) -> None:
        """Count a doubt of either sign in the last state, (n,) ≥ 0 [m]."""
        self.total = self.total + np.copysign(doubt, self.total)
        self.largest[-1] = self._now()

    def _now(self) -> float:
        return float(np.abs(self.total).max(initial=0.0)) + self.scatter
