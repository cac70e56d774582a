"""A scene becomes physics: only here do sections of a campaign file meet gears, mesh, dynamics and wear."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.assembly import contact, mesh, sets
from wearlab.assembly.vibration import OnClock, build_vibration, fluctuation
from wearlab.assembly.wear import MeshKindModel, build_kind, build_load, joined_kinds
from wearlab.dynamics.modes import Modes, critical_speeds, mode_kinds, modes
from wearlab.dynamics.steady.response import dashpot_of
from wearlab.life.coupled import MeshKind, Vibration
from wearlab.life.coupling import Coupling, FaceCoupling, FaceKind
from wearlab.mesh import clock, force, gear_set, profile, stages
from wearlab.scene import Scene, summary

PHASE_POINTS = 256


@dataclass(frozen=True)
class GearModel:
    """The physics of a scene; what the scene leaves out is ``None``.

    Parameters
    ----------
    scene : what was asked for
    gears : the gear set in operation
    kinds : the physics of each kind of mesh
    meshes : the meshes, their lags and errors
    edges : breaks of the clock
    coupling : contact, dynamics and wear joined; over the face, where flanks have a
        width
    """

    harmonics: ClassVar[int] = 10

    scene: Scene
    gears: gear_set.GearSet
    kinds: tuple[MeshKindModel, ...]
    meshes: tuple[clock.Mesh, ...]
    edges: Array
    coupling: Coupling

    @property
    def face(self) -> FaceCoupling | None:
        """Contact and wear over the face, which is the coupling then.

        None: flanks have no width.
        """
        coupling: Any = self.coupling
        return coupling if isinstance(coupling, FaceCoupling) else None

    @property
    def vibration(self) -> Vibration | None:
        """The dynamics."""
        return self.coupling.vibration

    @property
    def moving(self) -> Vibration:
        """The dynamics of what has some."""
        assert self.coupling.vibration is not None
        return self.coupling.vibration

    @cached_property
    def phase(self) -> Array:
        """Stored phases, (n_phases,) [1]."""
        count = self.scene.numerics.phase_points or PHASE_POINTS
        return np.arange(count) / count

    @cached_property
    def constant_error(self) -> Array:
        """Once-per-revolution errors that are held, (n_mesh,) [m].

        Others enter elsewhere.
        """
        errors = self.scene.errors
        return (
            np.zeros(len(self.meshes))
            if errors is None
            else errors.slow.constant(self.meshes)
        )

    @property
    def friction(self) -> float | None:
        """Coefficient μ of the flanks, None: they do not rub [1]."""
        given = self.scene.dynamics and self.scene.dynamics.friction
        return given.coefficient if given else None

    @property
    def pressure_factor(self) -> float:
        """Of the stored pressure to the mean of Hertz's ellipse [1]."""
        return 1.0 if self.scene.wear is None else self.scene.wear.pressure.factor

    @property
    def wohler_slope(self) -> float | None:
        """Exponent of the equivalent load, None: not stored [1]."""
        return None if self.scene.wear is None else self.scene.wear.wohler_slope

    @property
    def on_clock(self) -> OnClock:
        """Contact and meshes on the clock."""
        return OnClock([kind.analysis for kind in self.kinds], self.meshes, self.edges)

    def locate(self, mesh: int, phases: Array) -> profile.Lookup:
        """Return the look-up of clock phases (n,) among the nodes of a mesh."""
        own = self.meshes[mesh]
        return clock.look(self.kinds[own.kind].analysis.grid, [own.lag], phases)

    def forces(
        self,
        kinds: Sequence[Any],
        mesh: int,
        where: profile.Lookup,
        motions: force.Deflections,
    ) -> force.NormalForces:
        """Return the forces of a mesh of the flanks ``kinds``.

        Motions of all, (n_periods, n_mesh, n).
        """
        own = force.Deflections(*(m[:, mesh] for m in motions))
        flanks = kinds[self.meshes[mesh].kind]
        dashpot = dashpot_of(self.moving.system, mesh)
        return force.flank_forces(flanks, where, own, dashpot, self.moving.period)

    def with_steps(
        self, grid: stages.StageGrid, hunting: int, period: float
    ) -> Vibration:
        """Return the dynamics by these steps of a mesh period that lasts so long [s]."""
        return self.moving._replace(
            sampling=self.on_clock.sampled(self.scene, self.gears, grid),
            period=period,
            fluctuation=fluctuation(self.scene, grid, hunting, period),
        )

    @cached_property
    def validity(self) -> tuple[str, ...]:
        """Assumed values and limits of validity that the scene touches, one line each."""
        scene = self.scene
        gears = self.gears
        wear = self.scene.wear
        flags = [*summary.oversights(scene), *gears.assumed]
        for kind, own in zip(gears.kinds, self.kinds, strict=True):
            flags += contact.contact_flags(scene, kind, own.analysis)
            flags += scene.mesh.of(kind.section).stiffness.flags(
                kind.pair, kind.key("stiffness")
            )
        if any(own.film is not None for own in self.kinds):
            flags.append("roughness: R_q = 1.25 R_a assumed")
        if wear is not None and wear.coefficient is not None:
            flags.append(
                "wear coefficient: usually unknown within a decade; depth and 1/life "
                "are proportional to it"
            )
        initial = {name: scene.initial_of(name) for name in gears.flanks}
        flags += [
            flag
            for name, flank in initial.items()
            if flank is not None
            for flag in flank.flags(name)
        ]
        flags += mesh.class_flags(scene, gears)
        materials = [
            scene.gears.material,
            *(gear.material for gear in scene.gears.gears().values()),
        ]
        for given in (scene.lubricant, *materials):
            flags += [] if given is None else given.told
        bearings = self.vibration is not None and self.vibration.system.on_bearings
        loads = [mesh.largest_load(scene, kind) for kind in gears.kinds]
        return (
            *dict.fromkeys(flags),
            *contact.helix_flags(gears, loads, bearings=bearings),
        )


