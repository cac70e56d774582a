"""ISO 6336-2, method B: contact stress at the pitch point and safety S_H against pitting.

``σ_H = Z_B σ_H0 √(K_A K_v K_Hβ K_Hα)``, ``σ_H0 = Z_H Z_E Z_ε Z_β √(F_t/(d_1 b) (u + 1)/u)``, beside
``σ_HG = σ_Hlim Z_NT Z_L Z_v Z_R`` with Z_W = Z_X = 1; ``S_H = σ_HG/σ_H``.

The equations are second-hand, from public implementations of the edition of 2006; the values that those
print of ISO/TR 6336-30 are reproduced digit by digit. The standard itself was not opened. The edition of 2019
raises Z_B of helical gears by a factor of their modifications, which is not in here.
"""

import math
from typing import NamedTuple

import numpy as np

from wearlab.gears.gear import GearPair
from wearlab.gears.helix import Helix

PER_MPA, PER_MM = 1e-6, 1e3
SOFT, HARD = 850.0, 1200.0
"""Limits σ_Hlim between which the exponents of oil and roughness vary [MPa]."""
STATIC_CYCLES, KNEE, ENDLESS = 1e5, 5e7, 1e10
STATIC_FACTOR, ENDLESS_FACTOR = 1.6, 0.85


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
    working, angle = pair.working_pressure_angle, pair.driving.pressure_angle
    return math.sqrt(2.0 * turned.cosine * math.cos(working) / (math.cos(angle) ** 2 * math.sin(working)))


def elasticity_factor(pair: GearPair) -> float:
    """Return ``Z_E = 1/√(π Σ (1 − ν²)/E)`` [√Pa].

    References
    ----------
    ISO 6336-2:2006, 7.
    """
    yielding = sum((1.0 - g.material.poisson_ratio**2) / g.material.youngs_modulus for g in pair.gears)
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
    """Return Z_B and Z_D of (driving, driven), from the pitch point to the inner point of single contact [1].

    ``M² = ρ_red,C/ρ_red`` at the point nearest to the root of each gear; ``M − ε_β (M − 1)``, and 1 at least.
    A ring has 1.

    References
    ----------
    ISO 6336-2:2006, 6.3.
    """
    points = pair.path.E - pair.base_pitch, pair.path.A + pair.base_pitch
    at_pitch = float(pair.equivalent_curvature(0.0))
    found = []
    for gear, where in zip(pair.gears, points, strict=True):
        M = math.sqrt(at_pitch / float(pair.equivalent_curvature(where)))
        found.append(1.0 if gear.internal else max(1.0, M - min(overlap, 1.0) * (M - 1.0)))
    return found[0], found[1]


def nominal_stress(pair: GearPair, turned: Helix, overlap: float, tangential: float) -> float:
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
    u = second.teeth / first.teeth * (-1.0 if second.internal else 1.0)
    factors = zone_factor(pair, turned) * elasticity_factor(pair) / math.sqrt(math.cos(turned.angle))
    factors *= contact_ratio_factor(pair.contact_ratio, overlap)
    return factors * math.sqrt(tangential / (2.0 * first.reference_radius * pair.face_width) * (u + 1.0) / u)


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
    >>> [round(factor, 5) for factor in film_factors(1500e6, 320e-6, 2.664, 6e-6, 21.855e-3)]
    [1.04739, 0.96911, 0.96599]
    """
    held = float(np.clip(limit * PER_MPA, SOFT, HARD))
    C_L = 0.83 + 0.08 * (held - SOFT) / (HARD - SOFT)
    C_v = C_L + 0.02
    per_10 = 1e6 * roughness * (10.0 / (PER_MM * radius)) ** (1.0 / 3.0)
    return FilmFactors(
        C_L + 4.0 * (1.0 - C_L) / (1.2 + 134.0 / (1e6 * viscosity)) ** 2,
        C_v + 2.0 * (1.0 - C_v) / math.sqrt(0.8 + 32.0 / speed),
        (3.0 / per_10) ** (0.32 - 0.0002 * held),
    )


def life_factor(cycles: float) -> float:
    """Return Z_NT of steels that were hardened, no pitting allowed [1].

    1.6 up to 1e5 cycles, 1 at 5e7, 0.85 from 1e10 on, straight between these in logarithms.

    References
    ----------
    ISO 6336-2:2006, 11, table 2.

    Examples
    --------
    >>> [round(life_factor(cycles), 3) for cycles in (1.08e9, 1.783e8)]
    [0.91, 0.962]
    """
    at = np.log([STATIC_CYCLES, KNEE, ENDLESS])
    factor = np.log([STATIC_FACTOR, 1.0, ENDLESS_FACTOR])
    return float(np.exp(np.interp(math.log(max(cycles, 1.0)), at, factor)))
