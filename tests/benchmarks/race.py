"""Our steady states against peers at their best, to the same errors: settings first,
then times in turns.

Every contestant gets the cheapest of its settings that reaches an error. Then all run
in turns, round after round, in processor time: what else the machine does meets them
alike, and a ratio is taken within a round.
"""

import copy
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np
from harmonic_balance import HarmonicBalance
from numpy.typing import NDArray
from peer_ladders import FORGOTTEN, HARMONICS, Course, course
from transient import periods_to

from wearlab.accuracy.ladder import TRANSIENT_SHARE
from wearlab.accuracy.reference import reference
from wearlab.accuracy.steady import Steady, relative_error
from wearlab.accuracy.steady_curves import STEPS
from wearlab.dynamics.rigid import balance_of
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.gears.specification import GearError

Array = NDArray[np.float64]
Action = Callable[[], object]

ROUNDS = 9
BATCH = 20e-3
"""Processor time that a contestant runs for in a round at least: the first times after
another one are up to twice as long, with its tables in the caches [s]."""
SLOW = 0.2
"""A march that takes longer is timed over its first periods, and scaled to all of them
[s]."""
SHORTEST = 1e-7
"""What a clock that stands still counts as [s]."""
TOLERANCES = tuple(10.0 ** -np.arange(2.0, 10.1, 0.5))
OURS, WARM = "wearlab", "wearlab, warm"
LANDING, CLOSING, BALANCE = (
    "landing on jumps",
    "Newton around a period",
    "harmonic balance",
)


class Contestant(NamedTuple):
    """A method at a setting that reaches an error.

    Parameters
    ----------
    role : of `OURS`, `WARM`, `LANDING`, `CLOSING`, `BALANCE`
    name : method and setting
    error : relative error of its mesh force [1]
    action : finds the steady state, or marches a part of the way
    share : of the way
    """

    role: str
    name: str
    error: float
    action: Action
    share: float = 1.0


@dataclass(frozen=True)
class Ranked:
    """A contestant and its times.

    Parameters
    ----------
    contestant : who
    seconds : (n_rounds,) processor time of each round [s]
    """

    contestant: Contestant
    seconds: Array

    def over(self, other: "Ranked") -> Array:
        """Return how many times the other's time this takes, in every round."""
        return np.asarray(self.seconds / other.seconds)


def race(
    problem: Steady, targets: tuple[float, ...], rounds: int = ROUNDS
) -> dict[float, list[Ranked]]:
    """Return who ran to each error, and the times.

    Of each role the fastest, ours cold and warm.
    """
    given = course(problem, reference(problem, checked=False))
    finders = [ours(given, targets), *peers(given, targets)]
    chosen = {
        target: list(_fastest([found[target] for found in finders]))
        for target in targets
    }
    return {
        target: timed(contestants, rounds) for target, contestants in chosen.items()
    }


def _fastest(found: list[list[Contestant]]) -> Iterator[Contestant]:
    """Yield ours, and the fastest of every other role by a first look."""
    entrants = [one for each in found for one in each]
    for role in (OURS, WARM, LANDING, CLOSING, BALANCE):
        mine = [one for one in entrants if one.role == role]
        if mine:
            yield min(mine, key=lambda one: seconds_of(one.action, 3) / one.share)


def timed(contestants: list[Contestant], rounds: int) -> list[Ranked]:
    """Return the times of contestants that run in turns."""
    repeats = [
        max(1, int(BATCH / max(SHORTEST, seconds_of(one.action))))
        for one in contestants
    ]
    taken = np.empty((rounds, len(contestants)))
    for turn in range(rounds):
        for at, (one, count) in enumerate(zip(contestants, repeats, strict=True)):
            taken[turn, at] = _batch(one.action, count) / one.share
    return [Ranked(one, taken[:, at]) for at, one in enumerate(contestants)]


def _batch(action: Action, count: int) -> float:
    begun = time.process_time()
    for _ in range(count):
        action()
    return (time.process_time() - begun) / count


def seconds_of(action: Action, times: int = 1) -> float:
    """Return the processor time of an action that has run before: the
    least of some [s].
    """
    action()
    return min(_batch(action, 1) for _ in range(times))


