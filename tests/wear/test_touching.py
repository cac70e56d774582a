"""Where worn flanks touch, there they wear: areas, first order, whole lives."""

import numpy as np
import pytest

from tests.benchmarks import touching_wear
from tests.support.scenes import external_pair
from wearlab.scene import Scene
from wearlab.simulation import simulate
from wearlab.wear.patch import ascending
from wearlab.wear.touching import TouchingPoints

DEPTHS = (20e-6, 50e-6, 100e-6, 200e-6)


def touching_at(s, path, shift):
    """Return contacts shifted along the path, (2, n) [m]."""
    return TouchingPoints(s + np.broadcast_to(shift, (2, len(s))), s, path)


def rate_along(path):
    s = (path.arc - path.arc.min(axis=1, keepdims=True)) / np.ptp(path.arc, axis=1)[
        :, None
    ]
    return 1e-12 * (1.5 + np.cos(5.0 * s))


def test_unworn_flanks_keep_their_rate(l16):
    s, path = l16
    rate = rate_along(path)
    worn = touching_at(s, path, 0.0).worn(rate)
    np.testing.assert_allclose(worn, rate, rtol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_the_worn_area_is_conserved_wherever_contacts_go(l16, seed):
    s, path = l16
    rng = np.random.default_rng(seed)
    rate = rate_along(path)
    shift = rng.uniform(-1.0, 1.0, (2, 1)) * 2e-4 * np.sin(9e2 * s)
    shift[:, ::7] += 1e-4  # some jump
    worn = touching_at(s, path, shift).worn(rate)
    area = (path.arc_weight * rate).sum(axis=1)
    np.testing.assert_allclose((path.arc_weight * worn).sum(axis=1), area, rtol=1e-11)
    assert worn.min() > -1e-13


def test_contacts_that_do_not_meet_wear_where_they_would(l16):
    s, path = l16
    rate = rate_along(path)
    met = np.stack([s, s])
    met[:, 10:14] = np.nan
    worn = TouchingPoints(met, s, path).worn(rate)
    np.testing.assert_allclose(worn, rate, rtol=1e-12)


def test_a_small_shift_is_a_flux_of_wear(make_path):
    """``r − ∂(r x)/∂L`` where the contact is off by x along the flank."""
    s, path = make_path(n=801)
    rate = rate_along(path)
    off = 2e-6 * np.sin(1.2e3 * s)
    worn = touching_at(s, path, off).worn(rate)
    inside = slice(40, -40)
    for gear in (0, 1):
        arc = ascending(path.arc[gear])
        along = np.interp(s + off, s, arc) - arc
        expected = -np.gradient(rate[gear] * along, arc)
        found = worn[gear] - rate[gear]
        largest = np.abs(expected[inside]).max()
        assert found[inside] == pytest.approx(expected[inside], abs=0.03 * largest)


def life_over_depths(contact, patch):
    """Return the cycles of a pair 20/40, m 2, at 20 N m to all depths, (4,)."""
    scene = Scene.from_mapping(
        {
            "gears": external_pair(20, 40, module="2 mm", face_width="20 mm"),
            "operation": {"torque": "20 N*m", "speed": "1000 rpm"},
            "mesh": {"contact": contact},
            "wear": {
                "coefficient": {"model": "constant", "value": "1e-16 m^2/N"},
                "contact_patch": patch,
                "until": {"flank": "pinion", "depth": "200 um"},
                "snapshots": {
                    "flank": "pinion",
                    "depth": ["20 um", "50 um", "100 um"],
                },
            },
        }
    )
    run = simulate(scene)
    deepest = run["max_wear_depth"].max("flank").values
    return np.interp(DEPTHS, deepest, run["cycle"].values)


@pytest.fixture(scope="module")
def outlines():
    """Lives by whole outlines, over those that do not know where contacts go."""
    load = 20.0 / touching_wear.pair().base_radius[0]
    first_order = touching_wear.life("displacement", load, 2.6e8)
    return touching_wear.life("touching", load, 2.6e8) / first_order


@pytest.mark.parametrize(
    ("contact", "bound"), [("displacement", 0.05), ("exact", 0.03)]
)
def test_deep_lives_are_those_of_whole_outlines(outlines, contact, bound):
    """Against the brute force of `touching_wear`, to a tenth of a module."""
    blind = life_over_depths("displacement", "two-way")
    found = life_over_depths(contact, "elastic") / blind
    np.testing.assert_allclose(found, outlines, rtol=bound)
