"""One gear set with sheets that contradict each other: a posterior by each reading.

Beside every run as it is, with all sheets sound, stands the run with one of them having
a scale of its own, each sheet in turn (`sheet_doubts`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from wearlab.arrays import Array, Index, Random
from wearlab.updating.data_blocks import Blocks
from wearlab.updating.grids import Posterior, draws_along_grid, joined
from wearlab.updating.run_curves import DoubtedSheet, RunHistory, Runs
from wearlab.updating.sheet_doubts import (
    log_density_of_scale,
    log_of_doubt,
    log_with_scale,
)

THINNED = 4  # points of a grid, of which one is taken where they are finer than needed

Sheets = Mapping[str, tuple[int, ...]]
"""The blocks of each sheet, by its name."""


def sheets_of(blocks: Blocks) -> Sheets:
    """Return the sheets that tell where a gear set stands, with their blocks.

    A block with an unknown gain has a scale of its own anyway.

    Parameters
    ----------
    blocks : observations
    """
    sheets: dict[str, tuple[int, ...]] = {}
    for n, block in enumerate(blocks):
        if len(block.rows) and not block.data.error.gain_sd:
            name = block.data.sheet_name
            sheets[name] = (*sheets.get(name, ()), n)
    return sheets


def with_doubts(
    post: Posterior, alone: Sequence[Posterior], others: Sequence[Posterior]
) -> Posterior:
    """Return what is known where each sheet may have a scale of its own.

    Parameters
    ----------
    post : as if all sheets were sound
    alone : by each sheet alone
    others : by all but each of them
    """
    log_all_sound, log_doubt = log_of_doubt(len(alone))
    sheets = list(sheets_of(post.blocks).values())
    parts = [post]
    for blocks, sheet, sound in zip(sheets, alone, others, strict=True):
        log_scaled = np.stack(
            [_log_scaled(sheet, sound, run) for run in range(len(post.histories))]
        )
        histories = tuple(
            replace(history, doubted=DoubtedSheet(blocks, sheet, run))
            for run, history in enumerate(sound.histories)
        )
        spreads = tuple(
            of_sheet if number in blocks else of_sound
            for number, (of_sheet, of_sound) in enumerate(
                zip(sheet.spreads, sound.spreads, strict=True)
            )
        )
        weighed = sound.reweighed(log_scaled)
        parts.append(weighed.with_changes(histories=histories, spreads=spreads))
    shares = [log_all_sound, *[log_doubt] * len(alone)]
    return joined(parts, shares, post.blocks)


def _log_scaled(sheet: Posterior, sound: Posterior, run: int) -> Array:
    """Return the log likelihood of a sheet with a scale of its own, (n,)."""
    log_factor, log_mass = _thinned(sheet, run)
    return log_with_scale(sound.log_factor[run], log_factor, log_mass)


def _thinned(sheet: Posterior, run: int) -> tuple[Array, Array]:
    """Return ln factor, and the log of likelihood times spacing there, of a run."""
    log_mass = sheet.log_mass()[run][::THINNED] + np.log(THINNED)
    return sheet.log_factor[run][::THINNED], log_mass


def without_doubts(runs: Runs) -> list[RunHistory]:
    """Return the runs in which all sheets are sound.

    Parameters
    ----------
    runs : of a posterior
    """
    return [run for run in runs if run.doubted is None]


def sound_probability(post: Posterior) -> float:
    """Return how probably no sheet has a scale of its own.

    Parameters
    ----------
    post : with doubts, or without
    """
    sound = [run.doubted is None for run in post.histories]
    return float(post.weight[sound].sum())


def doubted_probability(post: Posterior, block: int) -> float:
    """Return how probably the sheet of a block has a scale of its own.

    Parameters
    ----------
    post : with doubts, or without
    block : number of the block
    """
    is_doubted = [
        run.doubted is not None and block in run.doubted.blocks
        for run in post.histories
    ]
    return float(post.weight[is_doubted].sum())


def drawn_scales(
    post: Posterior, run: Index, log_factor: Array, rng: Random
) -> dict[int, Array]:
    """Return draws of ln of the scale of each block that may have one, (draws,) each.

    Parameters
    ----------
    post : with doubts, or without
    run : which run each draw is of, (draws,)
    log_factor : ln factor of each, (draws,)
    rng : of the draws
    """
    scales: dict[int, Array] = {}
    for i in np.unique(run):
        doubted = post.histories[i].doubted
        if doubted is None:
            continue
        drawn = np.flatnonzero(run == i)
        seen, log_mass = _thinned(doubted.alone, doubted.run)
        away = seen - log_factor[drawn][:, None]
        logs = log_mass + log_density_of_scale(away)
        mass = np.exp(logs - logs.max(axis=1, keepdims=True))
        at = draws_along_grid(seen, mass, np.arange(len(drawn)), rng)
        for block in doubted.blocks:
            scale = scales.setdefault(block, np.zeros(len(run)))
            scale[drawn] = at - log_factor[drawn]
    return scales
