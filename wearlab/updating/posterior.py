"""What is known after the measurements: a grid over (ln k, ln sd, ln drift), within each stored run.

Given k, blocks of observations are independent, so that each integrates its own errors out,

    L_b(k) = ∫ p(y_b | k, sd, drift) p(sd) p(drift) d sd d drift,   p(k | y) ∝ p(k) Π_b L_b(k).

The grid is found by narrowing the prior's range to where the posterior is, and its panels are halved until
their Legendre series have decayed.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from wearlab.campaign.distributions import SMALLEST, Distribution
from wearlab.updating.filtering import Filtered
from wearlab.updating.history import History
from wearlab.updating.likelihood import Block, Spread, log_likelihood
from wearlab.updating.quadrature import POINTS, Grid, at_edges

Array = NDArray[np.float64]
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
class Prior:
    """What is known of the factor on the wear coefficient before; None: it is what the runs have."""

    factor: Distribution | None

    def ends(self) -> tuple[float, float]:
        """Return the range of ln factor."""
        assert self.factor is not None
        return float(np.log(self.factor.at(SMALLEST))), float(np.log(self.factor.at(1.0 - SMALLEST)))

    def log_density(self, log_factor: Array) -> Array:
        """Return the log of the density per unit of ln factor."""
        assert self.factor is not None
        f = np.exp(log_factor)
        with np.errstate(divide="ignore"):
            return np.log(np.array([self.factor.density(x) * x for x in f.tolist()]))


@dataclass(frozen=True)
class Posterior:
    """The answer on its grid.

    Parameters
    ----------
    histories : the stored runs
    blocks : the observations that count
    prior : of the factor
    grid : over ln factor; None where the factor is no unknown
    spreads : for each block the grids over ln of its unknown spreads, (sd, drift); None where one is known
    log_density : (runs, n) log of p(ln factor, y | run), not normed
    log_evidence : (runs,) log of p(y | run)
    weight : (runs,) posterior probability of each run
    log_proposal : (runs,) log of how much more often a run was drawn than its prior has it
    """

    histories: tuple[History, ...]
    blocks: tuple[Block, ...]
    prior: Prior
    grid: Grid | None
    spreads: tuple[tuple[Grid | None, Grid | None], ...]
    log_density: Array
    log_evidence: Array
    weight: Array
    log_proposal: Array

    @property
    def log_factor(self) -> Array:
        """The points of ln factor, (n,)."""
        if self.grid is None:
            return np.log([self.histories[0].factor])
        return self.grid.points

    @property
    def evidence(self) -> float:
        """The log of the probability of all observations."""
        return float(
            log_sum((self.log_evidence - self.log_proposal)[None])[0] - np.log(len(self.log_evidence))
        )

    @property
    def effective_runs(self) -> float:
        """The effective number of runs: 1/Σ w²."""
        return float(1.0 / np.sum(self.weight**2))

    def density(self) -> Array:
        """Return p(run, ln factor | y), (runs, n)."""
        return np.asarray(np.exp(self.log_density - self.log_evidence[:, None]) * self.weight[:, None])


def posterior(
    histories: Sequence[History],
    blocks: Sequence[Block],
    prior: Prior,
    log_proposal: Array | None = None,
) -> Posterior:
    """Return what is known after the observations.

    Parameters
    ----------
    histories : stored runs, each with a draw of the unknowns that cost runs
    blocks : the observations that count
    prior : of the factor on the wear coefficient
    log_proposal : (runs,) log of how much more often each was drawn than its prior has it [0]
    """
    runs, some = tuple(histories), tuple(blocks)
    proposal = np.zeros(len(runs)) if log_proposal is None else log_proposal
    pilots = _pilots(len(runs))
    axes = _narrowed(runs, some, prior, pilots)
    axes = _refined(runs, some, prior, axes, pilots)
    for _ in range(ROUNDS):
        table = np.stack([_table(run, some, prior, axes) for run in runs])
        wider = None if axes.factor is None else _wider(axes.factor, table, prior)
        if wider is None:
            break
        axes = replace(axes, factor=wider)
    weights = np.zeros(1) if axes.factor is None else np.log(axes.factor.weights)
    evidence = np.asarray(log_sum(table + weights))
    relative = evidence - proposal
    weight = np.exp(relative - log_sum(relative[None])[0])
    return Posterior(runs, some, prior, axes.factor, axes.spreads, table, evidence, weight, proposal)


@dataclass(frozen=True)
class _Axes:
    factor: Grid | None
    spreads: tuple[tuple[Grid | None, Grid | None], ...]


def conditional(
    history: History, block: Block, number: int, log_factor: Array, sd: Grid | None, drift: Grid | None
) -> Array:
    """Return log p(y_b, ln sd, ln drift | factor) with the weights of the grids, (factors, sds, drifts)."""
    found = on_grids(history, block, number, log_factor, sd, drift).log_likelihood
    return np.asarray(found + log_prior(block.sd, sd)[:, None] + log_prior(block.drift, drift))


def on_grids(
    history: History, block: Block, number: int, log_factor: Array, sd: Grid | None, drift: Grid | None
) -> Filtered:
    """Return the likelihood of a block and its drift at every point of the grids, (factors, sds, drifts)."""
    return log_likelihood(
        block,
        history,
        number,
        np.exp(log_factor)[:, None, None],
        values(block.sd, sd)[None, :, None],
        values(block.drift, drift)[None, None, :],
    )


def values(spread: Spread | None, along: Grid | None) -> Array:
    """Return the values of a spread on its grid; the known one without it, 0 where there is none."""
    if spread is None:
        return np.zeros(1)
    return np.array([spread.known]) if along is None else np.exp(along.points)


def log_prior(spread: Spread | None, along: Grid | None) -> Array:
    """Return the logs of a spread's prior times the weights of its grid."""
    if spread is None or along is None:
        return np.zeros(1)
    return np.asarray(spread.log_density(np.exp(along.points)) + np.log(along.weights))


