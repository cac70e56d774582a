"""The named methods agree, each with its own order and its own idea of steady."""

import re
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from benchmark_pair import BenchmarkPair, mesh_period

from wearlab.dynamics import methods
from wearlab.dynamics.methods import IntegrationMethod
from wearlab.dynamics.methods.newmark import Newmark
from wearlab.dynamics.methods.rk4 import RungeKutta4
from wearlab.dynamics.methods.rk45 import RungeKutta45
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.response import deflection_at
from wearlab.dynamics.steady.until_steady import remaining_change

PAIR = BenchmarkPair()
SEPARATING = PAIR._replace(amplitude=6e-6)
PHASE = np.arange(200) / 200


@pytest.mark.parametrize(("pair", "rpm"), [(PAIR, 1860), (SEPARATING, 6000)])
@pytest.mark.parametrize(
    ("method", "tolerance"),
    [(RungeKutta4(), 1e-6), (RungeKutta45(), 3e-6), (Newmark(), 2e-3)],
)
def test_methods_agree(
    method: IntegrationMethod, tolerance: float, pair: BenchmarkPair, rpm: float
) -> None:
    grid = pair.grid(400)
    arguments = pair.system(), pair.tables(grid), mesh_period(rpm)
    exact, _ = deflection_at(Periodic().solve(*arguments), grid, PHASE)
    response = method.solve(*arguments)
    delta, _ = deflection_at(response, grid, PHASE)
    assert response.period == 1 and response.verdict.deviations == ()
    assert np.abs(delta - exact).max() < tolerance * np.abs(exact).max()


def test_newmark_is_of_second_order() -> None:
    exact_grid = PAIR.grid(1600)
    exact, _ = deflection_at(
        Periodic().solve(PAIR.system(), PAIR.tables(exact_grid), mesh_period(1860)),
        exact_grid,
        PHASE,
    )
    errors = []
    for steps in (200, 400, 800):
        grid = PAIR.grid(steps)
        delta, _ = deflection_at(
            Newmark().solve(PAIR.system(), PAIR.tables(grid), mesh_period(1860)),
            grid,
            PHASE,
        )
        errors.append(np.abs(delta - exact).max())
    np.testing.assert_allclose(
        np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, atol=0.2
    )


def test_a_slow_decay_is_marched_to_its_end() -> None:
    """At 30,000 rpm the multiplier is 0.98: fifty times the last
    change is still to come.
    """
    grid = PAIR.grid(120)
    arguments = PAIR.system(), PAIR.tables(grid), mesh_period(30000)
    exact = Periodic().solve(*arguments)
    assert abs(exact.multipliers[0]) == pytest.approx(0.983, abs=2e-3)
    marched = RungeKutta4(tolerance=1e-6).solve(*arguments)
    size = np.abs(exact.state[0]).max(axis=0)
    assert (np.abs(marched.state[0] - exact.state[0]).max(axis=0) < 1e-5 * size).all()


def test_remaining_change_is_the_geometric_sum() -> None:
    k = np.arange(90)[:, None]
    strobe = np.hstack([1.0 + 1e-3 * 0.98**k, np.zeros_like(k)])
    assert remaining_change(strobe, 1, 1.0) == pytest.approx(1e-3 * 0.98**59, rel=0.05)
    assert remaining_change(np.hstack([np.sin(k * 1.0), 0.0 * k]), 1, 1.0) > 1.0


@pytest.mark.parametrize("method", [RungeKutta4(), Newmark()])
def test_marching_names_period_two(method: IntegrationMethod) -> None:
    pair = PAIR._replace(torque=5.0)
    grid = pair.grid(300)
    assert method.solve(pair.system(), pair.tables(grid), mesh_period(4900)).period == 2


def test_a_method_is_one_file_that_is_found_by_its_class(tmp_path: Path) -> None:
    """The method that the docs show agrees with the orbit, with its second order."""
    page = (Path(__file__).parents[2] / "docs" / "where_to_add.md").read_text()
    shown = re.search(r"methods/midpoint\.py`.*?```python\n(.*?)```", page, re.DOTALL)
    assert shown is not None
    file = tmp_path / "midpoint.py"
    file.write_text(shown[1])
    spec = spec_from_file_location("midpoint", file)
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    method = methods.method_of(module)
    assert method.__name__ == "Midpoint"

    errors = []
    for steps in (400, 800):
        grid = PAIR.grid(steps)
        arguments = PAIR.system(), PAIR.tables(grid), mesh_period(1860)
        exact, _ = deflection_at(Periodic().solve(*arguments), grid, PHASE)
        response = method.at_tolerance(1e-3).solve(*arguments)
        delta, _ = deflection_at(response, grid, PHASE)
        errors.append(np.abs(delta - exact).max() / np.abs(exact).max())
    assert errors[1] < 2e-3
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.3)


def test_a_file_without_a_method_is_refused() -> None:
    with pytest.raises(TypeError, match="one class with at_tolerance and solve"):
        methods.method_of(ModuleType("empty"))
