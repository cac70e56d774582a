"""What is known after the measurements: grids over (ln k, ln sd, ln drift) by run.

Given k, blocks of observations are independent, so that each integrates its own errors
out,

    L_b(k) = ∫ p(y_b | k, sd, drift) p(sd) p(drift) d sd d drift,   p(k | y) ∝ p(k) Π_b
    L_b(k).

Each run has a grid of its own over ln k, u = c + w sinh s with s evenly spaced: as fine
as the width w about the largest density c, and wide in the tails. The likelihood is
evaluated at its nodes and interpolated in its log to a grid eight times as fine, where
the prior is added; nodes are doubled until every other one is foretold by the rest.
Unknown errors have even grids in their logs, where the posterior is.
"""

import math
from collections.abc import Callable, Sequence
from copy import copy
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import logsumexp

from wearlab.arrays import Array, Flags, Index, Random
from wearlab.campaign.distributions import SMALLEST, Distribution
from wearlab.updating import data_blocks
from wearlab.updating.data_blocks import Block, Blocks, Spread, log_density
from wearlab.updating.kalman import Filtered
from wearlab.updating.likelihood import ParameterBatch, log_likelihood
from wearlab.updating.run_curves import Runs, invert_rising

COARSE = 101  # points over ln factor while ranges are narrowed
COARSE_SPREAD = 21  # points over an error meanwhile
CENTRED = 41  # points by which the top is found
AT_ONCE = 2_000_000  # values of all lanes that are worked on at once
NODES = 97  # of the factor to begin with
SPREADS = 33  # points over an unknown error
MAX_NODES = {False: 6145, True: 769}  # by whether errors are unknown besides
FINER = 8  # times as fine as the nodes the density is known
DEPTH = 28.0  # of the log density below its top that grids reach down to
TINIEST = 1e-290  # density of which there is a log
# of the largest density, by which every other node may be off from what the rest
# foretell
FORETOLD = 2e-6
ROUNDS = 60  # of narrowing a range, or finding a top

Grids = tuple[Array, Array]


class Range(NamedTuple):
    """Where ln of an unknown is looked for, and what its prior allows at all.

    Each (runs,).
    """

    low: Array
    high: Array
    smallest: Array
    largest: Array


def range_of(prior: Distribution, runs: int, scale: float = 1.0) -> Range:
    """Return the range of ln value of a prior, by run.

    A normal law allows more than it starts with.

    Parameters
    ----------
    prior : of the value, in its own unit
    runs : number of runs
    scale : SI value of the prior's unit
    """
    ends = np.array([prior.at(SMALLEST), prior.at(1.0 - SMALLEST)])
    bounds = np.array([max(prior.low, 0.0), prior.high])
    with np.errstate(divide="ignore"):
        low, high = np.log(scale * ends).tolist()
        smallest, largest = np.log(scale * bounds).tolist()
    if not np.isfinite(low):  # a normal law of what is positive
        low = math.log(scale * prior.at(0.5)) - 40.0
    if prior.word not in ("lognormal", "normal"):
        smallest = low
        largest = high
    return Range(
        low=np.full(runs, low),
        high=np.full(runs, high),
        smallest=np.full(runs, smallest),
        largest=np.full(runs, largest),
    )


