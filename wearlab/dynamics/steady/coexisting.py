"""Another attractor beside a response: |μ| < 1 does not say that it is the only one.

A mesh that may separate has several steady responses, even where the one found never
leaves contact. So flanks are let go from states that it does not visit. Mostly they are
back within a few dozen periods, as soon as they can no longer part, and the integration
ends there. What stays away is shot at now and then: an orbit takes far longer to settle
on than to find.
"""

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.rigid import rigid_modes
from wearlab.dynamics.steady import shooting
from wearlab.dynamics.steady.integrate import LOCATED
from wearlab.dynamics.steady.periodic import Periodic, periods_of
from wearlab.dynamics.steady.response import Response, step_forces

BLOCK = 50
"""Most mesh periods between two looks whether the flanks are back."""
RELEASES = 24
"""Releases of a search."""
FURTHER = 8
"""Releases of a search that goes on with those of a neighbouring case."""
MAX_RELEASES = 64
"""Releases with those that long transients add."""
LONG = 100
"""Mesh periods after which a release is shot at."""
ADDED = 2
"""Further releases that a long one asks for: where transients are long, which attractor
one ends on is chance."""
ADDED_SHARE = 0.5
"""Share of the work allowed up to which releases are added."""
TRIED = (1, 2, 3)
"""Periods that a motion is shot at which shows none."""
PASSES = 8
"""Passes of a shot at a motion that has not settled."""
PUSHED = 1e-3
"""Distance by which an orbit found by shooting is pushed, over the mean deflection."""
WATCHED = 50
"""Mesh periods in which a pushed orbit must not go tenfold as far: its multipliers say
so, but of a flank that grazes they know one side alone."""
MAX_STEPS = 30_000_000
"""Bound on the integration steps of a search, where nobody gives another."""
AMPLITUDE = (4.0, 120.0)
"""Force of the mode released over the mean mesh force: less hardly parts flanks, more
flies through gaps."""
PLASTIC = 1.32471795724474602596
"""Real root of x³ = x + 1: multiples of its inverse and of the square of that fill a
plane evenly."""
NEAR = 1e-2
"""Distance of two orbits, over the mean deflection, from which they are two."""
SPARED = 0.5
"""Share of the least mesh deflection that a motion that counts as back may take away:
its flanks stay in touch, the motion is that of a linear system, and nothing but the
response attracts it."""


class Tries(NamedTuple):
    """What a search tries.

    Parameters
    ----------
    releases : how many, more where transients are long
    first : number of the first of them, see
        `wearlab.dynamics.steady.coexisting.releases`
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
    spent : the work in mesh periods, changes of contact included
    """

    rival: Response | None = None
    starts: int = 0
    periods: int = 0
    cut_off: bool = False
    spent: float = 0.0


class _CutOff(Exception):
    """The bound on the work is reached."""


