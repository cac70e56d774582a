"""Planetary sets whose flanks have a width: each mesh as the pair
that it is, lags, hands, motion.
"""

from functools import cache

import numpy as np
import pytest
from nodal_period import at_nodes
from scenes import planetary_set

from wearlab.assembly import build
from wearlab.scene import Scene, SceneError
from wearlab.simulation import simulate
from wearlab.wear.path import sliding_velocity

RING = {"teeth": 76, "rim_diameter": "209 mm"}
PLANET = {"teeth": 28, "bore_diameter": "47 mm"}
SET = {
    "gears": planetary_set(
        20,
        PLANET,
        RING,
        module="2.25 mm",
        face_width="25 mm",
        carrier={"mass": "4.5 kg", "inertia": "11178 kg*mm^2"},
    ),
    "operation": {"torque": "134 N*m", "speed": "1500 rpm"},
    "mesh": {"stiffness": {"model": "potential-energy"}, "extended_contact": False},
    "wear": {
        "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
        "contact_patch": "none",
    },
    "numerics": {"profile_points": 81},
}
EVEN = {"mesh.face_coupling": "pasternak", "mesh.face_points": 5}
HELICAL = {
    "gears.helix_angle": "12 deg",
    "mesh.face_points": 21,
    "mesh.sun_planet": {"misalignment": "10 um"},
    "mesh.planet_ring": {"misalignment": "-6 um"},
}
MIRRORED = {
    **HELICAL,
    "gears.sun.hand": "left",
    "mesh.sun_planet": {"misalignment": "-10 um"},
    "mesh.planet_ring": {"misalignment": "6 um"},
}
MOVING = {"dynamics.model": "planetary-torsional", "mesh.damping_ratio": 0.07}


def scene(changes):
    return Scene.from_mapping(SET).replace(changes)


@cache
def known(name):
    return simulate(
        scene(
            {
                "plain": {},
                "even": EVEN,
                "helical": HELICAL,
                "mirrored": MIRRORED,
                "plain moving": {**MOVING, "numerics.profile_points": 201},
                "even moving": {**MOVING, **EVEN, "numerics.profile_points": 201},
                "helical moving": {**MOVING, **HELICAL},
            }[name]
        )
    )


def test_an_even_spur_face_is_the_planetary_set():
    plain = known("plain")
    face = known("even")
    rate = plain["wear_rate"].values[:, :, None, :]
    np.testing.assert_allclose(
        face["wear_rate"].values - rate, 0.0, atol=1e-9 * np.nanmax(rate)
    )
    for kind, mesh in ((0, 0), (1, 3)):
        for name, wanted in at_nodes(scene({}), kind).items():
            found = face[name].values[0, mesh]
            atol = 1e-9 * np.max(wanted)
            np.testing.assert_allclose(found, wanted, rtol=0.0, atol=atol, err_msg=name)
    assert face["worn_mass"].sizes == plain["worn_mass"].sizes
    assert face["face_load_factor"].values == pytest.approx(1.0, rel=1e-9)


def pair_of(mesh):
    """Return the scene of one mesh of the helical set as a pair, with
    its load and relative speed.
    """
    parts = build(scene(HELICAL))
    kind = parts.gears.kinds[mesh]
    driving = kind.pair.driving
    members = {
        0: {"kind": "external-pair", "pinion": {"teeth": 20}, "gear": PLANET},
        1: {
            "kind": "internal-pair",
            "pinion": {**PLANET, "hand": "left"},
            "ring": RING,
        },
    }[mesh]
    given = {key: SET["gears"][key] for key in ("module", "face_width")}
    return Scene.from_mapping(
        {
            **{key: SET[key] for key in ("wear", "numerics")},
            "gears": {**given, **members, "helix_angle": "12 deg"},
            "operation": {
                "torque": f"{kind.load * driving.base_radius!r} N*m",
                "speed": f"{float(kind.speed * 30.0 / np.pi)!r} rpm",
                "drive_flank": "right" if mesh == 0 else "left",
            },
            "mesh": {
                **SET["mesh"],
                "face_points": 21,
                "misalignment": ("10 um", "-6 um")[mesh],
            },
        }
    )


