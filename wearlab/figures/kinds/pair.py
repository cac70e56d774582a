"""One tooth pair through its engagement: its share of the load, its force."""

from collections.abc import Iterator

import numpy as np

from wearlab.arrays import Array
from wearlab.figures.ask import Ask
from wearlab.figures.kind import Kind
from wearlab.figures.kinds.engagement import ENGAGEMENT, contact_ratio, entry_phase, path_marks
from wearlab.figures.plot import Series
from wearlab.figures.runs import Run
from wearlab.figures.slices import Slice, companion, slices, thinned


def through_engagement(
    values: Array, phase: Array, ratio: float, lag: float = 0.0, period: int = 0
) -> tuple[Array, Array]:
    """Join the pieces of one pair: slot p holds the pair that entered ceil(ε) − 1 − p periods ago.

    Parameters
    ----------
    values : (pair, n_periods, n_phases)
    phase : (n_phases,) on the clock of all meshes [1]
    ratio : contact ratio [1]
    lag : phase at which a pair of this mesh enters at A [1]
    period : the mesh period in which the pair enters
    """
    slots, periods = int(np.ceil(ratio)), values.shape[1]
    since = np.round(np.arange(periods)[:, None] + phase - lag, 12)
    entered, own = np.floor(since).astype(int), since % 1.0
    x, y = [], []
    for age in range(slots):
        then = (entered - period - age) % periods == 0
        order = np.argsort(own[then])
        x.append(own[then][order] + age)
        y.append(values[slots - 1 - age][then][order])
    at, history = np.concatenate(x), np.concatenate(y)
    return at[at <= ratio], history[at <= ratio]


def _load_share(run: Run, ask: Ask) -> Iterator[Series]:
    run = thinned(run)
    for piece in slices(run, "load_share", ask, "pair", "phase"):
        yield from _histories(run, ask, piece, piece.values[:, None, :])


def _pair_force(run: Run, ask: Ask) -> Iterator[Series]:
    run = thinned(run)
    for piece in slices(run, "pair_force", ask, "pair", "mesh_period", "phase"):
        kept = ~np.isnan(piece.values).all(axis=(0, 2))
        yield from _histories(run, ask, piece, piece.values[:, kept])


def _histories(run: Run, ask: Ask, piece: Slice, values: Array) -> Iterator[Series]:
    index = dict(piece.place)
    phase, _ = companion(run, "phase", index, ask)
    ratio, marks = contact_ratio(run, index, ask), path_marks(run, index, ask)
    lag = entry_phase(run, index, ask)
    for period in range(values.shape[1]):
        x, y = through_engagement(values, phase, ratio, lag, period)
        yield Series(piece.key, x, y, ENGAGEMENT, piece.scale, marks=marks)


LOAD_SHARE = Kind(
    name="load-share",
    title="Load share of one tooth pair",
    shows="share of the static mesh force that one tooth pair carries, from A to E",
    needs=("load_share", "phase", "contact_ratio", "mesh_phase_offset"),
    dims=("pair", "phase"),
    series=_load_share,
    roles=(("hue", "update"), ("hue", "*"), ("cols", "*"), ("rows", "*")),
)
PAIR_FORCE = Kind(
    name="pair-force",
    title="Dynamic force on one tooth pair",
    shows="elastic force on the drive flanks of one tooth pair, from A to E, one curve per mesh period",
    needs=("pair_force", "phase", "contact_ratio", "mesh_phase_offset"),
    dims=("pair", "mesh_period", "phase"),
    series=_pair_force,
    roles=(("hue", "update"), ("cols", "*"), ("rows", "*"), ("hue", "*")),
)
