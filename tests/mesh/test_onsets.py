"""Quadrature of a stiffness that jumps at onsets of contact between nodes."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import external_pair, internal_pair

from wearlab import assembly
from wearlab.mesh.harmonics import harmonics
from wearlab.mesh.onsets import rule_between_onsets
from wearlab.mesh.profile import lookup
from wearlab.scene import Scene

PHASES = 40009
COUNT = 6
GEARS = {
    "external": external_pair(20, 50),
    "internal": internal_pair(30, {"teeth": 90, "rim_diameter": "310 mm"}),
}


def contact_of(gears, **mesh):
    """Return the contact analysis of a pair under 100 N·m."""
    scene = Scene.from_mapping(
        {
            "gears": gears,
            "operation": {"torque": "100 N*m", "speed": "1000 rpm"},
            "mesh": {"stiffness": "potential-energy", **mesh},
        }
    )
    return assembly.build(scene).kinds[0].analysis


def worn(analysis, depth):
    """Return nodes worn deepest at both ends of the path, by a depth [m]."""
    place = np.linspace(-1.0, 1.0, len(analysis.grid.position))
    return analysis.nodes(np.tile(depth * place**2, (2, 1)))


def harmonics_of(analysis, nodes):
    """Return the harmonics of the mesh stiffness by the rule."""
    rule = rule_between_onsets(analysis, nodes)
    stiffness = analysis.quasistatic(nodes, rule.where).tangent
    return harmonics(rule.where.phase, rule.weight, stiffness, COUNT)


@pytest.mark.parametrize("gears", GEARS.values(), ids=GEARS)
@pytest.mark.parametrize("depth", [0.0, 8e-6])
def test_harmonics_are_those_of_a_fine_transform(gears, depth):
    """The transform is off by half of a jump over its number of phases."""
    analysis = contact_of(gears)
    nodes = worn(analysis, depth)
    phase = np.arange(PHASES) / PHASES
    wave = analysis.quasistatic(nodes, lookup(analysis.grid, phase)).tangent
    transform = np.fft.rfft(wave) / PHASES
    largest_jump = np.abs(np.diff(wave)).max()

    found = harmonics_of(analysis, nodes)
    tolerance = 8.0 * largest_jump / PHASES
    assert found.mean == pytest.approx(wave.mean(), rel=0.0, abs=tolerance)
    assert found.rms == pytest.approx(wave.std(), rel=0.0, abs=tolerance)
    np.testing.assert_allclose(
        found.amplitude, 2.0 * np.abs(transform[1 : COUNT + 1]), rtol=0, atol=tolerance
    )


def test_harmonics_change_smoothly_with_wear():
    """Onsets move through the nodes, of which harmonics must know nothing."""
    analysis = contact_of(GEARS["external"])
    depths = np.linspace(2e-6, 3e-6, 41)
    rows = []
    for depth in depths:
        series = harmonics_of(analysis, worn(analysis, depth))
        rows.append(series.amplitude * np.exp(1j * series.phase))
    steps = np.diff(rows, axis=0)
    turns = np.abs(np.diff(steps, axis=0)).max(axis=0)
    assert (turns < 0.1 * np.abs(steps).max(axis=0)).all()


def test_jumps_by_a_threshold_are_found_as_well():
    analysis = contact_of(
        GEARS["external"], contact={"engagement": "threshold", "threshold": "1e-4 rad"}
    )
    nodes = worn(analysis, 8e-6)
    phase = np.arange(PHASES) / PHASES
    wave = analysis.quasistatic(nodes, lookup(analysis.grid, phase)).tangent
    tolerance = 8.0 * np.abs(np.diff(wave)).max() / PHASES
    found = harmonics_of(analysis, nodes)
    assert found.mean == pytest.approx(wave.mean(), rel=0.0, abs=tolerance)


def test_the_rule_integrates_smooth_functions():
    analysis = contact_of(GEARS["external"])
    rule = rule_between_onsets(analysis, worn(analysis, 8e-6))
    phase = rule.where.phase
    assert rule.weight.sum() == pytest.approx(1.0, rel=1e-13)
    assert rule.weight @ phase**5 == pytest.approx(1.0 / 6.0, rel=1e-12)


def test_without_load_the_nearest_pair_decides():
    """No force says which pair touches, so that its gap does."""
    analysis = contact_of(GEARS["external"])
    nodes = worn(analysis, 8e-6)
    phase = np.arange(PHASES) / PHASES
    none = np.zeros(PHASES)
    where = lookup(analysis.grid, phase)
    wave = analysis.quasistatic(nodes, where, none).tangent

    idle = replace(analysis, load=0.0)
    rule = rule_between_onsets(idle, nodes)
    stiffness = idle.quasistatic(nodes, rule.where).tangent
    tolerance = 8.0 * np.abs(np.diff(wave)).max() / PHASES
    assert rule.weight @ stiffness == pytest.approx(wave.mean(), abs=tolerance)