class Posterior:
    """What is known after the observations, on its grids.

    Parameters
    ----------
    runs : stored runs, each with a draw of the unknowns that cost runs
    blocks : the observations that count
    prior : of the factor on the wear coefficient; None: it is what the runs have

    Attributes
    ----------
    histories : the runs
    nodes : (runs, n) ln factor where the likelihood is known
    spreads : for each block the grids over ln of its errors, (sd, drift), each (runs,
        n); (runs, 1) of known
    centre, width : (runs,) of the map ln factor = c + w sinh s
    place : (runs, n) values of s, evenly spaced; one where the factor is known
    log_factor : (runs, n) ln factor there
    density, below : (runs, n) probability per unit of s, and up to there, of each run
        by itself
    log_evidence : (runs,) log of p(y | run)
    log_share : (runs,) log of what else is probable of a run before, as when one of its
        sheets has a scale of its own
    weight : (runs,) posterior probability of each run
    mass : (runs, n) probability of each point of the grids; all together 1
    resolved : whether the grids are fine enough
    """

    def __init__(self, runs: Runs, blocks: Blocks, prior: Distribution | None):
        self.histories = tuple(runs)
        self.blocks = tuple(blocks)
        self.prior = prior
        self._all = np.arange(len(self.histories))
        self.log_share: Array | float = 0.0
        self.resolved = True
        errors = data_blocks.unknown_errors(self.blocks)
        self._axes = {
            (n, side): range_of(prior, len(self._all), spread.scale)
            for n, side, spread, prior in errors
        }
        self.centre, self.width = (
            np.log([run.factor for run in self.histories]),
            np.ones(len(self._all)),
        )
        if prior is not None:
            self._factor = range_of(prior, len(self._all))
        self._narrow()
        self.spreads = self._spreads(SPREADS)
        if prior is None:
            self.nodes = self.centre[:, None]
            self._norm(
                np.zeros_like(self.nodes), self._log_likelihood(self.nodes, self._all)
            )
        else:
            self._norm(*self._resolve(prior))

    def with_changes(self, **changed: Any) -> "Posterior":
        """Return it with other histories or blocks, and all else as it is.

        Parameters
        ----------
        changed : attributes by name
        """
        posterior = copy(self)
        vars(posterior).update(changed)
        return posterior

    def of_runs(self, chosen: Index) -> "Posterior":
        """Return what is known if one of some runs is right.

        Parameters
        ----------
        chosen : numbers of the runs
        """
        by_run = ("nodes", "centre", "width", "place", "log_factor", "density", "below")
        columns = {name: getattr(self, name)[chosen] for name in by_run}
        log_share = np.broadcast_to(self.log_share, self.weight.shape)[chosen]
        probability = float(self.weight[chosen].sum())
        return self.with_changes(
            histories=tuple(self.histories[n] for n in chosen),
            _all=np.arange(len(chosen)),
            spreads=tuple((sd[chosen], drift[chosen]) for sd, drift in self.spreads),
            log_evidence=self.log_evidence[chosen],
            log_share=log_share,
            weight=self.weight[chosen] / probability,
            mass=self.mass[chosen] / probability,
            **columns,
        )

    def updated_with(self, blocks: Blocks) -> "Posterior":
        """Return what is known after other observations, all sheets being sound.

        Parameters
        ----------
        blocks : the observations
        """
        sound = [run for run in self.histories if run.doubted is None]
        return Posterior(sound, blocks, self.prior)

    @property
    def relative(self) -> Array:
        """Logs of evidence times share, over how often each was drawn, (runs,)."""
        log_drawn = np.array([run.log_weight for run in self.histories])
        return np.asarray(self.log_evidence - log_drawn + self.log_share)

    @property
    def evidence(self) -> float:
        """The log of the probability of all observations."""
        return float(logsumexp(self.relative) - np.log(len(self.log_evidence)))

    @property
    def effective_runs(self) -> float:
        """The effective number of runs: 1/Σ w²."""
        return float(1.0 / np.sum(self.weight**2))

    def smaller(self, log_factor: Array) -> Array:
        """Return each run's probability of smaller factors, (runs, q).

        Parameters
        ----------
        log_factor : ln of the factors, (runs, q)
        """
        if self.prior is None:
            return (log_factor > self.centre[:, None]).astype(float)
        s = np.arcsinh((log_factor - self.centre[:, None]) / self.width[:, None])
        first = self.place[:, :1]
        step = self.place[:, 1:2] - first
        n = self.place.shape[1]
        t = np.clip((s - first) / step, 0.0, n - 1.0)
        i = np.minimum(t.astype(np.intp), n - 2)
        t = t - i

        # a cubic by values and slopes at both ends of a piece
        runs = self._all[:, None]
        y0 = self.below[runs, i]
        y1 = self.below[runs, i + 1]
        d0 = self.density[runs, i] * step
        d1 = self.density[runs, i + 1] * step
        cubic = d0 + d1 - 2.0 * (y1 - y0)
        square = 3.0 * (y1 - y0) - 2.0 * d0 - d1
        return np.asarray(np.polyval([cubic, square, d0, y0], t))

    def factor(self, p: Array) -> Array:
        """Return quantiles of the factor on the wear coefficient [1].

        Parameters
        ----------
        p : probabilities of smaller factors, (q,)
        """
        low = self.log_factor[:, 0].min() - 1e-9
        high = self.log_factor[:, -1].max() + 1e-9

        def smaller(log_factor: Array) -> Array:
            shape = (len(self.weight), len(log_factor))
            return self.weight @ self.smaller(np.broadcast_to(log_factor, shape))

        return np.exp(invert_rising(smaller, np.asarray(p, float), low, high))

    def conditional(self, i: int, number: int) -> tuple[Array, Filtered]:
        """Return log p(y_b, ln sd, ln drift | factor) of a block, and what is filtered.

        Both are at the nodes of a run, (factors, sds, drifts).

        Parameters
        ----------
        i : number of the run
        number : of the block
        """
        runs = self.histories[i : i + 1]
        sd, drift = (grid[[i]] for grid in self.spreads[number])
        logs, filtered = conditional(
            runs, self.blocks[number], number, self.nodes[[i]], (sd, drift)
        )
        mean = np.broadcast_to(filtered.mean, logs.shape)[0]
        variance = np.broadcast_to(filtered.variance, logs.shape)[0]
        return logs[0], Filtered(logs[0], mean, variance, filtered.cycle)

    def _norm(self, place: Array, logs: Array) -> None:
        """Set densities, evidences and weights by logs at places.

        One place where the factor is known.
        """
        n = logs.shape[1]
        top = logs.max(axis=1, keepdims=True)
        density = np.exp(logs - top)
        below = density
        total = np.ones((len(logs), 1))
        if n > 1:
            step = (place[:, -1:] - place[:, :1]) / (n - 1)
            numbers = np.arange(n)
            spline = CubicSpline(numbers, density, axis=1)
            below = spline.antiderivative()(numbers) * step
            total = below[:, -1:]

        self.place = place
        self.log_factor = self._at(place)
        self.density = density / total
        self.below = below / total
        self.log_evidence = (top + np.log(total))[:, 0]
        self.weight = np.exp(self.relative - logsumexp(self.relative))
        mass = self.density * even_weights(n)
        mass_of_run = mass.sum(axis=1, keepdims=True)
        self.mass = mass / mass_of_run * self.weight[:, None]

    def _even(self, n: int, chosen: Any = slice(None)) -> Array:
        """Return n even values of s over the range of the factor, (some, n)."""
        low = np.arcsinh((self._factor.low - self.centre) / self.width)
        high = np.arcsinh((self._factor.high - self.centre) / self.width)
        return np.linspace(low[chosen], high[chosen], n, axis=1)

    def _at(self, s: Array, chosen: Any = slice(None)) -> Array:
        """Return ln factor at s, (some, n)."""
        centre = self.centre[chosen, None]
        width = self.width[chosen, None]
        return np.asarray(centre + width * np.sinh(s))

    def _spreads(self, n: int) -> tuple[Grids, ...]:
        """Return grids over the errors: n points of an unknown one."""

        def grid(number: int, side: int, spread: Spread | None) -> Array:
            axis = self._axes.get((number, side))
            if axis is not None:
                return np.linspace(axis.low, axis.high, n, axis=1)
            known = 0.0 if spread is None else spread.known
            with np.errstate(divide="ignore"):  # an error that is 0
                return np.full((len(self._all), 1), np.log(known))

        return tuple(
            (grid(k, 0, block.sd), grid(k, 1, block.drift))
            for k, block in enumerate(self.blocks)
        )

    def _tables(self, points: Array, chosen: Index) -> dict[int, Array]:
        """Return the conditional of each block at points of some runs, (some, n).

        As many runs at once are worked on as memory allows.
        """
        tables = {}
        count = len(chosen)
        for number in data_blocks.measured_blocks(self.blocks):
            block = self.blocks[number]
            sd, drift = (grid[chosen] for grid in self.spreads[number])
            size = points.shape[1] * len(block.rows) * sd.shape[1] * drift.shape[1]
            pieces = min(count, 1 + count * size // AT_ONCE)
            parts = []
            for piece in np.array_split(np.arange(count), pieces):
                runs = [self.histories[i] for i in chosen[piece]]
                errors = (sd[piece], drift[piece])
                table, _ = conditional(runs, block, number, points[piece], errors)
                parts.append(table)
            tables[number] = np.concatenate(parts)
        return tables

    def _log_likelihood(self, points: Array, chosen: Index) -> Array:
        """Return the log likelihood of all blocks at ln factor (some, n).

        Errors are integrated out.
        """
        total = np.zeros(points.shape)
        for table in self._tables(points, chosen).values():
            if table[0, 0].size == 1:
                total += table[:, :, 0, 0]
            else:
                total += logsumexp(table, axis=(2, 3))
        return total

    def _narrow(self) -> None:
        """Narrow all ranges to where the posterior is, or widen them.

        They are widened where a prior goes on.

        How small an error may be is seen only where the factor is right: its range
        comes first.
        """
        self.spreads = self._spreads(COARSE_SPREAD)
        for _ in range(1 + (len(self._axes) > 0)):
            if self.prior is not None:
                _repeat_until_settled(self._factor_moved, len(self._all))
                self.centre, self.width = find_peaks(
                    self._log_density, *self._factor[:2]
                )
            if self._axes:
                _repeat_until_settled(self._errors_moved, len(self._all))

    def _log_density(self, points: Array, chosen: Index) -> Array:
        """Return the log of prior times likelihood at ln factor (some, n)."""
        assert self.prior is not None
        return log_density(self.prior, points) + self._log_likelihood(points, chosen)

    def _factor_moved(self, chosen: Index) -> Flags:
        """Fit the range of the factor once; say of which runs it moved."""
        low = self._factor.low[chosen]
        high = self._factor.high[chosen]
        points = np.linspace(low, high, COARSE, axis=1)
        logs = self._log_density(points, chosen)
        return _narrow_range(self._factor, chosen, points, logs)

    def _errors_moved(self, chosen: Index) -> Flags:
        """Fit the ranges of unknown errors once; say of which runs any moved."""
        points = self.centre[chosen, None]
        prior_logs = np.zeros((len(chosen), 1))
        if self.prior is not None:
            s = self._even(COARSE, chosen)
            points = self._at(s, chosen)
            prior_logs = log_density(self.prior, points) + np.log(np.cosh(s))

        tables = self._tables(points, chosen)
        block_logs = {n: logsumexp(table, axis=(2, 3)) for n, table in tables.items()}
        together = prior_logs + sum(block_logs.values(), np.zeros(points.shape))
        moved = np.zeros(len(chosen), bool)
        for (number, side), axis in self._axes.items():
            if number not in tables:
                continue
            grid = self.spreads[number][side]
            of_rest = (together - block_logs[number])[:, :, None, None]
            margin = logsumexp(tables[number] + of_rest, axis=(1, 3 - side))
            margin = margin - np.log(even_weights(grid.shape[1]))
            moved |= _narrow_range(axis, chosen, grid[chosen], margin)
        self.spreads = self._spreads(COARSE_SPREAD)
        return moved

    def _resolve(self, prior: Distribution) -> tuple[Array, Array]:
        """Return s on a fine grid, and the log of prior times likelihood per unit of s.

        Both are (runs, n). Nodes are doubled until every other one is foretold by the
        rest; where it is, those between are.
        """
        self.nodes = self._at(self._even(NODES))
        values = self._log_likelihood(self.nodes, self._all)
        while True:
            n = values.shape[1]
            rough = self._rough_runs(prior, values)
            self.resolved = not len(rough)
            if self.resolved or 2 * n - 1 > MAX_NODES[bool(self._axes)]:
                break
            self.nodes = self._at(self._even(2 * n - 1))
            coarse = values
            values = _interpolated(coarse, 0.5 * np.arange(2 * n - 1))
            values[:, ::2] = coarse
            values[rough, 1::2] = self._log_likelihood(self.nodes[rough, 1::2], rough)

        s = self._even(FINER * (n - 1) + 1)
        logs = _interpolated(values, np.linspace(0.0, n - 1.0, s.shape[1]))
        logs = logs + log_density(prior, self._at(s))
        return s, logs + np.log(self.width[:, None] * np.cosh(s))

    def _rough_runs(self, prior: Distribution, values: Array) -> Index:
        """Return the runs in which every other node is not foretold by the rest.

        ``values`` are the log likelihoods at the nodes, (runs, nodes).
        """
        n = values.shape[1]
        logs = values + log_density(prior, self.nodes)
        allowed = np.isfinite(logs)
        top = np.where(allowed, logs, -np.inf).max(axis=1, keepdims=True)
        largest = np.where(allowed, values, -1e300).max(axis=1, keepdims=True)
        safe = np.maximum(values, largest - 1e6)

        spline = CubicSpline(np.arange(0, n, 2), safe[:, ::2], axis=1)
        foretold = spline(np.arange(1, n, 2))
        off = np.abs(np.expm1(np.minimum(foretold - safe[:, 1::2], 50.0)))
        density = np.exp(logs[:, 1::2] - top)
        return np.flatnonzero(~np.all(off * density < FORETOLD, axis=1))

    def reweighed(self, log_weight: Array) -> "Posterior":
        """Return what is known once more is known of the factor of each run.

        Parameters
        ----------
        log_weight : log of the likelihood of it at `log_factor`, (runs, n)
        """
        density = np.log(np.maximum(self.density, TINIEST))
        changed = self.with_changes()
        changed._norm(self.place, density + self.log_evidence[:, None] + log_weight)
        return changed

    def with_points(self, n: int) -> "Posterior":
        """Return it on grids of so many points.

        Parameters
        ----------
        n : number of points, one more than a multiple of `FINER`
        """
        if self.place.shape[1] == n:
            return self
        place = np.linspace(self.place[:, 0], self.place[:, -1], n, axis=1)
        at = np.linspace(0.0, self.place.shape[1] - 1.0, n)
        logs = _interpolated(np.log(np.maximum(self.density, TINIEST)), at)
        finer = self.with_changes(nodes=self._at(place[:, ::FINER]))
        finer._norm(place, logs + self.log_evidence[:, None])
        return finer

    def log_mass(self) -> Array:
        """Return the log of likelihood times spacing of ln factor, (runs, n)."""
        assert self.prior is not None
        n = self.place.shape[1]
        step = (self.place[:, -1:] - self.place[:, :1]) / (n - 1)
        mass = np.maximum(self.density * even_weights(n), TINIEST) * step
        logs = np.log(mass) + self.log_evidence[:, None]
        return np.asarray(logs - log_density(self.prior, self.log_factor))


def joined(
    parts: Sequence[Posterior], log_shares: Sequence[float], blocks: Blocks
) -> Posterior:
    """Return what is known where one of several posteriors holds.

    Parameters
    ----------
    parts : of the same runs each
    log_shares : log of the probability of each before
    blocks : all observations
    """
    n = max(part.place.shape[1] for part in parts)
    parts = [part.with_points(n) for part in parts]
    by_run = ("nodes", "centre", "width", "place", "log_factor", "density", "below")
    columns = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in (*by_run, "log_evidence")
    }
    spreads = [
        tuple(np.concatenate(grids) for grids in zip(*of_block, strict=True))
        for of_block in zip(*(part.spreads for part in parts), strict=True)
    ]
    runs = [len(part.histories) for part in parts]
    log_share = np.repeat(log_shares, runs) + np.log(len(parts))
    whole = parts[0].with_changes(
        histories=tuple(run for part in parts for run in part.histories),
        blocks=tuple(blocks),
        spreads=tuple(spreads),
        log_share=log_share,
        resolved=all(part.resolved for part in parts),
        _all=np.arange(sum(runs)),
        **columns,
    )
    whole.weight = np.exp(whole.relative - logsumexp(whole.relative))
    mass = whole.density * even_weights(n)
    whole.mass = mass / mass.sum(axis=1, keepdims=True) * whole.weight[:, None]
    return whole


