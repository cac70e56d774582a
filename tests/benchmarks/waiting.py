"""The time that people wait, beside that of another commit: a table to print.

``python tests/benchmarks/waiting.py [--against COMMIT] [--only ROW ...] [--quick]
[--repeat 3] [--write FILE.json]`` measures the rows of ``waiting_rows.py``, those that
take minutes left out if quick. Every measurement is a process of its own, and both
commits take turns. Medians are printed, and how many times the other commit's time this
one takes. The other commit is cloned beside the compiled kernels (``WEARLAB_CACHE``),
which it has of its own; a folder with a checkout may be named instead. Races need CyRK,
the hundred runs joblib; what is missing is said. Benchmarks need a quiet machine.
"""

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from waiting_rows import ROWS

from wearlab.files import cache_folder

HERE = Path(__file__).parents[2]
HEADS = ("row", "measured", "before", "now", "now over before")
THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
)


class Checkout(NamedTuple):
    """The package at a commit.

    Parameters
    ----------
    folder : with `wearlab`, `campaigns` and `tests`
    kernels : folder of its compiled kernels
    """

    folder: Path
    kernels: Path


class Measured(NamedTuple):
    """One number of a row.

    Parameters
    ----------
    row, quantity : what was measured, with its unit
    before, now : of every turn; none where there is no other commit, or it cannot run
    """

    row: str
    quantity: str
    before: list[float]
    now: list[float]


def checkout_of(commit: str) -> Checkout:
    """Return a folder with a checkout as it is, or a clone of a commit."""
    if Path(commit).is_dir():
        folder = Path(commit).resolve()
        return Checkout(folder, folder / ".cache")
    name = git("rev-parse", "--short", f"{commit}^{{commit}}").strip()
    place = cache_folder() / "waiting" / name
    clone = place / "wearlab"
    if not clone.exists():
        git("clone", "--quiet", "--no-checkout", str(HERE), str(clone))
    git("-C", str(clone), "checkout", "--quiet", "--force", name)
    return Checkout(clone, place / "kernels")


def git(*arguments: str) -> str:
    """Return what git answers in this checkout."""
    command = ["git", *arguments]
    return subprocess.run(
        command, check=True, cwd=HERE, stdout=subprocess.PIPE, text=True
    ).stdout


def times(row: str, checkout: Checkout) -> dict[str, float]:
    """Return the times of a row in a process of its own; none where it fails."""
    checkout.kernels.mkdir(parents=True, exist_ok=True)
    paths = [str(checkout.folder), os.environ.get("PYTHONPATH", "")]
    environment = os.environ | dict.fromkeys(THREADS, "1")
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, paths))
    environment["WEARLAB_CACHE"] = str(checkout.kernels)
    script = Path(__file__).with_name("waiting_rows.py")
    done = subprocess.run(
        [sys.executable, str(script), row, str(checkout.folder)],
        env=environment,
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:
        reason = done.stderr.strip().splitlines()[-1:]
        print(f"{row} in {checkout.folder}:", *reason, file=sys.stderr, flush=True)
        return {}
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def measure(
    row: str, now: Checkout, before: Checkout | None, turns: int
) -> list[Measured]:
    """Return the numbers of a row, both commits in turns."""
    found_now = []
    found_before = []
    for _ in range(turns):
        if before is not None:
            found_before.append(times(row, before))
        found_now.append(times(row, now))
    quantities = {name: None for found in found_now for name in found}
    return [
        Measured(
            row,
            quantity,
            [found[quantity] for found in found_before if quantity in found],
            [found[quantity] for found in found_now if quantity in found],
        )
        for quantity in quantities
    ]


def line(found: Measured) -> tuple[str, ...]:
    """Return medians and their ratio as a line of the table."""
    now = statistics.median(found.now)
    if not found.before:
        return (found.row, found.quantity, "", f"{now:.4g}", "")
    before = statistics.median(found.before)
    return (
        found.row,
        found.quantity,
        f"{before:.4g}",
        f"{now:.4g}",
        f"{now / before:.3f}",
    )


def text(cells: Sequence[str]) -> str:
    """Return a line in Markdown."""
    return f"| {' | '.join(cells)} |"


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print the table and keep the numbers in a file where one is named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--against", metavar="COMMIT")
    parser.add_argument("--only", nargs="+", choices=ROWS, metavar="ROW")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--write", type=Path, metavar="FILE.json")
    options = parser.parse_args(arguments)
    rows = options.only or [
        name for name, row in ROWS.items() if not (options.quick and row.long)
    ]
    now = Checkout(HERE, cache_folder())
    before = checkout_of(options.against) if options.against else None
    print(text(HEADS), text(["---"] * len(HEADS)), sep="\n", flush=True)
    everything = []
    for row in rows:
        measured = measure(row, now, before, options.repeat)
        everything += measured
        for found in measured:
            print(text(line(found)), flush=True)
    if options.write:
        report = {
            "date": datetime.now(UTC).date().isoformat(),
            "machine": f"{platform.machine()}, {os.cpu_count()} cores",
            "commit": git("rev-parse", "HEAD").strip(),
            "against": options.against,
            "measured": [found._asdict() for found in everything],
        }
        options.write.write_text(json.dumps(report, indent=1) + "\n")


if __name__ == "__main__":
    main()
