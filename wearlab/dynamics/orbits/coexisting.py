"""Another attractor beside the one found: |μ| < 1 says that an orbit attracts, not that it is the only one.

A mesh that may separate has several steady responses, even where the one found never leaves contact. So
flanks are let go from states that it does not visit. Mostly they are back within a few dozen periods, as soon
as they can no longer part, and the integration ends there. What stays away is shot at now and then: an orbit
takes far longer to settle on than to find.
"""

from itertools import islice
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.orbits.home import Home
from wearlab.dynamics.orbits.period_map import LOCATED
from wearlab.dynamics.orbits.periodic import Periodic, periods_of
from wearlab.dynamics.orbits.releases import releases
from wearlab.dynamics.orbits.response import Response, Verdict
from wearlab.dynamics.orbits.shooting import Orbit, Shooting

BLOCK = 50
"""Most mesh periods between two looks whether the flanks are back."""
RELEASES, FURTHER, MOST_RELEASES = 24, 8, 64
"""Releases of a search, of one that goes on with those of a neighbouring case, and with those that long
transients add."""
LONG, ADDED, ADDED_SHARE = 100, 2, 0.5
"""Mesh periods after which a release is shot at, further releases that it asks for, and the share of the work
allowed up to which it may: where transients are long, which attractor one ends on is chance."""
TRIED, PASSES = (1, 2, 3), 8
"""Periods that a motion is shot at which shows none, and passes allowed."""
PUSHED, WATCHED = 1e-3, 50
"""Distance by which an orbit found by shooting is pushed, over the mean deflection, and mesh periods in which
it must not go tenfold as far: its multipliers say so, but of a flank that grazes they know one side alone."""
MOST_STEPS = 30_000_000
"""Bound on the integration steps of a search, where nobody gives another."""


class Tries(NamedTuple):
    """What a search tries.

    Parameters
    ----------
    releases : how many, more where transients are long
    first : number of the first of them, see `wearlab.dynamics.orbits.releases.releases`
    near : another attractor of a neighbouring case: one like it is looked for first
    """

    releases: int = RELEASES
    first: int = 0
    near: Response | None = None


WHOLE = Tries()


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


def coexisting(
    response: Response, method: Periodic, most_steps: int = MOST_STEPS, tries: Tries = WHOLE
) -> Search:
    """Look for another attractor that the released flanks reach; there is none when all return.

    Parameters
    ----------
    response : a periodic, attracting response; no other is looked at
    method : how long to integrate, and how long a period may be
    most_steps : bound on the integration steps of the search
    tries : what to try; all of it where no neighbouring case has been searched

    Notes
    -----
    A search, not a proof: an attractor that none of the releases reaches stays unknown.
    """
    if response.period == 0 or not response.verdict.unique or not response.system.load.any():
        return Search()
    hunt = _Hunt(response, method, most_steps // len(response.tables.width))
    starts, wanted = 0, tries.releases
    try:
        rival = None if tries.near is None else hunt.like(tries.near)
        states = releases(response, hunt.home.deflection, tries.first)
        while rival is None and starts < wanted:
            before = hunt.maps
            rival = hunt.attractor(next(states))
            starts += 1
            if hunt.maps - before >= LONG and hunt.maps < ADDED_SHARE * hunt.most:
                wanted = min(wanted + ADDED, MOST_RELEASES)
    except _CutOff:
        return Search(None, starts, int(hunt.maps), starts < tries.releases)
    return Search(rival, starts, int(hunt.maps))


class _Hunt(Shooting):
    """Attractors beside a response, found with a bounded number of mesh periods."""

    def __init__(self, response: Response, method: Periodic, most: int) -> None:
        super().__init__(response.system, response.tables, response.mesh_period)
        self.home, self.method, self.most = Home(response, self.rate), method, most
        self.patience = sum(method.transients(self))

    def integrate(self, state: Array, count: int, keep: int = 1) -> tuple[Array, Array]:
        """Integrate as `Shooting.integrate` does, if the bound allows."""
        if self.maps + count > self.most:
            raise _CutOff
        return super().integrate(state, count, keep)

    def shoot(self, periods: int, state: Array, *, contact: int = LOCATED, most: int = 25) -> Orbit | None:
        """Shoot as `Shooting.shoot` does, with as many passes as the bound allows."""
        passes = min(most, int(self.most - self.maps) // periods)
        if passes < 1:
            raise _CutOff
        return super().shoot(periods, state, contact=contact, most=passes)

    def like(self, near: Response) -> Response | None:
        """Return the attractor that another of a neighbouring case becomes, None when it ends before."""
        if near.period == 0 or near.state.shape[2] != self.rows:
            return None
        return self._beside(near.period, near.state[0, 0])

    def attractor(self, state: Array) -> Response | None:
        """Return the attractor that a motion from ``state`` (2n,) reaches, None when it is the one known."""
        if self.balance is not None:
            self.balance.size[:] = 0.0  # integration moves the loads that keep a free set at its speed
        done, look = 0, LONG
        while done < self.patience:
            away = self.home.away(state)
            if not away > 1.0:  # back, or beyond all bounds
                return None
            if done >= look:
                look *= 2
                if (rival := self._led_to(state)) is not None:
                    return rival
            block = int(np.clip(np.ceil(self.home.periods_to(away)), 1, BLOCK))
            self.integrate(state, block)
            done += block
        return self._settled(state)

    def _led_to(self, state: Array) -> Response | None:
        """Return another attractor near a motion that has not settled."""
        strobe, _ = self.integrate(state.copy(), 2 * self.method.longest)
        shown = list(islice(periods_of(strobe, self.method.longest, self.rate), 1))
        for periods in shown or TRIED:
            if (rival := self._beside(periods, strobe[-1])) is not None:
                return rival
        return None

    def _beside(self, periods: int, state: Array) -> Response | None:
        """Return the other orbit near ``state`` (2n,), None where none attracts."""
        orbit = self.shoot(periods, state.copy(), most=PASSES)
        if orbit is None or orbit.largest >= 1.0 - self.method.margin or self.home.is_at(orbit.state[0, 0]):
            return None
        return self._periodic(orbit) if self._attracts(orbit) else None

    def _attracts(self, orbit: Orbit) -> bool:
        """Whether a motion pushed off an orbit stays near it."""
        pushed, n = orbit.state[0, 0].copy(), self.rows // 2
        pushed[:n] += PUSHED * self.home.deflection * np.sign(self.system.direction.sum(axis=0))
        count = WATCHED // orbit.periods + 1
        strobe, _ = self.integrate(pushed, count * orbit.periods)
        limit = 10.0 * PUSHED * self.home.deflection
        return self.distance(strobe[-1], orbit.state[0, 0]) <= limit

    def _settled(self, state: Array) -> Response | None:
        """Return the attractor on which a motion has settled."""
        method = self.method
        strobe, path = self.integrate(state, max(method.averaged, 2 * method.longest), method.averaged)
        for periods in periods_of(strobe, method.longest, self.rate):
            orbit = self.shoot(periods, strobe[-1].copy())
            if orbit is not None and orbit.largest <= 1.0 + method.margin:
                return None if self.home.is_at(orbit.state[0, 0]) else self._periodic(orbit)
        return None if self.home.is_at(strobe[-1]) else self.aperiodic(path, 0.0)

    def _periodic(self, orbit: Orbit) -> Response:
        attracting = orbit.largest < 1.0 - self.method.margin
        return self.response(orbit, Verdict(True, attracting, orbit.unique, True))
