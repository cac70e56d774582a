"""The default method: Newton shooting on the period map.

Integration where no simple orbit attracts.
"""

from collections.abc import Iterable
from itertools import islice
from typing import ClassVar, Self

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.integrators.count import settling_periods
from wearlab.dynamics.steady.integrate import LOCATED, PERMANENT
from wearlab.dynamics.steady.response import Response
from wearlab.dynamics.steady.shooting import OrbitSettings, Shooting
from wearlab.dynamics.steady.until_steady import (
    STABILITY_OF_RK4,
    StabilityLimit,
    change_over,
    in_one_unit,
)
from wearlab.dynamics.system import System
from wearlab.gears.specification import GearError
from wearlab.mesh.stages import StageTables

CLEAR = 0.005
"""Distance of the largest multiplier from 1 that lets a neighbour's derivative speak
for an orbit: chords shrink as fast as they must only where no multiplier has gone a
fifth of its way to 1."""
PASSES_NEAR = 8
"""Passes of a shooting that starts from a neighbour's orbit."""
PASSES_TO_SIMPLE = 12
"""Passes of a shooting from a motion that may be on its way to an orbit."""
TRANSIENT = 50
"""Mesh periods that a small system is integrated before it is shot at again."""
CANDIDATES = 3
"""Periods shot at, of those a motion shows: what comes back after m mesh periods does
after 2m and 3m too."""
MAX_STEPS = 3_000_000
"""Steps of the longest integration of a small system: about a second or two."""
TRANSIENT_LARGE = 30
AVERAGED_LARGE = 24
"""Mesh periods that a larger system is integrated, and is averaged over, when no orbit
is found."""
TRANSIENT_SETTLED = 2
AVERAGED_SETTLED = 8
"""The same from a neighbour whose motion does not repeat either: wear follows the mean
of many such states, which each go on from the last."""
LONGEST_LARGE = 4
"""Longest period that a larger system is shot at then: each pass costs as many maps."""
DYING = 0.3
"""Spread of the later half of strobed states over that of the earlier, of a motion on
its way to an orbit."""
FURTHEST = 1.0
"""Deflection of a mesh that no teeth have: a motion that reaches it grows without bound
[m]."""


class Unbounded(GearError):
    """The motion grows without bound, as that of undamped flanks in contact can."""


