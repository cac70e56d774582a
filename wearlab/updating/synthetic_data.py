"""Synthetic twins: measurements made up from a known truth, and how often intervals hold it.

Truths are drawn from the prior, measurements from the model with its errors; each twin
is updated as the real data are. The probability that a posterior gives to less than the
truth is then uniform (Talts et al. 2018, arXiv:1804.06788), and an interval holds the
truth as often as it says.

``python -m wearlab.updating.synthetic_data FILE KEY=VALUE… [--seed N]`` writes the data files of
one twin: the campaign is run with the values given as the truth, and in every data file
the values are replaced by what would have been measured there. Cycles and places stay
as the files have them, which so may hold zeros.
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from wearlab import arrays, tables, units
from wearlab.campaign import Campaign, load, update_options
from wearlab.updating import (
    answers,
    grids,
    layout,
    likelihood,
    lives,
    run_curves,
    sampling,
    scores,
)
from wearlab.updating.cases import Observed, Subject, UpdateError, studies

MADE = "# Made by: "
DIGITS = 5
SKILLS = ("life_skill", "life_interval_skill")


def calibrated(
    study: Subject, post: grids.Posterior, n: int, *, believed: likelihood.Blocks = ()
) -> xr.Dataset:
    """Return the ranks of the truths of synthetic twins, and how often intervals hold them.

    Parameters
    ----------
    study, post : the study and its posterior: runs, blocks, prior
    n : number of twins
    believed : the errors that the twins are updated with, where they are to be wrong [those
        they are made with]
    """
    rng = np.random.default_rng([study.spec.seed, 2])
    true = study.spec.check
    source = post
    if true is not None:
        runs = tuple(_with_power(run, true.power) for run in post.histories)
        source = post.with_changes(histories=runs, blocks=_true_blocks(post, true))
        believed = believed or post.blocks
    prior = answers.answer_of(
        study, source.histories, answers.without_values(source.blocks)
    )
    truths = replace(sampling.draw(prior, n, rng), posterior=source)
    unmeasured = prior.life(scores.EVEN)
    ranks: dict[str, list[float]] = {"factor": [], "life": []}
    scored: list[tuple[tuple[float, float], ...]] = []
    foreseen: list[tuple[float, ...]] = []
    for t in range(n):
        made_blocks, life = made_twin(truths[t : t + 1], prior, rng)
        pairs = zip(believed or made_blocks, made_blocks, strict=True)
        made_blocks = tuple(
            replace(made_block, observed=replace(real.observed, data=made_block.data))
            for made_block, real in pairs
        )
        # its own run knows too much
        other_runs = [
            run
            for i, run in enumerate(post.histories)
            if not study.costly or i != truths.run[t]
        ]
        answer = answers.answer_of(study, other_runs, made_blocks)
        if study.prior is not None:
            ranks["factor"].append(answer.factor_below(float(truths.factor[t])))
        over = life <= answer.now and answer.drifting is not None
        ranks["life"].append(
            float(rng.random() * answer.passed if over else answer.life_below(life)[0])
        )
        if np.isfinite(life):
            scored.append(
                tuple(
                    scores.scores_of(q, life)
                    for q in (answer.life(scores.EVEN), unmeasured)
                )
            )
        if answer.now < life < np.inf:
            middle = float(answer.life(np.array([0.5]))[0])
            before_any = float(prior.life(np.array([0.5]))[0])
            rules = (
                *scores.simple_rules(study, answer.posterior, answer.now),
                before_any - answer.now,
            )
            foreseen.append((life - answer.now, middle - answer.now, *rules))
    values: dict[str, Any] = {
        f"{name}_rank": rank_values
        for name, rank_values in ranks.items()
        if rank_values
    }
    for name, rank_values in ranks.items():
        off = np.abs(np.array(rank_values) - 0.5)
        values |= {
            f"{name}_coverage_{w}": np.mean(off <= 0.005 * w)
            for w in (50, 90)
            if rank_values
        }
    if scored:
        mine, theirs = np.sum(scored, axis=0)
        values |= dict(
            zip(SKILLS, 1.0 - mine / np.maximum(theirs, 1e-300), strict=True)
        )
    if foreseen:
        rest, *each_rule = np.array(foreseen).T
        for name, told_rest in zip(("", *scores.RULES), each_rule, strict=True):
            if (ok := np.isfinite(told_rest)).any():
                values[f"life_error_{name}".rstrip("_")] = (
                    np.abs(told_rest - rest)[ok].sum() / rest[ok].sum()
                )
    dataset = layout.dataset("twins", values, twin=np.arange(n))
    return dataset if true is None else dataset.assign_attrs(true_model=repr(true))


def _with_power(run: run_curves.RunHistory, power: float) -> run_curves.RunHistory:
    """Return a run whose wear goes as the cycles to a power, and is its own at the last inspection."""
    ends = [float(points.cycle.max()) for points in run.points if len(points.cycle)]
    last = max(ends, default=run.end) - run.start
    share = np.concatenate([np.linspace(0.0, 2.0, 401), np.geomspace(2.1, 1e4, 400)])
    bent = run.start + run.equal(run.start + last * share**power)
    return (
        run
        if power == 1.0
        else replace(run, clock=run_curves.Clock(run.start + last * share, bent))
    )


def _true_blocks(
    post: grids.Posterior, true: update_options.TrueModel
) -> tuple[likelihood.Block, ...]:
    """Return the blocks with the errors that are true of twins."""
    blocks = []
    for block in post.blocks:
        error = (
            block.data.error
            if true.errors is None
            else true.errors[block.data.number - 1]
        )
        observed = replace(
            block.observed, data=block.data.model_copy(update={"error": error})
        )
        blocks.append(replace(block, observed=observed).drifting(True))
    return post.blocks if true.errors is None else tuple(blocks)


def made_twin(
    truth: sampling.Draws, prior: lives.Answer, rng: arrays.Random
) -> tuple[likelihood.Blocks, float]:
    """Return the blocks with made-up values of one truth, and its life.

    Parameters
    ----------
    truth : one draw, with runs and blocks
    prior : the prior, for what drifts on to the limit
    rng : of errors and drift
    """
    post = truth.posterior
    blocks = []
    life = float(truth.life[0])
    run = post.histories[int(truth.run[0])]
    last = [
        run.points[n].cycle[b.rows].max(initial=run.start)
        for n, b in enumerate(post.blocks)
    ]
    last_cycle = float(max(last))
    for number, block in enumerate(post.blocks):
        value, w = sampling.replicated(truth, number, rng, conditional=False)
        values = block.observed.value.copy()
        below = block.observed.below[block.rows]
        values[block.rows] = np.where(
            value[0] < below, np.nan, value[0]
        )  # a file says the limit alone
        blocks.append(replace(block, observed=replace(block.observed, value=values)))
        if number == prior.drifting:
            rate = truth.drift[number] ** 2 / likelihood.PER
            w = w + np.sqrt(rate * (last_cycle - last[number])) * rng.standard_normal(1)
            life = float(
                lives.draw_lives(run, truth.factor, w, last_cycle, rate, rng)[0]
            )
    return tuple(blocks), life


def twin_files(
    campaign: Campaign, truth: dict[str, str | float], seed: int
) -> tuple[dict[Path, str], float]:
    """Return the texts of a campaign's data files as a twin's measurements would be, and the twin's life.

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
    by_column: dict[tuple[object, ...], Observed] = {}  # those of all cases, each once
    for observed in (observed for study in subjects for observed in study.observations):
        by_column.setdefault(
            (observed.data.file, observed.data.columns.value, observed.data.label),
            observed,
        )
    scene = subjects[0].scene.replace(dict(truth))
    measured = tuple(by_column.values())
    run = run_curves.history_of(simulate(scene), scene, measured, subjects[0].limit)
    for number, observed in enumerate(measured):
        if run.points[number].cycle.max(initial=0.0) > run.end:
            raise UpdateError(
                f"{observed.data.file}: goes on beyond the twin's run, {run.end:g} cycles"
            )
    blocks = tuple(
        likelihood.block_of(observed, accumulating=True) for observed in measured
    )
    errors = [
        [
            np.full(1, 0.0 if spread is None else spread.known)
            for spread in (b.sd, b.drift)
        ]
        for b in blocks
    ]
    sd, drift = zip(*errors, strict=True)
    post = grids.Posterior((run,), answers.without_values(blocks), None).with_changes(
        blocks=blocks
    )
    factor = np.full(1, run.factor)
    life = np.full(1, run.limit_cycle)
    true_draw = sampling.Draws(post, np.zeros(1, np.intp), factor, sd, drift, life)
    made_blocks, true_life = made_twin(
        true_draw, lives.Answer(post, run.start, None), np.random.default_rng(seed)
    )
    texts: dict[Path, str] = {}
    for block in made_blocks:
        file = Path(block.data.file)
        texts[file] = _with_values(
            texts.get(file) or file.read_text(encoding="utf-8"), block.observed
        )
    return texts, true_life


