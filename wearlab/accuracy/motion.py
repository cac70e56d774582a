"""The equation of motion of :mod:`wearlab.accuracy.cells`, compiled: what foreign integrators call."""

from typing import Any

import numpy as np

from wearlab.accuracy.cells import (
    CELLS,
    DEGREE,
    DIAGONAL,
    GATED,
    GUIDES,
    HAS_ERROR,
    HEADER,
    MESHES,
    PAIRS,
    PERIOD,
    RUBS,
    N,
)
from wearlab.compiled import jit

BY_APPROACH = np.zeros(0, np.bool_)
"""No contact is held: the approach of the flanks decides."""


@jit
def find_cell(flat: Any, edges: int, cells: int, guides: int, phase: float) -> int:
    """Return the cell that holds ``phase`` in [0, 1)."""
    guide = edges + 2 * cells + 1
    cell = int(flat[guide + min(int(phase * guides), guides - 1)])
    while cell < cells - 1 and phase >= flat[edges + cell + 1]:
        cell += 1
    return cell


@jit
def polynomial(flat: Any, at: int, u: float) -> float:
    """Return the polynomial whose coefficients begin at ``at``."""
    value = flat[at + DEGREE]
    for power in range(DEGREE - 1, -1, -1):
        value = value * u + flat[at + power]
    return value


@jit
def first_edge(flat: Any) -> int:
    """Return where the cell edges begin."""
    n, meshes = int(flat[N]), int(flat[MESHES])
    channels = 3 * meshes if flat[RUBS] > 0.0 else meshes
    return HEADER + 2 * n * n + meshes * n + 2 * meshes + n + channels * n


@jit
def first_coefficient(flat: Any, cell: int, mesh: int) -> int:
    """Return where the coefficients of a mesh in a cell begin."""
    cells, pairs = int(flat[CELLS]), int(flat[PAIRS])
    quantities = (4 * pairs if flat[RUBS] > 0.0 else 2 * pairs) + 2
    start = first_edge(flat) + 2 * cells + 1 + int(flat[GUIDES])
    return start + (cell * int(flat[MESHES]) + mesh) * quantities * (DEGREE + 1)


@jit
def motion_in_cell(phase: float, cell: int, y: Any, out: Any, flat: Any, contact: Any) -> None:
    """Write ẏ (2n,) at ``phase`` of ``cell``; contact by the sign of the approach, or as ``contact`` says.

    Parameters
    ----------
    contact : (n_mesh · (n_pairs + 1),) whether each pair and the back flank touch; empty: their approach
        decides
    """
    n, meshes, pairs = int(flat[N]), int(flat[MESHES]), int(flat[PAIRS])
    damping = HEADER + n * n
    direction = damping + n * n
    mesh_damping = direction + meshes * n
    backlash = mesh_damping + meshes
    load = backlash + meshes
    response = load + n
    edges = first_edge(flat)
    u = (phase - flat[edges + cell]) * flat[edges + int(flat[CELLS]) + 1 + cell]
    rubs, held, one = flat[RUBS] > 0.0, len(contact) > 0, DEGREE + 1
    for row in range(n):
        out[row] = y[n + row]
        a = flat[load + row]
        if flat[DIAGONAL] > 0.0:
            a -= flat[HEADER + row * n + row] * y[row] + flat[damping + row * n + row] * y[n + row]
        else:
            for col in range(n):
                a -= flat[HEADER + row * n + col] * y[col] + flat[damping + row * n + col] * y[n + col]
        out[n + row] = a
    for m in range(meshes):
        at, last = first_coefficient(flat, cell, m), (4 * pairs if rubs else 2 * pairs)
        delta, rate = 0.0, 0.0
        for row in range(n):
            delta += flat[direction + m * n + row] * y[row]
            rate += flat[direction + m * n + row] * y[n + row]
        if flat[HAS_ERROR] > 0.0:
            delta -= polynomial(flat, at + last * one, u)
            rate -= polynomial(flat, at + (last + 1) * one, u) / flat[PERIOD]
        force, every, touching, rubbed, moment = 0.0, 0.0, False, 0.0, 0.0
        for p in range(pairs):
            k = polynomial(flat, at + p * one, u)
            if k > 0.0:
                every += k
                approach = delta - polynomial(flat, at + (pairs + p) * one, u)
                if contact[m * (pairs + 1) + p] if held else approach > 0.0:
                    force += k * approach
                    touching = True
                    if rubs:
                        rubbed += k * approach * polynomial(flat, at + (2 * pairs + p) * one, u)
                        moment += k * approach * polynomial(flat, at + (3 * pairs + p) * one, u)
        back = -flat[backlash + m] - delta
        if contact[m * (pairs + 1) + pairs] if held else back > 0.0:
            force -= every * back
            touching = True
        if touching or flat[GATED] == 0.0:
            force += flat[mesh_damping + m] * rate
        for row in range(n):
            out[n + row] -= flat[response + m * n + row] * force
            if rubs:
                out[n + row] -= flat[response + (meshes + m) * n + row] * rubbed
                out[n + row] -= flat[response + (2 * meshes + m) * n + row] * moment


