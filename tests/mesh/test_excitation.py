"""The three excitations: what they tabulate, and the force they return."""

import numpy as np
import pytest

from wearlab.mesh import force
from wearlab.mesh.clock import Mesh, breaks_on_clock, instants_of, sampling
from wearlab.mesh.contact import ContactAnalysis
from wearlab.mesh.damping import no_force, register
from wearlab.mesh.damping_laws import hunt_crossley
from wearlab.mesh.excitation import MeshFlanks, combined_error, stage_tables
from wearlab.mesh.excitations.fourier import FourierExcitation
from wearlab.mesh.excitations.modulated import ModulatedExcitation
from wearlab.mesh.excitations.pairs import PairsExcitation
from wearlab.mesh.force import Dashpot, Deflections, flank_forces
from wearlab.mesh.harmonics import mesh_error
from wearlab.mesh.profile import interpolate, lookup, profile_grid
from wearlab.mesh.springs import gap_rates
from wearlab.mesh.stages import stage_grid
from wearlab.mesh.stiffness import GivenStiffness, constant

K, LOAD = 2.4e8, 4824.0


@pytest.fixture(scope="module")
def grid(pair):
    return profile_grid(pair, 201)


@pytest.fixture(scope="module")
def analysis(grid):
    return ContactAnalysis(
        grid,
        GivenStiffness(constant(K), False, grid),
        np.zeros(len(grid.position)),
        LOAD,
    )


@pytest.fixture(scope="module")
def nodes(analysis, grid):
    s = grid.position
    return analysis.nodes(
        np.stack([1e-6 + 3e-4 * np.abs(s), 2e-6 * np.cos(300 * s) + 2e-6])
    )


def test_steps_land_on_breaks_in_pairs():
    grid = stage_grid(np.array([0.0, 0.75]), 30)
    assert grid.width.sum() == pytest.approx(1.0)
    for point in (0.0, 0.75):
        assert np.any(np.abs(grid.start - point) < 1e-15)
    for segment in (0, 1):
        assert np.sum(grid.segment == segment) % 2 == 0


def test_rates_of_gaps_are_exact_for_cubics(pair, grid):
    """By phase: a pair moves on by a base pitch in a mesh period."""
    s = grid.contact_position / pair.base_pitch
    gap = 1e-5 * (s**3 - 0.4 * s**2 + 0.7 * s)
    slope = 1e-5 * (3.0 * s**2 - 0.8 * s + 0.7)
    where = lookup(grid, np.linspace(0.013, 0.987, 41))
    rates = gap_rates(grid, gap, where)
    exact = interpolate(grid, where, slope, 0.0)  # a parabola, read by a cubic
    assert np.count_nonzero(exact) > 41  # one pair, and two
    np.testing.assert_allclose(rates, exact, rtol=1e-9, atol=1e-17)


def test_pairs_are_tabulated_with_both_sides_of_every_jump(pair, grid, analysis, nodes):
    meshes = (Mesh(0, 0.0, mesh_error((), ((2, 1e-6, 0.3),))),)
    at = sampling([grid], meshes, grid.breaks, stage_grid(grid.breaks[:-1], 60))
    tables = stage_tables(
        [MeshFlanks(analysis, nodes, PairsExcitation().prepare(analysis, nodes))],
        at,
        None,
    )
    phase = at.grid.phase
    for slot, ahead in ((0, 1), (1, 0)):
        s = pair.path.A + (phase + ahead) * pair.base_pitch
        middle = (s[:, 1] < pair.path.E)[:, None] & np.ones(3, bool)
        expected = 1e-6 + 3e-4 * np.abs(s) + 2e-6 * np.cos(300 * s) + 2e-6
        np.testing.assert_allclose(
            tables.stiffness[:, :, 0, slot], np.where(middle, K, 0.0)
        )
        np.testing.assert_allclose(
            tables.gap[:, :, 0, slot][middle], expected[middle], atol=1e-11
        )
    np.testing.assert_allclose(
        tables.error[:, :, 0], 1e-6 * np.sin(4 * np.pi * phase + 0.3), atol=1e-20
    )
    np.testing.assert_allclose(
        tables.error_rate[:, :, 0],
        4e-6 * np.pi * np.cos(4 * np.pi * phase + 0.3),
        atol=1e-18,
    )


