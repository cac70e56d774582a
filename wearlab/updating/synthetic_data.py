"""Synthetic twins: measurements made up from a known truth.

``python -m wearlab.updating.synthetic_data FILE KEY=VALUE… [--seed N]`` writes the data
files of one twin: the campaign is run with the values given as the truth, and in every
data file the values are replaced by what would have been measured there. Cycles and
places stay as the files have them, which so may hold zeros.
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from wearlab import arrays, tables, units
from wearlab.campaign import Campaign, load
from wearlab.updating import (
    answers,
    data_blocks,
    grids,
    likelihood,
    lives,
    run_curves,
    sampling,
)
from wearlab.updating.cases import Observed, Subject, UpdateError, studies

MADE = "# Made by: "
DIGITS = 5


def made_twin(
    truth: sampling.Draws, prior: lives.Answer, rng: arrays.Random
) -> tuple[data_blocks.Blocks, float]:
    """Return the blocks with made-up values of one truth, and its life [cycles].

    Parameters
    ----------
    truth : one draw, with runs and blocks
    prior : the prior, for what drifts on to the limit
    rng : of errors and drift
    """
    post = truth.posterior
    run = post.histories[int(truth.run[0])]
    life = float(truth.life[0])
    last = [
        run.points[n].cycle[block.rows].max(initial=run.start)
        for n, block in enumerate(post.blocks)
    ]
    last_cycle = float(max(last))

    blocks = []
    for number, block in enumerate(post.blocks):
        replicas, w = sampling.replicated(truth, number, rng, conditional=False)
        below = block.observed.below[block.rows]
        values = block.observed.value.copy()
        # a file says the limit alone
        values[block.rows] = np.where(replicas[0] < below, np.nan, replicas[0])
        blocks.append(replace(block, observed=replace(block.observed, value=values)))
        if number == prior.drifting:
            rate = truth.drift[number] ** 2 / likelihood.PER
            spread = np.sqrt(rate * (last_cycle - last[number]))
            w = w + spread * rng.standard_normal(1)
            ends = lives.draw_lives(run, truth.factor, w, last_cycle, rate, rng)
            life = float(ends[0])
    return tuple(blocks), life


def twin_files(
    campaign: Campaign, truth: dict[str, str | float], seed: int
) -> tuple[dict[Path, str], float]:
    """Return the texts of data files as a twin's measurements would be, and its life.

    Parameters
    ----------
    campaign : with an [update]
    truth : key of the scene → value
    seed : of the errors

    Raises
    ------
    UpdateError : an observation lies beyond the twin's run
    """
    from wearlab.simulation import simulate

    subjects = studies(campaign)
    measured = _distinct_observations(subjects)
    scene = subjects[0].scene.replace(dict(truth))
    run = run_curves.history_of(simulate(scene), scene, measured, subjects[0].limit)
    for points, observed in zip(run.points, measured, strict=True):
        if points.cycle.max(initial=0.0) > run.end:
            raise UpdateError(
                f"{observed.data.file}: goes on beyond the twin's run, {run.end:g} "
                "cycles"
            )

    draw = _true_draw(run, measured)
    prior = lives.Answer(draw.posterior, run.start, None)
    blocks, life = made_twin(draw, prior, np.random.default_rng(seed))
    texts: dict[Path, str] = {}
    for block in blocks:
        if block.observed.data.at is not None:
            raise UpdateError(
                f"{block.observed.data.place}.at: measured flanks are not made up: "
                "give a table with columns"
            )
        file = Path(block.data.file)
        text = texts.get(file) or file.read_text(encoding="utf-8")
        texts[file] = _with_values(text, block.observed)
    return texts, life


def _distinct_observations(subjects: Sequence[Subject]) -> tuple[Observed, ...]:
    """Return the observations of all cases, each column of a file once."""
    by_column: dict[tuple[object, ...], Observed] = {}
    for study in subjects:
        for observed in study.observations:
            data = observed.data
            key = (data.file, data.columns.value, data.label)
            by_column.setdefault(key, observed)
    return tuple(by_column.values())


def _true_draw(
    run: run_curves.RunHistory, measured: Sequence[Observed]
) -> sampling.Draws:
    """Return a run as one draw, with the errors that the files give."""
    blocks = tuple(
        data_blocks.block_of(observed, accumulating=True) for observed in measured
    )

    def known(spread: data_blocks.Spread | None) -> arrays.Array:
        return np.full(1, 0.0 if spread is None else spread.known)

    empty = grids.Posterior((run,), answers.without_values(blocks), None)
    return sampling.Draws(
        posterior=empty.with_changes(blocks=blocks),
        run=np.zeros(1, np.intp),
        factor=np.full(1, run.factor),
        sd=tuple(known(block.sd) for block in blocks),
        drift=tuple(known(block.drift) for block in blocks),
        life=np.full(1, run.limit_cycle),
    )


def _with_values(text: str, observed: Observed) -> str:
    """Return a file's text with the values of one column replaced."""
    data = observed.data
    column = data.columns.value or data.quantity
    unit = data.units.get(column)
    scale = 1.0 if unit is None else units.convert(1.0, unit, data.si)
    table = tables.read_table(Path(data.file), sheet=data.sheet, decimal=data.decimal)
    place = table.names.index(str(table.find(column)))

    lines = text.splitlines()
    for row, number in zip(observed.row, observed.value / scale, strict=True):
        cells = lines[row - 1].split(table.separator or None)
        written = "" if np.isnan(number) else f"{number:.{DIGITS}g}"
        cells[place] = written.replace(".", table.decimal)
        lines[row - 1] = (table.separator or " ").join(cells)
    return "\n".join(lines) + "\n"


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the data files of a twin.

    Parameters
    ----------
    arguments : of the command line [those of the process]
    """
    parser = argparse.ArgumentParser(
        prog="python -m wearlab.updating.synthetic_data", description=__doc__
    )
    parser.add_argument("file", help="campaign with an [update]")
    parser.add_argument(
        "truth", nargs="*", metavar="KEY=VALUE", help="what is true of the twin"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the errors")
    options = parser.parse_args(arguments)

    pairs = (pair.partition("=") for pair in options.truth)
    truth = {key: _number(value) for key, _, value in pairs}
    texts, life = twin_files(load(options.file), truth, options.seed)
    words = " ".join(f'"{word}"' if " " in word else word for word in options.truth)
    command = (
        f"{MADE}python -m wearlab.updating.synthetic_data {options.file} {words} "
        f"--seed {options.seed} (true life: {life:.5g} cycles)"
    )
    for file, text in texts.items():
        lines = [line for line in text.splitlines() if not line.startswith(MADE)]
        head = next(i for i, line in enumerate(lines) if not line.startswith("#"))
        lines.insert(head, command)
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
        print(file)


def _number(text: str) -> str | float:
    """Return a text as a number, where it is one."""
    try:
        return float(text)
    except ValueError:
        return text


if __name__ == "__main__":
    main()
