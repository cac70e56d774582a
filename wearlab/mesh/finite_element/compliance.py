"""How the teeth of a gear yield under loads on their flanks: a wheel from one sector.

A sector keeps its displacements q on the two radial cuts, in its own frame; the rest is
eliminated:

    S q = g f,   fᵀu = A f + gᵀ q.

Round the ring q repeats with a phase step θ_n = 2πn/z (the discrete Fourier transform
of the teeth), so each harmonic n has the small matrix ``H_n = S_LL + S_RR + S_LR
e^{iθ_n} + S_RL e^{−iθ_n}`` and the load ``G_n = g_L + g_R e^{−iθ_n}``. The compliance
between loads on tooth 0 and tooth k is

    C_k = A δ_k0 + 1/z Σ_n e^{ikθ_n} G_n^H H_n⁻¹ G_n

exactly that of the full wheel with all its teeth.

References
----------
Thomas, Int. J. Numer. Methods Eng. 14 (1979) 81–102: rotationally periodic structures.
"""

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse.linalg import splu

from wearlab.arrays import Array, Index
from wearlab.gears.gear import DRIVING, Gear, GearPair
from wearlab.mesh.finite_element import elements, outline

KEPT_IN_PROCESS = 64
"""Gears of which a process remembers the compliance."""
LENGTHS = (
    "module",
    "base_radius",
    "reference_radius",
    "tip_radius",
    "root_radius",
    "form_radius",
    "fillet_radius",
    "bore_radius",
)
"""Lengths that make the shape of a gear."""
SHAPE_DIGITS = 11
"""Decimals, in scientific notation, to which the shapes of gears are compared."""


