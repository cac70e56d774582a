"""Synthetic twins: measurements made up from a known truth, and how often intervals hold it.

Truths are drawn from the prior, measurements from the model with its errors; each twin is updated as the real
data are. The probability that a posterior gives to less than the truth is then uniform (Talts et al. 2018,
arXiv:1804.06788), and an interval holds the truth as often as it says.

``python -m wearlab.updating.twins FILE KEY=VALUE… [--seed N]`` writes the data files of one twin: the
campaign is run with the values given as the truth, and in every data file the values are replaced by what
would have been measured there. Cycles and places stay as the files have them, which so may hold zeros.
"""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.campaign import Campaign, load
from wearlab.campaign.update_options import PREVIOUS, TrueModel
from wearlab.tables import read_table
from wearlab.units import convert
from wearlab.updating.draws import Draws, drawn
from wearlab.updating.layout import dataset
from wearlab.updating.likelihood import PER, Block, block_of, inspections_of, modelled
from wearlab.updating.lives import Answer, passage_time, present_state
from wearlab.updating.measurements import Observed, UpdateError
from wearlab.updating.outcome import answered, unseen
from wearlab.updating.posterior import Posterior
from wearlab.updating.run_curves import Clock, RunHistory, history_of, variables_of
from wearlab.updating.scores import EVEN, crps
from wearlab.updating.study import MeasuredCase, studies

MADE = "# Made by: "
DIGITS = 5


class Truth(NamedTuple):
    """What measurements are made up from: factor, and sd of a value and of the wear in `PER` cycles [SI]."""

    factor: float
    sd: float
    drift: float


def calibrated(
    study: MeasuredCase, post: Posterior, n: int, *, told: Sequence[Block] | None = None
) -> xr.Dataset:
    """Return the ranks of the truths of synthetic twins, and how often intervals hold them.

    Parameters
    ----------
    study, post : the study and its posterior: runs, blocks, prior
    n : number of twins
    told : the errors that the twins are updated with, where they are to be wrong [those they are made with]
    """
    rng, true, source = np.random.default_rng([study.spec.seed, 2]), study.spec.check, post
    if true is not None:
        runs = tuple(_bent(run, true.power) for run in post.histories)
        source, told = replace(post, histories=runs, blocks=_true_blocks(post, true)), told or post.blocks
    before = answered(study, source.histories, unseen(source.blocks), post.log_proposal)
    truths, unmeasured = drawn(before, n, rng), before.life(EVEN)
    ranks: dict[str, list[float]] = {"factor": [], "life": []}
    scores: list[tuple[float, float]] = []
    for t in range(n):
        made, life = twin(source, truths, t, before, rng)
        made = tuple(
            replace(believed, seen=replace(real.seen, data=believed.data))
            for believed, real in zip(told or made, made, strict=True)
        )
        kept = np.ones(len(post.histories), bool)
        kept[truths.run[t]] = not study.costly  # its own run knows too much
        runs = tuple(run for run, held in zip(post.histories, kept, strict=True) if held)
        answer = answered(study, runs, made, post.log_proposal[kept])
        if study.prior is not None:
            ranks["factor"].append(answer.factor_below(float(truths.factor[t])))
        over = life <= answer.now and answer.drifting is not None
        ranks["life"].append(float(rng.random() * answer.passed if over else answer.life_below(life)[0]))
        if np.isfinite(life):
            scores.append((crps(answer.life(EVEN), life), crps(unmeasured, life)))
    values: dict[str, Any] = {f"{name}_rank": each for name, each in ranks.items() if each}
    for name, each in ranks.items():
        off = np.abs(np.array(each) - 0.5)
        values |= {f"{name}_coverage_{w}": np.mean(off <= 0.005 * w) for w in (50, 90) if each}
    if scores:
        mine, theirs = np.sum(scores, axis=0)
        values["life_skill"] = 1.0 - float(mine / max(theirs, 1e-300))
    found = dataset("twins", values, twin=np.arange(n))
    return found if true is None else found.assign_attrs(true_model=repr(true))


def _bent(run: RunHistory, power: float) -> RunHistory:
    """Return a run whose wear goes as the cycles to a power, and is its own at the last inspection."""
    ends = [float(asked.cycle.max()) for asked in run.asked if len(asked.cycle)]
    last = max(ends, default=run.end) - run.start
    share = np.concatenate([np.linspace(0.0, 2.0, 401), np.geomspace(2.1, 1e4, 400)])
    bent = run.start + run.equal(run.start + last * share**power)
    return run if power == 1.0 else replace(run, clock=Clock(run.start + last * share, bent))


def _true_blocks(post: Posterior, true: TrueModel) -> tuple[Block, ...]:
    """Return the blocks with the errors that are true of twins."""
    made = []
    for block in post.blocks:
        error = block.data.error if true.errors is None else true.errors[block.data.number - 1]
        seen = replace(block.seen, data=replace(block.data, error=error))
        made.append(replace(block_of(seen, accumulating=True), rows=block.rows, numerical=block.numerical))
    return post.blocks if true.errors is None else tuple(made)


