"""An internal pair whose wear evolves, driven by either gear, in
exact and in first-order contact.
"""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scenes import internal_pair

import wearlab
from wearlab.cli import app
from wearlab.scene import Scene
from wearlab.simulation import simulate

pytestmark = pytest.mark.usefixtures("alone")

PAIR = internal_pair(
    {
        "teeth": 40,
        "root_diameter": "225 mm",
        "fillet_radius_coefficient": 0.35,
    },
    {
        "teeth": 100,
        "tip_alteration": "wang-2023",
        "root_diameter": "615 mm",
        "rim_diameter": "700 mm",
    },
    module="6 mm",
    face_width="50 mm",
    centre_distance="180 mm",
)
BY_PINION = {"torque": "1000 N*m", "speed": "1000 rpm"}
BY_RING = {
    "torque": "2500 N*m",
    "speed": "400 rpm",
    "input": "ring",
    "output": "pinion",
}
BASE_RADII = 0.5 * 0.006 * np.cos(np.radians(20.0)) * np.array([[40.0], [100.0]])
K = 2e-18


def scene(contact, operation, **wear):
    coefficient = {
        "coefficient": {"model": "constant", "value": f"{K} m^2/N"},
        "until": {"cycles": 5e7},
    }
    coefficient["contact_patch"] = "none"  # Archard's law, point by point
    return Scene.from_mapping(
        {
            "gears": PAIR,
            "operation": operation,
            "mesh": {
                "contact": contact,
                "extended_contact": False,
            },  # corners do not know who drives
            "wear": wear or coefficient,
            "numerics": {"profile_points": 81, "phase_points": 64},
        }
    )


@cache
def life(contact, driver):
    return simulate(scene(contact, BY_RING if driver == "ring" else BY_PINION))


@pytest.mark.parametrize("driver", ["pinion", "ring"])
def test_flanks_of_an_internal_pair_wear_as_they_slide(driver):
    """Both flanks slide past each other at equal speed: rates per
    turn are as ρ_ring to ρ_pinion.
    """
    run = life("exact", driver)
    rho = np.sqrt((0.5 * run.diameter.values) ** 2 - BASE_RADII**2)
    rate = run.wear_rate.sel(flank=["pinion", "ring"]).values[0]
    slides = rate[1] > 0.0
    assert slides.sum() > 70
    # contacts are found to 1e-8 of the path, beside the pitch point as well
    np.testing.assert_allclose(
        rate[0] * rho[0], rate[1] * rho[1], rtol=0.0, atol=2e-8 * (rate * rho).max()
    )
    force = run.static_mesh_force.item()
    assert force == pytest.approx(1000.0 / BASE_RADII[0, 0], rel=1e-12)


def test_either_driver_wears_the_unworn_pair_alike():
    """Static force and sliding do not tell who drives.

    The ring's path is the pinion's backwards.
    """
    pinion = life("exact", "pinion")
    ring = life("exact", "ring")
    first = pinion.wear_rate.values[0]
    second = ring.wear_rate.values[0]
    np.testing.assert_allclose(
        second[:, ::-1], first, rtol=1e-6, atol=1e-9 * first.max()
    )
    np.testing.assert_allclose(
        ring.max_wear_depth[-1], pinion.max_wear_depth[-1], rtol=1e-3
    )


def test_slight_wear_grows_alike_in_both_forms():
    worn = {
        "coefficient": {"model": "constant", "value": f"{K} m^2/N"},
        "until": {"cycles": 5e7},
    }
    exact = simulate(scene("exact", BY_PINION, **worn))
    first_order = simulate(scene("displacement", BY_PINION, **worn))
    assert exact.max_wear_depth.values[-1, 0] > 2e-6
    np.testing.assert_allclose(
        exact.max_wear_depth[-1], first_order.max_wear_depth[-1], rtol=5e-3
    )


