"""Standards of gears: ratings of ISO 6336, and deviations that ISO 1328 allows.

ISO 6336-1: method B of the mesh stiffness and method C of the face load factor K_Hβ.
ISO 6336-2, method B: contact stress at the pitch point and safety S_H against pitting,
``σ_H = Z_B σ_H0 √(K_A K_v K_Hβ K_Hα)``, ``σ_H0 = Z_H Z_E Z_ε Z_β √(F_t/(d_1 b) (u +
1)/u)``, beside ``σ_HG = σ_Hlim Z_NT Z_L Z_v Z_R`` with Z_W = Z_X = 1; ``S_H =
σ_HG/σ_H``. ISO 6336-6: of a spectrum, by the Palmgren-Miner sum.

Their equations are second-hand, from public implementations whose printed values of
ISO/TR 6336-30 and of a commercial program are reproduced digit by digit; the standards
themselves were not opened. The edition of 2019 raises Z_B of helical gears by a factor
of their modifications, which is not in here.

ISO 1328-1 is that of 1995, since that of 2013 has no formula for the tangential
composite deviations.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wearlab.gears.gear import GearPair
from wearlab.gears.helix import Helix
from wearlab.gears.specification import GearError

VALID_LOAD = 1e5
"""Specific load F_t K_A/b from which the single stiffness is that [N/m]."""


class Tooth(NamedTuple):
    """A gear as the single stiffness knows it, of the normal section.

    Parameters
    ----------
    teeth : z; of a ring infinite
    shift : profile shift coefficient x [1]
    """

    teeth: float
    shift: float


class Rack(NamedTuple):
    """The basic rack and the helix.

    Parameters
    ----------
    pressure_angle : α_n [rad]
    dedendum : h_fP/m_n, mean of both gears [1]
    helix_angle : β [rad]
    """

    pressure_angle: float
    dedendum: float
    helix_angle: float


def virtual_teeth(teeth: float, helix_angle: float, pressure_angle: float) -> float:
    """Return the teeth of the virtual spur gear, ``z_n = z/(cos²β_b cos β)`` [1].

    References
    ----------
    ISO 6336-1:2019, 9.3.

    Examples
    --------
    >>> round(virtual_teeth(17, math.radians(15.8), math.radians(20.0)), 3)
    18.905
    """
    base = math.asin(math.sin(helix_angle) * math.cos(pressure_angle))
    return teeth / (math.cos(base) ** 2 * math.cos(helix_angle))


def theoretical_stiffness(first: Tooth, second: Tooth, rack: Rack) -> float:
    """Return the theoretical single stiffness c'_th = 1/q' per face width [N/m²].

    Parameters
    ----------
    first, second : pinion and wheel
    rack : their basic rack

    References
    ----------
    ISO 6336-1:2019, 9.3: the polynomial q' of virtual teeth and shifts.
    """
    z1 = virtual_teeth(first.teeth, rack.helix_angle, rack.pressure_angle)
    z2 = virtual_teeth(second.teeth, rack.helix_angle, rack.pressure_angle)
    x1 = first.shift
    x2 = second.shift
    q = (
        0.04723
        + 0.15551 / z1
        + 0.25791 / z2
        - 0.00635 * x1
        - 0.11654 * x1 / z1
        - 0.00193 * x2
    )
    q += -0.24188 * x2 / z2 + 0.00529 * x1**2 + 0.00182 * x2**2
    # N/(mm µm) in N/m²
    return 1e9 / q


def single_stiffness(
    first: Tooth,
    second: Tooth,
    rack: Rack,
    *,
    body_factor: float = 1.0,
    modulus: float = 206e9,
) -> float:
    """Return the single stiffness ``c' = c'_th C_M C_R C_B cos β`` per width [N/m²].

    Parameters
    ----------
    first, second, rack : as in `theoretical_stiffness`
    body_factor : C_R, 1 for solid bodies [1]
    modulus : of both, ``2 E1 E2/(E1 + E2)`` [Pa]

    References
    ----------
    ISO 6336-1:2019, 9.3: C_M = 0.8, ``C_B = [1 + 0.5 (1.2 − h_fP/m)] [1 − 0.02 (20° −
    α_n)]``.
    """
    basic = (1.0 + 0.5 * (1.2 - rack.dedendum)) * (
        1.0 - 0.02 * (20.0 - math.degrees(rack.pressure_angle))
    )
    theoretical = theoretical_stiffness(first, second, rack)
    return (
        theoretical
        * 0.8
        * body_factor
        * basic
        * math.cos(rack.helix_angle)
        * modulus
        / 206e9
    )


class MeshStiffness(NamedTuple):
    """Mean mesh stiffnesses per face width, of even loads and of uneven ones [N/m²]."""

    alpha: float
    beta: float


def mesh_stiffness(single: float, transverse_ratio: float) -> MeshStiffness:
    """Return ``c_γα = c' (0.75 ε_α + 0.25)`` and ``c_γβ = 0.85 c_γα`` [N/m²].

    Parameters
    ----------
    single : c' [N/m²]
    transverse_ratio : ε_α [1]

    References
    ----------
    ISO 6336-1:2019, 9.3.
    """
    alpha = single * (0.75 * transverse_ratio + 0.25)
    return MeshStiffness(alpha, 0.85 * alpha)


def face_load_factor(misalignment: float, mean_load: float, stiffness: float) -> float:
    """Return K_Hβ of a linear opening, ``1 + u`` up to 2 and ``2 √u`` beyond.

    ``u = F_βy c_γβ/(2 F_m/b)``.

    Parameters
    ----------
    misalignment : F_βy, effective equivalent misalignment [m]
    mean_load : F_m/b [N/m]
    stiffness : c_γβ [N/m²]

    References
    ----------
    ISO 6336-1:2019, 7.5, method C.

    Examples
    --------
    >>> face_load_factor(10e-6, 200e3, 20e9)
    1.5
    >>> face_load_factor(80e-6, 200e3, 20e9)
    4.0
    """
    u = misalignment * stiffness / (2.0 * mean_load)
    return 1.0 + u if u <= 1.0 else 2.0 * math.sqrt(u)


def root_load_factor(flank: float, face_width: float, tooth_depth: float) -> float:
    """Return ``K_Fβ = K_Hβ^N_F`` [1].

    ``N_F = (b/h)²/(1 + b/h + (b/h)²)``, b/h at least 3.

    Parameters
    ----------
    flank : K_Hβ [1]
    face_width, tooth_depth : b and h [m]

    References
    ----------
    ISO 6336-1:2019, 7.6.

    Examples
    --------
    >>> round(root_load_factor(1.16, 0.1, 0.0184), 3)
    1.13
    """
    ratio = max(face_width / tooth_depth, 3.0)
    return float(flank ** (ratio**2 / (1.0 + ratio + ratio**2)))


SOFT, HARD = 850.0, 1200.0
"""Limits σ_Hlim between which the exponents of oil and roughness vary [MPa]."""


def zone_factor(pair: GearPair, turned: Helix) -> float:
    """Return ``Z_H = √(2 cos β_b cos α_wt/(cos² α_t sin α_wt))`` [1].

    Parameters
    ----------
    pair : the gears, in their transverse section
    turned : the helix

    References
    ----------
    ISO 6336-2:2006, 6.2.
    """
    working = pair.working_pressure_angle
    angle = pair.driving.pressure_angle
    return math.sqrt(
        2.0
        * turned.cosine
        * math.cos(working)
        / (math.cos(angle) ** 2 * math.sin(working))
    )


def elasticity_factor(pair: GearPair) -> float:
    """Return ``Z_E = 1/√(π Σ (1 − ν²)/E)`` [√Pa].

    References
    ----------
    ISO 6336-2:2006, 7.
    """
    yielding = sum(
        (1.0 - g.material.poisson_ratio**2) / g.material.youngs_modulus
        for g in pair.gears
    )
    return 1.0 / math.sqrt(math.pi * yielding)


def contact_ratio_factor(transverse: float, overlap: float) -> float:
    """Return ``Z_ε = √((4 − ε_α)/3 (1 − ε_β) + ε_β/ε_α)``, with ε_β of 1 at most [1].

    Parameters
    ----------
    transverse, overlap : ε_α and ε_β [1]

    References
    ----------
    ISO 6336-2:2006, 8.

    Examples
    --------
    >>> round(contact_ratio_factor(1.549, 1.083), 3)
    0.803
    """
    over = min(overlap, 1.0)
    return math.sqrt((4.0 - transverse) / 3.0 * (1.0 - over) + over / transverse)


def single_contact_factors(pair: GearPair, overlap: float) -> tuple[float, float]:
    """Return Z_B and Z_D of (driving, driven) [1].

    They lead from the pitch point to the inner point of single contact.

    ``M² = ρ_red,C/ρ_red`` at the point nearest to the root of each gear; ``M − ε_β (M −
    1)``, and 1 at least. A ring has 1.

    Parameters
    ----------
    pair : the gears in mesh
    overlap : overlap ratio ε_β [1]

    References
    ----------
    ISO 6336-2:2006, 6.3.
    """
    points = pair.path.E - pair.base_pitch, pair.path.A + pair.base_pitch
    at_pitch = float(pair.equivalent_curvature(0.0))
    factors = []
    for gear, point in zip(pair.gears, points, strict=True):
        M = math.sqrt(at_pitch / float(pair.equivalent_curvature(point)))
        factor = max(1.0, M - min(overlap, 1.0) * (M - 1.0))
        factors.append(1.0 if gear.internal else factor)
    return factors[0], factors[1]


def nominal_stress(
    pair: GearPair, turned: Helix, overlap: float, tangential: float
) -> float:
    """Return σ_H0 [Pa].

    Parameters
    ----------
    pair, turned : the gears and their helix
    overlap : ε_β [1]
    tangential : F_t at the reference circle [N]

    References
    ----------
    ISO 6336-2:2006, 5.2; Z_β = 1/√cos β: 9.
    """
    first, second = sorted(pair.gears, key=lambda gear: gear.teeth)
    u = second.outwards * second.teeth / first.teeth
    factors = (
        zone_factor(pair, turned)
        * elasticity_factor(pair)
        / math.sqrt(math.cos(turned.angle))
    )
    factors *= contact_ratio_factor(pair.contact_ratio, overlap)
    return factors * math.sqrt(
        tangential / (2.0 * first.reference_radius * pair.face_width) * (u + 1.0) / u
    )


class FilmFactors(NamedTuple):
    """Factors of oil, speed and roughness on the limit of contact stress [1]."""

    oil: float
    speed: float
    roughness: float


def film_factors(
    limit: float, viscosity: float, speed: float, roughness: float, radius: float
) -> FilmFactors:
    """Return Z_L, Z_v and Z_R.

    Parameters
    ----------
    limit : σ_Hlim [Pa]
    viscosity : ν_40 [m²/s]
    speed : v at the pitch line [m/s]
    roughness : R_z, mean of both flanks [m]
    radius : ρ_red at the pitch point [m]

    References
    ----------
    ISO 6336-2:2006, 12.

    Examples
    --------
    >>> factors = film_factors(1500e6, 320e-6, 2.664, 6e-6, 21.855e-3)
    >>> [round(factor, 5) for factor in factors]
    [1.04739, 0.96911, 0.96599]
    """
    held = float(np.clip(1e-6 * limit, SOFT, HARD))
    C_L = 0.83 + 0.08 * (held - SOFT) / (HARD - SOFT)
    C_v = C_L + 0.02
    per_10 = 1e6 * roughness * (10.0 / (1e3 * radius)) ** (1.0 / 3.0)
    return FilmFactors(
        C_L + 4.0 * (1.0 - C_L) / (1.2 + 134.0 / (1e6 * viscosity)) ** 2,
        C_v + 2.0 * (1.0 - C_v) / math.sqrt(0.8 + 32.0 / speed),
        (3.0 / per_10) ** (0.32 - 0.0002 * held),
    )


CYCLES_OF_LIFE = (1e5, 5e7, 1e10)
"""Static, knee and endless number of cycles of `life_factor`."""
LIFE_FACTORS = (1.6, 1.0, 0.85)
"""Z_NT there."""
HALVINGS = 60
"""Bisections of a range of safeties, to round-off."""


def life_factor(cycles: float) -> float:
    """Return Z_NT of steels that were hardened, no pitting allowed [1].

    1.6 up to 1e5 cycles, 1 at 5e7, 0.85 from 1e10 on, straight between these in
    logarithms.

    References
    ----------
    ISO 6336-2:2006, 11, table 2.

    Examples
    --------
    >>> [round(life_factor(cycles), 3) for cycles in (1.08e9, 1.783e8)]
    [0.91, 0.962]
    """
    at = np.log(CYCLES_OF_LIFE)
    factor = np.log(LIFE_FACTORS)
    return float(np.exp(np.interp(math.log(max(cycles, 1.0)), at, factor)))


def cycles_endured(factor: float) -> float:
    """Return the cycles whose life factor is ``factor``: the inverse of `life_factor`.

    None above the static factor of 1.6, endlessly many below 0.85.

    Parameters
    ----------
    factor : stress over the limit of contact stress [1]

    Examples
    --------
    >>> cycles_endured(1.7), cycles_endured(0.8), round(cycles_endured(1.0))
    (0.0, inf, 50000000)
    """
    static, _, endless = LIFE_FACTORS
    if factor > static:
        return 0.0
    if factor < endless:
        return math.inf
    falling = -np.log(LIFE_FACTORS)
    return float(np.exp(np.interp(-math.log(factor), falling, np.log(CYCLES_OF_LIFE))))


def spectrum_safety(cycles: Sequence[float], used: Sequence[float]) -> float:
    """Return the safety S of a spectrum, ``Σ n_i/N(S u_i) = 1``.

    Of one bin it is ``Z_NT(n)/u``.

    Parameters
    ----------
    cycles : n of each bin [1]
    used : u, its contact stress over the limit with all factors but that of life [1]

    References
    ----------
    ISO 6336-6: Palmgren-Miner sum; of the limit of stress as of `life_factor`.

    Examples
    --------
    >>> round(spectrum_safety([1e6], [0.5]) / (life_factor(1e6) / 0.5), 9)
    1.0
    >>> halves = spectrum_safety([1e8, 1e8], [0.5, 0.5])
    >>> round(halves / spectrum_safety([2e8], [0.5]), 9)
    1.0
    """

    def damage(safety: float) -> float:
        endured = [cycles_endured(safety * stress) for stress in used]
        return sum(
            count / bound if bound else math.inf
            for count, bound in zip(cycles, endured, strict=True)
        )

    static, _, endless = LIFE_FACTORS
    safe = endless / max(used)
    broken = static / max(used)
    for _ in range(HALVINGS):
        middle = math.sqrt(safe * broken)
        if damage(middle) <= 1.0:
            safe = middle
        else:
            broken = middle
    return safe


MODULES = (0.5, 2.0, 3.5, 6.0, 10.0, 16.0, 25.0, 40.0, 70.0)  # mm, ends of ranges
DIAMETERS = (
    5.0,
    20.0,
    50.0,
    125.0,
    280.0,
    560.0,
    1000.0,
    1600.0,
    2500.0,
    4000.0,
    6000.0,
    8000.0,
    10000.0,
)


class Allowed(NamedTuple):
    """What a class allows [m].

    Parameters
    ----------
    single_pitch : f_pt
    total_pitch : F_p
    profile : F_α
    tooth_composite : f_i′, tooth-to-tooth tangential composite deviation
    total_composite : F_i′, total tangential composite deviation
    """

    single_pitch: float
    total_pitch: float
    profile: float
    tooth_composite: float
    total_composite: float


def allowed(
    grade: int, module: float, diameter: float, contact_ratio: float
) -> Allowed:
    """Return the deviations that an accuracy class allows.

    ``f_pt = 0.3 (m + 0.4 √d) + 4``, ``F_p = 0.3 m + 1.25 √d + 7``, ``F_α = 3.2 √m +
    0.22 √d + 0.7``, ``f_i′ = K (4.3 + f_pt + F_α)``, ``K = 0.2 (ε + 4)/ε`` below ε = 4
    and 0.4 from there, ``F_i′ = F_p + f_i′``, in µm for class 5; times ``2^((Q −
    5)/2)`` for class Q. Module and diameter are the geometric means of the ranges that
    they fall in; values are rounded as the standard's tables are.

    Parameters
    ----------
    grade : Q, 0 to 12
    module : normal module [m]
    diameter : reference diameter [m]
    contact_ratio : ε of the mesh [1]

    Raises
    ------
    GearError : a class, module or diameter that the standard does not have

    Source: ISO 1328-1:1995, 6.1 to 6.4 and Annex A.
    """
    if grade not in range(13):
        raise GearError(f"ISO 1328 has the classes 0 to 12, not {grade}")
    m = _middle(1e3 * module, MODULES, "module")
    d = _middle(1e3 * diameter, DIAMETERS, "reference diameter")
    pitch = 0.3 * (m + 0.4 * math.sqrt(d)) + 4.0
    total = 0.3 * m + 1.25 * math.sqrt(d) + 7.0
    profile = 3.2 * math.sqrt(m) + 0.22 * math.sqrt(d) + 0.7
    k = 0.2 * (contact_ratio + 4.0) / contact_ratio if contact_ratio < 4.0 else 0.4
    tooth = k * (4.3 + pitch + profile)
    step = 2.0 ** ((grade - 5) / 2.0)
    return Allowed(
        *(
            1e-6 * _rounded(step * x)
            for x in (pitch, total, profile, tooth, total + tooth)
        )
    )


def _middle(value: float, ends: tuple[float, ...], name: str) -> float:
    """Return the geometric mean of the range that holds a value [mm]."""
    if not ends[0] <= value <= ends[-1]:
        raise GearError(
            f"ISO 1328-1 covers a {name} of {ends[0]:g} to {ends[-1]:g} mm, not "
            f"{value:g} mm"
        )
    high = next(
        (i for i, end in enumerate(ends) if value <= end and i > 0),
        bisect_right(ends, value),
    )
    return math.sqrt(ends[high - 1] * ends[high])


def _rounded(micrometres: float) -> float:
    """Round to whole micrometres above 10, to halves above 5, to tenths below.

    ISO 1328-1:1995, 5.2.
    """
    if micrometres > 10.0:
        return float(round(micrometres))
    return (
        round(2.0 * micrometres) / 2.0 if micrometres > 5.0 else round(micrometres, 1)
    )
