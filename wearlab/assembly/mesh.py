"""``[mesh]`` → contact analyses: nodes, extended contact, stiffness of teeth."""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.assembly import heat, leads, sets
from wearlab.gears import gear
from wearlab.mesh import (
    contact,
    contacts,
    gear_set,
    profile,
    stiffnesses,
)
from wearlab.mesh.exact.gaps import WornFlanks, unworn_extension
from wearlab.mesh.face import grid as slicing
from wearlab.scene import Scene
from wearlab.wear.projections import ProjectionModel

LARGEST_STATIC = 2.0
"""Times its static deflection that a quasi-static mesh may deflect, worn or with
errors."""
LARGEST_DYNAMIC = 4.0
"""Times its static deflection that a vibrating mesh may deflect."""
STEP = 0.02
"""Base pitches in which extended contact grows, so that grids of different density
reach equally far."""
NODES_AT_DEFAULT = 201
"""Nodes on the path at the default tolerance, of flanks without a width."""
NODES_OF_A_FACE = 101
"""The same of flanks with a width."""
NODES_IN_MOTION = 121
"""The same of helical gears that vibrate, whose lines enter little by little."""
DEFAULT_TOLERANCE = 1e-3
MAX_ADDED_POINTS = 60
KEPT_ANALYSES = 8
"""Contact analyses that a process remembers: of the scene it is at, and of one that
differs a little."""


def build_analyses(
    scene: Scene,
    kinds: Sequence[gear_set.PairOfSet],
    reach: Sequence[profile.ExtensionInPitches] | None = None,
) -> tuple[contact.ContactAnalysis, ...]:
    """Return the contact analysis of kinds of mesh of one set, each at its static load.

    Parameters
    ----------
    scene, kinds : the scene and the kinds of mesh of its gear set
    reach : how far beyond A and E the nodes of every kind reach; None: as far as their
        load asks for
    """
    if scene.operation.loaded_side is not None:
        # the same teeth, of which back flanks touch as front ones do
        return build_analyses(scene.in_front(), kinds[:1], reach) * len(kinds)
    points = profile_points(scene)
    pairs = [kind.pair for kind in kinds]
    even = None
    if scene.gears.helix_angle:
        even = slicing.nodes_per_pitch([pair.contact_ratio for pair in pairs], points)
    options = [_contact_options(scene, kind, points, even) for kind in kinds]
    if reach is None:
        extensions = [
            _reach(scene, kind, option)
            for kind, option in zip(kinds, options, strict=True)
        ]
    else:
        extensions = [
            extension.in_metres(pair.base_pitch)
            for pair, extension in zip(pairs, reach, strict=True)
        ]
    layer_bounds = [
        layer_bounds_of(pair, extension) if has_fixed_layers(scene) else ()
        for pair, extension in zip(pairs, extensions, strict=True)
    ]
    matched = [points] * len(pairs)
    if even is None:
        matched = matched_points(pairs, points, extensions, layer_bounds)
    return tuple(
        contact_analysis(
            option._replace(points=nodes, extension=extension, layer_bounds=bounds),
            kind.load,
        )
        for kind, option, nodes, extension, bounds in zip(
            kinds, options, matched, extensions, layer_bounds, strict=True
        )
    )


def has_fixed_layers(scene: Scene) -> bool:
    """Return whether nodes on the path do not follow the load: over a face.

    Parameters
    ----------
    scene : the scene
    """
    return bool(scene.face_keys) and not scene.gears.helix_angle


def layer_bounds_of(
    pair: gear.GearPair, extension: profile.Extension
) -> tuple[float, ...]:
    """Return where layers of nodes end on flanks with a width, in base pitches.

    The nodes on the path are then the same under all but light loads, so that the wear
    rate of a spectrum is the sum of those of its torques.

    Parameters
    ----------
    pair : the gears
    extension : how far nodes reach beyond A and E
    """
    return profile.bounds_of_layers(max(extension) / pair.base_pitch)


def matched_points(
    pairs: Sequence[gear.GearPair],
    points: int,
    reach: Sequence[profile.Extension],
    layer_bounds: Sequence[tuple[float, ...]],
) -> list[int]:
    """Return the points to ask for on each path so that all have equally many nodes.

    As near to that as can be.

    Parameters
    ----------
    pairs : the gears of each kind of mesh
    points : to be had at least
    reach : how far beyond A and E the nodes of each pair reach [m]
    layer_bounds : where the layers of each pair end, see `profile.profile_grid`
    """
    if len(pairs) == 1:
        return [points]
    points_for: list[dict[int, int]] = [{} for _ in pairs]
    for requested in range(points, points + MAX_ADDED_POINTS):
        for pair, extension, bounds, requested_for in zip(
            pairs, reach, layer_bounds, points_for, strict=True
        ):
            grid = profile.profile_grid(
                pair,
                requested,
                sets.kinks(pair),
                extension=extension,
                layer_bounds=bounds,
            )
            requested_for.setdefault(len(grid.position), requested)
        common = set(points_for[0]).intersection(*points_for[1:])
        if common:
            return [requested_for[min(common)] for requested_for in points_for]
    return [points] * len(pairs)


def _reach(
    scene: Scene, kind: gear_set.PairOfSet, options: "ContactOptions"
) -> profile.Extension:
    """Return how far beyond A and E nodes are laid: as far as deflection may reach.

    Conditions that take turns, or come in order, share their flanks and so their nodes.
    """
    if not options.extended:
        return profile.NO_EXTENSION
    if scene.thermal is not None:
        options = options._replace(pair=heat.softest(scene, kind.pair))
    unworn = contact_analysis(
        options._replace(backs=(None, None)), largest_load(scene, kind)
    ).unworn[1]
    times = LARGEST_STATIC if scene.dynamics is None else LARGEST_DYNAMIC
    # of a section below a contact ratio of 1: where a pair is on the path
    deflection = unworn.deflection[np.isfinite(unworn.deflection)].max()
    deepest = leads.deepest_deflection(scene, kind, float(deflection))
    reach = unworn_extension(kind.pair, times * deepest)
    step = STEP * kind.pair.base_pitch
    return profile.Extension(
        *(step * max(1.0, np.ceil(distance / step)) for distance in reach)
    )


