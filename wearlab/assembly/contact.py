"""What a run says of its contact: extended contact, helix, limits that are reached."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from wearlab.arrays import Array
from wearlab.assembly import mesh, sets
from wearlab.gears import gear
from wearlab.mesh import contact, gear_set, profile
from wearlab.mesh.exact import flank, gaps
from wearlab.scene import Scene

EXTENDED_CONTACT = 0.05
"""Share of the path by which contact may be extended before a run without extended
contact says so."""


def contact_flags(
    scene: Scene, kind: gear_set.PairOfSet, analysis: contact.ContactAnalysis
) -> Iterator[str]:
    """Yield what a run must say of its contact, in words.

    Parameters
    ----------
    scene : the scene
    kind, analysis : the kind of mesh and its contact
    """
    options = scene.mesh.of(kind.section)
    path = kind.pair.path
    yield from options.contact.flags()
    if options.extended_contact:
        first, *_, last = analysis.grid.contact_position
        beyond_a = path.A - first
        beyond_e = last - path.E
        wears = (
            "the force there wears both flanks (wear_depth_beyond)"
            if scene.sections.wears_beyond
            else (
                "tip corners do not wear, and the force they carry there wears no flank"
            )
        )
        yield (
            f"extended contact: pairs may touch up to {1e3 * beyond_a:.3g} mm before A "
            f"and {1e3 * beyond_e:.3g} mm after E; {wears}"
        )
        if max(beyond_a, beyond_e) > (gaps.FURTHEST - mesh.STEP) * kind.pair.base_pitch:
            yield (
                f"contact is followed no further than {gaps.FURTHEST:g} base pitches "
                "beyond A and E: "
                "under this load teeth may touch further out"
            )


def helix_flags(
    gears: gear_set.GearSet, loads: Sequence[float], *, bearings: bool
) -> Iterator[str]:
    """Yield what the helix of gears does that nothing here answers to, in words.

    Parameters
    ----------
    gears : the gear set
    loads : largest static force of each kind of mesh, in the heaviest of all conditions
        [N]
    bearings : whether the dynamics know bearings, which hold the axial force
    """
    if not gears.helix.angle:
        return
    axial = [abs(gears.helix.slope) * load for load in loads]
    if not bearings:
        force = f"up to {max(axial):.4g} N"
        yield (
            f"helix: each mesh pushes its gears {force} along their axes; no bearing "
            "here holds it"
        )
    if gears.shares:
        radius = gears.bodies["planet"].radius
        arms = sum(
            radius / math.cos(kind.pair.working_pressure_angle) for kind in gears.kinds
        )
        yield (
            "helix: the two meshes of a planet tilt it by up to "
            f"{axial[0] * arms:.4g} N m, and how its "
            "bearing gives way is not computed: give mesh.sun_planet.misalignment and "
            "mesh.planet_ring.misalignment, over torque"
        )


def follows_extended_contact(analysis: contact.ContactAnalysis) -> bool:
    """Return whether contact is followed beyond A and E, by nodes that lie there.

    Parameters
    ----------
    analysis : the contact of a kind of mesh
    """
    grid = analysis.grid
    return len(grid.contact_position) > len(grid.position)


def reached_limits(
    pair: gear.GearPair,
    analysis: contact.ContactAnalysis,
    wear: Array,
    gap: Array,
    deflection: Array,
) -> Iterator[str]:
    """Yield how the contact of one state left what was computed of it, in words.

    Parameters
    ----------
    pair, analysis : the gears and their contact
    wear : (2, n) wear depth, (driving, driven) [m]
    gap : (n_contact,) gaps at the nodes [m]
    deflection : (n_phase_nodes,) static deflection δ at the phase nodes [m]
    """
    if follows_extended_contact(analysis):
        yield from _cut_off(analysis, gap, deflection)
    else:
        yield from _beyond_path(pair, analysis, wear, deflection)


def _cut_off(
    analysis: contact.ContactAnalysis, gap: Array, deflection: Array
) -> Iterator[str]:
    """Yield whether a deflection closes the gap of an outermost node beyond A or E."""
    on_flank = analysis.grid.on_flank
    outermost_gaps = []
    if on_flank.start > 0:
        outermost_gaps.append(gap[0])
    if on_flank.stop < len(gap):
        outermost_gaps.append(gap[-1])

    largest = float(deflection.max())
    if any(largest > outermost for outermost in outermost_gaps):
        yield f"extended contact is cut off at a deflection of {1e6 * largest:.3g} µm"


def _beyond_path(
    pair: gear.GearPair,
    analysis: contact.ContactAnalysis,
    wear: Array,
    deflection: Array,
) -> Iterator[str]:
    """Yield by how much deflection would extend a path that ends at A and E."""
    try:
        extension = sum(extended_length(pair, analysis, wear, deflection))
    except flank.OverhangingFlank:
        yield (
            "flanks are worn too steeply to tell how far deflection extends their "
            "contact"
        )
        return
    share = extension / (pair.path.E - pair.path.A)
    if share > EXTENDED_CONTACT:
        yield f"deflection would extend the path of contact by {100 * share:.0f} %"


def cut_short(
    pair: gear.GearPair, analysis: contact.ContactAnalysis, nodes: contact.Nodes
) -> Iterator[str]:
    """Yield where an exact mesh relationship ends with the nodes, not with the contact.

    Parameters
    ----------
    pair, analysis : the gears and their contact
    nodes : of one wear state
    """
    if not isinstance(analysis.gaps, gaps.MeetingGaps):
        return
    if analysis.engagement_gap < np.inf:
        engaged = np.isfinite(analysis.at(nodes, analysis.at_nodes)[0]).astype(float)
    else:
        engaged = analysis.quasistatic(nodes, analysis.at_nodes).force
    along = analysis.force_at_nodes(engaged)
    ends = [
        letter for letter, value in (("A", along[0]), ("E", along[-1])) if value > 0.0
    ]
    if not follows_extended_contact(analysis) and ends:
        where2 = (
            f"meshing_range and contact_range of {pair.driving.name} and "
            f"{pair.driven.name} stop at"
        )
        still = "where pairs are still engaged: extended_contact follows them beyond"
        yield f"{where2} {' and '.join(ends)}, {still}"


def extended_length(
    pair: gear.GearPair,
    analysis: contact.ContactAnalysis,
    wear: Array,
    deflection: Array,
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
    at_handover = last_of_segment[leaves] - grid.intervals[leaves]
    depth = wear + sets.modifications(pair, grid.position)
    return gaps.reach_beyond(
        pair,
        grid.position,
        depth,
        (float(deflection[-1]), float(deflection[at_handover])),
    )
