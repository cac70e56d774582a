"""The contact patch: what it spreads and feels, and the levelling of
the pressure inside it.
"""

from dataclasses import replace

import numpy as np
import pytest
from scenes import CAMPAIGNS
from scipy.integrate import quad
from scipy.sparse import block_diag
from scipy.special import eval_chebyt, jv

from wearlab.assembly import build
from wearlab.campaign import load
from wearlab.wear.ahead import Ahead, looking_ahead
from wearlab.wear.elastic import elastic
from wearlab.wear.levelling import _slopes, levelling, shift
from wearlab.wear.patch import (
    KEPT,
    MAX_NODES,
    OneWay,
    effective_wear_matrix,
    patch_force,
    spread_matrix,
    spreading,
    two_way,
)
from wearlab.wear.path import contact_half_width
from wearlab.wear.squares import FIRST_ORDER, coefficients, max_orders, squares, windows
from wearlab.wear.widths import node_forces

K = 1e-16


@pytest.fixture(scope="module")
def contact(l16):
    """Path, half widths of a load that is shared at both ends, and
    ``k ζ`` times passes.
    """
    s, path = l16
    force = patch_force(np.where(np.abs(s) > 2e-3, 600.0, 2000.0), 2000.0)
    return (
        path,
        contact_half_width(force, path),
        K * path.slide_ratio * path.passes[:, None],
    )


def matrix_of(level, contact=1.0):
    """Return D of contacts, column by column."""
    n = level.sliding.shape[1]
    share = np.broadcast_to(contact, n)
    return np.stack([level.at(unit, share) for unit in np.eye(2 * n)], axis=1)


def half_plane_pressure(gap, x, width, radius, modulus, load):
    """Pressure of a line contact on an elastic half-plane, by
    boundary elements and active sets.
    """
    edge = 0.5 * width
    apart = x[:, None] - x

    def whole(u):
        return u * (np.log(np.abs(u)) - 1.0)

    # surface displacement 2/(πE*) ∫ p ln|1/(x − ξ)| dξ
    flexible = -2.0 / (np.pi * modulus) * (whole(apart + edge) - whole(apart - edge))
    touches = np.ones(len(x), bool)
    while True:
        n = int(touches.sum())
        system = np.zeros((n + 1, n + 1))
        system[:n, :n] = flexible[np.ix_(touches, touches)]
        system[:n, n] = -1.0
        system[n, :n] = width
        right = np.append(-(x**2 / (2.0 * radius) + gap)[touches], load)
        pressure = np.zeros(len(x))
        pressure[touches] = np.linalg.solve(system, right)[:n]
        if pressure.min() >= 0.0:
            return pressure
        touches &= pressure > 0.0


