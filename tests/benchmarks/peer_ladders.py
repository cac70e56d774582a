"""Work–precision curves of the peers: marched as long as told, closed by Newton, or
balanced by harmonics.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from best_peers import Bound, Peer, peers
from harmonic_balance import HarmonicBalance
from numpy.typing import NDArray
from transient import periods_to, transient

from wearlab.accuracy.equation import Motion, starting_state
from wearlab.accuracy.ladder import (
    TRANSIENT_SHARE,
    Rung,
    WorkPrecision,
    is_unresolved,
    timing,
)
from wearlab.accuracy.reference import Reference
from wearlab.accuracy.steady import Steady, relative_error
from wearlab.dynamics.rigid import balance_of
from wearlab.dynamics.steady.periodic import Periodic

Array = NDArray[np.float64]

AFFORDED = 2.0
"""A march that would take longer is left out [s]."""
LONGEST = 10.0
"""A peer whose rung took longer to measure is not asked for a finer one [s]."""
FORGOTTEN = 1e-3
"""Of an error made earlier so much is left when the error of going on and on is
measured [1]."""
HARMONICS = (10, 20, 40, 60, 80, 120, 160)
BALANCE = "harmonic balance"


class Course(NamedTuple):
    """What every peer has to integrate.

    Parameters
    ----------
    problem, known : the scene and its answer
    motion : its equation of motion
    starts : (2n,) the best of two static states, and the answer of a neighbouring wear
        state
    left : what is left of the transients from there after 0, 1, 2 … mesh periods [1]
    scale : (2n,) size of the states
    near : (n_periods, n_mesh, n_phases) mesh deflections of the neighbour at even
        phases [m]
    """

    problem: Steady
    known: Reference
    motion: Motion
    starts: tuple[Array, Array]
    left: tuple[Array, Array]
    scale: Array
    near: Array

    @property
    def periods(self) -> int:
        """Mesh periods of the orbit."""
        return len(self.known.force)

    def error(self, bound: Bound, tolerance: float, start: Array, count: int) -> float:
        """Return the relative error of the mesh force in the period that follows
        ``count`` others [1].
        """
        state = bound.march(start, count, tolerance, self.scale) if count else start
        if not np.isfinite(state).all():
            return float("inf")
        states = bound.states(
            state, self.periods, self.problem.phase, tolerance, self.scale
        )
        return relative_error(self.problem.force_of_states(states), self.known.force)


def course(problem: Steady, known: Reference) -> Course:
    """Return what the peers have to integrate to find an answer."""
    system = known.response.system
    tables = known.response.tables
    stiffness = tables.stiffness.sum(axis=3)
    mean = np.einsum("s,sm->m", tables.width, stiffness[:, 1])
    tight = problem.with_steps(len(tables.width) // 4, Periodic())
    near = problem.solve(tight, kinds=problem.near)
    warm = near.state[0, 0]
    colds = [starting_state(system, mean), starting_state(system, stiffness[0, 0])]
    left = [transient(problem, known, cold) for cold in colds]
    best = int(np.argmin([periods_to(one, FORGOTTEN) for one in left]))
    phase = np.arange(4 * max(HARMONICS)) / (4 * max(HARMONICS))
    return Course(
        problem,
        known,
        problem.motion(system),
        (colds[best], warm),
        (left[best], transient(problem, known, warm)),
        np.abs(known.response.state).max(axis=(0, 1)),
        np.asarray(tight.motions(near, tight.look(phase)).deflection),
    )


def peer_curves(
    problem: Steady, known: Reference, report: Callable[[str], None]
) -> Iterator[WorkPrecision]:
    """Yield the curves of the peers.

    Parameters
    ----------
    problem, known : the scene and its answer
    report : told who comes next
    """
    given = course(problem, known)
    for peer in peers():
        report(peer.name)
        yield peer_curve(given, peer)
    if not given.motion.rubs and not len(
        balance_of(known.response.system, problem.vibration.period).held
    ):
        report(BALANCE)
        yield balance_curve(given)


def peer_curve(given: Course, peer: Peer) -> WorkPrecision:
    """Return the curve of an integrator over its relative tolerance."""
    bound = peer.bind(given.motion)
    one = partial(closed_rung if peer.closes else rung, given, bound)
    one(peer.tolerances[0])  # compiles
    return WorkPrecision(
        peer.name,
        "relative",
        "mesh_force",
        "peer",
        laddered(given, one, peer.tolerances),
    )


def laddered(
    given: Course, one: Callable[[float], Rung | None], settings: Sequence[float]
) -> tuple[Rung, ...]:
    """Return the rungs of a peer until one takes too long or tells nothing."""
    rungs: list[Rung] = []
    for setting in settings:
        begun = time.perf_counter()
        found = one(setting)
        if found is None:
            break
        rungs.append(found)
        if time.perf_counter() - begun > LONGEST or is_unresolved(
            found, given.known.disagreement
        ):
            break
    return tuple(rungs)


def rung(given: Course, bound: Bound, tolerance: float) -> Rung | None:
    """Find the error that marching on and on would leave, then march as long as that is
    worth.

    None where the march cannot be afforded.
    """
    forgetting = periods_to(given.left[0], FORGOTTEN)
    begun = time.perf_counter()
    floor = given.error(bound, tolerance, given.known.start, forgetting)
    pace = (time.perf_counter() - begun) / (forgetting + given.periods)
    worth = TRANSIENT_SHARE * floor if np.isfinite(floor) else FORGOTTEN
    counts = [periods_to(left, worth) for left in given.left]
    if pace * max(counts) > AFFORDED:
        return None
    cold, warm = (
        timing(
            partial(bound.march, start, count + given.periods, tolerance, given.scale)
        )
        for start, count in zip(given.starts, counts, strict=True)
    )
    return Rung(
        tolerance,
        given.error(bound, tolerance, given.starts[0], counts[0]),
        cold,
        np.nan,
        warm,
    )


def closed_rung(given: Course, bound: Bound, tolerance: float) -> Rung:
    """Close the orbit by Newton's method around the integrator, cold
    and from the neighbour.
    """
    system = given.known.response.system
    free = len(balance_of(system, given.problem.vibration.period).held) > 0
    close = partial(
        bound.close,
        periods=given.periods,
        tolerance=tolerance,
        scale=given.scale,
        free=free,
    )
    found, marched = close(given.starts[0])
    if not np.isfinite(found).all():
        return Rung(tolerance, np.inf, np.nan, marched)
    cold, warm = (timing(partial(close, start)) for start in given.starts)
    return Rung(tolerance, given.error(bound, tolerance, found, 0), cold, marched, warm)


def balance_curve(given: Course) -> WorkPrecision:
    """Return the curve of harmonic balance over the harmonics of a mesh period."""
    rungs = laddered(given, partial(balance_rung, given), HARMONICS)
    return WorkPrecision(BALANCE, "harmonics", "mesh_force", "peer", rungs)


def balance_rung(given: Course, harmonics: int) -> Rung:
    """Balance so many harmonics of a mesh period, cold and continued
    from the neighbour.
    """
    balance = HarmonicBalance(given.motion, harmonics * given.periods, given.periods)
    near = balance.harmonics_of(
        np.moveaxis(given.near, 1, 0).reshape(given.near.shape[1], -1)
    )
    found = balance.solve()
    if found is None:
        return Rung(harmonics, np.inf, np.nan, np.nan)
    phase = given.problem.phase
    error = relative_error(
        given.problem.force(balance.motions(found, phase), phase), given.known.force
    )
    return Rung(
        harmonics,
        error,
        timing(balance.solve),
        np.nan,
        timing(partial(balance.solve, near)),
    )
