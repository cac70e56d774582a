"""Teeth that meet beyond A and E under static load, by finite elements and nothing of
the contact analysis.

At each phase every pair of teeth in or near contact gets its meeting point, normal and
distance from the drawn outlines (:mod:`.outline_contact`). All points of all phases are
loads of one finite-element solution of each gear, along the common normals: a tip
corner is loaded on the mate's normal, over a patch that ends at its edge. The forces
then solve the unilateral problem with the full compliance matrix of the pairs,

    C F + g = a Δ + w,  F ≥ 0, w ≥ 0, F w = 0,  a·F = T,

a the arms of the normals about the driving gear, Δ its turn under the torque T, by
non-negative least squares and a bracketed root for Δ. The contact itself yields after
Weber and Banaschek, iterated with the forces; a corner as the flanks do at A or E.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from outline_contact import Outlines, Touch
from scipy.optimize import brentq, nnls

from wearlab.gears.gear import GearPair
from wearlab.gears.outline import contact_depth
from wearlab.mesh.finite_element.compliance import through_cuts
from wearlab.mesh.finite_element.elements import (
    Options,
    flank_loads,
    half_plane_compliance,
    sector,
)
from wearlab.mesh.finite_element.outline import LoadedFlank, chart
from wearlab.mesh.stiffness import WeberContact

Array = NDArray[np.float64]

OPTIONS = Options(refinement=4, patch=0.05)
"""A patch about as wide as the contact, so that a corner is loaded close to its
edge."""
FURTHEST = 0.95
"""Base pitches beyond A and E where pairs are still looked at."""
ROUNDED = 1e-9
"""Of a flank's parameter: a path may begin where the involute does."""
ITERATIONS, TOLERANCE, LOOSER = 200, 1e-9, 1e-5
PAIRS = range(-1, 3)
"""Pairs looked at; pair j would touch at ``s_A + (φ + j) p_b``."""


@dataclass(frozen=True)
class Loaded:
    """The mesh under its static torque.

    Parameters
    ----------
    phase : (n,) [1]
    position : (n, n_pairs) where each pair would touch on the path [m]
    gap : (n, n_pairs) turn of the driven gear until they meet, times its base radius;
        inf: out of reach [m]
    force : (n, n_pairs) along the common normal [N]
    deflection : (n,) turn of the driving gear under the torque, times its base radius
        [m]
    """

    phase: Array
    position: Array
    gap: Array
    force: Array
    deflection: Array


@dataclass(frozen=True)
class Meeting:
    """The pairs of one phase: which, where they meet, what they yield
    together, and their contacts.
    """

    number: NDArray[np.int64]
    touches: Sequence[Touch]
    compliance: Array
    contacts: "Contacts"

    def forces(self, turn: float, force: Array) -> Array:
        """Return the forces along the normals (n,) [N] at a turn of the driving gear
        [rad], from a guess.
        """
        arm, gap = (
            np.array(each)
            for each in zip(
                *((t.arm[0], t.normal_gap) for t in self.touches), strict=True
            )
        )
        for _ in range(ITERATIONS):
            C = self.compliance + np.diag(self.contacts.compliance(force))
            factor = np.linalg.cholesky(C)
            updated: Array = nnls(factor.T, np.linalg.solve(factor, arm * turn - gap))[
                0
            ]
            if np.max(np.abs(updated - force)) <= LOOSER * max(updated.max(), 1.0):
                return updated
            force = updated
        raise ArithmeticError(f"the contacts did not settle in {ITERATIONS} iterations")


def meetings(
    pair: GearPair, phase: Array, options: Options = OPTIONS
) -> tuple[Array, list[Meeting]]:
    """Return where each pair would touch (n, n_pairs) [m], and the
    pairs that meet at each phase.
    """
    outlines = Outlines(pair)
    path = pair.path
    pitch = pair.base_pitch
    position = path.A + (np.asarray(phase)[:, None] + np.array(PAIRS)) * pitch
    room = FURTHEST * pitch
    row, column = np.nonzero((position >= path.A - room) & (position <= path.E + room))
    met = [
        (i, j, outlines.touch(position[i, j])) for i, j in zip(row, column, strict=True)
    ]
    found = [(i, j, one) for i, j, one in met if one is not None]
    gears = [
        elements(pair, index, [one for _, _, one in found], options) for index in (0, 1)
    ]
    each = []
    for i in range(len(position)):
        columns = np.array([n for n, (k, _, _) in enumerate(found) if k == i])
        pairs = np.array([found[n][1] for n in columns])
        here = [found[n][2] for n in columns]
        yields = Contacts(pair, np.clip(position[i, pairs], path.A, path.E))
        each.append(Meeting(pairs, here, between(gears, columns, pairs), yields))
    return position, each


