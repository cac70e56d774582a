"""Units of a population whose wear is known in closed form: depth =
rate · factor · cycle.
"""

import csv

import numpy as np
from made import ErrorModel, blocks, observed
from scenes import CAMPAIGNS

from wearlab.campaign.distributions import read_distribution
from wearlab.updating.fleet_law import Law, Parameter
from wearlab.updating.fleet_members import FleetMember
from wearlab.updating.grids import weighted_quantiles
from wearlab.updating.run_curves import ObservationPoints, RunCurve, RunHistory

LINERS = CAMPAIGNS / "measured" / "cylinder_liner_wear.csv"
RATE = 1e-7  # m a cycle (an hour of a liner) at factor 1
LIMIT = 4e-3


def quantile(found, name, p):
    scores, probability = found._between
    points = found.mean + scores @ found.root.T
    column = [parameter.name for parameter in found.law.parameters].index(name)
    return np.exp(weighted_quantiles(points[:, column], probability, p))


def lognormal(median, cov):
    return read_distribution({"lognormal": {"median": median, "cov": cov}}, "prior")


PRIORS = {
    "power": (lognormal(1.0, 0.3), 1.0),
    "straying": (lognormal(0.2, 1.0), 1.0),
    "sd_0": (lognormal("0.05 mm", 0.5), 1e-3),
    "spread": (lognormal(0.3, 1.0), 1.0),
    "median": (lognormal(1.0, 2.0), 1.0),
}


def law(*names, reference=1.5e4, sd=5e-5):
    parameters = tuple(Parameter(n, *PRIORS[n]) for n in (*names, "spread", "median"))
    return Law(parameters, reference, sd=(sd,))


def unit(name, cycle, value, sd=5e-5):
    seen = observed(
        np.asarray(cycle, float),
        value,
        ErrorModel(sd),
        quantity="max_wear_depth",
        where=None,
    )
    states = np.array([0.0, 5e4, 1e5])
    curve = RunCurve(states, RATE * states[:, None], np.full((3, 1), RATE))
    asked = (ObservationPoints(curve, np.zeros(len(seen), np.intp), seen.time),)
    run = RunHistory(
        name,
        1.0,
        1.0,
        0.0,
        1e5,
        3600.0,
        asked,
        curve,
        LIMIT,
        LIMIT / RATE,
        {"max_wear_depth": curve},
        (0.0, 0.0),
    )
    return FleetMember(name, run, blocks((seen,)))


def liners(sd=5e-5):
    told = [
        line for line in LINERS.read_text().splitlines() if not line.startswith("#")
    ]
    rows = list(csv.DictReader(told))
    units = []
    for name in dict.fromkeys(row["unit"] for row in rows):
        own = [row for row in rows if row["unit"] == name]
        hours = [float(row["operating_hours_h"]) for row in own]
        depth = [float(row["wear_depth_mm"]) for row in own]
        units.append(unit(name, hours, 1e-3 * np.array(depth), sd))
    return units


def simulated(
    n, inspections, seed, *, spread=0.3, straying=0.2, sd=5e-5, reference=1.5e4
):
    """Return units drawn from a population: median 1, power 1."""
    rng = np.random.default_rng(seed)
    made = []
    for i in range(n):
        factor = np.exp(spread * rng.standard_normal())
        cycle = np.sort(rng.uniform(2e3, 4e4, inspections))
        steps = (
            straying * factor * RATE * np.sqrt(reference * np.diff(cycle, prepend=0.0))
        )
        worn = factor * RATE * cycle + np.cumsum(
            steps * rng.standard_normal(inspections)
        )
        made.append(
            unit(
                f"unit {i + 1}", cycle, worn + sd * rng.standard_normal(inspections), sd
            )
        )
    return made
