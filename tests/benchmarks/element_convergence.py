"""How the finite-element compliance of a campaign's gears converges with the mesh.

``python tests/benchmarks/element_convergence.py FILE`` prints a table for each kind of
mesh.
"""

import sys
import time
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from wearlab.assembly.sets import build_set
from wearlab.campaign import load
from wearlab.gears.gear import GearPair
from wearlab.mesh.finite_element.compliance import pair_compliance, solve_gear
from wearlab.mesh.finite_element.elements import Options

REFINEMENTS = (1, 2, 3, 4)
REFERENCE = 6
POSITIONS = 25


class Rung(NamedTuple):
    """One mesh against the finest.

    Parameters
    ----------
    refinement : multiples of the coarsest mesh's elements
    own, shared : largest relative error of a pair's own and shared compliance along the
        path [1]
    order : observed in the own compliance since the rung before; nan for the first
    seconds : for both gears [s]
    """

    refinement: int
    own: float
    shared: float
    order: float
    seconds: float


def element_convergence(
    pair: GearPair,
    refinements: Sequence[int] = REFINEMENTS,
    reference: int = REFERENCE,
    options: Options = Options(),  # noqa: B008
) -> Iterator[Rung]:
    """Compare meshes of both gears of a pair with a fine one.

    Parameters
    ----------
    pair : the gears
    refinements, reference : of the meshes compared, and of the one they are compared
        with
    options : everything but the refinement
    """
    position = np.linspace(pair.path.A, pair.path.E, POSITIONS)
    coupled = position + pair.base_pitch <= pair.path.E
    exact_own, exact_shared, _ = _solve(
        pair, position, options._replace(refinement=reference)
    )
    before: Rung | None = None
    for refinement in refinements:
        own, shared, seconds = _solve(
            pair, position, options._replace(refinement=refinement)
        )
        error = float(np.abs(own / exact_own - 1.0).max())
        shared_error = float(
            np.abs(shared[0, coupled] / exact_shared[0, coupled] - 1.0).max()
        )
        order = np.nan
        if before is not None:
            order = float(
                np.log(before.own / error) / np.log(refinement / before.refinement)
            )
        before = Rung(refinement, error, shared_error, order, seconds)
        yield before


def _solve(
    pair: GearPair, position: np.ndarray, options: Options
) -> tuple[np.ndarray, np.ndarray, float]:
    begun = time.perf_counter()
    first, second = (solve_gear(gear, options) for gear in pair.gears)
    seconds = time.perf_counter() - begun
    return *pair_compliance(pair, position, 2, options, (first, second)), seconds


def main(files: Sequence[str]) -> None:
    """Print the tables of campaign files; the default mesh is marked."""
    for file in files:
        campaign = load(file)
        for one in build_set(campaign.cases[0].scene).kinds:
            print(f"{campaign.title}: {' and '.join(one.flanks)}")
            print(f"{'refinement':>12}{'own':>10}{'shared':>10}{'order':>8}{'s':>8}")
            for rung in element_convergence(one.pair):
                mark = "*" if rung.refinement == Options().refinement else " "
                print(
                    f"{rung.refinement:11d}{mark}"
                    f"{100 * rung.own:9.3f}%{100 * rung.shared:9.3f}%"
                    f"{rung.order:8.2f}{rung.seconds:8.2f}"
                )
            print()


if __name__ == "__main__":
    main(sys.argv[1:])
