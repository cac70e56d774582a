"""Lives of eight readings by an own, dense quadrature over courses of the wear rate.

Wear is straight in the cycles, and the prior of ln factor flat. Courses, errors and
scatters are on even grids, all alike at every set of readings; nothing is narrowed. Of
a course, with an error and a scatter, the wear at the last reading is normal, and the
life is drawn from all of them by their weights.
"""

from dataclasses import dataclass, field

import numpy as np
from laws import ERRORS, LAST, LIMIT, QUANTILES, SD, TIMES
from scipy import stats

from wearlab.updating import rate_drift

SHARES = TIMES / LAST  # of the time inspected
DRAWS = 2000
SIZES = {
    "power": np.linspace(-1.2, 1.2, 121),
    "change": np.linspace(-3.0, 3.0, 61),
    "running-in": np.linspace(0.02, 4.0, 41),
}
PROPORTION = {"power": 0.25, "change": 1.0, "running-in": 2.25}
PLACES = {
    "power": np.ones(1),
    "change": (np.arange(16) + 0.5) / 16,
    "running-in": np.geomspace(0.01, 0.3, 7),
}
LOG_SD = np.log(SD) + np.linspace(-2.2, 1.7, 16)
SD_OF_LOG = np.sqrt(np.log(2.0))  # of a lognormal law with a cov of 1
NEGLIGIBLE = 7.0  # of ln of the weight of courses, by errors that are large


@dataclass(frozen=True)
class Drifts:
    """What is probable before of the wear rate and of errors; as the package has it.

    Parameters
    ----------
    shares : probability of a steady rate, a power, a change and running-in
    scale : of ln of the ratio by which a rate drifts
    scatter : probability of relative errors besides those that are named
    laws : kind, size and place of the only ones there are, all alike [as by `shares`]
    """

    shares: dict[str, float] = field(default_factory=lambda: dict(rate_drift.SHARE))
    scale: float = rate_drift.SCALE
    scatter: dict[float, float] = field(
        default_factory=lambda: dict(rate_drift.SCATTER)
    )

    laws: tuple[tuple[str, float, float], ...] = ()

    def courses(self):
        """Return kind, size, place and ln of the probability of every course."""
        rows = [(*law, 1.0 / len(self.laws)) for law in self.laws]
        if self.laws:
            return self._columns(rows)
        if self.shares["steady"]:
            rows.append(("power", 0.0, 1.0, self.shares["steady"]))
        for kind, sizes in SIZES.items():
            if not self.shares[kind]:
                continue
            density = stats.t(3.0, scale=self.scale * PROPORTION[kind]).pdf(sizes)
            each = self.shares[kind] * density / density.sum() / len(PLACES[kind])
            rows += [
                (kind, size, place, one)
                for place in PLACES[kind]
                for size, one in zip(sizes, each, strict=True)
            ]
        return self._columns(rows)

    def _columns(self, rows):
        kinds, sizes, places, each = (np.array(c) for c in zip(*rows, strict=True))
        return kinds, sizes, places, np.log(each)


def passed(kind, size, place, x):
    """Return the share of equal wear that has passed at x, not yet 1 at 1."""
    ratio = np.exp(size)
    change = np.minimum(x, place) + ratio * np.maximum(x - place, 0.0)
    running_in = x + (ratio - 1.0) * place * (1.0 - np.exp(-x / place))
    return np.where(
        kind == "power", x**ratio, np.where(kind == "change", change, running_in)
    )


def time_of(kind, size, place, wear):
    """Return the share of the time at which so much equal wear has passed."""
    ratio = np.exp(size)
    power = wear ** (1.0 / ratio)
    change = np.where(wear <= place, wear, place + (wear - place) / ratio)
    extra = (ratio - 1.0) * place
    x = np.maximum(wear - extra, 1e-3)
    for _ in range(8):
        off = x + extra * (1.0 - np.exp(-x / place)) - wear
        x = np.maximum(x - off / (1.0 + extra / place * np.exp(-x / place)), 1e-6)
    return np.where(kind == "power", power, np.where(kind == "change", change, x))


