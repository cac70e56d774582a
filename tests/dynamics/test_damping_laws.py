"""Damping laws that are not linear: against SciPy with the law
written out, momentum, collisions, films.
"""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from benchmark_pair import BenchmarkPair, mesh_period
from momentum_balance import unbalanced
from plain_planetary import BREAKS, PERIOD, planetary, torsional
from plain_planetary import tables as meshes
from scipy.integrate import quad, solve_ivp

from wearlab.dynamics.forces.energy import energy_balance
from wearlab.dynamics.forces.mesh_forces import extremes
from wearlab.dynamics.methods.newmark import Newmark
from wearlab.dynamics.methods.rk4 import RungeKutta4
from wearlab.dynamics.methods.rk45 import RungeKutta45
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.shooting import Shooting
from wearlab.mesh.damping import apart_force, contact_force
from wearlab.mesh.damping_laws import MeshesInOperation
from wearlab.mesh.damping_laws.hunt_crossley import HuntCrossleyDamping
from wearlab.mesh.damping_laws.squeeze_film import SqueezeFilmDamping
from wearlab.mesh.stages import stage_grid

PAIR = BenchmarkPair(amplitude=6e-6, torque=150.0, damping_always=False, backlash=40e-6)
PERIOD_OF_PAIR = mesh_period(6000.0)
LOSS, FILM, THICKNESS = 0.4, 3e-6, 1e-6


def law_of(name: str, count: int = 1) -> Any:
    """Return a law for some meshes."""
    if name == "hunt-crossley":
        built = HuntCrossleyDamping(model=name, loss=f"{LOSS} s/m").build(
            operation(count)
        )
        assert built.loss.tolist() == [LOSS] * count
        return built
    law = SqueezeFilmDamping(model=name).build(operation(count))
    return law._replace(film=np.full(count, FILM), thickness=np.full(count, THICKNESS))


def operation(count: int = 1) -> MeshesInOperation:
    return MeshesInOperation(
        *(np.full(count, value) for value in (1000.0, 2000.0, 12e-3, 20e-3)), 0.012
    )


def written_out(name: str, k: float, c: float, x: float, rate: float) -> float:
    """Return the normal force of one flank that is compressed by ``x`` (negative:
    apart), by its formula.
    """
    if name == "hunt-crossley":
        return k * max(x, 0.0) * max(0.0, 1.0 + LOSS * rate)
    if x > 0.0:
        return max(0.0, k * x + c * rate)
    return FILM * max(rate, 0.0) / (THICKNESS - x) ** 1.5


def by_scipy(name: str, start: np.ndarray) -> np.ndarray:
    """Return where the pair is after a mesh period by DOP853 and
    Newton's law written out.
    """
    system = PAIR.system()
    inverse = np.linalg.inv(system.mass)
    d = system.direction[0]

    def motion(time: float, y: np.ndarray, middle: float) -> np.ndarray:
        phase = time / PERIOD_OF_PAIR
        q = y[:3]
        v = y[3:]
        k = float(PAIR.stiffness(np.array(phase), np.array(middle)))
        delta = d @ q - PAIR.amplitude * np.sin(2.0 * np.pi * phase)
        rate = d @ v - 2.0 * np.pi * PAIR.amplitude / PERIOD_OF_PAIR * np.cos(
            2.0 * np.pi * phase
        )
        normal = written_out(name, k, PAIR.mesh_damping, delta, rate)
        normal -= written_out(name, k, PAIR.mesh_damping, -delta - PAIR.backlash, -rate)
        return np.r_[
            v,
            inverse
            @ (system.load - d * normal - system.stiffness @ q - system.damping @ v),
        ]

    state = start
    ends = [*PAIR.breaks, 1.0]
    for low, high in pairwise(ends):
        span = (low * PERIOD_OF_PAIR, high * PERIOD_OF_PAIR)
        state = solve_ivp(
            motion,
            span,
            state,
            "DOP853",
            args=(0.5 * (low + high),),
            rtol=1e-11,
            atol=1e-16,
            max_step=1e-3 * PERIOD_OF_PAIR,
        ).y[:, -1]
    return np.asarray(state)