def coexisting(
    response: Response,
    method: Periodic,
    max_steps: int = MAX_STEPS,
    tries: Tries = WHOLE,
) -> Search:
    """Look for another attractor that the released flanks reach.

    There is none when all return.

    Parameters
    ----------
    response : a periodic, attracting response; no other is looked at
    method : how long to integrate, and how long a period may be
    max_steps : bound on the integration steps of the search
    tries : what to try; all of it where no neighbouring case has been searched

    Notes
    -----
    A search, not a proof: an attractor that none of the releases reaches stays unknown.
    """
    verdict = response.verdict
    attracts = verdict.attracting is not False
    is_loaded = bool(response.system.load.any())
    if response.period == 0 or not attracts or not verdict.unique or not is_loaded:
        return Search()

    hunt = _Hunt(response, method, max_steps // len(response.tables.width))
    starts = 0
    count = tries.releases
    try:
        rival = None if tries.near is None else hunt.like(tries.near)
        states = releases(response, hunt.attractor.deflection, tries.first)
        while rival is None and starts < count:
            first_period = hunt.maps
            rival = hunt.reached_from(next(states))
            starts += 1
            is_long = hunt.maps - first_period >= LONG
            if is_long and hunt.spent < ADDED_SHARE * hunt.max_periods:
                count = min(count + ADDED, MAX_RELEASES)
    except _CutOff:
        return Search(None, starts, hunt.maps, starts < tries.releases, hunt.spent)
    return Search(rival, starts, hunt.maps, spent=hunt.spent)


class _Hunt(shooting.Shooting):
    """Attractors beside a response, found with a bounded number of mesh periods."""

    def __init__(self, response: Response, method: Periodic, max_periods: int) -> None:
        super().__init__(response.system, response.tables, response.mesh_period, method)
        self.attractor = Attractor(response, self.rate)
        self.method = method
        self.max_periods = max_periods
        self.patience = sum(method.transients(self))

    @property
    def spent(self) -> float:
        """Mesh periods so far, with what locating changes of contact is worth."""
        per_period = shooting.RHS_PER_STEP * self.steps
        return self.maps + self.changes * self.per_change / per_period

    def follow(
        self,
        state: Array,
        count: int,
        keep: int = 1,
    ) -> tuple[Array, Array]:
        """Integrate, if the bound allows."""
        if self.spent + count > self.max_periods:
            raise _CutOff
        return self.integrate(state, count, keep)

    def shoot(
        self,
        periods: int,
        state: Array,
        *,
        contact: int = LOCATED,
        max_passes: int = 25,
    ) -> Response | None:
        """Shoot as `Shooting.shoot` does, with as many passes as the bound allows."""
        passes = min(max_passes, int(self.max_periods - self.spent) // periods)
        if passes < 1:
            raise _CutOff
        return super().shoot(periods, state, contact=contact, max_passes=passes)

    def like(self, near: Response) -> Response | None:
        """Return the attractor that another of a neighbouring case becomes.

        None when it ends before.
        """
        fits = near.period > 0 and near.state.shape[2] == self.rows
        return self._beside(near.period, near.state[0, 0]) if fits else None

    def reached_from(self, state: Array) -> Response | None:
        """Return the attractor that a motion reaches, None if it is the response.

        Parameters
        ----------
        state : (2n,) from which flanks are released, moved along
        """
        # integration moves the loads that keep a free set at its speed
        self.balance.size[:] = 0.0
        periods = 0
        next_shot = LONG
        while periods < self.patience:
            away = self.attractor.away(state)
            if not away > 1.0:  # back, or beyond all bounds
                return None
            if periods >= next_shot:
                next_shot *= 2
                rival = self._led_to(state)
                if rival is not None:
                    return rival
            until_back = np.ceil(self.attractor.periods_to(away))
            block = int(np.clip(until_back, 1, BLOCK))
            self.follow(state, block)
            periods += block
        return self._settled(state)

    def _led_to(self, state: Array) -> Response | None:
        """Return another attractor near a motion that has not settled."""
        longest = self.method.longest
        strobe, _ = self.follow(state.copy(), 2 * longest)
        shown = list(itertools.islice(periods_of(strobe, longest, self.rate), 1))
        for periods in shown or TRIED:
            rival = self._beside(periods, strobe[-1])
            if rival is not None:
                return rival
        return None

    def _beside(self, periods: int, state: Array) -> Response | None:
        """Return the other orbit near ``state`` (2n,), None where none attracts."""
        orbit = self.shoot(periods, state.copy(), max_passes=PASSES)
        if (
            orbit is None
            or orbit.largest >= 1.0 - self.method.margin
            or self.attractor.is_at(orbit.state[0, 0])
        ):
            return None
        return self.counted(orbit) if self._attracts(orbit) else None

    def _attracts(self, orbit: Response) -> bool:
        """Whether a motion pushed off an orbit stays near it."""
        pushed = orbit.state[0, 0].copy()
        n = self.rows // 2
        push = PUSHED * self.attractor.deflection
        pushed[:n] += push * np.sign(self.system.direction.sum(axis=0))
        periods = (WATCHED // orbit.period + 1) * orbit.period
        strobe, _ = self.follow(pushed, periods)
        limit = 10.0 * PUSHED * self.attractor.deflection
        return self.distance(strobe[-1], orbit.state[0, 0]) <= limit

    def _settled(self, state: Array) -> Response | None:
        """Return the attractor on which a motion has settled."""
        method = self.method
        periods_followed = max(method.averaged, 2 * method.longest)
        strobe, path = self.follow(state, periods_followed, method.averaged)
        for periods in periods_of(strobe, method.longest, self.rate):
            orbit = self.shoot(periods, strobe[-1].copy())
            if orbit is not None and orbit.largest <= 1.0 + method.margin:
                return None if self.attractor.is_at(orbit.state[0, 0]) else orbit
        return None if self.attractor.is_at(strobe[-1]) else self.aperiodic(path, 0.0)


def releases(response: Response, deflection: float, first: int = 0) -> Iterator[Array]:
    """Yield states (2n,) to release flanks from, without end.

    One mode follows another, each at another phase.

    About the mean state of the response, a mode vibrates with ``x = a cos θ``, ``ẋ = −a
    ω sin θ``. Amplitudes a, by their logarithm, and phases θ follow an additive
    recurrence, which leaves no gap wherever it ends.

    Parameters
    ----------
    response : the response beside which others are looked for
    deflection : its mean mesh deflection [m]
    first : number of the first release: what a neighbouring state has tried need not be
        tried again

    References
    ----------
    Roberts, The unreasonable effectiveness of quasirandom sequences, 2018: the plastic
    number.
    """
    system = response.system
    modes = response.modes
    driven = modes.excited() & (modes.frequency > 0.0)
    n = len(system.load)
    shapes = modes.shape[driven]
    rates = 2.0 * np.pi * modes.frequency[driven]
    # A mode's mesh force equals the load's, or its energy that of the deflection under
    # load, whichever is less: some hardly move the mesh.
    mesh_deflection = np.abs(shapes @ system.direction.sum(axis=0))
    load_rate = np.linalg.norm(shapes @ system.load / rates)
    largest = np.minimum(deflection / mesh_deflection, load_rate / rates)
    mean = response.state[:, :-1].mean(axis=(0, 1))
    low, high = np.log(AMPLITUDE)
    for number in itertools.count(first):
        turn, mode = divmod(number, len(shapes))
        spread = (0.5 + turn / PLASTIC) % 1.0
        phase = 2.0 * np.pi * ((0.5 + turn / PLASTIC**2) % 1.0)
        amplitude = np.exp(low + (high - low) * spread) * largest[mode]
        motion = amplitude * shapes[mode]
        state = mean.copy()
        state[:n] += np.cos(phase) * motion
        state[n:] -= np.sin(phase) * rates[mode] * motion
        yield state


class Attractor:
    """A response to which released flanks may return, by its states once a mesh period.

    Parameters
    ----------
    response : the response; a set that turns freely may turn meanwhile
    rate : by which velocities are measured [1/s]
    """

    def __init__(self, response: Response, rate: float) -> None:
        system = response.system
        n = len(system.load)
        self.rate = rate
        self.states = response.state[:, 0]

        position = response.state[:, :-1, :n]
        deflection = position @ system.direction.T - response.tables.error[:, 0]
        self.deflection = float(np.abs(deflection.mean(axis=(0, 1))).max())

        turning = rigid_modes(system)
        self.still = np.eye(n) - turning.T @ (turning @ system.mass)
        largest = float(abs(response.multipliers[0])) ** (1.0 / response.period)
        self.decay = -np.log(largest) if 0.0 < largest < 1.0 else 0.0

        least_force = step_forces(response).elastic.min(axis=(0, 1, 2))
        least_deflection = least_force / response.tables.mean_stiffness
        self.permanent_contact = bool(least_deflection.min() > 0.0)
        spared = SPARED * float(least_deflection.min())
        self.spare = max(spared, NEAR * self.deflection)

        # by how much the modes of a state deflect a mesh at most
        vibrating = response.modes.frequency > 0.0
        shapes = response.modes.shape[vibrating]
        mesh_deflection = np.abs(shapes @ system.direction.T).max(axis=1)
        self.deflections = mesh_deflection[:, None] * (shapes @ system.mass)
        self.rates = 2.0 * np.pi * response.modes.frequency[vibrating]

    def distance(self, state: Array) -> float:
        """Return how far a state is from the response, over its mean deflection [1].

        Parameters
        ----------
        state : (2n,) at the start of a mesh period
        """
        n = len(state) // 2
        difference = (self.states - state).reshape(-1, 2, n) @ self.still.T
        difference[:, 1] /= self.rate
        nearest = float(np.abs(difference).max(axis=(1, 2)).min())
        return nearest / self.deflection

    def is_at(self, state: Array) -> bool:
        """Whether a strobed state is one of the response's."""
        return self.distance(state) <= NEAR

    def away(self, state: Array) -> float:
        """Return how far a state is, over the distance at which it counts as back [1].

        In permanent contact that is told by the deflection that the state adds, all
        modes in phase.

        Parameters
        ----------
        state : (2n,) at the start of a mesh period
        """
        if not self.permanent_contact:
            return self.distance(state) / NEAR
        n = self.deflections.shape[1]
        difference = self.states - state
        position = difference[:, :n] @ self.deflections.T
        speed = difference[:, n:] @ self.deflections.T
        amplitudes = np.hypot(position, speed / self.rates)
        return float(amplitudes.sum(axis=1).min()) / self.spare

    def periods_to(self, factor: float) -> float:
        """Return the mesh periods in which the slowest vibration shrinks by a factor.

        Parameters
        ----------
        factor : by which it shrinks, 1 if less [1]
        """
        if self.decay <= 0.0:
            return np.inf
        return float(np.log(max(factor, 1.0)) / self.decay)
