"""Planetary stages of a file: sun, planets, ring and carrier, and what is fixed."""

import math
from collections.abc import Iterator
from typing import NamedTuple

from wearlab.rexs import pairs
from wearlab.rexs.document import Component, Document, RexsError
from wearlab.rexs.draft import Draft, with_unit
from wearlab.rexs.pairs import Roles, Summary
from wearlab.rexs.power import gears_of
from wearlab.rexs.quantities import number, position, size
from wearlab.rexs.wheel import Wheel, put_gear, wheel_of

EQUAL_ANGLES = 1e-6
"""How far planets may be from equal angles [rad] to be called equal."""


class PlanetaryGears(NamedTuple):
    """The gears of a planetary stage.

    Parameters
    ----------
    sun, ring : their components
    planets : their components, in the order of the file
    sun_mesh, ring_mesh : the pairs of the first planet with sun and ring
    carrier : a shaft of the carrier, None without
    """

    sun: Component
    ring: Component
    planets: tuple[Component, ...]
    sun_mesh: Component
    ring_mesh: Component
    carrier: Component | None


def planetary_gears(document: Document, stage: Component) -> PlanetaryGears:
    """Return the gears of a planetary stage.

    The pairs within it tell: a planet meshes with both central gears, and the ring is
    the one whose teeth point inwards.

    Parameters
    ----------
    document : the file
    stage : the stage's component

    Raises
    ------
    RexsError : no sun, ring or planet, or several suns or rings
    """
    meshes = tuple(
        part
        for part in document.partners("assembly", "assembly", stage.id, "part")
        if part.type == "cylindrical_stage"
    )
    gears_by_mesh = {
        mesh.id: gears
        for mesh in meshes
        if (gears := gears_of(document, mesh)) is not None
    }
    sides = list(gears_by_mesh.values())
    rings = {gear.id: gear for gears in sides for gear in gears if _is_ring(gear)}
    planets = {
        gear.id: gear
        for gears in sides
        if any(_is_ring(part) for part in gears)
        for gear in gears
        if not _is_ring(gear)
    }
    suns = {
        gear.id: gear
        for gears in sides
        for gear in gears
        if gear.id not in planets and gear.id not in rings
    }
    if len(suns) != 1 or len(rings) != 1 or len(planets) < 2:
        raise RexsError(
            f'"{stage.name or stage.id}" has {len(suns)} suns, {len(planets)} planets '
            f"and {len(rings)} rings: wearlab has sets of one sun, one ring and two or "
            "more planets"
        )
    carrier = next(
        document.partners("planet_carrier_shaft", "planetary_stage", stage.id, "shaft"),
        None,
    )
    first_planet = next(iter(planets))
    of_first = [
        mesh
        for mesh in meshes
        if first_planet in [gear.id for gear in gears_by_mesh.get(mesh.id, ())]
    ]
    with_ring = [
        mesh
        for mesh in of_first
        if rings.keys() & {gear.id for gear in gears_by_mesh[mesh.id]}
    ]
    with_sun = [mesh for mesh in of_first if mesh not in with_ring]
    if not with_sun:
        raise RexsError(
            f'"{stage.name or stage.id}": its first planet meshes with no sun: export '
            "the gear unit whole"
        )
    return PlanetaryGears(
        sun=next(iter(suns.values())),
        ring=next(iter(rings.values())),
        planets=tuple(planets.values()),
        sun_mesh=with_sun[0],
        ring_mesh=with_ring[0],
        carrier=carrier,
    )


def _is_ring(gear: Component) -> bool:
    """Tell whether a gear's teeth point inwards."""
    teeth = number(gear, "number_of_teeth")
    return gear.type == "ring_gear" or (teeth is not None and teeth.value < 0.0)


def summary(document: Document, stage: Component) -> Summary:
    """Return a planetary stage as a list of stages shows it.

    Parameters
    ----------
    document : the file
    stage : the stage's component

    Raises
    ------
    RexsError : as of `planetary_gears`
    """
    train = planetary_gears(document, stage)
    teeth = tuple(
        int(read.value) if (read := size(gear, "number_of_teeth")) else 0
        for gear in (train.sun, train.planets[0], train.ring)
    )
    module = size(train.sun, "normal_module", "mm")
    distance = size(train.sun_mesh, "center_distance", "mm")
    return (
        "planetary",
        teeth,
        None if module is None else module.value,
        None if distance is None else distance.value,
    )