def test_first_order_pressure_is_that_of_a_half_plane():
    """Work of the gap on the pressure it causes: ``∫ δp g dx = −(π E*/4) Σ n g_n²``."""
    modulus, radius, half = 113e9, 8e-3, 60e-6
    load = np.pi * half**2 * modulus / (4.0 * radius)
    n = 1201
    width = 2.4 * half / n
    x = (np.arange(n) - n // 2) * width
    for waves in (1.5, 3.0, 5.0):
        kappa = waves / half
        shape = np.cos(kappa * x)
        amplitude = 2e-5 * half**2 / radius
        worn = half_plane_pressure(amplitude * shape, x, width, radius, modulus, load)
        even = half_plane_pressure(0.0 * x, x, width, radius, modulus, load)
        work = float((worn - even) @ shape) * width / amplitude
        orders = np.arange(2, 40, 2)  # an even gap: g_n = 2 (−1)^(n/2) J_n(κa)
        expected = (
            -np.pi
            * modulus
            / 4.0
            * float(np.sum(orders * (2.0 * jv(orders, waves)) ** 2))
        )
        assert work == pytest.approx(expected, rel=0.01)


def wave_path(make_path, nodes):
    s, path = make_path(n=nodes)
    return s, path, np.full(nodes, 1.2e-4)


@pytest.mark.parametrize("kappa_a", [0.8, 1.5, 2.5, 4.0])
def test_a_wave_decays_as_on_a_half_plane(make_path, kappa_a):
    """``D h = −(π E*) k ζ Σ n J_n²(κa) h`` where nothing varies along
    the path within a wave.
    """
    s, path, a = wave_path(make_path, 1601)
    x = path.arc[0]
    sliding = np.full((2, len(s)), K)
    h = np.zeros((2, len(s)))
    h[0] = np.cos(kappa_a / a[0] * x)
    inside = slice(200, -200)
    found = (
        levelling(a, sliding, path)
        .at(h.ravel(), np.ones(len(s)))
        .reshape(h.shape)[0, inside]
    )
    orders = np.arange(FIRST_ORDER, 40)
    expected = (
        -np.pi
        * path.contact_modulus
        * K
        * float(np.sum(orders * jv(orders, kappa_a) ** 2))
    )
    assert found == pytest.approx(expected * h[0, inside], abs=0.01 * abs(expected))


def across(half_width, arc, j, most):
    """Return the coefficients of a contact at node j of a flank at ascending arcs, and
    the nodes it feels.
    """
    t, node, felt = (each[j] for each in windows(half_width, arc))
    assert t[felt][0] <= -1.0 < t[felt][1] and t[felt][-2] < 1.0 <= t[felt][-1]
    return t[felt], coefficients(t[felt], most), node[felt]


def test_coefficients_are_those_of_bessel_and_converge(make_path):
    """Across a patch ``cos κx = Σ 2 (−1)^(n/2) J_n(κa) T_n``, at
    second order in nodes.
    """
    errors = []
    for nodes in (401, 801, 1601):
        s, path, a = wave_path(make_path, nodes)
        j = int(np.argmin(np.abs(s - 3e-3)))
        _, found, node = across(a, path.arc[0], j, FIRST_ORDER)
        wave = np.cos(2.0 / a[0] * (path.arc[0] - path.arc[0, j]))
        errors.append(abs(float(found[0] @ wave[node]) - np.pi / 2 * -2.0 * jv(2, 2.0)))
    assert errors[0] / errors[1] > 3.0
    assert errors[1] / errors[2] > 3.0


@pytest.mark.parametrize("j", [0, 40, 117])
def test_coefficients_are_integrals_over_hats(contact, j):
    path, a, _ = contact
    most = max_orders(a, path)
    t, found, _ = across(a, path.arc[0], j, most)
    for order in (0, 1, most - FIRST_ORDER):
        for i, unit in enumerate(np.eye(len(t))):
            inside = np.arccos(np.clip(t[max(i - 1, 0) : i + 2], -1.0, 1.0))[::-1]
            expected, _ = quad(
                lambda theta, unit=unit, n=FIRST_ORDER + order: (
                    np.interp(np.cos(theta), t, unit) * eval_chebyt(n, np.cos(theta))
                ),
                inside[0],
                inside[-1],
                points=inside[1:-1],
            )
            assert found[order, i] == pytest.approx(expected, abs=1e-12)


def test_squares_are_sums_over_orders_of_what_a_contact_feels(contact):
    path, a, _ = contact
    at, node, product = squares(a, path)
    n = len(a)
    most = max_orders(a, path)
    assert product.shape == (len(node), 2 * n) and set(at) == set(range(n))
    for j in (0, 60, n - 1):
        felt = node[at == j]
        arcs = [arc if arc[-1] > arc[0] else -arc for arc in path.arc]
        both = [across(a, arc, j, most) for arc in arcs]
        np.testing.assert_array_equal(
            felt, np.concatenate([own + n * f for f, (*_, own) in enumerate(both)])
        )
        b = np.concatenate([found for _, found, _ in both], axis=1)
        square = b.T @ (np.arange(FIRST_ORDER, most + 1)[:, None] * b)
        expected = np.zeros((len(felt), 2 * n))
        np.add.at(expected.T, felt, square.T)  # a node and its mirror images are one
        found = product[at == j].toarray()
        np.testing.assert_allclose(
            found, expected, rtol=0.0, atol=1e-14 * np.abs(square).max()
        )


def test_what_looks_ahead_solves_the_whole_system(contact):
    path, a, sliding = contact
    level = levelling(a, sliding, path)
    more = np.random.default_rng(4).uniform(1.0, 5.0, len(a))
    matrix = matrix_of(level, more)
    forced = np.random.default_rng(3).uniform(0.0, 1.0, 2 * len(a))
    lag = 3.0 / np.abs(matrix).max()
    whole = np.eye(len(forced)) - lag * matrix
    np.testing.assert_allclose(
        looking_ahead(level.matrix(more), lag).solve(forced),
        np.linalg.solve(whole, forced),
        rtol=1e-12,
    )


def test_levelling_conserves_both_flanks_and_only_decays(contact):
    path, a, sliding = contact
    matrix = matrix_of(levelling(a, sliding, path))
    n = path.arc.shape[1]
    for flank, length in enumerate(path.arc_weight):
        own = length @ matrix[flank * n : (flank + 1) * n]
        assert (
            np.abs(own).max()
            < 1e-12
            * np.abs(length[:, None] * matrix[flank * n : (flank + 1) * n]).max()
        )
    values = np.linalg.eigvals(matrix)
    assert np.abs(values.imag).max() < 1e-9 * np.abs(values).max()
    assert values.real.max() < 1e-9 * np.abs(values).max()


def test_constants_and_slopes_are_not_levelled(contact):
    path, a, sliding = contact
    level = levelling(a, sliding, path)
    n = path.arc.shape[1]
    reference = np.abs(matrix_of(level)).max()
    even = level.at(np.ones(2 * n), np.ones(n))
    assert np.abs(even).max() < 1e-12 * reference
    slope = np.concatenate([path.arc[0] - path.arc[0, 0], np.zeros(n)])
    inside = level.at(slope, np.ones(n)).reshape(2, n)[:, 30:-30]
    assert np.abs(inside).max() < 1e-9 * reference * np.ptp(path.arc[0])


def test_contacts_move_off_a_slope(make_path):
    """A long wave of wear decays at ``R' κ²`` per depth worn: contacts move by
    ``−R' h'`` off a slope of wear, and take what they wear off with them.
    """
    s, path, a = wave_path(make_path, 1601)
    x = path.arc[0]
    kappa = 0.05 / a[0]
    rate = np.full((2, len(s)), 1e-12)
    h = np.zeros((2, len(s)))
    h[0] = np.cos(kappa * x)
    moves = shift(spread_matrix(a, path), rate, path)
    found = moves.at(h.ravel(), np.ones(len(s))).reshape(h.shape)[0]
    # the flux of wear is the rate times the shift −R' h', which varies along the path
    off = path.equivalent_radius * kappa * np.sin(kappa * x)
    evened = -np.gradient(rate[0] * off, x)
    inside = slice(300, -300)
    assert found[inside] == pytest.approx(
        evened[inside], abs=0.01 * np.abs(evened).max()
    )


@pytest.mark.parametrize("slices", [1, 3])
def test_what_moves_off_slopes_conserves_both_flanks_and_only_decays(contact, slices):
    path, a, sliding = contact
    wide = np.tile(sliding * 2000.0 / path.face_width, (1, slices))
    half_width = np.tile(a, (slices, 1))
    moves = shift(spread_matrix(half_width, path), wide, path, slices)
    n = wide.shape[1]
    share = np.random.default_rng(6).uniform(0.5, 2.0, n)
    matrix = moves.matrix(share).toarray()
    h = np.random.default_rng(7).uniform(0.0, 1e-6, 2 * n)
    np.testing.assert_allclose(matrix @ h, moves.at(h, share), rtol=1e-9, atol=1e-24)
    length = np.tile(path.arc_weight, (1, slices))
    taken = (length.ravel() * (matrix @ h)).reshape(2, slices, -1)
    assert np.abs(taken.sum(axis=2)).max() < 1e-9 * np.abs(taken).max()
    values = np.linalg.eigvals(matrix)
    assert values.real.max() < 1e-6 * np.abs(values).max()
    even = moves.at(np.ones(2 * n), share)
    assert np.abs(even).max() < 1e-9 * np.abs(matrix).max()


def test_where_nothing_touches_nothing_is_levelled(contact):
    path, a, sliding = contact
    level = levelling(a, sliding, path)
    h = np.random.default_rng(2).uniform(0.0, 1e-6, 2 * path.arc.shape[1])
    assert not level.at(h, np.zeros(len(a))).any()


def one_way(half_width, path):
    return OneWay(spread_matrix(half_width, path))


@pytest.mark.parametrize("kind", [one_way, two_way])
def test_spreading_conserves_and_feeling_is_its_adjoint(contact, kind):
    path, a, _ = contact
    patch = kind(a, path)
    length = path.arc_weight.ravel()
    rng = np.random.default_rng(1)
    wear, felt = rng.uniform(0.0, 1e-6, (2, *path.arc.shape))
    spread = patch.rate(wear, felt, node_forces(np.zeros(len(a))))
    assert (spread * path.arc_weight).sum(1) == pytest.approx(
        (wear * path.arc_weight).sum(1), rel=1e-12
    )
    if kind is one_way:
        assert patch.effective_wear(wear) is wear
        return
    assert patch.effective_wear(np.full_like(wear, 3e-6)) == pytest.approx(
        3e-6, rel=1e-12
    )
    both = length @ (patch.effective_wear(wear) * felt).ravel()
    assert both == pytest.approx(
        length @ (wear.ravel() * (patch.spreading @ felt.ravel())), rel=1e-12
    )


def test_the_semi_implicit_rate_conserves_and_tends_to_the_explicit_one(contact):
    path, a, sliding = contact
    n = len(a)
    force = np.full(n, 2000.0)
    pointwise = sliding * force / path.face_width
    s = (path.arc - path.arc.min(axis=1, keepdims=True)) / np.ptp(path.arc, axis=1)[
        :, None
    ]
    worn = 2e-6 * (1.0 + 0.1 * np.sin(12.0 * s))
    rates = []
    patch = elastic(a, force, 2000.0, sliding, pointwise, path, True)
    for finer in (1, 100, 10_000):
        nodes = n * finer
        patch = replace(
            patch, ahead=Ahead(patch.ahead.matrix, patch.ahead.fastest, nodes)
        )
        rates.append(patch.rate(pointwise, worn, node_forces(force)))
        assert (rates[-1] * path.arc_weight).sum(1) == pytest.approx(
            (pointwise * path.arc_weight).sum(1), rel=1e-9
        )
    spread = patch.spreading @ pointwise.ravel()
    level = patch.levelling.at(worn.ravel(), np.ones(n))
    explicit = spread + level + patch.shift.at(worn.ravel(), np.ones(n))
    apart = [float(np.abs(rate.ravel() - explicit).max()) for rate in rates]
    assert (
        apart[2] < 0.1 * apart[1] < 0.1 * apart[0] or apart[1] < 1e-3 * explicit.max()
    )


def test_the_patch_of_a_light_contact_keeps_a_fifth_of_the_load():
    assert patch_force([0.0, 300.0, 1000.0], 1000.0) == pytest.approx(
        [200.0, 300.0, 1000.0]
    )


def test_matrices_of_the_same_patches_are_made_once(make_path):
    """Those of other half widths are others.

    A process keeps a few, and none of very many nodes.
    """
    _, path, a = wave_path(make_path, 101)
    first = spread_matrix(a, path)
    assert spread_matrix(a.copy(), path) is first
    assert spread_matrix(2.0 * a, path) is not first
    block = block_diag([spreading(a, arc) for arc in path.arc]).toarray()
    np.testing.assert_array_equal(first.toarray(), block)
    length = path.arc_weight.ravel()
    np.testing.assert_array_equal(
        effective_wear_matrix(first, path).toarray(),
        (1.0 / length)[:, None] * block.T * length,
    )
    for factor in range(3, 3 + KEPT):
        spread_matrix(float(factor) * a, path)
    assert spread_matrix(a, path) is not first
    _, path, a = wave_path(make_path, MAX_NODES + 1)
    assert spread_matrix(a, path) is not spread_matrix(a, path)


def test_slopes_pass_nodes_at_one_place():
    """A relief that ends almost at a break has a segment of no length."""
    place = np.concatenate([[0.0, 1.0, 2.0], 2.0 + 2e-4 * np.arange(5), [3.0, 4.0]])
    for slices in (1, 3):
        slopes = _slopes(place, slices) @ np.tile(place, slices)
        within = np.delete(slopes, np.arange(len(place) - 1, len(slopes), len(place)))
        assert within == pytest.approx(1.0, rel=1e-9)


def test_a_trial_of_a_temperature_makes_nothing_that_levels(monkeypatch):
    """Contact feels the patch; what levels is made for the wear rate alone."""
    made = []
    monkeypatch.setattr(
        "wearlab.wear.levelling.squares",
        lambda *given: made.append(given) or squares(*given),
    )
    scene = load(CAMPAIGNS / "steel_on_pom.toml").cases[0].scene
    coupling = build(scene.replace("numerics.profile_points", 31)).coupling
    trials = []
    at = type(coupling).at
    monkeypatch.setattr(
        type(coupling),
        "at",
        lambda self, temperature: trials.append(temperature) or at(self, temperature),
    )
    made.clear()
    coupling.evaluate(coupling.unworn())
    assert len(trials) > 2
    assert len(made) == 1
