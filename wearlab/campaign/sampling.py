"""``sample = {method, n, seed}``: values of one block, each key drawn from its own distribution.

Sobol points and plain random ones can be extended: a larger ``n`` keeps the first points. A Latin hypercube
is made for its ``n``.
"""

import math
import warnings
from statistics import NormalDist
from typing import Any, NamedTuple

from wearlab.campaign.errors import CampaignError
from wearlab.scene.problems import not_a_choice, shown
from wearlab.units import UnitError, convert, is_quantity, split

METHODS = ("sobol", "latin-hypercube", "random")
DISTRIBUTIONS = {"lognormal": ("median", "cov"), "normal": ("mean", "sd"), "uniform": ("low", "high")}
DIGITS = 12
SMALLEST = 2.0**-40  # a probability; a Sobol point may be exactly 0


class Sample(NamedTuple):
    """How the points of a block are drawn."""

    method: str
    n: int
    seed: int


class Distribution(NamedTuple):
    """One key's distribution: a kind, its two parameters in ``unit``."""

    kind: str
    first: float
    second: float
    unit: str | None

    def at(self, probability: float) -> float:
        """Return the value that a draw stays below with this probability."""
        p = min(max(probability, SMALLEST), 1.0 - SMALLEST)
        if self.kind == "uniform":
            return self.first + (self.second - self.first) * p
        score = NormalDist().inv_cdf(p)
        if self.kind == "normal":
            return self.first + self.second * score
        return self.first * math.exp(math.sqrt(math.log1p(self.second**2)) * score)


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


def read_distribution(given: dict[str, Any], where: str) -> Distribution:
    """Return the distribution that a table such as ``{normal = {mean = …, sd = …}}`` means."""
    kind = next(word for word in DISTRIBUTIONS if word in given)
    names = DISTRIBUTIONS[kind]
    if len(given) > 1:
        extra = next(key for key in given if key != kind)
        raise CampaignError([f"{where}: {extra!r} does not belong here; units stand in the values"])
    inner = given[kind]
    if kind == "uniform" and isinstance(inner, list) and len(inner) == len(names):
        inner = dict(zip(names, inner, strict=True))
    if not isinstance(inner, dict) or set(inner) != set(names):
        wanted = "[low, high]" if kind == "uniform" else f"{{{names[0]} = …, {names[1]} = …}}"
        raise CampaignError([f"{where}.{kind}: {shown(given[kind])} is not {wanted}"])
    first, unit = _number(inner[names[0]], f"{where}.{kind}.{names[0]}")
    second, other = _number(inner[names[1]], f"{where}.{kind}.{names[1]}")
    if kind != "lognormal":
        second = _in_unit(second, other, unit, f"{where}.{kind}")
    elif other is not None:
        raise CampaignError([f"{where}.{kind}.cov: a plain number, the standard deviation over the mean"])
    _check(kind, first, second, f"{where}.{kind}")
    return Distribution(kind, first, second, unit)


def _number(value: Any, where: str) -> tuple[float, str | None]:
    if is_quantity(value):
        number, unit = split(value)
        return float(number), unit
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise CampaignError([f"{where}: {shown(value)} is neither a number nor a quantity with its unit"])
    return float(value), None


def _in_unit(value: float, own: str | None, unit: str | None, where: str) -> float:
    if own == unit:
        return value
    if own is None or unit is None:
        raise CampaignError([f"{where}: one value has a unit, the other has none"])
    try:
        return convert(value, own, unit)
    except UnitError as error:
        raise CampaignError([f"{where}: {error}"]) from None


def _check(kind: str, first: float, second: float, where: str) -> None:
    if kind == "uniform" and not first < second:
        raise CampaignError([f"{where}: from {first:g} to {second:g} there is nothing to draw"])
    if kind != "uniform" and second <= 0.0:
        name = DISTRIBUTIONS[kind][1]
        raise CampaignError([f"{where}.{name}: {second:g} must be greater than 0; or write a value"])
    if kind == "lognormal" and first <= 0.0:
        raise CampaignError([f"{where}.median: {first:g} must be greater than 0"])
