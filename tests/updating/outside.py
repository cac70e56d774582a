"""Twins, likelihoods and quadrature that share no code with the update: what its
answers are held against.

The wear is h(x) = r (x + x²/BEND), which the stored run's cubic pieces hold exactly;
the likelihood of the measurements is written as one normal law with a whole covariance
matrix, an unknown gain on a grid.
"""

from dataclasses import dataclass, replace

import numpy as np
from made import LIMIT, RATE, ErrorModel, blocks, history, observed, study
from scipy import stats
from scipy.interpolate import PchipInterpolator

from wearlab.campaign.distributions import read_distribution
from wearlab.updating.answers import answer_of
from wearlab.updating.run_curves import ObservationPoints, RunCurve
from wearlab.updating.sampling import ALARM, checks, draw

BEND, END = 8e6, 6e6
TIMES = np.array([1e5, 2e5, 3e5, 4.5e5, 6e5, 7.5e5])
GAINS = 601  # at which an unknown gain is looked at
PRIOR_SD = np.sqrt(np.log1p(0.36))  # of ln factor, cov 0.6
PRIOR = {"lognormal": {"median": 1.0, "cov": 0.6}}
P = np.array([0.05, 0.25, 0.5, 0.75, 0.95])


def wear(x):
    return RATE * (x + x * x / BEND)


def own_time(level):
    """Return x at which h(x) is a level."""
    return 0.5 * BEND * (np.sqrt(1.0 + 4.0 * level / RATE / BEND) - 1.0)


@dataclass(frozen=True)
class Case:
    """An error model as the update is told it, and as the twins have it: medians and
    sds of ln [SI].
    """

    error: ErrorModel
    sd: tuple[float, float] = (4e-4, 0.0)
    drift: tuple[float, float] = (0.0, 0.0)
    many: int = 1
    below: float = 0.0

    @property
    def cycle(self):
        return np.repeat(TIMES, self.many)


def lognormal(median, cov):
    return read_distribution(
        {"lognormal": {"median": f"{1e3 * median} g", "cov": cov}}, "error"
    )


def spread(cov):
    return np.sqrt(np.log1p(cov**2))


CASES = {
    "known": Case(ErrorModel(4e-4)),
    "unknown": Case(ErrorModel(lognormal(4e-4, 0.8)), (4e-4, spread(0.8))),
    "relative": Case(ErrorModel(1e-4, 0.05), (1e-4, 0.0)),
    "offset": Case(ErrorModel(2e-4, 0.0, 3e-4), (2e-4, 0.0), many=4),
    "gain": Case(ErrorModel(1e-4, 0.02, gain_sd=0.2), (1e-4, 0.0)),
    "below a limit": Case(ErrorModel(4e-4), below=3e-3),
    "drift": Case(ErrorModel(1e-4, drift=2e-3), (1e-4, 0.0), (2e-3, 0.0)),
    "unknown drift": Case(
        ErrorModel(1e-4, drift=lognormal(2e-3, 0.5)), (1e-4, 0.0), (2e-3, spread(0.5))
    ),
}


def covariance(case, model, sd, drift):
    """Return the covariance of the values, and whether each pair is
    of one inspection.
    """
    t = case.cycle
    error = case.error
    own = np.diag(sd**2 + (error.relative * model) ** 2)
    own = own + error.gain_sd**2 * np.outer(model, model)
    return (
        own
        + error.offset_sd**2 * (t[:, None] == t)
        + drift**2 / 1e6 * np.minimum(t[:, None], t)
    )


def measured(case, factor, sd, drift, rng, law=wear):
    """Return values of one twin, NaN below the limit of detection."""
    model = law(factor * case.cycle)
    value = model + np.linalg.cholesky(
        covariance(case, model, sd, drift)
    ) @ rng.standard_normal(len(model))
    return np.where(value < case.below, np.nan, value)


def answer_to(case, value):
    """Return what the update makes of values."""
    seen = replace(
        observed(case.cycle, value, case.error),
        below=np.where(np.isnan(value), case.below, np.nan),
    )
    accumulates = "accumulating" if case.error.drift is not None else "none"
    asked = study(PRIOR, (seen,), accumulates)
    x = np.linspace(0.0, END, 13)
    curve = RunCurve(x, wear(x)[:, None], (RATE * (1.0 + 2.0 * x / BEND))[:, None])
    one = ObservationPoints(curve, np.zeros(len(seen), np.intp), seen.time)
    run = replace(
        history((seen,), end=END),
        points=(one,),
        limit=curve,
        limit_cycle=float(own_time(LIMIT.value)),
        beside={"worn_mass": curve},
    )
    return answer_of(asked, (run,), blocks((seen,), accumulating=accumulates != "none"))


