import re
import tracemalloc

import numpy as np
import pytest
from made_path import path_of
from scipy.integrate import quad

from wearlab.gears.specification import GearError
from wearlab.wear.patch import MAX_BYTES, cell_edges, spreading
from wearlab.wear.squares import bytes_of_squares, squares


@pytest.fixture
def uneven(make_path):
    """Path with uneven nodes and a one-sided pair where the wear steps."""
    s, path = make_path(25, 40)
    curve = path.curvature
    keep = np.sort(
        np.append(np.union1d(np.arange(0, 201, 3), np.arange(60, 110)), [90, 120])
    )
    return s[keep], path_of(
        curve[:, keep],
        base_radius=np.array([25, 40]) * 1.5e-3 * np.cos(np.radians(20.0)),
        teeth=[25, 40],
        passes=path.passes,
        face_width=20e-3,
        modulus=path.contact_modulus,
    )


def averaged(wear, half_width, path):
    """Average the wear of both flanks over the width of contact."""
    return np.stack(
        [
            spreading(half_width, arc) @ flank
            for arc, flank in zip(path.arc, wear, strict=True)
        ]
    )


@pytest.mark.parametrize("half_width", [1e-5, 2e-4, 1.5e-3])
def test_worn_area_is_conserved_and_nothing_is_negative(uneven, half_width):
    s, path = uneven
    rng = np.random.default_rng(3)
    wear = rng.uniform(0.0, 1e-12, path.curvature.shape)
    a = half_width * rng.uniform(0.3, 1.0, len(s))
    smeared = averaged(wear, a, path)
    assert (smeared * path.arc_weight).sum(axis=1) == pytest.approx(
        (wear * path.arc_weight).sum(axis=1), rel=1e-12, abs=0.0
    )
    assert smeared.min() >= 0.0


def test_vanishing_width_returns_the_pointwise_law(uneven):
    s, path = uneven
    wear = np.stack([np.abs(s), np.where(s > 0, 1.0, 2.0)])
    still = averaged(wear, np.zeros(len(s)), path)
    assert still == pytest.approx(wear, rel=1e-9, abs=0.0)
    tiny = averaged(wear, np.full(len(s), 1e-9), path)
    assert tiny == pytest.approx(wear, abs=1e-4)


def test_constant_wear_stays_constant(uneven):
    s, path = uneven
    smeared = averaged(np.ones((2, len(s))), np.full(len(s), 3e-4), path)
    assert smeared == pytest.approx(1.0, rel=1e-12, abs=0.0)


def test_running_average_against_quadrature(make_path):
    """A step and a kink, averaged over ±a of the arc, cell by cell."""
    _, path = make_path(n=401)
    a = 4e-4
    x = path.arc[0]
    middle = x[200]

    def law(arc):
        return np.abs(arc - middle) + np.where(arc > x[300], 1e-3, 0.0)

    smeared = averaged(np.stack([law(x), law(x)]), np.full(401, a), path)[0]
    for i in (150, 200, 207, 295, 310):
        points = [p for p in (middle, x[300]) if x[i] - a < p < x[i] + a]
        expected = quad(law, x[i] - a, x[i] + a, points=points or None)[0] / (2 * a)
        assert smeared[i] == pytest.approx(expected, rel=0.01, abs=1e-6)
    assert smeared[200] == pytest.approx(
        a / 2, rel=0.02, abs=0.0
    )  # no exact zero at the pitch point any more


def test_edges_of_descending_arcs_ascend(make_path):
    _, path = make_path(25, 40)
    for arc in path.arc:
        edges = cell_edges(arc)
        assert np.all(np.diff(edges) > 0.0)
        assert edges[-1] - edges[0] == pytest.approx(
            abs(arc[-1] - arc[0]), rel=1e-6, abs=0.0
        )


def test_nodes_that_would_fill_the_memory_are_refused_before_they_do():
    """74.5 GiB were asked for with 100,000 points."""
    arc = np.linspace(0.0, 6e-3, 100_007)
    half_width = np.full(arc.size, 1e-4)
    with pytest.raises(GearError, match=r"need 32 GB .* at most \d+") as refused:
        spreading(half_width, arc)

    fewer = int(re.search(r"at most (\d+)", str(refused.value)).group(1))
    assert 50_000 < fewer < arc.size
    coarser = np.linspace(0.0, 6e-3, 1000)
    tracemalloc.start()
    spreading(half_width[:1000], coarser)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak * (fewer / 1000) ** 2 < MAX_BYTES  # the remedy


def test_shares_are_those_of_a_whole_matrix(uneven):
    """Every contact and both its mirror images, on every node."""
    s, path = uneven
    a = 1.5e-3 * np.linspace(0.3, 1.0, len(s))
    edges = cell_edges(path.arc[0])

    def fallen(below, left, right, width):
        """Return the area that falls below a place, from points of the cell."""
        density = [
            (min(below, x + width) - (x - width)) / (2.0 * width)
            if below > x - width
            else 0.0
            for x in np.linspace(left, right, 2001)
        ]
        return (right - left) * float(np.mean(density))

    share = spreading(a, path.arc[0]).toarray()
    rng = np.random.default_rng(5)
    for node, contact in rng.integers(0, len(s), (40, 2)):
        expected = 0.0
        low, high = edges[contact : contact + 2]
        for left, right in (
            (low, high),
            (2.0 * edges[0] - high, 2.0 * edges[0] - low),
            (2.0 * edges[-1] - high, 2.0 * edges[-1] - low),
        ):
            above, below = (
                fallen(edges[node + end], left, right, a[contact]) for end in (1, 0)
            )
            expected += above - below
        width = edges[node + 1] - edges[node]
        if width > 0.0:
            assert share[node, contact] == pytest.approx(
                expected / width, rel=2e-3, abs=1e-6
            )


def test_squares_of_a_contact_patch_are_refused_before_they_fill_the_memory(make_path):
    """Nodes of a tolerance of 1e-16 asked for 45 GiB."""
    _, path = make_path(n=1601)
    wide = 0.1 * np.ptp(path.arc[0])
    with pytest.raises(GearError, match=r"1601 nodes .* \d+ profile_points") as refused:
        squares(np.full(1601, wide), path)

    fewer = int(re.search(r"at most (\d+)", str(refused.value)).group(1))
    _, coarser = make_path(n=fewer)
    needed = bytes_of_squares(np.full((1, fewer), wide), coarser)
    assert 0.7 * MAX_BYTES < needed < MAX_BYTES  # the remedy


@pytest.mark.parametrize("share", [0.02, 0.1, 0.4])
def test_squares_take_no_more_memory_than_was_computed(make_path, share):
    _, path = make_path(n=161)
    half_width = np.full(161, share * np.ptp(path.arc[0]))
    tracemalloc.start()
    squares.__wrapped__(half_width, path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    needed = bytes_of_squares(half_width[None], path)
    assert 0.3 * needed < peak < 1.2 * needed


def test_a_contact_that_one_reflection_does_not_hold_is_refused(make_path):
    _, path = make_path()
    arc = path.arc[0]
    width = np.diff(cell_edges(arc))
    share = spreading(np.full(arc.size, np.ptp(arc)), arc)
    assert width @ share == pytest.approx(width, rel=1e-9)  # the worn area stays
    with pytest.raises(GearError, match=r"operation\.torque: .* give less torque"):
        spreading(np.full(arc.size, 1.01 * np.ptp(arc)), arc)
