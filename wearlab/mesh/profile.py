"""The nodes of a flank: where along the path of contact wear lives.

Wear jumps where the number of pairs changes and load passes between points one base
pitch apart. So the grid is cut in phase, not in position: every node has its base-pitch
partners as nodes, A, B, C, D and E are nodes, and the two sides of a jump (B, D) are
two nodes at one position. Where contact begins before A and ends after E, load and wear
change within a layer about as wide as contact extends, on either side; light loads make
it narrower than nodes lie apart, so that it has a least number of its own.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.compiled import jit
from wearlab.gears.gear import GearPair

SAME_PHASE = 1e-9


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
    most_pairs : pairs between A and E at most, ⌈ε⌉
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
    most_pairs: int

    @property
    def n_pairs(self) -> int:
        """Largest number of pairs in contact."""
        return self.first.shape[1]

    @property
    def slots(self) -> int:
        """Number of pair slots of datasets, ⌈ε⌉ + 1: the last one is for pairs beyond A and E.

        One more where a pair still touches beyond E while the next but ⌈ε⌉ already
        touches before A.
        """
        ends = [
            (self.first[:, self.pair_numbers == j] >= 0).any(axis=1)
            for j in (-1, self.most_pairs)
        ]
        return self.most_pairs + 1 + bool(np.any(ends[0] & ends[1]))

    def into_slots(self, values: Array, absent: float) -> Array:
        """Return values of the pairs (n_pairs, n) by slots of datasets (slots, n), leading first.

        The slot after the ⌈ε⌉ of the path holds the pair that approaches A, and early
        in the period one that is further beyond E than a whole number of base pitches
        from A; where both touch at once, the latter has a slot of its own.
        """
        slots = np.full((self.slots, values.shape[1]), absent)
        for number, row in zip(self.pair_numbers, values, strict=True):
            slot = (
                self.most_pairs - 1 - number
                if number < self.most_pairs
                else self.slots - 1
            )
            slots[slot] = np.where(
                ~np.isnan(row) if np.isnan(absent) else row != absent, row, slots[slot]
            )
        return slots

    @property
    def pair_numbers(self) -> Index:
        """Which pair each slot holds, j = −1 being the one that approaches A, (n_pairs,)."""
        return self.leading - np.arange(self.n_pairs)

    @property
    def on_flank(self) -> slice:
        """Which of the touching nodes lie on the active flank A–E."""
        return slice(self.before, self.before + len(self.position))

    @property
    def loaded(self) -> Array:
        """Where teeth are taken to bend when pairs touch: no further than A and E, (n_contact,) [m]."""
        return np.clip(self.contact_position, self.position[0], self.position[-1])

    def beyond(self, values: Array) -> Array:
        """Carry node values (…, n) to all touching nodes (…, n_contact), beyond A and E the end values."""
        after = len(self.contact_position) - len(self.position) - self.before
        if not self.before and not after:
            return values
        carried = np.empty(
            (*values.shape[:-1], len(self.contact_position)), values.dtype
        )
        carried[..., self.on_flank] = values
        carried[..., : self.before] = values[..., :1]
        carried[..., len(self.contact_position) - after :] = values[..., -1:]
        return carried

    @property
    def sliding_sense(self) -> Array:
        """Sign of s of each slot in each segment, which the pitch point bounds: 1 recess, −1 approach."""
        middle = self.first + self.intervals[:, None] // 2
        return np.where(self.first >= 0, np.sign(self.contact_position[middle]), 0.0)

    @property
    def phase_nodes(self) -> tuple[Array, Array]:
        """Phases of all (segment, node) and their Simpson weights over one period, (n_phase_nodes,) [1]."""
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
        """Contact node of each slot at each phase node, −1 without, (n_phase_nodes, n_pairs)."""
        first = np.repeat(self.first, self.intervals + 1, axis=0)
        step = np.concatenate([np.arange(count + 1) for count in self.intervals])
        return np.where(first >= 0, first + step[:, None], -1)


def simpson_weights(intervals: int) -> Array:
    """Return the weights of Simpson's composite rule on the unit interval, (intervals + 1,) [1].

    References
    ----------
    Abramowitz & Stegun, Handbook of Mathematical Functions, 1964, 25.4.6.
    """
    weights = np.full(intervals + 1, 2.0)
    weights[1::2] = 4.0
    weights[[0, -1]] = 1.0
    return weights / (3.0 * intervals)


class Extension(NamedTuple):
    """How far pairs may touch beyond the path, along the line of action [m].

    Parameters
    ----------
    approach, recess : before A and after E
    """

    approach: float
    recess: float


NO_EXTENSION = Extension(0.0, 0.0)


def profile_grid(
    pair: GearPair,
    points: int,
    kinks: tuple[float, ...] = (),
    jumps: tuple[float, ...] = (),
    extension: Extension = NO_EXTENSION,
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
    """
    pitch = pair.base_pitch
    start = pair.path.A
    ratio = pair.contact_ratio
    earliest = -extension.approach / pitch
    latest = ratio + extension.recess / pitch
    jumps = tuple(distinct([0.0, ratio % 1.0, *jumps]))
    bends = [((s - start) / pitch) % 1.0 for s in (pair.path.C, *kinks)]
    before_and_after = (
        (earliest, 0.0),
        (0.0, -earliest),
        (ratio - (latest - ratio), ratio),
        (ratio, latest),
    )
    layers = [(low, high) for low, high in before_and_after if high > low]
    bounds = [bound % 1.0 for layer in layers for bound in layer]
    breaks = np.array([*distinct([*jumps, *bends, *bounds]), 1.0])
    density = np.full(len(breaks) - 1, points / ratio)
    for low, high in layers:
        inside = (0.5 * (breaks[:-1] + breaks[1:]) - low) % 1.0 < high - low
        # intervals, over the nodes on the path, that each layer beside A or E has at
        # least: 8 of 201 nodes
        density[inside] = np.maximum(density[inside], points / 26.0 / (high - low))
    halves = np.ceil(0.5 * density * np.diff(breaks) - 1e-9)
    intervals = np.maximum(4, 2 * halves.astype(np.int64))
    pairs = range(
        -int(np.ceil(-earliest - SAME_PHASE)), int(np.ceil(latest - SAME_PHASE))
    )
    first = np.full((len(intervals), len(pairs)), -1, dtype=np.int64)
    table = np.empty(
        (4, 0)
    )  # position, phase and weight of the nodes, and whether they lie on the flank
    for j in pairs:
        for m, count in enumerate(intervals):
            low = breaks[m]
            high = breaks[m + 1]
            middle = j + 0.5 * (low + high)
            if not earliest < middle < latest:
                continue
            at = np.linspace(low, high, count + 1)
            weights = simpson_weights(count) * (high - low) * pitch
            shared = table.shape[1] > 0 and not any(
                abs(low - jump) < SAME_PHASE for jump in jumps
            )
            first[m, pairs[-1] - j] = table.shape[1] - shared
            if shared:
                table[2, -1] += weights[0]
            piece = np.stack(
                [
                    start + (at + j) * pitch,
                    at,
                    weights,
                    np.full(len(at), 0.0 < middle < ratio),
                ]
            )
            table = np.concatenate([table, piece[:, shared:]], axis=1)
    flank = table[3] > 0.0
    position, phase, weight = table[:3].compress(flank, axis=1)
    before = int(np.argmax(flank))
    most_pairs = int(np.ceil(ratio - SAME_PHASE))
    nodes = position, phase, weight, table[0]
    return ProfileGrid(breaks, first, intervals, *nodes, before, pairs[-1], most_pairs)


