"""Inputs that go together: a Gaussian copula with given rank correlations."""

from math import pi, sin
from typing import Any, NamedTuple

from wearlab.campaign.errors import CampaignError
from wearlab.scene.problems import shown


class Correlation(NamedTuple):
    """Spearman's rank correlation ρ of two drawn keys, −1 < ρ < 1."""

    one: str
    other: str
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
    found = []
    for number, one in enumerate(given):
        fits = isinstance(one, list) and len(one) == 3 and all(isinstance(key, str) for key in one[:2])
        rank = one[2] if fits else None
        if isinstance(rank, bool) or not isinstance(rank, int | float) or not -1.0 < rank < 1.0:
            raise CampaignError(
                [f"{where}[{number}]: {shown(one)} is not [key, key, ρ] with ρ within −1 and 1"]
            )
        found.append(Correlation(one[0], one[1], float(rank)))
    return tuple(found)


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
    for number, one in enumerate(correlations):
        for key in one[:2]:
            if key not in keys:
                raise CampaignError(
                    [f"{where}[{number}]: {key!r} is not drawn here; there are {', '.join(keys)}"]
                )
        i, j = keys.index(one.one), keys.index(one.other)
        if i == j:
            raise CampaignError([f"{where}[{number}]: {one.one!r} stands beside itself"])
        matrix[i, j] = matrix[j, i] = 2.0 * sin(pi * one.rank / 6.0)
    try:
        lower = np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        raise CampaignError(
            [f"{where}: no inputs can be correlated like this: the ρ contradict each other"]
        ) from None
    uniform = np.clip(np.asarray(points), 2.0**-40, 1.0 - 2.0**-40)
    found: list[list[float]] = ndtr(ndtri(uniform) @ lower.T).tolist()
    return found
