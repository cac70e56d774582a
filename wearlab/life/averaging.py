"""The wear rate averaged over mesh periods, meshes and error angles, and how far it scatters."""

from collections.abc import Callable, Sequence

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.wear.law import PreparedLaw, wear_rate

BLOCK = 20
"""Mesh periods of an aperiodic response that are averaged before their scatter counts as independent."""
LEAST_BLOCKS = 3
"""Blocks into which fewer periods than so many blocks take are cut, shorter ones then."""


def averaged_rate(law: PreparedLaw, weight: Array, tooth_force: Array, depth: Array) -> Array:
    """Return the wear per cycle averaged over rows of tooth forces, (2, n) [m per cycle].

    Parameters
    ----------
    law : the wear law
    weight : (n_rows,) of each row, summing to 1 [1]
    tooth_force : (n_rows, n) [N]
    depth : (2, n) wear so far [m]
    """
    if len(tooth_force) == 1:
        return wear_rate(law, tooth_force[0], depth)
    if law.linear:
        return wear_rate(law, weight @ tooth_force, depth)
    rates = np.stack([wear_rate(law, force, depth) for force in tooth_force])
    return np.einsum("r,rfn->fn", weight, rates)


def scatter(rate_of: Callable[[Index], Array], meshes: int, periods: Sequence[int]) -> float:
    """Return the standard error of the averaged rate, largest over the nodes, from blocks of mesh periods.

    Parameters
    ----------
    rate_of : the rate (2, n) that some of the rows make by themselves [m per cycle]; rows are those of every
        response in turn, of its meshes, of their mesh periods
    meshes : meshes of the kind
    periods : mesh periods of each response
    """
    largest, first = 0.0, 0
    for count in periods:
        length = min(BLOCK, max(1, count // LEAST_BLOCKS))
        blocks = count // length
        if blocks >= LEAST_BLOCKS:
            row = first + count * np.arange(meshes)[:, None] + np.arange(length)
            means = np.stack([rate_of((row + length * block).ravel()) for block in range(blocks)])
            largest = max(largest, float(means.std(axis=0, ddof=1).max() / np.sqrt(blocks)))
        first += meshes * count
    return largest
