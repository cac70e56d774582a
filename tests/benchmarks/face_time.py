"""How long flanks with a width take: one contact analysis, and the runs of campaigns.

``python tests/benchmarks/face_time.py FILE [FILE …]`` prints for every case of campaign
files whose flanks have a width: the set-up of its gears, nothing of them known; the
contact analysis over 64 phases and 41 slices after it, worn by 5 µm to 10 µm and solved
from unworn loads; a run whose gears are known, and its size on disk. Times are of the
processor.
"""

import statistics
import sys
import tempfile
import time
from pathlib import Path
from unittest.mock import patch

import numpy as np

from wearlab.accuracy.ladder import timing
from wearlab.assembly import build
from wearlab.campaign import load
from wearlab.cli.output import say, show_table
from wearlab.mesh.finite_element import compliance, solid
from wearlab.scene import Scene
from wearlab.simulation import simulate

PHASES, SLICES, DEPTH = 64, 41, 5e-6
HEADS = (
    "campaign",
    "case",
    "set-up",
    "phases × lines × slices",
    "contact analysis",
    "run",
    "stored",
)


def contact_seconds(scene: Scene) -> tuple[str, float]:
    """Return the size of the first kind of mesh and the time of its
    contact analysis [s].
    """
    sliced = scene.replace(
        {"mesh.face_points": SLICES, "numerics.phase_points": PHASES}
    )
    contact = build(sliced).face.kinds[0].contact
    worn = np.full((2, *contact.grid.shape), DEPTH) * (
        1.0 + np.linspace(0.0, 1.0, contact.grid.shape[-1])
    )
    phases, lines, slices = contact.unworn.load.shape
    seconds = timing(lambda: contact.solve(worn, contact.unworn), max_repetitions=30)
    return f"{phases} × {lines} × {slices}", seconds * PHASES / phases


def setup_seconds(scene: Scene) -> float:
    """Return the time in which gears of which nothing is kept are set up [s]."""
    for forgotten in (solid._remembered, compliance._remembered):
        forgotten.cache_clear()
    with (
        tempfile.TemporaryDirectory() as folder,
        patch.object(solid, "cache_folder", lambda: Path(folder)),
    ):
        begun = time.process_time()
        build(scene)
        return time.process_time() - begun


def run_seconds(scene: Scene) -> tuple[float, int]:
    """Return the time of a run whose kernels and teeth are there [s],
    and its size on disk [bytes].
    """
    begun = time.process_time()
    run = simulate(scene)
    seconds = time.process_time() - begun
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "run.nc"
        run.to_netcdf(file)
        return seconds, file.stat().st_size


def main(files: list[str]) -> None:
    """Print the table, and medians of static and of coupled runs."""
    rows = []
    static = []
    coupled = []
    for file in files:
        for case in load(file).cases:
            if not case.scene.face_keys:
                continue
            simulate(case.scene)
            setup = setup_seconds(case.scene)
            size, contact = contact_seconds(case.scene)
            seconds, stored = run_seconds(case.scene)
            (static if case.scene.dynamics is None else coupled).append(seconds)
            told = (
                f"{1e3 * contact:.1f} ms",
                f"{seconds:.1f} s",
                f"{stored / 1e6:.1f} MB",
            )
            rows.append((Path(file).stem, case.label, f"{setup:.1f} s", size, *told))
    show_table(HEADS, rows, title="Flanks with a width")
    for name, some in (("static", static), ("coupled", coupled)):
        if some:
            say(
                f"{name} runs: median {statistics.median(some):.1f} s, longest "
                f"{max(some):.1f} s"
            )


if __name__ == "__main__":
    main(sys.argv[1:])