def weighted_quantiles(value: Array, weight: Array, p: Any) -> Array:
    """Return quantiles of weighted values, each in the middle of its weight.

    Parameters
    ----------
    value, weight : (n,)
    p : probabilities
    """
    order = np.argsort(value, kind="stable")
    ordered = weight[order]
    below = np.cumsum(ordered)
    return np.interp(p, (below - 0.5 * ordered) / below[-1], value[order])


def even_weights(n: int) -> Array:
    """Return weights of evenly spaced values in an integral, for a spacing of 1.

    By Gregory's rule, of fourth order.

    Parameters
    ----------
    n : number of values
    """
    weights = np.ones(n)
    if n >= 6:
        weights[:3] = weights[:-4:-1] = (3 / 8, 7 / 6, 23 / 24)
    elif n > 1:
        weights[[0, -1]] = 0.5
    return weights


def equal_draws(probability: Array, n: int, rng: Random) -> Index:
    """Return the places of equally probable draws, (n,), in their order.

    Parameters
    ----------
    probability : of each place
    n : number of draws
    rng : of the first of them
    """
    below = np.cumsum(probability)
    places = np.searchsorted(below, (np.arange(n) + rng.random()) / n)
    return np.minimum(places, len(below) - 1)


def draws_along_grid(u: Array, mass: Array, rows: Index, rng: Random) -> Array:
    """Return draws from laws on one grid, (n,).

    Parameters
    ----------
    u : the grid
    mass : of each law there, (p, grid)
    rows : law of each draw, (n,)
    rng : of the draws
    """
    below = np.cumsum(0.5 * (mass[:, 1:] + mass[:, :-1]), axis=1)
    below_of_draws = below[rows]
    at = rng.random(len(rows)) * below_of_draws[:, -1]
    pieces = (below_of_draws < at[:, None]).sum(axis=1)
    i = np.minimum(pieces, below.shape[1] - 1)
    mass_before = np.where(i > 0, below[rows, i - 1], 0.0)
    mass_of_piece = below[rows, i] - mass_before
    share = (at - mass_before) / np.maximum(mass_of_piece, 1e-300)
    return np.asarray(u[i] + share * (u[i + 1] - u[i]))


