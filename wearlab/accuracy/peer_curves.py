"""Work–precision curves of the integrators of CyRK on the equation of motion."""

import time
from collections.abc import Callable, Iterator
from copy import copy
from functools import partial
from importlib.util import find_spec

import numpy as np

from wearlab.accuracy.equation import CyRKIntegrator, starting_state
from wearlab.accuracy.ladder import (
    TRANSIENT_SHARE,
    Rung,
    WorkPrecision,
    measured_rungs,
    timing,
)
from wearlab.accuracy.reference import Reference
from wearlab.accuracy.steady import Steady, relative_error
from wearlab.arrays import Array

METHODS = ("RK45", "TSIT5", "VERN7", "DOP853")
PEER_TOLERANCES = tuple(10.0 ** -np.arange(3.0, 9.5, 1.0))
LONGEST = 10.0
"""An integration that would take longer is not begun [s]."""


def peers() -> tuple[str, ...]:
    """Return the names of the methods of CyRK, if it is installed.

    Each lands on every known jump.
    """
    if missing_peers():
        return ()
    return tuple(f"CyRK {method}, landing" for method in METHODS)


def missing_peers() -> tuple[str, ...]:
    """Return the peers that are not installed (``pip install wearlab[peers]``)."""
    return () if find_spec("CyRK") is not None else ("CyRK",)


def peer_curves(
    problem: Steady, answer: Reference, report: Callable[[str], None]
) -> Iterator[WorkPrecision]:
    """Yield the curves of the peers over their relative tolerance.

    Peers whose transient would take too long to die have none.

    Parameters
    ----------
    problem, answer : the scene and its answer
    report : called with the name of the peer that comes next
    """
    system = answer.response.system
    tables = answer.response.tables
    stiffness_at_middles = tables.stiffness.sum(axis=3)[:, 1]
    mean_stiffness = np.einsum("s,sm->m", tables.width, stiffness_at_middles)
    start = starting_state(system, mean_stiffness)
    if not peers():
        return

    compiled = CyRKIntegrator(problem.motion(system), METHODS[0])
    for name, method in zip(peers(), METHODS, strict=True):
        report(name)
        peer = copy(compiled)
        peer.method = method
        rung_of = partial(_rung, peer, problem, answer, start=start)
        rungs = measured_rungs(PEER_TOLERANCES, rung_of, answer.disagreement)
        if rungs:
            yield WorkPrecision(name, "relative", "mesh_force", "peer", rungs)


def periods_to(answer: Reference, left: float) -> float:
    """Return the mesh periods until a share of a transient is left, ∞ if never.

    Parameters
    ----------
    answer : whose largest Floquet multiplier says how fast transients die
    left : share of the transient [1]
    """
    largest = answer.multiplier ** (1.0 / len(answer.force))
    if not 0.0 < largest < 1.0:
        return float("inf")
    return float(np.ceil(np.log(left) / np.log(largest)))


def _rung(
    peer: CyRKIntegrator,
    problem: Steady,
    answer: Reference,
    tolerance: float,
    start: Array,
) -> Rung | None:
    """Return a setting of a peer, None where its integration would take too long."""
    scale = np.abs(answer.response.state).max(axis=(0, 1))
    periods = periods_to(answer, TRANSIENT_SHARE * tolerance)
    for _ in range(2):  # the first compiles
        begin = time.process_time()
        peer.integrate(answer.start, 1, tolerance, scale)
    if periods * (time.process_time() - begin) > LONGEST:
        return None

    settling = int(periods)
    settled = peer.integrate(start, settling, tolerance, scale)
    if not np.isfinite(settled).all():
        return Rung(tolerance, float("inf"), float("nan"), float("nan"))

    answer_periods = len(answer.force)
    states = peer.states(settled, answer_periods, problem.phase, tolerance, scale)
    seconds = timing(
        lambda: peer.integrate(start, settling + answer_periods, tolerance, scale)
    )
    error = relative_error(problem.force_of_states(states), answer.force)
    return Rung(tolerance, error, seconds, float("nan"))