def through_cuts(
    sector: elements.Sector, loads: Array, teeth_apart: int
) -> tuple[Array, Array]:
    """Return how loads on a tooth move its load points and those of teeth further on.

    Of a sector in three dimensions, under waves along the face, likewise.

    Parameters
    ----------
    sector : one sector of the wheel, clamped at v = 0
    loads : (n_dofs, m) unit loads on its tooth [N/m per N/m]
    teeth_apart : how many teeth further on to look, 0 the tooth itself [1]

    Returns
    -------
    held : (m, m) of the sector held at both cuts, observed × loaded [1/Pa]
    beyond : (teeth_apart + 1, m, m) what the wheel beyond them adds to the tooth
        itself, and what the teeth further on move, which follow towards the loaded
        flank's side (y > 0) [1/Pa]
    """
    reduced = _reduced(sector, loads)
    S = reduced.stiffness
    half = len(S) // 2
    z = sector.chart.flank.gear.teeth
    n = np.arange(z // 2 + 1)
    turn = np.exp(2j * math.pi * n / z)[:, None, None]
    turned_back = np.conj(turn)

    H = S[:half, :half] + S[half:, half:] + turn * S[:half, half:]
    H = H + turned_back * S[half:, :half]
    G = reduced.force[:half] + turned_back * reduced.force[half:]
    work = G.conj().swapaxes(1, 2) @ np.linalg.solve(H, G)

    # harmonics other than the first and the last stand for two, n and z − n
    is_single = (n == 0) | (2 * n == z)
    share = np.where(is_single, 1.0, 2.0)[:, None, None] / z
    beyond = [(share * turn**k * work).real.sum(axis=0) for k in range(teeth_apart + 1)]
    return reduced.held, np.stack(beyond)


class _ReducedSector(NamedTuple):
    """A sector of which only its two cuts are left, c displacements on each.

    Parameters
    ----------
    held : (m, m) A, of the load points with both cuts held [1/Pa]
    stiffness : (2c, 2c) S of the cuts, left before right
    force : (2c, m) g on the cuts, due to the loads
    """

    held: Array
    stiffness: Array
    force: Array


class _Dofs(NamedTuple):
    """Numbers of the displacements of a sector.

    Parameters
    ----------
    left, right : (c,) on the two cuts, without the clamped ones
    inner : between the cuts
    """

    left: Index
    right: Index
    inner: Index

    @property
    def cuts(self) -> Index:
        """Those of both cuts, (2c,)."""
        return np.concatenate([self.left, self.right])


def _dofs(sector: elements.Sector) -> _Dofs:
    """Return the displacements of a sector that is clamped at v = 0."""
    left = sector.dofs[:, sector.nodes(u=-2.0)[1:]].T.ravel()
    right = sector.dofs[:, sector.nodes(u=2.0)[1:]].T.ravel()
    clamped = sector.dofs[:, sector.nodes(v=0.0)].ravel()
    numbers = np.arange(sector.stiffness.shape[0])
    inner = np.setdiff1d(numbers, np.concatenate([left, right, clamped]))
    return _Dofs(left, right, inner)


def _reduced(sector: elements.Sector, loads: Array) -> _ReducedSector:
    """Eliminate all displacements but those of the two cuts.

    The sector is its own mirror image: the displacements that the left cut causes,
    mirrored, are those that the right cut causes.

    Products of small matrices are taken by einsum: they are not worth waking a
    library's threads, which wait for busy cores.
    """
    dofs = _dofs(sector)
    stiffness = sector.stiffness.tocsc()
    coupling = stiffness[dofs.inner][:, dofs.cuts]
    inner_stiffness = stiffness[dofs.inner][:, dofs.inner]

    by_cut = coupling[:, : len(dofs.left)].toarray()
    right_sides = np.hstack([loads[dofs.inner], by_cut])
    solved = _solve_columns(inner_stiffness, right_sides)
    by_loads = solved[:, : loads.shape[1]]
    by_left = solved[:, loads.shape[1] :]
    by_right = _mirrored(sector, dofs, by_left)

    by_cuts = np.hstack([by_left, by_right])
    between_cuts = stiffness[dofs.cuts][:, dofs.cuts].toarray()
    of_cuts = between_cuts - coupling.T @ by_cuts
    turn = _turn(2.0 * sector.chart.half_pitch, len(dofs.left), len(sector.dofs))
    turned = np.einsum("ki,kj->ij", turn, np.einsum("ik,kj->ij", of_cuts, turn))
    return _ReducedSector(
        held=np.einsum("ki,kj->ij", loads[dofs.inner], by_loads),
        stiffness=0.5 * (turned + turned.T),
        force=-np.einsum("ki,kj->ij", turn, coupling.T @ by_loads),
    )


def _solve_columns(matrix: Any, right_sides: Array) -> Array:
    """Solve a sparse symmetric system for many right-hand sides (n, m).

    They are solved one by one: for all at once SuperLU's threads would compete for
    busy cores.
    """
    factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    columns = np.ascontiguousarray(right_sides.T)
    return np.stack([factors.solve(column) for column in columns], axis=1)


def _mirrored(sector: elements.Sector, dofs: _Dofs, by_left: Array) -> Array:
    """Return the inner displacements due to the right cut, from those due to the left.

    Parameters
    ----------
    sector : one sector of the wheel
    dofs : its displacements
    by_left : (n_inner, c) due to the left cut
    """
    image, sign = sector.mirrored
    place = np.empty(len(image), dtype=np.int64)
    place[dofs.inner] = np.arange(len(dofs.inner))
    rows = place[image[dofs.inner]]
    return sign[dofs.inner, None] * by_left[rows] * sign[dofs.right]


def _turn(angle: float, count: int, axes: int) -> Array:
    """Return what turns the right cut from the next sector's frame into this one's.

    Parameters
    ----------
    angle : from one sector to the next [rad]
    count : displacements on a cut
    axes : directions of a displacement, 2 or 3
    """
    cos = math.cos(angle)
    sin = math.sin(angle)
    rotation = np.eye(axes)
    rotation[:2, :2] = [[cos, -sin], [sin, cos]]
    turn = np.eye(2 * count)
    turn[count:, count:] = np.kron(np.eye(count // axes), rotation)
    return turn


class GearCompliance(NamedTuple):
    """Compliance of a gear along the line of action, without the local indentation.

    Per unit face width.

    Parameters
    ----------
    parameter : (m,) sampled positions on the flank, ascending; 1 where the involute
        begins, 2 at the tip
    own : (m,) of a tooth under its own load [1/Pa]
    across : (n_apart, m, m) of the tooth 1, 2 … pitches further on towards the loaded
        flank's side, observed × loaded position [1/Pa]
    """

    parameter: Array
    own: Array
    across: Array

    def weights(self, parameter: ArrayLike) -> Array:
        """Return the weights of the samples at positions, (n, m) [1].

        See `spline_weights`.
        """
        return spline_weights(self.parameter, parameter)


def spline_weights(samples: Array, places: ArrayLike) -> Array:
    """Return the weights of samples at places, (n, m) [1]: a spline, straight beyond.

    Parameters
    ----------
    samples : (m,) places of the samples, ascending
    places : (n,)
    """
    from scipy.interpolate import CubicSpline

    q = np.asarray(places, dtype=float)
    spline = CubicSpline(samples, np.eye(len(samples)))
    inside = np.clip(q, samples[0], samples[-1])
    straight = (q - inside)[:, None] * spline(inside, 1)
    return np.asarray(spline(inside) + straight)


def gear_compliance(gear: Gear, options: elements.Options) -> GearCompliance:
    """Return the compliance of an unworn gear; each shape is solved once.

    Plane elasticity knows no length: gears that differ in their module alone yield
    alike per unit face width, and in inverse proportion to Young's modulus.

    Parameters
    ----------
    gear : the gear; its name, size, face width, Young's modulus, mass and modifications
        do not matter
    options : of mesh and load
    """
    modulus = gear.material.youngs_modulus
    compliance = _remembered(of_unit_size(gear), options)
    return GearCompliance(
        compliance.parameter, compliance.own / modulus, compliance.across / modulus
    )


def of_unit_size(gear: Gear) -> Gear:
    """Return the shape of a gear: with module and Young's modulus 1, without the rest.

    Parameters
    ----------
    gear : its name, size, face width, mass and modifications do not matter
    """
    lengths: dict[str, Any] = {}
    for name in LENGTHS:
        in_modules = getattr(gear, name) / gear.module
        lengths[name] = float(f"{in_modules:.{SHAPE_DIGITS}e}")
    return gear._replace(
        name="",
        face_width=1.0,
        mass=0.0,
        inertia=0.0,
        assumed=(),
        modification=None,
        material=gear.material._replace(
            youngs_modulus=1.0, density=1.0, flank_modulus=None
        ),
        **lengths,
    )


def solve_gear(
    gear: Gear, options: elements.Options, wear: outline.Wear | None = None
) -> GearCompliance:
    """Compute the compliance of a gear with finite elements.

    Teeth, root and body of the whole wheel yield, clamped at the bore. The local
    indentation is the half plane's against the tooth's centre line and is taken off the
    tooth's own compliance. The outermost load touches the tip edge with its patch;
    beyond, towards the edge itself, the samples are continued straight, since no half
    plane is left there.

    Parameters
    ----------
    gear : the gear
    options : of mesh and load
    wear : of every tooth's loaded flank; the other flank wears alike

    Returns
    -------
    GearCompliance
    """
    cut, q, loads = elements.loaded_sector(gear, options, wear)
    held, beyond = through_cuts(cut, loads, options.teeth_apart)
    half_width = options.patch * gear.module
    depth = cut.chart.flank.depth(q)
    local = elements.half_plane_compliance(
        gear.material, options.plane, half_width, depth
    )
    return GearCompliance(q, np.diag(beyond[0] + held) - local, beyond[1:])


_remembered = lru_cache(KEPT_IN_PROCESS)(solve_gear)


def pair_compliance(
    pair: GearPair,
    position: Array,
    pairs: int,
    options: elements.Options = elements.Options(),  # noqa: B008
    solved: tuple[GearCompliance, GearCompliance] | None = None,
    recess: float = 0.0,
) -> tuple[Array, Array]:
    """Return what pairs of teeth yield along the line of action, own and shared.

    Parameters
    ----------
    pair : the gears
    position : (n,) path positions [m]
    pairs : largest number of pairs in contact
    options : of mesh and load
    solved : what the two gears yield, (driving, driven), when they are worn; absent:
        unworn gears
    recess : how far beyond E pairs may touch; there they yield as at E [m]

    Returns
    -------
    own (n,) and shared (pairs − 1, n) [m/N]; the latter with the pair 1, 2 … base
    pitches ahead, 0 where that one is out of the path
    """
    s = np.asarray(position, dtype=float)
    compliances = solved or tuple(gear_compliance(gear, options) for gear in pair.gears)
    own = np.zeros(len(s))
    shared = np.zeros((pairs - 1, len(s)))
    for number, compliance in enumerate(compliances):
        gear = pair.gears[number]
        flank = outline.LoadedFlank(gear)
        weights = compliance.weights(flank.parameter(pair.radius(number, s)))
        own += weights @ compliance.own / gear.face_width

        for teeth_apart in range(1, pairs):
            ahead = s + teeth_apart * pair.base_pitch
            is_in_path = ahead <= pair.path.E + recess + 1e-9 * pair.base_pitch
            touched = ahead[is_in_path]
            if recess:
                touched = np.minimum(touched, pair.path.E)
            parameter = flank.parameter(pair.radius(number, touched))
            weights_ahead = compliance.weights(parameter)

            # the mate pushes a driving tooth back and a driven tooth on: the tooth
            # ahead lies on the loaded flank's side of a driving tooth, and on the other
            # side of a driven one
            loaded = weights[is_in_path]
            observed = weights_ahead
            if number != DRIVING:
                loaded, observed = observed, loaded
            across = compliance.across[teeth_apart - 1]
            value = np.einsum("no,ol,nl->n", observed, across, loaded)
            shared[teeth_apart - 1, is_in_path] += value / gear.face_width
    return own, shared
