"""Another attractor beside the one found: |μ| < 1 says that an orbit attracts, not that it is the only one.

A mesh that may separate has several steady responses, even where the one found never leaves contact. So
flanks are let go from states that it does not visit: mostly they fall back within a few dozen periods, and
the march ends there.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.period_map import LOCATED
from wearlab.dynamics.periodic import Periodic, periods_of
from wearlab.dynamics.response import Response, Verdict
from wearlab.dynamics.rigid import rigid_modes
from wearlab.dynamics.shooting import Orbit, Shooting

BLOCK = 50
"""Most mesh periods between two looks whether the flanks have fallen back."""
FALLEN_BACK = 1e-3
"""Distance from the orbit, over the mean deflection, at which its attraction has won."""
DISTINCT = 1e-2
"""Distance of two orbits, over the mean deflection, from which they are two."""
RELEASES = ((-1.0, True), (-2.0, True), (-1.0, False), (2.0, False), (-8.0, True), (3.0, True))
"""Approach of the flanks at release over the mean deflection; of all coordinates, or of one alone."""
MOST_STEPS = 30_000_000
"""Bound on the integration steps of a search, where nobody gives another."""


class Search(NamedTuple):
    """What a search for another attractor came to.

    Parameters
    ----------
    rival : the other attractor, None when none was found
    starts : releases that were followed to their end
    periods : mesh periods that were integrated
    cut_off : whether the bound on the work ended the search before the last release
    """

    rival: Response | None = None
    starts: int = 0
    periods: int = 0
    cut_off: bool = False


class _CutOff(Exception):
    """The bound on the work is reached."""


class _Bounded(Shooting):
    """Orbits of one system, found with a bounded number of mesh periods."""

    def __init__(self, response: Response, most: int) -> None:
        super().__init__(response.system, response.tables, response.mesh_period)
        self.most = most

    def march(self, state: Array, count: int, keep: int = 1) -> tuple[Array, Array]:
        """March as `Shooting.march` does, if the bound allows."""
        if self.maps + count > self.most:
            raise _CutOff
        return super().march(state, count, keep)

    def shoot(self, periods: int, state: Array, *, touch: int = LOCATED, most: int = 25) -> Orbit | None:
        """Shoot as `Shooting.shoot` does, with as many passes as the bound allows."""
        passes = min(most, int(self.most - self.maps) // periods)
        if passes < 1:
            raise _CutOff
        return super().shoot(periods, state, touch=touch, most=passes)


def coexisting(response: Response, method: Periodic, most_steps: int = MOST_STEPS) -> Search:
    """Look for another attractor that the released flanks reach; there is none when all return.

    Parameters
    ----------
    response : a periodic, attracting response; no other is looked at
    method : how long to march, and how long a period may be
    most_steps : bound on the integration steps of the search

    Notes
    -----
    A search, not a proof: an attractor that none of the releases reaches stays unknown.
    """
    if response.period == 0 or not response.verdict.unique or not response.system.load.any():
        return Search()
    scale, most, periods = _mean_deflection(response), most_steps // len(response.tables.width), 0
    for number, state in enumerate(_releases(response, scale)):
        # Marching moves the loads that keep a free set at its speed: each release starts from those found.
        shooting = _Bounded(response, most - periods)
        home = _Home(response, scale, shooting.rate)
        try:
            rival = _attractor(shooting, state, home, method)
        except _CutOff:
            return Search(None, number, periods + int(shooting.maps), True)
        periods += int(shooting.maps)
        if rival is not None:
            return Search(rival, number + 1, periods)
    return Search(None, len(RELEASES), periods)


class _Home:
    """The strobed states of the response found; where a set turns freely it may have turned meanwhile."""

    def __init__(self, response: Response, scale: float, rate: float) -> None:
        self.scale, self.rate = scale, rate
        self.states = response.state[:, 0]
        turning = rigid_modes(response.system)
        self.still = np.eye(len(response.system.load)) - turning.T @ (turning @ response.system.mass)

    def distance(self, state: Array) -> float:
        """Return how far a strobed state is from the orbit, over the mean deflection [1]."""
        n = len(state) // 2
        apart = (self.states - state).reshape(-1, 2, n) @ self.still.T
        apart[:, 1] /= self.rate
        return float(np.abs(apart).max(axis=(1, 2)).min()) / self.scale


def _mean_deflection(response: Response) -> float:
    n = len(response.system.load)
    state = response.state[:, :-1, :n]
    deflection = state @ response.system.direction.T - response.tables.error[:, 0]
    return float(np.abs(deflection.mean(axis=(0, 1))).max())


def _releases(response: Response, scale: float) -> Iterator[Array]:
    direction = response.system.direction.sum(axis=0)
    for approach, spread in RELEASES:
        state = np.zeros(2 * len(direction))
        if spread:
            state[: len(direction)] = approach * scale * direction / (direction @ direction)
        else:
            last = int(np.flatnonzero(direction)[-1])
            state[last] = approach * scale / direction[last]
        yield state


def _falls_back(shooting: Shooting, state: Array, home: _Home, most: int) -> bool:
    passed, block = 0, 1
    while passed < most:
        shooting.march(state, block)
        passed, block = passed + block, min(2 * block, BLOCK)
        if home.distance(state) <= FALLEN_BACK:
            return True
    return not np.isfinite(state).all()


def _attractor(shooting: Shooting, state: Array, home: _Home, method: Periodic) -> Response | None:
    """Return the attractor that a march from ``state`` reaches, None when it is the one known."""
    for transient in method.transients(shooting):
        if _falls_back(shooting, state, home, transient):
            return None
        strobe, path = shooting.march(state, max(method.averaged, 2 * method.longest), method.averaged)
        for m in periods_of(strobe, method.longest, shooting.rate):
            orbit = shooting.shoot(m, strobe[-1].copy())
            if orbit is not None and orbit.largest <= 1.0 + method.margin:
                same = home.distance(orbit.state[0, 0]) <= DISTINCT
                return None if same else _periodic(shooting, orbit, method)
    if home.distance(strobe[-1]) <= DISTINCT:
        return None
    return shooting.aperiodic(path, 0.0)


def _periodic(shooting: Shooting, orbit: Orbit, method: Periodic) -> Response:
    verdict = Verdict(True, orbit.largest < 1.0 - method.margin, orbit.unique, True)
    return shooting.response(orbit, verdict)
