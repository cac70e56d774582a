"""Steady states raced against peers at their best: one table, one thread, one run.

``python tests/benchmarks/races.py [PAGE.md]`` takes the scenes of `campaigns/accuracy`:
L16's pair at five speeds, the benchmark pair, an internal pair, a set with tooth
friction and one of 18 degrees of freedom. To 1e-3 and to 1e-6 every method runs at the
cheapest of its settings that gets there, all in turns, nine rounds of processor time
each; the medians are told, and how far the rounds spread. Written to PAGE.md, if one is
named, with date and machine. Five to eight minutes on a quiet machine; most of them
find settings.
"""

# ruff: noqa: E402
import os

for name in (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
):
    os.environ[name] = "1"

import platform
import sys
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from race import BALANCE, CLOSING, LANDING, OURS, WARM, Contestant, race

from wearlab.accuracy.steady import steady
from wearlab.campaign import load
from wearlab.scene import Scene

FOLDER = Path(__file__).parents[2] / "campaigns" / "accuracy"
TARGETS = (1e-3, 1e-6)
NAMES = {"base": "L16"}
RATIOS = (
    "case",
    "error",
    "wearlab",
    "× marching peer",
    "× Newton or balance",
    "× warm start",
)
SETTINGS = ("case", "error", "wearlab", "marching peer", "Newton or harmonic balance")


def scenes() -> Iterator[tuple[str, Scene]]:
    """Yield the names and scenes of the race."""
    for file in ("spur_steady", "internal", "planetary_friction", "planetary_steady"):
        for case in load(FOLDER / f"{file}.toml").cases:
            scene = case.scene
            if scene.dynamics is not None and not (
                scene.wear is not None and scene.wear.until is not None
            ):
                name = NAMES.get(case.label, case.label)
                speed = scene.operation.speed or 0.0
                kind = file.removesuffix("_steady").replace("_", " ")
                yield f"{kind} {name}, {30.0 * speed / np.pi:.0f} rpm", scene


def rows(
    case: str, target: float, entries: list[Contestant]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return a row of the table of ratios, and one of that of settings."""
    by_role = {one.contestant.role: one for one in entries}
    mine = by_role.get(OURS)
    if mine is None:
        return (case, f"{target:.0e}", "not reached", "", "", ""), (
            case,
            f"{target:.0e}",
            "",
            "",
            "",
        )
    closers = [by_role[role] for role in (CLOSING, BALANCE) if role in by_role]
    closer = min(closers, key=lambda one: float(np.median(one.seconds)), default=None)
    marcher = by_role.get(LANDING)
    warm = by_role[WARM]
    about = case, f"{target:.0e}"
    return (
        (
            *about,
            seconds(mine),
            ratio(marcher, mine),
            ratio(closer, mine),
            ratio(mine, warm),
        ),
        (*about, told(mine), told(marcher), told(closer)),
    )


def seconds(one: Contestant) -> str:
    """Return the median time of an entry, and half the range of its rounds."""
    median = float(np.median(one.seconds))
    return f"{1e6 * median:.4g} µs ±{50 * float(np.ptp(one.seconds) / median):.0f} %"


def told(one: Contestant | None) -> str:
    """Return time, spread, setting and error of an entry."""
    if one is None:
        return "not reached"
    part = (
        ""
        if one.contestant.share == 1.0
        else f", {100.0 * one.contestant.share:.0f} % timed"
    )
    how = one.contestant.name.removeprefix("wearlab ")
    return f"{seconds(one)} ({how}, {one.contestant.error:.0e}{part})"


def ratio(one: Contestant | None, other: Contestant) -> str:
    """Return the median of the ratios of each round, and their range."""
    if one is None:
        return ""
    found = one.over(other)
    return f"{np.median(found):.1f} ({found.min():.1f}–{found.max():.1f})"


def processor() -> str:
    """Return the processor's name."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    names = [
        line.partition(":")[2].strip()
        for line in lines
        if line.startswith("model name")
    ]
    return (
        f"{names[0]}, {len(names)} cores"
        if names
        else platform.processor() or platform.machine()
    )


def main(page: str | None = None) -> None:
    """Race, print the table, and write the page."""
    begun = time.perf_counter()
    ratios = []
    settings = []
    for case, scene in scenes():
        entries = race(steady(scene), TARGETS)
        for target in TARGETS:
            short, long = rows(case, target, entries[target])
            ratios.append(short)
            settings.append(long)
            print(" | ".join((*short, *long[2:])), flush=True)
    minutes = (time.perf_counter() - begun) / 60.0
    when = (
        f"{datetime.now(UTC):%Y-%m-%d}, {processor()}, one thread, {minutes:.1f} "
        "minutes"
    )
    print(when)
    if page is not None:
        text = Path(page).read_text().partition(MARK)[0]
        told = (
            f"{when}.\n\n{table(RATIOS, ratios)}\n\nSettings and "
            f"times:\n\n{table(SETTINGS, settings)}"
        )
        Path(page).write_text(f"{text}{MARK}\n\n{told}\n")


def table(heads: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """Return a table in Markdown."""
    return "\n".join(
        f"| {' | '.join(one)} |" for one in (heads, ("---",) * len(heads), *rows)
    )


MARK = "<!-- written by tests/benchmarks/races.py -->"

if __name__ == "__main__":
    main(*sys.argv[1:2])
