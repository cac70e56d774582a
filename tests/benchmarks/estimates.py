"""Are the error estimates of runs honest? Drawn scenes, each run beside a tight
reference.

``python tests/benchmarks/estimates.py --seed N [--scenes 300] [--workers N] OUT`` draws
scenes: of 25, seven spur pairs, six internal pairs, six planetary sets in motion, which
have errors, and six gears of any kind with a face.
What each run estimates of its own errors is set beside its errors against a reference
to 1e-5; ``estimates.csv``, ``estimates.nc`` and ``estimates.png`` go to the folder OUT.
Rows are kept one by one: cut off, the command prints what it has; asked again, it goes
on where it was, unless wearlab's sources have changed. Its status is 1 where something
promised is not kept.
"""

import argparse
import sys
import time
from math import isfinite
from pathlib import Path
from typing import NamedTuple

import estimate_rows
import estimate_table
from drawn_scenes import draw_any
from estimate_figure import scores_png

from wearlab.accuracy.study import netcdf
from wearlab.cli.output import bar, complain, say, show_table
from wearlab.simulation.label import provenance
from wearlab.store.files import write_whole

TABLE, DATASET, FIGURE = "estimates.csv", "estimates.nc", "estimates.png"
KEPT = (
    "model_version",
    "source",
    "source_hash",
    "packages",
    "machine",
    "commit",
    "dirty",
)


def main(words: list[str] | None = None) -> int:
    """Score the scenes that are asked for.

    Print tables, store the dataset and draw the figure.
    """
    given = read(words)
    asked = estimate_rows.Asked(*given[:4])
    out = given.out
    begun = time.time()
    out.mkdir(parents=True, exist_ok=True)
    made_by = provenance(draw_any(asked.seed, 0), begun)
    source = made_by["source_hash"]
    try:
        with bar(asked.scenes) as tell:
            rows = estimate_rows.run(asked, source, out / TABLE, given.workers, tell)
    except KeyboardInterrupt:
        rows = estimate_rows.done(asked, source, out / TABLE)
        complain(
            f"cut off after {len(rows)} of {asked.scenes} scenes: the same command "
            "goes on from there"
        )
        if not rows:
            raise
    tell_scores(asked, rows)
    attributes = {key: made_by[key] for key in KEPT if key in made_by}
    made = estimate_table.dataset(asked.seed, rows, attributes, begun)
    images = {DATASET: netcdf(made), FIGURE: scores_png(estimate_table.scores_of(rows))}
    for name, image in images.items():
        write_whole(out / name, image)
    files = [out / name for name in images]
    for path in (out / TABLE, *files):
        say(str(path))
    missed = estimate_table.missed(rows)
    for line in missed:
        complain(line)
    return 1 if missed else 0


def tell_scores(asked: estimate_rows.Asked, rows: list[estimate_rows.Row]) -> None:
    """Print the tables."""
    show_table(
        estimate_table.SCORE_HEADS,
        estimate_table.score_rows(rows),
        title="Error estimates",
    )
    if apart := estimate_table.apart_rows(rows):
        say()
        show_table(
            estimate_table.APART_HEADS,
            apart,
            title=f"Scenes without a score, of {len(rows)}",
        )
    median, largest = estimate_table.costs(rows)
    share = (
        f"{median:.0%} in the median and at most {largest:.0%}"
        if isfinite(median)
        else "nothing known"
    )
    say(f"\nestimates add {share} to the time of a run")
    say(
        f"a run may take {asked.longest:g} s, its reference "
        f"{asked.longest_reference:g} s\n"
    )


class Given(NamedTuple):
    """What the command line says."""

    scenes: int
    seed: int
    longest: float
    longest_reference: float
    workers: int | None
    out: Path


def read(words: list[str] | None) -> Given:
    """Read the command line; what is wrong ends with status 2."""
    reader = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = reader.add_argument
    add(
        "--seed",
        type=natural,
        required=True,
        help="the same seed draws the same scenes",
    )
    add("--scenes", type=positive, default=300, help="how many are drawn [300]")
    add(
        "--longest",
        type=seconds,
        default=60.0,
        help="processor time after which a run is given up [60 s]",
    )
    add(
        "--longest-reference",
        type=seconds,
        default=60.0,
        help="and its reference, once more to 1e-4 [60 s]",
    )
    add("--workers", type=positive, help="processes [the cores]")
    add("out", type=Path, metavar="OUT", help="folder of table, dataset and figure")
    return Given(**vars(reader.parse_args(words)))


def natural(text: str) -> int:
    """Return a whole number from 0 on."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text} is not a whole number from 0 on")
    return int(text)


def positive(text: str) -> int:
    """Return a whole number from 1 on."""
    if natural(text) == 0:
        raise argparse.ArgumentTypeError("0 is not a whole number from 1 on")
    return int(text)


def seconds(text: str) -> float:
    """Return a time greater than 0 [s]."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not value > 0.0:
        raise argparse.ArgumentTypeError(f"{text} is no time in seconds")
    return value


if __name__ == "__main__":
    sys.exit(main())
