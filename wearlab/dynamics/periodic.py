"""The default method: Newton shooting on the period map; marching where no simple orbit attracts."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.between import TablesWithin
from wearlab.dynamics.folded import orbit_held_together
from wearlab.dynamics.known import known_of
from wearlab.dynamics.parting import orbit_of_small
from wearlab.dynamics.period_map import MIDDLE, TOUCHING, TOUCHING_FIRST
from wearlab.dynamics.response import Response, Verdict
from wearlab.dynamics.shooting import CLOSED, Orbit, Shooting
from wearlab.dynamics.steps import slowest_decay
from wearlab.dynamics.structure import in_registers
from wearlab.dynamics.system import System
from wearlab.dynamics.touching import Parted, parting
from wearlab.gears.specification import GearError
from wearlab.mesh.stages import StageTables, halved

CLEAR = 0.005
"""Distance of the largest multiplier from 1 that lets a neighbour's derivative speak for an orbit: chords
shrink as fast as they must only where no multiplier has gone a fifth of its way to 1."""

BARELY = 0.1
"""Distance of parted flanks, over the largest deflection, from which an orbit may touch again: a branch on
which flanks barely part ends where they touch. A try that fails costs half an orbit with parting flanks."""
MOST_BY_MIDDLE, MOST_LOCATED = 12, 6
"""Passes by the contact of the steps' middles, and those with located changes that finish what it began."""
CANDIDATES = 3
"""Periods shot at, of those a march shows: what comes back after m mesh periods does after 2m and 3m too."""

MOST_MARCHED = 3_000_000
"""Steps of the longest march of a system in registers: about a second or two."""
TRANSIENT_LARGE, AVERAGED_LARGE = 30, 24
"""Mesh periods that a larger system marches, and is averaged over, when no orbit is found."""
LONGEST_LARGE = 4
"""Longest period that a larger system is shot at once it is marched: each pass costs as many located maps."""
DYING = 0.3
"""Spread of the later half of strobed states over that of the earlier, of a motion on its way to an orbit."""
REMEMBERED = 1e-6
"""Share of a motion that is left when it has died out."""


class Unbounded(GearError):
    """The motion grows without bound, as that of undamped flanks that never part can."""


