import numpy as np
import pytest
from scipy.integrate import solve_ivp

from wearlab.life import runge_kutta as rkc


def amplification(z, scheme):
    """Growth of y' = λ y over one step, z = ΔN λ (stages may not be
    clipped for this).
    """
    before = 1.0
    current = 1.0 + scheme.mu_rate[1] * z
    for j in range(2, scheme.stages + 1):
        following = (
            (1 - scheme.mu[j] - scheme.nu[j])
            + scheme.mu[j] * current
            + scheme.nu[j] * before
            + z * (scheme.mu_rate[j] * current + scheme.gamma_rate[j])
        )
        before, current = current, following
    return current


@pytest.mark.parametrize("stages", [2, 3, 7, 20, 60])
@pytest.mark.parametrize("damping", [rkc.SHARP, rkc.WIDE])
def test_second_order_polynomial_bounded_over_its_whole_reach(stages, damping):
    scheme = rkc.scheme(stages, damping)
    z = 1e-3
    assert amplification(z, scheme) == pytest.approx(1 + z + z**2 / 2, abs=3e-10)
    inside = np.linspace(-scheme.reach, 0.0, 2001)
    assert np.abs(amplification(inside, scheme)).max() <= 1.0 + 1e-9
    assert np.abs(amplification(-2.0 * scheme.reach, scheme)) > 1.0


def test_reach_is_that_of_the_paper():
    for stages in (4, 10, 40):
        paper = (2 / 3) * (stages**2 - 1) * (1 - (2 / 15) * rkc.SHARP)
        assert rkc.scheme(stages).reach == pytest.approx(paper, rel=0.03, abs=0.0)


def test_wide_damping_tolerates_an_imaginary_part():
    stages = 10
    z = -0.5 * rkc.scheme(stages, rkc.WIDE).reach + 4.0j
    assert abs(amplification(z, rkc.scheme(stages, rkc.WIDE))) < 1.0
    nearby = -np.linspace(0.2, 0.8, 50) * rkc.scheme(stages).reach + 4.0j
    assert np.abs(amplification(nearby, rkc.scheme(stages))).max() > 1.0


def test_fewest_stages_that_reach():
    assert rkc.stages_for(0.0).stages == 2
    scheme = rkc.stages_for(100.0)
    assert scheme.reach >= 100.0 > rkc.scheme(scheme.stages - 1).reach
    assert rkc.stages_for(1e9).stages == rkc.MAX_STAGES


def test_second_order_on_nonlinear_toys_and_error_estimate_of_the_right_size(toys):
    rate = toys.Sharing()
    total = 1.5e7
    h0 = np.zeros(rate.n)
    exact = solve_ivp(
        lambda _, y: rate(y), (0, total), h0, method="DOP853", rtol=1e-12, atol=1e-19
    ).y[:, -1]
    for stages in (2, 5):
        errors = []
        for steps in (20, 40, 80):
            h = h0
            size = total / steps
            for _ in range(steps):
                h = rkc.chebyshev_step(rate, h, rate(h), size, rkc.scheme(stages))
            errors.append(np.abs(h - exact).max())
        orders = np.log2(np.array(errors[:-1]) / errors[1:])
        assert orders == pytest.approx(2.0, abs=0.2)


def test_local_error_is_third_order_and_of_the_size_of_the_true_one(toys):
    rate = toys.Braking()
    h0 = np.zeros(1)
    ratios = []
    sizes = []
    for size in (4e5, 2e5):
        h = rkc.chebyshev_step(rate, h0, rate(h0), size, rkc.scheme(10))
        estimate = rkc.chebyshev_error(h0, h, rate(h0), rate(h), size)
        ratios.append(float(estimate[0] / (rate.depth(size) - h[0])))
        sizes.append(float(estimate[0]))
    assert np.log2(sizes[0] / sizes[1]) == pytest.approx(3.0, abs=0.3)
    assert (
        1.0 < ratios[1] < 2.0
    )  # 1/15 of ΔN³ h''' and 0.8 of the error itself: 1.8 in the limit
