"""How much of two cores a campaign uses: ``python tests/support/efficiency.py [runs]``,
on a quiet machine.

The same campaign of static lives under drawn torques is run by one worker and by two,
each in a new store, start of the workers included; its cases take about half a second
each, 150 of them more than a minute.
"""

import sys
import tempfile
from pathlib import Path

from scenes import SPUR_50_50

import wearlab

FILE = """
title = "Static lives under drawn torques"
extends = "{base}"
drop = ["dynamics"]

[wear]
load = "static"
until = {{ depth = "20 um", cycles = 1e10 }}
snapshots = {{ cycles = [1e7, 3e7, 1e8] }}

[[sweep]]
sample = {{ method = "sobol", n = {runs}, seed = 1 }}
"operation.torque" = {{ uniform = ["100 N*m", "500 N*m"] }}
"""


def main(runs: int) -> None:
    """Print the time of one worker, of two, and what share of the two was used."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "study.toml"
        seconds = []
        for name, count, workers in (
            ("warm", 2, 2),
            ("one", runs, 1),
            ("two", runs, 2),
        ):
            file.write_text(FILE.format(base=SPUR_50_50, runs=count))
            store = wearlab.Store(Path(folder) / name)
            report = wearlab.run(wearlab.load(file), store, workers=workers)
            assert report.ok and report.computed == count
            seconds.append(report.seconds)
            store.close()
    _, one, two = seconds
    print(
        f"{runs} runs: {one:.1f} s by one worker, {two:.1f} s by two: "
        f"{one / (2 * two):.0%} of two cores"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 150)
