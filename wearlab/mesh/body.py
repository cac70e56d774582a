"""The elastic wheel body under a loaded tooth: Sainsot's formula, and a shared annulus.

The annulus is plane, clamped at the bore, or at the outside of a ring's rim. A tooth
hands its load over to the arc |θ| ≤ θ_f of the root circle as a normal stress linear in
θ and a constant shear stress, the only such tractions in equilibrium with the load.
Michell's solution gives the displacement of every Fourier mode in closed form (four
constants a mode), and the work of one tooth's tractions on the displacements due to
another's is their compliance: the body's displacement along the neighbour's line of
action, rotation times lever included. It is symmetric (Betti) and positive semidefinite
(energy) by construction.

Plane stress, as Sainsot's polynomials are: a single tooth then agrees with them within
6 per cent for 2 <= r_f/r_bore <= 3.4 and 20 to 100 teeth (15 per cent at r_f/r_bore =
1.5).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.gears.gear import Gear
from wearlab.gears.outline import load_angle, root_half_angle
from wearlab.gears.specification import Material

_TABLE = np.array(
    [
        [-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045],
        [60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086],
        [-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236],
        [-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904],
    ]
)
"""A to F of L*, M*, P* and Q*, each ``A/θ² + B h² + C h/θ + D/θ + E h + F``.

