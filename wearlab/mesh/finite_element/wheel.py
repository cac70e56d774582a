"""A whole gear from one sector: z equal sectors in a ring, each reduced to what it shows its neighbours.

A sector keeps its displacements q on the two radial cuts, in its own frame; the rest is eliminated:

    S q = g f,   fᵀu = A f + gᵀ q.

Round the ring q repeats with a phase step θ_n = 2πn/z (the discrete Fourier transform of the teeth), so each
harmonic n has the small matrix ``H_n = S_LL + S_RR + S_LR e^{iθ_n} + S_RL e^{−iθ_n}`` and the load
``G_n = g_L + g_R e^{−iθ_n}``. The compliance between loads on tooth 0 and tooth k is

    C_k = A δ_k0 + 1/z Σ_n e^{ikθ_n} G_n^H H_n⁻¹ G_n

exactly that of the full wheel with all its teeth.

References
----------
Thomas, Int. J. Numer. Methods Eng. 14 (1979) 81–102: rotationally periodic structures.
"""

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse.linalg import SuperLU, splu

from wearlab.arrays import Array, Index
from wearlab.mesh.finite_element.patch import patch_rule
from wearlab.mesh.finite_element.sector import Sector


def wheel_compliance(sector: Sector, loads: Array, teeth_apart: int) -> Array:
    """Return what loads on one tooth do to the same load points of teeth further on.

    Parameters
    ----------
    sector : one sector of the wheel, clamped at v = 0
    loads : (n_dofs, m) unit loads on its tooth [N/m per N/m]
    teeth_apart : how many teeth further on to look, 0 the tooth itself [1]

    Returns
    -------
    (teeth_apart + 1, m, m) observed × loaded; the teeth follow towards the loaded flank's side (y > 0) [1/Pa]
    """
    own, reduced, shown = _reduce(sector, loads)
    z = sector.chart.flank.gear.teeth
    half = len(reduced) // 2
    across = np.zeros((teeth_apart + 1, *own.shape))
    across[0] = own
    for n in range(z // 2 + 1):
        turn = np.exp(2j * math.pi * n / z)
        H = reduced[:half, :half] + reduced[half:, half:] + turn * reduced[:half, half:]
        H = H + np.conj(turn) * reduced[half:, :half]
        G = shown[:half] + np.conj(turn) * shown[half:]
        work = G.conj().T @ np.linalg.solve(H, G)
        twice = 1.0 if n in (0, z - n) else 2.0
        for k in range(teeth_apart + 1):
            across[k] += twice / z * (turn**k * work).real
    return across


def _reduce(sector: Sector, loads: Array) -> tuple[Array, Array, Array]:
    """Eliminate everything but the two cuts: A (m, m), S (2c, 2c), g (2c, m), right cut turned."""
    left, right = (_cut(sector, side) for side in (-2.0, 2.0))
    cuts = np.concatenate([left, right])
    clamped = sector.dofs[:, sector.nodes(v=0.0)].ravel()
    inner = np.setdiff1d(np.arange(sector.stiffness.shape[0]), np.concatenate([cuts, clamped]))
    K = sector.stiffness.tocsc()
    coupling = K[inner][:, cuts]
    factors = splu(K[inner][:, inner], permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    load = loads[inner]
    moved, carried = (_solve(factors, columns) for columns in (load, coupling.toarray()))
    turn = _turn(2.0 * sector.chart.half_pitch, len(left))
    reduced = turn.T @ (K[cuts][:, cuts].toarray() - coupling.T @ carried) @ turn
    shown = -turn.T @ (coupling.T @ moved)
    return load.T @ moved, 0.5 * (reduced + reduced.T), shown


def _solve(factors: SuperLU, columns: Array) -> Array:
    """Solve for (n, m) right-hand sides one by one: all at once, SuperLU's threads fight for busy cores."""
    return np.stack([factors.solve(column) for column in np.ascontiguousarray(columns.T)], axis=1)


def _cut(sector: Sector, side: float) -> Index:
    """Unknowns on a radial cut, x and y node by node, without the clamped end."""
    nodes = sector.nodes(u=side)[1:]
    return sector.dofs[:, nodes].T.ravel()


def _turn(angle: float, count: int) -> Array:
    """Turn the unknowns of the right cut from the next sector's frame into this one's."""
    cos, sin = math.cos(angle), math.sin(angle)
    whole = np.eye(2 * count)
    whole[count:, count:] = np.kron(np.eye(count // 2), np.array([[cos, -sin], [sin, cos]]))
    return whole


def flank_loads(
    sector: Sector, parameter: ArrayLike, half_width: float, direction: Array | None = None
) -> Array:
    """Return the nodal loads of unit Hertzian patches, along the inward flank normals or as asked.

    The patch is a half ellipse of pressure in the length along the flank, ``p ∝ √(1 − (x/w)²)``, integrated
    by the Gauss rule made for it.

    Parameters
    ----------
    sector : the sector
    parameter : (m,) middles of the patches on the flank, in [1, 2]
    half_width : w [m]
    direction : (2, m) unit vectors in the tooth's frame; None: the inward normals [1]

    Returns
    -------
    (n_dofs, m) [1]
    """
    q = np.atleast_1d(np.asarray(parameter, dtype=float))
    chart, flank = sector.chart, sector.chart.flank
    offset, weight = patch_rule()
    length = chart.measured.of(q)[:, None] + half_width * offset
    v = chart.height(chart.measured.at(length))
    nodes = sector.nodes(u=1.0)
    nodes = nodes[sector.logical[1, nodes] > 1.0 - 1e-9]
    element, shape = _quadratic(sector.logical[1, nodes], v)
    direction = -flank.normal(q) if direction is None else direction
    loads = np.zeros((sector.stiffness.shape[0], len(q)))
    for local in range(3):
        touched = nodes[2 * element + local]
        for axis in range(2):
            value = weight * shape[..., local] * direction[axis][:, None]
            column = np.broadcast_to(np.arange(len(q))[:, None], value.shape)
            np.add.at(loads, (sector.dofs[axis, touched], column), value)
    return loads


def _quadratic(nodes: Array, v: Array) -> tuple[Index, Array]:
    """Return the element of each v and the values of its three shape functions there."""
    ends = nodes[::2]
    element = np.clip(np.searchsorted(ends, v, side="right") - 1, 0, len(ends) - 2)
    x = (v - ends[element]) / (ends[element + 1] - ends[element])
    shape = np.stack([(1 - x) * (1 - 2 * x), 4 * x * (1 - x), x * (2 * x - 1)], axis=-1)
    return element, shape