@jit
def motion_at(time: float, y: Any, out: Any, flat: Any) -> None:
    """Write ẏ (2n,) at ``time`` [s]: contact by the sign of the approach, the mesh repeats every period."""
    phase = time / flat[PERIOD]
    phase -= np.floor(phase)
    cell = find_cell(flat, first_edge(flat), int(flat[CELLS]), int(flat[GUIDES]), phase)
    motion_in_cell(phase, cell, y, out, flat, BY_APPROACH)


@jit(allocates=True)
def motion_of(time: float, y: Any, flat: Any) -> Any:
    """Return ẏ (2n,) at ``time`` [s], as SciPy wants it."""
    out = np.empty(len(y))
    motion_at(time, y, out, flat)
    return out


@jit
def cell_within(flat: Any, first: int, last: int, phase: float) -> int:
    """Return the cell among ``first … last − 1`` that holds ``phase``: one side of a jump."""
    edges = first_edge(flat)
    low, high = first, last - 1
    while low < high:
        middle = (low + high + 1) // 2
        if flat[edges + middle] <= phase:
            low = middle
        else:
            high = middle - 1
    return low


@jit(allocates=True)
def motion_held(time: float, y: Any, flat: Any, first: int, last: int, contact: Any) -> Any:
    """Return ẏ (2n,) in one smooth segment (cells ``first … last − 1``) while ``contact`` lasts."""
    out = np.empty(len(y))
    phase = time / flat[PERIOD]
    motion_in_cell(phase, cell_within(flat, first, last, phase), y, out, flat, contact)
    return out


@jit(allocates=True)
def approaches(time: float, y: Any, flat: Any, first: int, last: int) -> Any:
    """Return the approach of all pairs and back flanks, (n_mesh · (n_pairs + 1),) [m]; −1 out of the path."""
    n, meshes, pairs, one = int(flat[N]), int(flat[MESHES]), int(flat[PAIRS]), DEGREE + 1
    direction = HEADER + 2 * n * n
    backlash = direction + meshes * n + meshes
    edges = first_edge(flat)
    phase = time / flat[PERIOD]
    cell = cell_within(flat, first, last, phase)
    u = (phase - flat[edges + cell]) * flat[edges + int(flat[CELLS]) + 1 + cell]
    out = np.empty(meshes * (pairs + 1))
    for m in range(meshes):
        at = first_coefficient(flat, cell, m)
        error = 4 * pairs if flat[RUBS] > 0.0 else 2 * pairs
        delta = -polynomial(flat, at + error * one, u)
        for row in range(n):
            delta += flat[direction + m * n + row] * y[row]
        for p in range(pairs):
            inside = polynomial(flat, at + p * one, u) > 0.0
            gap = polynomial(flat, at + (pairs + p) * one, u)
            out[m * (pairs + 1) + p] = delta - gap if inside else -1.0
        out[m * (pairs + 1) + pairs] = -flat[backlash + m] - delta
    return out
