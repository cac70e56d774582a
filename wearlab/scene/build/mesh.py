"""``[mesh]`` and ``[errors]`` → contact analysis, excitation and prescribed errors."""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from wearlab.gears.gear import GearPair
from wearlab.mesh import clock, gear_set
from wearlab.mesh.contact import ContactAnalysis
from wearlab.mesh.contacts import ContactModel
from wearlab.mesh.face.grid import lattice, nodes_per_pitch
from wearlab.mesh.profile import NO_EXTENSION, Extension, profile_grid
from wearlab.mesh.stiffnesses import StiffnessModel
from wearlab.scene import Scene
from wearlab.scene.build.contact import build_errors, extension_wanted, flanks_of
from wearlab.scene.build.sets import build_set, kinks, modifications
from wearlab.scene.face import face_keys

NODES_AT_DEFAULT, NODES_OF_A_FACE, NODES_IN_MOTION = 201, 101, 121
"""Nodes on the path at the default tolerance: of flanks without a width, with one, and of helical gears that
vibrate, whose lines enter little by little."""
DEFAULT_TOLERANCE = 1e-3
MOST_MORE_POINTS = 60
KEPT_ANALYSES = 8
"""Contact analyses that a process remembers: of the scene it is at, and of one that differs a little."""


def build_analyses(
    scene: Scene, gears: gear_set.GearSet, reach: Sequence[Extension] | None = None
) -> tuple[ContactAnalysis, ...]:
    """Return the contact analysis of every kind of mesh at the static load of the scene.

    Parameters
    ----------
    scene, gears : the scene and its gear set
    reach : how far beyond A and E the nodes of every kind reach, in base pitches; None: as far as their load
        asks for
    """
    points, even = profile_points(scene), lattice_nodes(scene, [kind.pair for kind in gears.kinds])
    if reach is None:
        reach = [_reach(scene, kind, points, even) for kind in gears.kinds]
    else:
        pitches = [kind.pair.base_pitch for kind in gears.kinds]
        reach = [Extension(p * far.approach, p * far.recess) for p, far in zip(pitches, reach, strict=True)]
    matched = [points] * len(gears.kinds)
    if even is None:
        matched = matched_points([kind.pair for kind in gears.kinds], points, reach)
    return tuple(
        _analysis(scene, kind, n, far, even) for kind, n, far in zip(gears.kinds, matched, reach, strict=True)
    )


def lattice_nodes(scene: Scene, pairs: Sequence[GearPair], points: int | None = None) -> int | None:
    """Return how many nodes of helical gears lie on a base pitch of every mesh, None of spur gears."""
    if not scene.gears.helix_angle:
        return None
    return nodes_per_pitch([pair.contact_ratio for pair in pairs], points or profile_points(scene))


def matched_points(pairs: Sequence[GearPair], points: int, reach: Sequence[Extension]) -> list[int]:
    """Return the points to ask for on each path so that all have equally many nodes, as near as can be."""
    if len(pairs) == 1:
        return [points]
    matched: list[dict[int, int]] = [{} for _ in pairs]
    for asked in range(points, points + MOST_MORE_POINTS):
        for pair, far, nodes in zip(pairs, reach, matched, strict=True):
            grid = profile_grid(pair, asked, kinks(pair), extension=far)
            nodes.setdefault(len(grid.position), asked)
        if common := set(matched[0]).intersection(*matched[1:]):
            return [nodes[min(common)] for nodes in matched]
    return [points] * len(pairs)


def build_analysis(scene: Scene, kind: gear_set.PairOfSet, points: int | None = None) -> ContactAnalysis:
    """Return the contact analysis of one kind of mesh at its static load, on as many nodes as asked for."""
    points = points or profile_points(scene)
    even = lattice_nodes(scene, [kind.pair], points)
    return _analysis(scene, kind, points, _reach(scene, kind, points, even), even)


def _reach(scene: Scene, kind: gear_set.PairOfSet, points: int, even: int | None) -> Extension:
    """Return how far beyond A and E the nodes of a mesh reach."""
    if not scene.mesh.of(kind.section).extended_contact:
        return NO_EXTENSION
    asked = scene.mesh.of(kind.section)
    load = largest_load(scene, kind)
    options = ContactOptions(asked.stiffness, asked.contact, True, even=even)
    plain = contact_analysis(kind.pair, options, points, NO_EXTENSION, load)
    return extension_wanted(kind.pair, plain, vibrates=scene.dynamics is not None)


