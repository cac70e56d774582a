"""``[wear]`` and ``[lubricant]`` → wear law, film, load, limits, snapshots and the step over cycles."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np

from wearlab import compiled, slots
from wearlab.arrays import Array
from wearlab.assembly import mesh, sets, vibration
from wearlab.gears.gear import GearPair
from wearlab.life import coupled, limits, loads
from wearlab.life.coupling import FaceKind
from wearlab.life.loads.instant import InstantLoad
from wearlab.life.loads.static import StaticLoad
from wearlab.mesh import clock, contact, gear_set
from wearlab.mesh.face.contact import FaceContact
from wearlab.scene import Scene
from wearlab.wear import coefficients, films
from wearlab.wear.law import NAN, FlankLaw, PreparedLaw, WearLaw, prepare
from wearlab.wear.patch import PatchSetting
from wearlab.wear.path import WearPath, contact_half_width, wear_path
from wearlab.wear.setting import Setting


class MeshKindModel(NamedTuple):
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
    film: films.Film | None


def build_kind(
    scene: Scene,
    gears: gear_set.GearSet,
    kind: gear_set.PairOfSet,
    analysis: contact.ContactAnalysis,
) -> MeshKindModel:
    """Return the physics of one kind of mesh; a helix flattens flanks.

    The face load factor K_Hβ puts the load on as much less of the face: wear is that of
    its busiest part.
    """
    pair = kind.pair
    position = analysis.grid.position
    width = pair.face_width / scene.mesh.of(kind.section).face_load_factor
    path = wear_path(pair, position, kind.speed, kind.passes, width)
    path = path._replace(equivalent_radius=path.equivalent_radius / gears.helix.cosine)
    law = build_law(scene, pair, path)
    film = build_film(scene, pair)
    return MeshKindModel(
        pair, analysis, sets.modifications(pair, position), path, law, film
    )


@dataclass(frozen=True)
class FacePatchSetting(PatchSetting):
    """What a contact patch may know of flanks with a width: forces and law slice after slice.

    Parameters
    ----------
    face : contact over the face
    """

    face: FaceContact

    @cached_property
    def line_load(self) -> Array:
        """Static load per width of unworn flanks when they touch at the node, (n_face, n) [N/m]."""
        return self.face.grid.at_nodes(self.face.unworn.load)

    @cached_property
    def static(self) -> Array:
        """That load as a force on the whole face, (n_face n,) [N]."""
        return self.line_load.ravel() * self.path.face_width

    @cached_property
    def half_width(self) -> Array:
        """Hertz's half width of every slice, (n_face, n) [m]."""
        return contact_half_width(
            self.reference.reshape(self.line_load.shape), self.path
        )


def joined_kinds(
    scene: Scene,
    gears: gear_set.GearSet,
    kinds: Sequence[MeshKindModel],
    on_clock: vibration.OnClock,
) -> Iterator[coupled.MeshKind | FaceKind]:
    """Yield contact and wear of each kind of mesh, over the face where flanks have a width."""
    meshes = on_clock.meshes
    for number, (kind, own) in enumerate(zip(gears.kinds, kinds, strict=True)):
        mine = clock.of_kind(meshes, number)
        law = own.law
        setting = PatchSetting(own.analysis, own.path, law)
        if scene.face_keys:
            face = mesh.build_face_contact(scene, kind, own.analysis, gears.helix)
            law = build_law(scene, kind.pair, repeated(own.path, face.grid.shape[0]))
            setting = FacePatchSetting(own.analysis, own.path, law, face)
        patch = None if scene.wear is None else scene.wear.contact_patch.build(setting)
        if scene.face_keys:
            yield FaceKind(face, law, patch, {at: meshes[at].lag for at in mine})
            continue
        grid = own.analysis.grid
        where = own.analysis.at_nodes
        when = tuple(
            clock.instants_of(grid, meshes[at].lag, where, on_clock.edges)
            for at in mine
        )
        yield coupled.MeshKind(own.analysis, law, patch, mine, when)


def repeated(path: WearPath, slices: int) -> WearPath:
    """Return the path of a section as that of all slices, one after another."""
    along = (
        "curvature",
        "surface_velocity",
        "specific_sliding",
        "arc_weight",
        "arc",
        "pressure_angle",
    )
    wide: dict[str, Any] = {
        name: np.tile(getattr(path, name), (1, slices)) for name in along
    }
    return path._replace(
        equivalent_radius=np.tile(path.equivalent_radius, slices), **wide
    )


def build_film(scene: Scene, pair: GearPair) -> films.Film | None:
    """Return the oil between the flanks, when the scene names an oil and both roughnesses."""
    roughness = _roughness(scene, pair)
    if scene.lubricant is None or roughness is None:
        return None
    oil = scene.lubricant
    assert (
        oil.viscosity is not None and oil.pressure_viscosity is not None
    )  # given, or of its grade
    return films.Film(
        oil.viscosity, oil.pressure_viscosity, films.composite_rq(roughness)
    )


