"""``[mesh]`` and ``[errors]`` → contact analysis, contact over the face, and prescribed errors."""

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
NODES_AT_DEFAULT, NODES_OF_A_FACE, NODES_IN_MOTION = 201, 101, 121
"""Nodes on the path at the default tolerance: of flanks without a width, with one, and
of helical gears that vibrate, whose lines enter little by little."""
SLICES_AT_DEFAULT, LEAST_SLICES, MOST_SLICES = 41, 11, 161
DEFAULT_TOLERANCE = 1e-3
MOST_MORE_POINTS = 60
KEPT_ANALYSES = 8
"""Contact analyses that a process remembers: of the scene it is at, and of one that
differs a little."""


def build_analyses(
    scene: Scene,
    kinds: Sequence[gear_set.PairOfSet],
    reach: Sequence[profile.Extension] | None = None,
) -> tuple[contact.ContactAnalysis, ...]:
    """Return the contact analysis of kinds of mesh of one set, each at its static load.

    Parameters
    ----------
    scene, kinds : the scene and the kinds of mesh of its gear set
    reach : how far beyond A and E the nodes of every kind reach, in base pitches; None:
        as far as their load asks for
    """
    points = profile_points(scene)
    pairs = [kind.pair for kind in kinds]
    even = None
    if scene.gears.helix_angle:
        even = slicing.nodes_per_pitch([pair.contact_ratio for pair in pairs], points)
    asked = [_asked(scene, kind, points, even) for kind in kinds]
    if reach is None:
        far = [_reach(scene, kind, own) for kind, own in zip(kinds, asked, strict=True)]
    else:
        shares = zip(pairs, reach, strict=True)
        far = [
            profile.Extension(*(share * pair.base_pitch for share in own))
            for pair, own in shares
        ]
    matched = (
        [points] * len(pairs)
        if even is not None
        else matched_points(pairs, points, far)
    )
    return tuple(
        contact_analysis(own._replace(points=nodes, extension=extension), kind.load)
        for kind, own, nodes, extension in zip(kinds, asked, matched, far, strict=True)
    )


def matched_points(
    pairs: Sequence[gear.GearPair], points: int, reach: Sequence[profile.Extension]
) -> list[int]:
    """Return the points to ask for on each path so that all have equally many nodes, as near as can be."""
    if len(pairs) == 1:
        return [points]
    matched: list[dict[int, int]] = [{} for _ in pairs]
    for asked in range(points, points + MOST_MORE_POINTS):
        for pair, far, nodes in zip(pairs, reach, matched, strict=True):
            grid = profile.profile_grid(pair, asked, sets.kinks(pair), extension=far)
            nodes.setdefault(len(grid.position), asked)
        if common := set(matched[0]).intersection(*matched[1:]):
            return [nodes[min(common)] for nodes in matched]
    return [points] * len(pairs)


def _reach(
    scene: Scene, kind: gear_set.PairOfSet, asked: "ContactOptions"
) -> profile.Extension:
    """Return how far beyond A and E nodes are laid: as far as the largest deflection expected reaches.

    Conditions that take turns, or come in order, share their flanks and so their nodes.
    """
    if not asked.extended:
        return profile.NO_EXTENSION
    unworn = contact_analysis(
        asked._replace(backs=(None, None)), largest_load(scene, kind)
    ).unworn[1]
    times = LARGEST_STATIC if scene.dynamics is None else LARGEST_DYNAMIC
    reach = unworn_extension(kind.pair, times * float(unworn.deflection.max()))
    step = STEP * kind.pair.base_pitch
    return profile.Extension(
        *(step * max(1.0, np.ceil(distance / step)) for distance in reach)
    )


def largest_load(scene: Scene, kind: gear_set.PairOfSet) -> float:
    """Return the static normal force of a mesh in the heaviest of conditions that share its flanks [N]."""
    here = scene.operation.torque
    most = scene.operation.largest_torque
    if most == here:
        return kind.load
    if here > 0.0:
        return kind.load * most / here
    heaviest = scene.model_copy(
        update={
            "operation": scene.operation.single_condition(most, scene.operation.speed)
        }
    )
    return next(
        kinds.load
        for kinds in sets.build_set(heaviest).kinds
        if kinds.section == kind.section
    )


