"""What gives the flanks of a scene a width, and what does not go together with it."""

from collections.abc import Iterator
from itertools import accumulate, pairwise
from operator import mul

from wearlab import options
from wearlab.mesh import contacts, face_couplings, stiffnesses
from wearlab.scene import sections
from wearlab.scene.gears import LEAD_KEYS, SetOptions, Toothed
from wearlab.scene.mesh import MeshSection, OneMesh
from wearlab.wear.coefficients import CalibratedCoefficient

Problems = Iterator[tuple[str, str]]
OF_MESH = ("misalignment", "face_coupling", "face_points")
WITHOUT = "or leave {keys} out and give mesh.face_load_factor"


def face_keys(scene: sections.Sections) -> tuple[str, ...]:
    """Return the keys by which the flanks of a scene have a width, () where they have none."""
    keys = [] if scene.gears.helix_angle is None else ["gears.helix_angle"]
    places: list[tuple[str, options.Part, tuple[str, ...]]]
    places = [(f"gears.{name}", gear, LEAD_KEYS) for name, gear in scene.gears.gears().items()]
    places += [(path, mesh, OF_MESH) for path, mesh in scene.meshes.items()]
    keys += [f"{path}.{key}" for path, part, own in places for key in own if getattr(part, key) is not None]
    return tuple(keys)


def face_coupling(mesh: OneMesh) -> face_couplings.FaceCouplingModel:
    """Return how slices hold each other: as said, or as their stiffness can tell.

    As solid teeth with finite elements, apart where the stiffness is prescribed, else in shear.
    """
    if mesh.face_coupling is not None:
        return mesh.face_coupling
    if isinstance(mesh.stiffness, stiffnesses.FiniteElementStiffness):
        return face_couplings.ElementsCoupling()
    return (
        face_couplings.NoFaceCoupling()
        if isinstance(mesh.stiffness, stiffnesses.PrescribedStiffness)
        else face_couplings.PasternakCoupling()
    )


def told_mesh(scene: sections.Sections) -> MeshSection:
    """Return ``[mesh]`` with the coupling of solid teeth along a face, where it goes without saying.

    It was another once: a run of then is none of now.
    """
    if not face_keys(scene):
        return scene.mesh
    couplings = {path: face_coupling(mesh) for path, mesh in scene.meshes.items()}
    told = {path: {"face_coupling": own} for path, own in couplings.items() if own.of_elements}
    if scene.gears.descriptor.is_pair:
        return scene.mesh.model_copy(update=told.get("mesh"))
    each = {path: scene.meshes[path].model_copy(update=own) for path, own in told.items()}
    return scene.mesh.model_copy(update={path.removeprefix("mesh."): mesh for path, mesh in each.items()})


def oblique_layers(scene: sections.Sections) -> bool:
    """Say whether slices of helical teeth yield by sections, and not as solid teeth."""
    return bool(scene.gears.helix_angle) and any(
        not face_coupling(mesh).of_elements
        and not isinstance(mesh.stiffness, stiffnesses.PrescribedStiffness)
        for mesh in scene.meshes.values()
    )


def hands(scene: sections.Sections) -> dict[str, str]:
    """Return the hand of each helical gear: as said, or opposite outside, the same in a ring.

    Where none is said the driving gear is right-handed, of a planetary set the sun.
    """
    gears = scene.gears.gears()
    chain = list(gears)  # each meshes with the one before it
    turns = accumulate((1 if name == "ring" else -1 for name in chain[1:]), mul, initial=1)
    alike = dict(zip(chain, turns, strict=True))
    first = str(scene.operation.input) if scene.gears.descriptor.is_pair else chain[0]
    told = [name for name in (first, *chain) if gears[name].hand is not None]
    known, hand = (told[0], gears[told[0]].hand) if told else (first, "right")
    other = {"left": "right", "right": "left"}[str(hand)]
    derived = {name: str(hand) if alike[name] == alike[known] else other for name in chain}
    return {name: gears[name].hand or derived[name] for name in chain}


def face_rules(scene: sections.Sections, gears: SetOptions) -> Problems:
    """What flanks with a width cannot go together with, each with what to give instead."""
    keys = face_keys(scene)
    yield from _measured(scene, keys)
    if not keys:
        return
    without = WITHOUT.format(keys=" and ".join(keys))
    yield from _hands(scene, gears.gears())
    yield from _widths(gears, keys[0])
    for path, mesh in scene.meshes.items():
        yield from _of_mesh(mesh, path, keys[0])
    yield from _in_motion(scene, keys[0])
    if scene.errors is not None:
        yield "errors", f"are not known over the face ({keys[0]}): leave [errors] out, {without}"
    if scene.start is not None:
        yield "start", "takes wear over by profile alone: give wear.initial instead"
    if scene.wear is not None and isinstance(scene.wear.coefficient, CalibratedCoefficient):
        yield "wear.coefficient", "'calibrated' knows no face: give the coefficient's value"


