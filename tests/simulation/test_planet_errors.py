"""Errors of planets: an axis that runs out is a displaced pin, pitches are none.

The kinematics of the displaced pin are those of the involutes themselves: a string from
one base circle to the other, of which the rotations unwind as much as they wind.
"""

import numpy as np
import pytest
from scenes import planetary_set

from wearlab.assembly import build
from wearlab.scene import Scene
from wearlab.simulation import simulate

SUN, PLANET, RING = 20, 29, 79
TORQUE = 90.0
STIFFNESS = 4.5e8  # of a mesh [N/m]
SUPPORTS = {
    "sun": (10e6, 0.0),
    "planet": (58e6, 0.0),
    "ring": (1000e6, 57.6e6),
    "carrier": (195e6, 10e6),
}
"""Radial and tangential stiffness of what holds the members, W23 Table 1 [N/m]."""


def _set(roles=("sun", "carrier", "ring"), **gears):
    supports = {
        name: {"radial_stiffness": f"{radial} N/m", "damping_ratio": 0.03}
        | ({"tangential_stiffness": f"{tangential} N/m"} if tangential else {})
        for name, (radial, tangential) in SUPPORTS.items()
    }
    planet = {"teeth": PLANET, "bore_diameter": "47 mm", "mass": "0.35 kg"}
    return {
        "gears": planetary_set(
            {"teeth": SUN, "profile_shift_coefficient": 0.35, "mass": "0.53 kg"},
            planet | gears.get("planet", {}),
            {"teeth": RING, "rim_diameter": "209 mm"},
            module="2.25 mm",
            face_width="25 mm",
            centre_distance="56.5 mm",
            carrier={"mass": "4.5 kg", "inertia": "11178 kg*mm^2"},
        ),
        "operation": {
            "torque": f"{TORQUE} N*m",
            "speed": "1000 rpm",
            **dict(zip(("input", "output", "fixed"), roles, strict=True)),
        },
        "mesh": {
            "stiffness": {
                "model": "constant",
                "value": f"{STIFFNESS} N/m",
                "of": "mesh",
            },
            "damping_ratio": 0.07,
        },
        "dynamics": {"model": "planetary", "supports": supports},
    }


def _string(centre, at_sun, radii):
    """Return the rotation that a planet's place asks for: of its mesh [m].

    External: the string crosses between the base circles; internal: it lies along them.
    """
    distance = np.hypot(*centre)
    turned = np.arctan2(centre[1], centre[0])
    span = radii[0] + radii[1] if at_sun else radii[0] - radii[1]
    pressure_angle = np.arccos(span / distance)
    free = np.sqrt(distance**2 - span**2)
    if at_sun:
        return free + span * (turned - pressure_angle)
    return span * (turned + pressure_angle) - free


def _errors_of_pin(parts, planet, displacement):
    """Return both mesh errors of a planet whose axis is displaced (n, 2) [m]."""
    gears = parts.gears
    radius = {name: gear.base_radius for name, gear in gears.gears.items()}
    angle = gears.angles[planet]
    distance = gears.bodies["carrier"].radius
    centre = distance * np.array([np.cos(angle), np.sin(angle)])
    found = []
    for mate in ("sun", "ring"):
        radii = (radius[mate], radius["planet"])
        at_rest = _string(centre, mate == "sun", radii)
        found.append(
            [
                _string(centre + moved, mate == "sun", radii) - at_rest
                for moved in displacement
            ]
        )
    return np.array(found)


ROLES = [("sun", "carrier", "ring"), ("carrier", "sun", "ring")]


@pytest.mark.parametrize("roles", ROLES)
@pytest.mark.parametrize(
    "errors",
    [
        {"gears": {"planet": {"eccentricity": "20 um"}}},
        {"errors": {"planet": {"total_composite": "40 um"}}},
        {"errors": {"planet": {"installation": ["20 um"]}}},
    ],
)
def test_a_planet_that_runs_out_has_the_errors_of_a_displaced_pin(roles, errors):
    table = _set(roles, **errors.get("gears", {}))
    table["errors"] = {"seed": 3, **errors.get("errors", {})}
    parts = build(Scene.from_mapping(table))
    periods = np.linspace(0.0, PLANET, 40, endpoint=False)
    turn = -parts.gears.sense * 2 * np.pi * periods / PLANET
    for planet in range(3):
        of_meshes = [
            parts.meshes[mesh].error.slow.value(periods)
            for mesh in (planet, 3 + planet)
        ]
        # where the axis stands at first follows from the mesh with the sun
        candidates = np.linspace(0.0, 2 * np.pi, 721)
        alpha = parts.gears.kinds[0].pair.working_pressure_angle
        along = 20e-6 * np.sin(
            candidates[:, None] + turn - parts.gears.angles[planet] + alpha
        )
        start = candidates[np.abs(along - of_meshes[0]).max(axis=1).argmin()]
        axis = 20e-6 * np.stack([np.cos(start + turn), np.sin(start + turn)], axis=1)
        exact = _errors_of_pin(parts, planet, axis)
        np.testing.assert_allclose(of_meshes, exact, atol=0.12e-6)


@pytest.mark.parametrize("roles", ROLES)
def test_pitches_that_add_up_come_to_both_meshes_together(roles):
    table = _set(roles)
    planet = {"total_composite": "40 um", "composite": "pitch"}
    table["errors"] = {"seed": 3, "planet": planet}
    parts = build(Scene.from_mapping(table))
    periods = np.linspace(0.0, PLANET, 40)
    for n in range(3):
        at_sun, at_ring = (
            parts.meshes[mesh].error.slow.value(periods) for mesh in (n, 3 + n)
        )
        np.testing.assert_allclose(at_sun, at_ring, atol=1e-18)
        assert np.abs(at_sun).max() == pytest.approx(20e-6, rel=1e-2)


