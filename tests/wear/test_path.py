import numpy as np
import pytest
from made_path import path_of
from scipy.integrate import quad

from wearlab.wear.path import rolling_velocity, sliding_velocity


def test_velocities_from_the_rotation_of_both_gears(make_path):
    """v = ρ ω, and sliding = (ω1 + ω2) s by rolling of the pitch circles."""
    s, path = make_path(25, 40, speed=150.0)
    omega1 = 150.0
    omega2 = 150.0 * 25 / 40
    assert path.surface_velocity[1] == pytest.approx(
        path.curvature[1] * omega2, rel=1e-6, abs=0.0
    )
    assert sliding_velocity(path)[0] == pytest.approx((omega1 + omega2) * s, abs=1e-12)
    assert sliding_velocity(path)[1] == pytest.approx(-(omega1 + omega2) * s, abs=1e-12)
    assert rolling_velocity(path) == pytest.approx(
        0.5 * (path.curvature[0] * omega1 + path.curvature[1] * omega2),
        rel=1e-6,
        abs=0.0,
    )
    ratio = sliding_velocity(path) / path.surface_velocity
    assert path.specific_sliding == pytest.approx(ratio, rel=1e-6, abs=0.0)
    assert path.slide_ratio == pytest.approx(np.abs(ratio), rel=1e-6, abs=0.0)


def test_sliding_vanishes_at_the_pitch_point_only_and_is_negative_on_the_roots(
    make_path,
):
    s, path = make_path(25, 40)
    at_pitch = np.array([np.interp(0.0, s, row) for row in path.specific_sliding])
    assert at_pitch == pytest.approx(0.0, abs=1e-3)
    assert np.all(path.specific_sliding[0][s < 0.0] < 0.0)
    assert np.all(path.specific_sliding[1][s > 0.0] < 0.0)


def test_the_smaller_curvature_of_a_ring_is_the_difference(make_path):
    _, path = make_path(25, 40)
    inside = path_of(
        path.curvature * np.array([[1.0], [3.0]]),
        base_radius=[0.035, 0.17],
        teeth=[25, 120],
        speed=1.0,
        passes=[1.0, 25 / 120],
        face_width=20e-3,
        modulus=path.contact_modulus,
        internal=True,
    )
    first, second = inside.curvature
    assert 1.0 / inside.equivalent_radius == pytest.approx(
        np.abs(1.0 / first - 1.0 / second)
    )


def test_flank_arc_against_quadrature_of_the_involute(l16):
    """dL = ρ dρ/r_b: the arc of x = r_b(cos t + t sin t), y = r_b(sin t − t cos t)."""
    _, path = l16
    base_radius = 0.075 * np.cos(np.radians(20.0))
    t = path.curvature[0] / base_radius
    length = quad(
        lambda u: np.hypot(base_radius * u * np.cos(u), base_radius * u * np.sin(u)),
        t[0],
        t[-1],
    )[0]
    assert path.arc_weight[0].sum() == pytest.approx(length, rel=1e-12, abs=0.0)
    assert path.arc_weight[1].sum() == pytest.approx(length, rel=1e-12, abs=0.0)


def test_contact_on_the_base_circle_is_refused():
    with pytest.raises(ValueError, match="base circle"):
        path_of(
            [[0.0, 1e-3], [2e-3, 1e-3]],
            passes=[1.0, 1.0],
            base_radius=[0.05, 0.05],
            teeth=[20, 20],
            speed=1.0,
            face_width=0.01,
        )
