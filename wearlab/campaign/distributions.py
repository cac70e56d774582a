"""What values are drawn from, and how: distributions, correlations and samples."""

import math
import warnings
from math import pi, sin
from statistics import NormalDist
from typing import Any, NamedTuple, Protocol

from wearlab.campaign.inheritance import CampaignError
from wearlab.scene.problems import not_a_choice, shown
from wearlab.units import UnitError, convert, is_quantity, split

SMALLEST = 2.0**-40  # a probability; a Sobol point may be exactly 0
LEAST_KEPT = 1e-9  # probability that a truncation must leave
TRUNCATE = "truncate"
STANDARD = NormalDist()


class Shape(Protocol):
    """A distribution without unit and truncation."""

    def quantile(self, p: float) -> float:
        """Return the value with probability ``p`` below it."""

    def below(self, x: float) -> float:
        """Return the probability of a value below ``x``."""

    def density(self, x: float) -> float:
        """Return the probability per unit of ``x`` there."""


class Uniform(NamedTuple):
    """The same density from ``low`` to ``high``."""

    low: float
    high: float

    def quantile(self, p: float) -> float:
        """Return the value with probability ``p`` below it."""
        return self.low + (self.high - self.low) * p

    def below(self, x: float) -> float:
        """Return the probability of a value below ``x``."""
        return min(max((x - self.low) / (self.high - self.low), 0.0), 1.0)

    def density(self, x: float) -> float:
        """Return the probability per unit of ``x`` there."""
        return 1.0 / (self.high - self.low) if self.low <= x <= self.high else 0.0


class LogUniform(NamedTuple):
    """The same density in ln x from ``low`` to ``high``."""

    low: float
    high: float

    def quantile(self, p: float) -> float:
        """Return the value with probability ``p`` below it."""
        return self.low * (self.high / self.low) ** p

    def below(self, x: float) -> float:
        """Return the probability of a value below ``x``."""
        if x <= self.low:
            return 0.0
        return min(math.log(x / self.low) / math.log(self.high / self.low), 1.0)

    def density(self, x: float) -> float:
        """Return the probability per unit of ``x`` there."""
        return 1.0 / (x * math.log(self.high / self.low)) if self.low <= x <= self.high else 0.0


class Triangular(NamedTuple):
    """Density rising linearly from ``low`` to ``mode`` and falling to ``high``."""

    low: float
    mode: float
    high: float

    def quantile(self, p: float) -> float:
        """Return the value with probability ``p`` below it."""
        width, rise, fall = self.high - self.low, self.mode - self.low, self.high - self.mode
        if p * width <= rise:
            return self.low + math.sqrt(p * width * rise)
        return self.high - math.sqrt((1.0 - p) * width * fall)

    def below(self, x: float) -> float:
        """Return the probability of a value below ``x``."""
        width = self.high - self.low
        if x <= self.low:
            return 0.0
        if x >= self.high:
            return 1.0
        if x < self.mode:
            return (x - self.low) ** 2 / (width * (self.mode - self.low))
        return 1.0 - (self.high - x) ** 2 / (width * (self.high - self.mode))

    def density(self, x: float) -> float:
        """Return the probability per unit of ``x`` there."""
        if not self.low <= x <= self.high:
            return 0.0
        top = 2.0 / (self.high - self.low)
        if x == self.mode:
            return top
        if x < self.mode:
            return top * (x - self.low) / (self.mode - self.low)
        return top * (self.high - x) / (self.high - self.mode)


class Normal(NamedTuple):
    """Gaussian, by mean and standard deviation."""

    mean: float
    sd: float

    def quantile(self, p: float) -> float:
        """Return the value with probability ``p`` below it."""
        return self.mean + self.sd * STANDARD.inv_cdf(p)

    def below(self, x: float) -> float:
        """Return the probability of a value below ``x``."""
        return STANDARD.cdf((x - self.mean) / self.sd)

    def density(self, x: float) -> float:
        """Return the probability per unit of ``x`` there."""
        return STANDARD.pdf((x - self.mean) / self.sd) / self.sd


class LogNormal(NamedTuple):
    """Gaussian in ln x: ``median`` and the coefficient of variation, sd(ln x)² = ln(1 + cov²)."""

    median: float
    cov: float

    @property
    def log_sd(self) -> float:
        """Standard deviation of ln x."""
        return math.sqrt(math.log1p(self.cov**2))

    def quantile(self, p: float) -> float:
        """Return the value with probability ``p`` below it."""
        return self.median * math.exp(self.log_sd * STANDARD.inv_cdf(p))

    def below(self, x: float) -> float:
        """Return the probability of a value below ``x``."""
        return 0.0 if x <= 0.0 else STANDARD.cdf(math.log(x / self.median) / self.log_sd)

    def density(self, x: float) -> float:
        """Return the probability per unit of ``x`` there."""
        if x <= 0.0:
            return 0.0
        return STANDARD.pdf(math.log(x / self.median) / self.log_sd) / (self.log_sd * x)


