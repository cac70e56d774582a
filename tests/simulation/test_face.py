"""Runs of flanks with a width: their limits, mirror images, worn
volume and running-in.
"""

from functools import cache

import numpy as np
import pytest
from field_of_action import FieldOfAction
from nodal_period import at_nodes
from scenes import external_pair

from wearlab.assembly import build, mesh
from wearlab.scene import Scene
from wearlab.simulation import simulate
from wearlab.simulation.dataset.wear import worn_mass
from wearlab.wear.path import sliding_velocity

GEARS = external_pair(23, 71, module="4 mm", face_width="45 mm")
SPUR = {
    "gears": GEARS,
    "operation": {"torque": "320 N*m", "speed": "1450 rpm"},
    "mesh": {"stiffness": {"model": "potential-energy", "hertz": "weber"}},
    "wear": {"coefficient": {"model": "constant", "value": "1e-18 m^2/N"}},
    "numerics": {"profile_points": 61},
}


def scene(**changes):
    return Scene.from_mapping(SPUR).replace(
        {key.replace("__", "."): value for key, value in changes.items()}
    )


@cache
def known(name):
    return simulate(
        {
            "spur": scene(wear__until={"depth": "5 um"}),
            "slices": scene(
                wear__until={"depth": "5 um"},
                mesh__face_coupling="none",
                mesh__face_points=5,
            ),
            "layer": scene(
                wear__until={"depth": "5 um"},
                mesh__face_coupling="pasternak",
                mesh__face_points=5,
            ),
            "right": helical(),
            "left": helical().replace(
                {"gears.pinion.hand": "left", "mesh.misalignment": "-20 um"}
            ),
        }[name]
    )


def helical():
    return scene(
        gears__helix_angle="12 deg", mesh__misalignment="20 um", mesh__face_points=21
    )


@pytest.fixture
def nodes_of_a_face(monkeypatch):
    """Lay the nodes of flanks with a width on flanks without one."""
    monkeypatch.setattr(mesh, "has_fixed_layers", lambda _: True)


@pytest.mark.parametrize("coupling", ["slices", "layer"])
def test_an_even_spur_face_is_the_spur_pair(coupling, nodes_of_a_face):
    """The first rate to rounding, on the same nodes.

    Later what wear does to the sections of teeth is left out.
    """
    spur = known("spur")
    face = known(coupling)
    rate = spur["wear_rate"].values[0][:, None, :]
    np.testing.assert_allclose(
        face["wear_rate"].values[0] - rate, 0.0, atol=1e-9 * rate.max()
    )
    for name, wanted in at_nodes(scene(), 0).items():
        np.testing.assert_allclose(
            face[name].values[0, 0], wanted, rtol=0.0, atol=1e-9 * np.max(wanted)
        )
    assert float(face.life) == pytest.approx(float(spur.life), rel=2e-4)
    assert face["worn_mass"].values[-1] == pytest.approx(
        spur["worn_mass"].values[-1], rel=1e-3
    )
    assert face["face_load_factor"].values == pytest.approx(1.0, rel=1e-9)


def test_the_film_over_an_even_face_is_the_pairs_and_wears_by_its_own_slice(
    nodes_of_a_face,
):
    oil = {
        "lubricant": {"viscosity": "0.05 Pa*s", "pressure_viscosity": "2e-8 1/Pa"},
        "gears.pinion.roughness_ra": "0.4 um",
        "gears.gear.roughness_ra": "0.4 um",
        "wear.coefficient": {"model": "constant", "value": "1e-18 m^2/N", "film": True},
    }
    pair = simulate(scene().replace(oil))
    even = simulate(scene(mesh__face_points=5).replace(oil))
    for name in ("film_thickness", "lambda_ratio", "wear_rate"):
        assert even[name].dims == ("update", "flank", "face", "profile")
        wanted = pair[name].values[:, :, None, :]
        np.testing.assert_allclose(
            even[name].values - wanted, 0.0, atol=1e-9 * wanted.max(), err_msg=name
        )
    tilted = simulate(
        scene(mesh__misalignment="20 um", mesh__face_points=5).replace(oil)
    )
    film = tilted["film_thickness"].values[0, 0]
    load = tilted["line_load"].values[0, 0]
    inner = film.shape[1] // 2
    carrying = load[:, inner] > 0.0
    thin = film[carrying, inner]
    pressed = load[carrying, inner]
    np.testing.assert_allclose(
        thin, thin[0] * (pressed / pressed[0]) ** -0.13, rtol=1e-6
    )  # Dowson–Higginson