def log_normal_density(case, value, factor, sd, drift):
    """Return ln p(values | factors, sd, drift), (factors,)."""
    model = wear(factor[:, None] * case.cycle)
    if case.error.gain_sd:
        gains = np.linspace(
            1.0 - 6.0 * case.error.gain_sd, 1.0 + 6.0 * case.error.gain_sd, GAINS
        )
        logs = np.full(len(factor), -np.inf)
        for gain in gains:
            own = np.sqrt(sd**2 + (case.error.relative * gain * model) ** 2)
            each = stats.norm.logpdf(value, gain * model, own).sum(axis=1)
            logs = np.logaddexp(
                logs, each + stats.norm.logpdf(gain, 1.0, case.error.gain_sd)
            )
        return logs
    hidden = np.isnan(value)
    if case.error.relative or hidden.any():
        each = np.sqrt(sd**2 + (case.error.relative * model) ** 2)
        logs = np.where(
            hidden,
            stats.norm.logcdf((case.below - model) / each),
            stats.norm.logpdf(value, model, each),
        )
        return logs.sum(axis=1)
    root = np.linalg.cholesky(covariance(case, model[0], sd, drift))
    z = np.linalg.solve(root, (value - model).T)
    return -0.5 * (z**2).sum(axis=0) - np.log(np.diagonal(root)).sum()


def quantiles_of(case, value, points=20_001, nodes=161):
    """Return quantiles of the factor by quadrature: even in ln factor, Gauss-Legendre
    in ln of an error.
    """
    laws = [case.sd, case.drift]
    axes = []
    for median, width in laws:
        if width:
            x, w = np.polynomial.legendre.leggauss(nodes)
            z = 8.0 * x
            axes.append((median * np.exp(width * z), 8.0 * w * stats.norm.pdf(z)))
        else:
            axes.append((np.array([median]), np.ones(1)))
    low = -9.0 * PRIOR_SD
    high = 9.0 * PRIOR_SD
    for n in (2001, 2001, points):
        u = np.linspace(low, high, n)
        logs = [
            log_normal_density(case, value, np.exp(u), sd, drift) + np.log(a * b)
            for sd, a in zip(*axes[0], strict=True)
            for drift, b in zip(*axes[1], strict=True)
        ]
        total = np.logaddexp.reduce(logs, axis=0) + stats.norm.logpdf(u, 0.0, PRIOR_SD)
        held = np.flatnonzero(total > total.max() - 30.0)
        low = u[max(held[0] - 1, 0)]
        high = u[min(held[-1] + 1, n - 1)]
    density = np.exp(total - total.max())
    below = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    inside = (below / below[-1] > 1e-7) & (below / below[-1] < 1.0 - 1e-7)
    return np.exp(PchipInterpolator(below[inside] / below[-1], u[inside])(P))


def true_life(case, factor, drift, value_of_w, rng):
    """Return the life of a twin.

    With a drift walked on from the last inspection in small steps.
    """
    if not drift:
        return own_time(LIMIT.value) / factor
    now = TIMES[-1]
    w = value_of_w
    step = 1000.0
    t = now + step * np.arange(0, 6000)
    path = w + np.concatenate(
        [[0.0], np.cumsum(drift * np.sqrt(step / 1e6) * rng.standard_normal(5999))]
    )
    gap = LIMIT.value - wear(factor * t) - path
    crossed = np.exp(
        -2.0
        * np.maximum(gap[:-1], 0.0)
        * np.maximum(gap[1:], 0.0)
        / (drift**2 / 1e6 * step)
    )
    over = (gap[1:] <= 0.0) | (crossed > rng.random(len(crossed)))
    return float(t[1:][np.argmax(over)] - 0.5 * step) if over.any() else np.inf


def twin(case, seed):
    """Return the ranks of factor and life of one twin, and whether it
    was called wrongly.
    """
    rng = np.random.default_rng([5, seed])
    factor = float(np.exp(PRIOR_SD * rng.standard_normal()))
    sd, drift = (
        median * np.exp(width * rng.standard_normal())
        for median, width in (case.sd, case.drift)
    )
    walk = np.cumsum(
        drift
        * np.sqrt(np.diff(TIMES, prepend=0.0) / 1e6)
        * rng.standard_normal(len(TIMES))
    )
    model = wear(factor * case.cycle)
    value = (
        model
        + np.repeat(walk, case.many)
        + case.error.offset_sd * np.repeat(rng.standard_normal(6), case.many)
    )
    gain = 1.0 + case.error.gain_sd * rng.standard_normal()
    value = value + (gain - 1.0) * model
    model = gain * model
    value = value + np.hypot(sd, case.error.relative * model) * rng.standard_normal(
        len(model)
    )
    value = np.where(value < case.below, np.nan, value)
    life = true_life(case, factor, drift, float(walk[-1]), rng)
    answer = answer_to(case, value)
    each, courses = checks(draw(answer, 300, rng))
    called = (
        any(check.p < ALARM / len(each) for check in each)
        or min(courses.values(), default=1.0) < ALARM
    )
    over = (
        drift > 0.0 and wear(factor * TIMES[-1]) + walk[-1] >= LIMIT.value
    )  # when, nobody knows any more
    rank = rng.random() * answer.passed if over else float(answer.life_below(life)[0])
    return answer.factor_below(factor), rank, called


def coverage(case, n):
    """Return how many of n twins the intervals of factor and life
    hold, and how many are called.
    """
    found = np.array([twin(case, seed) for seed in range(n)], float)
    off = np.abs(found[:, :2] - 0.5)
    held = {
        (name, w): int((off[:, k] <= 0.005 * w).sum())
        for k, name in enumerate(("factor", "life"))
        for w in (50, 90)
    }
    return held, int(found[:, 2].sum())