BOTH = ["hunt-crossley", pytest.param("squeeze-film", marks=pytest.mark.slow)]
"""Laws of a whole motion: each is compiled for itself, and shares all but its two
functions of one flank."""


@pytest.mark.parametrize("name", BOTH)
def test_a_parting_pair_closes_under_scipy_with_the_law_written_out(name: str) -> None:
    system = PAIR.system()._replace(damping_law=law_of(name))
    errors = []
    for steps in (600, 2400):
        response = Periodic().solve(
            system, PAIR.tables(PAIR.grid(steps)), PERIOD_OF_PAIR
        )
        assert response.period == 1 and extremes(response).separated[0] > 0.05
        start = response.state[0, 0]
        errors.append(
            np.abs(by_scipy(name, start)[:3] - start[:3]).max()
            / np.abs(start[:3]).max()
        )
    # A film stiffens without bound as flanks close in: steps must be as short as that
    # lasts.
    assert errors[1] < (1e-6 if name == "hunt-crossley" else 1e-4)
    assert errors[0] < (2e-5 if name == "hunt-crossley" else 2e-3)


@pytest.mark.parametrize("name", BOTH)
def test_the_force_that_wears_carries_the_load_and_energy_closes(name: str) -> None:
    system = PAIR.system()._replace(damping_law=law_of(name))
    response = Periodic().solve(system, PAIR.tables(PAIR.grid(6000)), PERIOD_OF_PAIR)
    assert np.abs(unbalanced(response)).max() < 1e-6
    balance = energy_balance(response, np.zeros(3))
    lost = balance.mesh_damping + balance.bearing_damping
    assert balance.mesh_damping > 0.5 * lost
    assert lost + balance.parametric + balance.moving_gaps == pytest.approx(
        0.0, abs=1e-3 * lost
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "build", "mu"),
    [("hunt-crossley", planetary, None), ("squeeze-film", torsional, 0.1)],
)
def test_a_planetary_set_carries_its_load(
    name: str, build: Any, mu: float | None
) -> None:
    system = build()._replace(damping_law=law_of(name, 6))
    response = Periodic().solve(
        system, meshes(stage_grid(BREAKS, 1500), mu, 4e-6), PERIOD
    )
    assert response.period > 0
    assert np.abs(unbalanced(response)).max() < 2e-6


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hunt-crossley", "squeeze-film"])
def test_other_methods_find_the_same_orbit(name: str) -> None:
    system = PAIR.system()._replace(damping_law=law_of(name))
    tables = PAIR.tables(PAIR.grid(1200))
    orbit = Periodic().solve(system, tables, PERIOD_OF_PAIR)
    found = extremes(orbit)
    for method, bar in (
        (RungeKutta4(), 1e-6),
        (RungeKutta45(), 1e-4),
        (Newmark(), 5e-3),
    ):
        other = extremes(method.solve(system, tables, PERIOD_OF_PAIR))
        np.testing.assert_allclose(other.largest_normal, found.largest_normal, rtol=bar)


@pytest.mark.parametrize(
    ("name", "build"),
    [
        ("hunt-crossley", "pair"),
        pytest.param("squeeze-film", "pair", marks=pytest.mark.slow),
        pytest.param("hunt-crossley", "planetary", marks=pytest.mark.slow),
    ],
)
def test_the_derivative_of_the_map_is_that_of_differences(
    name: str, build: str
) -> None:
    if build == "pair":
        system = PAIR.system()
        tables = PAIR.tables(PAIR.grid(1200))
        period = PERIOD_OF_PAIR
    else:
        system = planetary()
        tables = meshes(stage_grid(BREAKS, 400), None, 4e-6)
        period = PERIOD
    system = system._replace(damping_law=law_of(name, len(system.direction)))
    orbit = Periodic().solve(system, tables, period)
    shooting = Shooting(system, tables, period)
    start = orbit.state[0, 0]
    _, derivative = shooting.path_of(start)
    n = len(start) // 2
    scale = np.r_[
        np.full(n, np.abs(start[:n]).max()), np.full(n, np.abs(start[n:]).max())
    ]
    for row in (0, n - 1, n, 2 * n - 1):
        moved = np.zeros(2 * n)
        moved[row] = 1e-5 * scale[row]
        ahead, behind = (
            shooting.path_of(start + sign * moved)[0][-1] for sign in (1.0, -1.0)
        )
        slope = (ahead - behind) / (2e-5 * scale[row])
        np.testing.assert_allclose(
            derivative[:, row] * scale[row] / scale,
            slope * scale[row] / scale,
            atol=5e-4,
        )