class ContactOptions(NamedTuple):
    """How teeth give way and where they touch: what a contact analysis is told of a scene.

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


def _asked(
    scene: Scene, kind: gear_set.PairOfSet, points: int, even: int | None
) -> ContactOptions:
    own = scene.mesh.of(kind.section)
    initial = [scene.initial_of(flank) for flank in kind.flanks]
    backs = tuple(
        wear if wear is not None and wear.thins_teeth else None for wear in initial
    )
    extended = bool(own.extended_contact)
    return ContactOptions(
        kind.pair, own.stiffness, own.contact, extended, points, even, backs
    )


@lru_cache(KEPT_ANALYSES)
def contact_analysis(asked: ContactOptions, load: float) -> contact.ContactAnalysis:
    """Return a contact analysis under a static normal force [N]: the same one while nothing changes."""
    return replace(_unloaded(asked), load=load)


@lru_cache(KEPT_ANALYSES)
def _unloaded(asked: ContactOptions) -> contact.ContactAnalysis:
    pair = asked.pair
    stiffness = asked.stiffness
    extension = asked.extension
    if asked.even is not None:
        grid = slicing.lattice(pair, asked.even, extension)
    else:
        grid = profile.profile_grid(
            pair, asked.points, sets.kinks(pair), stiffness.jumps(pair), extension
        )
    teeth = stiffness.build(pair, grid)
    position = grid.position
    if any(back is not None for back in asked.backs):
        depth = [
            np.zeros_like(position)
            if back is None
            else back.at_nodes(pair, gear, position)
            for gear, back in enumerate(asked.backs)
        ]
        teeth = teeth.with_worn_backs(grid.beyond(np.stack(depth)))
    removed = sets.modifications(pair, position)
    gaps = asked.contact.build(WornFlanks(pair, grid, removed), asked.extended)
    engages = asked.contact.engagement_gap(pair)
    return contact.ContactAnalysis(grid, teeth, removed.sum(axis=0), 0.0, engages, gaps)


def profile_points(scene: Scene) -> int:
    """Return the nodes on the path: as asked, or for a third-order error from the tolerance."""
    if scene.numerics.profile_points is not None:
        return int(scene.numerics.profile_points)
    ratio = DEFAULT_TOLERANCE / scene.numerics.tolerance
    if scene.face_keys:
        moving = NODES_IN_MOTION if scene.gears.helix_angle else NODES_AT_DEFAULT
        nodes = NODES_OF_A_FACE if scene.dynamics is None else moving
        return int(np.clip(nodes * ratio ** (1 / 3), 41, 401))
    return int(np.clip(NODES_AT_DEFAULT * ratio ** (1 / 3), 81, 1601))


def slices_of(scene: Scene, kind: gear_set.PairOfSet) -> int:
    """Return the slices asked for: as said, or for a second-order error from the tolerance."""
    asked = scene.mesh.of(kind.section).face_points
    if asked is not None:
        return asked
    wanted = SLICES_AT_DEFAULT * (DEFAULT_TOLERANCE / scene.numerics.tolerance) ** 0.5
    return int(np.clip(wanted, LEAST_SLICES, MOST_SLICES))


def build_face_contact(
    scene: Scene,
    kind: gear_set.PairOfSet,
    analysis: contact.ContactAnalysis,
    turned: helix.Helix,
) -> over_face.FaceContact:
    """Return the contact over the face of one kind of mesh."""
    mesh = scene.mesh.of(kind.section)
    slices = slices_of(scene, kind)
    if turned.angle:
        grid = slicing.helical_face(analysis.grid, kind.pair, turned, slices)
    else:
        grid = slicing.spur_face(analysis.grid, kind.pair.face_width, slices)
    given = mesh.misalignment
    coupling = mesh.coupling
    pair = kind.pair
    over = (
        0.0
        if given is None
        else given.over_face(pair.working_pressure_angle, scene.operation.torque)
    )
    removed = []
    for number, turning in enumerate(pair.gears):
        share = pair.from_root(number, grid.profile.position)
        own = lead(getattr(scene.gears, turning.name))
        removed.append(own.removed(grid.position, share, grid.face_width))
    return over_face.FaceContact(
        grid=grid,
        analysis=analysis,
        lead=np.stack(removed),
        opening=over * grid.position / grid.face_width,
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
    own: Any = getattr(scene.gears, pair.gears[of[1]].name)
    return helix.SlicedFlank(middles, pair.face_width, lead(own), gears.helix.cosine)


def lead(gear: Any) -> helix.Lead:
    """Return the lead modification that ``[gears.<name>]`` says."""
    ends = gear.end_relief
    amount, length = (0.0, 1.0) if ends is None else (ends.amount, ends.length)
    return helix.Lead(
        gear.lead_crowning or 0.0,
        gear.lead_slope or 0.0,
        amount,
        length,
        gear.bias or 0.0,
    )


def build_meshes(scene: Scene, gears: gear_set.GearSet) -> tuple[clock.Mesh, ...]:
    """Return the meshes on their clock, each with one realisation of its errors.

    They are drawn member after member from the seed.
    """
    if gears.angles:
        each = _of_planetary(scene, gears)
    else:
        members = tuple(_member(scene, gears, name) for name in gears.members)
        each = [
            harmonics.mesh_error(
                members, _harmonics(scene, gears.mesh_names[0]), scene.prescribed.seed
            )
        ]
    on_clock = zip(gears.mesh_kinds, gears.mesh_lags, each, strict=True)
    return tuple(clock.Mesh(kind, float(lag), error) for kind, lag, error in on_clock)


def _member(scene: Scene, gears: gear_set.GearSet, name: str) -> harmonics.MemberError:
    """Return the errors that the file gives a toothed member, or that its ISO 1328 class allows."""
    own = gears.gears[name]
    given: Any = scene.prescribed.members.get(name)
    eccentricity = getattr(getattr(scene.gears, name), "eccentricity", None) or 0.0
    grade = iso_1328_class(scene, name)
    total = 0.0
    tooth = 0.0
    if grade is not None:
        pairs = [
            kind.pair
            for kind in gears.kinds
            if own.name in {gear.name for gear in kind.pair.gears}
        ]
        ratio = min(pair.contact_ratio for pair in pairs)
        *_, tooth, total = iso.allowed(
            grade, own.module, 2.0 * own.reference_radius, ratio
        )
    said = (
        {}
        if given is None
        else {key: getattr(given, key) for key in given.model_fields_set}
    )
    total = said.get("total_composite", total)
    tooth = said.get("tooth_composite", tooth)
    return harmonics.MemberError(
        own.teeth, total, tooth, getattr(given, "installation", ()), eccentricity
    )


def iso_1328_class(scene: Scene, name: str) -> int | None:
    """Return the accuracy class of a toothed member, None without one."""
    own = getattr(scene.prescribed.members.get(name), "iso_1328_class", None)
    return scene.prescribed.iso_1328_class if own is None else own


def class_flags(scene: Scene, gears: gear_set.GearSet) -> tuple[str, ...]:
    """Return what each member's ISO 1328 class allows it, in words."""
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
    """Return the prescribed harmonics of one mesh, named itself or with all of its kind."""
    own = [
        one
        for one in scene.prescribed.harmonic
        if one.mesh in (mesh, mesh.rpartition("-")[0])
    ]
    return tuple((one.order, one.amplitude, one.phase) for one in own)


def _of_planetary(scene: Scene, gears: gear_set.GearSet) -> list[harmonics.MeshError]:
    """Return the errors of all meshes: gears seen where each planet stands, pins where they are held.

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
    """Return where the pins are off, at rest in the carrier: each tangential in its own direction.

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
    own = [
        amount for held in (carrier, planet) if held for amount in held.planet_position
    ]
    directions = random.uniform(0.0, 2 * math.pi, len(shared))
    pins = []
    for angle in angles:
        moved = [*zip(shared, angle - directions, strict=True)]
        moved += [(amount, random.uniform(0.0, 2 * math.pi)) for amount in own]
        each = [
            harmonics.AT_REST.of(amount, float(direction))
            for amount, direction in moved
        ]
        pins.append([axis for axis in each if axis.slow])
    return pins