def conditional(
    runs: Runs, block: Block, number: int, u: Array, grids: Grids
) -> tuple[Array, Filtered]:
    """Return log p(y_b, ln sd, ln drift | factor) weighted by the grids.

    It is (runs, factors, sds, drifts); what is filtered comes beside it.

    Parameters
    ----------
    runs, block, number : stored runs, what was measured, the block's place
    u : (runs, factors) ln factor
    grids : (runs, n) over ln of the errors
    """
    sd_grid, drift_grid = grids
    lanes = ParameterBatch(
        factor=np.exp(u)[:, :, None, None],
        sd=np.exp(sd_grid)[:, None, :, None],
        drift=np.exp(drift_grid)[:, None, None, :],
    )
    runs_with_lanes = [(run, [i]) for i, run in enumerate(runs)]
    filtered = log_likelihood(block, runs_with_lanes, number, lanes)
    sd_prior = _log_prior(block.sd, sd_grid)[:, None, :, None]
    drift_prior = _log_prior(block.drift, drift_grid)[:, None, None, :]
    return filtered.log_likelihood + sd_prior + drift_prior, filtered


def _log_prior(spread: Spread | None, grid: Array) -> Array:
    """Return the logs of an error's prior times the weights of its grid, (runs, n).

    0 of a known one.
    """
    if spread is None or spread.prior is None:
        return np.zeros((1, 1))
    weights = even_weights(grid.shape[1]) * (grid[:, 1:2] - grid[:, :1])
    return log_density(spread.prior, grid, spread.scale) + np.log(weights)