def test_flanks_that_meet_part_slower_by_two_thirds_of_the_loss() -> None:
    """Hunt & Crossley 1975: ``e = 1 − ⅔ χ v`` for small losses,
    whatever stiffness and mass.
    """
    law = law_of("hunt-crossley")
    k = 3e8
    mass = 0.7
    speed = 0.01

    def motion(_: float, y: np.ndarray) -> list[float]:
        force = contact_force(law, 0, k * y[0], k, 0.0, y[1])[0] if y[0] > 0.0 else 0.0
        return [y[1], -force / mass]

    def parts(_: float, y: np.ndarray) -> float:
        return float(y[0]) if y[1] < 0.0 else 1.0

    parts.terminal = True  # type: ignore[attr-defined]
    time = 4.0 * np.sqrt(mass / k)
    end = solve_ivp(
        motion, (0.0, time), [0.0, speed], events=parts, rtol=1e-10, atol=1e-18
    ).y[1, -1]
    assert -end / speed == pytest.approx(
        1.0 - 2.0 / 3.0 * LOSS * speed, abs=0.5 * (LOSS * speed) ** 2
    )


def test_about_the_static_force_the_loss_is_that_of_the_dashpot() -> None:
    law = HuntCrossleyDamping(model="hunt-crossley").build(operation())
    static = operation().force[0]
    normal, _, damping = contact_force(law, 0, static, 3e8, 123.0, 0.02)
    assert damping == pytest.approx(1000.0) and normal == pytest.approx(
        static + 1000.0 * 0.02
    )
    assert contact_force(law, 0, static, 3e8, 123.0, -1e3) == (0.0, 0.0, 0.0)


def test_a_film_is_reynolds_equation_solved_for_a_cylinder_and_a_plane() -> None:
    """``dp/dx = −12 η V x/h³``, so p = 6 η V R/h², over ``h = h0 +
    x²/2R`` (SciPy's quadrature).
    """
    given = operation()
    law = SqueezeFilmDamping(model="squeeze-film").build(given)
    radius = given.curvature_radius[0]
    viscosity = given.viscosity
    width = given.face_width[0]
    for clearance, speed in ((0.0, 0.01), (4e-6, 0.02), (60e-6, 0.3)):
        h0 = law.thickness[0] + clearance

        def pressure(x: float, h0: float = h0, speed: float = speed) -> float:
            return 6.0 * viscosity * speed * radius / (h0 + x**2 / (2.0 * radius)) ** 2

        wide = 60.0 * np.sqrt(radius * h0)
        force = width * quad(pressure, -wide, wide, points=[0.0], limit=400)[0]
        assert apart_force(law, 0, clearance, speed)[0] == pytest.approx(
            force, rel=1e-4
        )
    assert apart_force(law, 0, 0.0, 1.0)[0] == pytest.approx(
        given.damping[0]
    )  # no jump where flanks meet
    assert apart_force(law, 0, 1e-6, -0.1) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("name", ["hunt-crossley", "squeeze-film"])
def test_tangents_are_those_of_differences(name: str) -> None:
    law = law_of(name)
    for x, rate in ((2e-6, 0.01), (2e-6, -0.02), (-3e-6, 0.05)):

        def force(x: float, rate: float) -> tuple[float, float, float]:
            if x > 0.0:
                return contact_force(law, 0, 3e8 * x, 3e8, 1000.0, rate)
            return apart_force(law, 0, -x, rate)

        _, by_place, by_rate = force(x, rate)
        slope = (force(x + 1e-10, rate)[0] - force(x - 1e-10, rate)[0]) / 2e-10
        assert by_place == pytest.approx(slope, rel=1e-5, abs=1e-3)
        slope = (force(x, rate + 1e-6)[0] - force(x, rate - 1e-6)[0]) / 2e-6
        assert by_rate == pytest.approx(slope, rel=1e-5, abs=1e-6)
