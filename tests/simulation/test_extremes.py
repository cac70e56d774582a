"""What scenes at the edge need: steps that see the mesh, and values without load."""

import numpy as np
import pytest
from scenes import external_pair

from wearlab.assembly import build
from wearlab.scene import Scene
from wearlab.simulation import simulate

SCENE = {
    "gears": external_pair(50, 50),
    "operation": {"torque": "340 N*m", "speed": "3000 rpm"},
    "mesh": {
        "damping": "1000 N*s/m",
        "normal_backlash": "100 um",
        "stiffness": {"model": "constant", "value": "300 N/um", "of": "mesh"},
    },
    "dynamics": {"model": "torsional"},
}


def scene(**sections):
    return Scene.from_mapping(SCENE | sections)


def steps(order, amplitude="3 um"):
    harmonic = {"order": order, "amplitude": amplitude}
    return len(
        build(scene(errors={"harmonic": [harmonic]})).vibration.sampling.grid.width
    )


def test_steps_rise_until_they_see_a_high_order_error():
    """A parabola through three stages misses a sine of n steps a wave by about
    (2π/n)³/52 in the mean.
    """
    assert steps(1) == steps(2)
    assert steps(30) >= 2 * steps(10) >= 4 * steps(2)
    assert steps(30) == steps(30, amplitude="30 um")


def test_a_ramp_that_no_step_hits_is_resolved(tmp_path):
    def grid(width):
        table = tmp_path / f"ramp_{width}.csv"
        middle = 0.4137
        table.write_text(
            f"phase,stiffness\n0,300\n{middle - width},300\n{middle + width},200\n"
            "0.9,200\n0.95,300\n1,300\n"
        )
        stiffness = {
            "model": "tabulated",
            "of": "mesh",
            "file": str(table),
            "units": {"stiffness": "N/um"},
        }
        mesh = SCENE["mesh"] | {"stiffness": stiffness}
        return build(scene(mesh=mesh)).vibration.sampling.grid

    assert len(grid(0.004).width) > 1.5 * len(grid(0.1).width)


@pytest.mark.parametrize("backlash", ["100 um", None])
@pytest.mark.parametrize("stiffness", ["constant", "potential-energy"])
def test_no_load_is_a_family_of_orbits_with_finite_values(backlash, stiffness):
    mesh = {"damping": "1000 N*s/m"} | (
        {"normal_backlash": backlash} if backlash else {}
    )
    if stiffness == "constant":
        mesh["stiffness"] = SCENE["mesh"]["stiffness"]
    dataset = simulate(
        scene(
            mesh=mesh,
            operation={"torque": "0 N*m", "speed": "3000 rpm"},
            errors={"harmonic": [{"order": 1, "amplitude": "3 um"}]},
        )
    )
    assert dataset.verdict.item() == "non-unique"
    assert dataset.residual_load_share.item() == 0.0
    for name in (
        "mesh_stiffness",
        "secant_stiffness",
        "dynamic_mesh_force",
        "mesh_deflection",
        "load_share",
    ):
        assert np.isfinite(dataset[name].values).all(), name
    np.testing.assert_allclose(dataset.secant_stiffness, dataset.mesh_stiffness)
    if (
        stiffness == "constant"
    ):  # the load that begins to grow meets every pair in the path
        np.testing.assert_allclose(dataset.mesh_stiffness, 300e6)
