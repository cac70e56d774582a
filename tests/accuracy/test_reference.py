"""The reference stands: a second method agrees, and would not agree
with a wrong answer.
"""

import numpy as np
import pytest

from wearlab.accuracy.reference import over_periods, reference, second_method
from wearlab.accuracy.steady import relative_error, steady


@pytest.mark.parametrize("which", ["loaded", "separating"])
def test_a_second_method_agrees(which, request):
    problem = steady(request.getfixturevalue(which))
    known = reference(problem)
    # Where pairs cease to push slopes of worn gaps decide, which bend at nodes that
    # steps do not land on.
    assert known.disagreement < (2e-9 if which == "loaded" else 2e-6)
    if which == "separating":
        assert (known.force <= 0.0).any() and (known.force > 0.0).any()


def test_it_does_not_agree_with_another_system(problem):
    known = reference(problem)
    given = problem.motion()
    assert given.mesh_damping[0] == pytest.approx(1000.0)
    given = given._replace(mesh_damping=1.01 * given.mesh_damping)
    other = second_method(problem, given, known.response)
    assert 1e-5 < relative_error(other, known.force) < 1e-2


def test_the_orbit_closes_by_the_second_method(problem):
    known = reference(problem)
    scale = np.abs(known.response.state).max(axis=(0, 1))
    states, end = over_periods(problem.motion(), known.start, 2, problem.phase, scale)
    np.testing.assert_allclose(end, known.start, atol=1e-9 * scale.max())
    np.testing.assert_allclose(states[0], states[1], atol=1e-8 * scale.max())


def test_forces_over_several_periods_may_begin_anywhere():
    force = np.array([[1.0, 2.0], [3.0, 4.0]])
    assert relative_error(force[::-1], force) == 0.0
    assert relative_error(force[:1], force) == np.inf
    assert relative_error(force * np.nan, force) == np.inf
    assert relative_error(force + np.diag([0.0, 0.4]), force) == pytest.approx(0.1)
