"""The estimated error of the largest mesh force against orbits that SciPy's DOP853 closes."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from wearlab.accuracy.reference import second_method
from wearlab.accuracy.steady import steady
from wearlab.dynamics.periodic import Periodic
from wearlab.scene import Scene
from wearlab.simulation import simulate
from wearlab.simulation.force_errors import LARGEST_SHARE, NEAR, error_of_largest

SCENE: dict[str, Any] = {
    "gears": {
        "kind": "external-pair",
        "module": "3 mm",
        "face_width": "20 mm",
        "pinion": {"teeth": 23},
        "gear": {"teeth": 37},
    },
    "operation": {"torque": "150 N*m", "speed": "2900 rpm"},
    "mesh": {"damping_ratio": 0.05, "normal_backlash": "100 um"},
    "dynamics": {"model": "torsional"},
    "numerics": {"tolerance": 1e-3},
}
CASES: dict[str, dict[str, Any]] = {
    "soft onset": {},
    "jumps at A and E": {"mesh": SCENE["mesh"] | {"extended_contact": False}},
    "worn, slow": {
        "wear": {"initial": {"pinion": {"depth": "15 um", "shape": "quadratic"}}},
        "operation": {"torque": "150 N*m", "speed": "700 rpm"},
    },
}


@pytest.mark.parametrize("case", list(CASES))
def test_it_covers_what_dop853_finds(case: str) -> None:
    scene = Scene.from_mapping(SCENE | CASES[case])
    run, problem = simulate(scene), steady(scene)
    edge = problem.parts.edges
    sides = np.concatenate([edge[:-1] + 1e-9, edge[1:] - 1e-9])
    phase = np.sort(np.concatenate([(np.arange(3000) + 0.5) / 3000, sides]))
    problem = replace(problem, parts=replace(problem.parts, phase=phase))
    response = problem.solve(problem.with_steps(1000, Periodic()))
    truth = float(second_method(problem, problem.motion(response.system), response).max())
    estimate = float(run.error_estimate_mesh_force_max[-1])
    assert abs(float(run.mesh_force_max[-1, 0]) - truth) <= estimate < 5e-3 * truth


def test_the_largest_is_off_by_no_more_than_the_error_where_it_may_lie() -> None:
    x = np.linspace(0.0, 1.0, 1001)
    values = np.where(x < 0.5, 10.0 * x, 2.0)
    far = np.where(x > 0.9, 1.0, 0.01)
    assert error_of_largest(values, far) == pytest.approx(0.01 * LARGEST_SHARE)
    assert error_of_largest(values, 20.0 * far) == pytest.approx(20.0 * LARGEST_SHARE)
    by_chance = np.abs(x - x[values.argmax()])
    assert error_of_largest(values, by_chance) == pytest.approx(LARGEST_SHARE * 0.1 * NEAR * 5.0, rel=0.05)
