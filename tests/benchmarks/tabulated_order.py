"""The order of RK4 on a stiffness that is read from a table.

``python tests/benchmarks/tabulated_order.py docs/evidence/tabulated_order.json`` finds
the periodic response of one coordinate, ``x'' + 2 ζ ω x' + ω² k(t) x = 1``, by RK4 and
keeps its errors. The stiffness is a smooth ramp up and down, once as it is and once as
tables of it, which the cubic of Fritsch and Carlson joins, as in wearlab.
"""

import json
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

STEPS = (64, 128, 256, 512, 1024, 2048, 4096)
REFERENCE = 32 * 1600
"""Steps of the reference; every table here has rows where its steps end."""
OMEGA = 2.0 * np.pi * 1.3
DAMPING_RATIO = 0.03
ROWS = {
    "no table": None,
    "16 rows, a step ends at each": 16,
    "80 rows, steps end at some": 80,
    "100 rows, steps end at some": 100,
}
Stiffness = Callable[[np.ndarray], np.ndarray]


def smooth(phase: np.ndarray) -> np.ndarray:
    """Return a stiffness with quintic ramps that are 0.05 periods wide [1]."""

    def step(centre: float) -> np.ndarray:
        u = np.clip((phase % 1.0 - centre) / 0.05 + 0.5, 0.0, 1.0)
        return u**3 * (10.0 - 15.0 * u + 6.0 * u**2)

    return 0.73 + 0.5 * (step(0.0) - step(0.75) + step(1.0))


def tabulated(rows: int | None) -> Stiffness:
    """Return the stiffness as a table of so many rows a period has it, None: smooth."""
    if rows is None:
        return smooth
    phase = np.linspace(0.0, 1.0, rows + 1)
    curve = PchipInterpolator(phase, smooth(phase))
    return lambda x: curve(x % 1.0)


def response(stiffness: Stiffness, steps: int) -> float:
    """Return x at the beginning of a period of the periodic response, by RK4."""
    width = 1.0 / steps
    begin = np.arange(steps) * width
    stages = [OMEGA**2 * stiffness(begin + part * width) for part in (0.0, 0.5, 1.0)]
    whole = np.eye(3)
    for start, middle, end in zip(*stages, strict=True):
        first = _slope(start)
        second = _slope(middle) @ (np.eye(3) + width / 2.0 * first)
        third = _slope(middle) @ (np.eye(3) + width / 2.0 * second)
        fourth = _slope(end) @ (np.eye(3) + width * third)
        mean = (first + 2.0 * second + 2.0 * third + fourth) / 6.0
        whole = (np.eye(3) + width * mean) @ whole
    state = np.linalg.solve(np.eye(2) - whole[:2, :2], whole[:2, 2])
    return float(state[0])


def _slope(stiffness: float) -> np.ndarray:
    """Return the matrix of (x, x', 1)' = A (x, x', 1)."""
    return np.array(
        [
            [0.0, 1.0, 0.0],
            [-stiffness, -2.0 * DAMPING_RATIO * OMEGA, 1.0],
            [0.0, 0.0, 0.0],
        ]
    )


def measured(rows: int | None) -> dict[str, Any]:
    """Return the errors of RK4 with a table, and the order between its steps."""
    stiffness = tabulated(rows)
    exact = response(stiffness, REFERENCE)
    errors = [abs(response(stiffness, steps) / exact - 1.0) for steps in STEPS]
    orders = [float(np.log2(coarse / fine)) for coarse, fine in pairwise(errors)]
    return {
        "steps": list(STEPS),
        "errors": [float(f"{error:.2g}") for error in errors],
        "orders": [round(order, 1) for order in orders],
        "mean_order": round(float(np.mean(orders)), 1),
    }


def main(file: Path) -> None:
    """Keep what is measured."""
    kept = {name: measured(rows) for name, rows in ROWS.items()}
    file.write_text(json.dumps(kept, indent=1) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