def to_the_ends_of_the_face(run):
    """Return the deepest wear of both flanks, and that out to the ends of the face [m].

    A straight line through the two outermost slices leads on to each end.
    """
    depth = run.wear_depth.isel(update=-1).values
    place = run.face_position.values
    half = 0.5 * (place[1] - place[0])
    first = depth[:, 0] - half * (depth[:, 1] - depth[:, 0]) / (place[1] - place[0])
    last = depth[:, -1] + half * (depth[:, -1] - depth[:, -2]) / (place[1] - place[0])
    inside = depth.max(axis=(1, 2))
    return inside, np.max([inside, first.max(axis=1), last.max(axis=1)], axis=0)


def test_the_estimate_is_what_half_the_slices_and_nodes_change_and_the_ends_miss():
    """And what the rates change besides, less than a twentieth of the depth."""
    run = simulate(
        scene().replace(
            {
                "mesh.misalignment": "20 um",
                "mesh.face_points": 20,
                "numerics.profile_points": 60,
                "wear.until": {"depth": "2 um"},
            }
        )
    )
    rougher = simulate(
        scene().replace(
            {
                "mesh.misalignment": "20 um",
                "mesh.face_points": 10,
                "numerics.profile_points": 30,
                "wear.until": {"cycles": float(run.life)},
            }
        )
    )
    deepest, at_end = to_the_ends_of_the_face(run)
    _, rough_at_end = to_the_ends_of_the_face(rougher)
    beyond_slices = float(at_end.max() - deepest.max())
    changed = float(np.abs(rough_at_end - at_end).max())
    least = beyond_slices + 2.0 * changed
    told = float(run.error_estimate_wear_depth[-1])
    assert beyond_slices > 0.01 * deepest.max()
    assert least <= told < least + 0.05 * deepest.max()


def test_depth_at_the_end_of_a_face_is_told_where_slices_end_before_it():
    """Tilted spur gears without coupling: the end wears deepest, beyond any slice."""
    tilted = {
        "mesh.misalignment": "20 um",
        "mesh.face_coupling": "none",
        "mesh.face_points": 20,
        "wear.until": {"depth": "2 um"},
    }
    run = simulate(scene().replace(tilted))
    as_long = {"cycles": float(run.life)}
    finest = simulate(
        scene().replace({**tilted, "mesh.face_points": 320, "wear.until": as_long})
    )
    _, at_end = to_the_ends_of_the_face(finest)
    error = float(at_end.max()) - 2e-6
    told = float(run.error_estimate_wear_depth[-1])
    assert 0.01 * 2e-6 < error < told < 2.0 * error


@pytest.mark.parametrize("coupling", ["none", "pasternak"])
def test_an_estimate_of_the_life_covers_what_more_slices_change(coupling):
    """The deepest point of spur gears moves by the first order of the
    width of slices.
    """
    given = {
        "mesh.misalignment": "20 um",
        "mesh.face_coupling": coupling,
        "wear.until": {"depth": "2 um"},
    }
    lives = {
        n: simulate(scene().replace({**given, "mesh.face_points": n}))
        for n in (20, 40, 120)
    }
    error = {n: abs(float(lives[n].life) - float(lives[120].life)) for n in (20, 40)}
    assert all(error[n] <= float(lives[n].error_estimate_life) for n in error)
    assert error[40] == pytest.approx(
        0.4 * error[20], rel=0.2
    )  # 1/40 − 1/120 over 1/20 − 1/120


def test_a_vanishing_helix_leads_to_the_spur_pair():
    straight = simulate(scene(mesh__face_points=7, mesh__face_coupling="none"))
    errors = []
    for degrees in ("2 deg", "0.02 deg"):
        turned = simulate(
            scene(
                gears__helix_angle=degrees,
                mesh__face_points=7,
                mesh__face_coupling="none",
            )
        )
        mean = float(
            turned["stiffness_mean"].values.item()
            / straight["stiffness_mean"].values.item()
        )
        peak = float(
            turned["wear_rate"].values.max() / straight["wear_rate"].values.max()
        )
        errors.append((abs(mean - 1.0), abs(peak - 1.0)))
    assert errors[1][0] < 5e-3 and errors[1][1] < 2e-2