def _with_values(text: str, observed: Observed) -> str:
    """Return a file's text with the values of one column replaced."""
    data = observed.data
    column = observed.data.columns.value or observed.data.quantity
    unit = data.units.get(column)
    shown = (
        observed.value
        if unit is None
        else observed.value / units.convert(1.0, unit, data.si)
    )
    table = tables.read_table(Path(data.file))
    at = table.names.index(str(table.find(column)))
    lines = text.splitlines()
    for row, number in zip(observed.row, shown, strict=True):
        cells = lines[row - 1].split(table.separator or None)
        cells[at] = (
            ""
            if np.isnan(number)
            else f"{number:.{DIGITS}g}".replace(".", table.decimal)
        )
        lines[row - 1] = (table.separator or " ").join(cells)
    return "\n".join(lines) + "\n"


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the data files of a twin."""
    parser = argparse.ArgumentParser(
        prog="python -m wearlab.updating.synthetic_data", description=__doc__
    )
    parser.add_argument("file", help="campaign with an [update]")
    parser.add_argument(
        "truth", nargs="*", metavar="KEY=VALUE", help="what is true of the twin"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the errors")
    options = parser.parse_args(arguments)
    truth = {
        key: _number(value)
        for key, _, value in (pair.partition("=") for pair in options.truth)
    }
    texts, life = twin_files(load(options.file), truth, options.seed)
    words = " ".join(f'"{word}"' if " " in word else word for word in options.truth)
    command = (
        f"{MADE}python -m wearlab.updating.synthetic_data {options.file} {words} --seed "
        f"{options.seed}"
    )
    for file, text in texts.items():
        old_lines = [line for line in text.splitlines() if not line.startswith(MADE)]
        head = next(i for i, line in enumerate(old_lines) if not line.startswith("#"))
        new_lines = [
            *old_lines[:head],
            f"{command} (true life: {life:.5g} cycles)",
            *old_lines[head:],
        ]
        file.write_text("\n".join(new_lines) + "\n", encoding="utf-8")
        print(file)


def _number(text: str) -> str | float:
    try:
        return float(text)
    except ValueError:
        return text


if __name__ == "__main__":
    main()
