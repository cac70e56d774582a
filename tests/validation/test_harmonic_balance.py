"""Harmonic balance: closed forms where nothing jumps, and the
shooting orbit where flanks part.
"""

import harmonic_balance
import numpy as np
import pytest
from harmonic_balance import HarmonicBalance

from wearlab.accuracy.reference import reference
from wearlab.accuracy.steady import relative_error, steady


def balanced(problem, known, harmonics):
    balance = HarmonicBalance(problem.motion(known.response.system), harmonics, 1)
    found = balance.solve()
    force = problem.force(balance.motions(found, problem.phase), problem.phase)
    return balance, found, relative_error(force, known.force)


def test_a_constant_stiffness_with_a_harmonic_error_has_its_closed_form(loaded):
    """δ + e = x of ``m ẍ + c ẋ + k x = F + k e + c ė`` on a torsional pair."""
    scene = loaded.replace("dynamics", {"model": "torsional"}).replace(
        "mesh",
        {
            "stiffness": {"model": "constant", "value": "3e8 N/m", "of": "mesh"},
            "damping_in": "always",
        },
    )
    scene = scene.replace("errors.harmonic", [{"order": 1, "amplitude": "1 um"}])
    problem = steady(scene)
    known = reference(problem)
    balance, found, error = balanced(problem, known, 3)
    assert error < 1e-9
    system = known.response.system
    m = 1.0 / float(balance.given.per_force[0, 0])
    c = float(system.mesh_damping[0])
    omega = 2 * np.pi / problem.vibration.period
    e = 1e-6 / 2j
    expected = (3e8 + 1j * omega * c) * e / (3e8 - m * omega**2 + 1j * omega * c) - e
    np.testing.assert_allclose(found[0, 1], expected, rtol=1e-9)
    np.testing.assert_allclose(found[0, 2:], 0.0, atol=1e-15)


def test_it_converges_to_the_orbit_that_shooting_finds(problem):
    known = reference(problem)
    errors = [balanced(problem, known, harmonics)[2] for harmonics in (20, 80, 320)]
    assert errors[2] < 1e-3 and errors[0] > 3 * errors[2]  # a jump: first order at best


def test_flanks_that_part_and_strike_back(separating):
    problem = steady(separating)
    known = reference(problem)
    if len(known.force) == 1:
        balance, found, error = balanced(problem, known, 160)
        assert error < 2e-2
        again = balance.solve(found)
        np.testing.assert_allclose(again, found, rtol=1e-6, atol=1e-12)


def test_the_derivative_is_that_of_the_remainder(separating):
    balance = HarmonicBalance(steady(separating).motion(), 12, 1)
    random = np.random.default_rng(3)
    delta = (
        5e-6
        * (random.normal(size=(1, 13)) + 1j * random.normal(size=(1, 13)))
        / (1.0 + np.arange(13))
    )
    delta[:, 0] = 4e-6
    step = 1e-12 * (random.normal(size=(1, 13)) + 1j * random.normal(size=(1, 13)))
    step[:, 0] = step[:, 0].real
    balance.gated = False
    _, tangent = balance._remainder(delta)
    matrix = harmonic_balance._toeplitz(balance._harmonics(tangent, 24))
    found = harmonic_balance._unstacked(matrix @ harmonic_balance._stacked(step), 1)
    above, below = (
        balance._harmonics(balance._remainder(delta + sign * step)[0])
        for sign in (1, -1)
    )
    np.testing.assert_allclose(
        found, 0.5 * (above - below), rtol=1e-5, atol=1e-6 * np.abs(found).max()
    )


def test_friction_is_refused(problem):
    given = problem.motion()._replace(rubs=True)
    with pytest.raises(ValueError, match="without friction"):
        HarmonicBalance(given, 10, 1)