def put_stage(draft: Draft, document: Document, stage: Component) -> Roles:
    """Write ``[gears]`` of a planetary stage.

    Parameters
    ----------
    draft : the campaign file
    document : the file
    stage : the stage's component

    Raises
    ------
    RexsError : as of `planetary_gears`
    """
    train = planetary_gears(document, stage)
    wheels = {
        "sun": wheel_of(document, train.sun, draft),
        "planet": wheel_of(document, train.planets[0], draft),
        "ring": wheel_of(document, train.ring, draft),
    }
    draft.put("gears", "kind", "planetary", f"component {stage.id}, {stage.type}")
    count = len(train.planets)
    draft.put("gears", "planets", count, "planets that mesh with the ring")
    _put_angles(draft, train)
    module = pairs.put_rack(draft, wheels["sun"])

    distances = _put_distances(draft, train)
    pairs.put_face(draft, train.sun_mesh, wheels)

    for member, wheel in wheels.items():
        put_gear(draft, member, wheel, module)
    if distances is not None:
        _derive_shifts(draft, wheels, module, distances)
    pairs.put_hand(draft, "sun", wheels["sun"])
    _say_what_differs(draft, train)
    draft.missing.append(
        "gears.carrier: mass and inertia, which dynamics need, are not in the file"
    )
    return {
        "sun": train.sun.id,
        "planet": train.planets[0].id,
        "ring": train.ring.id,
        "carrier": train.carrier.id if train.carrier is not None else "",
    }


def _put_distances(draft: Draft, train: PlanetaryGears) -> tuple[float, float] | None:
    """Write the centre distance, of both meshes where they differ; return both [mm]."""
    with_sun = size(train.sun_mesh, "center_distance", "mm")
    with_ring = size(train.ring_mesh, "center_distance", "mm")
    if with_sun is None or with_ring is None:
        return None

    distances = (with_sun.value, with_ring.value)
    if distances[0] == distances[1]:
        value: object = with_unit(distances[0], "mm")
    else:
        value = {
            "sun_planet": with_unit(distances[0], "mm"),
            "planet_ring": with_unit(distances[1], "mm"),
        }
    draft.put("gears", "centre_distance", value, with_sun.source)
    return distances


def _derive_shifts(
    draft: Draft,
    wheels: dict[str, Wheel],
    module: float,
    distances: tuple[float, float],
) -> None:
    """Say what profile shifts the centre distance asks for in both meshes."""
    for members, distance in zip(
        (("sun", "planet"), ("planet", "ring")), distances, strict=True
    ):
        pair = (wheels[members[0]], wheels[members[1]])
        pairs.derive_shifts(draft, members, pair, module, distance)


def _put_angles(draft: Draft, train: PlanetaryGears) -> None:
    """Write the angles of the planets where they are not equal."""
    angles = _angles(train)
    if len(angles) != len(train.planets):
        return

    step = 2.0 * math.pi / len(angles)
    unequal = any(
        abs(math.remainder(angle - place * step, 2.0 * math.pi)) > EQUAL_ANGLES
        for place, angle in enumerate(angles)
    )
    shown = ", ".join(f"{math.degrees(angle):.6g}" for angle in angles)
    draft.derived.append(f"planets at {shown} deg")
    if unequal:
        values = [
            with_unit(float(f"{math.degrees(angle):.12g}"), "deg") for angle in angles
        ]
        draft.put("gears", "planet_angles", values, "support_vector of the planets")


def _angles(train: PlanetaryGears) -> list[float]:
    """Return the angles of the planets about the sun, from the first one [rad]."""
    centre = position(train.sun, "support_vector")
    places = [position(planet, "support_vector") for planet in train.planets]
    if centre is None:
        return []

    turned = [
        math.atan2(place[2] - centre[2], place[1] - centre[1])
        for place in places
        if place is not None
    ]
    return sorted(
        round((angle - turned[0]) % (2.0 * math.pi), 12) % (2.0 * math.pi)
        for angle in turned
    )


def _say_what_differs(draft: Draft, train: PlanetaryGears) -> None:
    """Say where planets differ from the first one, which stands for all."""
    first, *others = train.planets
    for planet in others:
        for attribute in _differences(first, planet):
            draft.left_out.append(
                f"component {planet.id}, {attribute}: another one than of the first "
                f"planet, component {first.id}, which is taken for all"
            )


def _differences(first: Component, second: Component) -> Iterator[str]:
    """Yield the attributes, places aside, in which two planets differ."""
    for attribute in sorted({*first.attributes, *second.attributes}):
        if attribute.endswith("_vector"):
            continue
        if first.attributes.get(attribute) != second.attributes.get(attribute):
            yield attribute