def find_peaks(
    logs_at: Callable[[Array, Index], Array], low: Array, high: Array
) -> tuple[Array, Array]:
    """Return where densities are largest within ranges, and their widths, (rows,).

    Parameters
    ----------
    logs_at : their logs at points (some, n), of some of the rows
    low, high : (rows,)
    """
    low = low.copy()
    high = high.copy()
    top = np.empty(len(low))
    width = np.empty(len(low))

    def moved(chosen: Index) -> Flags:
        """Narrow some of the ranges about their tops; say which are to go on."""
        points = np.linspace(low[chosen], high[chosen], CENTRED, axis=1)
        rows = np.arange(len(chosen))
        logs = logs_at(points, chosen)
        best = np.argmax(logs, axis=1)
        near = logs > logs[rows, best][:, None] - 0.5
        first = near.argmax(axis=1)
        last = CENTRED - 1 - near[:, ::-1].argmax(axis=1)
        top[chosen] = points[rows, best]
        width[chosen] = 0.5 * (points[rows, last] - points[rows, first])
        low[chosen] = points[rows, np.maximum(best - 2, 0)]
        high[chosen] = points[rows, np.minimum(best + 2, CENTRED - 1)]
        return np.asarray(near.sum(axis=1) <= 4)

    _repeat_until_settled(moved, len(low))
    return top, width


