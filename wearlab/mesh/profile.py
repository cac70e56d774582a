"""The nodes of a flank: the places along the path of contact at which wear is known.

Wear jumps where the number of pairs changes and load passes between points one base
pitch apart. So the grid is cut in phase, not in position: every node has its base-pitch
partners as nodes, A, B, C, D and E are nodes, and the two sides of a jump (B, D) are
two nodes at one position. Where contact begins before A and ends after E, load and wear
change within a layer about as wide as contact extends, on either side. Under light
loads that layer is narrower than the distance of nodes, so that it has a least number
of nodes.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Flags, Index
from wearlab.compiled import jit, jit_inner
from wearlab.gears.gear import GearPair

SAME_PHASE = 1e-9
"""Difference up to which phases are the same [1]."""
LAYER_SHARE = 26.0
"""Nodes on the path over the least intervals of a layer: 8 of 201 nodes."""
LAYER_BOUNDS = (0.12, 0.36)
"""Where layers end that are the same under every load, in base pitches from A and E: of
a module of 4 mm contact reaches 0.1 under 40 N m, 0.24 under 1000 N m."""
LAST_BOUND = 1.0
"""Where the next layer ends under loads that reach further: nodes there are those of A
and E in other pairs [base pitches]."""
LIGHT_REACH = 0.07
"""Reach in base pitches below which layers follow the load: they are too thin."""
BY_CUBIC = np.array([[-11.0, 18.0, -9.0, 2.0], [-2.0, -3.0, 6.0, -1.0]]) / 6.0
BY_QUARTIC = (
    np.array([[-25.0, 48.0, -36.0, 16.0, -3.0], [-3.0, -10.0, 18.0, -6.0, 1.0]]) / 12.0
)
"""Weights of nodes at 0, 1, 2 … for the slope at 0 and at 1, by the polynomial through
them."""


class ProfileGrid(NamedTuple):
    """Nodes on the path of contact and how they meet in phase.

    Parameters
    ----------
    breaks : (n_segments + 1,) phases that bound the smooth segments, 0 first and 1 last
        [1]
    first : (n_segments, n_pairs) touching node with which the pair slot begins in that
        segment, −1 when the pair is out of the path; slots are leading first (slot p
        holds pair ``leading − p``)
    intervals : (n_segments,) node intervals in each segment (even, so that Simpson's
        rule applies)
    position : (n,) path position s of the nodes, ascending, twice where wear may jump
        [m]
    phase : (n,) phase of the nodes, a segment's end counting as its left limit [1]
    weight : (n,) Simpson weights, so that ``sum(weight * f)`` is the integral of f over
        the path [m]
    contact_position : (n_contact,) where pairs may touch: ``position`` and, with
        extended contact, nodes before A and after E, in ascending order; ``first``
        counts among these [m]
    before : number of nodes before A
    leading : which pair the first slot holds; pair j touches at ``s_A + (φ + j) p_b``
    max_pairs : pairs between A and E at most, ⌈ε⌉
    """

    breaks: Array
    first: Index
    intervals: Index
    position: Array
    phase: Array
    weight: Array
    contact_position: Array
    before: int
    leading: int
    max_pairs: int

    @property
    def n_pairs(self) -> int:
        """Largest number of pairs in contact."""
        return self.first.shape[1]

    @property
    def slots(self) -> int:
        """Number of pair slots of datasets, ⌈ε⌉ + 1: the last is for pairs beyond A, E.

        One more where a pair still touches beyond E while the next but ⌈ε⌉ already
        touches before A.
        """
        approaching = self._is_in_contact(-1)
        receding = self._is_in_contact(self.max_pairs)
        return self.max_pairs + 1 + bool(np.any(approaching & receding))

    def _is_in_contact(self, number: int) -> Flags:
        """Return in which segments the pair of a number may touch, (n_segments,)."""
        slots = self.pair_numbers == number
        return np.asarray((self.first[:, slots] >= 0).any(axis=1))

    def into_slots(self, values: Array, absent: float) -> Array:
        """Return values of pairs by slots of datasets, (slots, n), leading first.

        The slot after the ⌈ε⌉ of the path holds the pair that approaches A, and early
        in the period one that is further beyond E than a whole number of base pitches
        from A; where both touch at once, the latter has a slot of its own.

        Parameters
        ----------
        values : (n_pairs, n) of the pairs
        absent : the value of a pair that is out of the path, and of an empty slot
        """
        slots = np.full((self.slots, values.shape[1]), absent)
        for number, row in zip(self.pair_numbers, values, strict=True):
            slot = self.max_pairs - 1 - number
            if number >= self.max_pairs:
                slot = self.slots - 1
            present = ~np.isnan(row) if np.isnan(absent) else row != absent
            slots[slot] = np.where(present, row, slots[slot])
        return slots

    @property
    def pair_numbers(self) -> Index:
        """Which pair each slot holds, (n_pairs,); −1 is the one that approaches A."""
        return self.leading - np.arange(self.n_pairs)

    @property
    def on_flank(self) -> slice:
        """Which of the touching nodes lie on the active flank A–E."""
        return slice(self.before, self.before + len(self.position))

    @property
    def is_beyond(self) -> Flags:
        """Whether touching nodes lie before A or after E, (n_contact,)."""
        is_beyond = np.ones(len(self.contact_position), bool)
        is_beyond[self.on_flank] = False
        return is_beyond

    @property
    def loaded(self) -> Array:
        """Where teeth are loaded when pairs touch: on A–E, (n_contact,) [m]."""
        return np.clip(self.contact_position, self.position[0], self.position[-1])

    def beyond(self, values: Array) -> Array:
        """Return values at all touching nodes: beyond A and E those at A and E.

        Parameters
        ----------
        values : (…, n) at the nodes on A–E

        Returns
        -------
        (…, n_contact)
        """
        n_contact = len(self.contact_position)
        n_after = n_contact - len(self.position) - self.before
        if not self.before and not n_after:
            return values

        extended = np.empty((*values.shape[:-1], n_contact), values.dtype)
        extended[..., self.on_flank] = values
        extended[..., : self.before] = values[..., :1]
        extended[..., n_contact - n_after :] = values[..., -1:]
        return extended

    @property
    def sliding_sense(self) -> Array:
        """Sign of s of each slot in each segment: 1 recess, −1 approach, 0 no pair.

        The pitch point is a break, so that no segment has both.
        """
        middle = self.first + self.intervals[:, None] // 2
        return np.where(self.first >= 0, np.sign(self.contact_position[middle]), 0.0)

    @property
    def phase_nodes(self) -> tuple[Array, Array]:
        """Phases of all nodes of all segments, and Simpson weights over a period [1].

        Both (n_phase_nodes,).
        """
        phases = []
        weights = []
        for low, high, count in zip(
            self.breaks[:-1], self.breaks[1:], self.intervals, strict=True
        ):
            phases.append(np.linspace(low, high, count + 1))
            weights.append(simpson_weights(count) * (high - low))
        return np.concatenate(phases), np.concatenate(weights)

    @property
    def pairs_at_phase_nodes(self) -> Index:
        """Contact node of each slot at each phase node, −1 without.

        (n_phase_nodes, n_pairs).
        """
        first = np.repeat(self.first, self.intervals + 1, axis=0)
        step = np.concatenate([np.arange(count + 1) for count in self.intervals])
        return np.where(first >= 0, first + step[:, None], -1)


def simpson_weights(intervals: int) -> Array:
    """Return the weights of Simpson's composite rule on the unit interval [1].

    Parameters
    ----------
    intervals : an even number

    Returns
    -------
    (intervals + 1,)

    References
    ----------
    Abramowitz & Stegun, Handbook of Mathematical Functions, 1964, 25.4.6.
    """
    weights = np.full(intervals + 1, 2.0)
    weights[1::2] = 4.0
    weights[[0, -1]] = 1.0
    return weights / (3.0 * intervals)


class Extension(NamedTuple):
    """How far pairs may touch beyond the path, along the line of action.

    Parameters
    ----------
    approach, recess : before A and after E [m]
    """

    approach: float
    recess: float


NO_EXTENSION = Extension(0.0, 0.0)


class ExtensionInPitches(NamedTuple):
    """How far pairs may touch beyond the path, in base pitches.

    Parameters
    ----------
    approach, recess : before A and after E [1]
    """

    approach: float
    recess: float

    def in_metres(self, base_pitch: float) -> Extension:
        """Return the extension of a pair with a base pitch [m].

        Parameters
        ----------
        base_pitch : of the pair, transverse [m]
        """
        return Extension(self.approach * base_pitch, self.recess * base_pitch)


Layer = tuple[float, float]
"""From where to where, in base pitches from A, load and wear change fast [1]."""


def profile_grid(
    pair: GearPair,
    points: int,
    kinks: tuple[float, ...] = (),
    jumps: tuple[float, ...] = (),
    extension: Extension = NO_EXTENSION,
    layer_bounds: Sequence[float] = (),
) -> ProfileGrid:
    """Lay about ``points`` nodes on the path of contact.

    Parameters
    ----------
    pair : the gear pair
    points : nodes wanted on the path A–E; every smooth segment gets at least five, and
        layers their own
    kinks : further path positions at which the flank bends (ends of reliefs) [m]
    jumps : further phases at which a prescribed stiffness jumps [1]
    extension : how far pairs may touch beyond A and E
    layer_bounds : where layers end whatever the load, in base pitches from A and E; the
        nodes on the path are then the same under every load [as wide as the extension]
    """
    pitch = pair.base_pitch
    ratio = pair.contact_ratio
    earliest = -_whole_layers(extension.approach / pitch, layer_bounds)
    latest = ratio + _whole_layers(extension.recess / pitch, layer_bounds)

    all_jumps = distinct([0.0, ratio % 1.0, *jumps])
    bends = [((s - pair.path.A) / pitch) % 1.0 for s in (pair.path.C, *kinks)]
    layers = _layers(earliest, ratio, latest, layer_bounds)
    bounds = [bound % 1.0 for layer in layers for bound in layer]
    breaks = np.array([*distinct([*all_jumps, *bends, *bounds]), 1.0])
    intervals = _intervals(breaks, layers, points, ratio)

    nodes = _lay_nodes(pair, breaks, intervals, all_jumps, earliest, latest)
    on_flank = nodes.on_flank
    return ProfileGrid(
        breaks=breaks,
        first=nodes.first,
        intervals=intervals,
        position=nodes.position[on_flank],
        phase=nodes.phase[on_flank],
        weight=nodes.weight[on_flank],
        contact_position=nodes.position,
        before=int(np.argmax(on_flank)),
        leading=nodes.leading,
        max_pairs=int(np.ceil(ratio - SAME_PHASE)),
    )


def _whole_layers(reach: float, layer_bounds: Sequence[float]) -> float:
    """Return a reach up to the end of the layer that it ends in, in base pitches."""
    if reach <= 0.0:
        return 0.0
    beyond = (bound for bound in layer_bounds if bound >= reach - SAME_PHASE)
    return next(beyond, reach)


def _layers(
    earliest: float, ratio: float, latest: float, layer_bounds: Sequence[float]
) -> list[Layer]:
    """Return the layers on both sides of A and E.

    They are as wide as contact extends there, or end at given bounds.
    """
    if not layer_bounds:
        layers_of_load = (
            (earliest, 0.0),
            (0.0, -earliest),
            (ratio - (latest - ratio), ratio),
            (ratio, latest),
        )
        return [(low, high) for low, high in layers_of_load if high > low]

    layers: list[Layer] = []
    for low, high in pairwise([0.0, *layer_bounds]):
        for end in (0.0, ratio):
            layers += [(end - high, end - low), (end + low, end + high)]
    return layers


def bounds_of_layers(reach: float) -> tuple[float, ...]:
    """Return where layers end that are the same under every load, in base pitches.

    None under a light load, whose layers follow it; more under one that reaches beyond
    the usual bounds.

    Parameters
    ----------
    reach : how far contact may extend beyond A or E, in base pitches

    Examples
    --------
    >>> bounds_of_layers(0.2)
    (0.12, 0.36)
    """
    if reach < LIGHT_REACH:
        return ()
    if reach > LAYER_BOUNDS[-1] + SAME_PHASE:
        return (*LAYER_BOUNDS, LAST_BOUND)
    return LAYER_BOUNDS


def _intervals(
    breaks: Array, layers: Sequence[Layer], points: int, ratio: float
) -> Index:
    """Return the number of intervals of every segment, even and four at least."""
    density = np.full(len(breaks) - 1, points / ratio)
    middle = 0.5 * (breaks[:-1] + breaks[1:])
    for low, high in layers:
        inside = (middle - low) % 1.0 < high - low
        in_layer = points / LAYER_SHARE / (high - low)
        density[inside] = np.maximum(density[inside], in_layer)
    halves = np.ceil(0.5 * density * np.diff(breaks) - 1e-9)
    return np.maximum(4, 2 * halves.astype(np.int64))


class _LaidNodes(NamedTuple):
    """All touching nodes in ascending order, (n_contact,) each, see `ProfileGrid`."""

    position: Array
    phase: Array
    weight: Array
    on_flank: Flags
    first: Index
    leading: int


def _lay_nodes(
    pair: GearPair,
    breaks: Array,
    intervals: Index,
    jumps: Sequence[float],
    earliest: float,
    latest: float,
) -> _LaidNodes:
    """Lay nodes segment after segment, from the first place of contact to the last.

    Neighbouring segments share the node between them, but at a jump.
    """
    approaching = int(np.ceil(-earliest - SAME_PHASE))
    pairs = range(-approaching, int(np.ceil(latest - SAME_PHASE)))
    leading = pairs[-1]
    first = np.full((len(intervals), len(pairs)), -1, dtype=np.int64)
    pieces: list[Array] = []
    count = 0

    for number in pairs:
        for segment, n_intervals in enumerate(intervals):
            low = breaks[segment]
            high = breaks[segment + 1]
            middle = number + 0.5 * (low + high)
            if not earliest < middle < latest:
                continue

            piece = _piece(pair, number, low, high, n_intervals)
            begins_at_jump = any(abs(low - jump) < SAME_PHASE for jump in jumps)
            is_shared = count > 0 and not begins_at_jump
            first[segment, leading - number] = count - is_shared
            if is_shared:
                pieces[-1][2, -1] += piece[2, 0]
                piece = piece[:, 1:]
            pieces.append(piece)
            count += piece.shape[1]

    position, phase, weight, on_flank = np.concatenate(pieces, axis=1)
    return _LaidNodes(position, phase, weight, on_flank > 0.0, first, leading)


def _piece(
    pair: GearPair, number: int, low: float, high: float, n_intervals: int
) -> Array:
    """Return the nodes of one pair in one segment, (4, n_intervals + 1).

    Rows: path position, phase, weight, whether on the flank.
    """
    pitch = pair.base_pitch
    phase = np.linspace(low, high, n_intervals + 1)
    position = pair.path.A + (phase + number) * pitch
    weight = simpson_weights(n_intervals) * (high - low) * pitch
    middle = number + 0.5 * (low + high)
    on_flank = np.full(len(phase), 0.0 < middle < pair.contact_ratio)
    return np.stack([position, phase, weight, on_flank])


def distinct(phases: Sequence[float]) -> list[float]:
    """Return phases in [0, 1), ascending, without those equal to another or to 1.

    Parameters
    ----------
    phases : in any order [1]
    """
    result: list[float] = []
    for phase in sorted(phases):
        is_new = not result or phase - result[-1] > SAME_PHASE
        if is_new and 1.0 - phase > SAME_PHASE:
            result.append(phase)
    return result


class Lookup(NamedTuple):
    """Cubic interpolation from nodes to given phases, per smooth segment.

    Parameters
    ----------
    phase : (n,) the phases [1]
    segment : (n,) smooth segment of each phase
    offset : (n,) first of the four nodes used, counted from the segment's first node
    weight : (n, 4) Lagrange weights [1]
    """

    phase: Array
    segment: Index
    offset: Index
    weight: Array


def cubic_weights(t: Array) -> Array:
    """Return the Lagrange weights of nodes at 0, 1, 2 and 3, (n, 4) [1].

    Parameters
    ----------
    t : (n,) places among the nodes [1]
    """
    a = t - 1
    b = t - 2
    c = t - 3
    of_0 = -a * b * c / 6
    of_1 = t * b * c / 2
    of_2 = -t * a * c / 2
    of_3 = t * a * b / 6
    return np.stack([of_0, of_1, of_2, of_3], axis=1)


@jit_inner(counted=False)
def slope_at(values, first, last, node, at_end):  # type: ignore[no-untyped-def]
    """Return the slope at one of the equally spaced nodes of a segment, per spacing.

    A central difference of fourth order, at the ends that of a polynomial: slopes that
    are interpolated between the nodes do not jump at them.

    Parameters
    ----------
    values : at the nodes
    first, last : nodes of a smooth segment, five or more
    node : one of them
    at_end : `BY_CUBIC` or `BY_QUARTIC`

    References
    ----------
    Abramowitz & Stegun, Handbook of Mathematical Functions, 1964, 25.2.
    """
    from_first = node - first
    from_last = last - node
    slope = 0.0
    if from_first < 2:
        for i in range(at_end.shape[1]):
            slope += at_end[from_first, i] * values[first + i]
    elif from_last < 2:
        for i in range(at_end.shape[1]):
            slope -= at_end[from_last, i] * values[last - i]
    else:
        near = values[node + 1] - values[node - 1]
        far = values[node + 2] - values[node - 2]
        slope = (8.0 * near - far) / 12.0
    return slope


def lookup(grid: ProfileGrid, phase: Array, segment: Index | None = None) -> Lookup:
    """Prepare the interpolation of node values to phases, within one segment each.

    Parameters
    ----------
    grid : the nodes
    phase : (n,) phases in [0, 1] [1]
    segment : (n,) the segment whose side is meant; by default the one that begins at or
        before the phase
    """
    phase = np.ravel(np.asarray(phase, float))
    if segment is None:
        segment = np.searchsorted(grid.breaks, phase + SAME_PHASE, side="right") - 1
        segment = np.clip(segment, 0, len(grid.intervals) - 1)
    low = grid.breaks[segment]
    high = grid.breaks[segment + 1]
    count = grid.intervals[segment]
    x = (phase - low) / (high - low) * count
    offset = np.clip(np.floor(x).astype(np.int64) - 1, 0, count - 3)
    return Lookup(phase, segment, offset, cubic_weights(x - offset))


def at_phase_nodes(grid: ProfileGrid) -> Lookup:
    """Return the look-up of the phase nodes themselves, each in its own segment."""
    phases, _ = grid.phase_nodes
    numbers = np.arange(len(grid.intervals))
    return lookup(grid, phases, np.repeat(numbers, grid.intervals + 1))


def interpolate(
    grid: ProfileGrid, where: Lookup, values: Array, absent: float
) -> Array:
    """Return values of all pairs at the prepared phases, (…, n, n_pairs).

    Parameters
    ----------
    grid : the nodes
    where : the phases
    values : (…, n_contact) at the touching nodes
    absent : value of slots whose pair is out of the path
    """
    rows = np.ascontiguousarray(values, float).reshape(-1, values.shape[-1])
    out = np.empty((len(rows), len(where.segment), grid.first.shape[1]))
    _interpolate(grid.first, where, rows, absent, out)
    return out.reshape(*values.shape[:-1], *out.shape[1:])


@jit
def _interpolate(
    first: Index, where: Lookup, values: Array, absent: float, out: Array
) -> None:
    """Fill ``out`` (n_rows, n, n_pairs) from node values (n_rows, n_contact)."""
    for row in range(out.shape[0]):
        for i in range(out.shape[1]):
            for pair in range(out.shape[2]):
                node = first[where.segment[i], pair]
                if node < 0:
                    out[row, i, pair] = absent
                    continue
                begin = node + where.offset[i]
                value = 0.0
                for q in range(4):
                    value += where.weight[i, q] * values[row, begin + q]
                out[row, i, pair] = value
