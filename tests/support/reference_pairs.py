"""Helical pairs whose geometry and stiffness others have printed."""

import csv
import math
from pathlib import Path

from wearlab.gears.helix import helix, transverse, transverse_basics
from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import Basics, GearSpec

FILE = Path(__file__).parents[1] / "gears" / "helical_reference_values.csv"
ISO, NREL = "ISO/TR 6336-30 example 1", "NREL 5 MW high-speed stage"


def reference(case):
    lines = [
        line
        for line in FILE.read_text(encoding="utf-8").splitlines()
        if not line.startswith("#")
    ]
    return {
        row["quantity"]: row["value"]
        for row in csv.DictReader(lines)
        if row["case"] == case
    }


def both(text):
    return [float(part) for part in text.split("/")]


def pair_of(case):
    given = reference(case)
    teeth = both(given["teeth"])
    tips = both(given["tip_diameter"])
    shifts = both(given.get("shift_1/shift_2", given.get("shift")))
    angle = math.radians(float(given["normal_pressure_angle"]))
    basics = Basics(
        1e-3 * float(given["normal_module"]), angle, 1e-3 * float(given["face_width"])
    )
    turned = helix(math.radians(float(given["helix_angle"])), angle)
    specs = [
        transverse(
            GearSpec(
                name=name,
                teeth=int(z),
                profile_shift_coefficient=x,
                tip_diameter=1e-3 * tip,
                dedendum_coefficient=float(given["tool_dedendum"]),
            ),
            turned,
        )
        for name, z, x, tip in zip(("pinion", "gear"), teeth, shifts, tips, strict=True)
    ]
    distance = 1e-3 * float(given["centre_distance"])
    return (
        gear_pair(
            *specs, transverse_basics(basics, turned.angle), centre_distance=distance
        ),
        turned,
        given,
    )