@pytest.mark.parametrize(
    ("gears", "degrees", "widths"),
    [
        (external_pair(30, 41, module="2 mm", face_width="40 mm"), 25.0, 20.0),
        (external_pair(25, 50, face_width="90 mm"), 15.0, 30.0),
    ],
)
def test_wide_helical_pairs_transmit_as_the_length_of_their_lines(
    gears, degrees, widths
):
    """Constant stiffness, slices apart: δ ∝ 1/L, by lines cut off exactly.

    At the slices that stand by default, which were 28 and 12 % off.
    """
    run = simulate(
        Scene.from_mapping(
            {
                "gears": {**gears, "helix_angle": f"{degrees} deg"},
                "operation": {"torque": "100 N*m", "speed": "1000 rpm"},
                "mesh": {
                    "stiffness": {
                        "model": "constant",
                        "value": "400 N/um",
                        "of": "pair",
                    },
                    "face_coupling": "none",
                    "extended_contact": False,
                },
            }
        )
    )
    ratio = widths * np.sin(np.radians(degrees)) / np.pi  # b/m sin β/π
    assert run.overlap_ratio.item() == pytest.approx(ratio, rel=1e-12)
    field = FieldOfAction(
        run.contact_ratio.item(), ratio, 1.0, np.radians(run.base_helix_angle.item())
    )
    compliance = 1.0 / field.line_length(np.linspace(0.0, 1.0, 20001))
    exact = run.ste_mean.item() * np.ptp(compliance) / compliance.mean()
    assert run.ste_peak_to_peak.item() == pytest.approx(exact, rel=5e-3)


@pytest.mark.parametrize("degrees", [0.0, 25.0])
def test_estimates_of_a_face_cover_what_more_slices_change(degrees):
    """Of a run without a life, too: transmission error, K_Hβ and stiffness."""
    wide = {
        "gears": external_pair(30, 41, module="2 mm", face_width="40 mm"),
        "operation": {"torque": "100 N*m", "speed": "1000 rpm"},
        "mesh": {"misalignment": "20 um", "face_coupling": "pasternak"},
    }
    wide["gears"]["helix_angle"] = f"{degrees} deg"
    run = simulate(Scene.from_mapping(wide))
    finer = simulate(Scene.from_mapping(wide).replace({"mesh.face_points": 218}))
    for name, estimate in (
        ("ste_peak_to_peak", "error_estimate_transmission_error"),
        ("ste_mean", "error_estimate_transmission_error"),
        ("face_load_factor", "error_estimate_face_load_factor"),
        ("stiffness_mean", "error_estimate_stiffness"),
    ):
        error = abs(run[name].item() - finer[name].item())
        assert error < run[estimate].item() < 0.2 * run[name].item(), name


def test_whole_overlap_without_coupling_transmits_evenly():
    """Even stiffness along the path, slices apart, as many as the
    lattice has nodes to a pitch.
    """
    width = np.pi * 4.0 / np.sin(np.radians(12.0))
    even = scene(
        gears__helix_angle="12 deg",
        gears__face_width=f"{float(width)!r} mm",
        mesh__stiffness={"model": "constant", "value": "4e8 N/m"},
        mesh__extended_contact=False,
        numerics__profile_points=101,
        mesh__face_points=61,
    )
    grid = build(even).face.kinds[0].contact.grid
    assert len(grid.position) == len(grid.phase)
    run = simulate(even)
    assert run["overlap_ratio"].values == pytest.approx(1.0, rel=1e-12)
    assert run["ste_peak_to_peak"].values.max() < 1e-12 * float(
        run["ste_mean"].values.item()
    )


def test_the_other_hand_and_the_other_misalignment_are_mirror_images():
    right = known("right")
    left = known("left")
    for name in ("wear_rate", "line_load", "contact_pressure"):
        there = right[name].values
        here = left[name].values[..., ::-1, :]
        np.testing.assert_allclose(here, there, rtol=1e-7, atol=1e-7 * there.max())
    assert not np.allclose(
        right["line_load"].values, right["line_load"].values[..., ::-1, :], rtol=1e-2
    )


LOADED_FACES = {
    "helical": lambda: helical().replace({"mesh.face_points": 9}),
    "spur": lambda: scene(mesh__misalignment="20 um", mesh__face_points=9),
    "crowned": lambda: scene(
        gears__pinion={"teeth": 23, "lead_crowning": "8 um"}, mesh__face_points=9
    ),
}


