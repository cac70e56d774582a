"""What values are drawn from, and how: distributions, correlations and samples."""

import math
import warnings
from collections.abc import Callable, Sequence
from functools import cache
from math import log1p, pi, sin, sqrt
from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import StrictInt, ValidationInfo, field_validator

from wearlab.arrays import Array
from wearlab.campaign.blocks import CampaignError
from wearlab.options import ClosedTable
from wearlab.scene.problems import shown
from wearlab.units import UnitError, convert, is_number, is_quantity, rounded, split

SMALLEST = 2.0**-40  # a probability; a Sobol point may be exactly 0
LEAST_KEPT = 1e-9  # probability that a truncation must leave
TRUNCATE = "truncate"
Correlation = tuple[str, str, float]


class Word(NamedTuple):
    """A word of the campaign file: the law of `scipy.stats` that it means, and its numbers.

    Parameters
    ----------
    law : law of its numbers, given `scipy.stats`, which takes longer to import than
        most files to read
    listed : whether they may stand in a list
    """

    law: Callable[..., Any]
    listed: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its numbers: what its law is called with."""
        return self.law.__code__.co_varnames[1:]


WORDS = {
    "lognormal": Word(
        lambda stats, median, cov: stats.lognorm(sqrt(log1p(cov**2)), scale=median)
    ),
    "normal": Word(lambda stats, mean, sd: stats.norm(mean, sd)),
    "uniform": Word(
        lambda stats, low, high: stats.uniform(low, high - low), listed=True
    ),
    "loguniform": Word(
        lambda stats, low, high: stats.loguniform(low, high), listed=True
    ),
    "triangular": Word(
        lambda stats, low, mode, high: stats.triang(
            (mode - low) / (high - low), low, high - low
        ),
        listed=True,
    ),
    "weibull": Word(lambda stats, scale, shape: stats.weibull_min(shape, scale=scale)),
}
PLAIN = {"cov": "the standard deviation over the mean", "shape": "the exponent"}
"""Numbers that have no unit; the others of a word share one."""
DISTRIBUTIONS = tuple(WORDS)


class Distribution(NamedTuple):
    """What a value is drawn from, in ``unit``, between ``low`` and ``high``.

    Parameters
    ----------
    word, numbers : a word of `WORDS` and what it is made from
    unit : of the numbers, None for plain ones
    low, high : where it is truncated
    """

    word: str
    numbers: tuple[float, ...]
    unit: str | None = None
    low: float = -math.inf
    high: float = math.inf

    def at(self, probability: Any) -> Any:
        """Return the value that a draw stays below with this probability.

        Of an array, an array.
        """
        law, below, above = _law(self)
        p = below + (above - below) * np.clip(probability, SMALLEST, 1.0 - SMALLEST)
        return np.clip(
            law.ppf(np.clip(p, SMALLEST, 1.0 - SMALLEST)), self.low, self.high
        )

    def below(self, value: Any) -> Any:
        """Return the probability of a draw below this value; of an array, an array."""
        law, below, above = _law(self)
        return np.clip(
            (law.cdf(np.clip(value, self.low, self.high)) - below) / (above - below),
            0.0,
            1.0,
        )

    def log_density(self, value: Any) -> Any:
        """Return the log of the probability per ``unit``, −∞ beyond the ends.

        Right however far out.
        """
        law, below, above = _law(self)
        x = np.asarray(value, float)
        ends = 1e-12 * np.abs(value)
        logs = law.logpdf(x) - math.log(above - below)
        return np.where(
            (x >= self.low - ends) & (x <= self.high + ends), logs, -np.inf
        )[()]


@cache
def _law(distribution: Distribution) -> tuple[Any, float, float]:
    """Return the frozen law of `scipy.stats`, and the probabilities below the ends that truncate it."""
    from scipy import stats

    law = WORDS[distribution.word].law(stats, *distribution.numbers)
    return law, float(law.cdf(distribution.low)), float(law.cdf(distribution.high))


def is_distribution(value: Any) -> bool:
    """Say whether a value of the file is a table with the word of a distribution."""
    return isinstance(value, dict) and any(word in value for word in WORDS)


def read_distribution(given: dict[str, Any], where: str) -> Distribution:
    """Return the distribution that a table such as ``{normal = {mean = …, sd = …}}`` means.

    Parameters
    ----------
    given : the table, with ``truncate = [a, b]`` beside the word where it is truncated
    where : its place in the file

    Raises
    ------
    CampaignError : the word's numbers are wrong, or a key does not belong
    """
    kind = next(word for word in WORDS if word in given)
    extra = [key for key in given if key not in (kind, TRUNCATE)]
    if extra:
        raise CampaignError(
            f"{where}: {extra[0]!r} does not belong here; units stand in the values"
        )
    numbers, unit = _numbers(kind, given[kind], f"{where}.{kind}")
    whole = Distribution(kind, tuple(numbers), unit)
    if TRUNCATE not in given:
        return whole
    ends = given[TRUNCATE]
    place = f"{where}.{TRUNCATE}"
    if not isinstance(ends, list) or len(ends) != 2:
        raise CampaignError(f"{place}: {shown(ends)} is not [low, high]")
    low, high = (in_unit(*number_of(value, place), unit, place) for value in ends)
    if not low < high:
        raise CampaignError(
            f"{place}: from {low:g} to {high:g} there is nothing to draw"
        )
    if whole.below(high) - whole.below(low) < LEAST_KEPT:
        raise CampaignError(
            f"{place}: practically nothing of the distribution lies within "
            f"{shown(ends)}"
        )
    return whole._replace(low=low, high=high)


def _numbers(kind: str, given: Any, where: str) -> tuple[list[float], str | None]:
    """Return the numbers of a word in the unit of the first, and that unit."""
    word = WORDS[kind]
    if word.listed and isinstance(given, list) and len(given) == len(word.names):
        given = dict(zip(word.names, given, strict=True))
    if not isinstance(given, dict) or set(given) != set(word.names):
        keys = ", ".join(f"{name} = …" for name in word.names)
        wanted = f"[{', '.join(word.names)}]" if word.listed else f"{{{keys}}}"
        raise CampaignError(f"{where}: {shown(given)} is not {wanted}")
    first, unit = number_of(given[word.names[0]], f"{where}.{word.names[0]}")
    numbers = [first]
    for name in word.names[1:]:
        value, own = number_of(given[name], f"{where}.{name}")
        if name not in PLAIN:
            value = in_unit(value, own, unit, where)
        elif own is not None:
            raise CampaignError(f"{where}.{name}: a plain number, {PLAIN[name]}")
        numbers.append(value)
    _check(kind, numbers, where)
    return numbers, unit


def number_of(value: Any, where: str) -> tuple[float, str | None]:
    """Return a number as it is written, and its unit, None where it has none."""
    if is_quantity(value):
        number, unit = split(value)
        return float(number), unit
    if not is_number(value) or not math.isfinite(value):
        raise CampaignError(
            f"{where}: {shown(value)} is neither a number nor a quantity with its unit"
        )
    return float(value), None


def in_unit(value: float, own: str | None, unit: str | None, where: str) -> float:
    """Return a number in another unit."""
    if own == unit:
        return value
    if own is None or unit is None:
        raise CampaignError(f"{where}: one value has a unit, the other has none")
    try:
        return convert(value, own, unit)
    except UnitError as error:
        raise CampaignError(f"{where}: {error}") from None


def _check(word: str, numbers: Sequence[float], where: str) -> None:
    """Refuse numbers that make no distribution."""
    said: Any = (word, *numbers)
    match said:
        case ["uniform" | "loguniform", low, high] if not low < high:
            raise CampaignError(
                f"{where}: from {low:g} to {high:g} there is nothing to draw"
            )
        case ["loguniform", low, _] if low <= 0.0:
            raise CampaignError(f"{where}.low: {low:g} must be greater than 0")
        case ["triangular", low, mode, high] if not (
            low <= mode <= high and low < high
        ):
            raise CampaignError(
                f"{where}: {low:g}, {mode:g}, {high:g} are not in rising order"
            )
        case ["normal" | "lognormal", _, spread] if spread <= 0.0:
            name = WORDS[word].names[1]
            raise CampaignError(
                f"{where}.{name}: {spread:g} must be greater than 0; or write a value"
            )
        case ["lognormal" | "weibull", *several] if min(several) <= 0.0:
            name, number = next(
                (n, x)
                for n, x in zip(WORDS[word].names, several, strict=True)
                if x <= 0.0
            )
            raise CampaignError(f"{where}.{name}: {number:g} must be greater than 0")


def coupled(
    points: Array, correlations: Sequence[Correlation], keys: list[str], where: str
) -> Array:
    """Return points of the unit cube whose columns have the wanted rank correlations, each still uniform.

    z = Φ⁻¹(u), z′ = L z with L Lᵀ = C, u′ = Φ(z′), where C_ij = 2 sin(π ρ_ij / 6) is
    the correlation of normal variables with the rank correlation ρ_ij (Pearson 1907).

    Parameters
    ----------
    points : u, independent, (n, keys)
    correlations : ρ; others are 0
    keys : what the columns are
    where : place in the file

    Raises
    ------
    CampaignError : a key is not drawn here, stands beside itself, or the correlations
        contradict each other
    """
    from scipy.special import ndtr, ndtri

    matrix = np.eye(len(keys))
    for number, (first, second, rank) in enumerate(correlations):
        if lost := [key for key in (first, second) if key not in keys]:
            there = ", ".join(keys)
            raise CampaignError(
                f"{where}[{number}]: {lost[0]!r} is not drawn here; there are {there}"
            )
        i = keys.index(first)
        j = keys.index(second)
        if i == j:
            raise CampaignError(f"{where}[{number}]: {first!r} stands beside itself")
        matrix[i, j] = matrix[j, i] = 2.0 * sin(pi * rank / 6.0)
    try:
        lower = np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        said = "no inputs can be correlated like this: the ρ contradict each other"
        raise CampaignError(f"{where}: {said}") from None
    return np.asarray(ndtr(ndtri(np.clip(points, SMALLEST, 1.0 - SMALLEST)) @ lower.T))


INDICES = "sobol-indices"
METHODS = ("sobol", "latin-hypercube", "random", INDICES)


class SampleTable(ClosedTable):
    """How the keys of a block are drawn."""

    method: Literal[METHODS]  # type: ignore[valid-type]
    """sobol and random keep their first points when n grows; a Latin hypercube is made
    for its n; sobol-indices is the design from which wl.sobol_indices tells what makes
    a result scatter"""
    n: StrictInt
    """number of points; of sobol-indices pairs of points, d + 2 runs each for d keys"""
    seed: StrictInt
    """seed; the same seed draws the same points"""
    correlation: list[Correlation] | None = None
    """[key, key, Spearman's ρ] of keys that go together [independent]"""

    @field_validator("n", "seed")
    @classmethod
    def _is_a_count(cls, number: int, info: ValidationInfo) -> int:
        if number < (least := int(info.field_name == "n")):
            raise ValueError(f"{number} is no whole number from {least} on")
        return number

    @field_validator("correlation")
    @classmethod
    def _is_within(
        cls, given: list[Correlation] | None, info: ValidationInfo
    ) -> list[Correlation] | None:
        if given and info.data.get("method") == INDICES:
            raise ValueError("Sobol' indices are of independent inputs: drop it")
        for block in given or ():
            if not -1.0 < block[2] < 1.0:
                raise ValueError(
                    f"{shown(list(block))} is not [key, key, ρ] with ρ within −1 and 1"
                )
        return given


def draw(
    sample: SampleTable, distributions: dict[str, Distribution], where: str
) -> dict[str, tuple[Any, ...]]:
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
        points = coupled(
            points,
            sample.correlation,
            list(distributions),
            f"{where}.sample.correlation",
        )
    return {
        key: tuple(
            written(value, distribution.unit)
            for value in distribution.at(column).tolist()
        )
        for column, (key, distribution) in zip(
            points.T, distributions.items(), strict=True
        )
    }


def _pairs(sample: SampleTable, width: int) -> Array:
    """Return A, B and A with each input of B, pair of points by pair of points, (n (width + 2), width)."""
    both = _points("sobol", sample.n, 2 * width, sample.seed)
    a = both[:, :width]
    b = both[:, width:]
    mixed = [np.where(np.arange(width) == j, b, a) for j in range(width)]
    return np.stack([a, b, *mixed], axis=1).reshape(-1, width)


def written(value: float, unit: str | None) -> float | str:
    """Return a value as a campaign file would write it."""
    return rounded(value) if unit is None else f"{rounded(value)!r} {unit}"


def _points(method: str, n: int, width: int, seed: int) -> Array:
    """Return n points of the unit cube, (n, width)."""
    if method == "random":
        return np.random.default_rng(seed).random((n, width))
    from scipy.stats import qmc

    kinds = {"sobol": qmc.Sobol, "latin-hypercube": qmc.LatinHypercube}
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore", UserWarning
        )  # that n is no power of two: the user may extend it
        return np.asarray(kinds[method](width, rng=seed).random(n))
