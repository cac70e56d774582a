import numpy as np
import pytest

from wearlab.wear.films import Film, composite_rq, film_thickness
from wearlab.wear.films.dowson_higginson import film_factor

FILM = Film(viscosity=0.012, pressure_viscosity=1.6e-8, roughness=0.5e-6)


def test_dowson_higginson_by_hand(l16):
    """Pitch point at 100 rad/s: u = 2.5652 m/s, R' = 12.826 mm, E' =
    226.37 GPa, w = 50 N/mm.
    """
    _, path = l16
    U = 0.012 * 2.565151 / (226.3736e9 * 12.82575e-3)
    G = 1.6e-8 * 226.3736e9
    W = 50e3 / (226.3736e9 * 12.82575e-3)
    assert (U, G, W) == pytest.approx(
        (1.0602e-11, 3622.0, 1.7221e-5), rel=1e-4, abs=0.0
    )
    expected = 12.82575e-3 * 2.65 * U**0.70 * G**0.54 / W**0.13
    assert film_thickness(FILM, path, np.full(201, 1000.0))[100] == pytest.approx(
        expected, rel=1e-6, abs=0.0
    )
    assert expected == pytest.approx(
        0.2456e-6, rel=1e-3, abs=0.0
    )  # by logarithms on paper


def test_exponents(make_path):
    force = np.full(201, 1000.0)
    base = film_thickness(FILM, make_path()[1], force)
    assert film_thickness(
        FILM, make_path(speed=200.0)[1], force
    ) / base == pytest.approx(2**0.70, rel=1e-6, abs=0.0)
    assert film_thickness(
        FILM._replace(viscosity=0.024), make_path()[1], force
    ) / base == pytest.approx(2**0.70, rel=1e-6, abs=0.0)
    thicker = FILM._replace(pressure_viscosity=3.2e-8)
    assert film_thickness(thicker, make_path()[1], force) / base == pytest.approx(
        2**0.54, rel=1e-6, abs=0.0
    )
    assert film_thickness(FILM, make_path()[1], 2 * force) / base == pytest.approx(
        2**-0.13, rel=1e-6, abs=0.0
    )


def test_modulus_of_the_two_formulas_matters_two_percent_only(l16):
    _, path = l16
    force = np.full(201, 1000.0)
    other = film_thickness(
        FILM, path._replace(contact_modulus=0.5 * path.contact_modulus), force
    )
    assert other / film_thickness(FILM, path, force) == pytest.approx(
        2**0.03, rel=1e-6, abs=0.0
    )


def test_limits_are_finite(make_path):
    unloaded = film_thickness(FILM, make_path()[1], np.zeros(201))
    assert np.all(np.isfinite(unloaded))
    assert np.all(unloaded > film_thickness(FILM, make_path()[1], np.ones(201)))
    assert np.all(film_thickness(FILM, make_path(speed=0.0)[1], np.zeros(201)) == 0.0)


def test_film_factor_limits_and_continuity():
    ratio = np.array([0.0, 0.3, 0.5, 0.5 + 1e-9, 2.25, 4.0 - 1e-9, 4.0, 10.0, np.inf])
    assert film_factor(ratio) == pytest.approx([1, 1, 1, 1, 0.5, 0, 0, 0, 0], abs=1e-8)
    assert film_factor(1.0) == pytest.approx(6 / 7, rel=1e-6, abs=0.0)


def test_roughness_is_rms_of_both():
    assert composite_rq([0.3e-6, 0.4e-6]) == pytest.approx(0.625e-6, rel=1e-6, abs=0.0)
