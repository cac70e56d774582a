"""Contacts as wide as the flanks that bear them are refused, by the torque."""

import pytest
from scenes import external_pair, internal_pair

from wearlab import assembly
from wearlab.gears.specification import GearError
from wearlab.scene import Scene
from wearlab.simulation import simulate

WEAR = {
    "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
    "until": {"depth": "2 um"},
}
INTERNAL = internal_pair({"teeth": 26}, {"teeth": 66, "rim_diameter": "230 mm"})


def under(gears, torque, **numerics):
    return Scene.from_mapping(
        {
            "gears": gears,
            "operation": {"torque": torque, "speed": "1000 rpm"},
            "wear": WEAR,
            "numerics": numerics,
        }
    )


@pytest.mark.parametrize("tolerance", [1e-3, 1e-10])
def test_a_contact_wider_than_two_flanks_is_refused_before_it_takes_memory(tolerance):
    """Its patch asked for 8.7 GB at small tolerances."""
    scene = under(INTERNAL, "1e6 N*m", tolerance=tolerance)
    reason = r"operation.torque: .* 25\.6 mm wide, .* twice the 5\.46 mm of flank"
    with pytest.raises(GearError, match=reason):
        assembly.build(scene)
    assembly.build(under(INTERNAL, "1000 N*m"))  # the remedy


@pytest.mark.parametrize("face_width", ["20 mm", "30 mm"])
def test_slices_pressed_beyond_any_balance_are_refused(face_width):
    """Their loads were no numbers, and a highest order could not be told from them."""
    gears = external_pair(20, 40, helix_angle="15 deg", face_width=face_width)
    with pytest.raises(GearError, match=r"operation.torque: under .* give less torque"):
        assembly.build(under(gears, "3000 N*m"))
    assembly.build(under(gears, "300 N*m"))  # the remedy


def test_cycles_beyond_any_life_end_by_a_limit():
    """A division by zero ended a life of gears that wear away within a cycle."""
    mesh = {"stiffness": {"model": "constant", "value": "300 N/um", "of": "mesh"}}
    table = {
        "gears": external_pair(5000, 40, module="1 mm"),
        "operation": {"torque": "100 N*m", "speed": "1000 rpm"},
        "mesh": mesh,
        "wear": {
            "coefficient": {"model": "constant", "value": "1e-8 m^2/N"},
            "until": {"cycles": 1e18},
        },
        "numerics": {"profile_points": 21},
    }
    run = simulate(Scene.from_mapping(table))
    assert run.end_reason.item() == "evaluation limit"