def largest_load(scene: Scene, kind: gear_set.PairOfSet) -> float:
    """Return the static normal force of a mesh in the heaviest of conditions that share its flanks [N]."""
    here, most = scene.operation.torque, scene.operation.largest_torque
    if most == here:
        return kind.load
    if here > 0.0:
        return kind.load * most / here
    heaviest = scene.model_copy(update={"operation": scene.operation.alone(most, scene.operation.speed)})
    return next(kinds.load for kinds in build_set(heaviest).kinds if kinds.section == kind.section)


def _analysis(
    scene: Scene, kind: gear_set.PairOfSet, points: int, extension: Extension, even: int | None
) -> ContactAnalysis:
    asked = scene.mesh.of(kind.section)
    initial = [None if scene.wear is None else scene.wear.initial_of(flank) for flank in kind.flanks]
    backs = tuple(wear if wear is not None and wear.thins_teeth else None for wear in initial)
    options = ContactOptions(asked.stiffness, asked.contact, asked.extended_contact, backs, even)
    return contact_analysis(kind.pair, options, points, extension, kind.load)


class ContactOptions(NamedTuple):
    """How teeth give way and where they touch: what a contact analysis is told of a scene.

    Parameters
    ----------
    stiffness, contact : the models
    extended : whether tip corners touch beyond A and E
    backs : initial wear that the back flanks of (driving, driven) carry too, None without
    even : nodes to a base pitch where they lie equally far apart, as slices of helical gears need them
    """

    stiffness: StiffnessModel
    contact: ContactModel
    extended: bool
    backs: tuple[Any, ...] = (None, None)
    even: int | None = None


@lru_cache(KEPT_ANALYSES)
def contact_analysis(
    pair: GearPair, options: ContactOptions, points: int, extension: Extension, load: float
) -> ContactAnalysis:
    """Return the contact analysis of a pair: the same one as long as nothing it is made of changes.

    Parameters
    ----------
    pair : the gears
    options : stiffness and contact
    points : nodes asked for on the path
    extension : how far beyond A and E nodes reach
    load : static normal force [N]
    """
    return replace(_unloaded(pair, options, points, extension), load=load)


@lru_cache(KEPT_ANALYSES)
def _unloaded(pair: GearPair, options: ContactOptions, points: int, extension: Extension) -> ContactAnalysis:
    stiffness, contact = options.stiffness, options.contact
    if options.even is not None:
        grid = lattice(pair, options.even, extension)
    else:
        grid = profile_grid(pair, points, kinks(pair), stiffness.jumps(pair), extension)
    teeth = stiffness.build(pair, grid)
    if any(back is not None for back in options.backs):
        position = grid.position
        depth = [
            np.zeros_like(position) if back is None else back.at_nodes(pair, gear, position)
            for gear, back in enumerate(options.backs)
        ]
        teeth = teeth.with_worn_backs(grid.beyond(np.stack(depth)))
    return ContactAnalysis(
        grid,
        teeth,
        modifications(pair, grid.position).sum(axis=0),
        0.0,
        contact.engagement_gap(pair),
        contact.build(flanks_of(pair, grid), options.extended),
    )


def profile_points(scene: Scene) -> int:
    """Return the nodes on the path: as asked, or for a third-order error from the tolerance."""
    if scene.numerics.profile_points is not None:
        return int(scene.numerics.profile_points)
    ratio = DEFAULT_TOLERANCE / scene.numerics.tolerance
    if face_keys(scene):
        moving = NODES_IN_MOTION if scene.gears.helix_angle else NODES_AT_DEFAULT
        nodes = NODES_OF_A_FACE if scene.dynamics is None else moving
        return int(np.clip(nodes * ratio ** (1 / 3), 41, 401))
    return int(np.clip(NODES_AT_DEFAULT * ratio ** (1 / 3), 81, 1601))


def build_meshes(scene: Scene, gears: gear_set.GearSet) -> tuple[clock.Mesh, ...]:
    """Return the meshes on their clock, each with one realisation of its errors."""
    errors = build_errors(scene, gears)
    return tuple(
        clock.Mesh(kind, float(lag), error)
        for kind, lag, error in zip(gears.mesh_kinds, gears.mesh_lags, errors, strict=True)
    )
