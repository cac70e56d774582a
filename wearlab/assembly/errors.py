"""``[errors]`` → meshes on their clock, each with its errors."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.gears import iso
from wearlab.gears.specification import GearError
from wearlab.mesh import (
    clock,
    gear_set,
    harmonics,
)
from wearlab.scene import Scene


def build_meshes(scene: Scene, gears: gear_set.GearSet) -> tuple[clock.Mesh, ...]:
    """Return the meshes on their clock, each with one realisation of its errors.

    They are drawn member after member from the seed.
    """
    if gears.angles:
        errors = _of_planetary(scene, gears)
    else:
        members = tuple(_member(scene, gears, name) for name in gears.members)
        errors = [
            harmonics.mesh_error(
                members, _harmonics(scene, gears.mesh_names[0]), scene.prescribed.seed
            )
        ]
    on_clock = zip(gears.mesh_kinds, gears.mesh_lags, errors, strict=True)
    return tuple(clock.Mesh(kind, float(lag), error) for kind, lag, error in on_clock)


def _member(scene: Scene, gears: gear_set.GearSet, name: str) -> harmonics.MemberError:
    """Return the errors that the file states of a gear, or that its class allows."""
    toothing = gears.gears[name]
    options: Any = scene.prescribed.members.get(name)
    eccentricity = getattr(getattr(scene.gears, name), "eccentricity", None) or 0.0
    grade = iso_1328_class(scene, name)
    total = 0.0
    tooth = 0.0
    if grade is not None:
        pairs = [
            kind.pair
            for kind in gears.kinds
            if toothing.name in {gear.name for gear in kind.pair.gears}
        ]
        ratio = min(pair.contact_ratio for pair in pairs)
        *_, tooth, total = iso.allowed(
            grade, toothing.module, 2.0 * toothing.reference_radius, ratio
        )
    stated = (
        {}
        if options is None
        else {key: getattr(options, key) for key in options.model_fields_set}
    )
    total = stated.get("total_composite", total)
    tooth = stated.get("tooth_composite", tooth)
    measured = _measured_pitch(gears, name, stated.get("pitch"))
    if measured:
        total = 0.0
    return harmonics.MemberError(
        toothing.teeth,
        total,
        tooth,
        getattr(options, "installation", ()),
        eccentricity,
        getattr(options, "composite", "runout"),
        measured,
    )


def _measured_pitch(
    gears: gear_set.GearSet, name: str, table: Any
) -> tuple[tuple[int, float, float], ...]:
    """Return measured pitches as waves along the line of action, none without a table.

    ``e_i = ±F_p,i cos α_t`` when tooth i passes the pitch point: a tooth of the driving
    gear that stands back comes late, and one of the driven gear meets its mate early.
    """
    if table is None:
        return ()
    kind = next(
        kind
        for kind in gears.kinds
        if name in [toothing.name for toothing in kind.pair.gears]
    )
    pair = kind.pair
    cosine = math.cos(pair.driving.pressure_angle)
    at_pitch_point = -pair.path.A / pair.base_pitch
    begins = 0.0 if pair.driving.name == name else math.pi
    teeth = gears.gears[name].teeth
    return tuple(
        (
            order,
            size * cosine,
            phase + begins - 2.0 * math.pi * order * at_pitch_point / teeth,
        )
        for order, size, phase in table.waves()
    )


def pitch_flags(scene: Scene) -> tuple[str, ...]:
    """Return what is to be known of measured pitches, in words.

    Parameters
    ----------
    scene : the scene
    """
    members: Any = scene.prescribed.members
    return tuple(
        f"{name}: measured pitches, of range F_p "
        f"{1e6 * float(np.ptp(members[name].pitch.cumulative)):.3g} µm, move the "
        "teeth of a turn after one another; wear stays the same for all teeth"
        for name in scene.prescribed.measured_pitches
    )


def iso_1328_class(scene: Scene, name: str) -> int | None:
    """Return the accuracy class of a toothed member, None without one.

    Parameters
    ----------
    scene : the scene
    name : of the member
    """
    of_member = getattr(scene.prescribed.members.get(name), "iso_1328_class", None)
    return scene.prescribed.iso_1328_class if of_member is None else of_member


def class_flags(scene: Scene, gears: gear_set.GearSet) -> tuple[str, ...]:
    """Return what each member's ISO 1328 class allows it, in words.

    Parameters
    ----------
    scene, gears : the scene and its gear set
    """
    grades = {
        name: grade
        for name in gears.gears
        if (grade := iso_1328_class(scene, name)) is not None
    }
    allowed = {name: _member(scene, gears, name) for name in grades}
    totals = {
        name: "F_i′ by its measured pitches, "
        if error.measured
        else f"F_i′ = {1e6 * error.total_composite:.3g} µm, "
        for name, error in allowed.items()
    }
    return tuple(
        f"{name}: ISO 1328-1:1995 class {grades[name]}: {totals[name]}"
        f"f_i′ = {1e6 * error.tooth_composite:.3g} µm, all that is allowed, at angles "
        "drawn by errors.seed"
        for name, error in allowed.items()
    )


def differ(scene: Scene, gears: gear_set.GearSet) -> bool:
    """Return whether errors load the planets of a set differently for good.

    Errors of planets and of pins do, and harmonics of one of several meshes; errors of
    sun and ring come to all planets alike as they turn, not where one angle is frozen.

    Parameters
    ----------
    scene, gears : the scene and its gear set
    """
    random = np.random.default_rng(0)
    of_planets = harmonics.realised(_member(scene, gears, "planet"), random)
    pins = [
        pin for of_planet in _pins(scene, gears.angles, random) for pin in of_planet
    ]
    if of_planets.acts or any(pin.acts for pin in pins):
        return True
    if any(harmonic.mesh[-1].isdigit() for harmonic in scene.prescribed.harmonic):
        return True
    others = (
        harmonics.realised(_member(scene, gears, name), random)
        for name in ("sun", "ring")
    )
    frozen = scene.prescribed.slow.realised
    return frozen and any(member.slow for member in others)


def at_angles(
    scene: Scene, gears: gear_set.GearSet, meshes: Sequence[clock.Mesh]
) -> Array:
    """Return the slow errors by which planets share a static load, (n_angles, n_mesh).

    At the drawn angle where it is frozen, else at equally weighted ones [m].

    Parameters
    ----------
    scene, gears : the scene and its gear set
    meshes : with their errors
    """
    if scene.prescribed.measured_pitches:
        name = next(iter(scene.prescribed.measured_pitches))
        raise GearError(
            f"errors.{name}.pitch: planets that differ share their load by errors of "
            "one wave a turn, and measured pitches have more: leave [wear] out, or "
            f"give errors.{name}.total_composite in their place"
        )
    errors = gears.slow_errors(meshes)
    if errors is None:
        return np.zeros((1, len(meshes)))
    if scene.prescribed.slow.realised:
        return scene.prescribed.slow.constant(meshes)[None]
    return errors


def _harmonics(scene: Scene, mesh: str) -> tuple[tuple[int, float, float], ...]:
    """Return the prescribed harmonics of a mesh, under its name or that of its kind."""
    harmonics = [
        harmonic
        for harmonic in scene.prescribed.harmonic
        if harmonic.mesh in (mesh, mesh.rpartition("-")[0])
    ]
    return tuple(
        (harmonic.order, harmonic.amplitude, harmonic.phase) for harmonic in harmonics
    )


def _of_planetary(scene: Scene, gears: gear_set.GearSet) -> list[harmonics.MeshError]:
    """Return the errors of all meshes of a planetary set.

    Seen from the carrier the sun brings its once-per-revolution error to planet n later
    by ψ_n, the ring, which turns the other way, earlier. A planet whose axis is
    displaced by p has the errors ``n_s·p`` and ``n_r·p`` of a displaced pin in its
    meshes, whose directions are α_s + α_r apart: the ring's leads by that where the sun
    turns as the models count.
    """
    random = np.random.default_rng(scene.prescribed.seed)
    angles = gears.sense * np.asarray(gears.angles)
    sun, *planets, ring = (
        harmonics.realised(_member(scene, gears, name), random)
        for name in ("sun", *("planet",) * len(angles), "ring")
    )
    pins = _pins(scene, gears.angles, random)
    alpha_sun, alpha_ring = (kind.pair.working_pressure_angle for kind in gears.kinds)
    between_directions = gears.sense * (alpha_sun + alpha_ring)
    rows = []
    for name, kind, n in zip(
        gears.mesh_names, gears.mesh_kinds, [*range(len(angles))] * 2, strict=True
    ):
        if kind == 0:
            parts = [
                sun.turned(-angles[n]),
                planets[n],
                *(pin.turned(-alpha_sun) for pin in pins[n]),
            ]
        else:
            parts = [
                planets[n].at_other_mesh(between_directions),
                ring.turned(angles[n]),
                *(pin.turned(alpha_ring) for pin in pins[n]),
            ]
        rows.append(
            harmonics.mesh_error((), _harmonics(scene, name), parts=tuple(parts))
        )
    return rows


def _pins(scene: Scene, angles: Any, random: Any) -> list[list[harmonics.Realisation]]:
    """Return where the pins are off, at rest in the carrier.

    A pin moved by p in the direction β sees ``−n·p`` in a mesh whose normal is turned
    by ψ ∓ α.
    """
    members: Any = scene.prescribed.members
    gears: Any = scene.gears
    carrier = members.get("carrier")
    planet = members.get("planet")
    shared = [
        *(carrier.installation if carrier else ()),
        gears.carrier.eccentricity or 0.0,
    ]
    tolerances = [
        amount for held in (carrier, planet) if held for amount in held.planet_position
    ]
    directions = random.uniform(0.0, 2 * math.pi, len(shared))
    pins = []
    for angle in angles:
        moved = [*zip(shared, angle - directions, strict=True)]
        moved += [(amount, random.uniform(0.0, 2 * math.pi)) for amount in tolerances]
        axes = [
            harmonics.AT_REST.of(amount, float(direction))
            for amount, direction in moved
        ]
        pins.append([axis for axis in axes if axis.slow])
    return pins