@pytest.mark.parametrize("face", LOADED_FACES.values(), ids=LOADED_FACES)
def test_a_spectrum_over_a_face_wears_as_its_conditions_mixed(face):
    """Rates of each torque alone, by their shares: nodes on the path do not follow the
    load, and how far they reach beyond it, as the heaviest torque decides, changes
    nothing. Layers of nodes that did follow it left 4e-4 of spur gears.
    """
    torques = ("320 N*m", "80 N*m")
    alone = [
        simulate(face().replace("operation.torque", torque))["wear_rate"].values[0]
        for torque in torques
    ]
    duty = [
        {"torque": torque, "speed": "1450 rpm", "share": share}
        for torque, share in zip(torques, (0.25, 0.75), strict=True)
    ]
    mixed = simulate(face().replace("operation", {"duty": duty}))
    expected = 0.25 * alone[0] + 0.75 * alone[1]
    found = mixed["wear_rate"].values[0]
    assert np.abs(found - expected).max() < 1e-9 * expected.max()


def test_line_loads_carry_the_force():
    run = known("right")
    assert run["residual_line_load"].values.max() < 1e-12
    width = np.gradient(run["face_position"].values)
    assert run["mean_line_load"].values[0, 0] @ width == pytest.approx(
        float(run["static_mesh_force"][0]), rel=0.05
    )
    assert run["face_load_factor"].values.item() > 1.2
    assert (
        run["peak_line_load_factor"].values.item()
        > run["face_load_factor"].values.item() * 0.5
    )


def test_worn_volume_is_that_of_the_work_of_sliding():
    """``Σ h dA = k ∮ F_n |v_1 − v_2| dt``: what a pass takes off, summed over the lines
    of every phase.
    """
    parts = build(helical().replace("wear.contact_patch", "none"))
    state = parts.coupling.evaluate(parts.coupling.unworn())
    contact = parts.face.kinds[0].contact
    grid = contact.grid
    path = parts.kinds[0].path
    of_all_teeth = worn_mass(parts, 0, state.kind[0].rate[None])[0]
    gears = parts.kinds[0].pair.gears
    volume = (
        of_all_teeth
        / [gear.material.density * gear.teeth for gear in gears]
        / path.passes
    )
    speed = np.abs(sliding_velocity(path))
    step = np.full(
        len(grid.profile.position), grid.profile.position[1] - grid.profile.position[0]
    )
    step[[0, -1]] *= 0.5
    time = step / (parts.gears.kinds[0].speed * parts.kinds[0].pair.driving.base_radius)
    load = state.kind[0].line_load
    normal = load / contact.helix.cosine
    work = 1e-18 * np.einsum("jk,gk,k,j->g", normal, speed, time, grid.width)
    ends = 2.0 * step[0] / (grid.profile.position[-1] - grid.profile.position[0])
    assert volume == pytest.approx(work, rel=ends)
    inner = slice(1, -1)
    area = path.arc_weight[:, inner] / contact.helix.cosine
    h = state.kind[0].rate[:, :, inner] / path.passes[:, None, None]
    taken = np.einsum("gjk,gk,j->g", h, area, grid.width)
    given = 1e-18 * np.einsum(
        "jk,gk,k,j->g", normal[:, inner], speed[:, inner], time[inner], grid.width
    )
    assert taken == pytest.approx(given, rel=1e-9)


def test_a_patch_keeps_the_worn_volume():
    points = build(helical().replace("wear.contact_patch", "none"))
    spread = build(helical().replace("wear.contact_patch", "two-way"))
    masses = [
        worn_mass(
            parts,
            0,
            parts.coupling.evaluate(parts.coupling.unworn()).kind[0].rate[None],
        )
        for parts in (points, spread)
    ]
    assert masses[0] == pytest.approx(masses[1], rel=1e-9)


