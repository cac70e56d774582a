"""``[mesh]`` and ``[errors]`` → contact analyses, and prescribed errors."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.assembly import sets
from wearlab.gears import gear, helix, iso
from wearlab.mesh import (
    clock,
    contact,
    contacts,
    gear_set,
    harmonics,
    profile,
    stiffnesses,
)
from wearlab.mesh.exact.gaps import WornFlanks, unworn_extension
from wearlab.mesh.face import contact as over_face
from wearlab.mesh.face import grid as slicing
from wearlab.scene import Scene

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
SLICES_AT_DEFAULT = 41
FEWEST_SLICES = 11
MOST_SLICES = 161
DEFAULT_TOLERANCE = 1e-3
MOST_MORE_POINTS = 60
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
    matched = [points] * len(pairs)
    if even is None:
        matched = matched_points(pairs, points, extensions)
    return tuple(
        contact_analysis(
            option._replace(points=nodes, extension=extension),
            kind.load,
        )
        for kind, option, nodes, extension in zip(
            kinds, options, matched, extensions, strict=True
        )
    )


def matched_points(
    pairs: Sequence[gear.GearPair], points: int, reach: Sequence[profile.Extension]
) -> list[int]:
    """Return the points to ask for on each path so that all have equally many nodes.

    As near to that as can be.

    Parameters
    ----------
    pairs : the gears of each kind of mesh
    points : to be had at least
    reach : how far beyond A and E the nodes of each pair reach [m]
    """
    if len(pairs) == 1:
        return [points]
    points_for: list[dict[int, int]] = [{} for _ in pairs]
    for requested in range(points, points + MOST_MORE_POINTS):
        for pair, extension, requested_for in zip(
            pairs, reach, points_for, strict=True
        ):
            grid = profile.profile_grid(
                pair, requested, sets.kinks(pair), extension=extension
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
    unworn = contact_analysis(
        options._replace(backs=(None, None)), largest_load(scene, kind)
    ).unworn[1]
    times = LARGEST_STATIC if scene.dynamics is None else LARGEST_DYNAMIC
    reach = unworn_extension(kind.pair, times * float(unworn.deflection.max()))
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
    torque = scene.operation.torque
    largest_torque = scene.operation.largest_torque
    if largest_torque == torque:
        return kind.load
    if torque > 0.0:
        return kind.load * largest_torque / torque
    heaviest_condition = scene.operation.single_condition(
        largest_torque, scene.operation.speed
    )
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
    backs : initial wear that the back flanks of (driving, driven) carry too, None
        without
    extension : how far beyond A and E nodes reach
    """

    pair: gear.GearPair
    stiffness: stiffnesses.StiffnessModel
    contact: contacts.ContactModel
    extended: bool
    points: int
    even: int | None
    backs: tuple[Any, ...]
    extension: profile.Extension = profile.NO_EXTENSION


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
            pair, options.points, sets.kinks(pair), stiffness.jumps(pair), extension
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
    return contact.ContactAnalysis(grid, teeth, removed.sum(axis=0), 0.0, engages, gaps)


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
    return int(np.clip(slices, FEWEST_SLICES, MOST_SLICES))


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
    mesh = scene.mesh.of(kind.section)
    slices = slices_of(scene, kind)
    if turned.angle:
        grid = slicing.helical_face(analysis.grid, kind.pair, turned, slices)
    else:
        grid = slicing.spur_face(analysis.grid, kind.pair.face_width, slices)
    misalignment = mesh.misalignment
    coupling = mesh.coupling
    pair = kind.pair
    opening = (
        0.0
        if misalignment is None
        else misalignment.over_face(pair.working_pressure_angle, scene.operation.torque)
    )
    removed = []
    for number, turning in enumerate(pair.gears):
        share = pair.from_root(number, grid.profile.position)
        modification = lead(getattr(scene.gears, turning.name))
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
        middles, pair.face_width, lead(gear_options), gears.helix.cosine
    )


def lead(gear: Any) -> helix.Lead:
    """Return the lead modification that ``[gears.<name>]`` says.

    Parameters
    ----------
    gear : options of the gear
    """
    relief = gear.end_relief
    return helix.Lead(
        crowning=gear.lead_crowning or 0.0,
        slope=gear.lead_slope or 0.0,
        relief=0.0 if relief is None else relief.amount,
        relief_length=1.0 if relief is None else relief.length,
        bias=gear.bias or 0.0,
    )


def build_meshes(scene: Scene, gears: gear_set.GearSet) -> tuple[clock.Mesh, ...]:
    """Return the meshes on their clock, each with one realisation of its errors.

    They are drawn member after member from the seed.
    """
    if gears.angles:
        errors = _of_planetary(scene, gears)
    else:
        members = tuple(_member(scene, gears, name) for name in gears.members)
        errors = [
            harmonics.mesh_error(
                members, _harmonics(scene, gears.mesh_names[0]), scene.prescribed.seed
            )
        ]
    on_clock = zip(gears.mesh_kinds, gears.mesh_lags, errors, strict=True)
    return tuple(clock.Mesh(kind, float(lag), error) for kind, lag, error in on_clock)


