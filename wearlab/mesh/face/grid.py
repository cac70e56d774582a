"""The nodes of a face: slices, and which profile node of each slice touches when.

A section at y is behind that at mid-face by ``y tan β_b``. On nodes that are equally
far apart, M to the base pitch, slices as far apart as a whole number of them meet each
node exactly, at one of M phases: wear is never interpolated. A spur pair keeps the
nodes of its path, with two sides where load jumps.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.gears import gear, helix
from wearlab.mesh.profile import (
    NO_EXTENSION,
    SAME_PHASE,
    Extension,
    ProfileGrid,
    cubic_weights,
)

HALF = 0.5 - 1e-9
"""Share from which the middle of a slice lies on the path, and so on a node [1]."""
BESIDE_A_JUMP = 1e-9
"""How far from a jump its two sides are looked at [1]."""


class FaceGrid(NamedTuple):
    """Slices across the face, and how they meet the profile.

    Parameters
    ----------
    profile : nodes of every slice
    position : (n_face,) y of the middle of each slice from mid-face, ascending [m]
    width : (n_face,) of each slice [m]
    weight : (n_phases,) of each phase in a mean over the mesh period, summing to 1 [1]
    phase : (n_phases,) mesh phase at mid-face [1]
    node : (n_phases, n_lines, n_face) touching node of the profile that each line
        meets, −1 beyond
    filled : (n_phases, n_lines, n_face) share of each slice that the line crosses on
        the path: a part where the line ends within it, 0 beyond [1]
    even : whether the phases are equally far apart
    """

    profile: ProfileGrid
    position: Array
    width: Array
    weight: Array
    phase: Array
    node: Index
    filled: Array
    even: bool

    @property
    def face_width(self) -> float:
        """Width of all slices [m]."""
        return float(self.width.sum())

    @property
    def inside(self) -> Array:
        """The phases, moved off the two sides of jumps, (n_phases,) [1]."""
        if self.even:
            return self.phase
        count = self.profile.intervals + 1
        begin = np.cumsum(count) - count
        moved = self.phase.copy()
        moved[begin] += BESIDE_A_JUMP
        moved[begin + count - 1] -= BESIDE_A_JUMP
        return moved

    @property
    def shape(self) -> tuple[int, int]:
        """Slices, and wear nodes of each."""
        return len(self.position), len(self.profile.position)

    def at_nodes(self, load: Array) -> Array:
        """Return loads at the wear nodes, (n_face, n_profile).

        Parameters
        ----------
        load : (n_phases, n_lines, n_face) of the lines
        """
        nodal = np.zeros((len(self.position), len(self.profile.contact_position)))
        phase, line, slice_ = np.nonzero(self.filled >= HALF)
        nodal[slice_, self.node[phase, line, slice_]] = load[phase, line, slice_]
        return nodal[:, self.profile.on_flank]

    def at_phases(self, values: Array, phase: Array) -> Array:
        """Return values of the grid's phases (n_phases,) at others (n,).

        By cubics through four of them where they are equally far apart, else straight
        between them.
        """
        if not self.even:
            return np.interp(phase, self.phase, values)
        x = ((phase - self.phase[0]) % 1.0) * len(self.phase)
        low = np.floor(x).astype(np.int64)
        four = values[(low[:, None] + np.arange(-1, 3)) % len(values)]
        return np.asarray((cubic_weights(x - low + 1.0) * four).sum(axis=1))


def lattice(
    pair: gear.GearPair, per_pitch: int, extension: Extension = NO_EXTENSION
) -> ProfileGrid:
    """Lay nodes equally far apart from A on, ``per_pitch`` to the base pitch.

    The last lies at E or before.

    Parameters
    ----------
    pair : the gears, in their transverse section
    per_pitch : M, intervals to a base pitch
    extension : how far pairs may touch beyond A and E
    """
    step = pair.base_pitch / per_pitch
    inside = math.floor(pair.contact_ratio * per_pitch + SAME_PHASE)
    before = math.ceil(extension.approach / step - SAME_PHASE)
    after = math.ceil(extension.recess / step - SAME_PHASE)
    numbers = np.arange(-before, inside + after + 1)
    marks = _segment_marks(per_pitch, before, inside, inside + after)
    first, leading = _first_nodes(marks, per_pitch, before, inside + after)

    on_path = np.arange(inside + 1)
    weight = np.full(inside + 1, step)
    weight[[0, -1]] *= 0.5
    return ProfileGrid(
        breaks=np.array(marks) / per_pitch,
        first=first,
        intervals=np.diff(marks),
        position=np.asarray(pair.path.A + step * on_path),
        phase=(on_path % per_pitch) / per_pitch,
        weight=weight,
        contact_position=np.asarray(pair.path.A + step * numbers),
        before=before,
        leading=leading,
        max_pairs=math.ceil(inside / per_pitch),
    )


def _segment_marks(per_pitch: int, before: int, inside: int, last: int) -> list[int]:
    """Return the nodes of a base pitch between which no pair enters or leaves.

    Parameters
    ----------
    per_pitch : intervals to a base pitch
    before, inside, last : nodes before A; numbers of the node at E and of the last one,
        counted from A
    """
    at_ends = {inside % per_pitch, -before % per_pitch, last % per_pitch}
    return sorted({0, per_pitch} | at_ends)


def _first_nodes(
    marks: Sequence[int], per_pitch: int, before: int, last: int
) -> tuple[Index, int]:
    """Return with which node every pair begins in every segment, and the leading pair.

    (n_segments, n_pairs), see `ProfileGrid.first`.

    Parameters
    ----------
    marks : nodes of a base pitch that bound the segments
    per_pitch, before, last : as in `_segment_marks`
    """
    pairs = range(-math.ceil(before / per_pitch), math.ceil(last / per_pitch))
    leading = pairs[-1]
    first = np.full((len(marks) - 1, len(pairs)), -1, dtype=np.int64)
    for segment, (low, high) in enumerate(pairwise(marks)):
        for number in pairs:
            begin = number * per_pitch + low
            end = number * per_pitch + high
            if begin >= -before and end <= last:
                first[segment, leading - number] = begin + before
    return first, leading


def nodes_per_pitch(contact_ratios: Sequence[float], points: int) -> int:
    """Return how many nodes a base pitch has, so that E of every mesh is nearly a node.

    Parameters
    ----------
    contact_ratios : ε_α of each kind of mesh of a set, which have one base pitch [1]
    points : nodes wanted on the shortest path
    """
    fewest = max(8, round(points / min(contact_ratios)))
    choices = range(fewest, int(1.4 * fewest) + 2)

    def distance_to_last_node(per_pitch: int) -> tuple[float, int]:
        """Return how far E lies beyond a node, in nodes, and the number of nodes."""
        beyond = max((ratio * per_pitch) % 1.0 for ratio in contact_ratios)
        return round(beyond, 9), per_pitch

    return min(choices, key=distance_to_last_node)


def equal_slices(face_width: float, slices: int) -> tuple[Array, Array]:
    """Return the middles and widths of slices of equal width, each (slices,) [m].

    Parameters
    ----------
    face_width : of all slices together [m]
    slices : their number
    """
    width = np.full(slices, face_width / slices)
    return (np.arange(slices) - 0.5 * (slices - 1)) * width, width


def spur_face(profile: ProfileGrid, face_width: float, slices: int) -> FaceGrid:
    """Return the face of a spur pair: equal slices, at the same node at any time.

    Parameters
    ----------
    profile : nodes of the path
    face_width : b [m]
    slices : of equal width
    """
    phase, weight = profile.phase_nodes
    node = np.repeat(profile.pairs_at_phase_nodes[:, :, None], slices, axis=2)
    position, width = equal_slices(face_width, slices)
    filled = np.where(node >= 0, 1.0, 0.0)
    return FaceGrid(
        profile, position, width, weight / weight.sum(), phase, node, filled, even=False
    )


def helical_face(
    profile: ProfileGrid, pair: gear.GearPair, turned: helix.Helix, slices: int
) -> FaceGrid:
    """Return the face of a helical pair, its slices on the lattice of its nodes.

    Where that gives too few slices, they are equal.

    Slices that lie a whole number of nodes apart fill the face from its middle; the two
    at the ends have what is left of it. Where the overlap is so small that they would
    be less than half as many as asked for, they are alike, and turned by the nearest
    whole number of nodes.

    Parameters
    ----------
    profile : a lattice
    pair : the gears, in their transverse section
    turned : the helix
    slices : wanted
    """
    step = float(profile.position[1] - profile.position[0])
    per_pitch = round(pair.base_pitch / step)
    b = pair.face_width
    slope = math.tan(turned.base_angle)
    nodes = b * slope / step
    if nodes < 0.5 * slices:
        position, width = equal_slices(b, slices)
        shift = np.round(position * slope / step).astype(np.int64)
        spacing = 1
    else:
        spacing = max(1, round(nodes / slices))
        position, width, offset = _lattice_slices(b, spacing * step / slope)
        shift = spacing * offset
    shift = shift if turned.sense > 0.0 else -shift

    node, filled = _nodes_met(profile, per_pitch, shift, spacing)
    middle = float(shift.mean()) / per_pitch
    return FaceGrid(
        profile=profile,
        position=position,
        width=width,
        weight=np.full(per_pitch, 1.0 / per_pitch),
        phase=np.arange(per_pitch) / per_pitch - middle,
        node=node,
        filled=filled,
        even=True,
    )


def _lattice_slices(face_width: float, width: float) -> tuple[Array, Array, Index]:
    """Return middles and widths of slices of a width, and their numbers from mid-face.

    The two at the ends have what is left of the face.
    """
    count = max(3, math.ceil(face_width / width - 1e-9))
    offset = np.arange(count) - (count // 2 if count % 2 else count // 2 - 1)

    widths = np.full(count, width)
    end_width = 0.5 * (face_width - (count - 2) * width)
    widths[[0, -1]] = end_width

    position = (offset - offset.mean()) * width
    end = 0.5 * (face_width - end_width)
    position[[0, -1]] = [-end, end]
    return position, widths, offset


def _nodes_met(
    profile: ProfileGrid, per_pitch: int, shift: Index, spacing: int
) -> tuple[Index, Array]:
    """Return the node that each line meets on each slice, and the part that it crosses.

    Both (n_phases, n_lines, n_face), for slices that are ``shift`` nodes behind and
    ``spacing`` nodes wide. A line that ends within a slice whose middle it does not
    reach meets it at the end of the path; beyond, the node is −1 and the part 0.
    """
    last = len(profile.contact_position) - 1
    phases = np.arange(per_pitch)
    furthest = math.ceil((last + 1 + np.abs(shift).max() + spacing) / per_pitch) + 1
    lines = np.arange(furthest, -furthest - 1, -1)

    at_mid_face = phases[:, None, None] + lines[None, :, None] * per_pitch
    number = at_mid_face - shift[None, None, :] + profile.before
    begin = np.maximum(number - 0.5 * spacing, 0.0)
    end = np.minimum(number + 0.5 * spacing, float(last))
    filled = np.maximum(end - begin, 0.0) / spacing

    node = np.where(filled > 0.0, np.clip(number, 0, last), -1)
    is_met = (node >= 0).any(axis=(0, 2))
    return node[:, is_met], filled[:, is_met]
