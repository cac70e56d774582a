"""The equation of motion of :mod:`wearlab.accuracy.cells`, compiled: what foreign integrators call."""

from typing import Any

import numpy as np

from wearlab.accuracy.cells import (
    BACKLASH,
    CELLS,
    DEGREE,
    DIAGONAL,
    GATED,
    GUIDES,
    HAS_ERROR,
    HEADER,
    MESH_DAMPING,
    PAIRS,
    PERIOD,
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
def motion_in_cell(phase: float, cell: int, y: Any, out: Any, flat: Any, contact: Any) -> None:
    """Write ẏ (2n,) at ``phase`` of ``cell``; contact by the sign of the approach, or as ``contact`` says.

    Parameters
    ----------
    contact : (n_pairs + 1,) whether each pair and the back flank touch; empty: their approach decides
    """
    n, pairs, cells, guides = int(flat[N]), int(flat[PAIRS]), int(flat[CELLS]), int(flat[GUIDES])
    damping = HEADER + n * n
    direction = damping + n * n
    response = direction + n
    load = response + n
    edges = load + n
    inverse_width = edges + cells + 1
    at = inverse_width + cells + guides + cell * (2 * pairs + 2) * (DEGREE + 1)
    u = (phase - flat[edges + cell]) * flat[inverse_width + cell]
    delta, rate = 0.0, 0.0
    for row in range(n):
        delta += flat[direction + row] * y[row]
        rate += flat[direction + row] * y[n + row]
    if flat[HAS_ERROR] > 0.0:
        delta -= polynomial(flat, at + 2 * pairs * (DEGREE + 1), u)
        rate -= polynomial(flat, at + (2 * pairs + 1) * (DEGREE + 1), u) / flat[PERIOD]
    held = len(contact) > 0
    force, every, touching = 0.0, 0.0, False
    for p in range(pairs):
        k = polynomial(flat, at + p * (DEGREE + 1), u)
        if k > 0.0:
            every += k
            approach = delta - polynomial(flat, at + (pairs + p) * (DEGREE + 1), u)
            if contact[p] if held else approach > 0.0:
                force += k * approach
                touching = True
    back = -flat[BACKLASH] - delta
    if contact[pairs] if held else back > 0.0:
        force -= every * back
        touching = True
    if touching or flat[GATED] == 0.0:
        force += flat[MESH_DAMPING] * rate
    for row in range(n):
        out[row] = y[n + row]
        a = flat[load + row] - flat[response + row] * force
        if flat[DIAGONAL] > 0.0:
            a -= flat[HEADER + row * n + row] * y[row] + flat[damping + row * n + row] * y[n + row]
        else:
            for col in range(n):
                a -= flat[HEADER + row * n + col] * y[col] + flat[damping + row * n + col] * y[n + col]
        out[n + row] = a


@jit
def motion_at(time: float, y: Any, out: Any, flat: Any) -> None:
    """Write ẏ (2n,) at ``time`` [s]: contact by the sign of the approach, the mesh repeats every period."""
    n, cells = int(flat[N]), int(flat[CELLS])
    phase = time / flat[PERIOD]
    phase -= np.floor(phase)
    cell = find_cell(flat, HEADER + 2 * n * n + 3 * n, cells, int(flat[GUIDES]), phase)
    motion_in_cell(phase, cell, y, out, flat, BY_APPROACH)


@jit
def motion_packed(time: float, y: Any, out: Any, packed: Any) -> None:
    """Write ẏ (2n,) at ``time`` [s], as SUNDIALS wants it: the flat array in a tuple."""
    motion_at(time, y, out, packed[0])


@jit
def motion_of(time: float, y: Any, flat: Any) -> Any:
    """Return ẏ (2n,) at ``time`` [s], as SciPy wants it."""
    out = np.empty(len(y))
    motion_at(time, y, out, flat)
    return out


@jit
def cell_within(flat: Any, first: int, last: int, phase: float) -> int:
    """Return the cell among ``first … last − 1`` that holds ``phase``: one side of a jump."""
    n = int(flat[N])
    edges = HEADER + 2 * n * n + 3 * n
    low, high = first, last - 1
    while low < high:
        middle = (low + high + 1) // 2
        if flat[edges + middle] <= phase:
            low = middle
        else:
            high = middle - 1
    return low


@jit
def motion_held(time: float, y: Any, flat: Any, first: int, last: int, contact: Any) -> Any:
    """Return ẏ (2n,) in one smooth segment (cells ``first … last − 1``) while ``contact`` lasts."""
    out = np.empty(len(y))
    phase = time / flat[PERIOD]
    motion_in_cell(phase, cell_within(flat, first, last, phase), y, out, flat, contact)
    return out


@jit
def approaches(time: float, y: Any, flat: Any, first: int, last: int) -> Any:
    """Return the approach of every pair and of the back flank, (n_pairs + 1,) [m]; −1 out of the path."""
    n, pairs, cells, guides = int(flat[N]), int(flat[PAIRS]), int(flat[CELLS]), int(flat[GUIDES])
    direction = HEADER + 2 * n * n
    edges = direction + 3 * n
    phase = time / flat[PERIOD]
    cell = cell_within(flat, first, last, phase)
    at = edges + 2 * cells + 1 + guides + cell * (2 * pairs + 2) * (DEGREE + 1)
    u = (phase - flat[edges + cell]) * flat[edges + cells + 1 + cell]
    delta = 0.0
    for row in range(n):
        delta += flat[direction + row] * y[row]
    delta -= polynomial(flat, at + 2 * pairs * (DEGREE + 1), u)
    out = np.empty(pairs + 1)
    for p in range(pairs):
        inside = polynomial(flat, at + p * (DEGREE + 1), u) > 0.0
        out[p] = delta - polynomial(flat, at + (pairs + p) * (DEGREE + 1), u) if inside else -1.0
    out[pairs] = -flat[BACKLASH] - delta
    return out
