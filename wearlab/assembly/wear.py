"""``[wear]`` and ``[lubricant]`` → wear law, film, load, limits and snapshots."""

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
from wearlab.life.face_coupling import FaceKind
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
    """What a contact patch may know of flanks with a width: forces and law by slice.

    Parameters
    ----------
    face : contact over the face
    """

    face: FaceContact

    @cached_property
    def line_load(self) -> Array:
        """Static load per width of unworn flanks at each node, (n_face, n) [N/m]."""
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
            yield _mesh_kind(scene, model, on_clock, of_kind)


def _face_kind(
    scene: Scene,
    gears: gear_set.GearSet,
    kind: gear_set.PairOfSet,
    model: MeshKindModel,
    on_clock: vibration.OnClock,
    of_kind: np.ndarray[Any, np.dtype[np.int64]],
) -> FaceKind:
    """Return contact and wear over the face of one kind of mesh."""
    face = mesh.build_face_contact(scene, kind, model.analysis, gears.helix)
    law = build_law(scene, kind.pair, repeated(model.path, face.grid.shape[0]))
    setting = FacePatchSetting(model.analysis, model.path, law, face)
    lags = {number: on_clock.meshes[number].lag for number in of_kind}
    return FaceKind(face, law, _patch(scene, setting), lags)


def _mesh_kind(
    scene: Scene,
    model: MeshKindModel,
    on_clock: vibration.OnClock,
    of_kind: np.ndarray[Any, np.dtype[np.int64]],
) -> coupled.MeshKind:
    """Return contact and wear of one kind of mesh whose flanks have no width."""
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
        model.analysis, model.law, _patch(scene, setting), of_kind, instants
    )


def _patch(scene: Scene, setting: PatchSetting) -> Any:
    """Return the contact patch, None where nothing wears."""
    return None if scene.wear is None else scene.wear.contact_patch.build(setting)


def repeated(path: WearPath, slices: int) -> WearPath:
    """Return the path of a section as that of all slices, one after another.

    Parameters
    ----------
    path : of the transverse section
    slices : how many there are
    """
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
    """Return the oil between the flanks, None without an oil or both roughnesses.

    Parameters
    ----------
    scene : the scene
    pair : the gears
    """
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
    """Return the mean roughness of (driving, driven) [m], None where one is unknown."""
    first, second = (
        getattr(scene.gears, gear.name).roughness_ra for gear in pair.gears
    )
    return None if first is None or second is None else (first, second)


def build_law(scene: Scene, pair: GearPair, path: WearPath) -> PreparedLaw | None:
    """Return the wear law on the path, None when nothing wears.

    Film thickness over roughness is by the first film that a flank has, else the
    standard.

    Parameters
    ----------
    scene : the scene
    pair : the gears
    path : velocities and radii along the path of contact
    """
    wear = scene.wear
    if wear is None or wear.coefficient is None:
        return None
    coefficients_of = [wear.coefficient_of(gear.name) for gear in pair.gears]
    settings = _settings(scene, pair, path)
    first, second = (
        _flank_law(wear.law, coefficient, setting)
        for coefficient, setting in zip(coefficients_of, settings, strict=True)
    )
    law = WearLaw(
        (first, second),
        _lambda_ratio(scene, pair, coefficients_of, settings[0]),
        wear.pressure.factor,
        wear.projection,
    )
    return prepare(law, path)


def _settings(scene: Scene, pair: GearPair, path: WearPath) -> list[Setting]:
    """Return what the wear of (driving, driven) may depend on."""
    roughness = _roughness(scene, pair)
    temperature = getattr(scene.lubricant, "temperature", None)
    settings = []
    for number, gear in enumerate(pair.gears):
        material = getattr(scene.gears, gear.name).material or scene.gears.material
        settings.append(
            Setting(
                path, number, scene.lubricant, roughness, material.hardness, temperature
            )
        )
    return settings


def _lambda_ratio(
    scene: Scene,
    pair: GearPair,
    coefficients_of: Sequence[coefficients.CoefficientModel],
    setting: Setting,
) -> Any:
    """Return film thickness over roughness, None without oil or without roughnesses."""
    roughness = _roughness(scene, pair)
    if scene.lubricant is None or roughness is None:
        return None
    films_of = [coefficient.film_model for coefficient in coefficients_of]
    film = next(filter(None, films_of), coefficients.standard_film())
    thickness = film.thickness(setting)
    return thickness._replace(scale=thickness.scale / films.composite_rq(roughness))


def _flank_law(
    law: Any, coefficient: coefficients.CoefficientModel, setting: Setting
) -> FlankLaw:
    """Return the law of one flank."""
    film = coefficient.film_model
    return FlankLaw(
        coefficient=of_user(coefficient, coefficient.build(setting)),
        factor=coefficient.factor,
        film=None if film is None else of_user(film, film.build(setting)),
        rate=of_user(law, law.build(setting)),
        hardness=NAN if setting.hardness is None else setting.hardness,
        temperature=NAN if setting.temperature is None else setting.temperature,
    )


def of_user(variant: slots.Variant, built: Any) -> Any:
    """Return what a variant built; a function of a user's compiles where it can.

    Parameters
    ----------
    variant : the variant
    built : what its ``build`` returned
    """
    if variant.origin is None or not isinstance(built, FunctionType):
        return built
    return compiled.compiled_if_possible(
        built, f"{variant.origin.file}: {variant.chosen!r}"
    )


def build_load(scene: Scene) -> loads.LoadModel:
    """Return which force wears the flanks, or would.

    Parameters
    ----------
    scene : the scene
    """
    if scene.wear is None:
        return StaticLoad() if scene.dynamics is None else InstantLoad()
    return scene.wear.load.build(scene.wear.wohler_slope)


def flank_entries(
    flank: str | None, gears: gear_set.GearSet, coupling: coupled.Coupled
) -> slice:
    """Return where a flank's depths lie in the flat state.

    All of them when no flank is named.

    Parameters
    ----------
    flank : its name, None of all
    gears, coupling : the gear set and its physics
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
    """Return the states that are stored on the way.

    Parameters
    ----------
    scene, gears, coupling : the scene and its physics
    """
    snapshots: Any = scene.wear.snapshots if scene.wear else None
    if snapshots is None:
        return limits.Snapshots()
    cycles = tuple(snapshots.cycles or ()) + tuple(
        n / gears.reference_teeth for n in snapshots.mesh_cycles or ()
    )
    return limits.Snapshots(
        cycles,
        tuple(snapshots.depth or ()),
        flank_entries(snapshots.flank, gears, coupling),
    )
