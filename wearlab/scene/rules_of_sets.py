"""What pairs and planetary sets ask of the sections of a scene, each kind of set in its way."""

from collections.abc import Iterator

from wearlab.scene.mesh import OWN_MESHES
from wearlab.scene.sections import Sections

Problems = Iterator[tuple[str, str]]


def _meshes_of_the_set(scene: Sections) -> Problems:
    """What both kinds of mesh must share, and what pairs have not."""
    if not scene.gears.descriptor.is_pair:
        pair = [scene.mesh.of(section) for section in OWN_MESHES]
        for key in ("damping_in", "excitation"):
            if getattr(pair[0], key) != getattr(pair[1], key):
                yield f"mesh.planet_ring.{key}", f"must be as in mesh.sun_planet: write mesh.{key} for both"
        return
    for section in OWN_MESHES:
        if getattr(scene.mesh, section) is not None:
            yield f"mesh.{section}", "belongs to planetary sets; this is a pair: write it under [mesh]"
    if scene.operation.output_loaded is False:
        yield "operation.load_torque", "'zero' needs a planetary set with a grounded output"


def _harmonics(scene: Sections) -> Problems:
    """An error of one planet's mesh needs that planet."""
    planets = getattr(scene.gears, "planets", 1)
    for number, harmonic in enumerate(scene.errors.harmonic if scene.errors is not None else ()):
        last = harmonic.mesh.rsplit("-", 1)[-1]
        if last.isdigit() and int(last) > planets:
            yield (
                f"errors.harmonic[{number}].mesh",
                f"{harmonic.mesh!r}: of that kind there are meshes 1 to {planets}",
            )


def _pins(scene: Sections) -> Problems:
    """The planets' pins stand in one member's errors: written twice, they would count twice."""
    given = scene.errors.members if scene.errors is not None else {}
    if all(getattr(given.get(member), "planet_position", ()) for member in ("planet", "carrier")):
        yield (
            "errors.planet.planet_position",
            "stands in errors.carrier as well, and both would add up: give the pins' tolerances in one place",
        )


RULES_OF_SETS = (_meshes_of_the_set, _harmonics, _pins)
