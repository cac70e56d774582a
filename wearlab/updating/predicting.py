"""What the posterior says of the wear over the cycles, and of measurements that could have been made."""

import numpy as np

from wearlab.arrays import Array
from wearlab.updating.checking import surprises
from wearlab.updating.curve import RunCurve
from wearlab.updating.draws import Draws
from wearlab.updating.filtering import smoothed_paths
from wearlab.updating.history import RunHistory
from wearlab.updating.likelihood import PER, inspections_of, modelled
from wearlab.updating.posterior import Posterior


def over_cycles(
    post: Posterior, draws: Draws, curve: str, cycles: Array, drifting: int | None, rng: np.random.Generator
) -> Array:
    """Return a quantity over the cycles for every draw, (cycles, draws) [SI].

    Parameters
    ----------
    post, draws : the posterior and draws from it
    curve : "limit", or a quantity that stands beside it
    cycles : rising
    drifting : the block whose drift the quantity follows, None without one
    rng : of the paths of the drift
    """
    depths = np.empty((len(cycles), len(draws)))
    for i in np.unique(draws.run):
        run, mine = post.histories[int(i)], draws.of_run(int(i))
        own = run.own_cycle(cycles[:, None], draws.factor[mine])
        depths[:, mine] = _curve(run, curve).at(own)
    if drifting is not None:
        depths += _drifts(post, draws, drifting, cycles, rng)
    return depths


def _curve(run: RunHistory, name: str) -> RunCurve:
    return run.limit if name == "limit" else run.beside[name]


def _drifts(post: Posterior, draws: Draws, number: int, cycles: Array, rng: np.random.Generator) -> Array:
    """Return draws of W over the cycles: through its draws at the inspections, freely after the last."""
    block, n = post.blocks[number], len(draws)
    rate = draws.drift[number] ** 2 / PER
    history = post.histories[0]
    known, paths = [history.start], [np.zeros(n)]
    if len(block.rows):
        times = [inspection.cycle for inspection in inspections_of(block, history, number)]
        drawn = smoothed_paths(surprises(post, draws, number), times, rate, rng)
        first = 1 if times[0] <= history.start else 0
        known += times[first:]
        paths += list(drawn[first:])
    drifts = np.empty((len(cycles), n))
    at, w, after = known[0], paths[0], 1
    for k, cycle in enumerate(cycles):  # a Brownian bridge, place by place, from one inspection to the next
        while after < len(known) and known[after] <= cycle:
            at, w, after = known[after], paths[after], after + 1
        step = max(cycle - at, 0.0)
        if after < len(known):
            share = step / (known[after] - at)
            mean, spread = w + share * (paths[after] - w), rate * step * (1.0 - share)
        else:
            mean, spread = w, rate * step
        w = mean + np.sqrt(np.maximum(spread, 0.0)) * rng.standard_normal(n)
        at = max(at, float(cycle))
        drifts[k] = w
    return drifts


def replicated(post: Posterior, draws: Draws, number: int, rng: np.random.Generator) -> Array:
    """Return measurements as they could have come out, (draws, values) [SI]."""
    block, n = post.blocks[number], len(draws)
    depths = np.empty((n, len(block.rows)))
    for i in np.unique(draws.run):
        mine = draws.of_run(int(i))
        depths[mine] = modelled(block, post.histories[int(i)], number, draws.factor[mine])
    seen, error = block.seen, block.data.error
    relative = np.hypot(error.relative, block.numerical)
    model = depths.copy()
    times = inspections_of(block, post.histories[0], number)
    if np.any(draws.drift[number] > 0.0) and block.data.since is None:
        rate = draws.drift[number] ** 2 / PER
        paths = smoothed_paths(surprises(post, draws, number), [t.cycle for t in times], rate, rng)
        for time, w in zip(times, paths, strict=True):
            depths[:, time.values] += w[:, None]
    if error.offset_sd:
        for time in times:
            depths[:, time.values] += error.offset_sd * rng.standard_normal((n, 1))
    spread = np.sqrt(draws.sd[number][:, None] ** 2 + seen.sd[block.rows] ** 2 + (relative * model) ** 2)
    return np.asarray(depths + spread * rng.standard_normal(depths.shape))