def ours(given: Course, targets: tuple[float, ...]) -> dict[float, list[Contestant]]:
    """Return our default method, cold and from a neighbouring state, by the fewest
    steps for each error.
    """
    problem = given.problem
    force = given.known.force
    found: dict[float, list[Contestant]] = {target: [] for target in targets}
    for steps in STEPS:
        with suppress(GearError):
            vibration = problem.with_steps(steps, Periodic())
            near = problem.solve(vibration, kinds=problem.near)
            cold = partial(problem.solve, vibration, None)
            warm = partial(problem.solve, vibration, near)
            errors = [
                relative_error(problem.force_of(vibration, one()), force)
                for one in (cold, warm)
            ]
            count = len(cold().tables.width)
            for target in targets:
                if max(errors) <= target and not found[target]:
                    name = f"{count} steps"
                    found[target] = [
                        Contestant(OURS, name, errors[0], cold),
                        Contestant(WARM, name, errors[1], warm),
                    ]
        if all(found.values()):
            break
    return found


def peers(
    given: Course, targets: tuple[float, ...]
) -> Iterator[dict[float, list[Contestant]]]:
    """Yield what every peer that is installed reaches each error with."""
    if find_spec("CyRK") is not None:
        from best_peers import METHODS, ClosingCyRK

        first = ClosingCyRK(given.motion, METHODS[0])
        for method in METHODS:
            bound = copy.copy(first)
            bound.method = method
            for role, one in ((LANDING, _march), (CLOSING, _close)):
                yield _laddered(targets, TOLERANCES, partial(one, given, bound, role))
    if not given.motion.rubs and not len(
        balance_of(given.known.response.system, given.motion.period).held
    ):
        yield _laddered(targets, HARMONICS, partial(_balance, given))


def _laddered(
    targets: tuple[float, ...],
    settings: tuple[float, ...],
    entrant: Callable[[Any], Contestant | None],
) -> dict[float, list[Contestant]]:
    """Return the coarsest setting that reaches each error, none where
    the finest does not.
    """
    found: dict[float, list[Contestant]] = {target: [] for target in targets}
    for setting in settings:
        one = entrant(setting)
        for target in targets:
            if one is not None and one.error <= target and not found[target]:
                found[target] = [one]
        if all(found.values()):
            break
    return found


def _march(given: Course, bound: Any, role: str, tolerance: float) -> Contestant | None:
    """Return a march from the best static state, no longer than what
    it forgets is worth.
    """
    start = given.starts[0]
    forgetting = periods_to(given.left[0], FORGOTTEN)
    floor = given.error(bound, tolerance, given.known.start, forgetting)
    if not np.isfinite(floor):
        return None
    count = periods_to(given.left[0], TRANSIENT_SHARE * floor) + given.periods
    pace = seconds_of(partial(bound.march, start, 1, tolerance, given.scale))
    some = min(count, max(1, int(SLOW / max(SHORTEST, pace))))
    action = partial(bound.march, start, some, tolerance, given.scale)
    name = f"CyRK {bound.method} {tolerance:.0e}, {count} periods"
    return Contestant(role, name, (1.0 + TRANSIENT_SHARE) * floor, action, some / count)


def _close(given: Course, bound: Any, role: str, tolerance: float) -> Contestant | None:
    """Return Newton's method around the integrator, from the best static state."""
    free = len(balance_of(given.known.response.system, given.motion.period).held) > 0
    action = partial(
        bound.close, given.starts[0], given.periods, tolerance, given.scale, free
    )
    state, marched = action()
    if not np.isfinite(state).all():
        return None
    error = given.error(bound, tolerance, state, 0)
    return Contestant(
        role, f"CyRK {bound.method} {tolerance:.0e}, {marched} periods", error, action
    )


def _balance(given: Course, harmonics: int) -> Contestant | None:
    """Return harmonic balance, its matrices built before."""
    balance = HarmonicBalance(given.motion, harmonics * given.periods, given.periods)
    found = balance.solve()
    if found is None:
        return None
    phase = given.problem.phase
    force = given.problem.force(balance.motions(found, phase), phase)
    return Contestant(
        BALANCE,
        f"{harmonics} harmonics",
        relative_error(force, given.known.force),
        balance.solve,
    )
