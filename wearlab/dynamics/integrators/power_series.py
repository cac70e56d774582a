"""The motion over a part of a step as a power series of the time.

While contact lasts, ``q̈ = p − K q − C q̇ − Σ_c r_c (k_c d·q + b_c d·q̇ − w_c)`` with
k_c, b_c and w_c parabolas over the part: the terms of the motion follow one from
another. A series serves every look into the part.

Source: Hairer, Nørsett & Wanner 1993, I.8.
"""

from typing import Any

import numpy as np

from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.integrators.kernel import TERMS, multiply

LEFT_OUT = 1e-14
"""Size of the terms left out over that of the motion."""
LEFT_OUT_OF_TANGENTS = 1e-12
"""Size of the terms left out of a tangent that starts with size one."""
LARGEST_LAST_TERM = 1e-10
"""Last term of a series over its first ones, above which its time is too long."""
SHORTEST = 1e-4
"""Part of a step below which a series that does not end is taken as it is."""


@jit_inner(counted=False)
def parabola(
    first: float,
    middle: float,
    last: float,
) -> tuple[float, float, float]:
    """Return the coefficients of the parabola through values at 0, 1/2 and 1."""
    return first, 4.0 * middle - 3.0 * first - last, 2.0 * (first + last) - 4.0 * middle


@jit_inner(counted=False, inline=True)
def series_over(
    series: Any,
    held: Any,
    mesh: Any,
    inputs: Any,
    h: float,
    state: Any,
) -> int:
    """Expand the motion over a part of a step; return how many terms the series has.

    ``(j + 1)(j + 2) q_{j+2} = h² p_j − h² K q_j − h (j + 1) C q_{j+1} − h² Σ_c r_c
    Q_{c,j}`` with the terms Q of the channels and p of the inputs.

    Parameters
    ----------
    series : its ``terms``, and their projections d·q in ``sensed``, are written
    held : coordinates that loads of unknown size hold
    mesh : (6 n_channel,) stiffness of the channels at start, middle and end of the
        part, then damping
    inputs : (3, n_input) at start, middle and end of the part
    h : duration of the part [s]
    state : (2n, w) at the beginning of the part
    """
    terms = series.terms
    n = terms.shape[1]
    w = terms.shape[2]
    for row in range(n):
        for col in range(np.uint64(0), np.uint64(w)):
            terms[0, row, col] = state[row, col]
            terms[1, row, col] = h * state[n + row, col]
    return int(_expand(series, held, mesh, inputs, h))


@jit(counted=False)
def _expand(series: Any, held: Any, mesh: Any, inputs: Any, h: float) -> int:
    """Fill the series from its first two terms, ``q`` and ``h q̇``; count the terms."""
    terms = series.terms
    sensed = series.sensed
    w = terms.shape[2]
    multiply(series.by_direction, terms[0], sensed[0])
    multiply(series.by_direction, terms[1], sensed[1])
    size = largest(terms[0], 0, 1) + largest(terms[1], 0, 1)
    small_terms = 0
    for j in range(TERMS - 2):
        term = terms[j + 2]
        _start_term(series, j, h)
        _add_channels(series, mesh, j, h)
        if j < 3:  # inputs are parabolas
            _add_inputs(series, held, inputs, j, h)
        for row in range(term.shape[0]):
            for col in range(np.uint64(0), np.uint64(w)):
                term[row, col] /= (j + 1.0) * (j + 2.0)
        multiply(series.by_direction, term, sensed[j + 2])

        is_small = largest(term, 0, 1) <= LEFT_OUT * size
        is_small = is_small and (w == 1 or largest(term, 1, w) <= LEFT_OUT_OF_TANGENTS)
        small_terms = small_terms + 1 if is_small else 0
        if small_terms >= 2 and j >= 3:
            return j + 3
    return TERMS


@jit_inner(counted=False, inline=True)
def _start_term(series: Any, j: int, h: float) -> None:
    """Write ``−h² K q_j − h (j + 1) C q_{j+1}`` as term j + 2."""
    terms = series.terms
    term = terms[j + 2]
    square = h * h
    rate = h * (j + 1)
    multiply(series.by_stiffness, terms[j], term)
    multiply(series.by_damping, terms[j + 1], series.product)
    for row in range(terms.shape[1]):
        for col in range(np.uint64(0), np.uint64(terms.shape[2])):
            term[row, col] = -square * term[row, col] - rate * series.product[row, col]


