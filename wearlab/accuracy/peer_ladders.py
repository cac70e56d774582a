"""Work–precision curves of the peers, each told how many mesh periods to march."""

import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.accuracy.cells import Motion, starting_state
from wearlab.accuracy.ladder import SHARE, Curve, Rung, best_time, told
from wearlab.accuracy.peers import Peer, peers
from wearlab.accuracy.reference import Reference
from wearlab.accuracy.steady import Steady, relative_error
from wearlab.accuracy.transient import periods_to, transient
from wearlab.dynamics.periodic import Periodic

Array = NDArray[np.float64]

AFFORDED = 2.0
"""A march that would take longer is timed over its first periods, and scaled to all of them [s]."""
LONGEST = 10.0
"""A peer whose rung took longer to measure is not asked for a finer one [s]."""
FORGOTTEN = 1e-3
"""Of an error made earlier so much is left when the error of going on and on is measured [1]."""


class Timed(NamedTuple):
    """A wall time [s] and the share of it that was measured; the rest is scaled from that [1]."""

    seconds: float
    share: float


class Course(NamedTuple):
    """What every peer has to integrate.

    Parameters
    ----------
    problem, known : the scene and its answer
    motion : its equation of motion
    starts : (2n,) the static equilibrium, and the answer of a neighbouring wear state
    left : what is left of the transients from there after 0, 1, 2 … mesh periods [1]
    scale : (2n,) size of the states
    """

    problem: Steady
    known: Reference
    motion: Motion
    starts: tuple[Array, Array]
    left: tuple[Array, Array]
    scale: Array

    def error(self, peer: Peer, tolerance: float, start: Array, count: int) -> float:
        """Return the relative error of the mesh force in the period that follows ``count`` others [1]."""
        periods = len(self.known.force)
        turns = count + np.arange(periods)[:, None] + self.problem.phase
        times, end = turns.ravel() * self.motion.period, (count + periods) * self.motion.period
        states = peer.march(self.motion, start, end, tolerance, self.scale, times)
        if len(states) != turns.size:
            return float("inf")
        force = self.problem.force_of_states(states.reshape(*turns.shape, -1))
        return relative_error(force, self.known.force)

    def seconds(self, peer: Peer, tolerance: float, start: Array, periods: int, pace: float) -> Timed:
        """Return the wall time of so many mesh periods, those that can be afforded timed.

        Parameters
        ----------
        peer, tolerance, start : who marches, how, and from where
        periods : how many are wanted
        pace : about what one takes [s]
        """
        timed = min(periods, max(1, int(AFFORDED / pace)))
        end = timed * self.motion.period
        march = partial(peer.march, self.motion, start, end, tolerance, self.scale, None)
        return Timed(best_time(march, most=8) * periods / timed, timed / periods)


def course(problem: Steady, known: Reference) -> Course:
    """Return what the peers have to integrate to find an answer."""
    system, tables = known.response.system, known.response.tables
    mean = np.einsum("s,sm->m", tables.width, tables.stiffness.sum(axis=3)[:, 1])
    cold = starting_state(system, mean)
    tight = problem.with_steps(len(tables.width) // 4, Periodic())
    warm = problem.solve_near(tight).state[0, 0]
    left = transient(problem, known, cold), transient(problem, known, warm)
    scale = np.abs(known.response.state).max(axis=(0, 1))
    return Course(problem, known, problem.motion(system), (cold, warm), left, scale)


def peer_curves(problem: Steady, known: Reference, report: Callable[[str], None]) -> Iterator[Curve]:
    """Yield the curves of the peers.

    Parameters
    ----------
    problem, known : the scene and its answer
    report : told who comes next
    """
    given = course(problem, known)
    for peer in peers():
        report(peer.name)
        peer.march(given.motion, known.start, given.motion.period, peer.tolerances[0], given.scale, None)
        rungs: list[Rung] = []
        for tolerance in peer.tolerances:
            begun = time.perf_counter()
            rungs.append(rung(given, peer, tolerance))
            if time.perf_counter() - begun > LONGEST or told(rungs[-1], known.disagreement):
                break
        yield Curve(peer.name, "relative", "mesh_force", "peer", tuple(rungs))


def rung(given: Course, peer: Peer, tolerance: float) -> Rung:
    """Find the error that marching on and on would leave, then march as long as that is worth.

    Where the march cannot be afforded its error is that of going on and on, and the part of it that is left
    of the transient.
    """
    known, periods = given.known, len(given.known.force)
    forgetting = periods_to(given.left[0], FORGOTTEN)
    begun = time.perf_counter()
    floor = given.error(peer, tolerance, known.start, forgetting)
    pace = (time.perf_counter() - begun) / (forgetting + periods)
    worth = SHARE * floor if np.isfinite(floor) else FORGOTTEN
    counts = [periods_to(left, worth) for left in given.left]
    cold, warm = (
        given.seconds(peer, tolerance, start, count + periods, pace)
        for start, count in zip(given.starts, counts, strict=True)
    )
    error = (1.0 + SHARE) * floor
    if cold.share == 1.0:
        error = given.error(peer, tolerance, given.starts[0], counts[0])
    return Rung(tolerance, error, cold.seconds, float("nan"), warm.seconds, cold.share)
