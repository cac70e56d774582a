"""``helix_angle``, lead modifications and ``[mesh] misalignment`` → contact and wear over the face."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.helix import SPUR, Helix, Lead, SlicedFlank, helix
from wearlab.life.face import FaceKind
from wearlab.mesh import gear_set
from wearlab.mesh.contact import ContactAnalysis
from wearlab.mesh.face.contact import FaceContact
from wearlab.mesh.face.grid import equal_slices, helical_face, spur_face
from wearlab.scene import Scene
from wearlab.scene.build.wear import KindParts, build_law
from wearlab.scene.face import face_coupling, face_keys, hands
from wearlab.wear.patch import PatchSetting
from wearlab.wear.path import WearPath, contact_half_width

SLICES_AT_DEFAULT, LEAST_SLICES, MOST_SLICES = 41, 11, 161
DEFAULT_TOLERANCE = 1e-3


def helix_of(scene: Scene, gears: gear_set.GearSet) -> Helix:
    """Return the helix of a scene's gears, that of spur gears where there is none.

    Of a right-handed driving gear that drives with its right flanks, contact reaches larger y later, and so
    it does in every mesh of a set: the next gear turns the other way with the other hand, or is a ring.
    """
    if not scene.gears.helix_angle:
        return SPUR
    right = hands(scene)[gears.kinds[0].pair.driving.name] == "right"
    sense = 1.0 if right == (scene.operation.drive_flank == "right") else -1.0
    return helix(scene.gears.helix_angle, scene.gears.pressure_angle, sense)


def helix_flags(
    gears: gear_set.GearSet, turned: Helix, loads: Sequence[float], *, bearings: bool
) -> Iterator[str]:
    """Yield what the helix of gears does that nothing here answers to, in words.

    Parameters
    ----------
    gears, turned : the gear set and its helix
    loads : largest static force of each kind of mesh, in the heaviest of all conditions [N]
    bearings : whether the dynamics know bearings, which hold the axial force
    """
    if not turned.angle:
        return
    axial = [abs(turned.slope) * load for load in loads]
    if not bearings:
        force = f"up to {max(axial):.4g} N"
        yield f"helix: each mesh pushes its gears {force} along their axes; no bearing here holds it"
    if gears.shares:
        radius = gears.bodies["planet"].radius
        arms = sum(radius / math.cos(kind.pair.working_pressure_angle) for kind in gears.kinds)
        yield (
            f"helix: the two meshes of a planet tilt it by up to {axial[0] * arms:.4g} N m, and how its "
            "bearing gives way is not computed: give mesh.sun_planet.misalignment and "
            "mesh.planet_ring.misalignment, over torque"
        )


def slices_of(scene: Scene, kind: gear_set.PairOfSet) -> int:
    """Return the slices asked for: as said, or for a second-order error from the tolerance."""
    asked = scene.mesh.of(kind.section).face_points
    if asked is not None:
        return asked
    wanted = SLICES_AT_DEFAULT * (DEFAULT_TOLERANCE / scene.numerics.tolerance) ** 0.5
    return int(np.clip(wanted, LEAST_SLICES, MOST_SLICES))


def build_face_contact(
    scene: Scene, kind: gear_set.PairOfSet, analysis: ContactAnalysis, turned: Helix
) -> FaceContact:
    """Return the contact over the face of one kind of mesh."""
    mesh, slices = scene.mesh.of(kind.section), slices_of(scene, kind)
    if turned.angle:
        grid = helical_face(analysis.grid, kind.pair, turned, slices)
    else:
        grid = spur_face(analysis.grid, kind.pair.face_width, slices)
    given, coupling, pair = mesh.misalignment, face_coupling(mesh), kind.pair
    over = 0.0 if given is None else given.over_face(pair.working_pressure_angle, scene.operation.torque)
    removed = [
        lead(getattr(scene.gears, gear.name)).removed(
            grid.position, pair.from_root(number, grid.profile.position), grid.face_width
        )
        for number, gear in enumerate(pair.gears)
    ]
    return FaceContact(
        grid=grid,
        analysis=analysis,
        lead=np.stack(removed),
        opening=over * grid.position / grid.face_width,
        shear_length=coupling.shear_length(scene.gears.module),
        pitch=kind.pair.base_pitch,
        helix=turned,
        solid=coupling.lines(pair, grid, turned),
    )


def sliced_flank(
    scene: Scene, gears: gear_set.GearSet, of: tuple[int, int], slices: Array | int
) -> SlicedFlank | None:
    """Return a flank by slices, None in a scene without a face.

    Parameters
    ----------
    scene, gears : the scene and its gear set
    of : kind of mesh, and 0 for its driving gear or 1
    slices : their middles (n_face,) from mid-face [m], or how many equal ones
    """
    if not face_keys(scene):
        return None
    pair = gears.kinds[of[0]].pair
    if isinstance(slices, int):
        slices, _ = equal_slices(pair.face_width, slices)
    own: Any = getattr(scene.gears, pair.gears[of[1]].name)
    return SlicedFlank(slices, pair.face_width, lead(own), helix_of(scene, gears).cosine)


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
    """What a contact patch may know of flanks with a width: forces and law slice after slice.

    Parameters
    ----------
    line_load : (n_face, n) static load per width of unworn flanks when they touch at the node [N/m]
    """

    line_load: Array

    @cached_property
    def static(self) -> Array:
        """That load as a force on the whole face, (n_face n,) [N]."""
        return self.line_load.ravel() * self.path.face_width

    @cached_property
    def half_width(self) -> Array:
        """Hertz's half width of every slice, (n_face, n) [m]."""
        return contact_half_width(self.reference.reshape(self.line_load.shape), self.path)


def build_face(
    scene: Scene, kind: gear_set.PairOfSet, of: KindParts, lags: dict[int, float], turned: Helix
) -> FaceKind:
    """Return contact and wear of one kind of mesh whose flanks have a width.

    Parameters
    ----------
    scene, kind : the scene and its kind of mesh
    of : its physics in a section
    lags : γ of each of its meshes, by number [1]
    turned : the helix
    """
    contact = build_face_contact(scene, kind, of.analysis, turned)
    over_face, patch = build_law(scene, kind.pair, repeated(of.path, contact.grid.shape[0])), None
    if scene.wear is not None:
        unworn = contact.grid.at_nodes(contact.unworn.load)
        patch = scene.wear.contact_patch.build(FacePatchSetting(of.analysis, of.path, over_face, unworn))
    return FaceKind(contact, over_face, patch, lags)


def repeated(path: WearPath, slices: int) -> WearPath:
    """Return the path of a section as that of all slices, one after another."""
    along = ("curvature", "surface_velocity", "specific_sliding", "arc_weight", "arc", "pressure_angle")
    wide: dict[str, Any] = {name: np.tile(getattr(path, name), (1, slices)) for name in along}
    return path._replace(equivalent_radius=np.tile(path.equivalent_radius, slices), **wide)
