"""Solvers that a user would pick instead, in the same run: SciPy always, CyRK where it is installed.

Each marches on the compiled equation of motion, called from Python, from the static equilibrium until no more
is left of the transient than its tolerance, which the Floquet multiplier tells for free. That says what such
a call costs, not what these methods can: compiled into one piece with their right-hand side and landing on
the jumps of the stiffness they race in ``tests/validation/races.py``, and are far faster.
"""

import time
from collections.abc import Callable, Iterator
from functools import partial
from importlib.util import find_spec
from typing import Any, NamedTuple

import numba
import numpy as np

from wearlab.accuracy.cells import Motion, starting_state
from wearlab.accuracy.ladder import SHARE, Rung, WorkPrecision, fine_enough
from wearlab.accuracy.motion import motion_of
from wearlab.accuracy.reference import Reference
from wearlab.accuracy.steady import Steady, relative_error
from wearlab.arrays import Array

Rates = Callable[[float, Array], Array]

METHODS = ("RK45", "DOP853")
TOLERANCES = tuple(10.0 ** -np.arange(3.0, 9.5, 1.0))
LONGEST = 10.0
"""A march that would take longer is not begun [s]."""


class Peer(NamedTuple):
    """One foreign integrator: its name, and a function with the arguments of `scipy.integrate.solve_ivp`."""

    name: str
    solve: Callable[..., Any]


def peers() -> Iterator[Peer]:
    """Yield what is installed."""
    from scipy.integrate import solve_ivp

    yield from (Peer(f"SciPy {method}", partial(solve_ivp, method=method)) for method in METHODS)
    if not missing_peers():
        from CyRK import pysolve_ivp

        yield from (Peer(f"CyRK {method}", partial(pysolve_ivp, method=method)) for method in METHODS)


def missing_peers() -> tuple[str, ...]:
    """Return the peers that are not installed (``pip install wearlab[peers]``)."""
    return () if find_spec("CyRK") is not None else ("CyRK",)


def peer_curves(problem: Steady, known: Reference, report: Callable[[str], None]) -> Iterator[WorkPrecision]:
    """Yield the curves of the peers over their relative tolerance, where a transient dies in time.

    Parameters
    ----------
    problem, known : the scene and its answer
    report : told who comes next
    """
    system, tables = known.response.system, known.response.tables
    start = starting_state(system, np.einsum("s,sm->m", tables.width, tables.stiffness.sum(axis=3)[:, 1]))
    given = bound(problem.motion(system))
    for peer in peers():
        report(peer.name)
        rungs: list[Rung] = []
        for tolerance in TOLERANCES:
            rung = _rung(peer, problem, given, known, tolerance, start)
            if rung is None:
                break
            rungs.append(rung)
            if fine_enough(rung, known.disagreement):
                break
        if rungs:
            yield WorkPrecision(peer.name, "relative", "mesh_force", "peer", tuple(rungs))


def periods_to(known: Reference, left: float) -> float:
    """Return the mesh periods until so much is left of a transient; infinite where it does not die."""
    largest = known.multiplier ** (1.0 / len(known.force))
    return float(np.ceil(np.log(left) / np.log(largest))) if 0.0 < largest < 1.0 else float("inf")


def bound(given: Motion) -> Rates:
    """Return ẏ (2n,) of time and state, compiled for one wear state: its tables cost no call anything."""

    @numba.njit
    def rates(time: float, y: Any) -> Any:
        return motion_of(time, y, given)

    return rates


def marched(peer: Peer, given: Rates, start: Array, times: Array, tolerance: float, scale: Array) -> Any:
    """Return the states (n_times, 2n) at ascending times [s], None where the peer gives up.

    Parameters
    ----------
    peer, given : who integrates what
    start : (2n,) state at time 0
    times : (n_times,) when states are wanted [s]
    tolerance, scale : relative tolerance, and size of the states (2n,)
    """
    solution = peer.solve(
        given, (0.0, float(times[-1])), np.ascontiguousarray(start), t_eval=times, rtol=tolerance,
        atol=tolerance * scale,
    )  # fmt: skip
    return np.array(solution.y).T[: len(times)] if solution.success else None


def _rung(
    peer: Peer, problem: Steady, given: Rates, known: Reference, tolerance: float, start: Array
) -> Rung | None:
    """Return a setting of a peer, None where its march would take too long."""
    scale, periods = np.abs(known.response.state).max(axis=(0, 1)), periods_to(known, SHARE * tolerance)
    period = np.array([problem.vibration.period])
    for _ in range(2):  # the first compiles
        begun = time.perf_counter()
        marched(peer, given, known.start, period, tolerance, scale)
    if periods * (time.perf_counter() - begun) > LONGEST:
        return None
    turns = periods + np.arange(len(known.force))[:, None] + problem.phase
    begun = time.perf_counter()
    motion = marched(peer, given, start, np.ravel(turns) * problem.vibration.period, tolerance, scale)
    seconds = time.perf_counter() - begun
    if motion is None:
        return Rung(tolerance, float("inf"), seconds, float("nan"))
    force = problem.force_of_states(motion.reshape(*turns.shape, -1))
    return Rung(tolerance, relative_error(force, known.force), seconds, float("nan"))
