"""``helix_angle``, lead modifications and ``[mesh] misalignment`` → contact and wear over the face."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.gear import DRIVING, GearPair
from wearlab.gears.helix import SPUR, Helix, Lead, helix
from wearlab.life.face import FaceKind
from wearlab.mesh.contact import ContactAnalysis
from wearlab.mesh.face.contact import FaceContact, section
from wearlab.mesh.face.grid import FaceGrid, helical_face, spur_face
from wearlab.mesh.gear_set import PairOfSet
from wearlab.scene import Scene
from wearlab.scene.build.wear import build_law
from wearlab.scene.face import face_coupling, hands
from wearlab.wear.law import PreparedLaw
from wearlab.wear.patch import PatchSetting
from wearlab.wear.path import WearPath

SLICES_AT_DEFAULT, LEAST_SLICES, MOST_SLICES = 41, 11, 161
DEFAULT_TOLERANCE = 1e-3


def helix_of(scene: Scene) -> Helix:
    """Return the helix of a scene's gears, that of spur gears where there is none.

    Of a right-handed driving gear that drives with its right flanks, contact reaches larger y later.
    """
    if not scene.gears.helix_angle:
        return SPUR
    right = hands(scene)[str(scene.operation.input)] == "right"
    sense = 1.0 if right == (scene.operation.drive_flank == "right") else -1.0
    return helix(scene.gears.helix_angle, scene.gears.pressure_angle, sense)


def slices_of(scene: Scene, kind: PairOfSet) -> int:
    """Return the slices asked for: as said, or for a second-order error from the tolerance."""
    asked = scene.mesh.of(kind.section).face_points
    if asked is not None:
        return asked
    wanted = SLICES_AT_DEFAULT * (DEFAULT_TOLERANCE / scene.numerics.tolerance) ** 0.5
    return int(np.clip(wanted, LEAST_SLICES, MOST_SLICES))


def build_face_grid(scene: Scene, kind: PairOfSet, analysis: ContactAnalysis) -> FaceGrid:
    """Return slices and nodes of one kind of mesh."""
    turned, slices = helix_of(scene), slices_of(scene, kind)
    if turned.angle:
        return helical_face(analysis.grid, kind.pair, turned, slices)
    return spur_face(analysis.grid, kind.pair.face_width, slices)


def build_face_contact(scene: Scene, kind: PairOfSet, analysis: ContactAnalysis) -> FaceContact:
    """Return the contact over the face of one kind of mesh."""
    turned, mesh = helix_of(scene), scene.mesh.of(kind.section)
    grid = build_face_grid(scene, kind, analysis)
    given = mesh.misalignment
    torque = scene.operation.torque
    coupling = face_coupling(mesh)
    over = 0.0 if given is None else given.over_face(kind.pair.working_pressure_angle, torque)
    return FaceContact(
        grid=grid,
        analysis=analysis,
        section=section(analysis, grid.face_width, turned),
        lead=leads(scene, kind.pair, grid),
        opening=over * grid.position / grid.face_width,
        shear_length=coupling.shear_length(scene.gears.module),
        pitch=kind.pair.base_pitch,
        helix=turned,
        solid=coupling.lines(kind.pair, grid, turned),
    )


def leads(scene: Scene, pair: GearPair, grid: FaceGrid) -> Array:
    """Return what is removed on purpose and varies over the face, (2, n_face, n) (driving, driven) [m]."""
    path, each = pair.path, []
    for number, gear in enumerate(pair.gears):
        share = (grid.profile.position - path.A) / (path.E - path.A)
        own: Any = getattr(scene.gears, gear.name)
        of_gear = lead(own)
        from_root = share if number == DRIVING else 1.0 - share
        each.append(of_gear.removed(grid.position, from_root, grid.face_width))
    return np.stack(each)


def lead(gear: Any) -> Lead:
    """Return the lead modification that ``[gears.<name>]`` says."""
    ends = gear.end_relief
    return Lead(
        crowning=gear.lead_crowning or 0.0,
        slope=gear.lead_slope or 0.0,
        relief=0.0 if ends is None else ends.amount,
        relief_length=1.0 if ends is None else ends.length,
        bias=gear.bias or 0.0,
    )


@dataclass(frozen=True)
class FacePatchSetting(PatchSetting):
    """What a contact patch may know of flanks with a width.

    Parameters
    ----------
    mean_static : (n,) mean force on a pair of unworn flanks when it touches at the node, over the face, as if
        it were on the whole face [N]
    """

    mean_static: Array

    @cached_property
    def static(self) -> Array:
        """That force, (n,) [N]."""
        return self.mean_static


def build_face(
    scene: Scene, kind: PairOfSet, analysis: ContactAnalysis, path: WearPath, law: PreparedLaw | None
) -> FaceKind:
    """Return contact and wear of a pair whose flanks have a width.

    Parameters
    ----------
    scene, kind : the scene and its kind of mesh
    analysis, path, law : of the section
    """
    contact = build_face_contact(scene, kind, analysis)
    patch = None
    if scene.wear is not None:
        unworn = contact.grid.at_nodes(contact.unworn.load)
        mean = contact.grid.width @ unworn
        patch = scene.wear.contact_patch.build(FacePatchSetting(analysis, path, law, mean))
    over_face = build_law(scene, kind.pair, repeated(path, contact.grid.shape[0]))
    return FaceKind(contact, over_face, patch)


def repeated(path: WearPath, slices: int) -> WearPath:
    """Return the path of a section as that of all slices, one after another."""
    along = ("curvature", "surface_velocity", "specific_sliding", "arc_weight", "arc", "pressure_angle")
    wide: dict[str, Any] = {name: np.tile(getattr(path, name), (1, slices)) for name in along}
    return path._replace(equivalent_radius=np.tile(path.equivalent_radius, slices), **wide)
