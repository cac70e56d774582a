"""``[errors]`` → one realisation of the prescribed errors of every mesh."""

import math
from typing import Any

import numpy as np

from wearlab.gears.tolerances import allowed
from wearlab.mesh.errors import AT_REST, MemberError, MeshError, Realisation, mesh_error, realised
from wearlab.mesh.gear_set import GearSet
from wearlab.scene import Scene


def build_errors(scene: Scene, gears: GearSet) -> list[MeshError]:
    """Return one realisation of the errors of each mesh, drawn member after member from the seed."""
    if gears.angles:
        return _of_planetary(scene, gears)
    errors = scene.errors
    if errors is None:
        return [mesh_error(())]
    members = tuple(_member(scene, gears, name) for name in gears.members)
    return [mesh_error(members, _harmonics(scene, gears.mesh_names[0]), errors.seed)]


def _member(scene: Scene, gears: GearSet, name: str) -> MemberError:
    """Return the errors that the file gives a toothed member, or that its ISO 1328 class allows."""
    gear = gears.gears[name]
    teeth = gear.teeth
    given: Any = scene.errors.members.get(name) if scene.errors is not None else None
    eccentricity = getattr(getattr(scene.gears, name), "eccentricity", None) or 0.0
    grade = iso_1328_class(scene, name)
    total = tooth = 0.0
    if grade is not None:
        ratio = min(
            kind.pair.contact_ratio for kind in gears.kinds if gear.name in {g.name for g in kind.pair.gears}
        )
        *_, tooth, total = allowed(grade, gear.module, 2.0 * gear.reference_radius, ratio)
    if given is None:
        return MemberError(teeth, total, tooth, eccentricity=eccentricity)
    said = given.model_fields_set
    return MemberError(
        teeth,
        given.total_composite if "total_composite" in said else total,
        given.tooth_composite if "tooth_composite" in said else tooth,
        tuple(given.installation),
        eccentricity,
    )


def iso_1328_class(scene: Scene, name: str) -> int | None:
    """Return the accuracy class of a toothed member, None without one."""
    if scene.errors is None:
        return None
    own = getattr(scene.errors.members.get(name), "iso_1328_class", None)
    return scene.errors.iso_1328_class if own is None else own


def class_flags(scene: Scene, gears: GearSet) -> tuple[str, ...]:
    """Return what each member's ISO 1328 class allows it, in words."""
    lines = []
    for name in gears.gears:
        grade = iso_1328_class(scene, name)
        if grade is not None:
            error = _member(scene, gears, name)
            lines.append(
                f"{name}: ISO 1328-1:1995 class {grade}: F_i′ = {1e6 * error.total_composite:.3g} µm, "
                f"f_i′ = {1e6 * error.tooth_composite:.3g} µm, all that is allowed, "
                "at angles drawn by errors.seed"
            )
    return tuple(lines)


def _harmonics(scene: Scene, mesh: str) -> tuple[tuple[int, float, float], ...]:
    """Return the prescribed harmonics of one mesh, named itself or with all of its kind."""
    given = scene.errors.harmonic if scene.errors is not None else ()
    return tuple(
        (h.order, h.amplitude, h.phase) for h in given if mesh == h.mesh or mesh.rpartition("-")[0] == h.mesh
    )


def _of_planetary(scene: Scene, gears: GearSet) -> list[MeshError]:
    """Return the errors of all meshes: gears seen where each planet stands, pins where they are held.

    Seen from the carrier the sun brings its once-per-revolution error to planet n later by ψ_n, the ring,
    which turns the other way, earlier; a planet shows the ring the side away from the sun.
    """
    errors: Any = scene.errors
    random = np.random.default_rng(0 if errors is None else errors.seed)
    angles = gears.sense * np.asarray(gears.angles)
    sun = realised(_member(scene, gears, "sun"), random)
    planets = [realised(_member(scene, gears, "planet"), random) for _ in angles]
    ring = realised(_member(scene, gears, "ring"), random)
    pins = _pins(scene, angles, random)
    rows = []
    for mesh, name in enumerate(gears.mesh_names):
        kind, n = gears.mesh_kinds[mesh], mesh % len(angles)
        alpha = gears.kinds[kind].pair.working_pressure_angle
        if kind == 0:
            parts = [sun.turned(-angles[n]), planets[n], *(pin.turned(-alpha) for pin in pins[n])]
        else:
            parts = [
                planets[n].turned(math.pi),
                ring.turned(angles[n]),
                *(pin.turned(alpha) for pin in pins[n]),
            ]
        rows.append(mesh_error((), _harmonics(scene, name), parts=tuple(parts)))
    return rows


def _pins(scene: Scene, angles: Any, random: Any) -> list[list[Realisation]]:
    """Return where the pins are off, at rest in the carrier: each tangential in its own direction.

    A pin moved by p in the direction β sees ``−n·p`` in a mesh whose normal is turned by ψ ∓ α.
    """
    given: Any = scene.errors.members if scene.errors is not None else {}
    carrier, planet = given.get("carrier"), given.get("planet")
    gears: Any = scene.gears
    shared = [*(carrier.installation if carrier else ()), gears.carrier.eccentricity or 0.0]
    own = [
        *(carrier.planet_position if carrier else ()),
        *(planet.planet_position if planet else ()),
    ]
    directions = random.uniform(0.0, 2 * math.pi, len(shared))
    pins = []
    for angle in angles:
        moved = [
            AT_REST.of(amount, angle - direction)
            for amount, direction in zip(shared, directions, strict=True)
        ]
        moved += [AT_REST.of(amount, random.uniform(0.0, 2 * math.pi)) for amount in own]
        pins.append([axis for axis in moved if len(axis.slow)])
    return pins
