"""Planetary sets by exact steps of their linear part: independent
integration, order, derivative, limits.
"""

from math import factorial
from typing import Any

import numpy as np
import pytest
from plain_planetary import (
    ALPHA,
    BASE,
    BREAKS,
    CARRIER,
    DAMPING,
    INERTIA,
    MASS,
    OFFSET,
    PERIOD,
    PIN,
    RADIAL,
    SPEED,
    pairs,
    planetary,
    tables,
    torsional,
)
from planetary_arguments import rigid_set
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.linalg import expm

from wearlab.assembly.vibration import patient
from wearlab.dynamics.forces.energy import energy_balance, nominal_speeds
from wearlab.dynamics.forces.mesh_forces import extremes
from wearlab.dynamics.integrators.count import (
    exact_steps_per_period,
    graded_steps,
    steps_per_period,
)
from wearlab.dynamics.integrators.kernel import Dense, Propagated, kernel_of
from wearlab.dynamics.integrators.propagator import GRID, propagator_of
from wearlab.dynamics.methods.newmark import Newmark
from wearlab.dynamics.steady.integrate import OnTables
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.response import Response, deflection_at, step_forces
from wearlab.dynamics.steady.shooting import Shooting
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables, stage_grid


def segments(middle_law: Any, y: np.ndarray) -> np.ndarray:
    """Integrate one period from break to break."""
    for low, high in zip(BREAKS, [*BREAKS[1:], 1.0], strict=True):
        law = middle_law(0.5 * (low + high))
        span = (low * PERIOD, high * PERIOD)
        y = solve_ivp(law, span, y, method="DOP853", rtol=1e-10, atol=1e-15).y[:, -1]
    return y


def plain_law(system: System) -> Any:
    inverse = np.linalg.inv(system.mass)
    n = len(system.load)

    def of(middle: float) -> Any:
        def rate(time: float, y: np.ndarray) -> np.ndarray:
            phase = time / PERIOD
            force = system.load.copy()
            for m, d in enumerate(system.direction):
                angle = 2 * np.pi * phase + m
                delta = d @ y[:n] - 1e-6 * np.sin(angle)
                speed = d @ y[n:] - 2e-6 * np.pi / PERIOD * np.cos(angle)
                elastic = sum(
                    float(k) for k, _, _ in pairs(m, phase, middle, 0.0)
                ) * max(delta, 0.0)
                force -= d * (
                    elastic + (system.mesh_damping[m] * speed if delta > 0.0 else 0.0)
                )
            force -= system.total_stiffness @ y[:n] + system.total_damping @ y[n:]
            return np.r_[y[n:], inverse @ force]

        return rate

    return of


def test_the_orbit_of_eighteen_degrees_of_freedom_closes_under_scipy() -> None:
    system = planetary()
    response = Periodic().solve(system, tables(stage_grid(BREAKS, 400)), PERIOD)
    assert response.verdict.deviations == () and response.counts.newton_iterations == 1
    start = response.state[0, 0]
    end = segments(plain_law(system), start.copy())
    size = np.abs(response.state[0]).max(axis=0)
    scale = np.r_[np.full(18, size[:18].max()), np.full(18, size[18:].max())]
    assert (np.abs(end - start) < 2e-6 * scale).all()


def test_two_steps_at_once_are_of_sixth_order() -> None:
    system = planetary()
    found = []
    for steps in (1600, 300, 600):
        response = Periodic().solve(system, tables(stage_grid(BREAKS, steps)), PERIOD)
        found.append(float(system.direction[0] @ response.state[0, 0, :18]))
    one = abs(found[1] - found[0])
    two = abs(found[2] - found[0])
    assert two < 1e-6 * abs(found[0]) and one > 30.0 * two


def test_derivative_of_the_affine_map_is_that_of_scipy() -> None:
    """The map is affine: any difference quotient is its derivative."""
    system = planetary()
    response = Periodic().solve(system, tables(stage_grid(BREAKS, 400)), PERIOD)
    assert isinstance(response, Response) and response.derivative is not None
    law = plain_law(system)
    rate = 2.0 * np.pi / PERIOD
    start = response.state[0, 0]
    scale = np.repeat([1.0, rate], 18)
    moved = 1e-7 * scale * np.random.default_rng(5).normal(size=36)
    expected = segments(law, start + moved) - segments(law, start.copy())
    error = np.abs(response.derivative @ moved - expected) / scale
    assert error.max() < 1e-5 * np.abs(expected / scale).max()


