"""A scene becomes physics: only here do sections of a campaign file meet gears, mesh, dynamics and wear."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.gear import GearPair
from wearlab.gears.helix import Helix
from wearlab.life.coupled import kinds_of
from wearlab.life.coupling import Coupling
from wearlab.life.face import FaceCoupling
from wearlab.life.vibration import Vibration
from wearlab.mesh import clock, contact, gear_set, profile
from wearlab.scene import Scene, presence
from wearlab.scene.build import mesh, sets
from wearlab.scene.build.contact import class_flags, contact_flags
from wearlab.scene.build.face import SectionOfKind, build_face, helix_flags, helix_of
from wearlab.scene.build.vibration import StiffnessOfMeshes, build_vibration
from wearlab.scene.build.wear import build_film, build_law, build_load, build_path
from wearlab.scene.face import face_keys
from wearlab.wear.film import Film
from wearlab.wear.law import PreparedLaw
from wearlab.wear.patch import PatchSetting
from wearlab.wear.path import WearPath

HARMONICS = 10
PHASE_POINTS = 256


@dataclass(frozen=True)
class KindParts:
    """The physics of one kind of mesh; what the scene leaves out is ``None``.

    Parameters
    ----------
    pair : the gears in their operating position
    analysis : contact of the worn flanks
    modification : (2, n) material removed on purpose, (driving, driven) [m]
    path : velocities and radii along the path
    law, film : present parts of the wear law
    """

    pair: GearPair
    analysis: contact.ContactAnalysis
    modification: Array
    path: WearPath
    law: PreparedLaw | None
    film: Film | None


@dataclass(frozen=True)
class Parts:
    """The physics of a scene; what the scene leaves out is ``None``.

    Parameters
    ----------
    gears : the gear set in operation
    kinds : the physics of each kind of mesh
    meshes : the meshes, their lags and errors
    edges : breaks of the clock
    constant_error : (n_mesh,) frozen once-per-revolution errors [m]
    coupling : contact, dynamics and wear joined
    phase : (n_phases,) stored phases [1]
    harmonics : number of harmonics stored
    drive_flank : "right" or "left"
    pressure_factor : of the stored pressure to the mean of Hertz's ellipse [1]
    wohler_slope : exponent of the equivalent load, None: not stored
    friction : coefficient μ of the flanks, None: they do not rub [1]
    requested : names of the variables that are made on request
    validity : assumed values and limits this scene touches, in words
    face : contact and wear over the face, which is the coupling then; None: flanks have no width
    """

    gears: gear_set.GearSet
    kinds: tuple[KindParts, ...]
    meshes: tuple[clock.Mesh, ...]
    edges: Array
    constant_error: Array
    coupling: Coupling
    phase: Array
    harmonics: int
    drive_flank: str
    pressure_factor: float
    wohler_slope: float | None
    friction: float | None
    requested: tuple[str, ...]
    validity: tuple[str, ...]
    face: FaceCoupling | None = None

    @property
    def vibration(self) -> Vibration | None:
        """The dynamics."""
        return self.coupling.vibration

    @property
    def speed(self) -> float:
        """Speed of the reference gear relative to the carrier [rad/s]."""
        return self.gears.speed

    def look(self, mesh: int, phases: Array) -> profile.Lookup:
        """Return the look-up of clock phases (n,) among the nodes of a mesh."""
        own = self.meshes[mesh]
        return clock.look(self.kinds[own.kind].analysis.grid, [own.lag], phases)


def build(scene: Scene, reach: Sequence[profile.Extension] | None = None) -> Parts:
    """Turn a scene into physics.

    Parameters
    ----------
    scene : the scene
    reach : see `build_analyses`

    Raises
    ------
    GearError
        When no such gears can exist or run.
    """
    gears = sets.build_set(scene)
    analyses = mesh.build_analyses(scene, gears, reach)
    meshes = mesh.build_meshes(scene, gears)
    edges = clock.breaks_on_clock([contact.grid for contact in analyses], meshes)
    turned = helix_of(scene, gears)
    kinds = tuple(_kind(scene, gears, kind, analysis, turned) for kind, analysis in enumerate(analyses))
    if face_keys(scene):
        face = _face(scene, gears, kinds, turned, meshes, edges)
        return _parts(scene, gears, kinds, meshes, edges, cast("Coupling", face), face)
    patches = [
        None
        if scene.wear is None
        else scene.wear.contact_patch.build(PatchSetting(mesh_kind.analysis, mesh_kind.path, mesh_kind.law))
        for mesh_kind in kinds
    ]
    vibration = build_vibration(scene, gears, analyses, meshes, edges)
    coupling = Coupling(
        kinds_of(analyses, [mesh_kind.law for mesh_kind in kinds], patches, meshes, edges),
        vibration,
        build_load(scene),
    )
    return _parts(scene, gears, kinds, meshes, edges, coupling)


def _face(
    scene: Scene,
    gears: gear_set.GearSet,
    sections: Sequence[KindParts],
    turned: Helix,
    meshes: tuple[clock.Mesh, ...],
    edges: Array,
) -> FaceCoupling:
    """Return contact, dynamics and wear over the face of a gear set."""
    kinds = []
    for number, (kind, own) in enumerate(zip(gears.kinds, sections, strict=True)):
        lags = {mesh: meshes[mesh].lag for mesh in clock.of_kind(meshes, number)}
        kinds.append(build_face(scene, kind, SectionOfKind(own.analysis, own.path, own.law, lags), turned))
    if scene.dynamics is None:
        return FaceCoupling(tuple(kinds))
    contacts = [kinds[mesh.kind].contact for mesh in meshes]
    stiffness = StiffnessOfMeshes(
        np.array([contact.mean_stiffness for contact in contacts]),
        np.array([contact.unworn.tangent.max() for contact in contacts]),
    )
    analyses = [own.analysis for own in sections]
    vibration = build_vibration(scene, gears, analyses, meshes, edges, stiffness)
    return FaceCoupling(tuple(kinds), vibration, build_load(scene).moving)


def _parts(
    scene: Scene,
    gears: gear_set.GearSet,
    kinds: tuple[KindParts, ...],
    meshes: tuple[clock.Mesh, ...],
    edges: Array,
    coupling: Coupling,
    face: FaceCoupling | None = None,
) -> Parts:
    """Return what is joined, with what the scene says besides."""
    count = scene.numerics.phase_points or PHASE_POINTS
    vibration = coupling.vibration
    bearings = vibration is not None and vibration.system.on_bearings
    loads = [mesh.largest_load(scene, kind) for kind in gears.kinds]
    told = helix_flags(gears, helix_of(scene, gears), loads, bearings=bearings)
    wear: Any = scene.wear
    return Parts(
        gears=gears,
        kinds=kinds,
        meshes=meshes,
        edges=edges,
        constant_error=_constant_error(scene, meshes),
        coupling=coupling,
        phase=np.arange(count) / count,
        harmonics=HARMONICS,
        drive_flank=scene.operation.drive_flank,
        pressure_factor=1.0 if wear is None else wear.pressure.factor,
        wohler_slope=None if wear is None else wear.wohler_slope,
        friction=_friction(scene),
        requested=scene.store.requested,
        validity=(*_validity(scene, gears, [kind.analysis for kind in kinds]), *told),
        face=face,
    )


def _friction(scene: Scene) -> float | None:
    given = scene.dynamics.friction if scene.dynamics is not None else None
    return None if given is None else given.coefficient


def _kind(
    scene: Scene, gears: gear_set.GearSet, kind: int, analysis: contact.ContactAnalysis, turned: Helix
) -> KindParts:
    gears_of_kind = gears.kinds[kind]
    path = build_path(
        gears_of_kind, analysis.grid.position, scene.mesh.of(gears_of_kind.section).face_load_factor
    )
    path = path._replace(equivalent_radius=path.equivalent_radius / turned.cosine)
    return KindParts(
        pair=gears_of_kind.pair,
        analysis=analysis,
        modification=sets.modifications(gears_of_kind.pair, analysis.grid.position),
        path=path,
        law=build_law(scene, gears_of_kind.pair, path),
        film=build_film(scene, gears_of_kind.pair),
    )


def _constant_error(scene: Scene, meshes: Sequence[clock.Mesh]) -> Array:
    """Return the once-per-revolution errors that are held [m]; others enter elsewhere."""
    return np.zeros(len(meshes)) if scene.errors is None else scene.errors.slow.constant(meshes)


def _validity(
    scene: Scene, gears: gear_set.GearSet, analyses: Sequence[contact.ContactAnalysis]
) -> tuple[str, ...]:
    """Return assumed values and limits of validity that the scene touches, one line each."""
    flags = [*presence.oversights(scene), *gears.assumed]
    for kind, analysis in zip(gears.kinds, analyses, strict=True):
        flags += contact_flags(scene, kind.section, kind.pair, analysis)
        stiffness = scene.mesh.of(kind.section).stiffness
        said = stiffness.flags(kind.pair, kind.key("stiffness"))
        flags += [flag for flag in said if flag not in flags]
    if any(build_film(scene, kind.pair) is not None for kind in gears.kinds):
        flags.append("roughness: R_q = 1.25 R_a assumed")
    if scene.wear is not None and scene.wear.coefficient is not None:
        flags.append(
            "wear coefficient: usually unknown within a decade; depth and 1/life are proportional to it"
        )
    wear = scene.wear
    given: dict[str, Any] = {n: None if wear is None else wear.initial_of(n) for n in gears.flanks}
    flags += [flag for name, flank in given.items() if flank is not None for flag in flank.flags(name)]
    flags += class_flags(scene, gears)
    if scene.lubricant is not None:
        flags += scene.lubricant.told
    materials = [scene.gears.material, *(gear.material for gear in scene.gears.gears().values())]
    flags += [line for material in materials if material is not None for line in material.told]
    return tuple(dict.fromkeys(flags))