def _table(run: History, blocks: Sequence[Block], prior: Prior, axes: _Axes) -> Array:
    """Return log p(ln factor, y | run) over the grid."""
    points = np.log([run.factor]) if axes.factor is None else axes.factor.points
    total = np.zeros(len(points)) if axes.factor is None else prior.log_density(points)
    for number, (block, (sd, drift)) in enumerate(zip(blocks, axes.spreads, strict=True)):
        if len(block.rows):
            each = conditional(run, block, number, points, sd, drift)
            total = total + log_sum(each)
    return np.asarray(total)


def _pilots(count: int) -> NDArray[np.intp]:
    return np.unique(np.linspace(0, count - 1, min(count, PILOTS)).astype(np.intp))


def log_sum(table: Array) -> Array:
    """Return the log of the sum of exponentials over all but the first dimension."""
    flat = table.reshape(len(table), -1)
    top = flat.max(axis=1)
    top = np.where(np.isfinite(top), top, 0.0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(np.exp(flat - top[:, None]).sum(axis=1)) + top)


def _margins(
    runs: Sequence[History], blocks: Sequence[Block], prior: Prior, axes: _Axes, pilots: NDArray[np.intp]
) -> tuple[Array, list[list[Array | None]]]:
    """Return log densities along ln factor (the runs' envelope) and along ln of every unknown spread."""
    along_factor = []
    sums: list[list[list[Array]]] = [[[], []] for _ in blocks]
    for i in pilots:
        run = runs[i]
        points = np.log([run.factor]) if axes.factor is None else axes.factor.points
        weights = np.zeros(1) if axes.factor is None else np.log(axes.factor.weights)
        own = np.zeros(len(points)) if axes.factor is None else prior.log_density(points)
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
        found: list[Array | None] = []
        for side in (0, 1):
            axis = pair[side]
            if axis is None or not sums[n][side]:
                found.append(None)
            else:
                found.append(log_sum(np.stack(sums[n][side], axis=1)) - np.log(axis.weights))
        spread_margins.append(found)
    return np.asarray(np.max(np.stack(along_factor), axis=0)), spread_margins


def _narrowed(
    runs: Sequence[History], blocks: Sequence[Block], prior: Prior, pilots: NDArray[np.intp]
) -> _Axes:
    """Return grids that reach from the prior's range of the factor only where the posterior is."""
    spreads = tuple((_whole(block.sd), _whole(block.drift)) for block in blocks)
    if prior.factor is None:
        return _Axes(None, spreads)
    factor = prior.ends()
    for _ in range(40):
        axes = _Axes(_points(*factor, COARSE), spreads)
        along, _ = _margins(runs, blocks, prior, axes, pilots)
        assert axes.factor is not None
        factor, shrunk = _shrunk(factor, axes.factor.points, along)
        if not shrunk:
            break
    return _Axes(at_edges(np.linspace(*factor, PANELS + 1)), spreads)


