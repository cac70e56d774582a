"""Measurements of a synthetic twin: ``python -m wearlab.updating.twins FILE KEY=VALUE… [--seed N]``.

The campaign is run with the values given as the truth, and in every data file the values are replaced by what
would have been measured there: the run's own, with errors drawn as the campaign says they are. Cycles and
places stay as the files have them, which so may hold zeros to begin with.
"""

import argparse
import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from wearlab.campaign import Campaign, load
from wearlab.units import convert
from wearlab.updating.errors import UpdateError
from wearlab.updating.history import history_of
from wearlab.updating.likelihood import block_of
from wearlab.updating.making import Truth, made_up
from wearlab.updating.observations import Observed
from wearlab.updating.stored import StoredRun
from wearlab.updating.study import MeasuredCase, studies

MADE = "# Made by: "
DIGITS = 5


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

    study = _whole(studies(campaign))
    scene = study.scene
    for key, true in truth.items():
        scene = scene.replace(key, true)
    run = history_of(StoredRun.of(simulate(scene)), "twin", scene.model_dump(), study.seen, study.limit)
    rng = np.random.default_rng(seed)
    texts: dict[Path, str] = {}
    for number, seen in enumerate(study.seen):
        if run.asked[number].cycle.max(initial=0.0) > run.end:
            raise UpdateError(f"{seen.data.file}: goes on beyond the twin's run, {run.end:g} cycles")
        block = block_of(seen, accumulating=True)
        drift = 0.0 if block.drift is None else block.drift.known
        truth_of_block = Truth(run.factor, block.sd.known, drift)
        value, _, _ = made_up(block, run, number, truth_of_block, rng)
        file = Path(seen.data.file)
        texts[file] = _with(texts.get(file, file.read_text(encoding="utf-8")), seen, value)
    return texts, float(run.limit_cycle)


def _whole(sample: Sequence[MeasuredCase]) -> MeasuredCase:
    """Return a study with the data of all cases, each block once."""
    seen: dict[tuple[object, ...], Observed] = {}
    for study in sample:
        for block in study.seen:
            seen.setdefault((block.data.file, block.data.columns.value, block.data.label), block)
    first = sample[0]
    return MeasuredCase(first.label, first.scene, first.spec, first.limit, tuple(seen.values()), {})


def _with(text: str, seen: Observed, value: np.ndarray) -> str:
    """Return a file's text with the values of one column replaced."""
    data = seen.data
    column = data.columns.value or data.quantity
    own = data.units.get(column)
    shown = value if own is None else value / convert(1.0, own, data.si)
    lines = text.splitlines()
    head = next(i for i, line in enumerate(lines) if line.strip() and not line.startswith("#"))
    at = next(csv.reader([lines[head]])).index(column)
    for row, number in zip(seen.row, shown, strict=True):
        cells = next(csv.reader([lines[row - 1]]))
        cells[at] = "" if np.isnan(number) else f"{number:.{DIGITS}g}"
        written = io.StringIO()
        csv.writer(written, lineterminator="").writerow(cells)
        lines[row - 1] = written.getvalue()
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