def _repeat_until_settled(moved: Callable[[Index], Flags], count: int) -> None:
    """Take steps of so many rows, of each until one did not move it."""
    chosen = np.arange(count)
    for _ in range(ROUNDS):
        chosen = chosen[moved(chosen)]
        if not len(chosen):
            break


def _interpolated(values: Array, at: Array) -> Array:
    """Return values of evenly spaced nodes, (runs, n), at places between them."""
    safe = np.maximum(values, values.max(axis=1, keepdims=True) - 1e6)
    return np.asarray(CubicSpline(np.arange(values.shape[1]), safe, axis=1)(at))


def _narrow_range(axis: Range, chosen: Index, points: Array, logs: Array) -> Flags:
    """Fit ranges of some runs to all within `DEPTH` of the top of logs, (some, points).

    Say which moved.
    """
    low = axis.low[chosen]
    high = axis.high[chosen]
    smallest = axis.smallest[chosen]
    largest = axis.largest[chosen]
    rows = np.arange(len(chosen))
    end = logs.shape[1] - 1
    deep = logs > logs.max(axis=1, keepdims=True) - DEPTH
    top = np.argmax(logs, axis=1)
    first = deep.argmax(axis=1)
    last = end - deep[:, ::-1].argmax(axis=1)

    width = (high - low) * np.where((top == 0) | (top == end), 4.0, 1.0)
    left = points[rows, np.maximum(first - 1, 0)]
    right = points[rows, np.minimum(last + 1, end)]
    down = (first == 0) & (left > smallest + 1e-9)
    up = (last == end) & (right < largest - 1e-9)
    new_low = np.where(down, np.maximum(smallest, left - width), left)
    new_high = np.where(up, np.minimum(largest, right + width), right)
    axis.low[chosen] = new_low
    axis.high[chosen] = new_high
    narrower = right - left < 0.6 * (high - low)
    return np.asarray(narrower | down | up)