def _whole(spread: Spread | None) -> Grid | None:
    """Return a first grid over the whole prior of a spread."""
    ends = _ends(spread)
    return None if ends is None else at_edges(np.linspace(*ends, SPREAD_PANELS + 1))


def _ends(spread: Spread | None) -> tuple[float, float] | None:
    if spread is None or spread.prior is None:
        return None
    low, high = (spread.prior.at(p) * spread.scale for p in (1e-9, 1.0 - 1e-9))
    return float(np.log(low)), float(np.log(high))


def _points(low: float, high: float, count: int) -> Grid:
    """Return equally spaced points, ends included, that look like a grid."""
    points = np.linspace(low, high, count)
    return Grid(points, points, np.full(count, (high - low) / count))


def _shrunk(now: tuple[float, float], points: Array, margin: Array) -> tuple[tuple[float, float], bool]:
    """Return the range that holds all within `DEPTH` of the top, a point more on either side."""
    held = np.flatnonzero(margin > margin.max() - DEPTH)
    low, high = points[max(held[0] - 1, 0)], points[min(held[-1] + 1, len(points) - 1)]
    less = high - low < 0.6 * (now[1] - now[0])
    return (float(low), float(high)), bool(less)


def _refined(
    runs: Sequence[History], blocks: Sequence[Block], prior: Prior, axes: _Axes, pilots: NDArray[np.intp]
) -> _Axes:
    """Return the grids with panels halved until each has decayed.

    First the factor's, for how small an error may be is seen only where the factor is right; then the spreads
    are narrowed and halved; then the factor once more.
    """
    axes = _factor_refined(runs, blocks, prior, axes, pilots)
    for _ in range(ROUNDS):
        _, each = _margins(runs, blocks, prior, axes, pilots)
        spreads, changed = _spreads_shrunk(axes.spreads, each)
        if not changed:
            spreads, changed = _spreads_halved(axes.spreads, each)
        if not changed:
            break
        axes = _Axes(axes.factor, spreads)
    return _factor_refined(runs, blocks, prior, axes, pilots)


def _factor_refined(
    runs: Sequence[History], blocks: Sequence[Block], prior: Prior, axes: _Axes, pilots: NDArray[np.intp]
) -> _Axes:
    for _ in range(ROUNDS):
        if axes.factor is None:
            return axes
        along, _ = _margins(runs, blocks, prior, axes, pilots)
        factor, changed = _halved(axes.factor, along, "factor")
        if not changed:
            return axes
        axes = _Axes(factor, axes.spreads)
    return axes


def _spreads_shrunk(
    spreads: tuple[tuple[Grid | None, Grid | None], ...], margins: list[list[Array | None]]
) -> tuple[tuple[tuple[Grid | None, Grid | None], ...], bool]:
    found, changed = [], False
    for pair, each in zip(spreads, margins, strict=True):
        new: list[Grid | None] = []
        for axis, margin in zip(pair, each, strict=True):
            if axis is not None and margin is not None:
                ends = (float(axis.edges[0]), float(axis.edges[-1]))
                places = np.concatenate([ends[:1], axis.points, ends[1:]])
                level = np.concatenate([margin[:1], margin, margin[-1:]])
                low_high, less = _shrunk(ends, places, level)
                axis = at_edges(np.linspace(*low_high, SPREAD_PANELS + 1)) if less else axis
                changed |= less
            new.append(axis)
        found.append((new[0], new[1]))
    return tuple(found), changed


def _spreads_halved(
    spreads: tuple[tuple[Grid | None, Grid | None], ...], margins: list[list[Array | None]]
) -> tuple[tuple[tuple[Grid | None, Grid | None], ...], bool]:
    found, changed = [], False
    for pair, each in zip(spreads, margins, strict=True):
        new: list[Grid | None] = []
        for axis, margin in zip(pair, each, strict=True):
            if axis is not None and margin is not None:
                finer, less = _halved(axis, margin, "spread")
                changed |= less
                new.append(finer)
            else:
                new.append(axis)
        found.append((new[0], new[1]))
    return tuple(found), changed


def _halved(along: Grid, margin: Array, kind: str) -> tuple[Grid, bool]:
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


def _wider(along: Grid, table: Array, prior: Prior) -> Grid | None:
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
