"""Measurements of a synthetic twin: ``python -m wearlab.updating.twins FILE KEY=VALUE… [--seed N]``.

The campaign is run with the values given as the truth, and in every data file the values are replaced by what
would have been measured there: the run's own, with errors drawn as the campaign says they are. Cycles and
places stay as the files have them, which so may hold zeros to begin with.
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from wearlab.campaign import Campaign, load
from wearlab.tables import read_table
from wearlab.units import convert
from wearlab.updating.history import StoredRun, history_of
from wearlab.updating.likelihood import block_of
from wearlab.updating.observations import Observed, UpdateError
from wearlab.updating.study import studies
from wearlab.updating.validation import Truth, synthetic

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

    cases = studies(campaign)
    blocks: dict[tuple[object, ...], Observed] = {}  # those of all cases, each once
    for block in (block for study in cases for block in study.seen):
        blocks.setdefault((block.data.file, block.data.columns.value, block.data.label), block)
    scene = cases[0].scene
    for key, true in truth.items():
        scene = scene.replace(key, true)
    measured = tuple(blocks.values())
    run = history_of(StoredRun.of(simulate(scene)), "twin", scene.model_dump(), measured, cases[0].limit)
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
