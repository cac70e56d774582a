"""The contact analysis against root finding, limits, and its own fixed point."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from wearlab.mesh.body import body_coupling
from wearlab.mesh.contact import MIN_CONTACT_LOAD_SHARE, ContactAnalysis
from wearlab.mesh.profile import lookup, profile_grid
from wearlab.mesh.series import InSeries
from wearlab.mesh.stiffness import (
    ConstantContact,
    GivenStiffness,
    PiecewiseCurve,
    SectionVanished,
    WeberContact,
    constant,
    yang_sun,
)
from wearlab.mesh.tooth import tooth_flexibility

LOAD = 4824.0


@pytest.fixture(scope="module")
def grid(pair):
    return profile_grid(pair, 101)


def given(grid, curve, of_mesh=False, **changes):
    return ContactAnalysis(
        grid,
        GivenStiffness(curve, of_mesh, grid),
        np.zeros(len(grid.position)),
        LOAD,
        **changes,
    )


def potential_energy(
    pair, grid, *, correction=(1.0, 1.0), coupling=(), partner=(), **changes
):
    """Return the contact of a pair.

    ``coupling`` (n_apart, 2, n): ratios shared with ``partner`` nodes.
    """
    n = len(grid.position)
    teeth = tuple(
        tooth_flexibility(g, pair.radius(i, grid.position))
        for i, g in enumerate(pair.gears)
    )
    bodies = np.stack(
        [tooth.foundation / by for tooth, by in zip(teeth, correction, strict=True)]
    )
    shared = np.zeros((len(partner), n))
    for out, ratio, node in zip(shared, coupling, partner, strict=True):
        out[:] = np.where(
            node < 0, 0.0, (ratio * np.sqrt(bodies * bodies[:, node])).sum(axis=0)
        )
    hertz = ConstantContact(
        yang_sun(pair.driving.material, pair.driven.material, pair.face_width)
    )
    parts = {
        "hertz": hertz,
        "rest": bodies,
        "shared": shared,
        "teeth": teeth,
        **changes,
    }
    return ContactAnalysis(grid, InSeries(**parts), np.zeros(n), LOAD)


def some_wear(grid):
    s = grid.position
    return np.stack([2e-6 + 1e-6 * np.sin(400 * s), np.abs(s) * 8e-4])


def test_equal_pairs_share_equally_and_stiffen_in_double_contact(grid):
    analysis = given(grid, constant(2.4e8))
    state = analysis.quasistatic(
        analysis.nodes(np.zeros((2, len(grid.position)))), analysis.at_nodes
    )
    double = np.all(grid.pairs_at_phase_nodes >= 0, axis=1)
    np.testing.assert_allclose(state.tangent, np.where(double, 4.8e8, 2.4e8))
    np.testing.assert_allclose(state.deflection, LOAD / state.tangent)
    np.testing.assert_allclose(state.force[double], LOAD / 2)


def test_worn_flanks_agree_with_root_finding_pair_by_pair(pair, grid):
    analysis = potential_energy(pair, grid)
    wear = some_wear(grid)
    nodes = analysis.nodes(wear)
    state = analysis.quasistatic(nodes, analysis.at_nodes)
    for i, pairs in enumerate(grid.pairs_at_phase_nodes[::7]):
        touching = pairs[pairs >= 0]
        k = 1.0 / nodes.compliance[touching]
        g = wear[0, touching] + wear[1, touching]

        def unbalanced(delta, k=k, g=g):
            return np.sum(k * np.maximum(0.0, delta - g)) - LOAD

        expected = brentq(unbalanced, 0.0, 1e-3, xtol=1e-18, rtol=1e-13)
        assert state.deflection[7 * i] == pytest.approx(expected, rel=1e-10, abs=0.0)
        assert state.unloaded[7 * i] == pytest.approx(g.min(), abs=1e-20)


def load_dependent(pair, grid):
    return WeberContact(
        pair.equivalent_curvature(grid.position),
        np.full((2, len(grid.position)), 4e-3),
        (pair.driving.material, pair.driven.material),
        pair.face_width,
    )


def test_contacts_that_soften_agree_with_root_finding_and_settle_from_anywhere(
    pair, grid
):
    hertz = load_dependent(pair, grid)
    wear = some_wear(grid)
    analysis = potential_energy(pair, grid, hertz=hertz)
    nodes = analysis.nodes(wear)
    state = analysis.quasistatic(nodes, analysis.at_nodes)
    body = analysis.stiffness.body(wear)
    gap = wear[0] + wear[1]

    def deflection_under(force, node):
        at_least = np.full(len(gap), max(force, MIN_CONTACT_LOAD_SHARE * LOAD))
        return gap[node] + (body[node] + hertz.compliance(at_least)[node]) * force

    def force_of(delta, node):
        if delta <= gap[node]:
            return 0.0
        return brentq(
            lambda force: deflection_under(force, node) - delta,
            0.0,
            1e5,
            xtol=1e-12,
            rtol=1e-14,
        )

    for i, pairs in enumerate(grid.pairs_at_phase_nodes[::9]):
        touching = pairs[pairs >= 0]
        expected = brentq(
            lambda delta, touching=touching: (
                sum(force_of(delta, node) for node in touching) - LOAD
            ),
            0.0,
            1e-4,
            xtol=1e-18,
            rtol=1e-14,
        )
        assert state.deflection[9 * i] == pytest.approx(expected, rel=1e-11, abs=0.0)
        forces = [force_of(expected, node) for node in touching]
        assert state.force[9 * i, pairs >= 0] == pytest.approx(forces, abs=1e-9 * LOAD)
    for other in (0.0 * wear, wear * (1.0 + 1e-7), 5.0 * wear):
        near = analysis.quasistatic(analysis.nodes(other), analysis.at_nodes)
        np.testing.assert_allclose(
            analysis.nodes(wear, near).compliance, nodes.compliance, rtol=1e-14
        )


def test_wear_vanishing_is_the_healthy_mesh(pair, grid):
    analysis = potential_energy(pair, grid)
    wear = some_wear(grid)
    healthy = analysis.nodes(0.0 * wear)
    before = analysis.quasistatic(healthy, analysis.at_nodes)
    change = []
    for size in (1e-3, 1e-4, 1e-5):
        nodes = analysis.nodes(size * wear)
        worn = analysis.quasistatic(nodes, analysis.at_nodes)
        change.append(np.max(np.abs(worn.deflection - before.deflection)))
    assert change[0] / change[1] == pytest.approx(10, rel=0.05)
    assert change[1] / change[2] == pytest.approx(10, rel=0.05)
    assert (
        analysis.nodes(0.0 * wear).compliance.tobytes() == healthy.compliance.tobytes()
    )


def test_the_series_of_compliances_has_every_term(pair, grid):
    full = (
        potential_energy(pair, grid).nodes(np.zeros((2, len(grid.position)))).compliance
    )
    rigid_body = potential_energy(pair, grid, correction=(np.inf, np.inf))
    no_hertz = potential_energy(pair, grid, hertz=ConstantContact(0.0))
    wear = np.zeros((2, len(grid.position)))
    hertz = yang_sun(pair.driving.material, pair.driven.material, pair.face_width)
    np.testing.assert_allclose(full - no_hertz.nodes(wear).compliance, hertz, rtol=1e-9)
    teeth = potential_energy(pair, grid).stiffness.teeth
    foundations = teeth[0].foundation + teeth[1].foundation
    np.testing.assert_allclose(
        full - rigid_body.nodes(wear).compliance, foundations, rtol=1e-9
    )
    softer = potential_energy(pair, grid, correction=(2.0, 1.0)).nodes(wear).compliance
    np.testing.assert_allclose(full - softer, 0.5 * teeth[0].foundation, rtol=1e-9)
    np.testing.assert_allclose(
        potential_energy(pair, grid, scale=1.25).nodes(wear).compliance, full / 1.25
    )


def test_engagement_by_threshold_leaves_late_pairs_out(pair, grid):
    wear = np.zeros((2, len(grid.position)))
    wear[0, grid.position > pair.path.D + 1e-9] = 3e-6
    by_load = given(grid, constant(2.4e8))
    by_gap = given(grid, constant(2.4e8), engagement_gap=2e-6)
    double = np.all(grid.pairs_at_phase_nodes >= 0, axis=1)
    inside = double & (grid.phase_nodes[0] > 0.01) & (grid.phase_nodes[0] < 0.7)
    loaded = by_load.quasistatic(by_load.nodes(wear), by_load.at_nodes)
    gated = by_gap.quasistatic(by_gap.nodes(wear), by_gap.at_nodes)
    np.testing.assert_allclose(loaded.tangent[inside], 4.8e8)
    np.testing.assert_allclose(gated.tangent[inside], 2.4e8)


@pytest.mark.parametrize("shared", [False, True])
def test_by_a_threshold_the_mesh_is_as_stiff_as_all_engaged_pairs(pair, grid, shared):
    """Y23 sums every engaged pair, at 1 N too, where worn gaps leave
    the load to one of them.
    """
    wear = some_wear(grid)
    analysis = potential_energy(pair, grid)
    if shared:
        pairs = grid.pairs_at_phase_nodes
        partner = np.full(len(grid.position), -1, dtype=np.int64)
        both = np.all(pairs >= 0, axis=1)
        partner[pairs[both, 1]] = pairs[both, 0]
        ratio = np.full((1, 2, len(partner)), 0.2)
        analysis = potential_energy(pair, grid, coupling=ratio, partner=partner[None])
    whole = replace(analysis, engagement_gap=1.0, load=1.0)
    nodes = whole.nodes(wear)
    found = whole.quasistatic(nodes, whole.at_nodes)
    assert np.any((found.force > 0.0).sum(axis=1) < np.isfinite(found.gap).sum(axis=1))
    compliance, _, cross = whole.at(nodes, whole.at_nodes)
    for i in range(0, len(compliance), 7):
        own = np.isfinite(compliance[i])
        matrix = np.diag(compliance[i][own])
        if own.sum() == 2 and len(cross):
            matrix[0, 1] = matrix[1, 0] = cross[0, i, 1]
        assert found.tangent[i] == pytest.approx(np.linalg.inv(matrix).sum(), rel=1e-12)


def test_weber_contact_is_solved_for_its_own_load(pair, grid):
    teeth = tuple(
        tooth_flexibility(g, pair.radius(i, grid.position))
        for i, g in enumerate(pair.gears)
    )
    steel = pair.driving.material
    weber = WeberContact(
        pair.equivalent_curvature(grid.position),
        np.stack([tooth.half_thickness / np.cos(tooth.angle) for tooth in teeth]),
        (steel, steel),
        pair.face_width,
    )
    analysis = potential_energy(pair, grid, hertz=weber)
    wear = some_wear(grid)
    nodes = analysis.nodes(wear)
    force = analysis.force_at_nodes(
        analysis.quasistatic(nodes, analysis.at_nodes).force
    )
    rigid = (
        potential_energy(pair, grid, hertz=ConstantContact(0.0)).nodes(wear).compliance
    )
    expected = weber.compliance(force)
    np.testing.assert_allclose(nodes.compliance - rigid, expected, rtol=1e-7)
    stiffer = potential_energy(pair, grid).nodes(wear).compliance
    assert np.all(nodes.compliance > stiffer)


def test_a_shared_body_softens_double_contact_only(pair, grid):
    n = len(grid.position)
    partner = np.full(n, -1, dtype=np.int64)
    both = np.all(grid.pairs_at_phase_nodes >= 0, axis=1)
    leading, following = grid.pairs_at_phase_nodes[both].T
    partner[following] = leading
    ratio = np.zeros((1, 2, n))
    have = partner >= 0
    for i, gear in enumerate(pair.gears):
        radius = pair.radius(i, grid.position)
        ratio[0, i, have] = body_coupling(gear, radius[have], radius[partner[have]])
    coupled = potential_energy(pair, grid, coupling=ratio, partner=partner[None])
    alone = potential_energy(pair, grid)
    wear = np.zeros((2, n))
    a = alone.quasistatic(alone.nodes(wear), alone.at_nodes)
    b = coupled.quasistatic(coupled.nodes(wear), coupled.at_nodes)
    np.testing.assert_allclose(b.tangent[~both], a.tangent[~both], rtol=1e-12)
    fall = 1.0 - b.tangent[both] / a.tangent[both]
    assert np.all(fall > 0.02) and np.all(fall < 0.25)
    np.testing.assert_allclose(b.force.sum(axis=1), LOAD, rtol=1e-12)


def test_mesh_stiffness_from_a_table_keeps_its_jump(pair):
    curve = PiecewiseCurve(
        np.array([0.0, 0.4, 0.4, 1.0]), np.array([3e8, 3e8, 2e8, 2e8])
    )
    grid = profile_grid(pair, 101, jumps=curve.jumps)
    analysis = given(grid, curve, of_mesh=True)
    nodes = analysis.nodes(np.zeros((2, len(grid.position))))
    phases = np.array([0.1, 0.39999, 0.40001, 0.9])
    state = analysis.quasistatic(nodes, lookup(grid, phases))
    np.testing.assert_allclose(state.tangent, [3e8, 3e8, 2e8, 2e8], rtol=1e-12)


def test_wear_through_the_tooth_is_named(pair, grid):
    analysis = potential_energy(pair, grid)
    with pytest.raises(SectionVanished):
        analysis.nodes(np.full((2, len(grid.position)), 4e-3))
