"""The reference stands: a second method agrees, and would not agree with a wrong answer."""

import numpy as np
import pytest

from wearlab.accuracy.cells import HEADER
from wearlab.accuracy.reference import Reference, over_periods, reference, second_method, tight_steps
from wearlab.accuracy.steady import relative_error, steady
from wearlab.accuracy.transient import periods_to, transient
from wearlab.dynamics.periodic import Periodic


@pytest.mark.parametrize("which", ["loaded", "parting"])
def test_a_second_method_agrees(which, request):
    problem = steady(request.getfixturevalue(which))
    known = reference(problem)
    assert known.disagreement < 2e-9
    if which == "parting":
        assert (known.force <= 0.0).any() and (known.force > 0.0).any()


def test_it_does_not_agree_with_another_system(problem):
    known = reference(problem)
    given = problem.motion()
    flat = given.flat.copy()
    damping = HEADER + 2 * given.n**2 + given.n
    flat[damping] *= 1.01
    assert flat[damping] == pytest.approx(1010.0)
    other = second_method(problem, given._replace(flat=flat), known.response)
    assert 1e-5 < relative_error(other, known.force) < 1e-2


def test_the_orbit_closes_by_the_second_method(problem):
    known = reference(problem)
    scale = np.abs(known.response.state).max(axis=(0, 1))
    states, end = over_periods(problem.motion(), known.start, 2, problem.phase, scale)
    np.testing.assert_allclose(end, known.start, atol=1e-9 * scale.max())
    np.testing.assert_allclose(states[0], states[1], atol=1e-8 * scale.max())


def test_a_transient_decays_like_the_largest_multiplier(problem):
    known = reference(problem)
    left = transient(problem, known, 1.1 * known.start)
    count = periods_to(left, 1e-2), periods_to(left, 1e-8)
    assert (count[1] - count[0]) == pytest.approx(np.log(1e-6) / np.log(known.multiplier), rel=0.1)
    assert np.all(np.diff(left) <= 0.0)


def test_a_transient_of_a_large_system_decays_too(planetary):
    problem = steady(planetary)
    response = problem.solve(problem.with_steps(tight_steps(problem), Periodic()))
    largest = float(np.abs(response.multipliers).max())
    force = problem.force_of(problem.vibration, response)
    known = Reference(force, response.state[0, 0], response, 0.0, largest)
    left = transient(problem, known, 1.1 * known.start)
    count = periods_to(left, 1e-5), periods_to(left, 1e-8)
    assert (count[1] - count[0]) == pytest.approx(np.log(1e-3) / np.log(largest), rel=0.2)


def test_forces_over_several_periods_may_begin_anywhere():
    force = np.array([[1.0, 2.0], [3.0, 4.0]])
    assert relative_error(force[::-1], force) == 0.0
    assert relative_error(force[:1], force) == np.inf
    assert relative_error(force * np.nan, force) == np.inf
    assert relative_error(force + np.diag([0.0, 0.4]), force) == pytest.approx(0.1)
