"""Inputs that go together: a Gaussian copula with given rank correlations."""

from math import pi, sin
from typing import Any, NamedTuple

from wearlab.campaign.errors import CampaignError
from wearlab.scene.problems import shown


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
