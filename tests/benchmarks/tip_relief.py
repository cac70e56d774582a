"""Optimal tip relief: the largest life of a spur pair whose dynamic factor is bounded,
by derivatives.

``python tests/benchmarks/tip_relief.py [BOUND]`` prints every step of the search.
Pinion and gear have reliefs of their own; SciPy's SLSQP is given life and dynamic
factor with their derivatives.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

import wearlab as wl

CAMPAIGN = Path(__file__).parents[2] / "campaigns" / "spur_tip_relief.toml"
KEYS = ("gears.pinion.tip_relief.amount", "gears.gear.tip_relief.amount")
MICROMETRE = 1e-6
LEAST, MOST = 2.0, 30.0
BOUND = 1.1


def optimum(bound: float) -> tuple[np.ndarray, list[tuple[float, ...]]]:
    """Return the best reliefs of pinion and gear met within the bound [µm], and every
    step of the search.

    A step: both reliefs [µm], life, dynamic factor. The place of the largest force may
    change: there the bound has a corner, on which the search may go astray. So the best
    step counts, not the last.
    """
    scene = wl.load(CAMPAIGN).cases[0].scene
    known = {}
    steps = []

    def at(amounts: np.ndarray):  # type: ignore[no-untyped-def]
        key = tuple(float(one) for one in amounts)
        if key not in known:
            there = scene
            for name, amount in zip(KEYS, key, strict=True):
                there = there.replace(name, f"{amount!r} um")
            known[key] = found = wl.gradient(
                there, ["life", "dynamic_factor"], KEYS, estimate=False
            )
            steps.append((*key, float(found.life), float(found.dynamic_factor[0, 0])))
            print("  ".join(f"{value:.6g}" for value in steps[-1]), flush=True)
        return known[key]

    size = float(at(np.full(2, 8.0)).life)
    minimize(
        lambda x: -float(at(x).life) / size,
        np.full(2, 8.0),
        jac=lambda x: -at(x).d_life.values * MICROMETRE / size,
        bounds=[(LEAST, MOST)] * 2,
        constraints={
            "type": "ineq",
            "fun": lambda x: bound - float(at(x).dynamic_factor[0, 0]),
            "jac": lambda x: -at(x).d_dynamic_factor.values[:, 0, 0] * MICROMETRE,
        },
        method="SLSQP",
        options={"ftol": 1e-6, "maxiter": 10},
    )
    best = max(
        (one for one in steps if one[3] <= bound * (1.0 + 1e-6)), key=lambda one: one[2]
    )
    return np.array(best[:2]), steps


if __name__ == "__main__":
    print("pinion µm  gear µm  life  dynamic factor")
    best, steps = optimum(float(sys.argv[1]) if len(sys.argv) > 1 else BOUND)
    print(f"optimum after {len(steps)} gradients: {best[0]:.3f} and {best[1]:.3f} µm")
