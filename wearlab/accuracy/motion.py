"""The equation of motion of :mod:`wearlab.accuracy.cells`, compiled: what foreign integrators call."""

from typing import Any

import numpy as np

from wearlab.accuracy.cells import DEGREE, Motion
from wearlab.compiled import jit

BY_APPROACH = np.zeros(0, np.bool_)
"""No contact is held: the approach of the flanks decides."""


@jit
def polynomial(coefficients: Any, u: float) -> float:
    """Return ``Σ c_k u^k``."""
    value = coefficients[DEGREE]
    for power in range(DEGREE - 1, -1, -1):
        value = value * u + coefficients[power]
    return value


@jit
def cell_within(edges: Any, first: int, last: int, phase: float) -> int:
    """Return the cell among ``first … last − 1`` that holds ``phase``: one side of a jump."""
    low, high = first, last - 1
    while low < high:
        middle = (low + high + 1) // 2
        if edges[middle] <= phase:
            low = middle
        else:
            high = middle - 1
    return low


@jit
def within(given: Any, cell: int, phase: float) -> float:
    """Return where in a cell a phase lies, 0 to 1."""
    return (phase - given.edges[cell]) / (given.edges[cell + 1] - given.edges[cell])


@jit
def motion_in_cell(given: Any, cell: int, phase: float, y: Any, contact: Any, out: Any) -> None:
    """Write ẏ (2n,) at ``phase`` of ``cell``; contact by the sign of the approach, or as ``contact`` says.

    Parameters
    ----------
    contact : (n_mesh · (n_pairs + 1),) whether each pair and the back flank touch; empty: their approach
        decides
    """
    n, pairs, meshes = len(given.push), given.pairs, len(given.backlash)
    u, held = within(given, cell, phase), len(contact) > 0
    for row in range(n):
        out[row] = y[n + row]
        a = given.push[row]
        for col in range(n):
            a -= given.stiffness[row, col] * y[col] + given.damping[row, col] * y[n + col]
        out[n + row] = a
    for m in range(meshes):
        mesh = given.coefficients[cell, m]
        delta, rate = -polynomial(mesh[-2], u), -polynomial(mesh[-1], u) / given.period
        for row in range(n):
            delta += given.direction[m, row] * y[row]
            rate += given.direction[m, row] * y[n + row]
        force, every, touching, rubbed, moment = 0.0, 0.0, False, 0.0, 0.0
        for p in range(pairs):
            k = polynomial(mesh[p], u)
            if k > 0.0:
                every += k
                approach = delta - polynomial(mesh[pairs + p], u)
                if contact[m * (pairs + 1) + p] if held else approach > 0.0:
                    force += k * approach
                    touching = True
                    if given.rubs:
                        rubbed += k * approach * polynomial(mesh[2 * pairs + p], u)
                        moment += k * approach * polynomial(mesh[3 * pairs + p], u)
        back = -given.backlash[m] - delta
        if contact[m * (pairs + 1) + pairs] if held else back > 0.0:
            force -= every * back
            touching = True
        if touching or not given.gated:
            force += given.mesh_damping[m] * rate
        for row in range(n):
            out[n + row] -= given.per_force[m, row] * force
            if given.rubs:
                out[n + row] -= given.per_force[meshes + m, row] * rubbed
                out[n + row] -= given.per_force[2 * meshes + m, row] * moment


@jit
def motion_of(time: float, y: Any, given: Motion) -> Any:
    """Return ẏ (2n,) at ``time`` [s]: contact by the sign of the approach, the mesh repeats every period."""
    out, phase = np.empty(len(y)), time / given.period
    phase -= np.floor(phase)
    cell = cell_within(given.edges, 0, len(given.edges) - 1, phase)
    motion_in_cell(given, cell, phase, y, BY_APPROACH, out)
    return out


@jit
def motion_held(time: float, y: Any, given: Motion, first: int, last: int, contact: Any) -> Any:
    """Return ẏ (2n,) in one smooth segment (cells ``first … last − 1``) while ``contact`` lasts."""
    out, phase = np.empty(len(y)), time / given.period
    motion_in_cell(given, cell_within(given.edges, first, last, phase), phase, y, contact, out)
    return out


@jit
def approaches(time: float, y: Any, given: Motion, first: int, last: int) -> Any:
    """Return the approach of all pairs and back flanks, (n_mesh · (n_pairs + 1),) [m]; −1 out of the path."""
    pairs, meshes, phase = given.pairs, len(given.backlash), time / given.period
    cell = cell_within(given.edges, first, last, phase)
    u, out = within(given, cell, phase), np.empty(meshes * (pairs + 1))
    for m in range(meshes):
        mesh = given.coefficients[cell, m]
        delta = -polynomial(mesh[-2], u)
        for row in range(len(given.push)):
            delta += given.direction[m, row] * y[row]
        for p in range(pairs):
            inside = polynomial(mesh[p], u) > 0.0
            out[m * (pairs + 1) + p] = delta - polynomial(mesh[pairs + p], u) if inside else -1.0
        out[m * (pairs + 1) + pairs] = -given.backlash[m] - delta
    return out