@pytest.mark.parametrize("mesh", [0, 1])
def test_each_mesh_of_a_helical_set_is_the_helical_pair_that_it_is(mesh):
    """By the other way of building it, on nodes of its own.

    The rates differ by passes alone.
    """
    pair = simulate(pair_of(mesh))
    parts = build(scene(HELICAL))
    run = known("helical")
    first = 3 * mesh
    for name, tolerance in (
        ("stiffness_mean", 5e-3),
        ("ste_mean", 5e-3),
        ("face_load_factor", 1e-2),
        ("overlap_ratio", 1e-12),
        ("contact_ratio", 1e-12),
        ("base_helix_angle", 1e-12),
        ("static_mesh_force", 1e-12),
    ):
        wanted = pair[name].values[..., 0]
        np.testing.assert_allclose(
            run[name].values[..., first], wanted, rtol=tolerance, err_msg=name
        )
    mean = run["mean_line_load"].values[0, first]
    wanted = pair["mean_line_load"].values[0, 0]
    y = run["face_position"].values
    there = pair["face_position"].values
    inside = slice(2, -2)
    np.testing.assert_allclose(
        mean[inside], np.interp(y, there, wanted)[inside], atol=0.01 * wanted.max()
    )
    passes, alone = (
        of.gears.kinds[k].passes for of, k in ((parts, mesh), (build(pair_of(mesh)), 0))
    )
    flanks = ("sun", "planet-sun") if mesh == 0 else ("planet-ring", "ring")
    for number, flank in enumerate(flanks):
        rate = np.nanmax(run["wear_rate"].sel(flank=flank).values) / passes[number]
        assert rate == pytest.approx(
            pair["wear_rate"].values[0, number].max() / alone[number], rel=0.03
        )


def test_the_other_hands_and_misalignments_are_mirror_images():
    right = known("helical")
    left = known("mirrored")
    for name in ("wear_rate", "line_load", "contact_pressure"):
        there = right[name].values
        here = left[name].values[..., ::-1, :]
        np.testing.assert_allclose(here, there, rtol=1e-7, atol=1e-7 * np.nanmax(there))
    assert (right["base_helix_angle"] > 0.0).all() and (
        left["base_helix_angle"] < 0.0
    ).all()


def test_line_loads_of_every_mesh_carry_its_force_and_wear_what_slides():
    run = known("helical")
    parts = build(scene(HELICAL))
    assert run["residual_line_load"].values.max() < 1e-12
    width = parts.face.kinds[0].contact.grid.width
    np.testing.assert_allclose(
        run["mean_line_load"].values[0] @ width,
        run["static_mesh_force"].values,
        rtol=1e-12,
    )
    for kind, (section, of) in enumerate(
        zip(parts.kinds, parts.face.kinds, strict=True)
    ):
        inner = slice(1, -1)
        path = section.path
        load = parts.coupling.evaluate(parts.coupling.unworn()).kind[kind]
        step = np.diff(of.contact.grid.profile.position)[0]
        time = step / (parts.gears.kinds[kind].speed * section.pair.driving.base_radius)
        normal = load.line_load[:, inner] / of.contact.helix.cosine
        given = (
            1e-18
            * np.einsum(
                "jk,gk,j->g", normal, np.abs(sliding_velocity(path))[:, inner], width
            )
            * time
        )
        area = path.arc_weight[:, inner] / of.contact.helix.cosine
        h = load.rate[:, :, inner] / path.passes[:, None, None]
        assert np.einsum("gjk,gk,j->g", h, area, width) == pytest.approx(
            given, rel=1e-9
        )


