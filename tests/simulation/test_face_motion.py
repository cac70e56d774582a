"""Flanks with a width that vibrate: their force over deflection, the
limit of the pair, what wears.
"""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scenes import GEAR_UNIT

from wearlab.assembly import build
from wearlab.mesh.face.contact import LEVELS, face_flanks
from wearlab.scene import Scene, SceneError
from wearlab.simulation import simulate
from wearlab.simulation.warm import warm_up

PAIR = {
    **GEAR_UNIT,
    "mesh": {"damping_ratio": 0.07, "stiffness": {"model": "potential-energy"}},
    "dynamics": {"model": "torsional"},
    "wear": {"coefficient": {"model": "constant", "value": "1e-18 m^2/N"}},
    "numerics": {"profile_points": 61},
}
HELICAL = {
    "gears.helix_angle": "12 deg",
    "mesh.misalignment": "20 um",
    "mesh.face_points": 15,
}
EVEN = {"mesh.face_coupling": "pasternak", "mesh.face_points": 3}


def scene(changes):
    return Scene.from_mapping(PAIR).replace(changes)


@cache
def known(name):
    fine = {"numerics.profile_points": 241}
    return simulate(
        scene({"pair": fine, "even": {**EVEN, **fine}, "helical": HELICAL}[name])
    )


def test_an_even_face_vibrates_as_the_pair_does():
    """Constant Hertz contact: but for kinks of the force between the
    levels that its springs meet.
    """
    pair = known("pair")
    face = known("even")
    for name in (
        "dynamic_factor",
        "normal_force_factor",
        "dte_rms",
        "natural_frequency",
    ):
        np.testing.assert_allclose(
            face[name].values, pair[name].values, rtol=5e-3, err_msg=name
        )
    assert face["wear_rate"].values.max() == pytest.approx(
        pair["wear_rate"].values.max(), rel=2e-3
    )


def test_the_normal_force_has_the_static_mean():
    run = known("helical")
    assert np.abs(run["residual_mean_force"].values).max() < 1e-4
    assert run["normal_mesh_force"].values.mean() == pytest.approx(
        float(run["static_mesh_force"][0]), rel=1e-3
    )
    assert run["dynamic_factor"].values.item() > 1.0


def test_springs_meet_the_contact_at_its_levels_and_between_by_their_distance_squared():
    kind = build(scene(HELICAL)).face.kinds[0]
    contact = kind.contact
    none = np.zeros((2, *kind.shape))
    static = contact.unworn
    load = contact.analysis.load

    def missed(levels):
        found = face_flanks(contact, none, static, levels=levels)
        springs = found.springs(contact.grid.phase)
        assert (springs.stiffness >= 0.0).all()

        def force(deflection):
            return (
                springs.stiffness * np.maximum(0.0, deflection[:, None] - springs.gap)
            ).sum(axis=1)

        for level, row in zip(found.force, found.deflection[1:], strict=True):
            np.testing.assert_allclose(force(row), level, rtol=2e-3)
        errors = []
        for low, high in pairwise(level for level in levels if level >= LEVELS[0]):
            between = 0.5 * (low + high) * load
            solved = contact.solve(none, static, between)
            errors.append(np.abs(force(solved.deflection) - between).mean() / load)
        return np.array(errors)

    finer = sorted({*LEVELS, *(0.5 * (low + high) for low, high in pairwise(LEVELS))})
    coarse = missed(LEVELS)
    fine = missed(finer)
    assert coarse.max() < 0.01
    assert fine.mean() < 0.4 * coarse.mean()


def test_the_rate_of_gaps_is_their_slope_along_the_path():
    """A profile slope on one flank opens every pair alike: ġ = f
    p_b/L of a mesh period.
    """
    plain = {**EVEN, "mesh.extended_contact": False}
    sloped = build(scene({**plain, "gears.pinion.profile_slope": "10 um"}))
    kind = sloped.face.kinds[0]
    static = kind.contact.solve(np.zeros((2, *kind.shape)))
    pair = sloped.kinds[0].pair
    wanted = -10e-6 * pair.base_pitch / (pair.path.E - pair.path.A)
    rate = kind.contact.gap_rate(np.zeros((2, *kind.shape)), static)
    np.testing.assert_allclose(rate, wanted, rtol=1e-9)
    even = build(scene(plain)).face.kinds[0]
    assert (
        np.abs(
            even.contact.gap_rate(np.zeros((2, *even.shape)), even.contact.unworn)
        ).max()
        == 0.0
    )


def test_a_light_vibration_wears_nearly_as_the_static_force_does():
    moving = known("helical")
    static = simulate(scene({**HELICAL, "wear.load": "static"}))
    factor = float(moving["normal_force_factor"].values.item())
    there = static["wear_rate"].values[0]
    here = moving["wear_rate"].values[0]
    assert np.abs(here - there).max() <= 3.0 * (factor - 1.0) * there.max()
    assert here.sum() == pytest.approx(there.sum(), rel=factor - 1.0)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"mesh.excitation": "fourier"}, "mesh.excitation"),
        ({"wear.wohler_slope": 6.61}, "wear.wohler_slope"),
        ({"wear.load": "equivalent", "wear.wohler_slope": 6.61}, "wear.wohler_slope"),
    ],
)
def test_what_motions_over_the_face_do_not_know_is_refused(changes, said):
    with pytest.raises(SceneError, match=said.replace(".", r"\.")):
        scene({**HELICAL, **changes})


