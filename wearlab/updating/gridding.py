"""Where the posterior is, and how fine a grid it asks for.

The prior's range of ln factor is narrowed to where the density is, and panels are halved until their Legendre
series have decayed; so are those of ln sd and ln drift, by the densities of some of the runs.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from wearlab.arrays import Array
from wearlab.updating.history import RunHistory
from wearlab.updating.integrals import conditional, log_sum
from wearlab.updating.likelihood import Block, Spread
from wearlab.updating.prior import Prior
from wearlab.updating.quadrature import POINTS, Quadrature, at_edges

SpreadGrids = tuple[Quadrature | None, Quadrature | None]
COARSE = 61  # points of the factor while its range is narrowed
SPREAD_PANELS = 3
DEPTH = 32.0  # of the log density below its top that the grid reaches down to
DECAYED = {"factor": 1e-9, "spread": 1e-4}  # last terms of a panel's series over the whole integral
MOST_POINTS = {"factor": 3000, "spread": 60}
ROUNDS = 24
PILOTS = 24
PANELS = 20  # of the factor to begin with: cubic pieces between the points are then as exact as the points
EDGE = 1e-6  # share of the largest density that may stand at an end of the grid


@dataclass(frozen=True)
class Axes:
    """The grids: over ln factor, and for each block over ln sd and ln drift."""

    factor: Quadrature | None
    spreads: tuple[SpreadGrids, ...]


def axes_of(runs: Sequence[RunHistory], blocks: Sequence[Block], prior: Prior) -> Axes:
    """Return grids that are where the posterior is, and fine enough for it."""
    pilots = _pilots(len(runs))
    return _refined(runs, blocks, prior, _narrowed(runs, blocks, prior, pilots), pilots)


def _pilots(count: int) -> NDArray[np.intp]:
    return np.unique(np.linspace(0, count - 1, min(count, PILOTS)).astype(np.intp))


def _margins(
    runs: Sequence[RunHistory], blocks: Sequence[Block], prior: Prior, axes: Axes, pilots: NDArray[np.intp]
) -> tuple[Array, list[list[Array | None]]]:
    """Return log densities along ln factor (the runs' envelope) and along ln of every unknown spread."""
    along_factor = []
    sums: list[list[list[Array]]] = [[[], []] for _ in blocks]
    weights = np.zeros(1) if axes.factor is None else np.log(axes.factor.weights)
    own = np.zeros(1) if axes.factor is None else prior.log_density(axes.factor.points)
    for i in pilots:
        run = runs[i]
        points = np.log([run.factor]) if axes.factor is None else axes.factor.points
        parts = {}
        for n, block in enumerate(blocks):
            if len(block.rows):
                table = conditional(run, block, n, points, *axes.spreads[n])
                top = np.maximum(table.max(axis=(1, 2)), -1e300)
                parts[n] = (np.exp(table - top[:, None, None]), top)
        with np.errstate(divide="ignore"):
            alone = {n: np.log(each.sum(axis=(1, 2))) + top for n, (each, top) in parts.items()}
        together = own + sum(alone.values(), np.zeros(len(points)))
        along_factor.append(together)
        for n, (each, top) in parts.items():
            rest = together - alone[n] + top + weights
            highest = rest.max()
            share = np.exp(rest - highest)
            with np.errstate(divide="ignore"):
                sums[n][0].append(np.log(np.einsum("i,ijk->j", share, each)) + highest)
                sums[n][1].append(np.log(np.einsum("i,ijk->k", share, each)) + highest)
    spread_margins: list[list[Array | None]] = []
    for n, pair in enumerate(axes.spreads):
        margins: list[Array | None] = []
        for side in (0, 1):
            axis = pair[side]
            if axis is None or not sums[n][side]:
                margins.append(None)
            else:
                margins.append(log_sum(np.stack(sums[n][side], axis=1)) - np.log(axis.weights))
        spread_margins.append(margins)
    return np.asarray(np.max(np.stack(along_factor), axis=0)), spread_margins


def _narrowed(
    runs: Sequence[RunHistory], blocks: Sequence[Block], prior: Prior, pilots: NDArray[np.intp]
) -> Axes:
    """Return grids that reach from the prior's range of the factor only where the posterior is."""
    spreads = tuple((_whole(block.sd), _whole(block.drift)) for block in blocks)
    if prior.factor is None:
        return Axes(None, spreads)
    factor = prior.ends()
    for _ in range(40):
        axes = Axes(_points(*factor, COARSE), spreads)
        along, _ = _margins(runs, blocks, prior, axes, pilots)
        assert axes.factor is not None
        factor, shrunk = _shrunk(factor, axes.factor.points, along)
        if not shrunk:
            break
    return Axes(at_edges(np.linspace(*factor, PANELS + 1)), spreads)


def _whole(spread: Spread | None) -> Quadrature | None:
    """Return a first grid over the whole prior of a spread."""
    ends = _ends(spread)
    return None if ends is None else at_edges(np.linspace(*ends, SPREAD_PANELS + 1))


def _ends(spread: Spread | None) -> tuple[float, float] | None:
    if spread is None or spread.prior is None:
        return None
    low, high = (spread.prior.at(p) * spread.scale for p in (1e-9, 1.0 - 1e-9))
    return float(np.log(low)), float(np.log(high))


def _points(low: float, high: float, count: int) -> Quadrature:
    """Return equally spaced points, ends included, that look like a grid."""
    points = np.linspace(low, high, count)
    return Quadrature(points, points, np.full(count, (high - low) / count))


def _shrunk(now: tuple[float, float], points: Array, margin: Array) -> tuple[tuple[float, float], bool]:
    """Return the range that holds all within `DEPTH` of the top, a point more on either side."""
    held = np.flatnonzero(margin > margin.max() - DEPTH)
    low, high = points[max(held[0] - 1, 0)], points[min(held[-1] + 1, len(points) - 1)]
    less = high - low < 0.6 * (now[1] - now[0])
    return (float(low), float(high)), bool(less)


def _refined(
    runs: Sequence[RunHistory], blocks: Sequence[Block], prior: Prior, axes: Axes, pilots: NDArray[np.intp]
) -> Axes:
    """Return the grids with panels halved until each has decayed.

    First the factor's, for how small an error may be is seen only where the factor is right; then the spreads
    are narrowed and halved; then the factor once more.
    """
    axes = _factor_refined(runs, blocks, prior, axes, pilots)
    for _ in range(ROUNDS):
        _, each = _margins(runs, blocks, prior, axes, pilots)
        spreads, changed = _each_spread(axes.spreads, each, _spread_shrunk)
        if not changed:
            spreads, changed = _each_spread(axes.spreads, each, partial(_halved, kind="spread"))
        if not changed:
            break
        axes = Axes(axes.factor, spreads)
    return _factor_refined(runs, blocks, prior, axes, pilots)


def _factor_refined(
    runs: Sequence[RunHistory], blocks: Sequence[Block], prior: Prior, axes: Axes, pilots: NDArray[np.intp]
) -> Axes:
    for _ in range(ROUNDS):
        if axes.factor is None:
            return axes
        along, _ = _margins(runs, blocks, prior, axes, pilots)
        factor, changed = _halved(axes.factor, along, "factor")
        if not changed:
            return axes
        axes = Axes(factor, axes.spreads)
    return axes


def _each_spread(
    spreads: tuple[SpreadGrids, ...],
    margins: list[list[Array | None]],
    change: Callable[[Quadrature, Array], tuple[Quadrature, bool]],
) -> tuple[tuple[SpreadGrids, ...], bool]:
    """Return the grids of the spreads, each changed by its margin, and whether any was."""
    parts, changed = [], False
    for pair, each in zip(spreads, margins, strict=True):
        new: list[Quadrature | None] = []
        for axis, margin in zip(pair, each, strict=True):
            if axis is not None and margin is not None:
                axis, less = change(axis, margin)
                changed |= less
            new.append(axis)
        parts.append((new[0], new[1]))
    return tuple(parts), changed


def _spread_shrunk(axis: Quadrature, margin: Array) -> tuple[Quadrature, bool]:
    """Return a grid over the range that holds all of a margin, and whether it is a shorter one."""
    ends = (float(axis.edges[0]), float(axis.edges[-1]))
    places = np.concatenate([ends[:1], axis.points, ends[1:]])
    level = np.concatenate([margin[:1], margin, margin[-1:]])
    low_high, less = _shrunk(ends, places, level)
    return (at_edges(np.linspace(*low_high, SPREAD_PANELS + 1)) if less else axis), less


def _halved(along: Quadrature, margin: Array, kind: str) -> tuple[Quadrature, bool]:
    """Return a grid with the panels halved whose series have not decayed, and whether there were any."""
    density = np.exp(margin - margin.max()).reshape(-1, POINTS)
    half = 0.5 * np.diff(along.edges)
    total = float(np.sum(density.ravel() * along.weights))
    last = np.abs(density @ _last_terms().T).max(axis=1) * half
    # a mode rises and falls within a panel or two: their integrals must be right, not only small
    wrong = last > DECAYED[kind] * total
    if not wrong.any() or len(along) * 2 > MOST_POINTS[kind]:
        return along, False
    middle = 0.5 * (along.edges[1:] + along.edges[:-1])
    return at_edges(np.sort(np.concatenate([along.edges, middle[wrong]]))), True


def _last_terms() -> Array:
    """Return the matrix from values at a panel's points to the last two coefficients of its series."""
    nodes, weights = legendre.leggauss(POINTS)
    orders = np.arange(POINTS)[-2:]
    basis = legendre.legvander(nodes, POINTS - 1)[:, orders]
    return np.asarray((2 * orders[:, None] + 1) / 2 * (basis * weights[:, None]).T)


def wider_than(along: Quadrature, table: Array, prior: Prior) -> Quadrature | None:
    """Return a grid a quarter longer where a run's density is not small at its end; None where all are.

    A density may well be high where the prior itself ends.
    """
    low, high = prior.ends()
    relative = table - table.max()
    width = float(along.edges[-1] - along.edges[0])
    edges = along.edges
    if relative[:, 0].max() > np.log(EDGE) and edges[0] > low + 1e-9:
        edges = np.concatenate([[max(low, float(edges[0]) - 0.25 * width)], edges])
    if relative[:, -1].max() > np.log(EDGE) and edges[-1] < high - 1e-9:
        edges = np.concatenate([edges, [min(high, float(edges[-1]) + 0.25 * width)]])
    return None if len(edges) == len(along.edges) else at_edges(edges)