def test_force_of_pairs_is_that_of_its_springs_and_the_back_flank(
    grid, analysis, nodes
):
    where = lookup(grid, np.array([0.2, 0.6, 0.9]))
    _, gap, _ = analysis.at(nodes, where)
    for delta in (2e-5, 3e-6, -1e-6, -6e-5):
        motion = Deflections(np.full(3, delta), np.zeros(3))
        force = flank_forces(
            MeshFlanks(analysis, nodes, None),
            where,
            motion,
            Dashpot(0.0, False, 5e-5),
            1.0,
        )
        for i in range(3):
            present = np.isfinite(gap[i])
            expected = np.where(
                present,
                K * np.maximum(0.0, delta - np.where(present, gap[i], 0.0)),
                0.0,
            )
            back = K * present.sum() * max(0.0, -5e-5 - delta)
            np.testing.assert_allclose(force.pair[i], expected, rtol=1e-12)
            assert force.elastic[i] == pytest.approx(expected.sum() - back, rel=1e-12)


def test_fourier_series_tends_to_the_contact_analysis(grid, analysis, nodes):
    phase, weight = grid.phase_nodes
    state = analysis.quasistatic(nodes, analysis.at_nodes)
    misfit = []
    for count in (3, 9, 27):
        series = FourierExcitation(
            stiffness_harmonics=count, error_harmonics=count
        ).prepare(analysis, nodes)
        misfit.append(weight @ (series.stiffness.value(phase) - state.tangent) ** 2)
        assert len(series.stiffness.amplitude) == count == len(series.error.amplitude)
        assert series.error.mean == pytest.approx(
            weight @ state.unloaded, rel=1e-12, abs=0.0
        )
    assert misfit[0] > misfit[1] > misfit[2]


def test_combination_rules(analysis, nodes):
    state = analysis.quasistatic(nodes, analysis.at_nodes)
    both = np.isfinite(state.gap).all(axis=1)
    for rule, expected in (("min", np.min), ("max", np.max), ("mean", np.mean)):
        found = combined_error(state, rule, "unloaded")
        np.testing.assert_allclose(found[both], expected(state.gap[both], axis=1))
        np.testing.assert_allclose(found[~both], state.gap[~both].min(axis=1))
    np.testing.assert_array_equal(
        combined_error(state, "min", "loaded"), state.deflection
    )


@pytest.mark.parametrize(
    "excitation",
    [
        FourierExcitation(stiffness_harmonics=5, error_harmonics=4),
        ModulatedExcitation(),
    ],
)
def test_series_forces_are_one_spring_split_by_the_static_share(
    grid, analysis, nodes, excitation
):
    series = excitation.prepare(analysis, nodes)
    meshes = (Mesh(0, 0.0, mesh_error((), ((1, 1e-6, 0.0),))),)
    at = sampling([grid], meshes, grid.breaks, stage_grid(grid.breaks[:-1], 40))
    tables = stage_tables([MeshFlanks(analysis, nodes, series)], at, None)
    phase = at.grid.phase
    assert tables.stiffness.shape[2:] == (1, 1) and not tables.gap.any()
    np.testing.assert_allclose(
        tables.stiffness[:, :, 0, 0], series.stiffness.value(phase)
    )
    np.testing.assert_allclose(
        tables.error[:, :, 0],
        series.error.value(phase) + 1e-6 * np.sin(2 * np.pi * phase),
        rtol=1e-12,
    )
    where = lookup(grid, np.array([0.1, 0.85]))
    delta = np.array([2e-5, 1.5e-5])
    motion = Deflections(delta, np.zeros(2))
    force = flank_forces(
        MeshFlanks(analysis, nodes, series), where, motion, Dashpot(0.0), 1.0
    )
    np.testing.assert_allclose(
        force.elastic, series.stiffness.value(where.phase) * delta
    )
    np.testing.assert_allclose(force.pair.sum(axis=1), force.elastic)
    share = analysis.quasistatic(nodes, where).force / LOAD
    np.testing.assert_allclose(force.pair, share * force.elastic[:, None], rtol=1e-10)