class Quadrature:
    """Lives by one prior.

    Parameters
    ----------
    prior : of the rate and of errors
    """

    def __init__(self, prior: Drifts):
        self.scatter = prior.scatter
        self.kind, self.size, self.place, self.log_prior = prior.courses()
        of_courses = (self.kind[:, None], self.size[:, None], self.place[:, None])
        self.whole = passed(*of_courses, 1.0)[:, 0]
        self.model = passed(*of_courses, SHARES[None]) / self.whole[:, None]

    def lives(self, value, known, probabilities=QUANTILES, draws=DRAWS):
        """Return quantiles of the life over the true one."""
        log_sd, log_prior_of_sd = np.log([SD]), np.zeros(1)
        if known != "known":
            log_sd = LOG_SD
            log_prior_of_sd = -0.5 * ((LOG_SD - np.log(SD)) / SD_OF_LOG) ** 2

        # courses that even large errors do not reach
        best = self.model @ value / np.sum(self.model**2, axis=1)
        rest = np.sum((value - best[:, None] * self.model) ** 2, axis=1)
        large = SD**2 + (0.02 * LIMIT.value) ** 2
        rough = self.log_prior - 0.5 * rest / large
        counted = np.flatnonzero(rough > rough.max() - NEGLIGIBLE)
        model = self.model[counted]
        said = np.maximum(best[counted, None], 1e-9) * model

        parts = [
            of_scatter(model, said, value, log_sd, scatter) for scatter in self.scatter
        ]
        amplitude, sd, logs = (np.array(part) for part in zip(*parts, strict=True))
        logs += self.log_prior[counted, None] + log_prior_of_sd
        logs += np.log(list(self.scatter.values()))[:, None, None]
        below = np.cumsum(np.exp(logs - logs.max()).ravel())

        rng = np.random.default_rng(0)
        at = (np.arange(draws) + rng.random()) / draws * below[-1]
        drawn = np.minimum(np.searchsorted(below, at), len(below) - 1)
        score = stats.norm.ppf((np.arange(draws) + 0.5) / draws)
        worn = amplitude.ravel()[drawn] + sd.ravel()[drawn] * rng.permutation(score)
        course = counted[drawn // len(log_sd) % len(counted)]
        wear = LIMIT.value / np.maximum(worn, 1e-9) * self.whole[course]
        life = time_of(self.kind[course], self.size[course], self.place[course], wear)
        return np.quantile(LAST * life, probabilities)


def of_scatter(model, said, value, log_sd, scatter):
    """Return the wear at the last reading, its sd, and ln of the evidence.

    Each (courses, errors).
    """
    variance = np.exp(2.0 * log_sd)[:, None] + (scatter * said[:, None, :]) ** 2
    weight = 1.0 / variance
    square = np.einsum("csn,cn->cs", weight, model**2)
    cross = np.einsum("csn,cn->cs", weight, model * value)
    amplitude = np.maximum(cross / square, 1e-9)
    rest = weight @ value**2 - cross**2 / square
    logs = -0.5 * (np.log(variance).sum(axis=2) + np.log(square) + rest)
    return amplitude, 1.0 / np.sqrt(square), logs - np.log(amplitude)


def least_mean_width(share, lives):
    """Return the least mean width of intervals of clean sets, over a steady 90 % one.

    Intervals, however they are made, hold the life of every power of the cycles from
    0.6 to 1.5 in a share of the sets, the sd being known. A life is in one of a clean
    set no more rarely than the most powerful test of the nearest such law at that level
    accepts it, and the mean width is the integral of that over lives (Pratt 1961,
    https://doi.org/10.1080/01621459.1961.10480644).

    Parameters
    ----------
    share : of the sets
    lives : over which is summed, rising, the true one 1
    """
    power = np.linspace(0.6, 1.5, 181)[:, None]
    distance = [
        np.linalg.norm((TIMES / life) ** power - TIMES, axis=1).min() for life in lives
    ]
    in_interval = stats.norm.cdf(
        stats.norm.ppf(share) - np.array(distance) * LIMIT.value / SD
    )
    least = np.trapezoid(in_interval, lives)
    steady = 2.0 * stats.norm.ppf(0.95) * SD / np.linalg.norm(TIMES) / LIMIT.value
    return float(least / steady)


__all__ = ["ERRORS", "Drifts", "Quadrature", "least_mean_width"]
