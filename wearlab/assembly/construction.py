"""A scene becomes physics, stage by stage."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from wearlab.assembly import errors, face, heat, mesh, planets, sets, thermal
from wearlab.assembly.coupling import joined_kinds
from wearlab.assembly.gear_model import GearModel, phase_count
from wearlab.assembly.kinds import build_kind
from wearlab.assembly.life import build_load
from wearlab.assembly.long_periods import require_bounded_transmission_error
from wearlab.assembly.memory import require_memory_for_states
from wearlab.assembly.on_clock import OnClock
from wearlab.assembly.vibration import build_vibration
from wearlab.life.coupled import MeshKind
from wearlab.life.coupling import Coupling
from wearlab.life.face_coupling import FaceCoupling, FaceKind
from wearlab.life.thermal_coupling import ThermalCoupling
from wearlab.mesh import clock, profile
from wearlab.mesh.contact import ContactAnalysis
from wearlab.mesh.gear_set import GearSet
from wearlab.mesh.onsets import rule_between_onsets
from wearlab.scene import Scene


def build(
    scene: Scene, reach: Sequence[profile.ExtensionInPitches] | None = None
) -> GearModel:
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
    if scene.thermal is not None:
        gears = heat.as_warm_as_surroundings(scene, gears)
    analyses = mesh.build_analyses(scene, gears.kinds, reach)
    meshes = errors.build_meshes(scene, gears)
    edges = clock.breaks_on_clock([contact.grid for contact in analyses], meshes)
    kinds = tuple(
        build_kind(scene, gears, kind, analysis)
        for kind, analysis in zip(gears.kinds, analyses, strict=True)
    )
    apart = planets.planets_differ(scene, gears)
    if apart:
        kinds = tuple(kinds[mesh.kind] for mesh in meshes)
        analyses = tuple(kind.analysis for kind in kinds)
        meshes = tuple(mesh._replace(kind=i) for i, mesh in enumerate(meshes))
        gears = gears.with_planets_apart()
    phases = phase_count(scene)
    depths = _depths_of(scene, gears, analyses)
    require_memory_for_states(scene, phases, len(meshes), depths)
    on_clock = OnClock(analyses, meshes, edges)
    joined = tuple(joined_kinds(scene, gears, kinds, on_clock))
    join: Any = FaceCoupling if scene.face_keys else Coupling
    vibration = None
    if scene.dynamics is not None:
        loaded = [kind for kind in range(len(kinds)) if gears.is_loaded(kind)]
        stiffness = np.array([unworn_stiffness(joined[kind]) for kind in loaded])
        moving = on_clock.of_kinds(loaded)
        vibration = build_vibration(scene, gears, moving, stiffness)
    if scene.thermal is not None:
        warming = thermal.build_warming(scene, gears, kinds[0], on_clock)
        join = partial(ThermalCoupling, warming=warming)
    coupling = join(joined, vibration, build_load(scene))
    if apart:
        system = None if vibration is None else vibration.system
        joint = planets.planets_apart(scene, gears, meshes, system)
        coupling = replace(coupling, planets=joint)
    model = GearModel(scene, gears, kinds, meshes, edges, coupling)
    require_bounded_transmission_error(scene, gears, meshes, phases)
    return model


def _depths_of(
    scene: Scene, gears: GearSet, analyses: Sequence[ContactAnalysis]
) -> int:
    """Return the number of wear depths of all flanks, slice by slice over a face."""
    depths = 0
    for kind, analysis in zip(gears.kinds, analyses, strict=True):
        slices = face.slices_of(scene, kind) if scene.face_keys else 1
        depths += 2 * slices * len(analysis.grid.position)
    return depths


def unworn_stiffness(kind: MeshKind | FaceKind) -> tuple[float, float]:
    """Return mean and largest stiffness of an unworn mesh over a period [N/m].

    Parameters
    ----------
    kind : contact and wear of the mesh
    """
    if isinstance(kind, FaceKind):
        return kind.contact.mean_stiffness, kind.contact.unworn.tangent.max()
    analysis = kind.analysis
    nodes, at_nodes = analysis.unworn
    rule = rule_between_onsets(analysis, nodes)
    stiffness = analysis.quasistatic(nodes, rule.where).tangent
    return float(rule.weight @ stiffness), at_nodes.tangent.max()
