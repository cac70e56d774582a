"""``sample = {method, n, seed}``: values of one block, each key drawn from its own distribution.

Sobol points and plain random ones can be extended: a larger ``n`` keeps the first points. A Latin hypercube
is made for its ``n``.
"""

import warnings
from typing import Any, NamedTuple

from wearlab.campaign.distributions import Distribution
from wearlab.campaign.errors import CampaignError
from wearlab.scene.problems import not_a_choice, shown

METHODS = ("sobol", "latin-hypercube", "random")
DIGITS = 12


class Sample(NamedTuple):
    """How the points of a block are drawn."""

    method: str
    n: int
    seed: int


def read_sample(given: Any, where: str, most: int) -> Sample:
    """Return how a block is sampled.

    Parameters
    ----------
    given : its ``sample`` table
    where : place of the block in the file
    most : number of points that a campaign may have
    """
    wanted = "{method = …, n = …, seed = …}"
    if not isinstance(given, dict) or set(given) != {"method", "n", "seed"}:
        raise CampaignError([f"{where}.sample: {shown(given)} is not {wanted}"])
    if given["method"] not in METHODS:
        raise CampaignError([f"{where}.sample.method: {not_a_choice(given['method'], METHODS)}"])
    for key, least in (("n", 1), ("seed", 0)):
        number = given[key]
        if isinstance(number, bool) or not isinstance(number, int) or number < least:
            raise CampaignError([f"{where}.sample.{key}: {shown(number)} is no whole number from {least} on"])
    if given["n"] > most:
        raise CampaignError([f"{where}.sample.n: {given['n']} points are more than {most}; draw fewer"])
    return Sample(given["method"], given["n"], given["seed"])


def draw(sample: Sample, distributions: dict[str, Distribution]) -> dict[str, tuple[Any, ...]]:
    """Return the drawn values of every key as a campaign file would write them, drawn independently."""
    points = _points(sample, len(distributions))
    return {
        key: tuple(_written(one.at(point[column]), one.unit) for point in points)
        for column, (key, one) in enumerate(distributions.items())
    }


def _written(value: float, unit: str | None) -> float | str:
    short = float(f"{value:.{DIGITS}g}")
    return short if unit is None else f"{short!r} {unit}"


def _points(sample: Sample, width: int) -> list[list[float]]:
    """Return n points of the unit cube, (n, width)."""
    if sample.method == "random":
        import numpy as np

        drawn: list[list[float]] = np.random.default_rng(sample.seed).random((sample.n, width)).tolist()
        return drawn
    from scipy.stats import qmc

    kinds = {"sobol": qmc.Sobol, "latin-hypercube": qmc.LatinHypercube}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # that n is no power of two: the user may extend it
        points: list[list[float]] = kinds[sample.method](width, rng=sample.seed).random(sample.n).tolist()
    return points
