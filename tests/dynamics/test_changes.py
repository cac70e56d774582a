"""Contact that opens and closes again inside one step is not missed."""

import numpy as np
from benchmark_pair import BenchmarkPair
from scipy.integrate import solve_ivp

from wearlab.compiled import jit
from wearlab.dynamics.integrators.kernel import kernel_of
from wearlab.dynamics.integrators.mesh_law import THIS, fill_load_inputs
from wearlab.dynamics.integrators.power_series import series_over
from wearlab.dynamics.steady.integrate import OnTables
from wearlab.dynamics.system import System


def pushed_pair() -> tuple[BenchmarkPair, System]:
    """Return a pair without damping, hardly held, that a load alone pushes together."""
    pair = BenchmarkPair(
        double=1e4, single=1e4, mesh_damping=0.0, amplitude=0.0, backlash=1.0, ramp=0.0
    )
    system = pair.system()
    held = 1e-3 * np.eye(3)
    nothing = np.zeros((3, 3))
    push = 1800.0 * system.mass @ [0.0, 0.0, 1.0]
    return pair, system._replace(stiffness=held, damping=nothing, load=push)


def test_a_short_separation_inside_one_step() -> None:
    pair, system = pushed_pair()
    # δ = 1 mm, approaching zero at 2 m/s while the load pushes back: separated between
    # about 0.8 and 1.5 ms.
    start = np.array([0.0, 0.0, 1e-3, 0.0, 0.0, -2.0])
    duration = 2.5e-3

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        d = system.direction[0]
        force = d * 1e4 * max(0.0, d @ y[:3]) + system.stiffness @ y[:3]
        return np.r_[y[3:], np.linalg.solve(system.mass, system.load - force)]

    exact = solve_ivp(
        rate,
        (0.0, duration),
        start,
        method="DOP853",
        rtol=1e-11,
        atol=1e-14,
        max_step=1e-5,
    )
    assert (exact.y[:3].T @ system.direction[0]).min() < -5e-5
    tables = pair.tables(pair.grid(4))
    marcher = OnTables(kernel_of(system, tables, duration / tables.width[0]))
    _, kept = marcher.integrate(start.copy(), 1, 1)
    np.testing.assert_allclose(kept[0, 1, 3:], exact.y[3:, -1], atol=1.5e-4)


@jit(counted=False)
def terms_of_flight(series, held, mesh, inputs, h, state):
    return series_over(series, held, mesh, inputs, h, state)


def test_the_series_of_a_free_flight_ends_soon() -> None:
    pair, system = pushed_pair()
    flying = kernel_of(system, pair.tables(pair.grid(4)), 1e-3)
    series = flying.series
    h = 1e-6
    state = np.zeros((6, series.terms.shape[2]))
    state[:, 0] = 0.0, 0.0, 1e-3, 0.0, 0.0, -2.0
    fill_load_inputs(flying.flanks, flying.balance, 0, 0.0, 1.0, THIS)
    mesh = flying.flanks.scratch.mesh[0]
    inputs = flying.flanks.scratch.inputs[0]
    terms = terms_of_flight(series, flying.balance.held, mesh, inputs, h, state)
    assert terms <= 8
    np.testing.assert_allclose(
        series.terms[:3, 2, 0], [1e-3, -2.0 * h, 0.5 * 1800.0 * h * h], rtol=1e-6
    )
