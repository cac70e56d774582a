"""What gives the flanks of a scene a width, and what follows from it."""

from itertools import accumulate
from operator import mul

from wearlab import options
from wearlab.mesh import face_couplings, stiffnesses
from wearlab.scene import sections
from wearlab.scene.gears import LEAD_KEYS
from wearlab.scene.mesh import MeshSection, OneMesh

OF_MESH = ("misalignment", "face_coupling", "face_points")


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
