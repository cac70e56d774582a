"""Contact of a scene's flanks: worn shapes, and the errors that offset them."""

import math
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.gears import gear, outline, specification, tolerances
from wearlab.mesh import contact, gear_set, profile
from wearlab.mesh.corners import FURTHEST, OverhangingFlank, reach_beyond, unworn_extension
from wearlab.mesh.errors import AT_REST, MemberError, MeshError, Realisation, mesh_error, realised
from wearlab.mesh.exact.gaps import WornFlanks
from wearlab.scene import Scene
from wearlab.scene.build.face import sliced_flank
from wearlab.scene.build.sets import modifications


def build_errors(scene: Scene, gears: gear_set.GearSet) -> list[MeshError]:
    """Return one realisation of the errors of each mesh, drawn member after member from the seed."""
    if gears.angles:
        return _of_planetary(scene, gears)
    errors = scene.errors
    if errors is None:
        return [mesh_error(())]
    members = tuple(_member(scene, gears, name) for name in gears.members)
    return [mesh_error(members, _harmonics(scene, gears.mesh_names[0]), errors.seed)]


def _member(scene: Scene, gears: gear_set.GearSet, name: str) -> MemberError:
    """Return the errors that the file gives a toothed member, or that its ISO 1328 class allows."""
    gear = gears.gears[name]
    teeth = gear.teeth
    given: Any = scene.errors.members.get(name) if scene.errors is not None else None
    eccentricity = getattr(getattr(scene.gears, name), "eccentricity", None) or 0.0
    grade = iso_1328_class(scene, name)
    total = tooth = 0.0
    if grade is not None:
        ratio = min(
            kind.pair.contact_ratio for kind in gears.kinds if gear.name in {g.name for g in kind.pair.gears}
        )
        *_, tooth, total = tolerances.allowed(grade, gear.module, 2.0 * gear.reference_radius, ratio)
    if given is None:
        return MemberError(teeth, total, tooth, eccentricity=eccentricity)
    said = given.model_fields_set
    return MemberError(
        teeth,
        given.total_composite if "total_composite" in said else total,
        given.tooth_composite if "tooth_composite" in said else tooth,
        tuple(given.installation),
        eccentricity,
    )


def iso_1328_class(scene: Scene, name: str) -> int | None:
    """Return the accuracy class of a toothed member, None without one."""
    if scene.errors is None:
        return None
    own = getattr(scene.errors.members.get(name), "iso_1328_class", None)
    return scene.errors.iso_1328_class if own is None else own


def class_flags(scene: Scene, gears: gear_set.GearSet) -> tuple[str, ...]:
    """Return what each member's ISO 1328 class allows it, in words."""
    lines = []
    for name in gears.gears:
        grade = iso_1328_class(scene, name)
        if grade is not None:
            error = _member(scene, gears, name)
            lines.append(
                f"{name}: ISO 1328-1:1995 class {grade}: F_i′ = {1e6 * error.total_composite:.3g} µm, "
                f"f_i′ = {1e6 * error.tooth_composite:.3g} µm, all that is allowed, "
                "at angles drawn by errors.seed"
            )
    return tuple(lines)


def _harmonics(scene: Scene, mesh: str) -> tuple[tuple[int, float, float], ...]:
    """Return the prescribed harmonics of one mesh, named itself or with all of its kind."""
    given = scene.errors.harmonic if scene.errors is not None else ()
    return tuple(
        (h.order, h.amplitude, h.phase) for h in given if mesh == h.mesh or mesh.rpartition("-")[0] == h.mesh
    )


def _of_planetary(scene: Scene, gears: gear_set.GearSet) -> list[MeshError]:
    """Return the errors of all meshes: gears seen where each planet stands, pins where they are held.

    Seen from the carrier the sun brings its once-per-revolution error to planet n later by ψ_n, the ring,
    which turns the other way, earlier; a planet shows the ring the side away from the sun.
    """
    errors: Any = scene.errors
    random = np.random.default_rng(0 if errors is None else errors.seed)
    angles = gears.sense * np.asarray(gears.angles)
    sun = realised(_member(scene, gears, "sun"), random)
    planets = [realised(_member(scene, gears, "planet"), random) for _ in angles]
    ring = realised(_member(scene, gears, "ring"), random)
    pins = _pins(scene, angles, random)
    rows = []
    for mesh, name in enumerate(gears.mesh_names):
        kind, n = gears.mesh_kinds[mesh], mesh % len(angles)
        alpha = gears.kinds[kind].pair.working_pressure_angle
        if kind == 0:
            parts = [sun.turned(-angles[n]), planets[n], *(pin.turned(-alpha) for pin in pins[n])]
        else:
            parts = [
                planets[n].turned(math.pi),
                ring.turned(angles[n]),
                *(pin.turned(alpha) for pin in pins[n]),
            ]
        rows.append(mesh_error((), _harmonics(scene, name), parts=tuple(parts)))
    return rows


