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

from wearlab.arrays import Array
from wearlab.gears.gear import DRIVING, Gear, GearPair
from wearlab.mesh.finite_element import elements, outline

KEPT_IN_PROCESS = 64
LENGTHS = (
    "module",
    *(
        f"{of}_radius"
        for of in ("base", "reference", "tip", "root", "form", "fillet", "bore")
    ),
)


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
    own, reduced, shown = _reduced(sector, loads)
    z = sector.chart.flank.gear.teeth
    half = len(reduced) // 2
    n = np.arange(z // 2 + 1)
    turn = np.exp(2j * math.pi * n / z)[:, None, None]
    H = reduced[:half, :half] + reduced[half:, half:] + turn * reduced[:half, half:]
    H = H + np.conj(turn) * reduced[half:, :half]
    G = shown[:half] + np.conj(turn) * shown[half:]
    work = G.conj().swapaxes(1, 2) @ np.linalg.solve(H, G)
    count = np.where((n == 0) | (2 * n == z), 1.0, 2.0)[:, None, None] / z
    return own, np.stack(
        [(count * turn**k * work).real.sum(axis=0) for k in range(teeth_apart + 1)]
    )


def _reduced(sector: elements.Sector, loads: Array) -> tuple[Array, Array, Array]:
    """Eliminate all but the two cuts: A (m, m), S (2c, 2c) and g (2c, m).

    The sector is its own mirror image: what the left cut moves tells what the right one
    does.
    """
    left, right = (
        sector.dofs[:, sector.nodes(u=side)[1:]].T.ravel() for side in (-2.0, 2.0)
    )
    cuts = np.concatenate([left, right])
    clamped = sector.dofs[:, sector.nodes(v=0.0)].ravel()
    inner = np.setdiff1d(
        np.arange(sector.stiffness.shape[0]), np.concatenate([cuts, clamped])
    )
    K = sector.stiffness.tocsc()
    coupling = K[inner][:, cuts]
    factors = splu(
        K[inner][:, inner], permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}
    )
    given = np.hstack([loads[inner], coupling[:, : len(left)].toarray()])
    # one by one: all at once, SuperLU's threads fight for busy cores
    solved = np.stack(
        [factors.solve(column) for column in np.ascontiguousarray(given.T)], axis=1
    )
    moved = solved[:, : loads.shape[1]]
    by_left = solved[:, loads.shape[1] :]
    image, sign = sector.mirrored
    place = np.empty(len(image), dtype=np.int64)
    place[inner] = np.arange(len(inner))
    by_right = sign[inner, None] * by_left[place[image[inner]]] * sign[right]
    turn = _turn(2.0 * sector.chart.half_pitch, len(left), len(sector.dofs))
    of_cuts = K[cuts][:, cuts].toarray() - coupling.T @ np.hstack([by_left, by_right])
    # by einsum: matrices so small are not worth waking a library's threads, which wait
    # for busy cores
    reduced = np.einsum("ki,kj->ij", turn, np.einsum("ik,kj->ij", of_cuts, turn))
    own = np.einsum("ki,kj->ij", loads[inner], moved)
    return (
        own,
        0.5 * (reduced + reduced.T),
        -np.einsum("ki,kj->ij", turn, coupling.T @ moved),
    )


def _turn(angle: float, count: int, axes: int) -> Array:
    """Return what turns the right cut from the next sector's frame into this one's."""
    cos = math.cos(angle)
    sin = math.sin(angle)
    own = np.eye(axes)
    own[:2, :2] = [[cos, -sin], [sin, cos]]
    whole = np.eye(2 * count)
    whole[count:, count:] = np.kron(np.eye(count // axes), own)
    return whole


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
    return np.asarray(spline(inside) + (q - inside)[:, None] * spline(inside, 1))


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
    # significant digits in which shapes are compared
    own: dict[str, Any] = {
        name: float(f"{getattr(gear, name) / gear.module:.11e}") for name in LENGTHS
    }
    own["material"] = gear.material._replace(youngs_modulus=1.0, density=1.0)
    return gear._replace(
        name="",
        face_width=1.0,
        mass=0.0,
        inertia=0.0,
        assumed=(),
        modification=None,
        **own,
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
    for index, (gear, compliance) in enumerate(
        zip(pair.gears, compliances, strict=True)
    ):
        flank = outline.LoadedFlank(gear)
        here = compliance.weights(flank.parameter(pair.radius(index, s)))
        own += here @ compliance.own / gear.face_width
        for apart in range(1, pairs):
            ahead = s + apart * pair.base_pitch
            inside = ahead <= pair.path.E + recess + 1e-9 * pair.base_pitch
            touched = (
                np.minimum(ahead[inside], pair.path.E) if recess else ahead[inside]
            )
            there = compliance.weights(flank.parameter(pair.radius(index, touched)))
            # the mate pushes a driving tooth back and a driven tooth on: the tooth
            # ahead lies on the loaded flank's side of a driving tooth, and on the other
            # side of a driven one
            first, second = (
                (here[inside], there) if index == DRIVING else (there, here[inside])
            )
            both = np.einsum("no,ol,nl->n", second, compliance.across[apart - 1], first)
            shared[apart - 1, inside] += both / gear.face_width
    return own, shared
