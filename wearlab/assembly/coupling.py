"""Contact and wear of each kind of mesh, joined on the clock of the set."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from wearlab.assembly import face
from wearlab.assembly.face_patch import FacePatchSetting, repeated
from wearlab.assembly.kinds import MeshKindModel
from wearlab.assembly.on_clock import OnClock
from wearlab.assembly.wear_law import build_law
from wearlab.life import coupled
from wearlab.life.face_coupling import FaceKind
from wearlab.mesh import clock, gear_set
from wearlab.scene import Scene
from wearlab.wear.patch import PatchSetting


def joined_kinds(
    scene: Scene,
    gears: gear_set.GearSet,
    kinds: Sequence[MeshKindModel],
    on_clock: OnClock,
) -> Iterator[coupled.MeshKind | FaceKind]:
    """Yield contact and wear of each kind of mesh, over the face where there is one.

    Parameters
    ----------
    scene, gears : the scene and its gear set
    kinds : physics of each kind of mesh
    on_clock : the meshes on their clock
    """
    for number, (kind, model) in enumerate(zip(gears.kinds, kinds, strict=True)):
        of_kind = clock.of_kind(on_clock.meshes, number)
        if scene.face_keys:
            yield _face_kind(scene, gears, kind, model, on_clock, of_kind)
        else:
            yield mesh_kind(scene, model, on_clock, of_kind)


def _face_kind(
    scene: Scene,
    gears: gear_set.GearSet,
    kind: gear_set.PairOfSet,
    model: MeshKindModel,
    on_clock: OnClock,
    of_kind: np.ndarray[Any, np.dtype[np.int64]],
) -> FaceKind:
    """Return contact and wear over the face of one kind of mesh."""
    over_face = face.build_face_contact(scene, kind, model.analysis, gears.helix)
    law = build_law(scene, kind.pair, repeated(model.path, over_face.grid.shape[0]))
    setting = FacePatchSetting(model.analysis, model.path, law, over_face)
    lags = {number: on_clock.meshes[number].lag for number in of_kind}
    return FaceKind(over_face, law, _patch(scene, setting), lags)


def mesh_kind(
    scene: Scene,
    model: MeshKindModel,
    on_clock: OnClock,
    of_kind: np.ndarray[Any, np.dtype[np.int64]],
) -> coupled.MeshKind:
    """Return contact and wear of one kind of mesh whose flanks have no width.

    Parameters
    ----------
    scene : the scene
    model : physics of the kind of mesh
    on_clock : the meshes on their clock
    of_kind : numbers of the meshes of this kind
    """
    setting = PatchSetting(model.analysis, model.path, model.law)
    instants = tuple(
        clock.instants_of(
            model.analysis.grid,
            on_clock.meshes[number].lag,
            model.analysis.at_nodes,
            on_clock.edges,
        )
        for number in of_kind
    )
    return coupled.MeshKind(
        analysis=model.analysis,
        law=model.law,
        patch=_patch(scene, setting),
        meshes=of_kind,
        when=instants,
        beyond=model.beyond,
    )


def _patch(scene: Scene, setting: PatchSetting) -> Any:
    """Return the contact patch, None where nothing wears."""
    return None if scene.wear is None else scene.wear.contact_patch.build(setting)
