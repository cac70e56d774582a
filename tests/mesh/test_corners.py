"""Gaps beyond A and E from a table: exact for unworn flanks, first order in wear."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from exact_extension import Deflections, extension

from wearlab.mesh.exact.gaps import corner, separations, unworn_extension
from wearlab.mesh.exact.minimum_gap import minimum_gap

_spec = importlib.util.spec_from_file_location(
    "flanks", Path(__file__).parent / "exact" / "conftest.py"
)
exact = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(exact)


@pytest.fixture(params=list(exact.PAIRS), scope="module")
def flanks(request):
    return exact.flanks_of(exact.PAIRS[request.param])


def beyond(pair, end, furthest=0.3, n=13):
    sense, tip = (-1.0, pair.path.A) if end == "A" else (1.0, pair.path.E)
    return tip + sense * np.linspace(0.0, furthest, n) * pair.base_pitch


@pytest.mark.parametrize("end", ["A", "E"])
def test_unworn_corners_are_as_far_as_the_exact_search_finds(flanks, end):
    pair = flanks.pair
    s = flanks.grid.position
    x = beyond(pair, end)
    none = np.zeros((2, len(s)))
    found = corner(pair, end, x, s).gap(none)
    np.testing.assert_allclose(
        found, minimum_gap(*flanks.worn(none), x).gap, rtol=1e-9, atol=1e-12
    )


@pytest.mark.parametrize("end", ["A", "E"])
def test_worn_corners_differ_from_the_exact_search_at_second_order(
    flanks, end, depths=(1e-5, 5e-6, 2.5e-6)
):
    """Half the wear leaves a quarter of the error, until the spacing of the nodes near
    the tip counts.
    """
    pair = flanks.pair
    s = flanks.grid.position
    x = beyond(pair, end)
    error = []
    for depth in depths:
        h = exact.smooth_wear(flanks, depth)
        found = corner(pair, end, x, s).gap(h)
        error.append(np.abs(found - minimum_gap(*flanks.worn(h), x).gap).max())
    assert max(error) < 0.12 * depths[0]
    assert error[2] < 0.6 * error[0]


@pytest.mark.parametrize("end", ["A", "E"])
def test_even_wear_of_one_flank_opens_the_gap_by_itself(flanks, end):
    pair = flanks.pair
    s = flanks.grid.position
    one = corner(pair, end, beyond(pair, end, 0.2), s)
    unworn = one.gap(np.zeros((2, len(s))))
    for gear in (0, 1):
        h = np.zeros((2, len(s)))
        h[gear] = 5e-6
        np.testing.assert_allclose(one.gap(h), unworn + 5e-6, rtol=1e-12)


def test_flanks_in_conjugate_contact_are_not_apart(flanks):
    pair = flanks.pair
    s = np.linspace(pair.path.A, pair.path.E, 9)
    for gear in (0, 1):
        apart, mate = separations(pair, gear, s, s)
        np.testing.assert_allclose(apart, 0.0, atol=1e-16)
        np.testing.assert_allclose(mate, s, atol=1e-15)


def test_the_extension_of_unworn_gears_is_the_exact_search_s(flanks):
    none = np.zeros((2, len(flanks.grid.position)))
    expected = extension(flanks, none, Deflections(20e-6, 20e-6))
    np.testing.assert_allclose(
        unworn_extension(flanks.pair, 20e-6), expected, rtol=1e-5
    )