def twin(
    post: Posterior, truths: Draws, t: int, before: Answer, rng: np.random.Generator
) -> tuple[tuple[Block, ...], float]:
    """Return the blocks with made-up values of one truth, and its life.

    Parameters
    ----------
    post : for its runs and blocks
    truths : draws from the prior
    t : which of them
    before : the prior, for what drifts on to the limit
    rng : of errors and drift
    """
    run = post.histories[int(truths.run[t])]
    factor = truths.factor[t : t + 1]
    made, life = [], float(run.life(factor)[0])
    now = max((float(run.asked[n].cycle[b.rows].max()) for n, b in enumerate(post.blocks) if len(b.rows)))
    for number, block in enumerate(post.blocks):
        drift = float(truths.drift[number][t])
        truth = Truth(float(factor[0]), float(truths.sd[number][t]), drift)
        value, w, last = synthetic(block, run, number, truth, rng)
        values = block.seen.value.copy()
        values[block.rows] = value
        made.append(replace(block, seen=replace(block.seen, value=values)))
        if number == before.drifting and drift > 0.0:
            rate = np.array([drift**2 / PER])
            w += float(np.sqrt(rate[0] * (now - last)) * rng.standard_normal())
            life = now + float(passage_time(*present_state(run, factor, np.array([w]), now), rate, rng)[0])
    return tuple(made), life


def synthetic(
    block: Block, run: RunHistory, number: int, truth: Truth, rng: np.random.Generator
) -> tuple[Array, float, float]:
    """Return values in place of those that count, how far the wear had strayed at the last, and when.

    A value below its limit of detection is NaN.

    Parameters
    ----------
    block, run, number : what is measured, the run that is the truth, the block's place
    truth : what the run and its errors are
    rng : of the errors
    """
    error, rows, since = block.data.error, block.rows, block.data.since
    model = modelled(block, run, number, np.array([truth.factor]))[0]
    model = model * (1.0 + error.gain_sd * rng.standard_normal() if error.gain_sd else 1.0)
    spread = np.sqrt(truth.sd**2 + block.seen.sd[rows] ** 2 + (block.relative * model) ** 2)
    value = model + spread * rng.standard_normal(len(rows))
    last, strayed = float(since) if isinstance(since, float) else run.begin(number), 0.0
    for inspection in inspections_of(block, run, number):
        step = np.sqrt(truth.drift**2 / PER * (inspection.cycle - last)) * rng.standard_normal()
        strayed = step if since == PREVIOUS else strayed + step
        value[inspection.values] += strayed + error.offset_sd * rng.standard_normal()
        last = inspection.cycle
    hidden = value < block.seen.below[rows]  # of which a file says no more than the limit of detection
    return np.where(hidden, np.nan, value), float(strayed), last


def twin_files(
    campaign: Campaign, truth: Mapping[str, str | float], seed: int
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

    cases = studies(campaign)
    blocks: dict[tuple[object, ...], Observed] = {}  # those of all cases, each once
    for block in (block for study in cases for block in study.seen):
        blocks.setdefault((block.data.file, block.data.columns.value, block.data.label), block)
    scene = cases[0].scene
    for key, true in truth.items():
        scene = scene.replace(key, true)
    measured = tuple(blocks.values())
    run = history_of(variables_of(simulate(scene)), "twin", scene.model_dump(), measured, cases[0].limit)
    rng = np.random.default_rng(seed)
    texts: dict[Path, str] = {}
    for number, seen in enumerate(measured):
        if run.asked[number].cycle.max(initial=0.0) > run.end:
            raise UpdateError(f"{seen.data.file}: goes on beyond the twin's run, {run.end:g} cycles")
        own = block_of(seen, accumulating=True)
        drift = 0.0 if own.drift is None else own.drift.known
        value, _, _ = synthetic(own, run, number, Truth(run.factor, own.sd.known, drift), rng)
        file = Path(seen.data.file)
        texts[file] = _with(texts.get(file, file.read_text(encoding="utf-8")), seen, value)
    return texts, float(run.limit_cycle)


def _with(text: str, seen: Observed, value: np.ndarray) -> str:
    """Return a file's text with the values of one column replaced."""
    data = seen.data
    column = data.columns.value or data.quantity
    own = data.units.get(column)
    shown = value if own is None else value / convert(1.0, own, data.si)
    table = read_table(Path(data.file))
    at = table.names.index(str(table.find(column)))
    lines = text.splitlines()
    for row, number in zip(seen.row, shown, strict=True):
        cells = lines[row - 1].split(table.separator or None)
        cells[at] = "" if np.isnan(number) else f"{number:.{DIGITS}g}".replace(".", table.decimal)
        lines[row - 1] = (table.separator or " ").join(cells)
    return "\n".join(lines) + "\n"


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the data files of a twin."""
    parser = argparse.ArgumentParser(prog="python -m wearlab.updating.twins", description=__doc__)
    parser.add_argument("file", help="campaign with an [update]")
    parser.add_argument("truth", nargs="*", metavar="KEY=VALUE", help="what is true of the twin")
    parser.add_argument("--seed", type=int, default=0, help="of the errors")
    given = parser.parse_args(arguments)
    truth = {key: _number(value) for key, _, value in (pair.partition("=") for pair in given.truth)}
    texts, life = twin_files(load(given.file), truth, given.seed)
    words = " ".join(f'"{word}"' if " " in word else word for word in given.truth)
    made = f"{MADE}python -m wearlab.updating.twins {given.file} {words} --seed {given.seed}"
    for file, text in texts.items():
        kept = [line for line in text.splitlines() if not line.startswith(MADE)]
        head = next(i for i, line in enumerate(kept) if not line.startswith("#"))
        told = [*kept[:head], f"{made} (true life: {life:.5g} cycles)", *kept[head:]]
        file.write_text("\n".join(told) + "\n", encoding="utf-8")
        print(file)


def _number(text: str) -> str | float:
    try:
        return float(text)
    except ValueError:
        return text


if __name__ == "__main__":
    main()
