"""Contact beyond A and E: pairs that enter and leave by their gap, in
the sharing of the load.
"""

from dataclasses import replace

import numpy as np
import pytest
from exact_extension import Deflections, extension

from wearlab.life.coupled import MeshKind
from wearlab.mesh.contact import ContactAnalysis
from wearlab.mesh.exact.gaps import DisplacementBeyond, MeetingGaps, WornFlanks
from wearlab.mesh.exact.minimum_gap import minimum_gap
from wearlab.mesh.profile import Extension, interpolate, lookup, profile_grid
from wearlab.mesh.stiffness import GivenStiffness, constant

STIFFNESS, LOAD = 2.4e8, 2000.0


def analysis(pair, reach, gaps=MeetingGaps, points=151):
    grid = profile_grid(pair, points, extension=reach)
    none = np.zeros((2, len(grid.position)))
    return ContactAnalysis(
        grid,
        GivenStiffness(constant(STIFFNESS), False, grid),
        none[0],
        LOAD,
        gaps=gaps(WornFlanks(pair, grid, none)),
    )


def worn(analysis):
    s = analysis.grid.position
    return 2e-6 * np.stack([(s / np.abs(s).max()) ** 2] * 2)


def reach_of(pair, share=0.3):
    return Extension(share * pair.base_pitch, share * pair.base_pitch)


@pytest.mark.parametrize("name", ["external", "internal", "internal, ring drives"])
def test_the_grid_reaches_beyond_and_keeps_its_flank(make, name):
    pair = make.pairs[name]
    plain = profile_grid(pair, 151)
    grid = profile_grid(pair, 151, extension=reach_of(pair))
    assert grid.contact_position[0] == pytest.approx(
        pair.path.A - 0.3 * pair.base_pitch
    )
    assert grid.contact_position[-1] == pytest.approx(
        pair.path.E + 0.3 * pair.base_pitch
    )
    assert grid.position[[0, -1]] == pytest.approx([pair.path.A, pair.path.E])
    np.testing.assert_array_equal(grid.contact_position[grid.on_flank], grid.position)
    assert np.sum(grid.weight) == pytest.approx(np.sum(plain.weight))
    phases, _ = grid.phase_nodes
    for phase, nodes in zip(phases, grid.pairs_at_phase_nodes, strict=True):
        for number, node in zip(grid.pair_numbers, nodes, strict=True):
            if node >= 0:
                where = pair.path.A + (phase + number) * pair.base_pitch
                assert grid.contact_position[node] == pytest.approx(where, abs=1e-12)
    assert plain.contact_position is plain.position or len(
        plain.contact_position
    ) == len(plain.position)


@pytest.mark.parametrize("gaps", [MeetingGaps, DisplacementBeyond])
def test_forces_have_no_jump_and_balance(make, gaps):
    pair = make.pairs["external"]
    found = analysis(pair, reach_of(pair), gaps)
    nodes = found.nodes(worn(found))
    phase = (np.arange(4000) + 0.5) / 4000
    state = found.quasistatic(nodes, lookup(found.grid, phase))
    np.testing.assert_allclose(state.force.sum(axis=1), LOAD, rtol=1e-12)
    # pair j at phase 1 goes on as pair j + 1 at phase 0: slot p takes over from slot p
    # + 1
    steps = [np.abs(np.diff(state.force, axis=0)).max()]
    steps.append(np.abs(state.force[0, :-1] - state.force[-1, 1:]).max())
    assert max(steps) < 0.01 * LOAD
    jump = analysis(pair, Extension(0.0, 0.0), gaps) if gaps is MeetingGaps else None
    if jump is not None:
        plain = jump.quasistatic(jump.nodes(worn(jump)), lookup(jump.grid, phase))
        assert np.abs(np.diff(plain.force, axis=0)).max() > 0.3 * LOAD


def test_a_pair_enters_where_its_corner_gap_is_the_deflection_of_the_others(make):
    pair = make.pairs["external"]
    found = analysis(pair, reach_of(pair))
    nodes = found.nodes(np.zeros((2, len(found.grid.position))))
    phase = np.linspace(0.5, 1.0, 4001)[:-1]
    state = found.quasistatic(nodes, lookup(found.grid, phase))
    last = int(np.flatnonzero(found.grid.pair_numbers == -1)[0])
    first = int(np.argmax(state.force[:, last] > 0.0))
    assert first > 0
    flanks = found.gaps.flanks
    x = pair.path.A + (phase[first] - 1.0) * pair.base_pitch
    gap = minimum_gap(*flanks.worn(np.zeros((2, len(found.grid.position)))), [x]).gap[0]
    assert gap == pytest.approx(state.deflection[first - 1], rel=5e-3)


def test_exact_contact_of_unworn_flanks_changes_nothing(make):
    pair = make.pairs["external"]
    exact = analysis(pair, Extension(0.0, 0.0))
    plain = ContactAnalysis(exact.grid, exact.stiffness, exact.modification, LOAD)
    none = np.zeros((2, len(exact.grid.position)))
    a = exact.quasistatic(exact.nodes(none), exact.at_nodes)
    b = plain.quasistatic(plain.nodes(none), plain.at_nodes)
    np.testing.assert_allclose(a.deflection, b.deflection, rtol=1e-9)
    np.testing.assert_allclose(a.force, b.force, atol=1e-7 * LOAD)


def test_the_extension_is_where_the_gap_reaches_the_deflection(flanks):
    none = np.zeros((2, len(flanks.grid.position)))
    reach = extension(flanks, none, Deflections(5e-6, 20e-6))
    ends = [flanks.pair.path.A - reach.approach, flanks.pair.path.E + reach.recess]
    np.testing.assert_allclose(
        minimum_gap(*flanks.worn(none), ends).gap, [5e-6, 20e-6], rtol=1e-6
    )
    even = np.full_like(none, 2e-6)
    later = extension(flanks, even, Deflections(5e-6, 20e-6))
    assert 0.0 < later.approach < reach.approach and 0.0 < later.recess < reach.recess
    assert extension(flanks, even, Deflections(3e-6, 3e-6)) == Extension(0.0, 0.0)


@pytest.mark.parametrize("gaps", [MeetingGaps, DisplacementBeyond])
def test_the_least_gap_is_that_of_the_nodes(make, gaps):
    """Whole outlines meet where they are worn: no depth is projected twice."""
    pair = make.pairs["external"]
    plain = analysis(pair, reach_of(pair), gaps)
    found = replace(plain, felt=np.full((2, len(plain.grid.position)), 0.5))
    depth = 3e-6 + worn(found)
    gap = found.nodes(depth).gap
    of_pairs = interpolate(found.grid, found.at_nodes, gap, np.inf)
    _, weight = found.grid.phase_nodes
    expected = weight @ of_pairs.min(axis=1)
    assert found.mean_least_gap(depth) == pytest.approx(expected, rel=1e-14)


def test_unworn_flanks_are_looked_at_once(make, monkeypatch):
    """They were in every wear state, as worn ones must be."""
    pair = make.pairs["external"]
    found = analysis(pair, reach_of(pair))
    kind = MeshKind(found, None, None, np.zeros(0, int), ())
    depths = []
    least_gap = ContactAnalysis.mean_least_gap

    def counted(self, wear):
        depths.append(float(wear.max()))
        return least_gap(self, wear)

    monkeypatch.setattr(ContactAnalysis, "mean_least_gap", counted)
    first, second = kind.clearance(worn(found)), kind.clearance(2.0 * worn(found))
    assert 0.0 < first < second
    assert depths.count(0.0) == 1 and len(depths) == 3
