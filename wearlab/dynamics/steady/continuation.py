"""The response over speed.

Each speed starts from the response of the last, upwards and downwards.
Where two responses coexist, the two directions follow different branches; where a
branch ends, the response jumps, and the jump is located by bisection.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.steady.periodic import Periodic, periods_of
from wearlab.dynamics.steady.response import Response
from wearlab.dynamics.steady.shooting import Shooting
from wearlab.dynamics.steady.until_steady import change_over
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

MeshAt = Callable[[float], tuple[System, StageTables, float]]

SUDDEN = 0.05
"""Change of the range of deflection between two speeds that may be a jump, over the
largest range."""
BISECTIONS = 8
STAYS = 0.5
"""Share of the change that a jump keeps however near the two speeds are."""
SAME = 0.05
"""Distance of an orbit from the motion that leads to it, over the size of the state."""
AT_REST = 1e-9
"""Change of the strobed states over a period, relative to their size, from which the
motion goes nowhere."""
FOLLOWED = (1, 2, 3, 4)
"""Periods tried on a motion that comes to rest too slowly to show its period."""


class ResponseAtSpeed(NamedTuple):
    """The response at one speed.

    Parameters
    ----------
    speed : [rad/s]
    response : the steady response
    strobe : (n, 2n) states once per mesh period, after the transient
    """

    speed: float
    response: Response
    strobe: Array

    @property
    def extent(self) -> float:
        """Range of the mesh deflection over the response [m]."""
        response = self.response
        state = response.state[:, :-1, : len(response.system.load)]
        return float(
            np.ptp(state @ response.system.direction.T - response.tables.error[:, 0])
        )


class JumpOfResponse(NamedTuple):
    """A jump between two speeds, in the order in which they are passed.

    Parameters
    ----------
    before, after : the two speeds [rad/s]
    extent_before, extent_after : range of the mesh deflection [m]
    """

    before: float
    after: float
    extent_before: float
    extent_after: float


@dataclass(frozen=True)
class Continuation:
    """How a response is followed.

    Parameters
    ----------
    transient : mesh periods integrated at every speed before it counts; fewer where it
        comes to rest before
    strobe : mesh periods whose states are kept, once a period
    method : how long a period may be, and when an orbit attracts
    """

    transient: int = 200
    strobe: int = 64
    method: Periodic = field(default_factory=Periodic)

    def follow(
        self, mesh_at: MeshAt, speeds: Sequence[float], start: Array
    ) -> list[ResponseAtSpeed]:
        """Return the responses at speeds in their order, each from that of the last.

        Parameters
        ----------
        mesh_at : speed [rad/s] → system, tables and duration of a mesh period
        speeds : [rad/s]
        start : (2n,) state from which the first response is looked for
        """
        points: list[ResponseAtSpeed] = []
        state = start
        for speed in speeds:
            point = self.at(mesh_at, speed, state)
            points.append(point)
            state = point.response.end
        return points

    def at(self, mesh_at: MeshAt, speed: float, start: Array) -> ResponseAtSpeed:
        """Return the response that a motion settles on.

        Parameters
        ----------
        mesh_at : as in `follow`
        speed : [rad/s]
        start : (2n,) state of the motion
        """
        method = self.method
        state = start.copy()
        system, tables, period = mesh_at(speed)
        shooting = Shooting(system, tables, period, method)
        for transient in (self.transient, self.transient, 4 * self.transient):
            strobe = _settled_strobe(shooting, state, transient, method.longest)
            orbit = _orbit_of(shooting, strobe, method)
            if orbit is not None:
                turns = -(-self.strobe // orbit.period)
                strobe = np.tile(orbit.state[:, 0], (turns, 1))[: self.strobe]
                return ResponseAtSpeed(speed, shooting.counted(orbit), strobe)

        strobe, path = shooting.integrate(
            state, max(self.strobe, method.averaged), method.averaged
        )
        return ResponseAtSpeed(
            speed, shooting.aperiodic(path, 0.0), strobe[-self.strobe :]
        )

    def jumps(
        self, mesh_at: MeshAt, points: Sequence[ResponseAtSpeed]
    ) -> list[JumpOfResponse]:
        """Return where the responses of successive speeds lie on different branches.

        Parameters
        ----------
        mesh_at : as in `follow`
        points : responses at speeds, in their order
        """
        largest = max(point.extent for point in points)
        jumps = list[JumpOfResponse | None]()
        for slow, fast in pairwise(points):
            repeats = slow.response.period > 0 or fast.response.period > 0
            if repeats and abs(fast.extent - slow.extent) > SUDDEN * largest:
                jumps.append(self._located(mesh_at, slow, fast))
        return [jump for jump in jumps if jump is not None]

    def _located(
        self, mesh_at: MeshAt, first: ResponseAtSpeed, second: ResponseAtSpeed
    ) -> JumpOfResponse | None:
        """Bisect between two speeds.

        None when the change shrinks with the distance: it was only steep.
        """
        change = abs(second.extent - first.extent)
        for _ in range(BISECTIONS):
            middle = self.at(
                mesh_at, 0.5 * (first.speed + second.speed), first.response.end
            )
            if abs(middle.extent - first.extent) <= abs(middle.extent - second.extent):
                first = middle
            else:
                second = middle
            if abs(second.extent - first.extent) < STAYS * change:
                return None
        return JumpOfResponse(first.speed, second.speed, first.extent, second.extent)


def _settled_strobe(
    shooting: Shooting, state: Array, transient: int, longest: int
) -> Array:
    """Integrate ``state`` over a transient, or until it comes to rest.

    Return its last strobed states.
    """
    n = shooting.rows // 2
    periods = 0
    while True:
        strobe, _ = shooting.integrate(state, 2 * longest + 2)
        periods += 2 * longest + 2
        size = float(np.abs(strobe[:, :n]).max())
        last = strobe[-2 * longest :, :n]
        changes = (change_over(last, m).max() for m in range(1, longest + 1))
        at_rest = any(change <= AT_REST * size for change in changes)
        if periods >= transient or at_rest:
            return strobe


def _orbit_of(shooting: Shooting, strobe: Array, method: Periodic) -> Response | None:
    """Return the attracting orbit that strobed states approach, None: there is none."""
    n = shooting.rows // 2
    size = float(np.abs(strobe[-1, :n]).max()) or 1.0
    for m in _periods(strobe, method, shooting.rate):
        orbit = shooting.near(m, strobe[-1])
        if orbit is not None:
            difference = orbit.state[:, 0, :n] - strobe[-1, :n]
            distance = np.abs(difference).max(axis=1)
            if distance.min() <= SAME * size:
                return orbit
    return None


def _periods(strobe: Array, method: Periodic, rate: float) -> Iterator[int]:
    """Yield the periods that a motion shows, then those whose changes shrink."""
    shown = list(periods_of(strobe, method.longest, rate))
    yield from shown
    position = strobe[:, : strobe.shape[1] // 2]
    for m in FOLLOWED:
        changes = change_over(position, m)
        third = len(changes) // 3
        late = changes[-third:].max()
        early = changes[:third].max()
        if m not in shown and late < 0.5 * early:
            yield m