def distinct(phases: Sequence[float]) -> list[float]:
    """Return ascending phases in [0, 1), dropping those that coincide with another or with 1."""
    kept: list[float] = []
    for phase in sorted(phases):
        if (not kept or phase - kept[-1] > SAME_PHASE) and 1.0 - phase > SAME_PHASE:
            kept.append(phase)
    return kept


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
    """Return the Lagrange weights of nodes at 0, 1, 2 and 3 for places t (n,) among them, (n, 4) [1]."""
    a = t - 1
    b = t - 2
    c = t - 3
    return np.stack(
        [-a * b * c / 6, t * b * c / 2, -t * a * c / 2, t * a * b / 6], axis=1
    )


BY_CUBIC = np.array([[-11.0, 18.0, -9.0, 2.0], [-2.0, -3.0, 6.0, -1.0]]) / 6.0
BY_QUARTIC = (
    np.array([[-25.0, 48.0, -36.0, 16.0, -3.0], [-3.0, -10.0, 18.0, -6.0, 1.0]]) / 12.0
)
"""Weights of nodes at 0, 1, 2 … for the slope at 0 and at 1, by the polynomial through
them."""


def slopes(values: Array, at_end: Array) -> Array:
    """Return the slopes at equally spaced nodes (n, …), per spacing.

    Central differences of fourth order, at the ends those of a polynomial: slopes that
    are interpolated between the nodes do not jump at them.

    Parameters
    ----------
    values : at the nodes of a smooth segment, five or more
    at_end : `BY_CUBIC` or `BY_QUARTIC`

    References
    ----------
    Abramowitz & Stegun, Handbook of Mathematical Functions, 1964, 25.2.
    """
    slope = np.empty_like(values)
    last = at_end.shape[1]
    slope[2:-2] = (
        values[:-4] - 8.0 * values[1:-3] + 8.0 * values[3:-1] - values[4:]
    ) / 12.0
    slope[:2] = np.tensordot(at_end, values[:last], axes=1)
    slope[:-3:-1] = -np.tensordot(at_end, values[: -last - 1 : -1], axes=1)
    return slope


def lookup(grid: ProfileGrid, phase: Array, segment: Index | None = None) -> Lookup:
    """Prepare the interpolation of node values to phases (one-sided within each segment).

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
    return lookup(
        grid, phases, np.repeat(np.arange(len(grid.intervals)), grid.intervals + 1)
    )


def interpolate(
    grid: ProfileGrid, where: Lookup, values: Array, absent: float
) -> Array:
    """Return values at the touching nodes (…, n_contact) at the prepared phases, (…, n, n_pairs).

    Slots whose pair is out of the path get ``absent``.
    """
    rows = np.ascontiguousarray(values, float).reshape(-1, values.shape[-1])
    out = np.empty((len(rows), len(where.segment), grid.first.shape[1]))
    _interpolate(grid.first, where, rows, absent, out)
    return out.reshape(*values.shape[:-1], *out.shape[1:])


@jit
def _interpolate(
    first: Index, where: Lookup, values: Array, absent: float, out: Array
) -> None:
    """Fill ``out`` (n_rows, n, n_pairs) with rows of node values (n_rows, n_contact) at phases."""
    for row in range(out.shape[0]):
        for i in range(out.shape[1]):
            for pair in range(out.shape[2]):
                node = first[where.segment[i], pair]
                if node < 0:
                    out[row, i, pair] = absent
                    continue
                value = 0.0
                for q in range(4):
                    value += (
                        where.weight[i, q] * values[row, node + where.offset[i] + q]
                    )
                out[row, i, pair] = value
