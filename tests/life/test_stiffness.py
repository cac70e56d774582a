import numpy as np
import pytest

from wearlab.life.euler import grows_saw, swings, zigzag
from wearlab.life.stiffness import random_direction, spectrum


def linear(J):
    return lambda h: 1e-12 + J @ h


def test_radius_and_alignment_of_a_real_spectrum():
    rng = np.random.default_rng(5)
    Q = np.linalg.qr(rng.normal(size=(20, 20)))[0]
    J = -Q @ np.diag(np.linspace(1e-9, 1e-6, 20)) @ Q.T
    found = spectrum(
        linear(J),
        np.zeros(20),
        random_direction(np.ones(20)),
        amplitude=1e-9,
        tolerance=1e-6,
        iterations=200,
    )
    assert found.radius == pytest.approx(1e-6, rel=1e-3, abs=0.0)
    assert found.is_real


def test_an_imaginary_part_is_noticed():
    J = 1e-6 * np.array([[-1.0, -2.0], [2.0, -1.0]])
    found = spectrum(linear(J), np.zeros(2), np.array([1.0, -0.3]), amplitude=1e-9)
    assert found.radius == pytest.approx(1e-6 * np.sqrt(5.0), rel=1e-6, abs=0.0)
    assert found.alignment == pytest.approx(1.0 / np.sqrt(5.0), rel=1e-6)
    assert not found.is_real


def test_a_nonlinear_rate_is_differenced_at_one_point():
    """Base and probe share the shift δ: r = −c h² has slope −2 c δ there, not an
    artefact of r(δ) − r(0).
    """

    def rate(h):
        return 1e-12 - 1.0 * h**2 + 2e-7 * h.mean()

    found = spectrum(
        rate, np.full(2, 1e-6), np.array([1.0, -1.0]), amplitude=1e-9, tolerance=1e-9
    )
    assert found.radius == pytest.approx(2.0 * (1e-6 + 1e-9), rel=1e-2, abs=0.0)


def test_probes_never_refill_a_flank_and_a_flat_rate_has_no_stiffness():
    seen = []

    def rate(h):
        seen.append(h.min())
        return 1e-12 * np.ones_like(h)

    found = spectrum(rate, np.zeros(7), random_direction(np.ones(7)), amplitude=1e-9)
    assert found.radius == 0.0
    assert min(seen) >= 0.0


def test_zigzag_of_a_saw_and_of_smooth_profiles():
    x = np.linspace(0.0, 1.0, 100)
    saw = (-1.0) ** np.arange(100)
    assert zigzag(saw) == pytest.approx(2.0, rel=0.02)
    assert zigzag(np.sin(np.pi * x)) < 1e-3
    assert zigzag(np.where(x < 0.4, 1.0, 0.3)) < 0.06  # one step, as at B and D
    assert zigzag(np.zeros(100)) == 0.0


def test_growing_saw_needs_two_rises():
    saw = (-1.0) ** np.arange(100)
    levels = [1.0 + a * saw for a in (0.05, 0.1, 0.2)]
    assert grows_saw(*levels)
    assert not grows_saw(*levels[::-1])
    steep = [1.0 + a * saw for a in (0.6, 0.5, 0.4)]
    assert not grows_saw(*steep)  # a saw that fades


def test_swings_alternate_without_dying_out():
    base = np.ones(10)
    wave = np.linspace(1.0, 2.0, 10)
    assert swings(base, base + 0.10 * wave, base)
    assert not swings(
        base, base + 0.10 * wave, base + 0.02 * wave
    )  # dies out by 0.8 a step
    assert not swings(base, base + 0.10 * wave, base + 0.20 * wave)  # a trend
    other = np.linspace(2.0, -1.6, 10)
    assert abs(wave @ other) < 0.3 * np.linalg.norm(wave) * np.linalg.norm(other)
    assert not swings(
        base, base + 0.1 * wave, base + 0.1 * wave + 0.1 * other
    )  # elsewhere
    assert not swings(base, base + 1e-4 * wave, base)  # noise