def test_it_is_told_how_far_the_first_order_form_is_off():
    initial = {
        flank: {"depth": "40 um", "shape": "quadratic"} for flank in ("pinion", "ring")
    }
    exact = simulate(scene("exact", BY_PINION, initial=initial))
    first_order = simulate(scene("displacement", BY_PINION, initial=initial))
    largest = [
        float(run.unloaded_transmission_error.max()) for run in (exact, first_order)
    ]
    excess = float(exact.first_order_excess[0, 0])
    assert excess == pytest.approx(largest[1] / largest[0] - 1.0, rel=0.05)
    depth = float(exact.first_order_depth[0, 0])
    assert (excess > 0.05) == (depth < 40e-6)
    assert "first_order_depth" not in first_order
    at_depth = {
        flank: {"depth": f"{1e6 * depth} um", "shape": "quadratic"}
        for flank in ("pinion", "ring")
    }
    assert float(
        simulate(scene("exact", BY_PINION, initial=at_depth)).first_order_excess[0, 0]
    ) == pytest.approx(0.05, rel=1e-3)


MEASURED = (
    'x = "path_position", y = "depth", units = { path_position = "mm", depth = "um" }'
)


@pytest.mark.parametrize(
    ("initial", "said"),
    [
        (
            'depth = "9 mm", shape = "uniform"',
            "wear.initial.pinion: wear of 9 mm is deeper than the tooth",
        ),
        (
            f'file = "few.csv", {MEASURED}',
            "pinion: 2 measured points lie on the active flank; give 5 or more",
        ),
        (
            f'file = "short.csv", {MEASURED}',
            "pinion: the measured profile covers diameters",
        ),
    ],
)
def test_wear_that_no_tooth_can_have_is_refused_before_anything_is_written(
    tmp_path, capsys, initial, said
):
    base = (
        Path(wearlab.__file__).parents[1]
        / "campaigns"
        / "base"
        / "internal_40_100.toml"
    )
    (tmp_path / "few.csv").write_text("path_position,depth\n-30,0\n-5,1\n5,2\n40,3\n")
    rows = "".join(f"{s},{abs(s)}\n" for s in range(-3, 4))
    (tmp_path / "short.csv").write_text("path_position,depth\n" + rows)
    file = tmp_path / "worn.toml"
    store = tmp_path / "store"
    file.write_text(
        f'extends = "{base.as_posix()}"\n[wear.initial]\npinion = {{ {initial} }}\n'
    )
    assert app.status_of(["run", str(file), "--store", str(store)]) == 2
    assert said in capsys.readouterr().err and not store.exists()


def vibrating(model, operation):
    supports = {
        "pinion": {"radial_stiffness": "1000 N/um", "damping": "1 N*s/m"},
        "ring": {"radial_stiffness": "2000 N/um", "damping": "1 N*s/m"},
    }
    mapping = {
        "gears": PAIR,
        "operation": operation,
        "mesh": {"damping_ratio": 1e-3, "extended_contact": False},
        "dynamics": {
            "model": model,
            **({"supports": supports} if model == "spur-3dof" else {}),
        },
        "numerics": {"profile_points": 81, "phase_points": 256, "tolerance": 1e-5},
    }
    return simulate(Scene.from_mapping(mapping))


@pytest.mark.parametrize("model", ["torsional", "spur-3dof"])
def test_driven_by_the_ring_an_undamped_pair_vibrates_backwards(model):
    """Above its resonances and all but undamped, one driver's motion is the other's
    with time reversed.
    """
    by_pinion = vibrating(model, BY_PINION | {"speed": "5000 rpm"})
    by_ring = vibrating(model, BY_RING | {"speed": "2000 rpm"})
    assert by_ring.natural_frequency.values == pytest.approx(
        by_pinion.natural_frequency.values, rel=1e-9
    )
    phase = by_pinion.phase.values
    ratio = float(by_pinion.contact_ratio.values.ravel()[0])
    forth = by_pinion.dynamic_mesh_force.values[0, 0, -1]
    back = by_ring.dynamic_mesh_force.values[0, 0, -1]
    mirrored = np.interp(
        (ratio - phase) % 1.0, np.r_[phase, 1.0], np.r_[forth, forth[0]]
    )
    steps = np.abs((phase[:, None] - [0.0, ratio] + 0.5) % 1.0 - 0.5).min(
        axis=1
    ) > 2.0 / len(phase)
    assert np.ptp(forth) > 0.3 * forth.mean()
    np.testing.assert_allclose(back[steps], mirrored[steps], atol=4e-3 * forth.mean())
    if model == "spur-3dof":
        pull = [np.abs(one.bearing_force.values).max() for one in (by_pinion, by_ring)]
        assert pull[0] == pytest.approx(pull[1], rel=1e-2)
