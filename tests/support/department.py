"""Twelve gearboxes with dates, loads, weighings: ``python tests/support/department.py``
writes their files.

The truth of each is a real run with its loads as stages and a coefficient of its own;
weighings are read off it with errors. G06's last weighing was written down 1.8 times
too high; G12 was never weighed.
"""

import sys
from datetime import date, timedelta
from itertools import pairwise
from pathlib import Path

import numpy as np
from scenes import CAMPAIGNS

import wearlab as wl

END = date(2026, 6, 30)
SD, SPREAD, LIMIT = 12.0, 0.3, 60e-6
RPM = 900
HEAVY, LIGHT, USUAL = 220, 140, 180
NAMES = [f"G{n:02d}" for n in range(1, 13)]
STOPS = (date(2024, 8, 1), date(2025, 8, 1))  # two weeks each


def record(number):
    """Return (day, torque, rpm) of one gearbox: other work in other years, two weeks a
    summer at rest.
    """
    begin = date(2024, 1, 1) + timedelta(days=35 * ((5 * number) % 12))
    loads = [
        (begin, (HEAVY, LIGHT, USUAL)[number % 3], RPM),
        (date(2025, 5, 1), USUAL, RPM),
    ]
    loads.append((date(2026, 1, 15), (LIGHT, USUAL, HEAVY, USUAL)[number % 4], RPM))
    for stop in (stop for stop in STOPS if stop > begin):
        before = [row for row in loads if row[0] <= stop][-1]
        loads += [(stop, 0, 0), (stop + timedelta(days=14), *before[1:])]
    return [*sorted(loads), (END, "", "")]


def truth(number, scene, rng):
    """Return a gearbox's rows of both files, and the true day on
    which 60 um are worn.
    """
    rows = record(number)
    factor = float(np.exp(SPREAD * rng.standard_normal()))
    stages = []
    days = [rows[0][0]]
    passed = [0.0]
    for (day, torque, rpm), (after, *_) in pairwise(rows):
        hours = 24.0 * (after - day).days * (rpm > 0)
        days.append(after)
        passed.append(passed[-1] + hours)
        if rpm:
            stages.append(
                {
                    "torque": f"{torque} N*m",
                    "speed": f"{rpm} rpm",
                    "cycles": 60.0 * rpm * hours,
                }
            )
    stages.append({"torque": f"{USUAL} N*m", "speed": f"{RPM} rpm"})
    own = scene.replace(
        {"operation": {"stage": stages}, "wear.coefficient.factor": factor}
    )
    run = wl.simulate(own)
    hours = run.operating_hours.values / 3600.0
    mass = 1e6 * run.worn_mass.sel(member="pinion").values
    depth = run.max_wear_depth.sel(flank="pinion").values
    looked = [
        rows[0][0] + (END - rows[0][0]) * share
        for share in (0.4, 0.75, 0.97)[number % 2 :]
    ]
    at = [
        np.interp((day - days[0]).days, [(d - days[0]).days for d in days], passed)
        for day in looked
    ]
    losses = np.interp(at, hours, mass) + SD * rng.standard_normal(len(at))
    if NAMES[number] == "G06":
        losses[-1] *= 1.8
    weighed = [] if NAMES[number] == "G12" else list(zip(looked, losses, strict=True))
    rate = passed[-1] / (END - rows[0][0]).days
    life = float(np.interp(LIMIT, depth, hours))
    return rows, weighed, END + timedelta(days=(life - passed[-1]) / rate)


def main(folder=CAMPAIGNS / "measured"):
    """Write the load record and the weighings, the true days beside."""
    scene = wl.load(CAMPAIGNS / "update_gearbox.toml").cases[0].scene
    rng = np.random.default_rng(11)
    made = (
        "# Made up by tests/support/department.py; true days on which 60 um are worn:\n"
    )
    loads = ["date,gearbox,torque,speed"]
    losses = ["date,gearbox,loss_mg"]
    days = []
    for number, name in enumerate(NAMES):
        rows, weighed, day = truth(number, scene, rng)
        loads += [f"{when},{name},{torque},{rpm}" for when, torque, rpm in rows]
        losses += [f"{when},{name},{loss:.0f}" for when, loss in weighed]
        days.append(f"{name} {day}")
        print(name, day, weighed)
    (folder / "department_loads.csv").write_text(
        "\n".join([made.split(";")[0], *loads]) + "\n"
    )
    (folder / "department_weighings.csv").write_text(
        made + "# " + ", ".join(days) + "\n" + "\n".join(losses) + "\n"
    )


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