def test_multipliers_of_a_free_set_leave_its_rotation_out() -> None:
    """Liouville: the product of all multipliers is the contraction of the map.

    The free ones are 1.

    Rounding of the map, 1e-16, is a hundredth of the two smallest multipliers' own
    1e-10 at most.
    """
    system = torsional()
    one = tables(stage_grid(BREAKS, 400), 0.0)
    found = Periodic().solve(system, one, PERIOD)
    assert isinstance(found, Response) and len(found.multipliers) == 8
    d = system.direction
    c = system.mesh_damping
    trace = np.trace(
        np.linalg.solve(system.mass, d.T @ (c[:, None] * d) + system.total_damping)
    )
    assert np.log(np.abs(found.multipliers)).sum() == pytest.approx(
        -trace * PERIOD, abs=0.03
    )


def symmetric(steps: int = 240) -> Any:
    """Response of equal planets whose meshes differ in nothing but their lag."""
    return Periodic().solve(
        planetary(), tables(stage_grid(BREAKS, steps), amplitude=0.0), PERIOD
    )


def spectrum(values: np.ndarray, phase: np.ndarray, orders: np.ndarray) -> np.ndarray:
    """Fourier coefficients of a smooth period from uneven nodes, by
    its interpolating spline.
    """
    even = np.arange(4096) / 4096
    spline = CubicSpline(
        np.r_[phase, 1.0], np.r_[values, values[:1]], bc_type="periodic"
    )
    return np.fft.fft(spline(even))[orders] / 4096


def entering(system: System) -> np.ndarray:
    """Return accelerations by forces of the meshes, and by the load."""
    return (
        np.vstack([system.force_vectors[1], system.load]) @ np.linalg.inv(system.mass).T
    )


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
def test_the_rule_for_exact_steps_meets_its_tolerance_and_little_more(
    tolerance: float,
) -> None:
    """Read at any phase, right after pairs enter, too, where the mesh rings."""
    system = planetary()
    phase = np.linspace(0.0, 0.999, 401)
    steps = exact_steps_per_period(system, 4e8, PERIOD, tolerance, len(BREAKS))
    assert steps < 0.5 * steps_per_period(system, 4e8, PERIOD, tolerance, len(BREAKS))
    found = []
    for count in (steps, 4 * steps):
        grid = stage_grid(BREAKS, count)
        response = Periodic().solve(system, tables(grid, amplitude=0.2e-6), PERIOD)
        found.append(deflection_at(response, grid, phase)[0])
    error = np.abs(found[1] - found[0]).max() / np.abs(found[1]).max()
    assert 1e-3 * tolerance < error < tolerance


def test_steps_of_hundreds_of_radians_are_exact() -> None:
    """Against the exponential of SciPy, inputs as the derivatives of their powers
    beside the state.
    """
    system = planetary()
    grid = stage_grid(BREAKS, 200)
    given = tables(grid)
    period = 100.0 * PERIOD
    found, _ = propagator_of(system, entering(system), given, period)
    h = 2.0 * given.width.max() * period
    longest = found.double
    n = len(system.load)
    inverse = np.linalg.inv(system.mass)
    d = system.direction
    spring = system.total_stiffness + d.T @ (found.stiffness[:, None] * d)
    damper = system.total_damping + d.T @ (found.damping[:, None] * d)
    assert np.sqrt(np.abs(np.linalg.eigvals(inverse @ spring)).max()) * h > 100.0
    whole = np.zeros(
        (2 * n + 5, 2 * n + 5)
    )  # the state, then one load as t⁴/4!, t³/3!, …, 1
    whole[:n, n : 2 * n] = np.eye(n)
    whole[n : 2 * n, : 2 * n] = -inverse @ np.hstack([spring, damper])
    whole[n : 2 * n, 2 * n] = inverse @ system.load
    whole[2 * n : -1, 2 * n + 1 :] = np.eye(4)
    moved = expm(h * whole)
    _, to_end = np.split(longest.transition[-1], 2)
    np.testing.assert_allclose(
        to_end, moved[: 2 * n, : 2 * n], atol=1e-9 * np.abs(moved).max()
    )
    # the load is the input after those of the meshes
    nodes = np.linspace(0.0, 1.0, 5)
    at = len(d)
    _, fed_by_end = np.split(longest.inputs[-1], 2)
    fed = fed_by_end.reshape(2 * n, 5, -1)[:, :, at]
    for power in range(5):
        expected = moved[: 2 * n, 2 * n + power] * factorial(power) / h**power
        np.testing.assert_allclose(
            fed @ nodes**power, expected, atol=1e-9 * np.abs(expected).max()
        )


