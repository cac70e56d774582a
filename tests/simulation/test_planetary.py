"""A planetary set at rest on its carrier: loads, passes, lags and wear of all four
kinds of flank.
"""

import numpy as np
import pytest
from scenes import planetary_set

from wearlab.assembly import build, build_modes
from wearlab.gears.specification import GearError
from wearlab.scene import Scene
from wearlab.simulation import simulate
from wearlab.simulation.dataset.modes import modes_table

SUN, PLANET, RING = 20, 29, 79
K = 1e-18
TORQUE = 134.0

SET = {
    "gears": planetary_set(
        {"teeth": SUN, "profile_shift_coefficient": 0.35},
        {"teeth": PLANET, "bore_diameter": "47 mm"},
        {"teeth": RING, "rim_diameter": "209 mm"},
        module="2.25 mm",
        face_width="25 mm",
        centre_distance="56.5 mm",
        carrier={"mass": "4.5 kg", "inertia": "11178 kg*mm^2"},
    ),
    "operation": {"torque": "134 N*m", "speed": "1500 rpm"},
    "mesh": {
        "stiffness": {"model": "potential-energy"},
        "extended_contact": False,
    },  # linear in the load
    "wear": {
        "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
        "contact_patch": "none",  # Archard's law by hand, point by point
        "until": {"cycles": 1e6},
    },
}


@pytest.fixture(scope="module")
def scene():
    return Scene.from_mapping(SET)


@pytest.fixture(scope="module")
def still(scene):
    return simulate(scene)


def test_every_mesh_carries_its_share_of_the_sun_torque(scene, still):
    base_radius = build(scene).gears.gears["sun"].base_radius
    np.testing.assert_allclose(
        still.static_mesh_force, TORQUE / (3 * base_radius), rtol=1e-12
    )
    np.testing.assert_allclose(still.load_share.sum("pair"), 1.0, atol=1e-12)


def test_flanks_pass_as_often_as_the_train_says(still):
    cycles = float(still.cycle[-1])
    expected = {
        "sun": 3 * cycles,
        "planet-sun": cycles * SUN / PLANET,
        "planet-ring": cycles * SUN / PLANET,
        "ring": 3 * cycles * SUN / RING,
    }
    for flank, passes in expected.items():
        assert float(still.load_cycles.sel(flank=flank)[-1]) == pytest.approx(
            passes, rel=1e-12
        )
    carrier = 1500.0 * SUN / (SUN + RING)
    assert float(still.mesh_frequency[0]) == pytest.approx(
        SUN * (1500.0 - carrier) / 60.0, rel=1e-12
    )


def test_first_wear_is_archards_law_on_each_flank(scene, still):
    """dh/dN = passes · k · F_j/B · |1 − v_other/v_own| with speeds relative to the
    carrier, by hand.
    """
    parts = build(scene)
    teeth = {"sun": SUN, "planet-sun": PLANET, "planet-ring": PLANET, "ring": RING}
    other = {"sun": PLANET, "planet-sun": SUN, "planet-ring": RING, "ring": PLANET}
    passes = {
        "sun": 3,
        "planet-sun": SUN / PLANET,
        "planet-ring": SUN / PLANET,
        "ring": 3 * SUN / RING,
    }
    for flank in teeth:
        kind, gear = parts.gears.flank(flank)
        pair = parts.kinds[kind].pair
        s = parts.kinds[kind].analysis.grid.position
        rho = pair.curvature(s)
        own = rho[gear] / teeth[flank]
        mate = rho[1 - gear] / other[flank]
        force = still.tooth_force.sel(flank=flank).values[0, : len(s)]
        rate = passes[flank] * K * force / pair.face_width * np.abs(1.0 - mate / own)
        found = still.wear_rate.sel(flank=flank).values[0, : len(s)]
        np.testing.assert_allclose(found, rate, rtol=1e-10, atol=1e-12 * rate.max())
        assert rate.max() > 0.0


def test_flanks_of_unlike_meshes_have_as_many_nodes(still):
    assert np.isfinite(still.wear_depth).all()
    letters = still.characteristic_point.sel(flank="ring").values
    assert {"A", "B", "C", "D", "E"} <= set(letters.tolist())


def test_lagging_meshes_show_the_same_stiffness_later(scene):
    """Mesh i at clock phase φ + γ is mesh 1 at φ: values on phases that a lag of a
    third maps on another.
    """
    data = simulate(scene.replace("numerics.phase_points", 240))
    stiffness = data.mesh_stiffness.values[0]
    for mesh in range(6):
        first = 0 if mesh < 3 else 3
        lag = float(data.mesh_phase_offset[mesh] - data.mesh_phase_offset[first]) % 1.0
        shift = lag * 240
        assert shift == pytest.approx(round(shift), abs=1e-6)
        rolled = np.roll(stiffness[first], round(shift))
        np.testing.assert_allclose(np.sort(stiffness[mesh]), np.sort(rolled), rtol=2e-2)
        assert np.mean(np.abs(stiffness[mesh] / rolled - 1.0) < 1e-9) > 0.97