def _member(scene: Scene, gears: gear_set.GearSet, name: str) -> harmonics.MemberError:
    """Return the errors that the file states of a gear, or that its class allows."""
    toothing = gears.gears[name]
    options: Any = scene.prescribed.members.get(name)
    eccentricity = getattr(getattr(scene.gears, name), "eccentricity", None) or 0.0
    grade = iso_1328_class(scene, name)
    total = 0.0
    tooth = 0.0
    if grade is not None:
        pairs = [
            kind.pair
            for kind in gears.kinds
            if toothing.name in {gear.name for gear in kind.pair.gears}
        ]
        ratio = min(pair.contact_ratio for pair in pairs)
        *_, tooth, total = iso.allowed(
            grade, toothing.module, 2.0 * toothing.reference_radius, ratio
        )
    stated = (
        {}
        if options is None
        else {key: getattr(options, key) for key in options.model_fields_set}
    )
    total = stated.get("total_composite", total)
    tooth = stated.get("tooth_composite", tooth)
    return harmonics.MemberError(
        toothing.teeth, total, tooth, getattr(options, "installation", ()), eccentricity
    )


def iso_1328_class(scene: Scene, name: str) -> int | None:
    """Return the accuracy class of a toothed member, None without one.

    Parameters
    ----------
    scene : the scene
    name : of the member
    """
    of_member = getattr(scene.prescribed.members.get(name), "iso_1328_class", None)
    return scene.prescribed.iso_1328_class if of_member is None else of_member


def class_flags(scene: Scene, gears: gear_set.GearSet) -> tuple[str, ...]:
    """Return what each member's ISO 1328 class allows it, in words.

    Parameters
    ----------
    scene, gears : the scene and its gear set
    """
    grades = {
        name: grade
        for name in gears.gears
        if (grade := iso_1328_class(scene, name)) is not None
    }
    allowed = {name: _member(scene, gears, name) for name in grades}
    return tuple(
        f"{name}: ISO 1328-1:1995 class {grades[name]}: F_i′ = "
        f"{1e6 * error.total_composite:.3g} µm, "
        f"f_i′ = {1e6 * error.tooth_composite:.3g} µm, all that is allowed, at angles "
        "drawn by errors.seed"
        for name, error in allowed.items()
    )


def _harmonics(scene: Scene, mesh: str) -> tuple[tuple[int, float, float], ...]:
    """Return the prescribed harmonics of a mesh, under its name or that of its kind."""
    harmonics = [
        harmonic
        for harmonic in scene.prescribed.harmonic
        if harmonic.mesh in (mesh, mesh.rpartition("-")[0])
    ]
    return tuple(
        (harmonic.order, harmonic.amplitude, harmonic.phase) for harmonic in harmonics
    )


def _of_planetary(scene: Scene, gears: gear_set.GearSet) -> list[harmonics.MeshError]:
    """Return the errors of all meshes of a planetary set.

    Seen from the carrier the sun brings its once-per-revolution error to planet n later
    by ψ_n, the ring, which turns the other way, earlier; a planet shows the ring the
    side away from the sun.
    """
    random = np.random.default_rng(scene.prescribed.seed)
    angles = gears.sense * np.asarray(gears.angles)
    sun, *planets, ring = (
        harmonics.realised(_member(scene, gears, name), random)
        for name in ("sun", *("planet",) * len(angles), "ring")
    )
    pins = _pins(scene, angles, random)
    rows = []
    for name, kind, n in zip(
        gears.mesh_names, gears.mesh_kinds, [*range(len(angles))] * 2, strict=True
    ):
        alpha = gears.kinds[kind].pair.working_pressure_angle
        if kind == 0:
            parts = [
                sun.turned(-angles[n]),
                planets[n],
                *(pin.turned(-alpha) for pin in pins[n]),
            ]
        else:
            held = (pin.turned(alpha) for pin in pins[n])
            parts = [planets[n].turned(math.pi), ring.turned(angles[n]), *held]
        rows.append(
            harmonics.mesh_error((), _harmonics(scene, name), parts=tuple(parts))
        )
    return rows


def _pins(scene: Scene, angles: Any, random: Any) -> list[list[harmonics.Realisation]]:
    """Return where the pins are off, at rest in the carrier.

    A pin moved by p in the direction β sees ``−n·p`` in a mesh whose normal is turned
    by ψ ∓ α.
    """
    members: Any = scene.prescribed.members
    gears: Any = scene.gears
    carrier = members.get("carrier")
    planet = members.get("planet")
    shared = [
        *(carrier.installation if carrier else ()),
        gears.carrier.eccentricity or 0.0,
    ]
    tolerances = [
        amount for held in (carrier, planet) if held for amount in held.planet_position
    ]
    directions = random.uniform(0.0, 2 * math.pi, len(shared))
    pins = []
    for angle in angles:
        moved = [*zip(shared, angle - directions, strict=True)]
        moved += [(amount, random.uniform(0.0, 2 * math.pi)) for amount in tolerances]
        axes = [
            harmonics.AT_REST.of(amount, float(direction))
            for amount, direction in moved
        ]
        pins.append([axis for axis in axes if axis.slow])
    return pins