def test_hands_of_a_set_follow_the_sun_and_a_carrier_that_drives_turns_the_lines():
    helical = scene(HELICAL)
    assert helical.hands() == {"sun": "right", "planet": "left", "ring": "left"}
    assert helical.replace("gears.ring.hand", "right").hands()["sun"] == "left"
    with pytest.raises(SceneError, match=r"gears\.ring\.hand: .* the same hand"):
        helical.replace({"gears.planet.hand": "left", "gears.ring.hand": "right"})
    wind = {
        "operation.input": "carrier",
        "operation.output": "sun",
        "operation.fixed": "ring",
    }
    turned = build(
        helical.replace(
            {**wind, "operation.torque": "640 N*m", "operation.speed": "300 rpm"}
        )
    )
    assert {kind.contact.helix.sense for kind in turned.face.kinds} == {-1.0}


def test_faces_of_two_widths_in_one_set_are_refused():
    with pytest.raises(SceneError, match=r"gears\.sun\.face_width: .* 20 and 25 mm"):
        scene({**HELICAL, "gears.sun.face_width": "20 mm"})
    assert (
        scene({**HELICAL, "gears.planet.face_width": "20 mm"}).gears.planet.face_width
        == 0.02
    )


def test_an_even_face_vibrates_as_the_planetary_set_does():
    plain = known("plain moving")
    face = known("even moving")
    for name in (
        "dynamic_factor",
        "normal_force_factor",
        "natural_frequency",
        "mesh_load_factor",
    ):
        np.testing.assert_allclose(
            face[name].values, plain[name].values, rtol=1e-2, err_msg=name
        )
    rate = face["wear_rate"].values
    wanted = plain["wear_rate"].values
    assert np.nanmax(rate) == pytest.approx(np.nanmax(wanted), rel=1e-2)


def test_meshes_of_a_helical_set_in_motion_carry_their_static_mean():
    run = known("helical moving")
    assert np.abs(run["residual_mean_force"].values).max() < 1e-3
    mean = run["normal_mesh_force"].values.mean(axis=(-1, -2))[0]
    np.testing.assert_allclose(mean, run["static_mesh_force"].values, rtol=2e-3)
    assert (run["dynamic_factor"].values > 1.0).all()


def test_bearings_hold_what_the_helix_pushes_along_the_axes():
    """Sun and ring hold theirs, pushed apart.

    The two meshes of a planet cancel in the mean, and tilt it.
    """
    bearing = {"radial_stiffness": "1e8 N/m", "damping_ratio": 0.05}
    supports = {member: bearing for member in ("sun", "planet", "ring", "carrier")}
    supports["ring"] = {**bearing, "tangential_stiffness": "1e9 N/m"}
    moving = {
        "dynamics": {"model": "planetary", "supports": supports},
        "mesh.damping_ratio": 0.07,
    }
    run = simulate(
        scene(
            {**HELICAL, **moving, "mesh.face_points": 11, "numerics.profile_points": 41}
        )
    )
    assert run["axis"].values.tolist() == ["x", "y", "z"]
    mean = (
        run["bearing_force"].sel(axis="z").isel(update=0).mean(["mesh_period", "phase"])
    )
    turned = np.radians(12.0)
    radius = 2.25e-3 * np.array([20, 28]) / (2.0 * np.cos(turned))
    pushed = 134.0 / radius[0] * np.tan(turned)  # F_t tan β
    assert float(mean.sel(member="sun")) == pytest.approx(pushed, rel=2e-3)
    assert float(mean.sel(member="ring")) == pytest.approx(-pushed, rel=2e-3)
    assert (
        np.abs(mean.sel(member=["planet-1", "planet-2", "planet-3"]).values).max()
        < 2e-3 * pushed
    )
    total = (
        run["bearing_force"]
        .sel(axis="z")
        .sel(member=["sun", "ring", "carrier"])
        .sum("member")
    )
    assert np.abs(total.values).max() < 1e-9 * pushed
    told = run["validity"].item()
    assert (
        f"tilt it by up to {pushed / 3.0 * 2.0 * radius[1]:.4g} N m" in told
        and "no bearing here" not in told
    )
    assert (
        f"each mesh pushes its gears up to {pushed / 3.0:.4g} N"
        in known("helical")["validity"].item()
    )
