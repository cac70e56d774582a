"""The wear rate averaged over mesh periods, meshes and error angles, and how far it scatters."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wearlab.wear.law import PreparedLaw, wear_rate

Array = NDArray[np.float64]

BLOCK = 20
"""Mesh periods of an aperiodic response that are averaged before their scatter counts as independent."""


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


def scatter(law: PreparedLaw, tooth_force: Array, depth: Array, meshes: int, periods: Sequence[int]) -> float:
    """Return the standard error of the averaged rate, largest over the nodes, from blocks of mesh periods.

    Parameters
    ----------
    law : the wear law
    tooth_force : (n_rows, n) of every response in turn, of its meshes, of their mesh periods [N]
    depth : (2, n) wear so far [m]
    meshes : meshes of the kind
    periods : mesh periods of each response
    """
    found, first = 0.0, 0
    for count in periods:
        rows = tooth_force[first : first + meshes * count]
        if count >= 2 * BLOCK and len(rows):
            found = max(found, _scatter(law, rows, depth, meshes, count // BLOCK))
        first += meshes * count
    return found


def _scatter(law: PreparedLaw, tooth_force: Array, depth: Array, meshes: int, blocks: int) -> float:
    rates = np.stack([wear_rate(law, force, depth) for force in tooth_force])
    rates = rates.reshape(meshes, -1, *rates.shape[1:]).mean(axis=0)
    means = rates[: blocks * BLOCK].reshape(blocks, BLOCK, *rates.shape[1:]).mean(axis=1)
    return float(means.std(axis=0, ddof=1).max() / np.sqrt(blocks))
