"""How long an update takes once its runs are stored: ``update_speed.py [draws
[readings]]``.

Six depths against one stored run, the same with the torque as a second unknown, one
stored run a draw; a million depths with each kind of independent errors, and a hundred
units with ten inspections each. The runs are made first and not counted; each update is
then made anew, imports over, and kept in the store. CPU time is told beside the
clock's, for a machine that is not quiet.
"""

import sys
import tempfile
import time
from collections.abc import Callable
from itertools import zip_longest
from pathlib import Path

import numpy as np
from scenes import SPUR_50_50

import wearlab

DEPTHS = (
    "cycles,depth\n5e7,5.2\n8e7,8.5\n1.1e8,11.3\n1.4e8,14.6\n1.7e8,17.5\n2e8,20.9\n"
)
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
[wear.snapshots]
depth = ["10 um", "20 um", "30 um", "40 um", "50 um"]
flank = "pinion"
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
error    = {{ {error} }}
"""
TORQUE = '"operation.torque" = { normal = { mean = "340 N*m", sd = "17 N*m" } }'
ERRORS = {
    "known": 'sd = "0.5 um"',
    "unknown": 'sd = { lognormal = { median = "0.5 um", cov = 0.5 } }',
    "relative": 'sd = "0.5 um", relative = 0.01',
    "gain": 'sd = "0.5 um", gain_sd = 0.1',
}
FLEET = """
title   = "A hundred units"
extends = "{base}"
[update]
limit    = {{ depth = "30 um", flank = "pinion" }}
calendar = {{ date = "2026-06-30", hours_per_year = 6000 }}
[update.unknown]
"wear.coefficient.factor" = {{ lognormal = {{ median = 1.0, cov = 1.0 }} }}
[[update.data]]
file     = "units.csv"
quantity = "max_wear_depth"
flank    = "pinion"
columns  = {{ unit = "unit", cycle = "cycles", value = "depth" }}
units    = {{ depth = "um" }}
error    = {{ sd = "0.5 um" }}
"""
REPEATS = 3


def study(
    folder: Path, draws: int, torque: str, error: str = "known", depths: str = DEPTHS
) -> wearlab.Campaign:
    """Return the campaign of one update."""
    (folder / "depths.csv").write_text(depths)
    file = folder / "study.toml"
    file.write_text(
        FILE.format(
            base=SPUR_50_50.as_posix(), draws=draws, torque=torque, error=ERRORS[error]
        )
    )
    return wearlab.load(file)


def worn(
    campaign: wearlab.Campaign, store: wearlab.Store, equal: np.ndarray
) -> np.ndarray:
    """Return the depth of the stored run after cycles [um]."""
    from wearlab.updating.cases import histories, studies

    return 1e6 * histories(studies(campaign)[0], store)[0].limit.at(equal)


def readings(campaign: wearlab.Campaign, store: wearlab.Store, count: int) -> str:
    """Return a table of so many depths of a gear that wears 1.1 times
    as fast as the run.
    """
    rng = np.random.default_rng(0)
    cycle = np.sort(rng.uniform(0.0, 2e8, count))
    depth = worn(campaign, store, 1.1 * cycle) + 0.5 * rng.standard_normal(count)
    rows = "\n".join(f"{c:.1f},{d:.4f}" for c, d in zip(cycle, depth, strict=True))
    return f"cycles,depth\n{rows}\n"


def fleet(
    folder: Path, campaign: wearlab.Campaign, store: wearlab.Store
) -> wearlab.Campaign:
    """Return the campaign of a hundred units with ten inspections each."""
    rng = np.random.default_rng(0)
    rows = ["unit,cycles,depth"]
    for unit in range(100):
        cycle = np.sort(rng.uniform(2e7, 2e8, 10))
        depth = worn(campaign, store, np.exp(0.2 * rng.standard_normal()) * cycle)
        depth += 0.5 * rng.standard_normal(10)
        rows += [f"U{unit},{c:.1f},{d:.4f}" for c, d in zip(cycle, depth, strict=True)]
    (folder / "units.csv").write_text("\n".join(rows))
    file = folder / "fleet.toml"
    base = folder / "study.toml"
    base.write_text(base.read_text().partition("[update]")[0])
    file.write_text(FLEET.format(base=base.as_posix()))
    return wearlab.load(file)


def answers(campaign: wearlab.Campaign, store: wearlab.Store) -> tuple[float, float]:
    """Return the seconds from stored runs to the answer: posterior, draws, checks.

    By clock and by CPU.
    """
    from wearlab.updating.answers import outcome_of
    from wearlab.updating.cases import histories, studies

    clock = time.perf_counter()
    cpu = time.process_time()
    (one,) = studies(campaign)
    outcome_of(one, histories(one, store))
    return time.perf_counter() - clock, time.process_time() - cpu


def kept(campaign: wearlab.Campaign, store: wearlab.Store) -> tuple[float, float]:
    """Return the seconds of the whole command: also predictions,
    virtual inspections, the file.
    """
    from wearlab.store.updates import kept_updates, update_files

    for name in kept_updates(store):
        update_files(store).path(name).unlink(missing_ok=True)
    clock = time.perf_counter()
    cpu = time.process_time()
    wearlab.update(campaign, store, progress=False)
    return time.perf_counter() - clock, time.process_time() - cpu


def main(draws: int, count: int) -> None:
    """Print them all."""

    def told(
        what: str, measure: Callable[..., tuple[float, float]], repeats: int = REPEATS
    ) -> None:
        wall, cpu = min(measure(campaign, store) for _ in range(repeats))
        print(f"{what}: {wall:.2f} s, {cpu:.2f} s of CPU", flush=True)

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for label, many, torque in (
            ("one stored run", 4000, ""),
            (f"{draws} stored runs", draws, TORQUE),
        ):
            campaign = study(folder, many, torque)
            store = wearlab.Store(folder / "store")
            wearlab.update(campaign, store, progress=False)
            told(f"{label}: the answer", answers)
            told(f"{label}: the whole update, kept", kept)
        table = readings(study(folder, 4000, ""), store, count)
        for error in ERRORS:
            campaign = study(folder, 4000, "", error, table)
            told(f"{count} depths, error {error}: the whole update, kept", kept, 1)
        campaign = fleet(folder, study(folder, 4000, ""), store)
        told("100 units, 10 inspections each: the whole update, kept", kept, 1)


if __name__ == "__main__":
    main(
        *(
            int(float(given or usual))
            for given, usual in zip_longest(sys.argv[1:], ("1000", "1e6"))
        )
    )