class Weibull(NamedTuple):
    """Probability below x = 1 − exp(−(x/scale)^shape)."""

    scale: float
    shape: float

    def quantile(self, p: float) -> float:
        """Return the value with probability ``p`` below it."""
        return float(self.scale * (-math.log1p(-p)) ** (1.0 / self.shape))

    def below(self, x: float) -> float:
        """Return the probability of a value below ``x``."""
        return 0.0 if x <= 0.0 else -math.expm1(-((x / self.scale) ** self.shape))

    def density(self, x: float) -> float:
        """Return the probability per unit of ``x`` there."""
        if x <= 0.0:
            return 0.0
        part = (x / self.scale) ** self.shape
        return float(self.shape / x * part * math.exp(-part))


class Word(NamedTuple):
    """A word of the campaign file: what it builds, from which numbers.

    Parameters
    ----------
    shape : the distribution
    names : of its numbers
    listed : whether they may stand in a list
    plain : the one of them that has no unit, None: all share one
    about : what that one is
    """

    shape: type[Any]
    names: tuple[str, ...]
    listed: bool = False
    plain: str | None = None
    about: str = ""


WORDS = {
    "lognormal": Word(
        LogNormal, ("median", "cov"), plain="cov", about="the standard deviation over the mean"
    ),
    "normal": Word(Normal, ("mean", "sd")),
    "uniform": Word(Uniform, ("low", "high"), listed=True),
    "loguniform": Word(LogUniform, ("low", "high"), listed=True),
    "triangular": Word(Triangular, ("low", "mode", "high"), listed=True),
    "weibull": Word(Weibull, ("scale", "shape"), plain="shape", about="the exponent"),
}
DISTRIBUTIONS = tuple(WORDS)


class Distribution(NamedTuple):
    """What a value is drawn from, in ``unit``, between ``low`` and ``high``."""

    shape: Shape
    unit: str | None = None
    low: float = -math.inf
    high: float = math.inf

    def at(self, probability: float) -> float:
        """Return the value that a draw stays below with this probability."""
        p = min(max(probability, SMALLEST), 1.0 - SMALLEST)
        below, above = self._ends
        value = self.shape.quantile(min(max(below + (above - below) * p, SMALLEST), 1.0 - SMALLEST))
        return min(max(value, self.low), self.high)

    def below(self, value: float) -> float:
        """Return the probability of a draw below this value."""
        below, above = self._ends
        inside = min(max(value, self.low), self.high)
        return min(max((self.shape.below(inside) - below) / (above - below), 0.0), 1.0)

    def density(self, value: float) -> float:
        """Return the probability per ``unit`` at this value."""
        if not self.low <= value <= self.high:
            return 0.0
        below, above = self._ends
        return self.shape.density(value) / (above - below)

    @property
    def _ends(self) -> tuple[float, float]:
        return self.shape.below(self.low), self.shape.below(self.high)


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
        raise CampaignError([f"{where}: {extra[0]!r} does not belong here; units stand in the values"])
    numbers, unit = _numbers(WORDS[kind], given[kind], f"{where}.{kind}")
    shape = WORDS[kind].shape(*numbers)
    _check(shape, f"{where}.{kind}")
    if TRUNCATE not in given:
        return Distribution(shape, unit)
    ends = given[TRUNCATE]
    place = f"{where}.{TRUNCATE}"
    if not isinstance(ends, list) or len(ends) != 2:
        raise CampaignError([f"{place}: {shown(ends)} is not [low, high]"])
    low, high = (_in(value, unit, place) for value in ends)
    if not low < high:
        raise CampaignError([f"{place}: from {low:g} to {high:g} there is nothing to draw"])
    if shape.below(high) - shape.below(low) < LEAST_KEPT:
        raise CampaignError([f"{place}: practically nothing of the distribution lies within {shown(ends)}"])
    return Distribution(shape, unit, low, high)


def _numbers(word: Word, given: Any, where: str) -> tuple[list[float], str | None]:
    """Return the numbers of a word in the unit of the first, and that unit."""
    if word.listed and isinstance(given, list) and len(given) == len(word.names):
        given = dict(zip(word.names, given, strict=True))
    if not isinstance(given, dict) or set(given) != set(word.names):
        keys = ", ".join(f"{name} = …" for name in word.names)
        wanted = f"[{', '.join(word.names)}]" if word.listed else f"{{{keys}}}"
        raise CampaignError([f"{where}: {shown(given)} is not {wanted}"])
    first, unit = _number(given[word.names[0]], f"{where}.{word.names[0]}")
    numbers = [first]
    for name in word.names[1:]:
        value, own = _number(given[name], f"{where}.{name}")
        if name != word.plain:
            value = _in_unit(value, own, unit, where)
        elif own is not None:
            raise CampaignError([f"{where}.{name}: a plain number, {word.about}"])
        numbers.append(value)
    return numbers, unit


