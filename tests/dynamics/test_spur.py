"""The builders against the equations of motion written out."""

import numpy as np
import pytest

from wearlab.dynamics.spur import Meshing, Paired, spur_3dof, torsional
from wearlab.dynamics.supports import (
    BearingSupport,
    MemberSupport,
    damping_by_ratio,
    effective_mass,
    support_of,
)
from wearlab.dynamics.system import System
from wearlab.mesh.gear_set import Body

INERTIA = (7.3e-3, 3.1e-3)
RADIUS = (0.07, 0.05)
GEARS = {
    name: Body(mass, inertia, radius)
    for name, mass, inertia, radius in zip(
        ("pinion", "gear"), (2.8, 1.9), INERTIA, RADIUS, strict=True
    )
}


def test_spur_3dof_is_l16_with_x_in_place_of_u() -> None:
    pinion = MemberSupport(1.0e9, radial_damping=5000.0, preload=10.0)
    gear = MemberSupport(1.2e9, radial_damping=4000.0, preload=20.0)
    s = spur_3dof(
        Paired(
            GEARS, {"pinion": pinion, "gear": gear}, Meshing(900.0), 340.0 / RADIUS[0]
        )
    )
    m_c = (
        INERTIA[0]
        * INERTIA[1]
        / (INERTIA[1] * RADIUS[0] ** 2 + INERTIA[0] * RADIUS[1] ** 2)
    )
    assert s.coordinates == ("pinion.y", "gear.y", "mesh.x")
    np.testing.assert_allclose(np.diag(s.mass), [2.8, 1.9, m_c], rtol=1e-14)
    np.testing.assert_allclose(np.diag(s.stiffness), [1.0e9, 1.2e9, 0.0])
    np.testing.assert_allclose(np.diag(s.damping), [5000.0, 4000.0, 0.0])
    np.testing.assert_allclose(s.direction, [[1.0, -1.0, 1.0]])
    np.testing.assert_allclose(s.load, [-10.0, 20.0, 340.0 / RADIUS[0]])
    assert s.backlash is None and s.fluctuation_direction is None


def test_torsional_supports_keep_both_rotations_and_the_mesh_acceleration() -> None:
    pair = Paired(GEARS, {}, Meshing(1.0), 100.0 / RADIUS[0], fluctuation=7.0)
    tied = {"pinion": MemberSupport(tangential_stiffness=0.0)}
    free = torsional(pair)
    held = torsional(pair._replace(held=tied))
    assert free.coordinates == ("mesh.x",) and held.coordinates == (
        "pinion.u",
        "gear.u",
    )
    for load in ("load", "fluctuation_direction"):
        mesh = [
            float((s.direction @ np.linalg.solve(s.mass, getattr(s, load)))[0])
            for s in (free, held)
        ]
        assert mesh[0] == pytest.approx(mesh[1], rel=1e-13)
    mobility = [
        float((s.direction @ np.linalg.inv(s.mass) @ s.direction.T)[0, 0])
        for s in (free, held)
    ]
    assert mobility[0] == pytest.approx(mobility[1], rel=1e-13)


def test_helical_gears_on_axial_bearings_move_along_their_axes() -> None:
    """m z̈ + c ż + k z ± W tan β_b = 0, the rotation last."""
    pinion = MemberSupport(
        1.0e9, radial_damping=5000.0, axial_stiffness=6e7, axial_damping=300.0
    )
    given = BearingSupport(
        radial_stiffness="1.2e9 N/m", damping_ratio=0.04, axial_stiffness="5e7 N/m"
    )
    gear = support_of(given, GEARS["gear"])
    s = spur_3dof(
        Paired(
            GEARS,
            {"pinion": pinion, "gear": gear},
            Meshing(900.0, slope=-0.2),
            340.0 / RADIUS[0],
        )
    )
    assert s.coordinates == ("pinion.y", "gear.y", "pinion.z", "gear.z", "mesh.x")
    np.testing.assert_allclose(s.direction, [[1.0, -1.0, -0.2, 0.2, 1.0]])
    np.testing.assert_allclose(np.diag(s.mass)[:4], [2.8, 1.9, 2.8, 1.9])
    np.testing.assert_allclose(np.diag(s.stiffness), [1.0e9, 1.2e9, 6e7, 5e7, 0.0])
    np.testing.assert_allclose(
        np.diag(s.damping)[2:], [300.0, 0.08 * np.sqrt(5e7 * 1.9), 0.0]
    )
    np.testing.assert_allclose(s.load, [0.0, 0.0, 0.0, 0.0, 340.0 / RADIUS[0]])
    alone = torsional(
        Paired(GEARS, {"gear": gear}, Meshing(slope=-0.2), 340.0 / RADIUS[0])
    )
    assert alone.coordinates == ("gear.z", "mesh.x")


def test_damping_ratios() -> None:
    given = BearingSupport(
        radial_stiffness="1e8 N/m", tangential_stiffness="4e6 N/m", damping_ratio=0.03
    )
    gears = dict.fromkeys(("pinion", "gear"), Body(2.0, 1.5, 1.0))
    held = dict.fromkeys(gears, support_of(given, gears["gear"]))
    damping = np.diag(spur_3dof(Paired(gears, held, Meshing(), 0.0)).damping)
    np.testing.assert_allclose(damping[:2], 2 * 0.03 * np.sqrt(1e8 * 2.0))
    np.testing.assert_allclose(damping[2:], 2 * 0.03 * np.sqrt(4e6 * 1.5))
    assert effective_mass(2.0, 2.0) == pytest.approx(1.0)
    assert damping_by_ratio(0.07, 3e8, 0.7) == pytest.approx(
        2 * 0.07 * np.sqrt(3e8 * 0.7)
    )


def test_rotating_frames_add_gyroscopic_and_centripetal_terms() -> None:
    s = torsional(Paired(GEARS, {}, Meshing(1.0), 1.0 / RADIUS[0]))
    turning: System = s._replace(
        stiffness=np.array([[5.0]]),
        gyroscopic=np.array([[2.0]]),
        centripetal=np.array([[0.5]]),
        rotation=2.0,
    )
    np.testing.assert_allclose(turning.total_damping, [[4.0]])
    np.testing.assert_allclose(turning.total_stiffness, [[3.0]])
