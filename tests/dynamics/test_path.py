"""The polynomials between the ends of steps: exact to degree eight, of ninth order."""

import numpy as np

from wearlab.dynamics.steady.response import Path, path

STEPS = np.array([0.1, 0.1, 0.3, 0.3])
ENDS = np.r_[0.0, np.cumsum(STEPS)]


def through(value: np.polynomial.Polynomial) -> Path:
    t = np.stack([ENDS[:-1], ENDS[1:]], axis=1)
    curvature = value.deriv(2)(t)[None, :, :, None]
    return path(
        value(ENDS)[None, :, None], value.deriv()(ENDS)[None, :, None], curvature, STEPS
    )


def test_degree_eight_is_met_with_its_rate() -> None:
    rng = np.random.default_rng(3)
    polynomial = np.polynomial.Polynomial(rng.normal(size=9))
    step = np.array([0, 1, 1, 2, 3])
    fraction = np.array([0.3, 0.0, 0.9, 0.5, 0.7])
    t = ENDS[step] + fraction * STEPS[step]
    value, rate = through(polynomial).at(step, fraction)
    np.testing.assert_allclose(value[0, :, 0], polynomial(t), rtol=1e-11)
    np.testing.assert_allclose(rate[0, :, 0], polynomial.deriv()(t), rtol=1e-9)


def test_accelerations_at_a_break_are_one_sided() -> None:
    """Each two steps see their own side of a jump of the acceleration."""
    ends = np.linspace(-0.2, 0.2, 5)
    h = np.full(4, 0.1)
    sides = (
        np.stack([6.0 * ends[:-1], 6.0 * ends[1:]], axis=1)
        * np.sign(h.cumsum() - 0.25)[:, None]
    )
    sides += np.sign(h.cumsum() - 0.25)[:, None]
    value = np.abs(ends) ** 3 + 0.5 * ends**2 * np.sign(ends)
    slope = 3.0 * ends**2 * np.sign(ends) + np.abs(ends)
    found = path(value[None, :, None], slope[None, :, None], sides[None, :, :, None], h)
    at = found.at(np.array([1, 2]), np.array([0.5, 0.5]))[0][0, :, 0]
    np.testing.assert_allclose(
        at, [0.05**3 - 0.5 * 0.05**2, 0.05**3 + 0.5 * 0.05**2], rtol=1e-12
    )


def test_ninth_order() -> None:
    worst = []
    for h in (0.8, 0.4):
        ends = h * np.arange(9)
        length = np.full(8, h)
        bend = -np.sin(np.stack([ends[:-1], ends[1:]], axis=1))
        found = path(
            np.sin(ends)[None, :, None],
            np.cos(ends)[None, :, None],
            bend[None, :, :, None],
            length,
        )
        step = np.repeat(np.arange(8), 11)
        fraction = np.tile(np.linspace(0, 1, 11), 8)
        worst.append(
            np.abs(
                found.at(step, fraction)[0][0, :, 0] - np.sin(h * (step + fraction))
            ).max()
        )
    assert 400.0 < worst[0] / worst[1] < 620.0
    assert worst[0] < 2e-7 * 0.8**9