@pytest.mark.parametrize("law", [None, "hunt-crossley"])
def test_periods_found_at_once_are_periods_found_one_by_one(grid, analysis, nodes, law):
    """There are more periods than one block takes."""
    phases, periods = 2000, 40
    where = lookup(grid, np.linspace(0.0, 1.0, phases, endpoint=False))
    flanks = MeshFlanks(analysis, nodes, None)
    rng = np.random.default_rng(3)
    motion = Deflections(
        2e-5 * rng.standard_normal((periods, phases)),
        1e-3 * rng.standard_normal((periods, phases)),
    )
    if law is not None:
        register(hunt_crossley.HuntCrossley, hunt_crossley.in_contact, no_force)
        law = hunt_crossley.HuntCrossley(np.array([0.1]))
    dashpot = Dashpot(500.0, False, 1e-5, law)
    together = flank_forces(flanks, where, motion, dashpot, 1e-3)
    assert together.pair.size > force.BLOCK_SIZE
    for number, row in enumerate(zip(*motion, strict=True)):
        alone = flank_forces(flanks, where, Deflections(*row), dashpot, 1e-3)
        for name in together._fields:
            np.testing.assert_array_equal(
                getattr(together, name)[number], getattr(alone, name)
            )


def test_a_mesh_that_lags_repeats_the_first_later_on_the_clock(
    pair, grid, analysis, nodes
):
    """Stage tables of a lagging mesh against the same flanks asked
    directly at its own phase.
    """
    lag = 0.37
    meshes = (
        Mesh(0, 0.0, mesh_error(())),
        Mesh(0, lag, mesh_error((), ((1, 1e-6, 0.2),))),
    )
    edges = breaks_on_clock([grid], meshes)
    at = sampling([grid], meshes, edges, stage_grid(edges[:-1], 80))
    tables = stage_tables([MeshFlanks(analysis, nodes, None)], at, None)
    own = (at.grid.phase[:, 1] - lag) % 1.0
    compliance, gap, _ = analysis.at(nodes, lookup(grid, own))
    present = np.isfinite(compliance)
    np.testing.assert_allclose(tables.stiffness[:, 1, 1], 1.0 / compliance, rtol=1e-12)
    np.testing.assert_allclose(tables.gap[:, 1, 1][present], gap[present], rtol=1e-9)
    np.testing.assert_allclose(
        tables.error[:, :, 1],
        1e-6 * np.sin(2 * np.pi * (at.grid.phase - lag) + 0.2),
        atol=1e-18,
    )
    entry = np.searchsorted(edges, lag)
    assert edges[entry] == pytest.approx(lag, abs=1e-12)


@pytest.mark.parametrize("lags", [(0.0, 1 / 3, 2 / 3), (0.2, 0.2, 0.2)])
def test_planets_that_are_alike_are_looked_up_once(lags, grid, analysis, nodes):
    """Three planets, one after another or at once, take a third of the places, and
    find what a mesh of their lag finds alone on the same clock.
    """
    planets = tuple(Mesh(0, lag, mesh_error(())) for lag in lags)
    edges = breaks_on_clock([grid], planets)
    steps = stage_grid(edges[:-1], 81, 6)
    flanks = [MeshFlanks(analysis, nodes, None)]
    at = sampling([grid], planets, edges, steps)
    assert len(at.where[0].where.phase) == 3 * len(steps.width)
    together = stage_tables(flanks, at, None)
    for number, planet in enumerate(planets):
        alone = stage_tables(flanks, sampling([grid], (planet,), edges, steps), None)
        for found, expected in zip(
            together.springs[:3], alone.springs[:3], strict=True
        ):
            np.testing.assert_allclose(
                found[:, :, number], expected[:, :, 0], rtol=1e-10, atol=1e-16
            )


def test_own_phases_meet_the_clock_on_their_own_side_of_a_break(grid, analysis):
    lag = 0.62
    edges = breaks_on_clock(
        [grid], (Mesh(0, 0.0, mesh_error(())), Mesh(0, lag, mesh_error(())))
    )
    own = analysis.at_nodes
    when = instants_of(grid, lag, own, edges)
    assert np.all(when.phase >= edges[when.segment] - 1e-12)
    assert np.all(when.phase <= edges[when.segment + 1] + 1e-12)
    middle = 0.5 * (edges[when.segment] + edges[when.segment + 1])
    own_segment = np.searchsorted(grid.breaks, (middle - lag) % 1.0, side="right") - 1
    np.testing.assert_array_equal(own_segment, own.segment)
    turns = when.phase - lag - own.phase
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-12)