def _pins(scene: Scene, angles: Any, random: Any) -> list[list[Realisation]]:
    """Return where the pins are off, at rest in the carrier: each tangential in its own direction.

    A pin moved by p in the direction β sees ``−n·p`` in a mesh whose normal is turned by ψ ∓ α.
    """
    given: Any = scene.errors.members if scene.errors is not None else {}
    carrier, planet = given.get("carrier"), given.get("planet")
    gears: Any = scene.gears
    shared = [*(carrier.installation if carrier else ()), gears.carrier.eccentricity or 0.0]
    own = [
        *(carrier.planet_position if carrier else ()),
        *(planet.planet_position if planet else ()),
    ]
    directions = random.uniform(0.0, 2 * math.pi, len(shared))
    pins = []
    for angle in angles:
        moved = [
            AT_REST.of(amount, angle - direction)
            for amount, direction in zip(shared, directions, strict=True)
        ]
        moved += [AT_REST.of(amount, random.uniform(0.0, 2 * math.pi)) for amount in own]
        pins.append([axis for axis in moved if len(axis.slow)])
    return pins


LARGEST_STATIC = 2.0
"""Times its static deflection that a quasi-static mesh may deflect, worn or with errors."""
LARGEST_DYNAMIC = 4.0
"""Times its static deflection that a vibrating mesh may deflect."""
STEP = 0.02
"""Base pitches in which extended contact grows, so that grids of different density reach equally far."""
EXTENDED_CONTACT = 0.05
"""Share of the path by which contact may be extended before a run without extended contact says so."""
CHECKED_POINTS, CHECKED_SLICES = 101, 41
"""Points of a profile, and slices of a face, at which the wear it starts with is looked at before a run."""


def flanks_of(pair: gear.GearPair, grid: profile.ProfileGrid) -> WornFlanks:
    """Return what makes worn flanks of wear depths at the nodes."""
    return WornFlanks(pair, grid, modifications(pair, grid.position))


def extension_wanted(
    pair: gear.GearPair, plain: contact.ContactAnalysis, *, vibrates: bool
) -> profile.Extension:
    """Return how far beyond A and E nodes are laid: as far as the largest deflection expected reaches.

    Conditions that take turns, or come in order, share their flanks and so their nodes.

    Parameters
    ----------
    pair : the gears
    plain : the contact analysis without extended contact, under the largest load of all conditions
    vibrates : whether the mesh vibrates, and so may deflect further
    """
    _, static = plain.unworn
    times = LARGEST_DYNAMIC if vibrates else LARGEST_STATIC
    reach = unworn_extension(pair, times * float(static.deflection.max()))
    step = STEP * pair.base_pitch
    return profile.Extension(*(step * max(1.0, np.ceil(distance / step)) for distance in reach))


def contact_flags(
    scene: Scene, section: str, pair: gear.GearPair, analysis: contact.ContactAnalysis
) -> tuple[str, ...]:
    """Return what a run must say of its contact, in words.

    Parameters
    ----------
    scene : the scene
    section : name of the mesh's own table, "" for a pair
    pair, analysis : the gears and their contact
    """
    mesh = scene.mesh.of(section)
    flags = list(mesh.contact.flags())
    if mesh.extended_contact:
        before, after = (
            pair.path.A - analysis.grid.contact_position[0],
            analysis.grid.contact_position[-1] - pair.path.E,
        )
        flags.append(
            f"extended contact: pairs may touch up to {1e3 * before:.3g} mm before A and {1e3 * after:.3g} "
            "mm after E; tip corners do not wear, and the force they carry there wears no flank"
        )
        if max(before, after) > (FURTHEST - STEP) * pair.base_pitch:
            flags.append(
                f"contact is followed no further than {FURTHEST:g} base pitches beyond A and E: under this "
                "load teeth may touch further out"
            )
    return tuple(flags)


def reached_limits(
    pair: gear.GearPair, analysis: contact.ContactAnalysis, wear: Array, gap: Array, deflection: Array
) -> tuple[str, ...]:
    """Return how the contact of one state left what was computed of it, in words.

    Parameters
    ----------
    pair, analysis : the gears and their contact
    wear : (2, n) wear depth, (driving, driven) [m]
    gap : (n_contact,) gaps at the nodes [m]
    deflection : (n_phase_nodes,) static deflection δ at the phase nodes [m]
    """
    if len(analysis.grid.contact_position) > len(analysis.grid.position):
        if not _cut_off(analysis, gap, float(deflection.max())):
            return ()
        return (f"extended contact is cut off at a deflection of {1e6 * deflection.max():.3g} µm",)
    try:
        share = sum(extended_length(pair, analysis, wear, deflection)) / (pair.path.E - pair.path.A)
    except OverhangingFlank:
        return ("flanks are worn too steeply to tell how far deflection extends their contact",)
    if share <= EXTENDED_CONTACT:
        return ()
    return (f"deflection would extend the path of contact by {100 * share:.0f} %",)


