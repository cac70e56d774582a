"""How long one steady state to a wanted error takes: cold, and from a neighbouring wear
state.

``python tests/benchmarks/steady_time.py FILE`` prints a line for every case of a
campaign file that moves: the fewest steps, of some, that reach the error against twice
as many as `tight_steps` asks for, and the best of several wall times, tables included.
"""

import sys
import time
from functools import partial
from typing import NamedTuple

from wearlab.accuracy.ladder import timing
from wearlab.accuracy.reference import tight_steps
from wearlab.accuracy.steady import relative_error, steady
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.gears.specification import GearError
from wearlab.scene import Scene

ERROR = 1e-6
COLD, WARM = 5e-3, 0.5e-3
"""Wanted error of the mesh force [1], and times [s]."""
SHARES = (0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.7, 1.0)
"""Steps tried, as shares of the tight ones."""


class SteadyTime(NamedTuple):
    """One steady state.

    Parameters
    ----------
    steps : steps of a mesh period
    error, warm_error : of the mesh force, solved cold and from a neighbour [1]
    cold, warm : wall times [s]
    first : wall time of the first start from that neighbour, whose factors are computed
        then [s]
    """

    steps: int
    error: float
    warm_error: float
    cold: float
    warm: float
    first: float


def steady_time(
    scene: Scene, error: float = ERROR, budget: float = 1.0
) -> SteadyTime | None:
    """Return the times of the fewest steps that reach an error, None where none of
    those tried does.

    ``budget``: for each of the two times [s].
    """
    problem = steady(scene)
    tight = problem.with_steps(2 * tight_steps(problem), Periodic())
    known = problem.force_of(tight, problem.solve(tight))
    for share in SHARES:
        vibration = problem.with_steps(int(share * tight_steps(problem)), Periodic())
        try:
            response = problem.solve(vibration)
        except GearError:  # so few steps are refused
            continue
        found = relative_error(problem.force_of(vibration, response), known)
        if found > error:
            continue
        for _ in range(2):  # the first may compile
            near = problem.solve(vibration, kinds=problem.near)
            begun = time.perf_counter()
            started = problem.solve(vibration, near)
            first = time.perf_counter() - begun
        timed = partial(timing, max_repetitions=200, budget=budget)
        return SteadyTime(
            len(vibration.sampling.grid.width),
            found,
            relative_error(problem.force_of(vibration, started), known),
            timed(partial(problem.solve, vibration)),
            timed(partial(problem.solve, vibration, near)),
            first,
        )
    return None


def time_text(found: SteadyTime | None) -> str:
    """Return one measurement in a line."""
    if found is None:
        return f"no steps tried reach {ERROR:g}"
    return (
        f"{found.steps:5} steps, error {found.error:.1e} (warm "
        f"{found.warm_error:.1e}): cold "
        f"{1e3 * found.cold:.2f} ms, warm {1e3 * found.warm:.2f} ms, the first time "
        f"{1e3 * found.first:.1f} ms"
    )


def main(arguments: list[str]) -> None:
    """Print the times for every case of a campaign file that moves."""
    from wearlab.campaign import load

    if not arguments:
        print("usage: python tests/benchmarks/steady_time.py FILE", file=sys.stderr)
        sys.exit(2)
    print(
        f"steady states to {ERROR:g}; the targets are {1e3 * COLD:g} ms cold and "
        f"{1e3 * WARM:g} ms warm"
    )
    for case in load(arguments[0]).cases:
        if case.scene.dynamics is not None:
            print(
                f"{case.label[:22]:24}{time_text(steady_time(case.scene))}", flush=True
            )


if __name__ == "__main__":
    main(sys.argv[1:])
