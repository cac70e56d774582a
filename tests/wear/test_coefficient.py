import numpy as np
import pytest

from wearlab.wear.coefficient import Constant, Hardness, Janakiraman, coefficient
from wearlab.wear.film import Film, film_factor, film_thickness
from wearlab.wear.law import WearLaw, effective_coefficient, prepare
from wearlab.wear.path import contact_modulus

OIL = Janakiraman(pressure_viscosity=1.6e-8, roughness=0.5e-6)


def test_constant_and_hardness(l16):
    _, path = l16
    force = np.linspace(0.0, 1.0, 201)
    assert np.all(coefficient(Constant(3e-18, 2.0), path, force) == 6e-18)
    assert coefficient(Hardness(1e-9, 2e9, 5.0), path, force) == pytest.approx(2.5e-18, rel=1e-6, abs=0.0)


def test_janakiraman_by_its_groups(l16):
    _, path = l16
    force = np.linspace(100.0, 4000.0, 201)
    E, R = 206e9 / (2 * (1 - 0.3**2)), path.equivalent_radius
    L, G, S = force / 20e-3 / (E * R), 1.6e-8 * E, 0.5e-6 / R
    expected = 3.981e29 / E * L**1.219 * G**-7.377 * S**1.589
    assert coefficient(OIL, path, force) == pytest.approx(expected, rel=1e-12, abs=0.0)
    assert 1e-20 < expected.mean() < 1e-16  # between a run-in ground flank and a scuffing one


def test_janakiraman_sensitivities_of_physics_7(l16):
    """A factor 2 in E' changes k0 774-fold, α from 10 to 20 GPa⁻¹ 166-fold; k0 ∝ L^1.219."""
    _, path = l16
    force = np.full(201, 1000.0)
    k = coefficient(OIL, path, force)
    stiffer = path._replace(contact_modulus=2 * path.contact_modulus)
    assert k / coefficient(OIL, stiffer, force) == pytest.approx(774.0, rel=1e-3, abs=0.0)
    assert k / coefficient(OIL._replace(pressure_viscosity=3.2e-8), path, force) == pytest.approx(
        166.2, rel=1e-3, abs=0.0
    )
    assert coefficient(OIL, path, 2 * force) / k == pytest.approx(2**1.219, rel=1e-6, abs=0.0)
    assert coefficient(OIL._replace(roughness=1e-6), path, force) / k == pytest.approx(
        2**1.589, rel=1e-6, abs=0.0
    )
    assert coefficient(OIL._replace(factor=7.0), path, force) == pytest.approx(7.0 * k, rel=1e-6, abs=0.0)
    assert np.all(coefficient(OIL, path, 0.0 * force) == 0.0)


def test_contact_modulus_of_two_materials():
    assert contact_modulus([200e9, 100e9], [0.3, 0.25]) == pytest.approx(
        1 / (0.91 / 200e9 + 0.9375 / 100e9), rel=1e-14, abs=0.0
    )


def test_prepared_law_is_the_product_of_its_parts(l16):
    _, path = l16
    force = np.linspace(0.0, 3000.0, 201)
    film = Film(0.012, 1.6e-8, 0.3e-6)
    law = WearLaw((OIL, Constant(1e-18)), film)
    found = effective_coefficient(prepare(law, path), force)
    factor = film_factor(film_thickness(film, path, force) / film.roughness)
    assert 0.0 < factor.min() < factor.max() < 1.0
    assert found[0] == pytest.approx(coefficient(OIL, path, force) * factor, rel=1e-12, abs=0.0)
    assert found[1] == pytest.approx(1e-18 * factor, rel=1e-12, abs=0.0)