@pytest.mark.parametrize(
    ("roles", "sun_drives"),
    [
        (("sun", "carrier", "ring"), True),
        (("carrier", "sun", "ring"), False),
        (("ring", "carrier", "sun"), False),
        (("sun", "ring", "carrier"), True),
    ],
)
def test_power_may_enter_anywhere(scene, roles, sun_drives):
    """The mesh force follows from the torque on the input by the
    train's ratio of torques.
    """
    table = {"input": roles[0], "output": roles[1], "fixed": roles[2]}
    changed = Scene.from_mapping({**SET, "operation": {**SET["operation"], **table}})
    parts = build(changed)
    lever = {"sun": SUN, "ring": RING, "carrier": SUN + RING}
    expected = (
        TORQUE * SUN / lever[roles[0]] / (3 * parts.gears.gears["sun"].base_radius)
    )
    assert parts.gears.kinds[0].load == pytest.approx(expected, rel=1e-12)
    assert (parts.gears.kinds[0].pair.driving.name == "sun") is sun_drives
    assert (parts.gears.kinds[1].pair.driving.name == "planet") is sun_drives


def test_face_load_factor_wears_as_a_narrower_face(scene, still):
    loaded = simulate(scene.replace("mesh.face_load_factor", 1.3))
    first = np.nan_to_num(still.wear_rate.values[0])
    np.testing.assert_allclose(loaded.wear_rate.values[0], 1.3 * first, rtol=1e-9)


def test_planets_with_errors_of_their_pins_share_unequally(scene):
    """The mean elastic and damping force of each mesh, over that of its kind.

    Alike without errors.
    """
    held = {
        "radial_stiffness": "100 N/um",
        "tangential_stiffness": "50 N/um",
        "damping_ratio": 0.05,
    }
    dynamics = {
        "model": "planetary",
        "supports": dict.fromkeys(("sun", "ring", "carrier", "planet"), held),
    }
    for member in ("sun", "planet"):
        dynamics["supports"][member] = {
            k: v for k, v in held.items() if k != "tangential_stiffness"
        }
    table = {**SET, "dynamics": dynamics, "mesh": {"damping_ratio": 0.07}}
    table["wear"] = {"coefficient": SET["wear"]["coefficient"]}
    alike = simulate(Scene.from_mapping(table)).mesh_load_factor.values
    np.testing.assert_allclose(alike, 1.0, atol=1e-4)
    table["errors"] = {
        "slow": "frozen",
        "seed": 3,
        "carrier": {"planet_position": ["5 um"]},
    }
    data = simulate(Scene.from_mapping(table))
    found = data.mesh_load_factor.values[0]
    assert np.ptp(found[:3]) > 0.05 and found[:3].mean() == pytest.approx(
        1.0, abs=1e-12
    )
    force = (
        (data.dynamic_mesh_force + data.mesh_damping_force)[0]
        .mean(("mesh_period", "phase"))
        .values
    )
    shares = np.r_[force[:3] / force[:3].mean(), force[3:] / force[3:].mean()]
    np.testing.assert_allclose(found, shares, atol=2e-3)
    np.testing.assert_allclose(
        found[:3], found[3:], atol=1e-2
    )  # a planet passes on what it takes


@pytest.mark.parametrize(
    "roles", [("sun", "carrier", "ring"), ("carrier", "sun", "ring")]
)
def test_critical_speeds_are_those_of_the_input(roles):
    """At the speed in the table, as ``operation.speed`` would have
    it, the mesh meets the mode.
    """
    held = {"radial_stiffness": "100 N/um", "damping_ratio": 0.03}
    dynamics = {
        "model": "planetary",
        "rotation": False,
        "supports": dict.fromkeys(("sun", "planet"), held)
        | dict.fromkeys(
            ("ring", "carrier"), held | {"tangential_stiffness": "10 N/um"}
        ),
    }
    table = dict(zip(("input", "output", "fixed"), roles, strict=True))
    changed = Scene.from_mapping(
        {
            **SET,
            "operation": {**SET["operation"], **table},
            "dynamics": dynamics,
            "mesh": {"damping_ratio": 0.07},
        }
    )
    row = modes_table(changed)[3]
    for order in (1, 2):
        speed = row[f"critical speed, order {order} [rpm]"]
        at = build(changed.replace("operation.speed", f"{speed!r} rpm"))
        assert order * at.gears.mesh_frequency == pytest.approx(
            row["natural_frequency [Hz]"], rel=1e-9
        )


def test_a_set_with_two_free_rotations_is_refused_by_name():
    held = {"radial_stiffness": "100 N/um", "damping_ratio": 0.1}
    supports = dict.fromkeys(("sun", "planet", "ring", "carrier"), held)
    mapping = {**SET, "mesh": {"damping_ratio": 0.05}}
    mapping |= {"dynamics": {"model": "planetary", "supports": supports}}
    with pytest.raises(
        GearError, match=r"supports: 2 rotations are free .* torsional_stiffness"
    ):
        build(Scene.from_mapping(mapping))


def held_softly(stiffness, speed):
    held = {"radial_stiffness": stiffness, "damping_ratio": 0.1}
    supports = dict.fromkeys(("sun", "planet", "carrier"), held)
    supports["ring"] = {**held, "tangential_stiffness": "100 N/um"}
    mapping = {
        **SET,
        "mesh": {"damping_ratio": 0.05},
        "dynamics": {"model": "planetary", "supports": supports},
    }
    return build(
        Scene.from_mapping(
            {**mapping, "operation": {"torque": "134 N*m", "speed": speed}}
        )
    )


def test_a_set_that_flies_apart_is_refused_and_one_that_stretches_turns_freely():
    with pytest.raises(GearError, match="indefinite"):
        held_softly("0.02 N/um", "9000 rpm")
    stretched = build_modes(held_softly("0.2 N/um", "4000 rpm")).modes.frequency
    assert stretched[0] == 0.0 and stretched[1] > 0.0
