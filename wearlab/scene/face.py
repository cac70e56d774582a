"""What gives the flanks of a scene a width, and what does not go together with it."""

from collections.abc import Iterator
from typing import Any

from wearlab.mesh.contacts import DisplacementContact
from wearlab.mesh.face_couplings import FaceCouplingModel, NoFaceCoupling, PasternakCoupling
from wearlab.mesh.stiffnesses import FiniteElementStiffness, PrescribedStiffness
from wearlab.scene import sections
from wearlab.scene.gears import LEAD_KEYS
from wearlab.scene.mesh import OneMesh
from wearlab.wear.coefficients import CalibratedCoefficient

Problems = Iterator[tuple[str, str]]
OF_MESH = ("misalignment", "face_coupling", "face_points")
WITHOUT = "or leave {keys} out and give mesh.face_load_factor"


def face_keys(scene: sections.Sections) -> tuple[str, ...]:
    """Return the keys by which the flanks of a scene have a width, () where they have none."""
    keys = [] if scene.gears.helix_angle is None else ["gears.helix_angle"]
    for name, gear in scene.gears.gears().items():
        keys += [f"gears.{name}.{key}" for key in LEAD_KEYS if getattr(gear, key) is not None]
    for section in scene.gears.descriptor.sections:
        mesh = scene.mesh.of(section)
        path = f"mesh.{section}." if section else "mesh."
        keys += [f"{path}{key}" for key in OF_MESH if getattr(mesh, key) is not None]
    return tuple(keys)


def face_coupling(mesh: OneMesh) -> FaceCouplingModel:
    """Return how slices hold each other: as said, apart where the stiffness is prescribed, else in shear."""
    if mesh.face_coupling is not None:
        return mesh.face_coupling
    return NoFaceCoupling() if isinstance(mesh.stiffness, PrescribedStiffness) else PasternakCoupling()


def hands(scene: sections.Sections) -> dict[str, str]:
    """Return the hand of each gear of a helical pair: as said, or opposite outside, the same in a ring."""
    gears, driving = scene.gears.gears(), str(scene.operation.input)
    mate = next(name for name in gears if name != driving)
    first, second = gears[driving].hand, gears[mate].hand
    internal = "ring" in gears
    first = first or (_of_mate(second, internal) if second is not None else "right")
    derived = {driving: first, mate: second or _of_mate(first, internal)}
    return {name: derived[name] for name in gears}


def _of_mate(hand: str, internal: bool) -> Any:
    """Return the hand that meshes with one: the same in a ring, else the other."""
    return hand if internal else {"left": "right", "right": "left"}[hand]


def face_rules(scene: sections.Sections) -> Problems:
    """What flanks with a width cannot go together with, each with what to give instead."""
    keys = face_keys(scene)
    if not keys:
        return
    without = WITHOUT.format(keys=" and ".join(keys))
    if not scene.gears.descriptor.is_pair:
        yield (
            keys[0],
            f"flanks with a width are those of pairs: give external-pair or internal-pair, {without}",
        )
        return
    yield from _hands(scene)
    yield from _of_mesh(scene, keys[0])
    yield from _in_motion(scene, keys[0])
    if scene.errors is not None:
        yield "errors", f"are not known over the face ({keys[0]}): leave [errors] out, {without}"
    if scene.start is not None:
        yield "start", "takes wear over by profile alone: give wear.initial instead"
    if scene.wear is not None and isinstance(scene.wear.coefficient, CalibratedCoefficient):
        yield "wear.coefficient", "'calibrated' knows no face: give the coefficient's value"


def _in_motion(scene: sections.Sections, key: str) -> Problems:
    """Motions of flanks with a width are followed by their force over deflection, without friction."""
    if scene.dynamics is None:
        return
    if scene.dynamics.friction is not None:
        yield "dynamics.friction", f"is not known over the face ({key}): leave it out"
    if scene.dynamics.response is not None:
        yield "dynamics.response", f"is not followed over the face ({key}): sweep operation.speed instead"
    if not scene.mesh.excitation.by_pairs:
        yield "mesh.excitation", f"of flanks with a width ({key}) is their own: give 'pairs', or leave it out"
    if scene.wear is not None and (scene.wear.load.needs_slope or scene.wear.wohler_slope is not None):
        yield (
            "wear.wohler_slope",
            f"counts forces of whole pairs, which a face ({key}) has not: give wear.load = 'instant' or "
            "'static', and leave it out",
        )


def _hands(scene: sections.Sections) -> Problems:
    """Hands belong to a helix, and those of two gears must mesh."""
    gears = scene.gears.gears()
    if scene.gears.helix_angle is None:
        for name, gear in gears.items():
            if gear.hand is not None:
                yield f"gears.{name}.hand", "is that of a helix: give gears.helix_angle, or leave it out"
        return
    (first, one), (second, two) = hands(scene).items()
    if (one == two) != ("ring" in gears):
        wanted = "the same hand" if "ring" in gears else "opposite hands"
        yield (
            f"gears.{second}.hand",
            f"{two!r} does not mesh with {first}'s {one!r}: these gears have {wanted}",
        )


def _of_mesh(scene: sections.Sections, key: str) -> Problems:
    mesh = scene.mesh
    if mesh.face_load_factor != 1.0:
        yield (
            "mesh.face_load_factor",
            f"is of scenes without a face, and {key} gives this one a face, of which it is a result: leave "
            "one out",
        )
    if mesh.stiffness.of_mesh:
        yield "mesh.stiffness.of", f"'mesh' has no pairs to share out over the face ({key}): give 'pair'"
    if face_coupling(mesh).of_contact and isinstance(mesh.stiffness, PrescribedStiffness):
        yield (
            "mesh.face_coupling",
            f"{face_coupling(mesh).chosen!r} must know what the contact itself yields, and a prescribed "
            "stiffness does not tell: give 'none', or another mesh.stiffness",
        )
    if face_coupling(mesh).of_elements and not isinstance(mesh.stiffness, FiniteElementStiffness):
        yield (
            "mesh.face_coupling",
            f"{face_coupling(mesh).chosen!r} goes with mesh.stiffness = 'finite-element': give that, or "
            "'pasternak'",
        )
    if not isinstance(mesh.contact, DisplacementContact) or mesh.contact.by_threshold:
        yield "mesh.contact", f"flanks with a width ({key}) meet on the line of action: give 'displacement'"
