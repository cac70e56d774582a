"""What is known of the wear coefficient of one unit, given what all units share.

The likelihood of ln f is the filter's, exact; its integral is on a grid of the unit's
own.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import softmax

from wearlab.arrays import Array, Index, Random
from wearlab.updating import grids, interval_blocks, kalman, likelihood
from wearlab.updating.fleet_law import Law, Shared
from wearlab.updating.fleet_members import FleetMember
from wearlab.updating.sheet_doubts import FAR, log_with_scale
from wearlab.updating.tails import FREEDOMS, over_freedoms, tails_of

NODES = 65  # of a unit's grid
DEPTH = 60.0  # of a unit's log likelihood below its top that counts
FLOOR = 1e3  # of it below its top, down to which it is interpolated
REACH = 6.0  # standard deviations of the population that a unit's grid goes to


def unit_likelihood(
    unit: FleetMember, shared: Shared, log_factor: Array, *, steps: bool = False
) -> kalman.Filtered:
    """Return how probable a unit's measurements are, and what is known of its W.

    Parameters
    ----------
    unit : with its measurements
    shared : what units share, lanes (p, 1)
    log_factor : ln of the factor on the wear coefficient, (p, nodes)
    steps : whether each inspection's innovation is kept
    """
    run = unit.run
    factor = np.exp(log_factor)
    begins = [0]
    parts = []
    apart: dict[int, list[Array]] = {}
    columns = zip(run.points, unit.blocks, shared.sd, strict=False)
    for number, (points, block, sd) in enumerate(columns):
        if interval_blocks.stands_apart(block):
            begins.append(begins[-1])
            if len(block.rows):
                apart[number] = interval_blocks.log_likelihoods(
                    block, run, number, shared, factor
                )
            continue
        cycle = points.cycle[block.rows]
        column = points.column[block.rows]
        model = shared.mean(run, points, factor, cycle, column)
        parts.append(likelihood.compared(block, model, sd))
        begins.append(begins[-1] + len(block.rows))

    nothing = np.zeros(0, np.intp)
    scales = [shared.worn(run, points.curve, factor) for points in run.points]
    times = [
        inspection._replace(
            cycle=shared.equal(run.equal(inspection.cycle)),
            values=inspection.values + begins[n] if n not in apart else nothing,
            offset_variance=0.0 if n in apart else inspection.offset_variance,
            scale=scales[n],
        )
        for n, inspection in unit.inspections
    ]
    residuals = _residuals_of(parts, log_factor.shape)
    before = kalman.Filtered()
    if shared.tails:
        by_freedom = [
            kalman.filtered(
                residuals,
                times,
                before,
                shared.rate,
                steps=steps,
                tails=tails_of(freedom),
            )
            for freedom in FREEDOMS
        ]
        filtered = over_freedoms(by_freedom)
    else:
        filtered = kalman.filtered(residuals, times, before, shared.rate, steps=steps)
    return _with_apart(filtered, unit, apart) if apart else filtered


def _residuals_of(
    parts: Sequence[kalman.Residuals], lanes: tuple[int, ...]
) -> kalman.Residuals:
    """Return residuals of blocks as those of one, of lanes without any value."""
    if not parts:
        return kalman.Residuals(*(np.empty((*lanes, 0)) for _ in range(3)))
    return parts[0] if len(parts) == 1 else _side_by_side(parts)


def _with_apart(
    filtered: kalman.Filtered, unit: FleetMember, apart: dict[int, list[Array]]
) -> kalman.Filtered:
    """Return what the filter knows, with the likelihood of blocks that stand apart."""
    of_inspection = {number: iter(logs) for number, logs in apart.items()}
    total = filtered.log_likelihood + sum(sum(logs) for logs in apart.values())
    innovations = []
    for step, (number, _) in zip(filtered.steps, unit.inspections, strict=False):
        if number in apart:
            log_likelihood = np.asarray(next(of_inspection[number]))
            step = replace(step, log_likelihood=log_likelihood)
        innovations.append(step)
    return replace(filtered, log_likelihood=total, steps=innovations)


def _side_by_side(parts: Sequence[kalman.Residuals]) -> kalman.Residuals:
    """Return residuals, variances and limits of several blocks as those of one."""
    shapes = [array.shape[:-1] for part in parts for array in part]
    lanes = np.broadcast_shapes(*shapes)
    wide = []
    for part in parts:
        shape = (*lanes, part.difference.shape[-1])
        wide.append([np.broadcast_to(array, shape) for array in part])
    columns = zip(*wide, strict=True)
    return kalman.Residuals(*(np.concatenate(column, axis=-1) for column in columns))


def _likelihood_on_grid(
    unit: FleetMember, shared: Shared, ends: Array, cycles: Array | None
) -> tuple[Array, Array]:
    """Return ln f on a fine grid, and the log of the likelihood times the spacing.

    That is (p, n); with cycles it is of what had been measured by each of them,
    (cycles, p, n).
    """
    centre, width = _top_of_unit(unit, shared, ends)
    first, last = np.arcsinh((ends - centre) / width).tolist()
    coarse = np.linspace(first, last, NODES)
    fine = np.linspace(first, last, 2 * NODES - 1)

    nodes = (centre + width * np.sinh(coarse))[None]
    logs = _log_likelihood_at(unit, shared, nodes, cycles)
    logs = _with_middles(coarse, logs)

    counted = logs > logs.max(axis=-1, keepdims=True) - DEPTH
    deep = counted.reshape(-1, len(fine)).any(axis=0)
    step = fine[1] - fine[0]
    spacing = width * np.cosh(fine) * step * grids.even_weights(len(fine))
    log_factor = centre + width * np.sinh(fine)
    return log_factor[deep], (logs + np.log(spacing))[..., deep]


def _with_middles(nodes: Array, logs: Array) -> Array:
    """Return logs of a likelihood at even nodes and between them, (…, 2n − 1).

    A spline of them overshoots where the log falls steeply, by more than what stands
    at the top: between two nodes that do not count, it is the larger of theirs.

    Parameters
    ----------
    nodes : (n,)
    logs : (…, n)
    """
    top = logs.max(axis=-1, keepdims=True)
    spline = CubicSpline(nodes, np.maximum(logs, top - FLOOR), axis=-1)
    middles = spline(0.5 * (nodes[1:] + nodes[:-1]))
    larger = np.maximum(logs[..., 1:], logs[..., :-1])

    result = np.empty((*logs.shape[:-1], 2 * len(nodes) - 1))
    result[..., ::2] = logs
    result[..., 1::2] = np.where(larger > top - DEPTH, middles, larger)
    return result


def _log_likelihood_at(
    unit: FleetMember, shared: Shared, log_factor: Array, cycles: Array | None
) -> Array:
    """Return the log likelihood of a unit at ln f (1, nodes), as of each of cycles."""
    shape = (len(shared.straying), log_factor.shape[1])
    filtered = unit_likelihood(unit, shared, log_factor, steps=cycles is not None)
    if cycles is None:
        return np.broadcast_to(filtered.log_likelihood, shape)
    gained = [np.broadcast_to(step.log_likelihood, shape) for step in filtered.steps]
    so_far = np.cumsum([np.zeros(shape), *gained], axis=0)
    return np.asarray(so_far[unit.inspected(cycles)])


def _top_of_unit(unit: FleetMember, shared: Shared, ends: Array) -> tuple[float, float]:
    """Return the most probable ln f of a unit, and the width of its likelihood.

    In one lane in the middle of all: the top moves little with what the units share.
    """

    def middle(values: Array) -> Array:
        logs = np.log(np.maximum(values, 1e-300))
        return np.asarray(np.exp(np.mean(logs, axis=0, keepdims=True)))

    lane = Shared(
        power=middle(shared.power),
        straying=middle(shared.straying),
        sd=tuple(middle(sd) for sd in shared.sd),
        reference=shared.reference,
        tails=shared.tails,
    )

    def logs_at(log_factor: Array, _: Index) -> Array:
        return _log_likelihood_at(unit, lane, log_factor, None)

    top, width = grids.find_peaks(logs_at, ends[:1], ends[1:])
    largest_width = 0.25 * (ends[1] - ends[0])
    return float(top[0]), float(np.clip(width[0], 1e-4, largest_width))


class UnitMasses(NamedTuple):
    """What is known of a unit's factor, given what the units share.

    Parameters
    ----------
    log_factor : ln f, (n,)
    mass : L N(ln f; m, s²) there over the largest, (…, p, n)
    log_marginal : ln of their sums, (…, p)
    """

    log_factor: Array
    mass: Array
    log_marginal: Array


def masses(
    unit: FleetMember,
    law: Law,
    theta: Array,
    cycles: Array | None = None,
    aside: FleetMember | None = None,
) -> UnitMasses:
    """Return what is known of a unit's factor at points of what the units share.

    Parameters
    ----------
    unit : with its measurements
    law : what is unknown of all units together
    theta : ln of the parameters, (p, parameters)
    cycles : (cycles,) up to each of which measurements count, the masses then being
        (cycles, p, n) [all count]
    aside : the unit with a sheet that has a scale of its own [none has]
    """
    spread = np.exp(theta[:, -2])
    median = theta[:, -1]
    # the likelihood knows the errors alone
    errors = np.round(theta[:, :-2], 10)
    _, first, lane = np.unique(errors, axis=0, return_index=True, return_inverse=True)
    shared = law.shared(theta[first])
    low = np.min(median - REACH * spread)
    high = np.max(median + REACH * spread)
    # a range is left though all points lie beyond what was measured
    ends = np.array([low, max(min(high, unit.largest_log_factor(shared)), low + 1.0)])
    u, logs = _likelihood_on_grid(unit, shared, ends, cycles)
    if aside is not None:
        logs = logs + _with_scale(aside, shared, ends, u)

    z = (u - median[:, None]) / spread[:, None]
    log_norm = np.log(spread * np.sqrt(2.0 * np.pi))[:, None]
    logs = logs[..., lane.ravel(), :]
    logs -= 0.5 * z * z + log_norm
    top = logs.max(axis=-1)
    # large: no copies of it
    mass = np.exp(np.subtract(logs, top[..., None], out=logs), out=logs)
    return UnitMasses(u, mass, top + np.log(mass.sum(axis=-1)))


def _with_scale(aside: FleetMember, shared: Shared, ends: Array, u: Array) -> Array:
    """Return the log likelihood of a sheet with a scale of its own at ln f, (p, n)."""
    farthest = np.array([ends[0] - FAR, ends[1] + FAR])
    largest = aside.largest_log_factor(shared)
    farthest[1] = max(min(farthest[1], largest), farthest[0] + 1.0)
    log_factor, log_mass = _likelihood_on_grid(aside, shared, farthest, None)
    return log_with_scale(u, log_factor, log_mass)


def masses_by_reading(unit: FleetMember, law: Law, theta: Array) -> list[UnitMasses]:
    """Return what is known of a unit's factor by each reading of its sheets.

    The logs of marginals have the probability of that reading before.

    Parameters
    ----------
    unit : with its measurements
    law : what is unknown of all units together
    theta : ln of the parameters, (p, parameters)
    """
    known = []
    for reading in unit.readings:
        of_reading = masses(reading.unit, law, theta, aside=reading.aside)
        log_marginal = of_reading.log_marginal + reading.log_prior
        known.append(of_reading._replace(log_marginal=log_marginal))
    return known


class FactorDraws(NamedTuple):
    """Draws of what is known of a unit, one for each draw of what all share.

    Parameters
    ----------
    log_factor : ln f, (n,)
    reading : which of the readings of its sheets holds, (n,)
    """

    log_factor: Array
    reading: Index


def factors(unit: FleetMember, law: Law, theta: Array, rng: Random) -> FactorDraws:
    """Return a draw of ln f of a unit for each of points, given its measurements.

    Parameters
    ----------
    unit : with its measurements
    law : what is unknown of all units together
    theta : ln of the parameters, (n, parameters)
    rng : of the draws
    """
    all_sound = np.zeros(len(theta), np.intp)
    if not len(unit.cycles):
        spread = np.exp(theta[:, -2])
        log_factor = theta[:, -1] + spread * rng.standard_normal(len(theta))
        return FactorDraws(log_factor, all_sound)

    points, rows = np.unique(theta, axis=0, return_inverse=True)
    rows = rows.ravel()
    known = masses_by_reading(unit, law, points)
    reading = all_sound
    if len(known) > 1:
        log_marginals = np.stack([one.log_marginal for one in known])
        below = np.cumsum(softmax(log_marginals, axis=0), axis=0)[:-1]
        reading = np.sum(rng.random(len(rows)) > below[:, rows], axis=0)

    log_factor = np.empty(len(rows))
    for number, one in enumerate(known):
        chosen = np.flatnonzero(reading == number)
        if len(chosen):
            log_factor[chosen] = grids.draws_along_grid(
                one.log_factor, one.mass, rows[chosen], rng
            )
    return FactorDraws(log_factor, reading)
