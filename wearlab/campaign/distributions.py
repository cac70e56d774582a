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
MIN_REMAINING = 1e-9  # probability that a truncation must leave
END_TOLERANCE = 1e-12  # relative; beyond an end of a truncation
TRUNCATE = "truncate"
INDICES = "sobol-indices"
METHODS = ("sobol", "latin-hypercube", "random", INDICES)
PLAIN = {"cov": "the standard deviation over the mean", "shape": "the exponent"}
"""Numbers that have no unit; the others of a word share one."""
Correlation = tuple[str, str, float]


class Word(NamedTuple):
    """A word of the campaign file for a law of `scipy.stats`.

    Parameters
    ----------
    law : of `scipy.stats`, which takes longer to import than most files to read, and of
        the numbers of the word
    listed : whether the numbers may stand in a list
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

        Parameters
        ----------
        probability : a number or an array
        """
        law = _law(self)
        inside = np.clip(probability, SMALLEST, 1.0 - SMALLEST)
        p = law.below_low + (law.below_high - law.below_low) * inside
        value = law.frozen.ppf(np.clip(p, SMALLEST, 1.0 - SMALLEST))
        return np.clip(value, self.low, self.high)

    def below(self, value: Any) -> Any:
        """Return the probability of a draw below a value.

        Parameters
        ----------
        value : a number or an array [unit]
        """
        law = _law(self)
        p = law.frozen.cdf(np.clip(value, self.low, self.high))
        share = (p - law.below_low) / (law.below_high - law.below_low)
        return np.clip(share, 0.0, 1.0)

    def log_density(self, value: Any) -> Any:
        """Return the log of the probability per ``unit``, −∞ beyond the ends.

        It is right however far out.

        Parameters
        ----------
        value : a number or an array [unit]
        """
        law = _law(self)
        x = np.asarray(value, float)
        slack = END_TOLERANCE * np.abs(value)
        log_mass = math.log(law.below_high - law.below_low)
        log_density = law.frozen.logpdf(x) - log_mass
        is_inside = (x >= self.low - slack) & (x <= self.high + slack)
        return np.where(is_inside, log_density, -np.inf)[()]


class _Law(NamedTuple):
    """A frozen law of `scipy.stats`, and the probabilities below its truncated ends."""

    frozen: Any
    below_low: float
    below_high: float


@cache
def _law(distribution: Distribution) -> _Law:
    """Return the law of a distribution; `scipy.stats` is imported here."""
    from scipy import stats

    frozen = WORDS[distribution.word].law(stats, *distribution.numbers)
    below_low = float(frozen.cdf(distribution.low))
    below_high = float(frozen.cdf(distribution.high))
    return _Law(frozen, below_low, below_high)


def is_distribution(value: Any) -> bool:
    """Say whether a value of the file is a table with the word of a distribution.

    Parameters
    ----------
    value : anything that a file holds
    """
    return isinstance(value, dict) and any(word in value for word in WORDS)


def read_distribution(table: dict[str, Any], where: str) -> Distribution:
    """Return the distribution of a table such as ``{normal = {mean = …, sd = …}}``.

    Parameters
    ----------
    table : with ``truncate = [a, b]`` beside the word where it is truncated
    where : its place in the file

    Raises
    ------
    CampaignError : the word's numbers are wrong, or a key does not belong
    """
    word = next(word for word in WORDS if word in table)
    extra = [key for key in table if key not in (word, TRUNCATE)]
    if extra:
        raise CampaignError(
            f"{where}: {extra[0]!r} does not belong here; units stand in the values"
        )
    numbers, unit = _numbers(word, table[word], f"{where}.{word}")
    distribution = Distribution(word, tuple(numbers), unit)
    if TRUNCATE not in table:
        return distribution
    return _truncated(distribution, table[TRUNCATE], f"{where}.{TRUNCATE}")


