"""What the scores of the error estimates say: a table, whether they keep what is
promised, and a dataset.
"""

from collections import Counter
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np
import xarray as xr
from drawn_scenes import KINDS
from estimate_rows import DOUBTFUL, SCORED, Row, of_row
from estimate_score import QUANTITIES, Score, summary

from wearlab.simulation.label import CONVENTIONS

MIN_COVERED = 0.95
MAX_RATIO = 8.0
MAX_COST = 0.5
MAX_REFUSED = 0.05
LONGEST_RUN = 60.0
SCORE_HEADS = (
    "gears",
    "quantity",
    "scenes",
    "error below estimate",
    "median of estimate over error",
)
APART_HEADS = ("without a score", "scenes", "what it means")
MISSES = {
    "run too long": "missed: the run takes longer than it may",
    "reference too long": "missed: references to 1e-5 and to 1e-4 take longer than "
    "they may",
    "reference too rough": "missed: only a reference to 1e-4 ends in time, hardly "
    "better than the run",
    "unfinished": "missed: the work of a run is used up before its life ends",
    "failed": "missed: a defect",
}
APART = {
    "aperiodic": "apart: loads are averages over many periods; the run says that its "
    "estimates are doubtful",
    "doubtful, reference too long": "apart: the run says that its estimates are "
    "doubtful",
    "reference ends early": "apart: the gears of the reference cannot run as long as "
    "those of the run",
    "reference refused": "apart: the reference is refused with a reason",
    "refused": "apart: the scene is refused with a reason",
}
UNITS = {
    "wear_depth": "m",
    "life": "1",
    "mesh_force": "N",
    "mesh_force_max": "N",
    "mesh_force_range": "N",
    "transmission_error": "m",
}
DISPLAY = UNITS | {"wear_depth": "um", "transmission_error": "um"}
TIME = "run_seconds"
ALL, FRICTION, OVER_FACE = "all", "with friction", "with a face"
GROUPS = (ALL, *KINDS, OVER_FACE, FRICTION, DOUBTFUL)
"""What is scored together; runs that say their estimates are doubtful count in the last
alone."""


def belongs(row: Row, group: str) -> bool:
    """Whether a scene is counted in a group."""
    if (row.get("quality") == DOUBTFUL) != (group == DOUBTFUL):
        return False
    over_face = row.get("face") == "yes"
    if group == OVER_FACE:
        return over_face
    if group == FRICTION:
        return row.get("friction") == "yes"
    return group in (ALL, DOUBTFUL) or (group == row["kind"] and not over_face)


def scores_of(rows: Sequence[Row], group: str | None = None) -> list[Score]:
    """Return the scores of a group, or of every scene that has one."""
    own = rows if group is None else [row for row in rows if belongs(row, group)]
    return [one for row in own if (one := of_row(row)) is not None]


def reason_of(row: Row) -> str:
    """Return why a scene has no score, in one of the words of `APART` and `MISSES`, or
    that it has one.
    """
    reason = str(row["outcome"]).partition(":")[0]
    return (
        f"{DOUBTFUL}, {reason}"
        if reason in MISSES and row.get("quality") == DOUBTFUL
        else reason
    )


def misses(rows: Sequence[Row], group: str) -> int:
    """Return how many scenes of a group have an error that took too long to find: it
    counts as exceeded.
    """
    return sum(belongs(row, group) and reason_of(row) in MISSES for row in rows)


def summary_of(rows: Sequence[Row], group: str) -> dict[str, tuple[int, float, float]]:
    """Return the summary of a group's scores, its misses counted."""
    return summary(scores_of(rows, group), misses(rows, group))


