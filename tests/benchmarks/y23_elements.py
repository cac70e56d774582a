"""The mesh stiffness of Y23's pair against plane finite elements, beside what its Fig.
19 says: a table.

    python tests/benchmarks/y23_elements.py

Largest difference in double and in single contact, unworn and worn by 100 µm, where
both have as many pairs in contact.
"""

from pathlib import Path

import numpy as np

from wearlab.campaign import load
from wearlab.simulation import simulate

CAMPAIGN = Path(__file__).parents[2] / "campaigns" / "internal_wear_levels.toml"
PRINTED = {
    ("0.1 um", 2): 6.4,
    ("0.1 um", 1): 3.2,
    ("100 um", 2): 9.8,
    ("100 um", 1): 4.6,
}
"""Largest difference [%] by level and pairs in contact (Y23, 3.3)."""
OURS = {"by load": "whole pairs", "shared bodies": "shared bodies"}


def stiffness(case, level):
    """Return mesh stiffness [N/m] and pairs in contact over the phase."""
    scene = next(one.scene for one in load(CAMPAIGN).cases if one.label == case)
    for flank in ("pinion", "ring"):
        scene = scene.replace(f"wear.initial.{flank}.depth", level)
    run = simulate(scene)
    return run.mesh_stiffness.values[0, 0], (run.load_share.values[0, 0] > 0.0).sum(
        axis=0
    )


def differences(case, level):
    """Return the largest difference from elements in double and single contact [%]."""
    ours, pairs = stiffness(case, level)
    elements, of_elements = stiffness("finite elements", level)
    off = 100.0 * np.abs(ours / elements - 1.0)
    return {
        count: float(off[(pairs == count) & (of_elements == count)].max())
        for count in (2, 1)
    }


if __name__ == "__main__":
    print(
        f"| wear | pairs in contact | Y23 | {' | '.join(OURS.values())} "
        f"|\n|---|---|---|{'---|' * len(OURS)}"
    )
    for wanted in ("0.1 um", "100 um"):
        found = {case: differences(case, wanted) for case in OURS}
        for pairs_in_contact in (2, 1):
            row = " | ".join(f"{found[case][pairs_in_contact]:.1f} %" for case in OURS)
            print(
                f"| {wanted} | {pairs_in_contact} | "
                f"{PRINTED[wanted, pairs_in_contact]} % | {row} |"
            )