@dataclass(frozen=True)
class Periodic:
    """Newton shooting on a period map; its derivative is the exact one of the map computed.

    A mesh that never changes contact is affine and takes one pass. Small systems on few long steps where they
    are given: pieces of their motion are power series (`orbit_of_small`). Where that finds no orbit that
    attracts, on an RK4 map with located changes. Multipliers beyond 1 + margin, or no
    convergence: march, look for a period m ≤ ``longest``, shoot on m periods; if none attracts, the response
    is aperiodic and its last ``averaged`` periods are returned. (Parker & Chua 1989, ch. 5; Leine &
    Nijmeijer 2004, ch. 7 for the saltation of tangents.)

    Parameters
    ----------
    margin : an orbit attracts when max |μ| < 1 − margin
    transient : mesh periods to march before a period is looked for
    longest : the longest period tried [mesh periods]
    averaged : mesh periods kept of an aperiodic response
    resolved : part of the mesh forces that steps for touching flanks may leave unresolved [1]
    closed : size of the last step by a neighbour's derivative, over that of the state [1]
    """

    margin: float = 1e-3
    transient: int = 500
    longest: int = 24
    averaged: int = 200
    resolved: float = np.inf
    closed: float = CLOSED

    def solve(
        self, system: System, tables: StageTables, period: float, start: Response | None = None
    ) -> Response:
        """Return the steady response.

        Parameters
        ----------
        system : the one form
        tables : the mesh at the stages
        period : duration of a mesh period [s]
        start : response of a neighbouring case to start from
        """
        if in_registers(system):
            return self._shoot(system, tables, period, start)
        held = self.held_together(system, tables, period, start)
        if isinstance(held, Response):
            return held
        # Where flanks part, steps go in twos and not in fours: half as long they are as accurate.
        response = self._shoot(system, halved(tables), period, start, held)
        return replace(response, state=np.ascontiguousarray(response.state[:, ::2]), tables=tables)

    def tries_few_steps(self, system: System, start: Response | None) -> bool:
        """Whether `on_few_steps` looks at its tables at all, from a neighbour."""
        return start is None or start.pieces is not None or self._may_hold_together(system, start)

    def _may_hold_together(self, system: System, start: Response) -> bool:
        """Whether no flank parts on a neighbour, or just barely."""
        if start.counts.newton_iterations == 1:
            return True
        return start.period == 1 and not in_registers(system) and parting(start) <= BARELY

    def on_few_steps(
        self,
        system: System,
        tables: StageTables,
        period: float,
        start: Response | None = None,
        between: TablesWithin | None = None,
    ) -> Response | None:
        """Return the response of a small system on the few long steps that serve touching flanks.

        Its flanks touch, or they part on an orbit over one mesh period. None where there is no such orbit
        that attracts, where it is not resolved, or where the neighbour is on none. Parameters as in `solve`,
        and what the tables were taken of.
        """
        if start is not None and start.pieces is not None:
            at = start.state[0, 0]
        else:
            held = self.held_together(system, tables, period, start, between)
            if (
                not isinstance(held, Parted)
                or not in_registers(system)
                or system.friction_constant is not None
            ):
                return held if isinstance(held, Response) else None
            at = held.state
        return self.parted(system, tables, period, at, between)

    def parted(
        self,
        system: System,
        tables: StageTables,
        period: float,
        at: Array,
        between: TablesWithin | None = None,
    ) -> Response | None:
        """Return the orbit near a state (2n,) of a small system whose flanks part, see `on_few_steps`."""
        known = known_of(system, tables, period)
        return orbit_of_small(known, tables, self.margin, at, self.resolved, between, self.closed)

    def held_together(
        self, system: System, tables: StageTables, period: float, start: Response | None = None,
        between: TablesWithin | None = None,
    ) -> Response | Parted | None:  # fmt: skip
        """Return the response on which no flank parts, on steps for collocation, see `touching_orbit`.

        None where there is none, where it is not resolved, or where the neighbour is on another branch: its
        flanks part, and not just barely. Parameters as in `on_few_steps`.
        """
        if start is not None and not self._may_hold_together(system, start):
            return None
        return orbit_held_together(system, tables, period, self.margin, start, self.resolved, between)

    def _shoot(
        self, system: System, tables: StageTables, period: float, start: Response | None,
        held: Parted | None = None,
    ) -> Response:  # fmt: skip
        shooting = Shooting(system, tables, period, self.closed, by_sections=True)
        if start is not None and start.period == 0 and not in_registers(system):
            return self._march(shooting, None, start)  # which looks for a simple orbit after so many periods
        orbit = self._simple_orbit(shooting, start, held)
        if orbit is not None and orbit.largest <= 1.0 + self.margin:
            return self._respond(shooting, orbit)
        return self._march(shooting, orbit, start)

    def _simple_orbit(self, shooting: Shooting, start: Response | None, held: Parted | None) -> Orbit | None:
        """Shoot from the neighbour, then from the loaded mesh, then from a marched state."""
        if start is not None and start.period > 0 and start.state.shape[2] == shooting.rows:
            large = not in_registers(shooting.system)
            sections = start.sections > 1 or not shooting.turns(start)  # or a third of the work would do
            if large and sections and start.verdict.unique and abs(start.multipliers[0]) < 1.0 - CLEAR:
                orbit = shooting.chord(start)
                if orbit is not None:
                    return orbit
            if start.period == 1 and start.counts.newton_iterations == 1 and held is None:
                # One pass was exact there, so its contact never changed; most likely it still does not, and
                # the affine map of a loaded mesh is half the work: no step asks which pairs touch.
                orbit = shooting.shoot(1, start.state[0, 0].copy(), touch=TOUCHING, most=1)
                if orbit is not None and orbit.largest <= 1.0 + self.margin:
                    return orbit
            orbit = self._orbit(shooting, start.period, start.state[0, 0].copy(), most=8)
            if orbit is not None and orbit.largest <= 1.0 + self.margin:
                return orbit
            if not in_registers(shooting.system) and shooting.loaded and not shooting.singular:
                return None  # near the neighbour no orbit attracts: it is marched from there
        state = np.zeros(shooting.rows)
        if in_registers(shooting.system):
            orbit = shooting.shoot(1, state, touch=TOUCHING)
        elif held is None:
            orbit = self._by_middle(shooting, 1, state, TOUCHING_FIRST)
        else:
            state, balance = held.state.copy(), shooting.balance
            if balance is not None:
                balance.size[:] = held.sizes
            orbit = self._by_middle(shooting, 1, state)
        if orbit is not None or shooting.singular:
            return orbit or shooting.family(state)
        if not (shooting.loaded or shooting.grounded):
            if (member := shooting.family(np.zeros(shooting.rows))) is not None:
                return member
        shooting.march(state, 50)
        shooting.marched = None if in_registers(shooting.system) else state.copy()
        return self._orbit(shooting, 1, state)

    def _orbit(self, shooting: Shooting, periods: int, state: Array, most: int = 25) -> Orbit | None:
        """Shoot from a state; a large system first with the contact of its steps' middles."""
        if in_registers(shooting.system):
            return shooting.shoot(periods, state, most=most)
        return self._by_middle(shooting, periods, state)

    def _by_middle(self, shooting: Shooting, periods: int, state: Array, touch: int = MIDDLE) -> Orbit | None:
        """Shoot with the contact of the steps' middles, then locate its changes on the way to the orbit.

        A map whose contact changes by whole steps is cheap and nearly right; what it leads to takes a few
        trajectories, located, with its derivative, or where that is not clear of 1 some located passes.
        """
        near = shooting.shoot(periods, state, touch=touch, most=MOST_BY_MIDDLE)
        if near is None or shooting.has_failed_from(near.state[0, 0]):
            return None
        if near.largest < 1.0 - CLEAR:
            orbit = shooting.chord(near)
            if orbit is not None:
                return orbit
        orbit = shooting.shoot(near.periods, near.state[0, 0].copy(), most=MOST_LOCATED)
        if orbit is not None and orbit.largest <= 1.0 + self.margin:
            return orbit
        shooting.failed.append(near.state[0, 0].copy())
        return None

    def _march(self, shooting: Shooting, simple_orbit: Orbit | None, start: Response | None) -> Response:
        """March until a period shows, shoot on it; otherwise return the aperiodic response.

        Raises
        ------
        Unbounded : the motion grows without bound
        """
        shooting.turning = None  # what has to be marched may have lost its symmetry
        state = np.zeros(shooting.rows) if start is None else start.end.copy()
        state = state if shooting.marched is None else shooting.marched
        settled = start is not None and start.period == 0
        large = not in_registers(shooting.system)
        averaged, transients = self.averaged, self.transients(shooting)
        averaged = min(averaged, AVERAGED_LARGE) if large else averaged
        longest, candidates = (LONGEST_LARGE, 1) if large else (self.longest, CANDIDATES)
        for count in (transients[0] // 5,) if settled else transients:
            shooting.march(state, count)
            strobe, orbit = shooting.march(state, max(averaged, 2 * longest), averaged)
            if not np.isfinite(strobe).all():
                raise Unbounded("scene.dynamics: the motion grows without bound")
            for m in islice(periods_of(strobe, longest, shooting.rate), candidates):
                orbit_m = self._orbit(shooting, m, strobe[-1].copy())
                if orbit_m is None and shooting.singular and m == 1:
                    orbit_m = shooting.family(strobe[-1])
                if orbit_m is not None and orbit_m.largest <= 1.0 + self.margin:
                    return self._respond(shooting, orbit_m)
            if large and settled and not dies_out(strobe):
                continue
            # A motion that dies out slowly shows no period; it may be on its way to an orbit that attracts.
            simple = self._orbit(shooting, 1, strobe[-1].copy(), most=12)
            if simple is not None and simple.largest < 1.0 - self.margin:
                return self._respond(shooting, simple)
        if simple_orbit is not None and simple_orbit.largest <= 1.0 + self.margin:
            return self._respond(shooting, simple_orbit)
        spread = float(np.ptp(strobe[:, : shooting.rows // 2], axis=0).max())
        size = float(np.abs(strobe[:, : shooting.rows // 2]).max()) or 1.0
        return shooting.aperiodic(orbit, spread / size)

    def transients(self, shooting: Shooting) -> list[int]:
        """Return the mesh periods to march between looks for a period, until a motion has died out.

        One transient, three more, and as many again as the damping asks for, in two pieces: a motion that
        dies out by e every thousand periods is not aperiodic because it has not settled after two thousand.
        Large systems march once, as long as two dozen solves of touching meshes take: what does not settle
        in that is averaged, and a life goes on from where it ended.
        """
        if not in_registers(shooting.system):
            return [min(self.transient, TRANSIENT_LARGE)]
        known = [self.transient, 3 * self.transient]
        wanted = settling_periods(shooting.system, shooting.tables, shooting.period)
        wanted = min(wanted, MOST_MARCHED / shooting.steps)
        left = int(wanted) - sum(known)
        return known if left <= 0 else [*known, -(-left // 3), 2 * -(-left // 3)]

    def _respond(self, shooting: Shooting, orbit: "Orbit") -> Response:
        unique = orbit.unique and (shooting.loaded or shooting.grounded)
        verdict = Verdict(True, orbit.largest < 1.0 - self.margin, unique, True)
        return shooting.response(orbit, verdict)


def settling_periods(system: System, tables: StageTables, period: float) -> float:
    """Return the mesh periods in which the slowest free motion of touching meshes dies out, inf undamped.

    Parameters
    ----------
    system, tables, period : as for `Periodic.solve`; the mean mesh stiffness counts
    """
    slowest = slowest_decay(system, tables.mean_stiffness)
    return float(-np.log(REMEMBERED) / (slowest * period)) if slowest > 0.0 else np.inf


def dies_out(strobe: Array) -> bool:
    """Whether strobed states (n, 2n) scatter less and less."""
    early, late = np.array_split(strobe[:, : strobe.shape[1] // 2], 2)
    return bool(np.ptp(late, axis=0).max() <= DYING * np.ptp(early, axis=0).max())


def periods_of(strobe: Array, longest: int, rate: float) -> Iterable[int]:
    """Yield the periods m after which strobed states (n, 2n) come back, shortest first.

    A state has come back when it differs by less than a thousandth of the spread of all states, or by a
    millionth of their size.
    """
    n = strobe.shape[1] // 2
    scaled = np.hstack([strobe[:, :n], strobe[:, n:] / rate])
    last = scaled[-2 * longest :]
    limit = 1e-3 * np.ptp(last, axis=0).max() + 1e-6 * np.abs(last).max()
    for m in range(1, longest + 1):
        if np.abs(last[m:] - last[:-m]).max() <= limit:
            yield m
