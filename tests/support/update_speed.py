"""How long an update takes once its runs are stored: ``python tests/support/update_speed.py [draws]``.

Six depths against one stored run, and the same with the torque as a second unknown, one stored run a draw.
The runs are made first and not counted; each update is then made anew, imports over, and kept in the store.
CPU time is told beside the clock's, for a machine that is not quiet.
"""

import sys
import tempfile
import time
from pathlib import Path

import wearlab

BASE = Path(__file__).parents[2] / "campaigns" / "base" / "spur_50_50.toml"
DEPTHS = "cycles,depth\n5e7,5.2\n8e7,8.5\n1.1e8,11.3\n1.4e8,14.6\n1.7e8,17.5\n2e8,20.9\n"
FILE = """
title   = "Six depths"
extends = "{base}"
drop    = ["dynamics"]
[mesh]
stiffness        = "potential-energy"
extended_contact = false
[wear]
load          = "static"
contact_patch = "none"
until         = {{ depth = "60 um", flank = "pinion" }}
snapshots     = {{ depth = ["10 um", "20 um", "30 um", "40 um", "50 um"], flank = "pinion" }}
[update]
limit = {{ depth = "30 um", flank = "pinion" }}
draws = {draws}
[update.unknown]
"wear.coefficient.factor" = {{ lognormal = {{ median = 1.0, cov = 14.13 }} }}
{torque}
[[update.data]]
file     = "depths.csv"
quantity = "max_wear_depth"
flank    = "pinion"
columns  = {{ cycle = "cycles", value = "depth" }}
units    = {{ depth = "um" }}
error    = {{ sd = "0.5 um" }}
"""
TORQUE = '"operation.torque" = { normal = { mean = "340 N*m", sd = "17 N*m" } }'
REPEATS = 3


def study(folder: Path, draws: int, torque: str) -> wearlab.Campaign:
    """Return the campaign of one update."""
    (folder / "depths.csv").write_text(DEPTHS)
    file = folder / "study.toml"
    file.write_text(FILE.format(base=BASE.as_posix(), draws=draws, torque=torque))
    return wearlab.load(file)


def answers(campaign: wearlab.Campaign, store: wearlab.Store) -> tuple[float, float]:
    """Return the seconds from stored runs to the answer: posterior, draws, checks; by clock and by CPU."""
    from wearlab.updating.outcome import outcome
    from wearlab.updating.study import histories, studies

    clock, cpu = time.perf_counter(), time.process_time()
    (one,) = studies(campaign)
    outcome(one, *histories(one, store))
    return time.perf_counter() - clock, time.process_time() - cpu


def kept(campaign: wearlab.Campaign, store: wearlab.Store) -> tuple[float, float]:
    """Return the seconds of the whole command: also predictions, virtual inspections, the file."""
    from wearlab.store.updates import kept_updates, update_files

    for name in kept_updates(store):
        update_files(store).path(name).unlink(missing_ok=True)
    clock, cpu = time.perf_counter(), time.process_time()
    wearlab.update(campaign, store, progress=False)
    return time.perf_counter() - clock, time.process_time() - cpu


def main(draws: int) -> None:
    """Print both for one run and for many."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for label, count, torque in (("one stored run", 4000, ""), (f"{draws} stored runs", draws, TORQUE)):
            campaign, store = study(folder, count, torque), wearlab.Store(folder / "store")
            wearlab.update(campaign, store, progress=False)
            for what, measure in (("the answer", answers), ("the whole update, kept", kept)):
                wall, cpu = min(measure(campaign, store) for _ in range(REPEATS))
                print(f"{label}: {what}: {wall:.2f} s, {cpu:.2f} s of CPU", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