def load_corners(
    pair: GearPair, load: float, phase: Array, options: Options = OPTIONS
) -> Loaded:
    """Return forces and deflection of unworn gears at phases.

    Parameters
    ----------
    pair : the gears
    load : torque of the driving gear over its base radius [N]
    phase : (n,) phases in [0, 1] [1]
    options : of mesh and load; its samples do not matter
    """
    position, each = meetings(pair, phase, options)
    force = np.zeros_like(position)
    gap = np.full_like(position, np.inf)
    deflection = np.empty(len(position))
    for i, one in enumerate(each):
        force[i, one.number], turn = balance(
            one.compliance, one.contacts, one.touches, load
        )
        deflection[i] = turn * pair.driving.base_radius
        gap[i, one.number] = [
            touch.angle * pair.driven.base_radius for touch in one.touches
        ]
    return Loaded(np.asarray(phase), position, gap, force, deflection)


@dataclass(frozen=True)
class Contacts:
    """The contacts of the pairs of one phase, after Weber and Banaschek.

    Parameters
    ----------
    pair : the gears
    position : (n,) path positions, from A to E [m]
    """

    pair: GearPair
    position: Array

    def compliance(self, force: Array) -> Array:
        """Return the secant compliance under forces (n,), (n,) [m/N]."""
        pair = self.pair
        s = self.position
        depth = np.stack(
            [
                contact_depth(gear, pair.radius(i, s))
                for i, gear in enumerate(pair.gears)
            ]
        )
        materials = pair.driving.material, pair.driven.material
        return WeberContact(
            pair.equivalent_curvature(s), depth, materials, pair.face_width
        ).compliance(force)


def balance(
    C: Array, contacts: Contacts, touches: Sequence[Touch], load: float
) -> tuple[Array, float]:
    """Return the forces (n,) [N] and the driving gear's turn [rad] with contacts that
    stiffen under load.

    Parameters
    ----------
    C : (n, n) compliance of teeth and bodies [m/N]
    contacts, touches : of the n pairs
    load : torque of the driving gear over its base radius [N]
    """
    arm = np.array([one.arm[0] for one in touches])
    gap = np.array([one.normal_gap for one in touches])
    torque = load * contacts.pair.driving.base_radius
    force = np.full(len(arm), load / len(arm))
    for _ in range(ITERATIONS):
        updated, turn = solve(C + np.diag(contacts.compliance(force)), arm, gap, torque)
        if np.max(np.abs(updated - force)) <= TOLERANCE * load:
            return updated, turn
        force = updated
    raise ArithmeticError(f"the contacts did not settle in {ITERATIONS} iterations")


def elements(
    pair: GearPair, index: int, touches: Sequence[Touch], options: Options
) -> Array:
    """Return what one gear yields at touches under each other, the local indentation
    taken out.

    Parameters
    ----------
    pair, index : the gears; 0 driving, 1 driven
    touches : m points with their normals
    options : of mesh and load

    Returns
    -------
    (teeth_apart + 1, m, m) observed × loaded, of the teeth further on, too [m/N]
    """
    gear = pair.gears[index]
    flank = LoadedFlank(gear)
    half_width = options.patch * gear.module
    shape = chart(flank)
    edge = float(shape.at_length(shape.length[-1] - half_width))
    q = np.array([one.parameter[index] for one in touches])
    if q.min() < 1.0 - ROUNDED:
        raise ValueError(
            f"{gear.name}: the mate's corner meets the root curve, not the involute"
        )
    q = np.clip(q, 1.0, edge)
    inward = np.array([one.inward[index] for one in touches]).T
    cut = sector(shape, gear.material, options.plane, options.refinement)
    held, work = through_cuts(
        cut, flank_loads(cut, q, half_width, inward), options.teeth_apart
    )
    work[0] += held - np.diag(
        half_plane_compliance(gear.material, options.plane, half_width, flank.depth(q))
    )
    return work / gear.face_width


def between(
    gears: Sequence[Array], columns: NDArray[np.int64], number: NDArray[np.int64]
) -> Array:
    """Return the compliance matrix of the pairs of one phase, both gears (n, n) [m/N].

    The pair ahead is the tooth towards the loaded flank's side on the driving gear; on
    the driven gear the tooth behind is.
    """
    C = np.zeros((len(columns), len(columns)))
    for a, ahead in enumerate(columns):
        for b, behind in enumerate(columns[: a + 1]):
            apart = number[a] - number[b]
            C[a, b] = C[b, a] = (
                gears[0][apart, ahead, behind] + gears[1][apart, behind, ahead]
            )
    return C


def solve(C: Array, arm: Array, gap: Array, torque: float) -> tuple[Array, float]:
    """Return forces ≥ 0 (n,) [N] that balance a torque [N·m], and the driving gear's
    turn [rad].

    Parameters
    ----------
    C : (n, n) compliance [m/N]
    arm : (n,) of the normals about the driving gear [m]
    gap : (n,) along the normals [m]
    """
    factor = np.linalg.cholesky(C)

    def forces(turn: float) -> Array:
        found: Array = nnls(factor.T, np.linalg.solve(factor, arm * turn - gap))[0]
        return found

    touching = float(np.min(gap / arm))
    alone = torque * float(np.max(np.diag(C) / arm**2))
    turn = brentq(
        lambda x: float(arm @ forces(x)) - torque,
        touching,
        touching + 2.0 * alone,
        xtol=1e-16,
    )
    return forces(turn), float(turn)