@pytest.mark.parametrize("roles", ROLES)
def test_a_carrier_off_its_axis_moves_all_pins_alike(roles):
    """Its errors are those of one displacement of all planets."""
    table = _set(roles)
    table["errors"] = {"seed": 5, "carrier": {"installation": ["15 um"]}}
    parts = build(Scene.from_mapping(table))
    errors = np.array([float(mesh.error.slow.value(0.0)) for mesh in parts.meshes])
    names = parts.moving.system.coordinates
    per_axis = np.zeros((6, 2))
    for number, axis in enumerate("xy"):
        planets = [names.index(f"planet-{n}.{axis}") for n in (1, 2, 3)]
        per_axis[:, number] = -parts.moving.system.direction[:, planets].sum(axis=1)
    moved, *_ = np.linalg.lstsq(per_axis, errors, rcond=None)
    np.testing.assert_allclose(per_axis @ moved, errors, atol=1e-12)
    assert np.hypot(*moved) == pytest.approx(15e-6)


def _own_statics(parts, errors):
    """Return load factors (n_angles, 3) of the sun's meshes by springs of our own."""
    radial, tangential = zip(
        *(SUPPORTS[name] for name in ("sun", "ring", "carrier")), strict=True
    )
    alpha_sun, alpha_ring = (
        kind.pair.working_pressure_angle for kind in parts.gears.kinds
    )
    stiffness = np.zeros((18, 18))
    for member in range(3):
        held = (radial[member], radial[member], tangential[member])
        for axis in range(3):
            stiffness[3 * member + axis, 3 * member + axis] = held[axis]
    meshes = []
    for n, angle in enumerate(parts.gears.angles):
        place = 9 + 3 * n
        for axis, ahead in enumerate((-np.sin(angle), np.cos(angle))):
            pin = np.zeros(18)
            pin[place + axis] = 1.0
            pin[6 + axis] = -1.0
            pin[8] = -ahead
            stiffness += SUPPORTS["planet"][0] * np.outer(pin, pin)
        for member, turned, spin in ((0, -alpha_sun, 1.0), (1, alpha_ring, -1.0)):
            normal = np.array([-np.sin(angle + turned), np.cos(angle + turned)])
            mesh = np.zeros(18)
            mesh[3 * member : 3 * member + 2] = normal
            mesh[3 * member + 2] = 1.0
            mesh[place : place + 2] = -normal
            mesh[place + 2] = spin
            meshes.append(mesh)
    order = [0, 2, 4, 1, 3, 5]
    direction = np.array(meshes)[order]
    stiffness += STIFFNESS * direction.T @ direction
    load = np.zeros(18)
    load[2] = TORQUE / parts.gears.gears["sun"].base_radius
    forces = []
    for row in errors:
        q = np.linalg.solve(stiffness, load + STIFFNESS * direction.T @ row)
        forces.append(STIFFNESS * (direction @ q - row))
    at_sun = np.array(forces)[:, :3]
    return at_sun / at_sun.mean(axis=1, keepdims=True)


@pytest.mark.parametrize(
    ("gears", "errors", "expected"),
    [
        ({"planet": {"eccentricity": "20 um"}}, {}, (0.885, 1.115)),
        ({}, {"planet": {"total_composite": "40 um"}}, (0.873, 1.127)),
        (
            {},
            {"planet": {"total_composite": "40 um", "composite": "pitch"}},
            (0.863, 1.137),
        ),
        ({}, {"iso_1328_class": 7}, (0.768, 1.232)),
    ],
)
def test_load_factors_over_a_whole_turn_are_those_of_own_statics(
    gears, errors, expected
):
    table = _set(**gears)
    table["errors"] = {"seed": 3, **errors}
    scene = Scene.from_mapping(table)
    data = simulate(scene)
    parts = build(scene)

    # members of other tooth numbers come to all angles with one another
    turns = np.arange(48) / 48
    at_angles = [np.array([0.0])] if not errors.get("iso_1328_class") else [turns] * 3
    if len(at_angles) == 1:
        at_angles = [np.zeros(1), turns, np.zeros(1)]
    grids = np.meshgrid(*at_angles, indexing="ij")
    by_teeth = dict(zip((SUN, PLANET, RING), map(np.ravel, grids), strict=True))
    rows = []
    for mesh in parts.meshes:
        slow = mesh.error.slow
        total = np.zeros(grids[0].size)
        for order, size, phase in zip(
            slow.order, slow.amplitude, slow.phase, strict=True
        ):
            turned = by_teeth[round(1.0 / order)]
            total += size * np.sin(2 * np.pi * turned + phase)
        rows.append(total)
    factors = _own_statics(parts, np.array(rows).T)

    least = float(data.mesh_load_factor_min.min())
    largest = float(data.mesh_load_factor_max.max())
    assert (least, largest) == pytest.approx(expected, abs=6e-4)
    assert least == pytest.approx(factors.min(), abs=1e-3)
    assert largest == pytest.approx(factors.max(), abs=1e-3)
    told = "carries up to" in data.validity.item()
    assert told == (largest > 1.2)


def test_an_eccentric_planet_acts_without_a_section_of_errors():
    table = _set(planet={"eccentricity": "20 um"})
    data = simulate(Scene.from_mapping(table))
    assert float(data.mesh_load_factor_max.max()) > 1.1
