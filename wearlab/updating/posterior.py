"""What is known after the measurements: a grid over (ln k, ln sd, ln drift), within each stored run.

Given k, blocks of observations are independent, so that each integrates its own errors out,

    L_b(k) = ∫ p(y_b | k, sd, drift) p(sd) p(drift) d sd d drift,   p(k | y) ∝ p(k) Π_b L_b(k).

Each run has a grid of its own over ln k, u = c + w sinh s with s evenly spaced: as fine as the width w about
the largest density c, and wide in the tails. The likelihood is evaluated at its nodes and interpolated in its
log to a grid eight times as fine, where the prior is added; nodes are doubled until every other one is
foretold by the rest. Unknown errors have even grids in their logs, where the posterior is.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import logsumexp

from wearlab.arrays import Array
from wearlab.campaign.distributions import Distribution
from wearlab.updating.kalman import Filtered
from wearlab.updating.likelihood import Block, Lanes, Range, Spread, log_density, log_likelihood, range_of
from wearlab.updating.run_curves import RunHistory

COARSE, COARSE_SPREAD = 101, 21  # points while ranges are narrowed
NODES, SPREADS = 97, 33  # of the factor to begin with, of an error
MOST_NODES = {False: 6145, True: 769}  # by whether errors are unknown besides
FINER = 8
DEPTH = 28.0  # of the log density below its top that grids reach down to
SCALE = 0.5  # of what sources that contradict each other may be off by, in ln k
FORETOLD = 2e-6  # of the largest density, by which every other node may be off from what the rest foretell
ROUNDS = 60
CLOSE = 1e-11  # of the range of a quantile, by which it moves last; it converges faster than linearly

SpreadGrids = tuple[Array | None, Array | None]


@dataclass(frozen=True)
class Posterior:
    """The answer on its grids.

    Parameters
    ----------
    histories : the stored runs
    blocks : the observations that count
    prior : of the factor on the wear coefficient; None: it is what the runs have
    nodes : for each run ln factor where the likelihood is known
    spreads : for each run and block the grids over ln of its unknown errors, (sd, drift); None where known
    centre, width : (runs,) of the map ln factor = c + w sinh s
    place : (runs, n) values of s, evenly spaced; one where the factor is known
    density, below : (runs, n) probability per unit of s, and up to there, of each run by itself
    log_evidence : (runs,) log of p(y | run)
    weight : (runs,) posterior probability of each run
    log_proposal : (runs,) log of how much more often a run was drawn than its prior has it
    resolved : whether the grids are fine enough
    """

    histories: tuple[RunHistory, ...]
    blocks: tuple[Block, ...]
    prior: Distribution | None
    nodes: tuple[Array, ...]
    spreads: tuple[tuple[SpreadGrids, ...], ...]
    centre: Array
    width: Array
    place: Array
    density: Array
    below: Array
    log_evidence: Array
    weight: Array
    log_proposal: Array
    resolved: bool

    @property
    def evidence(self) -> float:
        """The log of the probability of all observations."""
        return float(logsumexp(self.log_evidence - self.log_proposal) - np.log(len(self.log_evidence)))

    @property
    def effective_runs(self) -> float:
        """The effective number of runs: 1/Σ w²."""
        return float(1.0 / np.sum(self.weight**2))

    @cached_property
    def log_factor(self) -> Array:
        """Ln factor on the grids, (runs, n)."""
        return self.centre[:, None] + self.width[:, None] * np.sinh(self.place)

    @cached_property
    def mass(self) -> Array:
        """Probability of each point of the grids, (runs, n); all together 1."""
        if self.prior is None:
            return self.weight[:, None]
        mass = self.density * even_weights(self.place.shape[1])
        return mass / mass.sum(axis=1, keepdims=True) * self.weight[:, None]

    def smaller(self, log_factor: Array) -> Array:
        """Return each run's probability of smaller factors than (runs, q), (runs, q)."""
        if self.prior is None:
            return np.asarray((log_factor > self.centre[:, None]).astype(float))
        s = np.arcsinh((log_factor - self.centre[:, None]) / self.width[:, None])
        step = self.place[:, 1] - self.place[:, 0]
        n = self.place.shape[1]
        t = np.clip((s - self.place[:, :1]) / step[:, None], 0.0, n - 1.0)
        i = np.minimum(t.astype(np.intp), n - 2)
        t, runs = t - i, np.arange(len(s))[:, None]
        y0, y1 = self.below[runs, i], self.below[runs, i + 1]
        d0, d1 = (self.density[runs, j] * step[:, None] for j in (i, i + 1))
        return np.asarray(
            y0 + t * (d0 + t * (3.0 * (y1 - y0) - 2.0 * d0 - d1 + t * (2.0 * (y0 - y1) + d0 + d1)))
        )

    def factor(self, p: Array) -> Array:
        """Return quantiles of the factor."""
        ends = self.log_factor[:, [0, -1]]

        def smaller(u: Array) -> Array:
            return np.asarray(self.weight @ self.smaller(np.broadcast_to(u, (len(self.weight), len(u)))))

        return np.exp(quantiles(smaller, np.asarray(p, float), ends.min() - 1e-9, ends.max() + 1e-9))

    def conditional(self, i: int, number: int) -> tuple[Array, Filtered]:
        """Return log p(y_b, ln sd, ln drift | factor) of a run's block at its nodes, and what is filtered."""
        return conditional(
            self.histories[i], self.blocks[number], number, self.nodes[i], self.spreads[i][number]
        )


