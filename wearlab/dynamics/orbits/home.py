"""How far a motion is from a response that attracts, and whether it is as good as back."""

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.orbits.response import Response, step_forces
from wearlab.dynamics.rigid import rigid_modes

NEAR = 1e-2
"""Distance of two orbits, over the mean deflection, from which they are two."""
KEPT = 0.5
"""Share of the least mesh deflection that a motion that counts as back may take away: its flanks stay in
touch, the motion is that of a linear system, and nothing but the response attracts it."""


class Home:
    """A response to which released flanks may return, by its states once a mesh period.

    Parameters
    ----------
    response : the response; a set that turns freely may turn meanwhile
    rate : by which velocities are measured [1/s]
    """

    def __init__(self, response: Response, rate: float) -> None:
        system, n = response.system, len(response.system.load)
        state = response.state[:, :-1, :n]
        deflection = state @ system.direction.T - response.tables.error[:, 0]
        self.deflection = float(np.abs(deflection.mean(axis=(0, 1))).max())
        self.rate, self.states = rate, response.state[:, 0]
        turning = rigid_modes(system)
        self.still = np.eye(n) - turning.T @ (turning @ system.mass)
        largest = float(abs(response.multipliers[0])) ** (1.0 / response.period)
        self.decay = -np.log(largest) if 0.0 < largest < 1.0 else 0.0
        least = step_forces(response).elastic.min(axis=(0, 1, 2)) / response.tables.mean_stiffness
        self.touching = bool(least.min() > 0.0)
        self.spare = max(KEPT * float(least.min()), NEAR * self.deflection)
        self._see_modes(response)

    def _see_modes(self, response: Response) -> None:
        """Prepare what deflection the modes of a state amount to at most."""
        system = response.system
        vibrating = response.modes.frequency > 0.0
        shapes = response.modes.shape[vibrating]
        felt = np.abs(shapes @ system.direction.T).max(axis=1)
        self.seen = felt[:, None] * (shapes @ system.mass)
        self.rates = 2.0 * np.pi * response.modes.frequency[vibrating]

    def distance(self, state: Array) -> float:
        """Return how far a strobed state is from the response, over its mean deflection [1]."""
        n = len(state) // 2
        apart = (self.states - state).reshape(-1, 2, n) @ self.still.T
        apart[:, 1] /= self.rate
        return float(np.abs(apart).max(axis=(1, 2)).min()) / self.deflection

    def is_at(self, state: Array) -> bool:
        """Whether a strobed state is one of the response's."""
        return self.distance(state) <= NEAR

    def away(self, state: Array) -> float:
        """Return how many times farther a strobed state is than where it is as good as back [1]."""
        return self._swing(state) / self.spare if self.touching else self.distance(state) / NEAR

    def _swing(self, state: Array) -> float:
        """Return the amplitude of the deflection that the state adds, all modes in phase [m]."""
        n = self.seen.shape[1]
        apart = self.states - state
        swings = np.hypot(apart[:, :n] @ self.seen.T, apart[:, n:] @ self.seen.T / self.rates)
        return float(swings.sum(axis=1).min())

    def periods_to(self, away: float) -> float:
        """Return the mesh periods in which the slowest vibration shrinks by so many times."""
        return np.log(max(away, 1.0)) / self.decay if self.decay > 0.0 else np.inf
