"""Uneven load with known answers: slices apart, a layer in shear,
limits and mirror images.
"""

import numpy as np
import pytest

from wearlab.mesh.face.solve import Section, Slices, layer_of, solve_phases

B, FORCE, STIFFNESS = 0.1, 40e3, 20e9
"""Face width [m], force [N], stiffness per width [N/m²]."""


def pressed(
    gap,
    *,
    compliance=1.0 / STIFFNESS,
    contact=None,
    shear_length=0.0,
    force=FORCE,
    width=None,
):
    """Return line loads of one line under a force, and the approach:
    gaps of slices (n,) [m].
    """
    n = len(gap)
    width = np.full(n, B / n) if width is None else width
    edges = np.concatenate([[0.0], np.cumsum(width)])
    middle = 0.5 * (edges[1:] + edges[:-1])
    body = np.array([0.5 * compliance if contact is None else compliance])
    hertz = np.array([0.5 * compliance if contact is None else contact])
    slices = Slices(np.zeros((1, 1, n), np.int64), width, np.ones((1, 1, n)))
    section = Section(body, np.zeros((0, 1)), hertz, 0.0, 1.0)
    load, approach, tangent = solve_phases(
        slices,
        section,
        np.asarray(gap)[:, None],
        np.array([force]),
        np.zeros((1, 1, n)),
        layer_of(slices, middle, body, shear_length),
        None,
        True,
    )
    return load[0, 0], approach[0], tangent[0], width


def places(n):
    return (np.arange(n) + 0.5) / n - 0.5


def peak(load, n):
    """Return the load at the ends, carried on from the two last
    slices, over the mean one.
    """
    ends = [1.5 * load[0] - 0.5 * load[1], 1.5 * load[-1] - 0.5 * load[-2]]
    return max(*ends, load.max()) * B / FORCE


@pytest.mark.parametrize("u", [0.0, 0.3, 1.0, 1.7, 4.0])
def test_misalignment(u):
    """``K = 1 + u`` while all touch, ``2√u`` beyond, to first order
    in the slice where contact ends.
    """
    opening = u * 2.0 * FORCE / (STIFFNESS * B)
    wanted = 1.0 + u if u <= 1.0 else 2.0 * np.sqrt(u)
    errors = []
    for n in (41, 164):
        load, *_, width = pressed(opening * places(n))
        assert load @ width == pytest.approx(FORCE, rel=1e-13)
        errors.append(abs(peak(load, n) / wanted - 1.0))
    assert errors[0] < (1e-12 if u <= 1.0 else 5e-3)
    assert errors[1] <= max(errors[0] / 8.0, 1e-12)
    if u > 1.0:
        assert (load > 0.0).mean() == pytest.approx(1.0 / np.sqrt(u), abs=1.0 / n)


@pytest.mark.parametrize("v", [0.5, 1.5, 3.0, 12.0])
def test_crowning(v):
    """``K = 1 + v/3`` while all touch, ``1.5 (v/1.5)^⅓`` beyond.

    Errors fall as the square of the slices.
    """
    crowning = v * FORCE / (STIFFNESS * B)
    wanted = 1.0 + v / 3.0 if v <= 1.5 else 1.5 * (v / 1.5) ** (1.0 / 3.0)
    errors = []
    for n in (41, 163):
        load, *_ = pressed(4.0 * crowning * places(n) ** 2)
        errors.append(abs(load.max() * B / FORCE / wanted - 1.0))
    assert errors[0] < 2e-3
    assert errors[1] < errors[0] / 6.0


def test_crowning_and_misalignment_move_the_peak():
    crowning, opening, n = 20e-6, 10e-6, 401
    load, *_ = pressed(4.0 * crowning * places(n) ** 2 + opening * places(n))
    where = places(n)[np.argmax(load)] * B
    assert where == pytest.approx(-B * opening / (8.0 * crowning), abs=0.5 * B / n)


def layered(shear_length, n):
    """Return K of a face of 100 mm with k_t 25 and k_h 60 N/(mm µm), opening 20 µm,
    under 40 kN.
    """
    return peak(
        pressed(
            -20e-6 * places(n),
            compliance=1 / 25e9,
            contact=1 / 60e9,
            shear_length=shear_length,
        )[0],
        n,
    )


@pytest.mark.parametrize(
    ("modules", "printed"), [(0.0, 1.441), (0.5, 1.470), (1.0, 1.499), (2.0, 1.556)]
)
def test_a_layer_in_shear_with_free_ends(modules, printed):
    """Against its closed form to 1e-5, by the second-order limit of two grids, whose
    rate is shown.
    """
    length = 5e-3 * modules
    k_t = 25e9
    k_h = 60e9
    opening = 20e-6
    theta = opening / B
    mean = FORCE / B
    if length == 0.0:
        wanted = 1.0 + k_t * k_h / (k_t + k_h) * opening / 2.0 / mean
    else:
        rate = np.sqrt((k_t + k_h) / (k_t * length**2))
        a = k_h * theta / (k_t + k_h)
        x = -0.5 * B
        u1 = a * x - a * np.sinh(rate * x) / (rate * np.cosh(rate * B / 2.0))
        wanted = (mean + k_h * (u1 - theta * x)) / mean
    assert wanted == pytest.approx(printed, abs=6e-4)
    coarse = layered(length, 161)
    fine = layered(length, 323)
    finest = layered(length, 647)
    assert finest + (finest - fine) / 3.0 == pytest.approx(wanted, rel=1e-5)
    if modules:
        assert 3.0 < (coarse - fine) / (fine - finest) < 5.0


@pytest.mark.parametrize("shear_length", [0.0, 4e-3])
def test_a_rigid_face_bears_on_its_end_and_a_soft_one_evenly(shear_length):
    gap = 20e-6 * places(41)
    stiff, *_ = pressed(gap, compliance=1e-17, contact=1e-17, shear_length=shear_length)
    assert stiff[0] * B / 41 == pytest.approx(FORCE, rel=1e-6) and not stiff[1:].any()
    soft, *_ = pressed(gap, compliance=1e-6, contact=1e-6, shear_length=shear_length)
    assert soft == pytest.approx(np.full(41, FORCE / B), rel=1e-3)


def test_opposite_misalignments_are_mirror_images():
    gap = 30e-6 * places(41) + 5e-6 * places(41) ** 2
    one, *_ = pressed(gap, shear_length=5e-3)
    other, *_ = pressed(gap[::-1], shear_length=5e-3)
    np.testing.assert_allclose(one, other[::-1], rtol=1e-12, atol=1e-9 * FORCE / B)


def test_the_tangent_is_the_slope_of_the_force():
    gap = 40e-6 * places(41)
    _, approach, tangent, _ = pressed(gap, shear_length=5e-3)
    step = 1e-4 * FORCE
    _, further, *_ = pressed(gap, shear_length=5e-3, force=FORCE + step)
    assert step / (further - approach) == pytest.approx(tangent, rel=1e-3)


def test_where_it_does_not_touch_a_gap_is_left():
    gap = 60e-6 * places(41)
    load, approach, *_ = pressed(gap)
    assert not (load < 0.0).any()
    assert (gap[load == 0.0] >= approach).all() and (gap[load > 0.0] < approach).all()


def test_without_a_force_the_first_slice_touches():
    load, approach, *_ = pressed(20e-6 * places(41), force=0.0)
    assert approach == pytest.approx(20e-6 * places(41)[0], rel=1e-12)
    assert load.max() <= 1e-6
