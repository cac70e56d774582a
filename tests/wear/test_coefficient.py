import numpy as np
import pytest

from wearlab.options import Stored
from wearlab.slots import VariantError
from wearlab.wear.coefficients import CoefficientModel
from wearlab.wear.coefficients.constant import ConstantCoefficient
from wearlab.wear.coefficients.hardness import HardnessCoefficient
from wearlab.wear.coefficients.janakiraman import JanakiramanCoefficient, regression
from wearlab.wear.films import Film, film_thickness
from wearlab.wear.films.dowson_higginson import film_factor
from wearlab.wear.law import (
    FlankLaw,
    WearLaw,
    effective_coefficient,
    prepare,
    wear_rate,
)
from wearlab.wear.path import contact_modulus, mean_pressure
from wearlab.wear.setting import PowerOfLoad, Setting


def oil(path, force, viscosity=1.6e-8, roughness=0.5e-6):
    return regression(path, viscosity, roughness).at(force / path.face_width)


def constant(path, value):
    return PowerOfLoad(np.full(path.equivalent_radius.shape, value), 0.0)


def test_constant_and_hardness(l16):
    _, path = l16
    force = np.linspace(0.0, 1.0, 201)
    constant = ConstantCoefficient(model="constant", value=Stored(3e-18)).build(
        Setting(path, 0)
    )
    assert np.all(constant.at(force) == 3e-18)
    hardness = HardnessCoefficient(
        model="hardness", k=1e-9, hardness=Stored(2e9)
    ).build(Setting(path, 0))
    law = prepare(WearLaw((FlankLaw(constant), FlankLaw(hardness, 5.0))), path)
    assert effective_coefficient(law, force)[1] == pytest.approx(
        2.5e-18, rel=1e-6, abs=0.0
    )


def test_janakiraman_by_its_groups(l16):
    _, path = l16
    force = np.linspace(100.0, 4000.0, 201)
    E = 206e9 / (2 * (1 - 0.3**2))
    R = path.equivalent_radius
    L = force / 20e-3 / (E * R)
    G = 1.6e-8 * E
    S = 0.5e-6 / R
    expected = 3.981e29 / E * L**1.219 * G**-7.377 * S**1.589
    assert oil(path, force) == pytest.approx(expected, rel=1e-12, abs=0.0)
    assert (
        1e-20 < expected.mean() < 1e-16
    )  # between a run-in ground flank and a scuffing one


def test_janakiraman_sensitivities_of_physics_7(l16):
    """A factor 2 in E' changes k0 774-fold, α from 10 to 20 GPa⁻¹ 166-fold.

    K0 ∝ L^1.219.
    """
    _, path = l16
    force = np.full(201, 1000.0)
    k = oil(path, force)
    stiffer = path._replace(contact_modulus=2 * path.contact_modulus)
    assert k / oil(stiffer, force) == pytest.approx(774.0, rel=1e-3, abs=0.0)
    assert k / oil(path, force, viscosity=3.2e-8) == pytest.approx(
        166.2, rel=1e-3, abs=0.0
    )
    assert oil(path, 2 * force) / k == pytest.approx(2**1.219, rel=1e-6, abs=0.0)
    assert oil(path, force, roughness=1e-6) / k == pytest.approx(
        2**1.589, rel=1e-6, abs=0.0
    )
    assert np.all(oil(path, 0.0 * force) == 0.0)


def test_contact_modulus_of_two_materials():
    assert contact_modulus([200e9, 100e9], [0.3, 0.25]) == pytest.approx(
        1 / (0.91 / 200e9 + 0.9375 / 100e9), rel=1e-14, abs=0.0
    )


def test_prepared_law_is_the_product_of_its_parts(l16):
    _, path = l16
    force = np.linspace(0.0, 3000.0, 201)
    film = Film(0.012, 1.6e-8, 0.3e-6)
    first = FlankLaw(regression(path, 1.6e-8, 0.5e-6), film=film_factor)
    second = FlankLaw(constant(path, 1e-18), 3.0, film_factor)
    thickness = film.along(path)
    law = WearLaw(
        (first, second), thickness._replace(scale=thickness.scale / film.roughness)
    )
    found = effective_coefficient(prepare(law, path), force)
    factor = film_factor(film_thickness(film, path, force) / film.roughness)
    assert 0.0 < factor.min() < factor.max() < 1.0
    assert found[0] == pytest.approx(oil(path, force) * factor, rel=1e-12, abs=0.0)
    assert found[1] == pytest.approx(3e-18 * factor, rel=1e-12, abs=0.0)


def test_a_variant_builds_what_its_function_says(l16):
    _, path = l16
    where = Setting(
        path, 1, type("Oil", (), {"pressure_viscosity": 1.6e-8}), (0.3e-6, 0.4e-6)
    )
    found = JanakiramanCoefficient(model="janakiraman").build(where)
    assert np.array_equal(found.scale, regression(path, 1.6e-8, 0.5e-6).scale)
    assert set(CoefficientModel.slot.variants) >= {
        "constant",
        "hardness",
        "janakiraman",
        "calibrated",
    }


def test_a_function_of_the_state_is_what_a_power_of_the_load_is(l16):
    """k ∝ p² is k ∝ w, for the mean pressure grows with the root of the load.

    Depth and speed are there.
    """
    _, path = l16
    force = np.linspace(10.0, 3000.0, 201)
    depth = np.full((2, 201), 3e-6)
    seen = []

    def squared(state):
        seen.append(state)
        return 1e-36 * state.pressure**2

    per_load = 1e-36 * mean_pressure(force, path) ** 2 / (force / path.face_width)
    law = prepare(
        WearLaw((FlankLaw(squared), FlankLaw(PowerOfLoad(per_load, 1.0)))), path
    )
    found = wear_rate(law, force, depth)
    slid = path.slide_ratio[0] > 0.0
    ratio = path.slide_ratio[0, slid] / path.slide_ratio[1, slid]
    assert found[0, slid] == pytest.approx(found[1, slid] * ratio, rel=1e-9, abs=1e-40)
    assert not law.linear
    assert np.all(seen[0].depth == 3e-6) and np.isnan(seen[0].lambda_ratio).all()
    assert seen[0].sliding_speed == pytest.approx(
        np.abs(np.diff(path.surface_velocity, axis=0)[0])
    )


def test_a_law_of_ones_own_is_archards_where_it_says_the_same(l16):
    _, path = l16
    force = np.linspace(0.0, 3000.0, 201)
    k = constant(path, 1e-18)
    same = FlankLaw(
        k,
        rate=lambda state: state.coefficient * state.pressure * state.sliding_distance,
    )
    own, archard = (
        prepare(WearLaw((one, one), pressure_factor=4 / np.pi), path)
        for one in (same, FlankLaw(k))
    )
    assert wear_rate(own, force) == pytest.approx(
        wear_rate(archard, force), rel=1e-12, abs=1e-40
    )


@pytest.mark.parametrize("value", [-1e-18, np.nan, np.inf])
def test_what_no_flank_can_do_is_refused(l16, value):
    _, path = l16
    wrong = FlankLaw(lambda state: 0.0 * state.load + value)
    law = prepare(WearLaw((FlankLaw(constant(path, 1e-18)), wrong)), path)
    with pytest.raises(VariantError, match="must be finite and not negative"):
        wear_rate(law, np.ones(201))
