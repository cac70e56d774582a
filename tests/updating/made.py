"""A gearbox whose wear is known in closed form: mass = rate · factor · cycle."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from wearlab.campaign.distributions import read_distribution
from wearlab.campaign.update_options import Data, ErrorModel, Limit, UpdateSpec
from wearlab.updating.cases import FACTOR, Subject
from wearlab.updating.data_blocks import block_of
from wearlab.updating.measurements import Observed
from wearlab.updating.run_curves import ObservationPoints, RunCurve, RunHistory

RATE = 2e-8  # kg a cycle at factor 1
LIMIT = Limit("worn_mass", 0.03, "sun")


def data(error, *, number=1, quantity="worn_mass", where="sun", since=None):
    own = {
        "number": number,
        "quantity": quantity,
        "member": where,
        "error": error,
        "since": since,
    }
    return Data.model_construct(file=Path("weighings.csv"), **own)


def observed(cycle, value, error, **more):
    n = len(cycle)
    nothing = np.full(n, np.nan)
    return Observed(
        data(error, **more),
        "cycle",
        np.asarray(cycle, float),
        np.asarray(value, float),
        np.zeros(n),
        nothing,
        None,
        nothing,
        np.arange(2, n + 2),
        "made up",
    )


def line(end=2e6, rate=RATE):
    cycle = np.array([0.0, 0.5 * end, end])
    return RunCurve(cycle, rate * cycle[:, None], np.full((3, 1), rate))


def history(seen, *, end=2e6, rate=RATE, factor=1.0, run="made"):
    curve = line(end, rate)
    asked = tuple(
        ObservationPoints(curve, np.zeros(len(one), np.intp), one.time) for one in seen
    )
    crossing = float(curve.first_above(np.array(LIMIT.value)))
    return RunHistory(
        run,
        factor,
        1e-15,
        0.0,
        end,
        3.6,
        asked,
        curve,
        LIMIT.value,
        crossing,
        {"worn_mass": curve},
        (0.0, 0.0),
    )


def spec(prior, discrepancy="none", **more):
    unknown = {} if prior is None else {FACTOR: read_distribution(prior, "factor")}
    numbers = {"draws": more.get("draws", 2000), "seed": more.get("seed", 3)}
    return UpdateSpec.model_construct(
        limit=LIMIT, discrepancy=discrepancy, unknown=unknown, **numbers
    )


def study(prior, seen, discrepancy="none", **more):
    return Subject("base", None, spec(prior, discrepancy, **more), LIMIT, tuple(seen))


def blocks(seen, *, accumulating=False):
    return tuple(block_of(one, accumulating=accumulating) for one in seen)


def with_rows(block, rows):
    return replace(block, rows=np.asarray(rows, np.intp))


__all__ = [
    "ErrorModel",
    "blocks",
    "data",
    "history",
    "line",
    "observed",
    "spec",
    "study",
    "with_rows",
]