def _truncated(distribution: Distribution, ends: Any, where: str) -> Distribution:
    """Return a distribution between two ends that the file gives."""
    if not isinstance(ends, list) or len(ends) != 2:
        raise CampaignError(f"{where}: {shown(ends)} is not [low, high]")
    unit = distribution.unit
    low, high = (in_unit(*number_of(value, where), unit, where) for value in ends)
    if not low < high:
        raise CampaignError(
            f"{where}: from {low:g} to {high:g} there is nothing to draw"
        )
    if distribution.below(high) - distribution.below(low) < MIN_REMAINING:
        raise CampaignError(
            f"{where}: practically nothing of the distribution lies within "
            f"{shown(ends)}"
        )
    return distribution._replace(low=low, high=high)


def _numbers(word: str, written: Any, where: str) -> tuple[list[float], str | None]:
    """Return the numbers of a word in the unit of the first, and that unit."""
    names = WORDS[word].names
    listed = WORDS[word].listed
    table = written
    if listed and isinstance(written, list) and len(written) == len(names):
        table = dict(zip(names, written, strict=True))
    if not isinstance(table, dict) or set(table) != set(names):
        keys = ", ".join(f"{name} = …" for name in names)
        wanted = f"[{', '.join(names)}]" if listed else f"{{{keys}}}"
        raise CampaignError(f"{where}: {shown(table)} is not {wanted}")

    first, unit = number_of(table[names[0]], f"{where}.{names[0]}")
    numbers = [first]
    for name in names[1:]:
        value, value_unit = number_of(table[name], f"{where}.{name}")
        if name not in PLAIN:
            value = in_unit(value, value_unit, unit, where)
        elif value_unit is not None:
            raise CampaignError(f"{where}.{name}: a plain number, {PLAIN[name]}")
        numbers.append(value)
    _check(word, numbers, where)
    return numbers, unit


def number_of(value: Any, where: str) -> tuple[float, str | None]:
    """Return a number as it is written, and its unit, None where it has none.

    Parameters
    ----------
    value : a quantity or a number, as the file has it
    where : its place in the file

    Raises
    ------
    CampaignError : it is neither
    """
    if is_quantity(value):
        number, unit = split(value)
        return float(number), unit
    if not is_number(value) or not math.isfinite(value):
        raise CampaignError(
            f"{where}: {shown(value)} is neither a number nor a quantity with its unit"
        )
    return float(value), None


def in_unit(
    value: float, written_unit: str | None, unit: str | None, where: str
) -> float:
    """Return a number in another unit.

    Parameters
    ----------
    value : in the unit that is written
    written_unit, unit : from which and to which it is converted, None for plain numbers
    where : its place in the file

    Raises
    ------
    CampaignError : one is not converted to the other
    """
    if written_unit == unit:
        return value
    if written_unit is None or unit is None:
        raise CampaignError(f"{where}: one value has a unit, the other has none")
    try:
        return convert(value, written_unit, unit)
    except UnitError as error:
        raise CampaignError(f"{where}: {error}") from None


def _check(word: str, numbers: Sequence[float], where: str) -> None:
    """Refuse numbers that make no distribution."""
    definition: Any = (word, *numbers)
    match definition:
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
        case ["lognormal" | "weibull", *positive] if min(positive) <= 0.0:
            for name, number in zip(WORDS[word].names, positive, strict=True):
                if number <= 0.0:
                    raise CampaignError(
                        f"{where}.{name}: {number:g} must be greater than 0"
                    )


