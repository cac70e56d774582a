"""The physics of a scene: gears, meshes, dynamics and wear."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from wearlab.arrays import Array
from wearlab.assembly import contact, errors, mesh
from wearlab.assembly.kinds import MeshKindModel
from wearlab.assembly.long_periods import fluctuation
from wearlab.assembly.on_clock import OnClock
from wearlab.dynamics.steady.response import dashpot_of
from wearlab.life.coupled import WearState
from wearlab.life.coupling import Coupling
from wearlab.life.face_coupling import FaceCoupling
from wearlab.life.thermal_coupling import ThermalCoupling
from wearlab.life.vibration import Vibration
from wearlab.mesh import clock, force, gear_set, profile, stages
from wearlab.scene import Scene, summary

PHASE_POINTS = 256


def phase_count(scene: Scene) -> int:
    """Return the stored phases of a mesh period: as stated, or as usual.

    Parameters
    ----------
    scene : the scene
    """
    return scene.numerics.phase_points or PHASE_POINTS


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

    def coupling_like(self, reference: WearState) -> Coupling:
        """Return the coupling, as warm as a state of conditions that take turns.

        Parameters
        ----------
        reference : a state in this condition
        """
        heat = reference.heat
        if heat is None or not heat.is_shared:
            return self.coupling
        return self.coupling_held_as(reference)

    def coupling_held_as(self, reference: WearState) -> Coupling:
        """Return the coupling, held as warm as a state is.

        Parameters
        ----------
        reference : a state in this condition
        """
        coupling = self.coupling
        if reference.heat is None:
            return coupling
        assert isinstance(coupling, ThermalCoupling)
        return coupling.held_at(reference.heat.temperature)

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
        count = phase_count(self.scene)
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
        friction = self.scene.dynamics and self.scene.dynamics.friction
        return friction.coefficient if friction else None

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
        """Return the look-up of phases of the clock among the nodes of a mesh.

        Parameters
        ----------
        mesh : its number
        phases : (n,) of the clock [1]
        """
        on_clock = self.meshes[mesh]
        return clock.locate(
            self.kinds[on_clock.kind].analysis.grid, [on_clock.lag], phases
        )

    def forces(
        self,
        kinds: Sequence[Any],
        mesh: int,
        where: profile.Lookup,
        motions: force.Deflections,
    ) -> force.NormalForces:
        """Return the forces of a mesh.

        Parameters
        ----------
        kinds : flanks of each kind of mesh
        mesh : its number
        where : look-up among its nodes
        motions : of all meshes, (n_periods, n_mesh, n)
        """
        motion = force.Deflections(*(m[:, mesh] for m in motions))
        flanks = kinds[self.meshes[mesh].kind]
        dashpot = dashpot_of(self.moving.system, mesh)
        return force.flank_forces(flanks, where, motion, dashpot, self.moving.period)

    def with_steps(
        self, grid: stages.StageGrid, hunting: int, period: float
    ) -> Vibration:
        """Return the dynamics by other steps, or at another speed.

        Parameters
        ----------
        grid : steps of a mesh period
        hunting : mesh periods after which everything repeats
        period : duration of a mesh period [s]
        """
        return self.moving._replace(
            sampling=self.on_clock.sampled(self.scene, self.gears, grid),
            period=period,
            fluctuation=fluctuation(self.scene, grid, hunting, period),
        )

    @cached_property
    def validity(self) -> tuple[str, ...]:
        """Assumed values and limits of validity that concern the scene, one a line."""
        scene = self.scene
        loads = [mesh.largest_load(scene, kind) for kind in self.gears.kinds]
        bearings = self.vibration is not None and self.vibration.system.on_bearings
        flags = [
            *summary.oversights(scene),
            *self.gears.assumed,
            *self._flags_of_meshes(),
            *self._flags_of_wear(),
            *errors.class_flags(scene, self.gears),
            *self._flags_of_back_flanks(),
            *errors.pitch_flags(scene),
            *self._flags_of_materials(),
        ]
        return (
            *dict.fromkeys(flags),
            *contact.helix_flags(self.gears, loads, bearings=bearings),
        )

    def _flags_of_meshes(self) -> Iterator[str]:
        """Yield what a run must say of contact and stiffness."""
        for kind, model in zip(self.gears.kinds, self.kinds, strict=True):
            yield from contact.contact_flags(self.scene, kind, model.analysis)
            stiffness = self.scene.mesh.of(kind.section).stiffness
            yield from stiffness.flags(kind.pair, kind.key("stiffness"))

    def _flags_of_wear(self) -> Iterator[str]:
        """Yield what a run must say of film, coefficient and initial wear."""
        wear = self.scene.wear
        if any(model.film is not None for model in self.kinds):
            yield "roughness: R_q = 1.25 R_a assumed"
        if wear is not None and wear.coefficient is not None:
            yield (
                "wear coefficient: usually unknown within a decade; depth and 1/life "
                "are proportional to it"
            )
        for name in self.gears.flanks:
            initial = self.scene.initial_of(name)
            if initial is not None:
                yield from initial.flags(name)

    def _flags_of_back_flanks(self) -> Iterator[str]:
        """Yield how back flanks are taken that reversed torque loads."""
        if self.scene.operation.loaded_side is None:
            return
        yield (
            "back flanks: loaded as the front ones under a torque of that size, their "
            "mirror images; both thin the teeth"
            + (" but for those over the face" if self.face is not None else "")
        )
        if self.vibration is not None:
            yield (
                "back flanks: wear of the flanks behind widens the backlash of the "
                "motion by its mean over a mesh period; they vibrate as if the sense "
                "of rotation were reversed, too"
            )

    def _flags_of_materials(self) -> Iterator[str]:
        """Yield what catalogues say of oil and materials."""
        scene = self.scene
        yield from () if scene.lubricant is None else scene.lubricant.sources
        yield from scene.gears.material.sources
        for gear in scene.gears.gears().values():
            yield from () if gear.material is None else gear.material.sources
