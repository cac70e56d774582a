"""More runs where the posterior is: one adaptive round of importance sampling.

Draws from the prior are re-weighted by the evidence of each run, with k and the errors integrated out. Where
few of them carry the weight, as many more are drawn from a normal law fitted to them, in scores of the prior
(z, standard normal before), and all are weighted as if drawn from the mixture (balance heuristic, Veach &
Guibas 1995), so that none of the first is lost.
"""

from statistics import NormalDist

import numpy as np

from wearlab.arrays import Array
from wearlab.campaign.distributions import Distribution
from wearlab.campaign.sampling import written

WIDER = 1.5  # times the posterior's own spread
FEWEST = 100.0  # effective runs below which more are drawn
STANDARD = NormalDist()


def scores(values: Array, distribution: Distribution) -> Array:
    """Return the standard scores of values, 0 at the prior's median."""
    inside = np.clip([distribution.below(float(x)) for x in values], 1e-12, 1.0 - 1e-12)
    return np.array([STANDARD.inv_cdf(float(p)) for p in inside])


def fitted(z: Array, weight: Array) -> tuple[Array, Array]:
    """Return mean and covariance of weighted scores, (keys,) and (keys, keys), the latter widened."""
    mean = weight @ z
    off = z - mean
    cov = (off * weight[:, None]).T @ off
    return mean, WIDER**2 * (cov + 1e-4 * np.eye(z.shape[1]))


def proposed(
    mean: Array, covariance: Array, distributions: dict[str, Distribution], n: int, seed: int
) -> dict[str, tuple[float | str, ...]]:
    """Return values drawn from the fitted law, as a campaign file would write them."""
    from scipy.stats import qmc

    size = 1 << max(n - 1, 0).bit_length()
    points = qmc.Sobol(len(mean), rng=seed + 1).random(size)[:n]
    inside = np.clip(points, 1e-9, 1.0 - 1e-9)
    normal = np.array([[STANDARD.inv_cdf(float(p)) for p in row] for row in inside])
    z = mean + normal @ np.linalg.cholesky(covariance).T
    return {
        key: tuple(written(distribution.at(STANDARD.cdf(float(x))), distribution.unit) for x in z[:, column])
        for column, (key, distribution) in enumerate(distributions.items())
    }


def log_mixture(z: Array, mean: Array, covariance: Array, first: int, second: int) -> Array:
    """Return the log of the density that all were drawn from, over that of the prior.

    Parameters
    ----------
    z : (n, keys) scores
    mean, covariance : of the second round
    first, second : numbers of draws of the two rounds
    """
    inverse = np.linalg.inv(covariance)
    off = z - mean
    square = np.einsum("ij,jk,ik->i", off, inverse, off) - np.sum(z * z, axis=1)
    log_ratio = -0.5 * (square + np.linalg.slogdet(covariance)[1])
    share = second / (first + second)
    return np.asarray(np.logaddexp(np.log1p(-share), np.log(share) + log_ratio))
