"""Contact over the width of flanks: slices, misalignment and lead modifications."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from wearlab.assembly import leads
from wearlab.assembly.mesh import DEFAULT_TOLERANCE
from wearlab.gears import helix
from wearlab.mesh import (
    contact,
    gear_set,
)
from wearlab.mesh.face import contact as over_face
from wearlab.mesh.face import grid as slicing
from wearlab.scene import Scene

SLICES_AT_DEFAULT = 41
MIN_SLICES = 11
MAX_SLICES = 161


def slices_of(scene: Scene, kind: gear_set.PairOfSet) -> int:
    """Return the slices across the face: as stated, or by the tolerance (second order).

    Parameters
    ----------
    scene : the scene
    kind : the mesh
    """
    points = scene.mesh.of(kind.section).face_points
    if points is not None:
        return points
    slices = SLICES_AT_DEFAULT * (DEFAULT_TOLERANCE / scene.numerics.tolerance) ** 0.5
    return int(np.clip(slices, MIN_SLICES, MAX_SLICES))


def build_face_contact(
    scene: Scene,
    kind: gear_set.PairOfSet,
    analysis: contact.ContactAnalysis,
    turned: helix.Helix,
) -> over_face.FaceContact:
    """Return the contact over the face of one kind of mesh.

    Parameters
    ----------
    scene : the scene
    kind : the mesh
    analysis : contact of its transverse section
    turned : the helix
    """
    slices = slices_of(scene, kind)
    if turned.angle:
        grid = slicing.helical_face(analysis.grid, kind.pair, turned, slices)
    else:
        grid = slicing.spur_face(analysis.grid, kind.pair.face_width, slices)
    coupling = scene.mesh.of(kind.section).coupling
    pair = kind.pair
    opening = leads.opening(scene, kind, scene.operation.torque)
    removed = []
    for number, turning in enumerate(pair.gears):
        share = pair.from_root(number, grid.profile.position)
        modification = leads.lead(getattr(scene.gears, turning.name))
        removed.append(modification.removed(grid.position, share, grid.face_width))
    return over_face.FaceContact(
        grid=grid,
        analysis=analysis,
        lead=np.stack(removed),
        opening=opening * grid.position / grid.face_width,
        shear_length=coupling.shear_length(scene.gears.module),
        pitch=kind.pair.base_pitch,
        helix=turned,
        solid=coupling.lines(pair, grid, turned),
    )


def sliced_flank(
    scene: Scene, gears: gear_set.GearSet, of: tuple[int, int], slices: ArrayLike
) -> helix.SlicedFlank | None:
    """Return a flank by slices, None in a scene without a face.

    Parameters
    ----------
    scene, gears : the scene and its gear set
    of : kind of mesh, and 0 for its driving gear or 1
    slices : their middles (n_face,) from mid-face [m], or how many equal ones
    """
    if not scene.face_keys:
        return None
    pair = gears.kinds[of[0]].pair
    middles = (
        slicing.equal_slices(pair.face_width, slices)[0]
        if isinstance(slices, int)
        else np.asarray(slices)
    )
    gear_options: Any = getattr(scene.gears, pair.gears[of[1]].name)
    return helix.SlicedFlank(
        middles, pair.face_width, leads.lead(gear_options), gears.helix.cosine
    )
