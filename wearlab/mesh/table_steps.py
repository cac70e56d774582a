"""Steps that land where a stiffness from a table bends, few where it does not.

A table may be flat over half a mesh period and a ramp over a twentieth of it. Uniform steps that resolve
the ramp waste most of themselves; steps cut at points of the table, wherever a group of them does not
resolve it, do not.
"""

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.mesh.stages import StageGrid

Stiffness = Callable[[Array, float], Array]
"""Mesh stiffnesses (n_mesh, n) at phases (n,) of the clock, on the side of a phase inside the segment."""

LOOKED = 16
"""Evenly spaced places, beside the points of the tables, at which a group is asked for what it misses."""
SHARE = 0.1
"""What a single group may have of all that may be missed [1]."""
APART = 1e-5
"""Least phase between two cuts, beyond which no group is cut further [1]."""


class Tables(NamedTuple):
    """Mesh stiffnesses that are read off tables.

    Parameters
    ----------
    points : (k,) phases of the points of all tables [1]
    stiffness : the mesh stiffnesses
    """

    points: Array
    stiffness: Stiffness


def table_grid(
    breaks: Array, steps: int, multiple: int, tables: Tables, missing: float, most: int
) -> StageGrid | None:
    """Cut one mesh period into steps that land on breaks and, where that takes it, on points of tables.

    Parameters
    ----------
    breaks : (n,) ascending phases in [0, 1) at which something jumps; 0 is added when missing [1]
    steps : no step is longer than one of so many
    multiple : equal steps that make a group; a group has its ends and middles as nodes
    tables : what bends the stiffnesses
    missing : what the groups' polynomials may miss of them in the mean over the period, over their size [1]
    most : steps beyond which there is no such grid

    Returns
    -------
    StageGrid, or None.
    """
    edges = np.unique(np.concatenate([[0.0], np.asarray(breaks, float), [1.0]]))
    tables = tables._replace(points=np.unique(tables.points))
    starts, widths, segments, total = [], [], [], 0
    for index, (low, high) in enumerate(pairwise(edges)):
        for begin, end in _groups(low, high, multiple, tables, missing, 1.0 / steps):
            total += multiple
            if total > most:
                return None
            width = (end - begin) / multiple
            starts.append(begin + width * np.arange(multiple))
            widths.append(np.full(multiple, width))
            segments.append(np.full(multiple, index))
    return StageGrid(np.concatenate(starts), np.concatenate(widths), np.concatenate(segments))


def _groups(
    low: float,
    high: float,
    multiple: int,
    tables: Tables,
    missing: float,
    longest: float,
) -> Iterator[tuple[float, float]]:
    """Yield the ends of groups from ``low`` to ``high`` in turn, each resolved and short enough."""
    middle, waiting = 0.5 * (low + high), [(low, high)]
    while waiting:
        begin, end = waiting.pop()
        inside = tables.points[(tables.points > begin + APART) & (tables.points < end - APART)]
        missed = (end - begin) * _missed(begin, end, multiple, inside, lambda x: tables.stiffness(x, middle))
        if missed > SHARE * missing:
            cut = 0.5 * (begin + end)
            cut = float(inside[np.abs(inside - cut).argmin()]) if len(inside) else cut
            if min(cut - begin, end - cut) > APART:
                waiting += [(cut, end), (begin, cut)]
                continue
        count = max(1, int(np.ceil((end - begin) / (multiple * longest) - 1e-9)))
        yield from pairwise(np.linspace(begin, end, count + 1))


def _missed(
    begin: float, end: float, multiple: int, inside: Array, stiffness: Callable[[Array], Array]
) -> float:
    """Return the largest mean distance of stiffnesses from the polynomials of a group, over their size."""
    nodes = np.linspace(begin, end, 2 * multiple + 1)
    even = begin + (end - begin) * (np.arange(LOOKED) + 0.5) / LOOKED
    where = np.concatenate([even, inside])
    values = stiffness(np.concatenate([nodes, where]))
    known, wanted = values[:, : len(nodes)], values[:, len(nodes) :]
    apart = np.abs(known @ _lagrange(2 * multiple + 1, (where - begin) / (end - begin)) - wanted)
    return float((apart.mean(axis=1) / np.abs(values).max(axis=1)).max())


def _lagrange(count: int, x: Array) -> Array:
    """Return the Lagrange polynomials of even nodes on [0, 1] at ``x``, (count, n)."""
    nodes = np.linspace(0.0, 1.0, count)
    differences = np.where(np.eye(count, dtype=bool), 1.0, nodes[:, None] - nodes)
    factors = np.where(np.eye(count, dtype=bool)[:, :, None], 1.0, x - nodes[None, :, None])
    return np.asarray(factors.prod(axis=1) / differences.prod(axis=1)[:, None])
