"""Small elastic problems with the stiffness of a worn gear pair, cheap enough to solve
to the end.
"""

from types import SimpleNamespace

import numpy as np
import pytest


class Sharing:
    """A path of contact: nodes in double contact share the force with the node one
    pitch on, linearly in h.

    The rate is ``c |s| F_j``; short of separation the load difference of partners
    decays exponentially.
    """

    def __init__(self, n=80, load=1.0, stiffness=2e5, ratio=1.75):
        self.shift = round(n / ratio)
        self.double = n - self.shift
        self.coefficient = 1e-12 * np.abs(np.linspace(-0.875, 0.875, n))
        self.n, self.load, self.stiffness, self.count = n, load, stiffness, 0

    def __call__(self, h):
        self.count += 1
        force = np.full(self.n, self.load)
        wanted = 0.5 * (
            self.load + self.stiffness * (h[self.shift :] - h[: self.double])
        )
        force[: self.double] = np.clip(wanted, 0.0, self.load)
        force[self.shift :] = self.load - force[: self.double]
        return self.coefficient * force


class LineContact:
    """A punch on an elastic half-plane: short waves of wear relax
    fastest, and the edges separate.
    """

    def __init__(self, n=40, load=1.0, modulus=2e5):
        x = np.linspace(-1.0, 1.0, n)
        self.width = x[1] - x[0]
        distance = np.maximum(np.abs(x[:, None] - x[None]), 0.35 * self.width)
        self.influence = (1.2 - np.log(distance)) * self.width / modulus
        self.coefficient = 1e-12 * (1.0 + 0.5 * x)
        self.load = load
        self.n = n
        self.count = 0

    def __call__(self, h):
        self.count += 1
        active = np.arange(self.n)
        while True:
            m = len(active)
            system = np.zeros((m + 1, m + 1))
            system[:m, :m] = self.influence[np.ix_(active, active)]
            system[:m, m] = -1.0
            system[m, :m] = self.width
            pressure = np.linalg.solve(system, np.append(-h[active], self.load))[:m]
            if pressure.min() >= 0.0:
                break
            active = active[pressure > 0.0]
        rate = np.zeros(self.n)
        rate[active] = self.coefficient[active] * pressure
        return rate


class Braking:
    """One node whose rate falls with its depth, ``r = r0/(1 + h/L)``:
    ``N = (h + h²/2L)/r0``.
    """

    def __init__(self, r0=1e-12, length=5e-6):
        self.r0, self.length, self.count = r0, length, 0

    def __call__(self, h):
        self.count += 1
        return self.r0 / (1.0 + h / self.length)

    def depth(self, cycle):
        return self.length * (np.sqrt(1.0 + 2.0 * self.r0 * cycle / self.length) - 1.0)

    def life(self, depth):
        return (depth + depth**2 / (2.0 * self.length)) / self.r0


@pytest.fixture(scope="session")
def toys():
    return SimpleNamespace(Sharing=Sharing, LineContact=LineContact, Braking=Braking)
