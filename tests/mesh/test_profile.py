import math

import numpy as np
import pytest

from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import Basics, GearSpec
from wearlab.mesh.profile import (
    NO_EXTENSION,
    Extension,
    bounds_of_layers,
    interpolate,
    lookup,
    profile_grid,
)


def long_addendum_pair():
    spec = {"teeth": 60, "addendum_coefficient": 1.35, "dedendum_coefficient": 1.6}
    return gear_pair(
        GearSpec(name="pinion", **spec, fillet_radius_coefficient=0.2),
        GearSpec(name="gear", **spec, fillet_radius_coefficient=0.2),
        Basics(0.003, pressure_angle=math.radians(20), face_width=0.02),
    )


@pytest.mark.parametrize("points", [21, 201])
def test_characteristic_points_are_nodes_and_two_sided_at_jumps(pair, points):
    s = profile_grid(pair, points).position
    assert s[0] == pair.path.A and s[-1] == pytest.approx(pair.path.E, abs=1e-15)
    assert np.all(np.diff(s) >= -1e-15)
    for point, times in (("B", 2), ("C", 1), ("D", 2)):
        assert np.sum(np.abs(s - getattr(pair.path, point)) < 1e-12) == times


def test_every_node_has_its_base_pitch_partner(pair):
    grid = profile_grid(pair, 101)
    both = grid.pairs_at_phase_nodes
    double = np.all(both >= 0, axis=1)
    leading, following = grid.position[both[double]].T
    np.testing.assert_allclose(leading - following, pair.base_pitch, rtol=1e-13)
    assert double.sum() * 2 + (~double).sum() - 1 == len(
        grid.position
    )  # C's node belongs to two segments


def test_weights_integrate_the_path(pair):
    grid = profile_grid(pair, 41)
    s = grid.position
    assert grid.weight @ np.ones_like(s) == pytest.approx(
        pair.path.E - pair.path.A, rel=1e-14
    )
    assert grid.weight @ s**3 == pytest.approx(
        (pair.path.E**4 - pair.path.A**4) / 4, abs=1e-16
    )


def test_interpolation_is_fourth_order_and_one_sided(pair):
    errors = []
    for points in (41, 81, 161):
        grid = profile_grid(pair, points)
        jump = 1e-3 * (grid.position > pair.path.D - 1e-12)
        jump[np.flatnonzero(np.abs(grid.position - pair.path.D) < 1e-12)[0]] = (
            0.0  # left limit
        )
        nodes = np.sin(900 * grid.position) + jump
        phase = (np.arange(500) + 0.5) / 500
        out = interpolate(grid, lookup(grid, phase), nodes, np.nan)
        s = pair.path.A + np.stack([phase + 1, phase], axis=1) * pair.base_pitch
        exact = np.sin(900 * s) + 1e-3 * (s > pair.path.D)
        present = s < pair.path.E
        assert np.array_equal(present, ~np.isnan(out))
        errors.append(np.max(np.abs(out - exact)[present]))
    assert np.log2(errors[0] / errors[1]) > 3.5
    assert np.log2(errors[1] / errors[2]) > 3.5


def test_contact_ratio_above_two_keeps_three_pairs():
    pair = long_addendum_pair()
    assert 2.0 < pair.contact_ratio < 3.0
    grid = profile_grid(pair, 121)
    counts = (grid.pairs_at_phase_nodes >= 0).sum(axis=1)
    assert grid.n_pairs == 3 and set(counts) == {2, 3}
    assert grid.weight.sum() == pytest.approx(pair.path.E - pair.path.A)


def test_pairs_beyond_both_ends_at_once_have_a_slot_each(pair):
    """Was one slot for both, which held the force of the later one alone."""
    for share, more in ((0.2, 0), (0.9, 1)):
        reach = share * pair.base_pitch
        grid = profile_grid(pair, 101, extension=Extension(reach, reach))
        assert grid.slots == grid.max_pairs + 1 + more
        values = (grid.first.T >= 0).astype(float)
        np.testing.assert_array_equal(
            grid.into_slots(values, 0.0).sum(axis=0), values.sum(axis=0)
        )


def test_extra_jump_is_two_sided(pair):
    grid = profile_grid(pair, 61, jumps=(0.3,))
    s = pair.path.A + 0.3 * pair.base_pitch
    assert np.sum(np.abs(grid.position - s) < 1e-12) == 2


@pytest.mark.parametrize(
    "extension", [NO_EXTENSION, Extension(0.3e-3, 0.0), Extension(0.3e-3, 0.5e-3)]
)
def test_values_of_nodes_are_carried_beyond_the_path_by_their_ends(pair, extension):
    grid = profile_grid(pair, 41, extension=extension)
    values = np.random.default_rng(1).uniform(0.0, 1.0, (2, len(grid.position)))
    after = len(grid.contact_position) - len(grid.position) - grid.before
    padded = np.pad(values, [(0, 0), (grid.before, after)], mode="edge")
    np.testing.assert_array_equal(grid.beyond(values), padded)
    np.testing.assert_array_equal(grid.beyond(values[0]), padded[0])


@pytest.mark.parametrize("reach", [0.02, 0.3])
def test_layers_beside_a_and_e_have_their_own_least_number_of_nodes(pair, reach):
    far = Extension(reach * pair.base_pitch, reach * pair.base_pitch)
    nodes = profile_grid(pair, 201, extension=far).contact_position / pair.base_pitch
    start = pair.path.A / pair.base_pitch
    end = pair.path.E / pair.base_pitch
    for low, high in (
        (start - reach, start),
        (start, start + reach),
        (end - reach, end),
        (end, end + reach),
    ):
        inside = np.unique(nodes[(nodes > low - 1e-9) & (nodes < high + 1e-9)].round(9))
        assert len(inside) >= 9
    middle = nodes[(nodes > start + reach) & (nodes < end - reach)]
    assert np.diff(middle).max() <= pair.contact_ratio / 201 + 1e-9


def test_narrow_layers_alone_take_more_nodes(pair):
    def nodes(reach: float) -> int:
        return len(profile_grid(pair, 201, extension=Extension(reach, reach)).position)

    assert nodes(0.02 * pair.base_pitch) > 1.05 * nodes(0.0)
    assert nodes(0.2 * pair.base_pitch) < 1.03 * nodes(0.0)


def test_layers_of_a_face_lay_the_same_nodes_on_the_path_under_every_load(pair):
    on_path = []
    for reach in (0.1, 0.3, 0.4, 0.9):
        extension = Extension(reach * pair.base_pitch, reach * pair.base_pitch)
        grid = profile_grid(
            pair, 101, extension=extension, layer_bounds=bounds_of_layers(reach)
        )
        on_path.append(grid.position)
        assert grid.pairs_at_phase_nodes.shape[1] <= 4
    for nodes in on_path[1:]:
        np.testing.assert_allclose(nodes, on_path[0], atol=1e-15)
