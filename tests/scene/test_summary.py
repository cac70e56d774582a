"""Parts of a scene whose meshes have sections of their own."""

import pytest
from scenes import CAMPAIGNS

from wearlab.campaign import load
from wearlab.scene import parts_left_out, parts_present


@pytest.fixture
def planetary():
    return load(CAMPAIGNS / "base" / "planetary_ngw11_vibration.toml").cases[0].scene


def own(scene, backlash):
    """The scene with each kind of mesh said apart.

    Backlash of the ring's mesh, or none at all.
    """
    meshes = {
        "sun_planet": {
            "damping_ratio": 0.07,
            "stiffness": {"model": "constant", "value": "5e8 N/m"},
        },
        "planet_ring": {"damping_ratio": 0.07, "extended_contact": True, **backlash},
    }
    return scene.replace("mesh.normal_backlash", None).replace("mesh", meshes)


def test_parts_of_one_kind_of_mesh_are_present(planetary):
    scene = own(planetary, {"normal_backlash": "110 um"})
    present = parts_present(scene)
    assert "back flank" in present and "contact beyond A and E" in present
    assert "mesh stiffness: constant and potential-energy" in present
    assert "mesh stiffness: potential-energy" in parts_present(planetary)
    assert "back flank" in parts_left_out(own(planetary, {}))
