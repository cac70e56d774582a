"""Flanks with a width that vibrate: their force over deflection, the limit of the pair, what wears."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from wearlab.mesh.face.curves import LEVELS, curves
from wearlab.scene import Scene, SceneError
from wearlab.scene.build import build
from wearlab.simulation import simulate

PAIR = {
    "gears": {
        "kind": "external-pair",
        "module": "4 mm",
        "face_width": "45 mm",
        "pinion": {"teeth": 23},
        "gear": {"teeth": 71},
    },
    "operation": {"torque": "320 N*m", "speed": "1450 rpm"},
    "mesh": {"damping_ratio": 0.07, "stiffness": {"model": "potential-energy"}},
    "dynamics": {"model": "torsional"},
    "wear": {"coefficient": {"model": "constant", "value": "1e-18 m^2/N"}},
    "numerics": {"profile_points": 61},
}
HELICAL = {"gears.helix_angle": "12 deg", "mesh.misalignment": "20 um", "mesh.face_points": 15}
EVEN = {"mesh.face_coupling": "pasternak", "mesh.face_points": 3}


def scene(changes):
    return Scene.from_mapping(PAIR).replace(changes)


@cache
def known(name):
    fine = {"numerics.profile_points": 241}
    return simulate(scene({"pair": fine, "even": {**EVEN, **fine}, "helical": HELICAL}[name]))


def test_an_even_face_vibrates_as_the_pair_does():
    """Constant Hertz contact: but for kinks of the force between the levels that its springs meet."""
    pair, face = known("pair"), known("even")
    for name in ("dynamic_factor", "normal_force_factor", "dte_rms", "natural_frequency"):
        np.testing.assert_allclose(face[name].values, pair[name].values, rtol=5e-3, err_msg=name)
    assert face["wear_rate"].values.max() == pytest.approx(pair["wear_rate"].values.max(), rel=2e-3)


def test_the_normal_force_has_the_static_mean():
    run = known("helical")
    assert np.abs(run["residual_mean_force"].values).max() < 1e-4
    assert run["normal_mesh_force"].values.mean() == pytest.approx(
        float(run["static_mesh_force"][0]), rel=1e-3
    )
    assert run["dynamic_factor"].values.item() > 1.0


def test_springs_meet_the_contact_at_its_levels_and_between_by_the_square_of_their_distance():
    kind = build(scene(HELICAL)).face.kinds[0]
    contact, none = kind.contact, np.zeros((2, *kind.shape))
    static, load = contact.unworn, contact.analysis.load

    def missed(levels):
        found = curves(contact, none, static, levels)
        springs = kind.flanks(found).springs(contact.grid.phase)
        assert (springs.stiffness >= 0.0).all()

        def force(deflection):
            return (springs.stiffness * np.maximum(0.0, deflection[:, None] - springs.gap)).sum(axis=1)

        for level, row in zip(found.force, found.deflection[1:], strict=True):
            np.testing.assert_allclose(force(row), level, rtol=2e-3)
        errors = []
        for low, high in pairwise(level for level in levels if level >= LEVELS[0]):
            between = 0.5 * (low + high) * load
            solved = contact.solve(none, static, between)
            errors.append(np.abs(force(solved.deflection) - between).mean() / load)
        return np.array(errors)

    finer = sorted({*LEVELS, *(0.5 * (low + high) for low, high in pairwise(LEVELS))})
    coarse, fine = missed(LEVELS), missed(finer)
    assert coarse.max() < 0.01
    assert fine.mean() < 0.4 * coarse.mean()


def test_the_rate_of_gaps_is_their_slope_along_the_path():
    """A profile slope on one flank opens every pair alike: ġ = f p_b/L of a mesh period."""
    plain = {**EVEN, "mesh.extended_contact": False}
    sloped = build(scene({**plain, "gears.pinion.profile_slope": "10 um"}))
    kind = sloped.face.kinds[0]
    static = kind.contact.solve(np.zeros((2, *kind.shape)))
    pair = sloped.kinds[0].pair
    wanted = -10e-6 * pair.base_pitch / (pair.path.E - pair.path.A)
    rate = kind.contact.gap_rate(np.zeros((2, *kind.shape)), static)
    np.testing.assert_allclose(rate, wanted, rtol=1e-9)
    even = build(scene(plain)).face.kinds[0]
    assert np.abs(even.contact.gap_rate(np.zeros((2, *even.shape)), even.contact.unworn)).max() == 0.0


def test_a_light_vibration_wears_nearly_as_the_static_force_does():
    moving = known("helical")
    static = simulate(scene({**HELICAL, "wear.load": "static"}))
    factor = float(moving["normal_force_factor"].values.item())
    there, here = static["wear_rate"].values[0], moving["wear_rate"].values[0]
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