def quantiles(below: Callable[[Array], Array], p: Array, low: float, high: float) -> Array:
    """Return where a rising function reaches probabilities, by Ridders' method (1979)."""
    ends = [(at, below(at) - p) for at in (np.full(p.shape, low), np.full(p.shape, high))]
    (left, short), (right, over) = ends
    found = np.full(p.shape, np.inf)
    for _ in range(60):
        middle = 0.5 * (left + right)
        off = below(middle) - p
        root = np.sqrt(np.maximum(off * off - short * over, 1e-300))
        before, found = found, np.clip(middle - (middle - left) * off / root, left, right)
        if np.all(np.abs(found - before) <= CLOSE * (high - low)):
            break
        for at, y in ((middle, off), (found, below(found) - p)):
            under, above = (y < 0.0) & (at > left), (y >= 0.0) & (at < right)
            left, short = np.where(under, at, left), np.where(under, y, short)
            right, over = np.where(above, at, right), np.where(above, y, over)
    return found


def weighted_quantiles(value: Array, weight: Array, p: Any) -> Array:
    """Return quantiles of weighted values (n,), each in the middle of its weight."""
    order = np.argsort(value, kind="stable")
    below = np.cumsum(weight[order])
    return np.interp(p, (below - 0.5 * weight[order]) / below[-1], value[order])


def even_weights(n: int) -> Array:
    """Return weights of evenly spaced values in an integral, for a spacing of 1 (Gregory, fourth order)."""
    weights = np.ones(n)
    if n >= 6:
        weights[:3] = weights[:-4:-1] = (3 / 8, 7 / 6, 23 / 24)
    elif n > 1:
        weights[[0, -1]] = 0.5
    return weights


def conditional(
    run: RunHistory, block: Block, number: int, log_factor: Array, spreads: SpreadGrids
) -> tuple[Array, Filtered]:
    """Return log p(y_b, ln sd, ln drift | factor) with the weights of the grids, (factors, sds, drifts)."""
    sd, drift = (values_of(s, grid) for s, grid in zip((block.sd, block.drift), spreads, strict=True))
    lanes = Lanes(np.exp(log_factor)[:, None, None], sd[None, :, None], drift[None, None, :])
    seen = log_likelihood(block, run, number, lanes)
    return seen.log_likelihood + _log_prior(block.sd, spreads[0])[:, None] + _log_prior(
        block.drift, spreads[1]
    ), seen