class Periodic(OrbitSettings):
    """Newton shooting on the period map.

    Its derivative is the exact one of the map computed.

    The first pass takes the affine map of a mesh that never changes contact: where that
    is what happens, it is exact. Else passes locate every change. Where no orbit over a
    mesh period attracts, the motion is integrated, and an orbit over m ≤ ``longest``
    periods looked for where it shows one; if none attracts, the response is aperiodic
    and its last ``averaged`` periods are returned. (Parker & Chua 1989, ch. 5; Leine &
    Nijmeijer 2004, ch. 7.) Parameters: see
    `wearlab.dynamics.steady.shooting.OrbitSettings`.
    """

    stability: ClassVar[StabilityLimit | None] = STABILITY_OF_RK4
    exact_when_large: ClassVar[bool] = True

    @classmethod
    def at_tolerance(cls, tolerance: float) -> Self:
        """Return the method of a scene.

        Parameters
        ----------
        tolerance : ``numerics.tolerance`` [1]
        """
        return cls(closed=1e-3 * tolerance)

    def solve(
        self,
        system: System,
        tables: StageTables,
        period: float,
        start: Response | None = None,
    ) -> Response:
        """Return the steady response.

        Parameters
        ----------
        system : the equation of motion
        tables : the mesh at the stages
        period : duration of a mesh period [s]
        start : response of a neighbouring case to start from
        """
        shooting = Shooting(system, tables, period, self)
        if start is not None and start.state.shape[2] != shooting.rows:
            start = None
        aperiodic = start is not None and start.period == 0
        orbit = None if start is None or aperiodic else self._near(shooting, start)

        # A large system is integrated from a neighbour near which no orbit attracts.
        integrates = start is not None and not shooting.small
        no_orbit = aperiodic or (shooting.loaded and not shooting.singular)
        if orbit is None and not (integrates and no_orbit):
            orbit = self._from_rest(shooting)
        if orbit is None or orbit.largest > 1.0 + self.margin:
            orbit = self._integrated(shooting, start)
        return shooting.counted(orbit)

    def _near(self, shooting: Shooting, start: Response) -> Response | None:
        """Return the orbit that attracts near a neighbour's, None: there is none."""
        permanent = start.period == 1 and start.counts.newton_iterations == 1
        clear = start.verdict.unique and abs(start.multipliers[0]) < 1.0 - CLEAR
        if clear and not shooting.small:
            orbit = shooting.chord(start, PERMANENT if permanent else LOCATED)
            if orbit is not None:
                return orbit

        attempts = [(LOCATED, PASSES_NEAR)]
        if permanent:
            attempts.insert(0, (PERMANENT, 1))
        for contact, passes in attempts:
            orbit = shooting.shoot(
                start.period,
                start.state[0, 0].copy(),
                contact=contact,
                max_passes=passes,
            )
            if orbit is not None and orbit.largest <= 1.0 + self.margin:
                return orbit
        return None

    def _from_rest(self, shooting: Shooting) -> Response | None:
        """Shoot from the loaded mesh, then from a state that has been integrated."""
        state = np.zeros(shooting.rows)
        orbit = shooting.shoot(1, state, contact=PERMANENT)
        if orbit is not None or shooting.singular:
            return orbit or shooting.family(state)
        if not (shooting.loaded or shooting.grounded):
            member = shooting.family(np.zeros(shooting.rows))
            if member is not None:
                return member

        shooting.integrate(state, TRANSIENT if shooting.small else TRANSIENT_LARGE)
        return shooting.shoot(1, state)

    def _integrated(self, shooting: Shooting, start: Response | None) -> Response:
        """Integrate until a period shows, shoot on it.

        Otherwise return the aperiodic response.

        Raises
        ------
        Unbounded : the motion grows without bound
        """
        state = np.zeros(shooting.rows) if start is None else start.end.copy()
        n = shooting.rows // 2
        settled = start is not None and start.period == 0
        averaged = self.averaged
        longest = self.longest
        if not shooting.small:
            averaged = min(averaged, AVERAGED_SETTLED if settled else AVERAGED_LARGE)
            longest = LONGEST_LARGE

        for count in self.transients(shooting, settled):
            shooting.integrate(state, count)
            strobe, kept = shooting.integrate(
                state, max(averaged, 2 * longest), averaged
            )
            _require_bounded(shooting.system, strobe)
            orbit = self._shown_by(shooting, strobe, longest, settled)
            if orbit is not None:
                return orbit

        size = float(np.abs(strobe[:, :n]).max()) or 1.0
        spread = float(np.ptp(strobe[:, :n], axis=0).max())
        return shooting.aperiodic(kept, spread / size)

    def _shown_by(
        self, shooting: Shooting, strobe: Array, longest: int, settled: bool
    ) -> Response | None:
        """Return the attracting orbit that strobed states (n, 2n) show or lead to."""
        candidates = CANDIDATES if shooting.small else 1
        for m in islice(periods_of(strobe, longest, shooting.rate), candidates):
            orbit = shooting.near(m, strobe[-1])
            if orbit is not None:
                return orbit

        position = strobe[:, : shooting.rows // 2]
        early, late = (
            np.ptp(half, axis=0).max() for half in np.array_split(position, 2)
        )
        if not shooting.small and settled and late > DYING * early:
            return None
        # A motion that dies out slowly shows no period; it may be on its way to an
        # orbit that attracts.
        simple = shooting.shoot(1, strobe[-1].copy(), max_passes=PASSES_TO_SIMPLE)
        if simple is not None and simple.largest < 1.0 - self.margin:
            return simple
        return None

    def transients(self, shooting: Shooting, settled: bool = False) -> list[int]:
        """Return the mesh periods to integrate between looks for a period.

        They add up to what a motion takes to die out: one transient, three more, and
        as many again as the damping asks for, in two pieces: a motion that dies out
        by e every thousand periods is not aperiodic because it has not settled after
        two thousand. Large systems are integrated once, as long as two dozen solves
        take: what does not settle in that is averaged, and a life goes on from where
        it ended.

        Parameters
        ----------
        shooting : of the system
        settled : whether it starts from a neighbour whose motion does not repeat
        """
        if not shooting.small:
            longest = TRANSIENT_SETTLED if settled else TRANSIENT_LARGE
            return [min(self.transient, longest)]
        if settled:
            return [self.transient // 5]

        planned = [self.transient, 3 * self.transient]
        settling = settling_periods(shooting.system, shooting.tables, shooting.period)
        settling = min(settling, MAX_STEPS / shooting.steps)
        left = int(settling) - sum(planned)
        if left <= 0:
            return planned
        third = -(-left // 3)
        return [*planned, third, 2 * third]


def _require_bounded(system: System, strobe: Array) -> None:
    """Refuse a motion whose strobed states (n, 2n) deflect a mesh beyond all bounds."""
    n = len(system.load)
    deflection = np.abs(strobe[:, :n] @ system.direction.T)
    if not (deflection < FURTHEST).all():
        raise Unbounded("scene.dynamics: the motion grows without bound")


def periods_of(strobe: Array, longest: int, rate: float) -> Iterable[int]:
    """Yield the periods m after which strobed states come back, shortest first.

    A state has come back when it differs by less than a thousandth of the spread of all
    states, or by a millionth of their size.

    Parameters
    ----------
    strobe : (n_states, 2n)
    longest : the longest period tried [mesh periods]
    rate : by which velocities are measured [1/s]
    """
    last = in_one_unit(strobe[-2 * longest :], rate)
    limit = 1e-3 * np.ptp(last, axis=0).max() + 1e-6 * np.abs(last).max()
    for m in range(1, longest + 1):
        if change_over(last, m).max() <= limit:
            yield m