def build(scene: Scene, reach: Sequence[profile.Extension] | None = None) -> GearModel:
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
    analyses = mesh.build_analyses(scene, gears.kinds, reach)
    meshes = mesh.build_meshes(scene, gears)
    edges = clock.breaks_on_clock([contact.grid for contact in analyses], meshes)
    kinds = tuple(
        build_kind(scene, gears, *own)
        for own in zip(gears.kinds, analyses, strict=True)
    )
    on_clock = OnClock(analyses, meshes, edges)
    joined = tuple(joined_kinds(scene, gears, kinds, on_clock))
    join: Any = FaceCoupling if scene.face_keys else Coupling
    vibration = None
    if scene.dynamics is not None:
        stiffness = np.array([unworn_stiffness(kind) for kind in joined])
        vibration = build_vibration(scene, gears, on_clock, stiffness)
    return GearModel(
        scene, gears, kinds, meshes, edges, join(joined, vibration, build_load(scene))
    )


def unworn_stiffness(kind: MeshKind | FaceKind) -> tuple[float, float]:
    """Return mean and largest stiffness of an unworn mesh over a period [N/m]."""
    if isinstance(kind, FaceKind):
        return kind.contact.mean_stiffness, kind.contact.unworn.tangent.max()
    tangent = kind.analysis.unworn[1].tangent
    (_, weight) = kind.analysis.grid.phase_nodes
    return float(weight @ tangent), tangent.max()


class SceneModes(NamedTuple):
    """The modes of a scene.

    Parameters
    ----------
    modes : natural frequencies, shapes and participations
    critical_speed : (orders, n_modes) speeds of the input member at which harmonic 1, 2
        … of the mesh meets a mode [rad/s]
    coordinates : names of the coordinates
    kinds : what moves in each mode of a planetary set with translations, None for other
        models
    """

    modes: Modes
    critical_speed: Array
    coordinates: tuple[str, ...]
    kinds: tuple[str, ...] | None


def build_modes(parts: GearModel, orders: int = 3) -> SceneModes:
    """Return the modes of a scene with dynamics, with the mean stiffness of its unworn mesh."""
    system = parts.moving.system
    mean = [unworn_stiffness(kind)[0] for kind in parts.coupling.kinds]
    system_modes = modes(system, np.array([mean[mesh.kind] for mesh in parts.meshes]))
    return SceneModes(
        system_modes,
        critical_speeds(system_modes.frequency, parts.gears.input_teeth, orders),
        system.coordinates,
        mode_kinds(system, system_modes)
        if (~system.central & ~system.turns).any()
        else None,
    )