AXIAL = {"axial_stiffness": "60 N/um", "damping_ratio": 0.05}
MEMBERS = ("pinion", "gear")
ON_AXIAL_BEARINGS = {**HELICAL, "dynamics.supports": dict.fromkeys(MEMBERS, AXIAL)}
RADIAL = {"radial_stiffness": "400 N/um", "damping_ratio": 0.05}


@cache
def on_bearings(*changes):
    return simulate(scene({**ON_AXIAL_BEARINGS, **dict(changes)}))


def mean(values):
    return values.mean(("mesh_period", "phase")).values[0]


def test_natural_frequencies_of_a_pair_on_axial_bearings():
    """The mesh pulls on x and on both z by tan β_b: M = diag(m1, m2, m_c), K = k_z (z)
    + k_m d dᵀ.
    """
    parts = build(scene(ON_AXIAL_BEARINGS))
    first, second = parts.kinds[0].pair.gears
    mobility = (
        first.base_radius**2 / first.inertia + second.base_radius**2 / second.inertia
    )
    slope = parts.face.slope
    assert abs(slope) == pytest.approx(
        np.tan(np.arcsin(np.sin(np.radians(12)) * np.cos(np.radians(20))))
    )
    direction = np.array([slope, -slope, 1.0])
    system = parts.vibration.system
    assert system.coordinates == ("pinion.z", "gear.z", "mesh.x")
    np.testing.assert_allclose(system.direction, direction[None], rtol=1e-14)
    run = on_bearings()
    mass = np.array([first.mass, second.mass, 1.0 / mobility])
    rigid = known("helical")
    mesh = float(rigid["natural_frequency"].values.max() * 2 * np.pi) ** 2 / mobility
    stiffness = np.diag([6e7, 6e7, 0.0]) + mesh * np.outer(direction, direction)
    square = np.linalg.eigvals(stiffness / mass[:, None]).real
    found = run["natural_frequency"].values.ravel()
    np.testing.assert_allclose(
        np.sort(found), np.sort(np.sqrt(square)) / (2 * np.pi), rtol=1e-9
    )


ON_BEARINGS = {
    "dynamics.model": "spur-3dof",
    "dynamics.supports": dict.fromkeys(MEMBERS, AXIAL | RADIAL),
}


@pytest.mark.parametrize("radial", [False, True])
def test_bearings_along_the_axes_hold_in_the_mean_what_the_mesh_pushes(radial):
    run = simulate(scene(HELICAL | ON_BEARINGS)) if radial else on_bearings()
    slope = build(scene(HELICAL)).face.slope
    force = float(mean(run["normal_mesh_force"])[0])
    assert float(run["separation_fraction"].values.max()) == 0.0
    assert list(run["axis"].values) == ["x", "y", "z"]
    bearing = mean(run["bearing_force"])
    np.testing.assert_allclose(
        bearing[:, 2], [slope * force, -slope * force], rtol=2e-4
    )
    np.testing.assert_allclose(bearing[:, 1], [force, -force], rtol=2e-4)


def test_a_stiff_axial_bearing_is_a_rigid_one_and_one_alone_gives_way_alone():
    stiff = {"axial_stiffness": "1e7 N/um", "damping_ratio": 0.05}
    held = simulate(
        scene({**HELICAL, "dynamics.supports": {"pinion": stiff, "gear": stiff}})
    )
    rigid = known("helical")
    np.testing.assert_allclose(
        held["dynamic_mesh_force"], rigid["dynamic_mesh_force"], rtol=3e-4
    )
    alone = simulate(scene({**HELICAL, "dynamics.supports": {"pinion": AXIAL}}))
    slope = build(scene(HELICAL)).face.slope
    pushed = -slope * alone["normal_mesh_force"].isel(mesh=0)
    np.testing.assert_allclose(
        alone["bearing_force"].sel(member="gear", axis="z"), pushed, rtol=1e-12
    )
    assert (
        np.abs(
            alone["bearing_force"].sel(member="pinion", axis="z") + pushed
        ).values.max()
        > 1.0
    )


def test_the_other_hand_pushes_the_other_way():
    right = on_bearings()
    left = on_bearings(("gears.pinion.hand", "left"), ("mesh.misalignment", "-20 um"))
    for axis, sense in (("y", 1.0), ("z", -1.0)):
        np.testing.assert_allclose(
            left["bearing_force"].sel(axis=axis),
            sense * right["bearing_force"].sel(axis=axis),
            rtol=1e-6,
        )


@pytest.mark.parametrize(
    ("supports", "said"),
    [
        ({"axial_stiffness": "60 N/um"}, "needs 'axial_damping'"),
        ({"axial_damping": "2000 N*s/m"}, "give 'axial_stiffness'"),
    ],
)
def test_half_an_axial_bearing_is_refused(supports, said):
    with pytest.raises(SceneError, match=said):
        scene({**HELICAL, "dynamics.supports": {"pinion": supports}})


def test_spur_gears_have_no_axial_bearing():
    with pytest.raises(SceneError, match="give gears"):
        scene({"dynamics.supports": {"pinion": AXIAL}})


def test_workers_share_what_a_vibrating_face_compiles():
    for turn in (0, 1):
        warm_up([scene(HELICAL)], turn, 2)