def _in(value: Any, unit: str | None, where: str) -> float:
    number, own = _number(value, where)
    return _in_unit(number, own, unit, where)


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


def _check(shape: Shape, where: str) -> None:
    """Refuse numbers that make no distribution."""
    match shape:
        case Uniform(low, high) | LogUniform(low, high) if not low < high:
            raise CampaignError([f"{where}: from {low:g} to {high:g} there is nothing to draw"])
        case LogUniform(low, _) if low <= 0.0:
            raise CampaignError([f"{where}.low: {low:g} must be greater than 0"])
        case Triangular(low, mode, high) if not (low <= mode <= high and low < high):
            raise CampaignError([f"{where}: {low:g}, {mode:g}, {high:g} are not in rising order"])
        case Normal(_, spread) | LogNormal(_, spread) if spread <= 0.0:
            name = "sd" if isinstance(shape, Normal) else "cov"
            raise CampaignError([f"{where}.{name}: {spread:g} must be greater than 0; or write a value"])
        case LogNormal(median, _) if median <= 0.0:
            raise CampaignError([f"{where}.median: {median:g} must be greater than 0"])
        case Weibull(scale, exponent) if scale <= 0.0 or exponent <= 0.0:
            name, number = ("scale", scale) if scale <= 0.0 else ("shape", exponent)
            raise CampaignError([f"{where}.{name}: {number:g} must be greater than 0"])


class Correlation(NamedTuple):
    """Spearman's rank correlation ρ of two drawn keys, −1 < ρ < 1."""

    first: str
    second: str
    rank: float


def read_correlations(given: Any, where: str) -> tuple[Correlation, ...]:
    """Return the correlations of a sample.

    Parameters
    ----------
    given : list of [key, key, ρ]
    where : place in the file

    Raises
    ------
    CampaignError : an entry is malformed
    """
    if not isinstance(given, list):
        raise CampaignError([f"{where}: {shown(given)} is no list of [key, key, ρ]"])
    correlations = []
    for number, block in enumerate(given):
        fits = isinstance(block, list) and len(block) == 3 and all(isinstance(key, str) for key in block[:2])
        rank = block[2] if fits else None
        if isinstance(rank, bool) or not isinstance(rank, int | float) or not -1.0 < rank < 1.0:
            raise CampaignError(
                [f"{where}[{number}]: {shown(block)} is not [key, key, ρ] with ρ within −1 and 1"]
            )
        correlations.append(Correlation(block[0], block[1], float(rank)))
    return tuple(correlations)


def coupled(
    points: list[list[float]], correlations: tuple[Correlation, ...], keys: list[str], where: str
) -> list[list[float]]:
    """Return points of the unit cube whose columns have the wanted rank correlations, each still uniform.

    z = Φ⁻¹(u), z′ = L z with L Lᵀ = C, u′ = Φ(z′), where C_ij = 2 sin(π ρ_ij / 6) is the correlation of
    normal variables with the rank correlation ρ_ij (Pearson 1907).

    Parameters
    ----------
    points : u, independent, (n, keys)
    correlations : ρ; others are 0
    keys : what the columns are
    where : place in the file

    Raises
    ------
    CampaignError : a key is not drawn here, stands beside itself, or the correlations contradict each other
    """
    import numpy as np
    from scipy.special import ndtr, ndtri

    matrix = np.eye(len(keys))
    for number, correlation in enumerate(correlations):
        for key in correlation[:2]:
            if key not in keys:
                raise CampaignError(
                    [f"{where}[{number}]: {key!r} is not drawn here; there are {', '.join(keys)}"]
                )
        i, j = keys.index(correlation.first), keys.index(correlation.second)
        if i == j:
            raise CampaignError([f"{where}[{number}]: {correlation.first!r} stands beside itself"])
        matrix[i, j] = matrix[j, i] = 2.0 * sin(pi * correlation.rank / 6.0)
    try:
        lower = np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        raise CampaignError(
            [f"{where}: no inputs can be correlated like this: the ρ contradict each other"]
        ) from None
    uniform = np.clip(np.asarray(points), 2.0**-40, 1.0 - 2.0**-40)
    shares: list[list[float]] = ndtr(ndtri(uniform) @ lower.T).tolist()
    return shares


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