def largest_load(scene: Scene, kind: gear_set.PairOfSet) -> float:
    """Return the static normal force of a mesh in the heaviest condition [N].

    Parameters
    ----------
    scene : its conditions share the flanks
    kind : the mesh
    """
    operation = scene.operation
    largest_torque = operation.largest_torque
    if largest_torque == operation.torque:
        return kind.load
    if operation.torque > 0.0:
        return kind.load * largest_torque / operation.torque
    heaviest_condition = operation.single_condition(largest_torque, operation.speed)
    heaviest = scene.with_sections(operation=heaviest_condition)
    return next(
        kinds.load
        for kinds in sets.build_set(heaviest).kinds
        if kinds.section == kind.section
    )


class ContactOptions(NamedTuple):
    """How teeth deflect and where they touch: what a contact analysis depends on.

    Parameters
    ----------
    pair : the gears
    stiffness, contact : the models
    extended : whether tip corners touch beyond A and E
    points : nodes asked for on the path
    even : nodes to a base pitch where they lie equally far apart, as slices of helical
        gears need them
    projection : what the mesh feels of a depth of wear, None where nothing wears
    backs : initial wear that the back flanks of (driving, driven) carry too, None
        without
    extension : how far beyond A and E nodes reach
    layer_bounds : where layers of nodes end whatever the load, see `layer_bounds_of`
    """

    pair: gear.GearPair
    stiffness: stiffnesses.StiffnessModel
    contact: contacts.ContactModel
    extended: bool
    points: int
    even: int | None
    backs: tuple[Any, ...]
    projection: ProjectionModel | None = None
    extension: profile.Extension = profile.NO_EXTENSION
    layer_bounds: tuple[float, ...] = ()


def _contact_options(
    scene: Scene, kind: gear_set.PairOfSet, points: int, even: int | None
) -> ContactOptions:
    """Return what a scene says of the contact of a mesh; nodes end at A and E."""
    mesh = scene.mesh.of(kind.section)
    initial = [scene.initial_of(flank) for flank in kind.flanks]
    backs = tuple(
        wear if wear is not None and wear.thins_teeth else None for wear in initial
    )
    return ContactOptions(
        pair=kind.pair,
        stiffness=mesh.stiffness,
        contact=mesh.contact,
        extended=bool(mesh.extended_contact),
        points=points,
        even=even,
        backs=backs,
        projection=None if scene.wear is None else scene.wear.projection,
    )


@lru_cache(KEPT_ANALYSES)
def contact_analysis(options: ContactOptions, load: float) -> contact.ContactAnalysis:
    """Return a contact analysis, the same one while nothing changes.

    Parameters
    ----------
    options : how teeth give way and where they touch
    load : static normal force [N]
    """
    return replace(_unloaded(options), load=load)


@lru_cache(KEPT_ANALYSES)
def _unloaded(options: ContactOptions) -> contact.ContactAnalysis:
    """Return a contact analysis without a load."""
    pair = options.pair
    stiffness = options.stiffness
    extension = options.extension
    if options.even is not None:
        grid = slicing.lattice(pair, options.even, extension)
    else:
        grid = profile.profile_grid(
            pair,
            options.points,
            sets.kinks(pair),
            stiffness.jumps(pair),
            extension,
            options.layer_bounds,
        )
    teeth = stiffness.build(pair, grid)
    position = grid.position
    if any(back is not None for back in options.backs):
        depth = [
            np.zeros_like(position)
            if back is None
            else back.at_nodes(pair, gear, position)
            for gear, back in enumerate(options.backs)
        ]
        teeth = teeth.with_worn_backs(grid.beyond(np.stack(depth)))
    removed = sets.modifications(pair, position)
    gaps = options.contact.build(WornFlanks(pair, grid, removed), options.extended)
    engages = options.contact.engagement_gap(pair)
    return contact.ContactAnalysis(
        grid,
        teeth,
        removed.sum(axis=0),
        0.0,
        engages,
        gaps,
        _felt(pair, options.projection, position),
    )


def _felt(
    pair: gear.GearPair, projection: ProjectionModel | None, position: Array
) -> Array | None:
    """Return the gap over the depth of both flanks (2, n) [1], None where it is 1."""
    if projection is None or not projection.moves_gaps:
        return None
    return np.stack(
        [
            projection.felt(one, np.hypot(one.base_radius, curvature))
            for one, curvature in zip(pair.gears, pair.curvature(position), strict=True)
        ]
    )


def profile_points(scene: Scene) -> int:
    """Return the nodes on the path: as stated, or by the tolerance (third order).

    Parameters
    ----------
    scene : the scene
    """
    if scene.numerics.profile_points is not None:
        return int(scene.numerics.profile_points)
    ratio = DEFAULT_TOLERANCE / scene.numerics.tolerance
    if scene.face_keys:
        moving = NODES_IN_MOTION if scene.gears.helix_angle else NODES_AT_DEFAULT
        nodes = NODES_OF_A_FACE if scene.dynamics is None else moving
        return int(np.clip(nodes * ratio ** (1 / 3), 41, 401))
    return int(np.clip(NODES_AT_DEFAULT * ratio ** (1 / 3), 81, 1601))
