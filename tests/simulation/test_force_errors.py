"""The estimated error of the largest mesh force against orbits that
SciPy's DOP853 closes.
"""

from typing import Any

import numpy as np
import pytest
from estimate_score import reference
from scenes import CAMPAIGNS, VIBRATING_PAIR

from wearlab.accuracy.reference import second_method
from wearlab.accuracy.steady import steady
from wearlab.assembly import build
from wearlab.campaign import load
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.scene import Scene
from wearlab.simulation import companion_runs, simulate
from wearlab.simulation.companion_runs import error_of_largest

pytestmark = pytest.mark.usefixtures("alone")

SCENE: dict[str, Any] = VIBRATING_PAIR | {
    "mesh": {"damping_ratio": 0.05, "normal_backlash": "100 um"},
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
    run = simulate(scene)
    problem = steady(scene)
    edge = problem.parts.edges
    sides = np.concatenate([edge[:-1] + 1e-9, edge[1:] - 1e-9])
    phase = np.sort(np.concatenate([(np.arange(3000) + 0.5) / 3000, sides]))
    vars(problem.parts)["phase"] = phase  # instead of the stored ones
    response = problem.solve(problem.with_steps(1000, Periodic()))
    truth = float(
        second_method(problem, problem.motion(response.system), response).max()
    )
    estimate = float(run.error_estimate_mesh_force_max[-1])
    assert abs(float(run.mesh_force_max[-1, 0]) - truth) <= estimate < 5e-3 * truth


def test_the_largest_is_off_by_no_more_than_the_error_where_it_may_lie() -> None:
    x = np.linspace(0.0, 1.0, 1001)
    values = np.where(x < 0.5, 10.0 * x, 2.0)
    beside_a_jump = np.where(x > 0.9, 1.0, 0.01)
    assert error_of_largest(values, beside_a_jump) == pytest.approx(0.01)
    far_off = np.where(x > 0.9, 5.0, 0.01)
    assert error_of_largest(values, far_off) == pytest.approx(
        2.0 + 5.0 - float(values.max())
    )


def test_the_largest_of_what_is_off_lies_within_its_error() -> None:
    random = np.random.default_rng(3)
    phase = np.linspace(0.0, 2.0 * np.pi, 400)
    for _ in range(300):
        amplitude, shift = random.normal(size=2)
        values = np.cos(phase) + amplitude * np.cos(3.0 * phase + shift)
        error = np.abs(random.normal(size=1)) * (1.0 + np.sin(phase) ** 2)
        true = values + error * random.uniform(-1.0, 1.0, len(phase))
        apart = abs(float(true.max() - values.max()))
        assert apart <= error_of_largest(values, error) + 1e-12


BASE = CAMPAIGNS / "base"


@pytest.fixture(scope="module")
def table() -> tuple[Scene, float]:
    """The benchmark pair far above resonance, and its largest force
    by DOP853 at 6,000 places.
    """
    pair = load(BASE / "benchmark_pair.toml").cases[0].scene
    scene = pair.replace("operation.speed", "30000 rpm").replace(
        "numerics.profile_points", 61
    )
    problem = steady(scene)
    phase = (np.arange(6000) + 0.5) / 6000
    vars(problem.parts)["phase"] = phase  # instead of the stored ones
    response = problem.solve(problem.with_steps(600, Periodic()))
    return scene, float(
        second_method(problem, problem.motion(response.system), response).max()
    )


def test_the_largest_force_over_a_table_is_what_dop853_finds(
    table: tuple[Scene, float],
) -> None:
    scene, truth = table
    run = simulate(scene)
    assert int(run.count_steps_per_period) == len(
        build(scene).vibration.sampling.grid.width
    )
    missed = abs(float(run.mesh_force_max[-1, 0]) - truth)
    assert missed < 1e-5 * truth and missed <= float(
        run.error_estimate_mesh_force_max[-1]
    )


def test_a_misread_table_is_seen(
    table: tuple[Scene, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Parabolas over few steps miss the ramp of the table, and the twin's more so."""
    scene, truth = table
    monkeypatch.setattr("wearlab.life.vibration.Between", lambda *given: None)
    run = simulate(scene)
    missed = abs(float(run.mesh_force_max[-1, 0]) - truth)
    assert 1e-5 * truth < missed <= float(run.error_estimate_mesh_force_max[-1])


def test_extremes_of_worn_sets_are_told_within_a_few_times_their_error() -> None:
    """Rougher twins told 12 times the error in the median, and up to 450 times."""
    drawn = load(CAMPAIGNS / "planetary_excitation.toml").cases[0].scene
    random = np.random.default_rng(611)
    ratios = []
    for _ in range(4):
        torque, speed, depth = random.uniform([30.0, 300.0, 5.0], [180.0, 2500.0, 50.0])
        scene = drawn.replace("operation.torque", f"{torque} N*m")
        scene = scene.replace("operation.speed", f"{speed} rpm")
        scene = scene.replace("mesh.damping_ratio", float(random.uniform(0.03, 0.12)))
        scene = scene.replace("wear.until.depth", f"{depth} um")
        scene = scene.replace("wear.snapshots", None)

        last = simulate(scene).isel(update=-1)
        truth = reference(scene, float(last.cycle), 1e-4)
        largest = float(np.abs(last.mesh_force_max.values - truth.largest[0]).max())
        least = float(np.abs(last.mesh_force_min.values - truth.least[0]).max())
        told_largest = float(last.error_estimate_mesh_force_max)
        told_least = float(last.error_estimate_mesh_force_min)
        assert largest <= told_largest
        assert least <= told_least
        ratios += [told_largest / largest, told_least / least]
    assert np.median(ratios) < 10.0
    assert max(ratios) < 100.0


def test_twins_of_sets_that_cannot_be_finer_are_rougher(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    base = load(CAMPAIGNS / "planetary_excitation.toml").cases[0].scene
    scene = base.replace("wear.until.depth", "2 um").replace("wear.snapshots", None)
    finer = simulate(scene)
    monkeypatch.setattr(
        companion_runs,
        "finer_twins_of",
        lambda parts, lived: [None] * len(lived.samples.state),
    )
    rougher = simulate(scene)
    assert np.isfinite(rougher.error_estimate_mesh_force_max).all()
    assert (
        rougher.error_estimate_mesh_force_max != finer.error_estimate_mesh_force_max
    ).any()
    np.testing.assert_array_equal(rougher.wear_depth, finer.wear_depth)
