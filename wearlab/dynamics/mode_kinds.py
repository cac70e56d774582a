"""What moves in the modes of a planetary set: the classification of Lin & Parker (1999)."""

from typing import Literal

import numpy as np

from wearlab.arrays import Array, Flags
from wearlab.dynamics.modes import Modes
from wearlab.dynamics.system import System

Kind = Literal["rigid-body", "rotational", "translational", "planet", "mixed"]
ALIKE = 1e-7
"""Relative distance of two natural frequencies that count as one."""
MOVES = 1e-9
"""Share of a mode's kinetic energy from which a motion takes part in it."""


def mode_kinds(system: System, modes: Modes) -> tuple[Kind, ...]:
    """Return the kind of every mode.

    With equal, equally spaced planets the central members (sun, ring, carrier) only turn in a rotational
    mode, only move in the plane in a translational one (which comes in pairs), and stand still in a planet
    mode; with anything else modes may be mixed. Within a group of equal frequencies any combination of
    shapes is a mode; each group is first turned so that its rotations and translations separate.

    Parameters
    ----------
    system : a planetary system
    modes : its modes

    References
    ----------
    Lin & Parker, J. Vib. Acoust. 121 (1999) 316–321.
    """
    turns, shifts = system.central & system.turns, system.central & ~system.turns
    kinds: list[Kind] = []
    for group in _groups(modes.frequency):
        shapes = _separated(modes.shape[group], system.mass, turns, shifts)
        kinds += [_kind(shape, system.mass, turns, shifts, modes.frequency[group[0]]) for shape in shapes]
    return tuple(kinds)


def _groups(frequency: Array) -> list[list[int]]:
    groups: list[list[int]] = []
    for index, value in enumerate(frequency):
        if groups and value - frequency[groups[-1][-1]] <= ALIKE * value:
            groups[-1].append(index)
        else:
            groups.append([index])
    return groups


def _separated(shapes: Array, mass: Array, turns: Flags, shifts: Flags) -> Array:
    """Return combinations of equal modes with rotation and translation as far apart as they can be."""
    share = np.where(turns, 1.0, 0.0) - np.where(shifts, 1.0, 0.0)
    _, turn = np.linalg.eigh(shapes @ (share[:, None] * mass) @ shapes.T)
    separated: Array = turn.T @ shapes
    return separated


def _kind(shape: Array, mass: Array, turns: Flags, shifts: Flags, frequency: float) -> Kind:
    if frequency == 0.0:
        return "rigid-body"
    energy = shape * (mass @ shape)
    turning, shifting = energy[turns].sum() > MOVES, energy[shifts].sum() > MOVES
    if turning and shifting:
        return "mixed"
    return "rotational" if turning else "translational" if shifting else "planet"