def correlated(
    points: Array, correlations: Sequence[Correlation], keys: list[str], where: str
) -> Array:
    """Return points of the unit cube whose columns have given rank correlations.

    Each column is still uniform.

    z = Φ⁻¹(u), z′ = L z with L Lᵀ = C, u′ = Φ(z′), where C_ij = 2 sin(π ρ_ij / 6) is
    the correlation of normal variables with the rank correlation ρ_ij (Pearson 1907).

    Parameters
    ----------
    points : u, independent, (n, keys)
    correlations : ρ; those of other pairs are 0
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
        if unknown := [key for key in (first, second) if key not in keys]:
            raise CampaignError(
                f"{where}[{number}]: {unknown[0]!r} is not drawn here; there are "
                f"{', '.join(keys)}"
            )
        if first == second:
            raise CampaignError(f"{where}[{number}]: {first!r} stands beside itself")
        row = keys.index(first)
        column = keys.index(second)
        correlation = 2.0 * sin(pi * rank / 6.0)
        matrix[row, column] = correlation
        matrix[column, row] = correlation

    try:
        lower = np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        raise CampaignError(
            f"{where}: no inputs can be correlated like this: the ρ contradict each "
            "other"
        ) from None
    normal = ndtri(np.clip(points, SMALLEST, 1.0 - SMALLEST))
    return np.asarray(ndtr(normal @ lower.T))


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
        """Refuse a number of points below 1, and a negative seed."""
        smallest = int(info.field_name == "n")
        if number < smallest:
            raise ValueError(f"{number} is no whole number from {smallest} on")
        return number

    @field_validator("correlation")
    @classmethod
    def _is_within(
        cls, correlations: list[Correlation] | None, info: ValidationInfo
    ) -> list[Correlation] | None:
        """Refuse correlations beyond ±1, and any of Sobol' indices."""
        if correlations and info.data.get("method") == INDICES:
            raise ValueError("Sobol' indices are of independent inputs: drop it")
        for correlation in correlations or ():
            if not -1.0 < correlation[2] < 1.0:
                raise ValueError(
                    f"{shown(list(correlation))} is not [key, key, ρ] with ρ within −1 "
                    "and 1"
                )
        return correlations


def draw(
    sample: SampleTable, distributions: dict[str, Distribution], where: str
) -> dict[str, tuple[Any, ...]]:
    """Return the drawn values of every key as a campaign file would write them.

    Parameters
    ----------
    sample : how
    distributions : of every drawn key
    where : place of the block in the file

    Raises
    ------
    CampaignError : the correlations are wrong
    """
    keys = list(distributions)
    if sample.method == INDICES:
        points = _pairs(sample, len(keys))
    else:
        points = _points(sample.method, sample.n, len(keys), sample.seed)
    if sample.correlation:
        place = f"{where}.sample.correlation"
        points = correlated(points, sample.correlation, keys, place)

    drawn = {}
    for key, column in zip(keys, points.T, strict=True):
        distribution = distributions[key]
        values = distribution.at(column).tolist()
        drawn[key] = tuple(written(value, distribution.unit) for value in values)
    return drawn


def _pairs(sample: SampleTable, width: int) -> Array:
    """Return A, B, and A with each input of B in turn, (n (width + 2), width)."""
    points = _points("sobol", sample.n, 2 * width, sample.seed)
    a = points[:, :width]
    b = points[:, width:]
    mixed = [np.where(np.arange(width) == column, b, a) for column in range(width)]
    return np.stack([a, b, *mixed], axis=1).reshape(-1, width)


def written(value: float, unit: str | None) -> float | str:
    """Return a value as a campaign file would write it.

    Parameters
    ----------
    value : in the unit
    unit : None for a plain number
    """
    return rounded(value) if unit is None else f"{rounded(value)!r} {unit}"


def _points(method: str, n: int, width: int, seed: int) -> Array:
    """Return n points of the unit cube, (n, width)."""
    if method == "random":
        return np.random.default_rng(seed).random((n, width))
    from scipy.stats import qmc

    kinds = {"sobol": qmc.Sobol, "latin-hypercube": qmc.LatinHypercube}
    with warnings.catch_warnings():
        # n may be no power of two: the user may add points later
        warnings.simplefilter("ignore", UserWarning)
        return np.asarray(kinds[method](width, rng=seed).random(n))
