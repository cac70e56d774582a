"""``sample = {method, n, seed}``: values of one block, each key drawn from its own distribution.

Sobol points and plain random ones can be extended: a larger ``n`` keeps the first points. A Latin hypercube
is made for its ``n``. ``sobol-indices`` is the design from which Sobol' indices are computed: for each of
``n`` pairs of Sobol points A and B of the d inputs it has d + 2 runs, A, B, and A with one input of B at a
time (Saltelli et al. 2010, doi:10.1016/j.cpc.2009.09.018). ``correlation`` couples inputs by a Gaussian
copula.
"""

import warnings
from typing import Any, NamedTuple

from wearlab.campaign.correlation import Correlation, coupled, read_correlations
from wearlab.campaign.distributions import Distribution
from wearlab.campaign.errors import CampaignError
from wearlab.scene.problems import not_a_choice, shown

INDICES = "sobol-indices"
METHODS = ("sobol", "latin-hypercube", "random", INDICES)
DIGITS = 12


class Sample(NamedTuple):
    """How the points of a block are drawn."""

    method: str
    n: int
    seed: int
    correlation: tuple[Correlation, ...] = ()


def read_sample(given: Any, where: str, most: int) -> Sample:
    """Return how a block is sampled.

    Parameters
    ----------
    given : its ``sample`` table
    where : place of the block in the file
    most : number of points that a campaign may have
    """
    wanted = "{method = …, n = …, seed = …}, with correlation = [[key, key, ρ], …] where inputs go together"
    if not isinstance(given, dict) or set(given) - {"correlation"} != {"method", "n", "seed"}:
        raise CampaignError([f"{where}.sample: {shown(given)} is not {wanted}"])
    if given["method"] not in METHODS:
        raise CampaignError([f"{where}.sample.method: {not_a_choice(given['method'], METHODS)}"])
    for key, least in (("n", 1), ("seed", 0)):
        number = given[key]
        if isinstance(number, bool) or not isinstance(number, int) or number < least:
            raise CampaignError([f"{where}.sample.{key}: {shown(number)} is no whole number from {least} on"])
    if given["n"] > most:
        raise CampaignError([f"{where}.sample.n: {given['n']} points are more than {most}; draw fewer"])
    correlation = read_correlations(given.get("correlation", []), f"{where}.sample.correlation")
    if correlation and given["method"] == INDICES:
        raise CampaignError(
            [f"{where}.sample.correlation: Sobol' indices are of independent inputs: drop it"]
        )
    return Sample(given["method"], given["n"], given["seed"], correlation)


def draw(sample: Sample, distributions: dict[str, Distribution], where: str) -> dict[str, tuple[Any, ...]]:
    """Return the drawn values of every key as a campaign file would write them.

    Parameters
    ----------
    sample : how
    distributions : of every drawn key
    where : place of the block in the file
    """
    if sample.method == INDICES:
        points = _pairs(sample, len(distributions))
    else:
        points = _points(sample.method, sample.n, len(distributions), sample.seed)
    if sample.correlation:
        points = coupled(points, sample.correlation, list(distributions), f"{where}.sample.correlation")
    return {
        key: tuple(written(distribution.at(point[column]), distribution.unit) for point in points)
        for column, (key, distribution) in enumerate(distributions.items())
    }


def _pairs(sample: Sample, width: int) -> list[list[float]]:
    """Return A, B and A with each input of B, pair of points by pair of points, (n (width + 2), width)."""
    rows: list[list[float]] = []
    for both in _points("sobol", sample.n, 2 * width, sample.seed):
        a, b = both[:width], both[width:]
        rows += [a, b, *([*a[:j], b[j], *a[j + 1 :]] for j in range(width))]
    return rows


def written(value: float, unit: str | None) -> float | str:
    """Return a value as a campaign file would write it."""
    short = float(f"{value:.{DIGITS}g}")
    return short if unit is None else f"{short!r} {unit}"


def _points(method: str, n: int, width: int, seed: int) -> list[list[float]]:
    """Return n points of the unit cube, (n, width)."""
    if method == "random":
        import numpy as np

        drawn: list[list[float]] = np.random.default_rng(seed).random((n, width)).tolist()
        return drawn
    from scipy.stats import qmc

    kinds = {"sobol": qmc.Sobol, "latin-hypercube": qmc.LatinHypercube}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # that n is no power of two: the user may extend it
        points: list[list[float]] = kinds[method](width, rng=seed).random(n).tolist()
    return points
