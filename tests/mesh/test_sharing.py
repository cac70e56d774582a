"""Load sharing against SciPy's linear complementarity by brute force
over active sets.
"""

import itertools

import numpy as np
import pytest

from wearlab.mesh.sharing import share
from wearlab.mesh.springs import equivalent_springs

RANDOM = np.random.default_rng(3)


def solve(compliance, gap, cross, load):
    return share(compliance, gap, cross, np.full(len(gap), load))


def by_brute_force(matrix, gap, load):
    """Try every set of loaded pairs and return the one that is consistent."""
    n = len(gap)
    for size in range(1, n + 1):
        for chosen in itertools.combinations(range(n), size):
            a = list(chosen)
            inverse = np.linalg.inv(matrix[np.ix_(a, a)])
            delta = (load + inverse.sum(axis=0) @ gap[a]) / inverse.sum()
            force = np.zeros(n)
            force[a] = inverse @ (delta - gap[a])
            open_gap = delta - gap - matrix @ force
            rest = [i for i in range(n) if i not in a]
            if np.all(force[a] > 0) and np.all(open_gap[rest] <= 1e-15):
                return delta, force, inverse.sum()
    raise AssertionError("no consistent set")


def random_case(pairs, coupled):
    root = RANDOM.uniform(0.2, 1.0, (pairs, pairs))
    matrix = np.diag(RANDOM.uniform(3e-9, 8e-9, pairs))
    if coupled:
        matrix += 1e-9 * (root @ root.T) / pairs
    return matrix, RANDOM.uniform(0, 3e-5, pairs)


def as_tables(matrix, gap, coupled):
    pairs = len(gap)
    cross = np.zeros((pairs - 1 if coupled else 0, 1, pairs))
    if coupled:
        for p in range(pairs):
            for a in range(p):
                cross[a, 0, p] = matrix[p, p - 1 - a]
    return np.diag(matrix)[None].copy(), gap[None].copy(), cross


@pytest.mark.parametrize("coupled", [False, True])
@pytest.mark.parametrize("pairs", [1, 2, 3, 4])
def test_sharing_agrees_with_brute_force(pairs, coupled):
    for load in (10.0, 1e3, 1e4, 1e5):
        for _ in range(10):
            matrix, gap = random_case(pairs, coupled)
            deflection, tangent, force = solve(*as_tables(matrix, gap, coupled), load)
            delta, expected, slope = by_brute_force(matrix, gap, load)
            assert deflection[0] == pytest.approx(delta, rel=1e-11, abs=0.0)
            assert tangent[0] == pytest.approx(slope, rel=1e-12)
            np.testing.assert_allclose(force[0], expected, rtol=1e-9, atol=1e-9 * load)
            assert force.sum() == pytest.approx(load, rel=1e-12)


@pytest.mark.parametrize("coupled", [False, True])
def test_equivalent_springs_carry_the_same_total_force(coupled):
    for _ in range(20):
        matrix, gap = random_case(3, coupled)
        compliance, gaps, cross = as_tables(matrix, gap, coupled)
        stiffness, shifted, _ = equivalent_springs(compliance, gaps, cross, 1)
        assert np.all(stiffness >= 0)
        for load in (5.0, 2e3, 3e4):
            delta, _, _ = by_brute_force(matrix, gap, load)
            total = np.sum(stiffness * np.maximum(0.0, delta - shifted))
            assert total == pytest.approx(load, rel=1e-10)


def test_each_spring_hands_its_force_to_pairs():
    """Springs add up to each pair's own force, at every load, and
    together to all of it.
    """
    for coupled in (False, True):
        matrix, gap = random_case(3, coupled)
        compliance, gaps, cross = as_tables(matrix, gap, coupled)
        stiffness, shifted, part = equivalent_springs(compliance, gaps, cross, 1)
        assert (part is None) != coupled  # springs that are pairs keep their force
        part = np.eye(3)[None] if part is None else part
        np.testing.assert_allclose(part.sum(axis=2), 1.0, rtol=1e-12)
        for load in (5.0, 2e3, 3e4):
            delta, force, _ = by_brute_force(matrix, gap, load)
            handed = (stiffness[0] * np.maximum(0.0, delta - shifted[0])) @ part[0]
            np.testing.assert_allclose(handed, force, rtol=1e-9, atol=1e-9 * load)


def test_pairs_that_change_places_within_a_step_leave_its_springs_smooth():
    """Three stages have the order of the middle one, so that every spring is the
    parabola through them.
    """
    matrix = random_case(2, True)[0]
    gaps = np.array([[2e-6, 1e-6], [1.6e-6, 1.5e-6], [1.2e-6, 2e-6]])
    compliance, _, cross = as_tables(matrix, gaps[0], True)
    compliance = np.repeat(compliance, 3, axis=0)
    cross = np.repeat(cross, 3, axis=1)
    for stages, firsts in ((1, (1, 1, 0)), (3, (1, 1, 1))):
        stiffness, shifted, part = equivalent_springs(compliance, gaps, cross, stages)
        np.testing.assert_allclose(
            stiffness[:, 0],
            1.0 / np.diag(matrix)[list(firsts)],
            rtol=1e-14,
            err_msg=str(stages),
        )
        springs = zip(gaps, stiffness, shifted, part, strict=True)
        for gap, of_springs, where, handed in springs:
            delta, force, _ = by_brute_force(matrix, gap, 3e4)
            carried = of_springs * (delta - where)
            np.testing.assert_allclose(carried @ handed, force, rtol=1e-9)
    linear = shifted[:, 1] - np.linalg.lstsq(gaps, shifted[:, 1])[0] @ gaps.T
    np.testing.assert_allclose(
        linear, 0.0, atol=1e-18
    )  # one and the same mean of both gaps at every stage


def test_absent_pairs_carry_nothing():
    compliance = np.array([[np.inf, 5e-9]])
    gap = np.array([[np.inf, 2e-6]])
    deflection, tangent, force = solve(compliance, gap, np.zeros((1, 2, 0)), 1000.0)
    assert deflection[0] == pytest.approx(7e-6, rel=1e-12, abs=0.0)
    assert tangent[0] == pytest.approx(2e8)
    np.testing.assert_allclose(force[0], [0.0, 1000.0], rtol=1e-15)
