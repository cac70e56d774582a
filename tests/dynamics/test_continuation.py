"""The response over speed: both branches, jumps located, and no jump where the response
is only steep.
"""

import numpy as np
import pytest
from benchmark_pair import BenchmarkPair, mesh_period

from wearlab.dynamics.steady.continuation import Continuation, MeshAt
from wearlab.dynamics.steady.shooting import Shooting

RPM = np.pi / 30.0
PAIR = BenchmarkPair(mesh_damping=400.0)
SPEEDS = np.linspace(2300.0, 2660.0, 7) * RPM


def mesh_at(
    pair: BenchmarkPair, constant: float | None = None, steps: int = 60
) -> MeshAt:
    tables = pair.tables(pair.grid(steps))
    if constant is not None:
        tables = tables._replace(stiffness=np.sign(tables.stiffness) * constant)
    return lambda speed: (pair.system(), tables, mesh_period(speed / RPM))


def test_both_branches_and_their_jumps() -> None:
    way = Continuation()
    at = mesh_at(PAIR)
    up = way.follow(at, list(SPEEDS), np.zeros(6))
    down = way.follow(at, list(SPEEDS[::-1]), up[-1].response.end)[::-1]
    ratio = [d.extent / u.extent for u, d in zip(up, down, strict=True)]
    np.testing.assert_allclose([ratio[0], ratio[1], ratio[5], ratio[6]], 1.0, rtol=1e-6)
    assert ratio[2] > 2.5 and ratio[3] > 1.8 and ratio[4] > 1.3
    (rises,) = way.jumps(at, up)
    (falls,) = way.jumps(at, down[::-1])
    assert rises.before < rises.after and falls.before > falls.after
    assert (
        rises.after / RPM == pytest.approx(2554.5, abs=1.5)
        and abs(rises.after - rises.before) < 0.5 * RPM
    )
    assert (
        falls.after / RPM == pytest.approx(2415.8, abs=1.5)
        and falls.extent_before > falls.extent_after
    )


def test_both_branches_attract() -> None:
    way = Continuation()
    at = mesh_at(PAIR)
    speed = 2480.0 * RPM
    up = way.follow(at, [2300.0 * RPM, 2400.0 * RPM, speed], np.zeros(6))[-1]
    down = way.follow(at, [2660.0 * RPM, 2570.0 * RPM, speed], np.zeros(6))[-1]
    assert down.extent > 1.5 * up.extent
    for point in (up, down):
        strobe, _ = Shooting(*at(speed)).integrate(
            1.0001 * point.response.state[0, 0], 400
        )
        np.testing.assert_allclose(
            strobe[-1, :3], point.response.state[0, 0, :3], rtol=1e-6
        )


def test_linear_resonance_is_steep_and_no_jump() -> None:
    pair = PAIR._replace(amplitude=1e-6, torque=3400.0)
    k = 3e8
    way = Continuation()
    at = mesh_at(pair, k)
    points = way.follow(at, list(np.linspace(2200.0, 3000.0, 9) * RPM), np.zeros(6))
    assert (
        max(p.extent for p in points) > 3.0 * min(p.extent for p in points)
        and way.jumps(at, points) == []
    )
    system = pair.system()
    point = points[4]
    omega = 2 * np.pi / mesh_period(2600.0)
    d = system.direction
    c = system.mesh_damping[0]
    dynamic = system.stiffness + k * d.T @ d - omega**2 * system.mass
    dynamic = dynamic + 1j * omega * (system.damping + c * d.T @ d)
    q = np.linalg.solve(dynamic, (k + 1j * omega * c) * d[0]) * pair.amplitude
    assert point.extent == pytest.approx(2.0 * abs(d[0] @ q - pair.amplitude), rel=5e-3)


def test_aperiodic_response_keeps_its_strobed_states() -> None:
    light = BenchmarkPair(
        torque=60.0, mesh_damping=300.0, bearing_damping=2000.0, amplitude=8e-6
    )
    point = Continuation(strobe=40).at(mesh_at(light), 4500.0 * RPM, np.zeros(6))
    assert point.response.period == 0 and point.strobe.shape == (40, 6)
    assert len(np.unique(point.strobe[:, 0].round(9))) > 30
    fourfold = Continuation(strobe=10).at(mesh_at(light), 9750.0 * RPM, np.zeros(6))
    assert (
        fourfold.response.period == 4
        and len(np.unique(fourfold.strobe[:, 0].round(12))) == 4
    )
