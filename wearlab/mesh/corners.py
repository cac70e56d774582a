"""Gaps beyond A and E to first order in wear: the end of one flank against the points that its mate turns by.

Before A the driven tip meets the driving flank, after E the driving tip the driven one, both inside the
active flanks. Geometry knows neither load nor wear, so it is a table: the unworn separation of each node near
the tip from the mate, and which point of the mate it meets. Wear adds what is gone of both points, and the
pair touches where the sum is least: at the tip corner, or inside of it where the tip is worn round.
"""

import math
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Complex, Index
from wearlab.gears.gear import DRIVEN, DRIVING, TIP_AT, GearPair
from wearlab.mesh.beyond import beyond_path
from wearlab.mesh.profile import Extension

NEAR_TIP = 0.3
"""Base pitches from the tip within which a worn flank may touch beyond the path."""
SCAN, CLOSE = 33, 1e-6
"""Positions of a scan for the end of contact, and how narrowly it is enclosed, of the furthest."""
TURNS = 40
"""Steps by which the driven gear is turned back; each leaves a tenth to a third of the last."""
AS_GOOD_AS_MET = 1e-12
"""Base pitches by which the last step may still turn the flanks: a thousandth of an atom."""


class Corner(NamedTuple):
    """The flank of a tip against its mate, at positions beyond one end of the path.

    Parameters
    ----------
    gear : whose tip it is, 0 driving, 1 driven
    own : (m,) nodes near the tip, the tip itself first
    separation : (n, m) gap of these points of the unworn flank from the mate, along the line of action [m]
    mate : (n, m) path position of the mate's point each would meet [m]
    position : (n_nodes,) path positions of the nodes [m]
    """

    gear: int
    own: Index
    separation: Array
    mate: Array
    position: Array

    def gap(self, removed: Array) -> Array:
        """Return the smallest gap for material removed from the flanks (2, n_nodes), (n,) [m]."""
        theirs = np.interp(self.mate, self.position, removed[1 - self.gear])
        return np.asarray((self.separation + theirs + removed[self.gear, self.own]).min(axis=1))


def corner(pair: GearPair, end: str, x: Array, position: Array) -> Corner:
    """Lay out the geometry of one end of the path.

    Parameters
    ----------
    pair : the gears
    end : "A" (tip of the driven gear) or "E" (tip of the driving gear)
    x : (n,) positions to which the gears have turned, beyond that end or at it [m along the line of action]
    position : (n_nodes,) path positions of the nodes, A to E [m]

    References
    ----------
    Munro, Morrish & Palmer 1999: tip corners touch beyond the ends of the path.
    """
    gear, tip = TIP_AT[end], getattr(pair.path, end)
    own = np.flatnonzero(np.abs(position - tip) <= NEAR_TIP * pair.base_pitch)
    own = own if gear == DRIVEN else own[::-1]
    separation, mate = separations(pair, gear, np.asarray(x, float)[:, None], position[own])
    return Corner(gear, own, separation, mate, position)


def unworn_extension(pair: GearPair, deflection: float) -> Extension:
    """Return how far beyond A and E a deflection keeps the tip corners of unworn gears touching [m].

    References
    ----------
    Munro, Morrish & Palmer 1999: tip corners touch beyond the ends of the path.
    """

    def gap(x: Array) -> Array:
        gear, tip = (DRIVEN, pair.path.A) if x[-1] < pair.path.C else (DRIVING, pair.path.E)
        return separations(pair, gear, x, np.array(tip))[0]

    return beyond_path(pair, gap, (deflection, deflection), CLOSE, SCAN)


def separations(pair: GearPair, gear: int, x: Array, s: Array) -> tuple[Array, Array]:
    """Return how far points of one unworn flank are from the mate, and the mate's points they meet.

    A flank point that touches at s lies, with its gear turned to x, at the angle (x − s)/r_b from there. The
    mate's point at the same distance from the mate's centre touches at s', and lies (x − s')/r_b' from there.
    The separation is how far the driven gear must turn back until the two meet: at once for its own points,
    step by step where its points are those that meet the driving flank.

    Parameters
    ----------
    pair : the gears
    gear : whose points, 0 driving, 1 driven
    x : positions to which the gears have turned [m along the line of action]
    s : path positions of the points [m]; broadcasts with x

    Returns
    -------
    separation, times the driven base radius [m], and s' [m], of the broadcast shape

    References
    ----------
    Munro, Morrish & Palmer 1999: tip corners touch beyond the ends of the path.
    """
    if gear == DRIVING:
        return _apart(pair, DRIVING, x, x, s)
    turned = x + 0.0 * s
    for _ in range(TURNS):
        apart, theirs = _apart(pair, DRIVEN, turned, x, s)
        turned = turned - apart
        if np.abs(apart).max(initial=0.0) <= AS_GOOD_AS_MET * pair.base_pitch:
            break
    return x - turned, theirs


def _apart(pair: GearPair, gear: int, own: Array, x: Array, s: Array) -> tuple[Array, Array]:
    """Return the distance of points of a gear turned to ``own`` from its mate turned to x, and s' [m]."""
    other = 1 - gear
    frame = _frame(pair)
    centre = frame.centre
    place = _turned(pair, gear, own, s, frame)
    theirs = _position_at(pair, other, np.abs(place - centre[other]), frame)
    mate = _turned(pair, other, x, theirs, frame)
    angle = np.angle((place - centre[other]) / (mate - centre[other]))
    # the driven flank lies ahead of the driving one in the sense in which each gear turns
    ahead = _sense(pair, other) * (1.0 if gear == DRIVEN else -1.0)
    return ahead * pair.gears[other].base_radius * angle, theirs


class _Frame(NamedTuple):
    """A pair in the plane of complex numbers: pitch point, unit vector along the line of action, centres."""

    pitch: complex
    along: complex
    centre: tuple[complex, complex]


def _frame(pair: GearPair) -> _Frame:
    alpha = pair.working_pressure_angle
    first, second = (gear.base_radius / math.cos(alpha) for gear in pair.gears)
    towards = -1.0 if pair.driving.internal else 1.0
    apart = first - second if pair.internal else first + second
    along = complex(towards * math.sin(alpha), math.cos(alpha))
    return _Frame(complex(first), along, (0j, complex(apart)))


def _sense(pair: GearPair, gear: int) -> float:
    """Return the sense in which a gear turns, the driving one counter-clockwise."""
    return -1.0 if gear == DRIVEN and not pair.internal else 1.0


def _turned(pair: GearPair, gear: int, x: Array, s: Array, frame: _Frame) -> Complex:
    arm = frame.pitch + s * frame.along - frame.centre[gear]
    turn = _sense(pair, gear) * (x - s) / pair.gears[gear].base_radius
    return np.asarray(frame.centre[gear] + arm * np.exp(1j * turn))


def _position_at(pair: GearPair, gear: int, distance: Array, frame: _Frame) -> Array:
    """Return the path position at which a gear touches at a distance from its centre [m]."""
    foot = -((frame.pitch - frame.centre[gear]) * frame.along.conjugate()).real
    side = np.sign(0.5 * (pair.path.A + pair.path.E) - foot)
    base = pair.gears[gear].base_radius
    return np.asarray(foot + side * np.sqrt(np.maximum(0.0, distance**2 - base**2)))