def _measured(scene: sections.Sections, keys: tuple[str, ...]) -> Problems:
    """A flank that was measured over its face needs one, and thins its section nowhere alike."""
    for flank in scene.gears.descriptor.flanks:
        initial = scene.initial_of(flank)
        if initial is None or not getattr(initial, "over_the_face", False):
            continue
        path = f"wear.initial.{flank}"
        if not keys:
            yield (
                f"{path}.file",
                "was measured over the face (face_position), and this scene has none: give mesh.face_points, "
                "such as 41, or a file of one profile",
            )
        if initial.sides == "both":
            yield f"{path}.sides", "'both' thins every slice alike, and a face is worn unevenly: give 'drive'"


def _in_motion(scene: sections.Sections, key: str) -> Problems:
    """Motions of flanks with a width are followed by their force over deflection, without friction."""
    if scene.dynamics is None:
        return
    if scene.dynamics.friction is not None:
        yield "dynamics.friction", f"is not known over the face ({key}): leave it out"
    if scene.dynamics.response is not None:
        yield "dynamics.response", f"is not followed over the face ({key}): sweep operation.speed instead"
    if not all(mesh.excitation.by_pairs for mesh in scene.meshes.values()):
        yield "mesh.excitation", f"of flanks with a width ({key}) is their own: give 'pairs', or leave it out"
    if scene.wear is not None and (scene.wear.load.needs_slope or scene.wear.wohler_slope is not None):
        yield (
            "wear.wohler_slope",
            f"counts forces of whole pairs, which a face ({key}) has not: give wear.load = 'instant' or "
            "'static', and leave it out",
        )


def _hands(scene: sections.Sections, gears: dict[str, Toothed]) -> Problems:
    """Hands belong to a helix, and those of gears in mesh must fit."""
    if scene.gears.helix_angle is None:
        for name in (name for name, gear in gears.items() if gear.hand is not None):
            yield f"gears.{name}.hand", "is that of a helix: give gears.helix_angle, or leave it out"
        return
    for (first, one), (second, two) in pairwise(hands(scene).items()):
        if (one == two) != (second == "ring"):
            wanted = "the same hand" if second == "ring" else "opposite hands"
            told = f"{two!r} does not mesh with {first}'s {one!r}: these gears have {wanted}"
            yield f"gears.{second}.hand", told


def _widths(gears: SetOptions, key: str) -> Problems:
    """The meshes of a set are told over one face."""
    own = {name: gear.face_width or gears.face_width for name, gear in gears.gears().items()}
    meshes = {min(own[first], own[second]) for first, second in pairwise(own)}
    if len(meshes) > 1:
        narrowest = min(own, key=lambda name: own[name])
        yield (
            f"gears.{narrowest}.face_width",
            f"gives the meshes of this set faces of {' and '.join(f'{1e3 * b:.4g}' for b in sorted(meshes))} "
            f"mm, and flanks with a width ({key}) are told over one: give the planets the narrowest",
        )


def _of_mesh(mesh: OneMesh, path: str, key: str) -> Problems:
    coupling = face_coupling(mesh)
    if mesh.face_load_factor != 1.0:
        yield (
            f"{path}.face_load_factor",
            f"is of scenes without a face, and {key} gives this one a face, of which it is a result: leave "
            "one out",
        )
    if mesh.stiffness.of_mesh:
        yield f"{path}.stiffness.of", f"'mesh' has no pairs to share out over the face ({key}): give 'pair'"
    if coupling.of_contact and isinstance(mesh.stiffness, stiffnesses.PrescribedStiffness):
        yield (
            f"{path}.face_coupling",
            f"{coupling.chosen!r} must know what the contact itself yields, and a prescribed "
            "stiffness does not tell: give 'none', or another mesh.stiffness",
        )
    if coupling.of_elements and not isinstance(mesh.stiffness, stiffnesses.FiniteElementStiffness):
        told = "goes with mesh.stiffness = 'finite-element': give that, or 'pasternak'"
        yield f"{path}.face_coupling", f"{coupling.chosen!r} {told}"
    if not isinstance(mesh.contact, contacts.DisplacementContact) or mesh.contact.by_threshold:
        told = f"flanks with a width ({key}) meet on the line of action: give 'displacement'"
        yield f"{path}.contact", told
