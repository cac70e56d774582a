"""How long the exact mesh relationship of a worn pair takes: tangency, smallest gap,
and Algorithm 1.

``python tests/benchmarks/exact_contact.py FILE`` prints it for every case of a campaign
file that presets wear, at Y23's 1849 points, with the largest difference in rotation of
the driven gear.
"""

import sys
from typing import NamedTuple

import numpy as np

from wearlab.accuracy.ladder import timing
from wearlab.assembly import build
from wearlab.assembly.sets import modifications
from wearlab.gears.gear import GearPair
from wearlab.mesh.exact.flank import Flank
from wearlab.mesh.exact.gaps import PUBLISHED_POINTS, WornFlanks, algorithm_1
from wearlab.mesh.exact.kinematics import tangency
from wearlab.mesh.exact.minimum_gap import minimum_gap
from wearlab.scene import Scene

TARGET, RATIO = 5e-3, 50.0


class ExactTime(NamedTuple):
    """Wall times of one mesh relationship, and how far the methods differ.

    Parameters
    ----------
    depth : largest wear depth [m]
    tangency, smallest_gap, algorithm_1 : [s]
    apart : largest difference of tangency and smallest gap where flanks touch with a
        common tangent [rad]
    searched : largest difference of Algorithm 1 from the smallest gap there [rad]
    """

    depth: float
    tangency: float
    smallest_gap: float
    algorithm_1: float
    apart: float
    searched: float


def exact_time(
    pair: GearPair, worn: tuple[Flank, Flank], depth: float = 0.0
) -> ExactTime:
    """Measure the three methods on two worn flanks, at equally spaced
    points of the path.
    """
    x = np.linspace(pair.path.A, pair.path.E, PUBLISHED_POINTS)
    touching = tangency(*worn, x)
    published = algorithm_1(pair, *worn)
    apart = _difference(pair, worn, touching)
    searched = _difference(pair, worn, published)
    return ExactTime(
        depth,
        timing(lambda: tangency(*worn, x), max_repetitions=20),
        timing(lambda: minimum_gap(*worn, x), max_repetitions=20),
        timing(lambda: algorithm_1(pair, *worn), max_repetitions=2),
        apart,
        searched,
    )


def _difference(pair: GearPair, worn: tuple[Flank, Flank], found: object) -> float:
    # type: ignore[attr-defined]
    x = found.x_driving
    gap = found.gap
    inside = np.isfinite(gap) & (x > pair.path.A) & (x < pair.path.E)
    exact = minimum_gap(*worn, x[inside]).gap
    return float(np.abs(gap[inside] - exact).max()) / pair.driven.base_radius


def of_scene(scene: Scene) -> ExactTime:
    """Measure the methods on the flanks that a scene starts with."""
    from wearlab.simulation.initial_wear import initial_wear

    parts = build(scene)
    wear = initial_wear(scene, parts)[0]
    one = parts.gears.kinds[0]
    grid = parts.kinds[0].analysis.grid
    flanks = WornFlanks(one.pair, grid, modifications(one.pair, grid.position))
    return exact_time(one.pair, flanks.worn(wear), float(wear.max()))


def exact_text(time: ExactTime) -> str:
    """Return one measurement in a line."""
    return (
        f"{1e6 * time.depth:8.1f} um: tangency {1e3 * time.tangency:6.2f} ms, "
        "smallest gap "
        f"{1e3 * time.smallest_gap:6.2f} ms, Algorithm 1 "
        f"{1e3 * time.algorithm_1:6.0f} ms, "
        f"{time.algorithm_1 / time.smallest_gap:4.0f} times as long; tangency "
        f"{time.apart:.0e} rad off, "
        f"Algorithm 1 {time.searched:.0e} rad"
    )


def main(arguments: list[str]) -> None:
    """Print the times for every case of a campaign file that presets wear."""
    from wearlab.campaign import load

    if not arguments:
        print("usage: python tests/benchmarks/exact_contact.py FILE", file=sys.stderr)
        sys.exit(2)
    print(
        f"{PUBLISHED_POINTS} points of one worn pair; the target is {1e3 * TARGET:g} "
        f"ms and {RATIO:g} times"
    )
    for case in load(arguments[0]).cases:
        if case.scene.wear is not None and case.scene.mesh.contact.chosen == "exact":
            print(f"{case.label[:34]:36}{exact_text(of_scene(case.scene))}")


if __name__ == "__main__":
    main(sys.argv[1:])