def values_of(spread: Spread | None, grid: Array | None) -> Array:
    """Return the values of an error on its grid; the known one without it, 0 where there is none."""
    if spread is None:
        return np.zeros(1)
    return np.array([spread.known]) if grid is None else np.exp(grid)


def _log_prior(spread: Spread | None, grid: Array | None) -> Array:
    """Return the logs of an error's prior times the weights of its grid."""
    if spread is None or grid is None:
        return np.zeros(1)
    return np.asarray(spread.log_density(grid) + np.log(even_weights(len(grid)) * (grid[1] - grid[0])))


def posterior(
    histories: Sequence[RunHistory],
    blocks: Sequence[Block],
    prior: Distribution | None,
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
    grids: list[_Grid] = []
    known = any(len(block.rows) for block in some) or prior is None
    for run in runs:  # each begins where the one before it ended up; of a prior all are alike
        grids.append(
            _Grid(run, some, prior, grids[-1].factor if grids else None) if known or not grids else grids[0]
        )
    n = FINER * (max(len(grid.nodes) for grid in grids) - 1) + 1
    place, logs = (np.stack(each) for each in zip(*(grid.fine(n) for grid in grids), strict=True))
    parts = {
        "histories": runs,
        "blocks": some,
        "prior": prior,
        "nodes": tuple(grid.nodes for grid in grids),
        "spreads": tuple(grid.spreads for grid in grids),
        "centre": np.array([grid.centre for grid in grids]),
        "width": np.array([grid.width for grid in grids]),
        "place": place,
        "log_proposal": proposal,
        "resolved": all(grid.resolved for grid in grids),
    }
    return _normed(parts, logs)


def _normed(parts: Mapping[str, Any], logs: Array) -> Posterior:
    """Return a posterior of its parts, with densities, evidences and weights from logs on its grids."""
    n, place = logs.shape[1], parts["place"]
    top = logs.max(axis=1, keepdims=True)
    density = np.exp(logs - top)
    below, total = density, np.ones(len(logs))
    if parts["prior"] is not None:
        step = (place[:, -1] - place[:, 0]) / (n - 1)
        below = CubicSpline(np.arange(n), density, axis=1).antiderivative()(np.arange(n)) * step[:, None]
        total = below[:, -1]
        density, below = density / total[:, None], below / total[:, None]
    evidence = top[:, 0] + np.log(total)
    relative = evidence - parts["log_proposal"]
    weight = np.exp(relative - logsumexp(relative))
    found = {"density": density, "below": below, "log_evidence": evidence, "weight": weight}
    return Posterior(**{**parts, **found})


def widened(post: Posterior, alone: Sequence[Posterior]) -> Posterior:
    """Return what is known where each source has a scale of its own: it sees ln k + δ, δ ~ N(0, τ²).

    p(u | y) ∝ p(u) ∫ p(τ) Π_b ∫ L_b(x) N(x; u, τ²) dx dτ, τ half-normal with a standard deviation of `SCALE`:
    the random effects of a meta-analysis.

    Parameters
    ----------
    post : of all sources together, as if each were right
    alone : of each source alone
    """
    assert post.prior is not None
    n, runs = post.place.shape[1], len(post.weight)
    tau = np.geomspace(0.01, 4.0, 25) * SCALE
    log_tau = -0.5 * (tau / SCALE) ** 2 + np.log(tau)
    s = np.broadcast_to(np.linspace(-6.0, 6.0, n), (runs, n))
    centre, width, logs = post.centre.copy(), np.empty(runs), np.empty((runs, n))
    for i in range(runs):
        means = [float(np.sum(one.mass[i] * one.log_factor[i]) / one.mass[i].sum()) for one in alone]
        centre[i], width[i] = np.mean(means), max(np.ptp(means), 1e-6) / 4.0
        u = centre[i] + width[i] * np.sinh(s[i])
        together = log_tau + np.zeros((n, 1))
        for one in alone:
            x = one.log_factor[i][::4]
            own = np.log(np.maximum(one.density[i][::4] * even_weights(n)[::4], 1e-290))
            own = own - log_density(post.prior, x) + one.log_evidence[i]
            away = (u[:, None] - x) ** 2
            seen = [logsumexp(own - 0.5 * away / t**2, axis=1) - np.log(t) for t in tau]
            together = together + np.stack(seen, axis=1)
        logs[i] = logsumexp(together, axis=1) + log_density(post.prior, u) + np.log(width[i] * np.cosh(s[i]))
    nodes = tuple(c + w * np.sinh(s[0][::FINER]) for c, w in zip(centre, width, strict=True))
    parts = {each.name: getattr(post, each.name) for each in fields(post)}
    return _normed({**parts, "nodes": nodes, "centre": centre, "width": width, "place": s}, logs)


class _Grid:
    """The grids of one run, put where its posterior is."""

    def __init__(
        self,
        run: RunHistory,
        blocks: tuple[Block, ...],
        prior: Distribution | None,
        begin: Range | None = None,
    ) -> None:
        self.run, self.prior = run, prior
        self.blocks = [(number, block) for number, block in enumerate(blocks) if len(block.rows)]
        self.axes = {
            (number, side): range_of(spread.prior, spread.scale)
            for number, block in enumerate(blocks)
            for side, spread in enumerate((block.sd, block.drift))
            if spread is not None and spread.prior is not None
        }
        self.count = len(blocks)
        self.centre, self.width, self.resolved = float(np.log(run.factor)), 1.0, True
        self.factor = None if prior is None else begin or range_of(prior)
        self.ends = (0.0, 0.0)
        self._narrow()
        self.spreads = self._spreads(SPREADS)
        self.nodes, self.likelihood = np.array([self.centre]), np.zeros(1)
        if self.factor is None:
            self.likelihood = self._log_likelihood(self.nodes)
        else:
            self._resolve()

    def fine(self, n: int) -> tuple[Array, Array]:
        """Return s and the log of prior times likelihood per unit of s, on ``n`` points."""
        if self.factor is None or self.prior is None:
            return np.zeros(1), self.likelihood
        coarse = np.linspace(*self.ends, len(self.nodes))
        s = np.linspace(*self.ends, n)
        logs = CubicSpline(coarse, np.maximum(self.likelihood, self.likelihood.max() - 1e6))(s)
        u = self.centre + self.width * np.sinh(s)
        return s, logs + log_density(self.prior, u) + np.log(self.width * np.cosh(s))

    def _spreads(self, n: int) -> tuple[SpreadGrids, ...]:
        grids: list[list[Array | None]] = [[None, None] for _ in range(self.count)]
        for (number, side), axis in self.axes.items():
            grids[number][side] = np.linspace(axis.low, axis.high, n)
        return tuple((sd, drift) for sd, drift in grids)

    def _tables(self, points: Array) -> dict[int, Array]:
        return {
            number: conditional(self.run, block, number, points, self.spreads[number])[0]
            for number, block in self.blocks
        }

    def _log_likelihood(self, points: Array) -> Array:
        total = np.zeros(len(points))
        for table in self._tables(points).values():
            total = total + (table[:, 0, 0] if table[0].size == 1 else logsumexp(table, axis=(1, 2)))
        return total

    def _narrow(self) -> None:
        """Narrow all ranges to where the posterior is, or widen them where a prior goes on.

        How small an error may be is seen only where the factor is right: its range comes first.
        """
        self.spreads = self._spreads(COARSE_SPREAD)
        for _ in range(1 + (len(self.axes) > 0)):
            self._narrow_factor()
            for _ in range(ROUNDS if self.axes else 0):
                if not self._errors_moved():
                    break

    def _narrow_factor(self) -> None:
        if self.factor is None or self.prior is None:
            return
        for _ in range(ROUNDS):
            points = np.linspace(self.factor.low, self.factor.high, COARSE)
            logs = log_density(self.prior, points) + self._log_likelihood(points)
            self.factor, moved = _fitted(self.factor, points, logs)
            if not moved:
                break
        self._centre()

    def _errors_moved(self) -> bool:
        """Fit the ranges of unknown errors once; say whether any moved."""
        points, own = np.array([self.centre]), np.zeros(1)
        if self.factor is not None and self.prior is not None:
            low, high = (np.arcsinh((end - self.centre) / self.width) for end in self.factor[:2])
            s = np.linspace(low, high, COARSE)
            points = self.centre + self.width * np.sinh(s)
            own = log_density(self.prior, points) + np.log(np.cosh(s))
        tables = self._tables(points)
        alone = {number: logsumexp(table, axis=(1, 2)) for number, table in tables.items()}
        together = own + sum(alone.values(), np.zeros(len(points)))
        moved = False
        for (number, side), axis in self.axes.items():
            grid = self.spreads[number][side]
            if number in tables and grid is not None:
                table = tables[number] + (together - alone[number])[:, None, None]
                margin = logsumexp(table, axis=(0, 2 - side)) - np.log(even_weights(len(grid)))
                self.axes[number, side], more = _fitted(axis, grid, margin)
                moved |= more
        self.spreads = self._spreads(COARSE_SPREAD)
        return moved

    def _centre(self) -> None:
        """Find the largest density and how wide it is."""
        assert self.factor is not None and self.prior is not None
        low, high = self.factor.low, self.factor.high
        for _ in range(ROUNDS):
            points = np.linspace(low, high, 41)
            logs = log_density(self.prior, points) + self._log_likelihood(points)
            best = int(np.argmax(logs))
            self.centre = float(points[best])
            near = np.flatnonzero(logs > logs[best] - 0.5)
            self.width = 0.5 * float(points[near[-1]] - points[near[0]])
            if len(near) > 4:
                return
            low, high = float(points[max(best - 2, 0)]), float(points[min(best + 2, 40)])

    def _resolve(self) -> None:
        """Double the nodes until every other one is foretold by the rest."""
        assert self.factor is not None and self.prior is not None
        low, high = (float(np.arcsinh((end - self.centre) / self.width)) for end in self.factor[:2])
        self.ends = (low, high)
        most, n = MOST_NODES[bool(self.axes)], NODES
        s = np.linspace(*self.ends, n)
        values = self._log_likelihood(self.centre + self.width * np.sinh(s))
        while True:
            u = self.centre + self.width * np.sinh(s)
            logs = values + log_density(self.prior, u)
            held = np.isfinite(logs)
            safe = np.maximum(values, values[held].max(initial=-1e300) - 1e6)
            off = np.abs(np.expm1(np.minimum(CubicSpline(s[::2], safe[::2])(s[1::2]) - safe[1::2], 50.0)))
            self.resolved = bool(np.all(off * np.exp(logs[1::2] - logs[held].max()) < FORETOLD))
            if self.resolved or 2 * n - 1 > most:
                break
            more = np.empty(2 * n - 1)
            more[::2] = values
            s = np.linspace(*self.ends, 2 * n - 1)
            more[1::2] = self._log_likelihood(self.centre + self.width * np.sinh(s[1::2]))
            values, n = more, 2 * n - 1
        self.nodes, self.likelihood = self.centre + self.width * np.sinh(s), values


def _fitted(now: Range, points: Array, logs: Array) -> tuple[Range, bool]:
    """Return the range that holds all within `DEPTH` of the top, and whether it moved."""
    held = np.flatnonzero(logs > logs.max() - DEPTH)
    width = (now.high - now.low) * (4.0 if np.argmax(logs) in (0, len(logs) - 1) else 1.0)
    low, high = float(points[max(held[0] - 1, 0)]), float(points[min(held[-1] + 1, len(points) - 1)])
    moved = high - low < 0.6 * (now.high - now.low)
    if held[0] == 0 and low > now.least + 1e-9:
        low, moved = max(now.least, low - width), True
    if held[-1] == len(points) - 1 and high < now.most - 1e-9:
        high, moved = min(now.most, high + width), True
    return now._replace(low=low, high=high), moved