def test_misalignment_wears_in_as_an_exponential():
    """``K − 1 = (K0 − 1) exp(−h̄ c/w̄)`` at one point of the path, slices and pairs
    apart, all touching.

    At a point the depth follows ``dh/dN = a w``, so that every difference of load over
    the face decays with the mean depth of both flanks together.
    """
    stiffness = 8e8
    faced = scene(
        mesh__stiffness={"model": "constant", "value": f"{stiffness} N/m"},
        mesh__extended_contact=False,
        mesh__misalignment="6 um",
        mesh__face_points=21,
        wear__contact_patch="none",
        wear__until={"depth": "60 um"},
        numerics__tolerance=1e-5,
    )
    run = simulate(faced)
    parts = build(faced)
    grid = parts.face.kinds[0].contact.grid
    single = [k for k, count in _pairs_at(grid).items() if count == 1]
    node = single[len(single) // 4]
    load = run["line_load"].values[:, 0, :, node]
    depth = run["wear_depth"].values[:, :, :, node].sum(axis=1)
    mean_depth = depth.mean(axis=1)
    mean_load = load.mean(axis=1)
    uneven = load.max(axis=1) / mean_load - 1.0
    c = stiffness / 45e-3
    w = float(run["static_mesh_force"][0]) / 45e-3
    assert uneven[0] == pytest.approx(6e-6 * c / (2.0 * w) * 20 / 21, rel=1e-9)
    assert mean_depth[-1] * c / w > 1.0
    np.testing.assert_allclose(
        uneven, uneven[0] * np.exp(-mean_depth * c / w), rtol=2e-3
    )


def _pairs_at(grid):
    """Return how many pairs are in contact while one touches at a wear node."""
    counts = {}
    for lines in grid.node[:, :, 0]:
        present = lines[lines >= 0]
        counts |= {int(node) - grid.profile.before: len(present) for node in present}
    return counts


def test_the_deepest_point_of_the_face_ends_the_life():
    run = known("slices")
    assert run["max_wear_depth"].values[-1].max() == pytest.approx(5e-6, rel=1e-9)
    assert run["wear_depth"].dims == ("update", "flank", "face", "profile")
    assert "residual_load_share" not in run


def on_elements(**changes):
    solid = {
        "mesh.stiffness": "finite-element",
        "mesh.face_coupling": "elements",
        "mesh.face_points": 9,
    }
    return helical().replace({**solid, "numerics.profile_points": 31, **changes})


def test_solid_teeth_say_how_they_yield_beside_plane_elements_and_mirror():
    right = simulate(on_elements())
    left = simulate(
        on_elements(**{"gears.pinion.hand": "left", "mesh.misalignment": "-20 um"})
    )
    layer = simulate(on_elements(**{"mesh.face_coupling": "pasternak"}))
    assert "% against plane elements" in str(right["model_error"].values)
    assert "against plane elements" not in str(layer["model_error"].values)
    assert right["residual_line_load"].values.max() < 1e-12
    mirrored = left["line_load"].values[0, 0, ::-1]
    np.testing.assert_allclose(
        right["line_load"].values[0, 0], mirrored, atol=1e-6 * mirrored.max()
    )
    factor = right["face_load_factor"].values.item()
    wanted = layer["face_load_factor"].values.item()
    assert factor == pytest.approx(wanted, rel=0.1) and factor != pytest.approx(
        wanted, rel=1e-3
    )


def test_solid_teeth_under_even_loads_yield_as_they_are_told_to():
    """A spur pair whose gap is even: its mesh stiffness against that of plane elements,
    as the run tells.
    """
    solid = {
        "mesh.stiffness": "finite-element",
        "mesh.face_coupling": "elements",
        "mesh.face_points": 9,
    }
    even = Scene.from_mapping(SPUR).replace(solid)
    contact = build(even).face.kinds[0].contact
    layer = build(even.replace("mesh.face_coupling", "pasternak")).face.kinds[0].contact
    softer = contact.solid.even / contact.section.body - 1.0
    assert (
        0.0 < softer.min() and softer.max() < 0.02
    )  # b/m 11: free ends, on a wheel in plane strain
    ratio = layer.mean_stiffness / contact.mean_stiffness - 1.0
    assert 0.0 < ratio < softer.max()


@pytest.mark.parametrize(
    ("helix", "modules", "within"), [("12 deg", 10, 0.01), ("25 deg", 5, 0.06)]
)
def test_oblique_lines_on_a_layer_yield_about_as_on_solid_teeth(helix, modules, within):
    """Beside teeth of elements.

    Without cos β the second is 12 % too stiff, and its identity is another.
    """
    given = {
        "mesh.stiffness": "finite-element",
        "gears.helix_angle": helix,
        "mesh.face_points": 21,
    }
    given |= {"gears.face_width": f"{4 * modules} mm"}
    solid, layer = (
        Scene.from_mapping(SPUR).replace({**given, "mesh.face_coupling": coupling})
        for coupling in ("elements", "pasternak")
    )
    stiff = [
        build(each).face.kinds[0].contact.mean_stiffness for each in (layer, solid)
    ]
    assert stiff[0] == pytest.approx(stiff[1], rel=within)
    assert set(layer.sections.identifying()) - set(solid.sections.identifying()) == {
        "oblique"
    }
