"""What the scores of the error estimates say: a table, whether they keep what is promised, and a dataset."""

from collections import Counter
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np
import xarray as xr

from wearlab.accuracy.drawn import KINDS, QUANTITIES, Score, summary
from wearlab.accuracy.estimates import SCORED, Row, of_row
from wearlab.simulation.label import CONVENTIONS

LEAST_COVERED = 0.95
MOST_RATIO = 10.0
MOST_COST = 0.5
SCORE_HEADS = ("gears", "quantity", "scenes", "error below estimate", "median of estimate over error")
APART_HEADS = ("scored apart", "scenes", "what it means")
APART = {
    "aperiodic": "loads are averages over many periods, and no estimate of an orbit's error is made",
    "aperiodic reference": "the run found a periodic response, its reference does not",
    "life not reached": "the gears cannot run on, or the work of a run is used up, before the depth limit",
    "reference ends early": "the gears of the reference cannot run as long as the run",
    "refused": "the scene is refused with a reason",
    "run too long": "the run itself takes longer than a scene may",
    "reference too long": "the run is done; with its reference, to a hundredth of the tolerance, it takes "
    "longer than a scene may: its error is not known",
    "failed": "a defect",
}
UNITS = {"wear_depth": "m", "life": "1", "mesh_force": "N", "mesh_force_max": "N"}
DISPLAY = UNITS | {"wear_depth": "um"}
ALL = "all"


def scores_of(rows: Sequence[Row], kind: str = ALL) -> list[Score]:
    """Return the scores of one kind of gears, or of all."""
    return [one for row in rows if kind in (ALL, row["kind"]) and (one := of_row(row)) is not None]


def score_rows(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """Return a row for every quantity, of all gears and of each kind."""
    return [
        (kind, name.replace("_", " "), str(count), f"{share:.1%}", f"{ratio:.1f}")
        for kind in (ALL, *KINDS)
        for name, (count, share, ratio) in summary(scores_of(rows, kind)).items()
    ]


def reasons(rows: Sequence[Row]) -> dict[str, int]:
    """Return how many scenes have no score for which reason."""
    told = [row["outcome"].partition(":")[0] for row in rows]
    return dict(Counter(one for one in told if one != SCORED))


def apart_rows(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """Return a row for every reason for which scenes have no score."""
    return [(reason, str(count), APART.get(reason, "")) for reason, count in reasons(rows).items()]


def costs(rows: Sequence[Row]) -> tuple[float, float]:
    """Return what the estimates add to the run time, median and largest; NaN without scores [1]."""
    found = [one.cost for one in scores_of(rows)]
    return (float(np.median(found)), max(found)) if found else (float("nan"), float("nan"))


def missed(rows: Sequence[Row]) -> list[str]:
    """Return what is promised of the estimates and not kept by these scenes."""
    told = []
    for name, (_, share, ratio) in summary(scores_of(rows)).items():
        if share < LEAST_COVERED:
            told.append(f"{name}: the error is below its estimate in {share:.1%} of the scenes, not 95 %")
        if not ratio <= MOST_RATIO:
            told.append(f"{name}: the median of estimate over error is {ratio:.1f}, more than 10")
    if costs(rows)[1] > MOST_COST:
        told.append(f"the estimates add up to {costs(rows)[1]:.0%} to the time of a run, not at most half")
    return told


def dataset(title: str, seed: int, rows: Sequence[Row], made_by: dict[str, str], begun: float) -> xr.Dataset:
    """Return the scores as a dataset over scenes.

    Parameters
    ----------
    title : of the campaign
    seed : of the scenes
    rows : one for each scene, in order
    made_by : what is recorded of the sources and the machine
    begun : start of the last stretch of work, seconds since the epoch [s]
    """
    found: dict[str, Any] = {
        "outcome": ("scene", [row["outcome"] for row in rows]),
        "run_time": (
            "scene",
            [row["seconds"] for row in rows],
            _said("processor time, reference included", "s"),
        ),
        "cost": (
            "scene",
            [row.get("cost", np.nan) for row in rows],
            _said(
                "time of the estimates over that of the rest of the run",
                "1",
            ),
        ),
    }
    for name in QUANTITIES:
        for what, words in (("error", "true error"), ("estimate", "estimated error")):
            values = [row.get(f"{name}_{what}", np.nan) for row in rows]
            said = _said(f"{words} of the {name.replace('_', ' ')} at the end of the life", UNITS[name])
            found[f"{name}_{what}"] = ("scene", values, {**said, "display_units": DISPLAY[name]})
    coords = {"scene": [row["scene"] for row in rows], "kind": ("scene", [row["kind"] for row in rows])}
    attributes = {
        "Conventions": CONVENTIONS,
        "title": title,
        "seed": seed,
        **made_by,
        "date_created": datetime.fromtimestamp(begun, UTC).isoformat(timespec="seconds"),
    }
    return xr.Dataset(found, coords, attributes)


def _said(long_name: str, units: str) -> dict[str, str]:
    return {"long_name": long_name, "units": units}