def score_rows(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """Return a row for every quantity of every group."""
    return [
        (group, name.replace("_", " "), str(count), f"{share:.1%}", f"{ratio:.1f}")
        for group in GROUPS
        for name, (count, share, ratio) in summary_of(rows, group).items()
    ]


def reasons(rows: Sequence[Row]) -> dict[str, int]:
    """Return how many scenes have no score for which reason."""
    told = [reason_of(row) for row in rows]
    return dict(Counter(one for one in told if one != SCORED))


def apart_rows(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """Return a row for every reason for which scenes have no score."""
    means = APART | MISSES
    return [
        (reason, str(count), means.get(reason, APART["doubtful, reference too long"]))
        for reason, count in reasons(rows).items()
    ]


def costs(rows: Sequence[Row]) -> tuple[float, float]:
    """Return what the estimates add to the run time, median and largest.

    NaN without scores [1].
    """
    found = [one.cost for one in scores_of(rows)]
    return (
        (float(np.median(found)), max(found)) if found else (float("nan"), float("nan"))
    )


def missed(rows: Sequence[Row]) -> list[str]:
    """Return what is promised of the estimates and not kept by these scenes."""
    told = []
    for name, (_, share, ratio) in summary_of(rows, ALL).items():
        if share < MIN_COVERED:
            told.append(
                f"{name}: the error is below its estimate in {share:.1%} of the "
                "scenes, "
                f"not {MIN_COVERED:.0%}"
            )
        if not ratio <= MAX_RATIO:
            told.append(
                f"{name}: the median of estimate over error is {ratio:.1f}, more than "
                f"{MAX_RATIO:.0f}"
            )
    if costs(rows)[1] > MAX_COST:
        told.append(
            f"the estimates add up to {costs(rows)[1]:.0%} to the time of a run, not "
            "at most half"
        )
    refused = reasons(rows).get("refused", 0)
    if refused > MAX_REFUSED * len(rows):
        told.append(
            f"{refused} of {len(rows)} scenes are refused, more than {MAX_REFUSED:.0%}"
        )
    slow = [
        row["scene"]
        for row in rows
        if row[TIME if TIME in row else "seconds"] >= LONGEST_RUN
    ]
    if slow:
        told.append(
            f"runs of {LONGEST_RUN:.0f} s of the processor and more: "
            f"{', '.join(map(str, slow))}"
        )
    return told


def dataset(
    seed: int, rows: Sequence[Row], made_by: dict[str, str], begun: float
) -> xr.Dataset:
    """Return the scores as a dataset over scenes.

    Parameters
    ----------
    seed : of the scenes
    rows : one for each scene, in order
    made_by : what is recorded of the sources and the machine
    begun : start of the last stretch of work, seconds since the epoch [s]
    """
    found: dict[str, Any] = {
        "outcome": ("scene", [row["outcome"] for row in rows]),
        "estimate_quality": ("scene", [row.get("quality", "") for row in rows]),
        "run_time": (
            "scene",
            [row.get("run_seconds", row["seconds"]) for row in rows],
            _said("processor time of the run", "s"),
        ),
        "scoring_time": (
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
    found["reference_tolerance"] = (
        "scene",
        [row.get("reference", np.nan) for row in rows],
        _said("tolerance of the reference", "1"),
    )
    for name in QUANTITIES:
        for what, words in (("error", "true error"), ("estimate", "estimated error")):
            values = [row.get(f"{name}_{what}", np.nan) for row in rows]
            said = _said(
                f"{words} of the {name.replace('_', ' ')} at the end of the life",
                UNITS[name],
            )
            found[f"{name}_{what}"] = (
                "scene",
                values,
                {**said, "display_units": DISPLAY[name]},
            )
    coords: dict[str, Any] = {"scene": [row["scene"] for row in rows]}
    for name in ("kind", "motion", "friction"):
        coords[name] = ("scene", [row.get(name, "") for row in rows])
    attributes = {
        "Conventions": CONVENTIONS,
        "title": "Error estimates against true errors",
        "seed": seed,
        **made_by,
        "date_created": datetime.fromtimestamp(begun, UTC).isoformat(
            timespec="seconds"
        ),
    }
    return xr.Dataset(found, coords, attributes)


def _said(long_name: str, units: str) -> dict[str, str]:
    return {"long_name": long_name, "units": units}
