"""What one static run costs: ``python tests/support/run_cost.py [runs] [coefficient]
[profile]``.

Runs of a spur pair under torques, or with wear coefficients, of a list, one after the
other in one process. Prints medians of processor time [ms]: simulation, file and
description of every other run; of the others all of a run, and the store's part.
"""

import cProfile
import json
import pstats
import statistics
import sys
import tempfile
import time
from pathlib import Path

from scenes import SPUR_50_50

import wearlab
from wearlab.runner.worker import Task, execute
from wearlab.store import Store

FILE = """
title = "Static runs"
extends = "{base}"
drop = ["dynamics"]
[wear]
load = "static"
[[sweep]]
{swept}
"""
TORQUES = '"operation.torque" = {{ linspace = [100.0, 300.0, {runs}], unit = "N*m" }}'
COEFFICIENTS = (
    '"wear.coefficient.value" = {{ linspace = [1e-19, 1e-18, {runs}], unit = "m^2/N" }}'
)


def scenes(runs: int):
    """Return the cases of the campaign."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "study.toml"
        swept = COEFFICIENTS if "coefficient" in sys.argv else TORQUES
        file.write_text(
            FILE.format(base=SPUR_50_50.as_posix(), swept=swept.format(runs=runs))
        )
        return wearlab.load(file).cases


def measured(runs: int) -> dict[str, float]:
    """Return the median processor time of the parts of a run [ms], and bytes."""
    from wearlab.simulation import simulate
    from wearlab.store.description import describe
    from wearlab.store.netcdf import to_image

    cases = scenes(2 * runs + 4)
    parts: dict[str, list[float]] = {}

    def timed(name, act):
        begun = time.process_time()
        made = act()
        parts.setdefault(name, []).append(1e3 * (time.process_time() - begun))
        return made

    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder) / "store")
        store.archive.create()
        with store.archive.presence() as here:
            for case, other in zip(cases[::2], cases[1::2], strict=True):
                store.archive.claim([case.id], here.token, lambda entry: False)
                data = timed("simulate", lambda case=case: simulate(case.scene))
                image, _ = timed("file", lambda data=data: to_image(data))
                timed("describe", lambda data=data: describe(data))
                outcome = timed(
                    "whole run",
                    lambda other=other: execute(Task(other.id, other.scene)),
                )
                timed(
                    "save",
                    lambda outcome=outcome: store.archive.save([outcome], here.token),
                )
        size = store.archive.catalogue.path.stat().st_size
    found = {name: statistics.median(values[2:]) for name, values in parts.items()}
    return found | {
        "bytes of the file": len(image),
        "bytes of the catalogue a run": 2 * size / len(cases),
    }


def profiled(runs: int) -> None:
    """Print where the time of some runs goes."""
    cases = scenes(runs + 2)
    for case in cases[:2]:
        execute(Task(case.id, case.scene))
    profile = cProfile.Profile(time.process_time)
    profile.enable()
    for case in cases[2:]:
        execute(Task(case.id, case.scene))
    profile.disable()
    pstats.Stats(profile).sort_stats("cumtime").print_stats(110)


if __name__ == "__main__":
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 30
    if "profile" in sys.argv:
        profiled(runs)
    else:
        print(
            json.dumps(
                {name: round(value, 2) for name, value in measured(runs).items()}
            )
        )