def cut_short(
    pair: gear.GearPair, analysis: contact.ContactAnalysis, nodes: contact.Nodes
) -> tuple[str, ...]:
    """Return where the ranges of an exact mesh relationship end with the nodes, not with the contact.

    Parameters
    ----------
    pair, analysis : the gears and their contact
    nodes : of one wear state
    """
    if analysis.gaps is None or analysis.gaps.meeting is None:
        return ()
    if analysis.engagement_gap < np.inf:
        engaged = np.isfinite(analysis.at(nodes, analysis.at_nodes)[0]).astype(float)
    else:
        engaged = analysis.quasistatic(nodes, analysis.at_nodes).force
    along = analysis.force_at_nodes(engaged)
    ends = [letter for letter, value in (("A", along[0]), ("E", along[-1])) if value > 0.0]
    if len(analysis.grid.contact_position) > len(along) or not ends:
        return ()
    return (
        f"meshing_range and contact_range of {pair.driving.name} and {pair.driven.name} stop at "
        f"{' and '.join(ends)}, where pairs are still engaged: extended_contact follows them beyond",
    )


def extended_length(
    pair: gear.GearPair, analysis: contact.ContactAnalysis, wear: Array, deflection: Array
) -> profile.Extension:
    """Return how far beyond A and E a deflection would keep tip corners touching.

    Parameters
    ----------
    pair, analysis : the gears and their contact
    wear : (2, n) wear depth, (driving, driven) [m]
    deflection : (n_phase_nodes,) static deflection δ at the phase nodes [m]
    """
    grid = analysis.grid
    last_of_segment = np.cumsum(grid.intervals + 1) - 1
    leaves = int(np.argmin(np.abs(grid.breaks[:-1] - pair.contact_ratio % 1.0)))
    after = last_of_segment[leaves] - grid.intervals[leaves]
    depth = wear + modifications(pair, grid.position)
    return reach_beyond(pair, grid.position, depth, (float(deflection[-1]), float(deflection[after])))


def _cut_off(analysis: contact.ContactAnalysis, gap: Array, deflection: float) -> bool:
    """Whether pairs still touch where extended contact ends."""
    inside = analysis.grid.on_flank
    outermost = [gap[0]] if inside.start > 0 else []
    outermost += [gap[-1]] if inside.stop < len(gap) else []
    return any(deflection > corner for corner in outermost)


def tooth_thickness(pair: gear.GearPair, number: int, position: Array) -> Array:
    """Return how thick the teeth of a gear are along the line of action, at path positions (n,) [m]."""
    return 2.0 * outline.contact_depth(pair.gears[number], pair.radius(number, position))


def thickest(gears: gear_set.GearSet, where: str | None) -> float:
    """Return the largest thickness of the teeth where the flanks of a member, or all, touch [m]."""
    own = [name for name in gears.flanks if where in (name, name.split("-")[0])]
    each = []
    for kind, number in map(gears.flank, own or gears.flanks):
        pair = gears.kinds[kind].pair
        position = np.linspace(pair.path.A, pair.path.E, CHECKED_POINTS)
        each.append(tooth_thickness(pair, number, position).max())
    return float(max(each))


def check_limits(scene: Scene, gears: gear_set.GearSet) -> None:
    """Refuse depths to be reached, of a limit or a snapshot, that no tooth is thick enough for.

    Raises
    ------
    GearError : with path, depth and thickness
    """
    if scene.wear is None:
        return
    until, snapshots = scene.wear.until, scene.wear.snapshots
    asked = [] if until is None else [("until", until.depth, until.flank)]
    if snapshots is not None and snapshots.depth is not None:
        asked.append(("snapshots", snapshots.depth[-1], snapshots.flank))
    for place, depth, flank in asked:
        if depth is not None and depth >= (most := thickest(gears, flank)):
            raise specification.GearError(
                f"wear.{place}.depth: {1e3 * depth:.4g} mm is deeper than {flank or 'any tooth'} is thick, "
                f"{1e3 * most:.4g} mm along the normal of its flank: look at its unit, or give less"
            )


def check_initial_wear(scene: Scene, gears: gear_set.GearSet) -> None:
    """Refuse wear a scene starts with that its gears cannot have, before anything runs.

    Raises
    ------
    GearError
        Where a measured profile does not cover its flank, or wear is deeper than the tooth.
    """
    if scene.wear is None:
        return
    for name in gears.flanks:
        flank, (kind, gear) = scene.wear.initial_of(name), gears.flank(name)
        if flank is None:
            continue
        pair = gears.kinds[kind].pair
        position = np.linspace(pair.path.A, pair.path.E, CHECKED_POINTS)
        sliced = None if flank.by_law else sliced_flank(scene, gears, (kind, gear), CHECKED_SLICES)
        thickness = tooth_thickness(pair, gear, position)
        if flank.by_law:  # which course it has, the run finds out
            thickness, depth = thickness.max(keepdims=True), np.array([getattr(flank, "depth", 0.0)])
        elif sliced is None:
            depth = flank.at_nodes(pair, gear, position)
        else:
            depth = flank.over_face(pair, gear, position, sliced).max(axis=0)
        if np.any(depth >= thickness):
            worst = int(np.argmax(depth - thickness))
            raise specification.GearError(
                f"wear.initial.{name}: wear of {1e3 * depth[worst]:.4g} mm is deeper than the tooth, "
                f"{1e3 * thickness[worst]:.4g} mm thick there along its normal; give less initial wear"
            )