@jit_inner(counted=False, inline=True)
def _add_channels(series: Any, mesh: Any, j: int, h: float) -> None:
    """Subtract the accelerations by the channels' forces from term j + 2.

    The force of a channel is a product: its stiffness and damping, parabolas of the
    time, times the deflection and its rate.
    """
    term = series.terms[j + 2]
    sensed = series.sensed
    enters = series.by_inputs
    w = series.terms.shape[2]
    meshes = sensed.shape[1]
    channels = len(series.jump)
    force = series.force
    square = h * h
    rate = h * (j + 1)
    for c in range(channels):
        m = c % meshes
        k = parabola(mesh[c], mesh[channels + c], mesh[2 * channels + c])
        b = parabola(
            mesh[3 * channels + c], mesh[4 * channels + c], mesh[5 * channels + c]
        )
        for col in range(np.uint64(0), np.uint64(w)):
            force[col] = (
                square * k[0] * sensed[j, m, col] + rate * b[0] * sensed[j + 1, m, col]
            )
        for power in range(1, min(j, 2) + 1):
            slower = h * (j + 1 - power) * b[power]
            for col in range(np.uint64(0), np.uint64(w)):
                force[col] += square * k[power] * sensed[j - power, m, col]
                force[col] += slower * sensed[j + 1 - power, m, col]
        for entry in range(enters.begin[c], enters.begin[c + 1]):
            row = enters.column[entry]
            for col in range(np.uint64(0), np.uint64(w)):
                term[row, col] -= enters.entry[entry] * force[col]


@jit_inner(counted=False, inline=True)
def _add_inputs(series: Any, held: Any, inputs: Any, j: int, h: float) -> None:
    """Add the accelerations by the inputs to term j + 2, j < 3.

    A load of unknown size also moves the tangent by itself, which a load of one drives.
    """
    term = series.terms[j + 2]
    enters = series.enters
    n = series.terms.shape[1]
    w = series.terms.shape[2]
    square = h * h
    for x in range(len(enters)):
        value = square * parabola(inputs[0, x], inputs[1, x], inputs[2, x])[j]
        column = 1 + held[x - len(enters)] if x >= len(enters) - len(held) else 0
        for row in range(n):
            term[row, 0] += value * enters[x, row]
            if j == 0 and 0 < column < w:
                term[row, column] += square * enters[x, row]


@jit_inner(counted=False)
def largest(term: Any, first: int, end: int) -> float:
    """Return the largest modulus in the columns ``first … end − 1`` of a matrix."""
    modulus = 0.0
    for row in range(term.shape[0]):
        for col in range(first, end):
            modulus = max(modulus, abs(term[row, col]))
    return modulus


@jit_inner(counted=False)
def diverges(terms: Any) -> bool:
    """Whether the time is too long for a series: its last term is large.

    Parameters
    ----------
    terms : (TERMS, n, w) of the motion
    """
    size = largest(terms[0], 0, 1) + largest(terms[1], 0, 1)
    return largest(terms[TERMS - 1], 0, 1) > LARGEST_LAST_TERM * size


@jit_inner(counted=False)
def write_state_at(series: Any, terms: int, u: float, h: float, out: Any) -> None:
    """Write the state at a fraction of the series, by Horner's rule.

    Parameters
    ----------
    series : (TERMS, n, w) terms of the motion
    terms : how many of them there are
    u : fraction of the part of the step [1]
    h : duration of the part [s]
    out : (2n, w) state
    """
    n = series.shape[1]
    w = series.shape[2]
    for row in range(n):
        for col in range(np.uint64(0), np.uint64(w)):
            out[row, col] = series[terms - 1, row, col]
            out[n + row, col] = 0.0
    for j in range(terms - 2, -1, -1):
        for row in range(n):
            for col in range(np.uint64(0), np.uint64(w)):
                out[n + row, col] = out[n + row, col] * u + out[row, col]
                out[row, col] = out[row, col] * u + series[j, row, col]
    for row in range(n, 2 * n):
        for col in range(np.uint64(0), np.uint64(w)):
            out[row, col] /= h


@jit_inner(counted=False)
def horner(
    p: Any,
    terms: int,
    u: float,
) -> tuple[float, float]:
    """Return the value and the slope of a polynomial.

    Parameters
    ----------
    p : coefficients, constant first
    terms : how many of them there are
    u : where
    """
    value = p[terms - 1]
    slope = 0.0
    for j in range(terms - 2, -1, -1):
        slope = slope * u + value
        value = value * u + p[j]
    return value, slope