def _roughness(scene: Scene, pair: GearPair) -> tuple[float, float] | None:
    first, second = (
        getattr(scene.gears, gear.name).roughness_ra for gear in pair.gears
    )
    return None if first is None or second is None else (first, second)


def build_law(scene: Scene, pair: GearPair, path: WearPath) -> PreparedLaw | None:
    """Return the wear law on the path, None when nothing wears.

    Film thickness over roughness is by the first film that a flank has, else the
    standard.
    """
    wear = scene.wear
    roughness = _roughness(scene, pair)
    lambda_ratio = None
    if wear is None or wear.coefficient is None:
        return None
    each = [wear.coefficient_of(gear.name) for gear in pair.gears]
    given = [getattr(scene.gears, gear.name) for gear in pair.gears]
    hardness = [(own.material or scene.gears.material).hardness for own in given]
    warm = getattr(scene.lubricant, "temperature", None)
    settings = [
        Setting(path, gear, scene.lubricant, roughness, hardness[gear], warm)
        for gear in (0, 1)
    ]
    first, second = (
        _flank(wear.law, *flank) for flank in zip(each, settings, strict=True)
    )
    if scene.lubricant is not None and roughness is not None:
        film = next(
            filter(None, (own.film_model for own in each)), coefficients.standard_film()
        )
        thickness = film.thickness(settings[0])
        lambda_ratio = thickness._replace(
            scale=thickness.scale / films.composite_rq(roughness)
        )
    return prepare(
        WearLaw((first, second), lambda_ratio, wear.pressure.factor, wear.projection),
        path,
    )


def _flank(law: Any, given: coefficients.CoefficientModel, where: Setting) -> FlankLaw:
    film = given.film_model
    return FlankLaw(
        coefficient=of_user(given, given.build(where)),
        factor=given.factor,
        film=None if film is None else of_user(film, film.build(where)),
        rate=of_user(law, law.build(where)),
        hardness=NAN if where.hardness is None else where.hardness,
        temperature=NAN if where.temperature is None else where.temperature,
    )


def of_user(variant: slots.Variant, built: Any) -> Any:
    """Return what a variant built; a function of a user's compiles where it can."""
    if variant.origin is None or not isinstance(built, FunctionType):
        return built
    return compiled.compiled_if_possible(
        built, f"{variant.origin.file}: {variant.chosen!r}"
    )


def build_load(scene: Scene) -> loads.LoadModel:
    """Return which force wears the flanks, or would."""
    if scene.wear is None:
        return StaticLoad() if scene.dynamics is None else InstantLoad()
    return scene.wear.load.build(scene.wear.wohler_slope)


def flank_entries(
    flank: str | None, gears: gear_set.GearSet, coupling: coupled.Coupled
) -> slice:
    """Return where a flank's depths lie in the flat state.

    All of them when no flank is named.
    """
    return slice(None) if flank is None else coupling.entries(*gears.flank(flank))


def build_limits(
    scene: Scene,
    gears: gear_set.GearSet,
    coupling: coupled.Coupled,
    speed: float | None = None,
    passed: tuple[float, float] = (0.0, 0.0),
) -> limits.Limits:
    """Return where the life ends, in cycles of the reference gear and depth.

    Nowhere if nothing is said.

    Parameters
    ----------
    scene, gears, coupling : the scene and its physics
    speed : mean speed of the reference gear over time, that of ``gears`` where left out
        [rad/s]
    passed : cycles and operating time [s] that lie behind
    """
    until: Any = scene.wear.until if scene.wear else None
    if until is None:
        return limits.Limits(None, None, slice(None))
    turns = (
        until.cycles,
        until.mesh_cycles and until.mesh_cycles / gears.reference_teeth,
    )
    cycles = [count - passed[0] for count in turns if count is not None]
    if until.hours is not None:
        turned = (gears.speed if speed is None else speed) / (2 * np.pi)
        cycles.append((3600.0 * until.hours - passed[1]) * turned)
    return limits.Limits(
        min(cycles, default=None),
        until.depth,
        flank_entries(until.flank, gears, coupling),
    )


def build_snapshots(
    scene: Scene, gears: gear_set.GearSet, coupling: coupled.Coupled
) -> limits.Snapshots:
    """Return the states asked for on the way."""
    asked: Any = scene.wear.snapshots if scene.wear else None
    if asked is None:
        return limits.Snapshots()
    cycles = tuple(asked.cycles or ()) + tuple(
        n / gears.reference_teeth for n in asked.mesh_cycles or ()
    )
    return limits.Snapshots(
        cycles, tuple(asked.depth or ()), flank_entries(asked.flank, gears, coupling)
    )