@pytest.mark.parametrize("turns", [16.0, 400.0])
def test_steps_of_a_slow_set_grow_after_every_jump(turns: float) -> None:
    """At 63 rpm they give what equal ones give.

    At 2.5 rpm the largest force is that of the jump alone.
    """
    system = planetary()
    period = turns * PERIOD
    grid = graded_steps(system, 4e8, period, 1e-3, BREAKS)
    equal = exact_steps_per_period(system, 4e8, period, 1e-3, len(BREAKS))
    assert grid is not None and np.isclose(grid.width.sum(), 1.0, rtol=1e-12)
    assert (grid.width[::2] == grid.width[1::2]).all() and len(grid.width) < min(
        equal, 30_000
    )
    forces = []
    for cut, lasts in (
        (grid, period),
        (stage_grid(BREAKS, equal // round(turns / 16.0)), 16.0 * PERIOD),
    ):
        response = Periodic().solve(system, tables(cut), lasts)
        assert response.verdict.deviations == ()
        forces.append(extremes(response).largest)
    np.testing.assert_allclose(
        forces[0], forces[1], rtol=1e-3 if turns == 16.0 else 1e-2
    )


def test_steps_of_modes_of_any_rate_are_the_same_in_their_own_time() -> None:
    """A hundred thousand times faster: rates near 1e10 rad/s, whose powers would
    overflow in seconds.

    The factor keeps the mean stiffness of the linear part on its grid.
    """
    period = 3.2 * PERIOD
    grid = stage_grid(BREAKS, 200)
    slow = planetary()
    fast = float(np.exp(230 * GRID))
    system = slow._replace(
        damping=fast * slow.damping,
        stiffness=fast**2 * slow.stiffness,
        mesh_damping=fast * slow.mesh_damping,
        load=fast**2 * slow.load,
        rotation=fast * slow.rotation,
    )
    one = tables(grid)
    other = tables(grid)
    other = other._replace(stiffness=fast**2 * other.stiffness)
    expected, found = (
        propagator_of(system, entering(system), given, period)[0].double
        for system, given, period in (
            (slow, one, period),
            (system, other, period / fast),
        )
    )
    size = np.repeat([1.0, fast], 18)
    to_ends = (np.split(steps.transition, 2, axis=1) for steps in (found, expected))
    for moved, known in zip(*to_ends, strict=True):
        scaled = moved / size[:, None] * size
        np.testing.assert_allclose(
            scaled, known, rtol=1e-9, atol=2e-14 * np.abs(known).max()
        )
    orbits = [
        Periodic().solve(slow, one, period),
        Periodic().solve(system, other, period / fast),
    ]
    projected = [orbit.state[..., :18] @ slow.direction.T for orbit in orbits]
    np.testing.assert_allclose(
        projected[1], projected[0], atol=1e-7 * np.abs(projected[0]).max()
    )


def test_marches_of_large_systems_are_bounded_in_steps() -> None:
    """A march that finds no orbit ends, whatever a period takes.

    A short period gets the march it wants.
    """
    assert patient(Periodic(), planetary(), 216) == Periodic()
    for steps in (500, 2000, 20_000):
        method = patient(Periodic(), planetary(), steps)
        assert isinstance(method, Periodic) and method.longest >= 2
        assert steps * (4 * method.transient + 2 * method.averaged) < 2e6


def test_equal_planets_share_the_load_equally() -> None:
    """In the mean, and at every instant one lag later."""
    response = symmetric()
    forces = step_forces(response)
    tabled = response.tables
    total = forces.normal[0]
    mean = np.einsum("s,sm->m", tabled.width, total.mean(axis=1))
    np.testing.assert_allclose(mean, 90.0 / 3 / BASE["sun"], rtol=1e-3)
    np.testing.assert_allclose(mean, np.repeat(mean[[0, 3]], 3), rtol=1e-9)
    start = np.r_[0.0, np.cumsum(tabled.width)[:-1]]
    deflection = response.state[0, :-1, :18] @ response.system.direction.T
    own = np.linspace(0.0, 1.0, 50, endpoint=False)
    shown = [
        np.interp(
            (own + OFFSET[m]) % 1.0,
            np.r_[start, 1.0],
            np.r_[deflection[:, m], deflection[:1, m]],
        )
        for m in range(6)
    ]
    for first in (0, 3):
        spread = np.ptp(shown[first])
        assert spread > 1e-8
        for other in (1, 2):
            np.testing.assert_allclose(
                shown[first + other], shown[first], atol=5e-3 * spread
            )


def test_harmonics_excite_what_their_order_lets_them() -> None:
    """Order l of three equal planets: rotations alone where 3 divides
    it, translations alone elsewhere.
    """
    response = symmetric()
    phase = np.r_[0.0, np.cumsum(response.tables.width)[:-1]]
    orders = np.arange(1, 10)
    thirds = orders % 3 == 0
    for member in range(3):
        x, y, u = response.state[0, :-1, 3 * member : 3 * member + 3].T
        planar = np.hypot(*(np.abs(spectrum(one, phase, orders)) for one in (x, y)))
        turning = np.abs(spectrum(u, phase, orders))
        assert (
            planar[thirds].max() < 1e-5 * planar[~thirds].max()
            and planar[~thirds].max() > 1e-11
        )
        assert (
            turning[~thirds].max() < 1e-5 * turning[thirds].max()
            and turning[thirds].max() > 1e-11
        )


def test_energy_of_the_translating_set_closes_and_every_term_counts() -> None:
    """Seen from the carrier, whose turning the gyroscopic and centripetal terms say."""
    system = planetary()
    response = Periodic().solve(system, tables(stage_grid(BREAKS, 400)), PERIOD)
    speeds = nominal_speeds(
        system, {"sun.u": (SPEED - CARRIER) * BASE["sun"], "carrier.u": 0.0}
    )
    balance = energy_balance(response, speeds)
    missing = abs(balance.residual) * balance.input
    assert balance.input == pytest.approx(90.0 * (SPEED - CARRIER), rel=1e-9)
    assert missing < 1e-5 * balance.bearing_damping
    for term in (
        balance.bearing_damping,
        balance.mesh_damping,
        balance.parametric,
        balance.moving_gaps,
    ):
        assert abs(term) > 10.0 * missing


def test_one_planet_on_rigid_bearings_is_a_pair() -> None:
    """Sun against a planet that a rigid mesh ties to the ring: two coordinates,
    integrated by SciPy.

    Bearings are rigid by stiffness and by mass, which keeps their modes slow.
    """
    rigid, held = 2e11, 2e7
    set_of_one = planetary(
        rigid=rigid_set(
            dict.fromkeys(MASS, 1e6),
            INERTIA | {"carrier": 1e6 * PIN**2},
            BASE,
            PIN,
            ALPHA,
            [0.7],
        ),
        radial_stiffness=dict.fromkeys(RADIAL, 1e14),
        radial_damping={},
        tangential_stiffness={"carrier": 1e14, "ring": held},
        tangential_damping={"ring": 700.0},
        mesh_damping={"sun_planet": DAMPING["sun_planet"], "planet_ring": 0.0},
        carrier_speed=0.0,
    )
    response = Periodic().solve(
        set_of_one, one_planet(tables(stage_grid(BREAKS, 1000)), rigid), PERIOD
    )
    u = [set_of_one.coordinates.index(name) for name in ("sun.u", "planet-1.u")]
    start = response.state[0, 0][[*u, *(12 + at for at in u)]]
    second = (
        INERTIA["planet"] / BASE["planet"] ** 2 + INERTIA["ring"] / BASE["ring"] ** 2
    )

    def pair(middle: float) -> Any:
        def rate(time: float, y: np.ndarray) -> np.ndarray:
            phase = time / PERIOD
            delta = y[0] + y[1] - 1e-6 * np.sin(2 * np.pi * phase)
            speed = y[2] + y[3] - 2e-6 * np.pi / PERIOD * np.cos(2 * np.pi * phase)
            force = sum(float(k) for k, _, _ in pairs(0, phase, middle, 0.0)) * max(
                delta, 0.0
            )
            force += set_of_one.mesh_damping[0] * speed if delta > 0.0 else 0.0
            first = (90.0 / BASE["sun"] - force) / (INERTIA["sun"] / BASE["sun"] ** 2)
            return np.r_[y[2:], first, (-force - held * y[1] - 700.0 * y[3]) / second]

        return rate

    end = segments(pair, start.copy())
    scale = (
        np.abs(response.state[0][:, u]).max(),
        np.abs(response.state[0][:, [12 + at for at in u]]).max(),
    )
    np.testing.assert_allclose(end[:2], start[:2], atol=5e-3 * scale[0])
    np.testing.assert_allclose(end[2:], start[2:], atol=5e-3 * scale[1])


def one_planet(given: StageTables, rigid: float) -> StageTables:
    """The first sun–planet mesh, and a planet–ring mesh of one stiff
    pair without error.
    """
    names = ("stiffness", "gap", "error", "error_rate")
    each = {name: getattr(given, name)[:, :, [0, 3]].copy() for name in names}
    each["stiffness"][:, :, 1] = 0.5 * rigid
    for name in ("error", "error_rate"):
        each[name][:, :, 1] = 0.0
    return given._replace(**each)


@pytest.mark.slow
def test_separating_flanks_go_by_parts_of_steps() -> None:
    """From a state of rest flanks part and meet.

    Runge–Kutta steps, finer, find the same end of a period.

    Both pairs of a mesh have the same gap here: they part at the same instant.
    """
    for torque, amplitude in ((40.0, 2e-6), (8.0, 3e-6)):
        ends = []
        for steps, way in ((800, Propagated), (1600, Dense)):
            state = np.zeros(36)
            state[2] = 2e-6
            grid = stage_grid(BREAKS, steps)
            given = tables(grid, amplitude=amplitude)
            marcher = OnTables(kernel_of(planetary(torque), given, PERIOD, way=way))
            marcher.integrate(state, 1)
            ends.append(state)
        error = np.abs(ends[0] - ends[1])
        assert error[:18].max() < 1e-5 * np.abs(ends[1][:18]).max()
        assert error[18:].max() < 1e-3 * np.abs(ends[1][18:]).max()


@pytest.mark.slow
def test_derivative_of_the_map_with_separation() -> None:
    system = planetary(30.0)
    grid = stage_grid(BREAKS, 600)
    smooth = Periodic().solve(system, tables(grid, amplitude=0.2e-6), PERIOD)
    shooting = Shooting(system, tables(grid, amplitude=2.5e-6), PERIOD)
    state = smooth.state[0, 0]
    path, derivative = shooting.path_of(state)
    assert np.isfinite(path).all()
    for column, step in (
        (2, 1e-11),
        (9, 1e-11),
        (20, 1e-11 * shooting.rate),
        (35, 1e-11 * shooting.rate),
    ):
        moved = np.zeros(36)
        moved[column] = step
        up, down = (
            shooting.path_of(state + sign * moved)[0][-1] for sign in (1.0, -1.0)
        )
        numeric = (up - down) / (2 * step)
        assert (
            np.abs(numeric - derivative[:, column]).max() < 1e-3 * np.abs(numeric).max()
        )


@pytest.mark.slow
def test_a_trajectory_alone_is_that_beside_its_tangents() -> None:
    """A single column has code of its own, in the steps and between
    changes of contact.
    """
    system = planetary(30.0)
    grid = stage_grid(BREAKS, 200)
    smooth = Periodic().solve(system, tables(grid, amplitude=0.2e-6), PERIOD)
    shooting = Shooting(system, tables(grid, amplitude=2.5e-6), PERIOD)
    beside, _ = shooting.path_of(smooth.state[0, 0])
    alone = shooting.states(1)
    changes = shooting.advance(alone, smooth.state[0, 0].copy(), tangents=False)
    assert changes > 0
    size = np.abs(beside).max(axis=0)
    assert (np.abs(alone[:, :, 0] - beside) <= 1e-10 * size).all()


@pytest.mark.slow
def test_warm_start_with_a_neighbours_derivative_finds_the_same_orbit() -> None:
    grid = stage_grid(BREAKS, 200)
    system = planetary()
    first = tables(grid)
    second = tables(grid, amplitude=1.2e-6)
    second = second._replace(stiffness=1.01 * second.stiffness)
    neighbour = Periodic().solve(system, first, PERIOD)
    shooting = Shooting(system, second, PERIOD)
    warm = shooting.chord(neighbour)
    assert (
        warm is not None
        and warm.derivative is neighbour.derivative
        and 2 <= shooting.maps <= 8
    )
    cold = shooting.shoot(1, neighbour.state[0, 0].copy())
    assert cold is not None
    np.testing.assert_allclose(
        warm.state, cold.state, atol=1e-7 * np.abs(cold.state).max()
    )


@pytest.mark.slow
def test_a_free_set_is_the_limit_of_a_weakly_grounded_one() -> None:
    grid = stage_grid(BREAKS, 200)
    free = planetary(carrier_stiffness=0.0, friction=True, balanced="carrier")
    held = planetary(carrier_stiffness=1e3)
    found = Periodic().solve(free, tables(grid, 0.0), PERIOD)
    expected = Periodic().solve(held, tables(grid), PERIOD)
    deflection = [r.state[0, :, :18] @ free.direction.T for r in (found, expected)]
    np.testing.assert_allclose(
        deflection[0], deflection[1], atol=1e-3 * np.abs(deflection[1]).max()
    )
    np.testing.assert_allclose(
        found.system.load, free.load, atol=1e-5 * np.abs(free.load).max()
    )
    assert found.verdict.deviations == ()


def b23_law(load: float, mu: float) -> Any:
    """B23 as rederived, in angles: the planets' clockwise, every
    lever arm written out.
    """
    r = BASE
    alpha = np.array([*[ALPHA["sun_planet"]] * 3, *[ALPHA["planet_ring"]] * 3])
    damping = np.repeat([DAMPING["sun_planet"], DAMPING["planet_ring"]], 3)
    inertia = INERTIA["carrier"] + 3 * MASS["planet"] * PIN**2

    def of(middle: float) -> Any:
        def rate(time: float, y: np.ndarray) -> np.ndarray:
            phase = time / PERIOD
            sun = y[0]
            carrier = y[1]
            planets = y[2:5]
            v_sun = y[5]
            v_carrier = y[6]
            v_planets = y[7:10]
            t_sun = 90.0
            t_carrier = -load
            t_planet = np.zeros(3)
            for m in range(6):
                n = m % 3
                inner = m < 3
                angle = 2 * np.pi * phase + m
                cos = np.cos(alpha[m])
                approach, speed = (
                    r["sun"] * s - r["planet"] * p - PIN * cos * c
                    if inner
                    else r["planet"] * p - PIN * cos * c
                    for s, p, c in (
                        (sun, planets[n], carrier),
                        (v_sun, v_planets[n], v_carrier),
                    )
                )
                delta = approach - 1e-6 * np.sin(angle)
                speed = speed - 2e-6 * np.pi / PERIOD * np.cos(angle)
                total = rubbed = moment = 0.0
                springs = pairs(m, phase, middle, mu)
                every = sum(float(k) for k, _, _ in springs)
                for k, sliding, s in springs:
                    pair = 0.0
                    if delta > 0.0:  # what deforms is damped, and does not pull
                        pair = max(0.0, float(k) * (delta + damping[m] * speed / every))
                    total = total + pair
                    rubbed = rubbed + sliding * pair
                    moment += sliding * pair * s
                tan = np.tan(alpha[m])
                if inner:
                    t_sun -= total * r["sun"] + rubbed * r["sun"] * tan + moment
                    t_planet[n] += (
                        total * r["planet"] + rubbed * r["planet"] * tan - moment
                    )
                else:
                    t_planet[n] -= (
                        total * r["planet"] + rubbed * r["planet"] * tan + moment
                    )
                t_carrier += PIN * (total * cos + rubbed * np.sin(alpha[m]))
            accelerations = [
                t_sun / INERTIA["sun"],
                t_carrier / inertia,
                *t_planet / INERTIA["planet"],
            ]
            return np.r_[y[5:], accelerations]

        return rate

    return of


@pytest.mark.parametrize("mu", [0.1, 0.5])
def test_torsional_set_with_friction_closes_under_scipy_and_in_energy(
    mu: float,
) -> None:
    system = torsional()
    response = Periodic().solve(system, tables(stage_grid(BREAKS, 400), mu), PERIOD)
    radius = np.array([BASE["sun"], PIN, *[-BASE["planet"]] * 3])
    start = response.state[0, 0] / np.r_[radius, radius]
    load = -response.system.load[1] * PIN
    end = segments(b23_law(load, mu), start.copy())
    size = np.abs(start).reshape(2, -1).max(axis=1).repeat(5)
    assert (np.abs(end - start) < 3e-6 * size).all()
    speeds = nominal_speeds(system, {"sun.u": SPEED * BASE["sun"]})
    balance = energy_balance(response, speeds)
    assert abs(balance.residual) < 1e-6 and balance.friction > 0.0
    assert balance.efficiency == pytest.approx(
        load / PIN * speeds[1] / (90.0 * SPEED), rel=1e-6
    )


@pytest.mark.parametrize("free", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_newmark_comes_to_the_same_response_with_second_order(free: bool) -> None:
    """The paper's method, marched: B23's set with friction, whose
    load is found, and eighteen degrees.
    """
    system, mu = (torsional(), 0.1) if free else (planetary(), None)
    phase = np.linspace(0.0, 0.999, 101)
    grid = stage_grid(BREAKS, 600)
    response = Periodic().solve(system, tables(grid, mu), PERIOD)
    exact = deflection_at(response, grid, phase)[0]
    error = []
    for steps in (400, 800):
        grid = stage_grid(BREAKS, steps)
        marched = Newmark(tolerance=1e-5).solve(system, tables(grid, mu), PERIOD)
        error.append(
            np.abs(deflection_at(marched, grid, phase)[0] - exact).max()
            / np.abs(exact).max()
        )
        assert marched.period == 1
        np.testing.assert_allclose(
            marched.system.load,
            response.system.load,
            rtol=1e-3,
            atol=1e-3 * np.abs(system.load).max(),
        )
    assert error[1] < 0.012 and np.log2(error[0] / error[1]) == pytest.approx(
        1.9, abs=0.15
    )


@pytest.mark.slow
@pytest.mark.parametrize(("amplitude", "passes"), [(50e-6, 1), (200e-6, 2)])
def test_an_orbit_found_by_chords_says_whether_its_flanks_always_touch(
    amplitude: float, passes: int
) -> None:
    """If they do, the next orbit is first looked for where no flank parts."""
    grid = stage_grid(BREAKS, 200)
    system = planetary(8.0)
    neighbour = Periodic().solve(system, tables(grid, amplitude=amplitude), PERIOD)
    assert (neighbour.counts.newton_iterations == 1) == (passes == 1)
    near = tables(grid, amplitude=1.0001 * amplitude)
    shooting = Shooting(system, near, PERIOD)
    assert shooting.chord(neighbour) is not None and shooting.iterations == passes


@pytest.mark.parametrize("of", ["free", "grounded"])
def test_a_neighbour_of_flanks_that_touch_is_found_in_two_periods(of: str) -> None:
    """One of the affine map by the neighbour's derivative, and with its load, and one
    that finds no change of contact.
    """
    grid = stage_grid(BREAKS, 200)
    system, mu = (torsional(), 0.1) if of == "free" else (planetary(), None)
    neighbour = Periodic().solve(system, tables(grid, mu, amplitude=1e-6), PERIOD)
    near = tables(grid, mu, amplitude=1.1e-6)
    warm = Periodic().solve(system, near, PERIOD, neighbour)
    assert warm.counts.newton_iterations == 1 and warm.counts.period_maps == 2
    cold = Periodic().solve(system, near, PERIOD)
    scale = np.abs(cold.state).max(axis=(0, 1))
    assert (np.abs(warm.state - cold.state) <= 1e-7 * scale).all()
    np.testing.assert_allclose(warm.system.load, cold.system.load, rtol=1e-9)