Sainsot, Velex & Duverger 2004, Table 1.
"""
BORE_RATIO_RANGE = (1.4, 7.0)
ROOT_ANGLE_RANGE = (0.01, 0.12)
"""Of h_f [1] and θ_f [rad], in which the polynomials were fitted."""


class ForceLine(NamedTuple):
    """The lines along which unit forces press on a tooth, each in its plane.

    Parameters
    ----------
    angle : (n,) λ between the force and the thickness direction [rad]
    lever : (n,) distance of the line from the gear's centre [m]
    """

    angle: Array
    lever: Array


Foundation = Callable[[Gear, ForceLine], Array]
"""Compliance of a wheel body along lines of force (n,), (n,) [m/N]."""


def line_of_action(gear: Gear, radius: ArrayLike) -> ForceLine:
    """Return the line of action as teeth see it, at contact radii.

    It passes r_b from the centre, at the load angle.

    Parameters
    ----------
    gear : the gear
    radius : (n,) contact radii on the involute [m]
    """
    angle = load_angle(gear, radius)
    return ForceLine(angle, np.full_like(angle, gear.base_radius))


def sainsot_coefficients(bore_ratio: float, root_half_angle: float) -> Array:
    """Return Sainsot's polynomials at a ratio of radii and a root angle.

    Parameters
    ----------
    bore_ratio : h_f, outer over inner radius of the body: r_f / r_bore, or r_rim / r_f
        of a ring [1]
    root_half_angle : θ_f, half the tooth angle at the root circle [rad]

    Returns
    -------
    (4,) L*, M*, P* and Q* of his foundation compliance [1]

    References
    ----------
    Sainsot, Velex & Duverger, J. Mech. Des. 126 (2004) 748–752,
    https://doi.org/10.1115/1.1758252, Eq. 6.
    """
    h = bore_ratio
    theta = root_half_angle
    powers = [1.0 / theta**2, h * h, h / theta, 1.0 / theta, h, 1.0]
    return np.asarray(_TABLE @ powers)


def foundation_along(gear: Gear, force: ForceLine) -> Array:
    """Return the compliance of the wheel body along lines of force.

    For the whole face width, ``c_f = cos²λ / (E B) [L (u/S)² + M u/S + P (1 + Q
    tan²λ)]`` with ``S = 2 r_f θ_f`` and ``u = x_A − y_A tanλ − r_f``, the height above
    the root circle where the line of force crosses the tooth's centre line. Wear moves
    the contact point along its own normal, so u stays ``r_b/cosλ − r_f`` on the line of
    action. It is negative where that line crosses the root circle first, and so is the
    cross term then. A ring: ``u = r_f − r_b/cosλ`` and ``h_f = r_rim/r_f``, outside
    what the polynomials were fitted to (:func:`foundation_validity` says so;
    `annulus_along` has no such range).

    Parameters
    ----------
    gear : the gear
    force : the lines, (n,)

    Returns
    -------
    (n,) [m/N]

    References
    ----------
    Sainsot, Velex & Duverger 2004, Eq. 5.
    """
    theta = root_half_angle(gear)
    r_f = gear.root_radius
    L, M, P, Q = sainsot_coefficients(body_ratio(gear), theta)
    lam = force.angle

    crossing = force.lever / np.cos(lam)
    ratio = gear.outwards * (crossing - r_f) / (2.0 * r_f * theta)
    shape = L * ratio**2 + M * ratio + P * (1.0 + Q * np.tan(lam) ** 2)
    stiffness = gear.material.youngs_modulus * gear.face_width
    return np.cos(lam) ** 2 * shape / stiffness


def body_ratio(gear: Gear) -> float:
    """Return h_f, the outer over the inner radius of the body [1].

    ``r_f / r_bore`` of an external gear, ``r_rim / r_f`` of a ring.

    Parameters
    ----------
    gear : the gear

    References
    ----------
    Sainsot, Velex & Duverger 2004, for h_f.
    """
    ratio = gear.root_radius / gear.bore_radius
    return 1.0 / ratio if gear.internal else ratio


def foundation_validity(gear: Gear) -> tuple[str, ...]:
    """Return messages on quantities outside the range of Sainsot's polynomials.

    Parameters
    ----------
    gear : the gear

    Returns
    -------
    one message for each quantity out of range; empty within

    References
    ----------
    Sainsot, Velex & Duverger 2004: 1.4 ≤ h_f ≤ 7 and 0.01 ≤ θ_f ≤ 0.12.
    """
    ratio = "h_f = r_rim/r_f" if gear.internal else "h_f = r_f/r_bore"
    quantities = (
        (ratio, body_ratio(gear), BORE_RATIO_RANGE),
        ("theta_f", root_half_angle(gear), ROOT_ANGLE_RANGE),
    )
    return tuple(
        f"{gear.name}: sainsot foundation outside its range: {symbol} = {value:.4g}, "
        f"fitted for {low:g} to {high:g}"
        for symbol, value, (low, high) in quantities
        if not low <= value <= high
    )


class ModeCompliance(NamedTuple):
    """Displacements of the root circle under unit tractions σ cos nθ and τ sin nθ.

    The modes are n = 0, 1, 2 and up. Tractions and displacements count outwards (σ,
    u_r) and along rising θ (τ, u_θ).

    Parameters
    ----------
    normal : (n_modes,) u_r due to σ [m/Pa]
    mixed : (n_modes,) u_r due to τ, equal to u_θ due to σ [m/Pa]
    shear : (n_modes,) u_θ due to τ [m/Pa]; mode 0 is u_θ under a uniform shear
    """

    normal: Array
    mixed: Array
    shear: Array


def mode_compliance(
    clamped: float, loaded: float, material: Material, n_modes: int
) -> ModeCompliance:
    """Solve the annulus, clamped at one radius and loaded at the other, for all modes.

    Parameters
    ----------
    clamped, loaded : radii of bore (a ring: outside of the rim) and root circle [m]
    material : elastic constants; plane stress
    n_modes : modes 0 … n_modes − 1

    Returns
    -------
    ModeCompliance

    References
    ----------
    Michell, Proc. London Math. Soc. 31 (1899) 100–124; Barber, Elasticity, 3rd ed.,
    Table 9.1, written here as displacements from the Kolosov–Muskhelishvili potentials
    z^k and z^m.
    """
    n = np.arange(n_modes, dtype=float)
    solutions = _michell(n, material)
    inner = min(clamped, loaded)
    outer = max(clamped, loaded)
    clamp, _ = _at_radius(solutions, n, clamped, inner, outer, material)
    rim, surface = _at_radius(solutions, n, loaded, inner, outer, material)

    # an inner surface faces the centre: what pulls it outwards is a negative stress
    # there
    tractions = np.zeros((n_modes, 4, 2))
    outwards = 1.0 if loaded > clamped else -1.0
    tractions[:, 2, 0] = outwards
    tractions[:, 3, 1] = outwards

    conditions = np.concatenate([clamp, surface], axis=1)
    compliance = rim @ np.linalg.solve(conditions, tractions)
    return ModeCompliance(
        normal=compliance[:, 0, 0],
        mixed=compliance[:, 0, 1],
        shear=compliance[:, 1, 1],
    )


def _at_radius(
    solutions: Array,
    n: Array,
    radius: float,
    inner: float,
    outer: float,
    material: Material,
) -> tuple[Array, Array]:
    """Return displacements and tractions of the solutions at a radius.

    Displacements (u_r, u_θ) and tractions (σ_r, τ), each (n_modes, 2, 4).
    """
    mu = material.shear_modulus
    lame = 2.0 * mu * material.poisson_ratio / (1.0 - material.poisson_ratio)
    displacement = np.empty((len(n), 2, 4))
    traction = np.empty((len(n), 2, 4))

    for column, (U, V, power, logarithm) in enumerate(solutions):
        # growing powers are scaled by the outer and falling ones by the inner radius:
        # nothing overflows
        scale = np.where(power > 0.0, outer, inner)
        size = (radius / scale) ** power
        log_radius = np.log(radius / scale)

        u = size * (U + logarithm * log_radius)
        v = size * (V - logarithm * log_radius)
        u_rate = power * u + size * logarithm
        v_rate = power * v - size * logarithm

        normal = (lame + 2.0 * mu) * u_rate + lame * (u + n * v)
        displacement[:, 0, column] = u
        displacement[:, 1, column] = v
        traction[:, 0, column] = normal / radius
        traction[:, 1, column] = mu * (v_rate - n * u - v) / radius

    return displacement, traction


def _michell(n: Array, material: Material) -> Array:
    """Return Michell's four solutions of each mode, (4 solutions, 4 values, n_modes).

    ``u_r = (U + G ln r) r^p cos nθ`` and ``u_θ = (V − G ln r) r^p sin nθ``; the values
    are U, V, p and G. The overall factor of each solution is free.
    """
    kappa = (3.0 - material.poisson_ratio) / (1.0 + material.poisson_ratio)
    ones = np.ones_like(n)
    zeros = np.zeros_like(n)
    solutions = np.array(
        [
            [kappa - n - 1.0, kappa + n + 1.0, n + 1.0, zeros],
            [kappa + n - 1.0, n - kappa - 1.0, 1.0 - n, zeros],
            [-ones, ones, n - 1.0, zeros],
            [-ones, -ones, -n - 1.0, zeros],
        ]
    )
    # mode 1: r^(1−n) and r^(n−1) coincide; the point force takes the place of the
    # second
    solutions[1, :, n == 1.0] = [-1.0, -1.0, 0.0, 2.0 * kappa]
    # mode 0: the radial solutions r and 1/r, and the rotational ones
    solutions[:, :, n == 0.0] = np.array(
        [
            [1.0, 0.0, 1.0, 0.0],
            [0.0, 1.0, 1.0, 0.0],
            [1.0, 0.0, -1.0, 0.0],
            [0.0, 1.0, -1.0, 0.0],
        ]
    )[:, :, None]
    return solutions


def arc_tractions(gear: Gear, force: ForceLine) -> Array:
    """Return the tractions that carry a unit load into the root arc, per face width.

    ``σ = σ0 + σ1 θ/θ_f`` and ``τ = τ0``, with the radial force ``2 r_f sinθ_f σ0 =
    −sinλ``, the moment about the centre ``2 r_f² θ_f τ0 = −a``, a the lever, and the
    tangential force ``2 r_f [σ1 (sinθ_f/θ_f − cosθ_f) + τ0 sinθ_f] = −cosλ``. The load
    presses a ring's tooth outwards, towards its root: there the radial force is +sinλ.

    Parameters
    ----------
    gear : the gear
    force : the lines of the loads, (n,)

    Returns
    -------
    (3, n) σ0, σ1, τ0 [1/m]; the loaded flank is on the side of positive θ

    References
    ----------
    Sainsot, Velex & Duverger 2004: normal stress linear, shear constant along the root
    arc.
    """
    theta = root_half_angle(gear)
    r_f = gear.root_radius
    lam = force.angle

    constant = -gear.outwards * np.sin(lam) / (2.0 * r_f * np.sin(theta))
    shear = -force.lever / (2.0 * r_f**2 * theta)
    tangential = -np.cos(lam) / (2.0 * r_f) - shear * np.sin(theta)
    linear = tangential / (np.sin(theta) / theta - np.cos(theta))
    return np.stack([constant, linear, shear])


def arc_work(gear: Gear, separation: float) -> Array:
    """Return the work of arc tractions of one tooth on displacements due to another's.

    Parameters
    ----------
    gear : the gear
    separation : angle from the acting to the observing tooth [rad]

    Returns
    -------
    (3, 3) observing × acting shapes (1, θ/θ_f normal; 1 shear), per unit face width
    [m²/Pa]

    References
    ----------
    Sainsot, Velex & Duverger 2004, for the tractions; the displacements are those of
    `mode_compliance`.
    """
    theta = root_half_angle(gear)
    # fourier modes times θ_f: the energy of mode n falls as n^-3
    n_modes = int(60.0 / theta) + 2
    compliance = mode_compliance(
        gear.bore_radius, gear.root_radius, gear.material, n_modes
    )
    # complex amplitudes of e^{inθ} of the tractions: cosines are real, sines −i
    n = np.arange(1, n_modes)
    sine = np.sin(n * theta)
    even = 2.0 * sine / n
    odd = 2.0 * (sine / n**2 - theta * np.cos(n * theta) / n) / theta
    zero = np.zeros_like(even)
    normal = np.stack([even + 0j, -1j * odd, zero + 0j])
    shear = np.stack([zero, zero, even])

    # those of the displacements
    mixed = compliance.mixed[1:]
    u_r = compliance.normal[1:] * normal + 1j * mixed * shear
    u_t = -1j * mixed * normal + compliance.shear[1:] * shear

    turn = np.exp(1j * n * separation)
    work = (normal.conj() * turn) @ u_r.T + (shear * turn) @ u_t.T
    of_mode_0 = np.diag([compliance.normal[0], 0.0, compliance.shear[0]])
    uniform = (2.0 * theta) ** 2 / 2.0 * of_mode_0
    return np.asarray(gear.root_radius / np.pi * (work.real + uniform))


def annulus_along(gear: Gear, force: ForceLine) -> Array:
    """Return the compliance of the annulus along lines of force.

    Parameters
    ----------
    gear : the gear
    force : the lines, (n,)

    Returns
    -------
    (n,) for the whole face width [m/N]

    References
    ----------
    Sainsot, Velex & Duverger 2004, for the tractions; clamped at the bore as there.
    """
    tractions = arc_tractions(gear, force)
    work = _work(tractions, arc_work(gear, 0.0), tractions)
    return np.asarray(work / gear.face_width)


def rigid_along(gear: Gear, force: ForceLine) -> Array:
    """Return the compliance of a rigid body, 0 along every line (n,).

    Parameters
    ----------
    gear : the gear
    force : the lines, (n,)
    """
    return np.zeros_like(force.angle)


def body_coupling(
    gear: Gear, radius: ArrayLike, second_radius: ArrayLike, teeth_apart: int = 1
) -> Array:
    """Return the body compliance that two loaded teeth share, over that of one of them.

    It is over the geometric mean of the two teeth's own. The foundation compliance
    between them is this ratio times ``√(c_f,i c_f,j)``. Both touch the same line of
    action, so the tooth with the larger contact radius (a ring's: the smaller) is on
    the loaded flank's side.

    Parameters
    ----------
    gear : the gear
    radius, second_radius : (n,) contact radii of the two teeth [m]
    teeth_apart : how many pitches lie between them [1]

    Returns
    -------
    (n,) ratio between −1 and 1 [1]; 1 for a tooth with itself

    References
    ----------
    Michell 1899, for the displacements; Sainsot, Velex & Duverger 2004, for the
    tractions on the root circle.
    """
    first, second = np.broadcast_arrays(
        np.asarray(radius, dtype=float), np.asarray(second_radius, dtype=float)
    )
    low = np.minimum(first, second)
    high = np.maximum(first, second)
    if gear.internal:
        low, high = high, low

    p = arc_tractions(gear, line_of_action(gear, low))
    q = arc_tractions(gear, line_of_action(gear, high))
    work_at_tooth = arc_work(gear, 0.0)
    work_between = arc_work(gear, 2.0 * np.pi * teeth_apart / gear.teeth)

    shared = _work(q, work_between, p)
    of_first = _work(p, work_at_tooth, p)
    of_second = _work(q, work_at_tooth, q)
    return np.asarray(shared / np.sqrt(of_first * of_second))


def _work(observing: Array, between: Array, acting: Array) -> Array:
    """Return the work of tractions (3, n) on displacements due to tractions (3, n)."""
    return np.asarray(np.einsum("a...,ab,b...->...", observing, between, acting))
