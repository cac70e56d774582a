"""VDI 2736-2 for pairs of plastic gears: stiffness, loss, temperature, wear, stresses.

The guideline was not at hand: its equations are second-hand, from two public
implementations and a published report, and are checked against printed values of
others (docs/validation.md).

References
----------
VDI 2736 Part 2:2014, Thermoplastic gear wheels: cylindrical gears, calculation of the
load-carrying capacity.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from wearlab.gears.gear import GearPair

DEFORMATION = 7.5
"""Displacement of a tooth over F_t/(b E) [1]."""
DUTY_EXPONENT = 0.64
"""Power of the relative duty cycle ED in the rise of temperature [1]."""
SPEED_EXPONENT = 0.75
"""Power of v_t m_n in the heat transfer of the teeth [1]."""
MILLIMETRE = 1e-3
MAX_CONTACT_RATIO = 2.0
"""ε_α from which there is no point of single contact."""


def pair_stiffness(face_width: float, moduli: Sequence[float]) -> float:
    """Return the stiffness of one pair of teeth, ``b/(7.5 (1/E_1 + 1/E_2))`` [N/m].

    Parameters
    ----------
    face_width : b [m]
    moduli : Young's moduli of both gears [Pa]
    """
    return face_width / (DEFORMATION * sum(1.0 / modulus for modulus in moduli))


def loss_factor(pair: GearPair) -> float:
    """Return the degree of tooth loss H_V of spur gears [1].

    ``H_V = π (u + 1)/(z_2 cos β_b) (1 − ε_1 − ε_2 + ε_1² + ε_2²)``, exact where two
    pairs share the load equally and 1 ≤ ε ≤ 2, beyond that as the guideline has it.

    Parameters
    ----------
    pair : an external pair

    References
    ----------
    VDI 2736-2:2014, degree of tooth loss, second-hand.
    """
    approach, recess = partial_contact_ratios(pair)
    teeth = [gear.teeth for gear in pair.gears]
    of_numbers = math.pi * (1.0 / teeth[0] + 1.0 / teeth[1])
    return of_numbers * (1.0 - approach - recess + approach**2 + recess**2)


def partial_contact_ratios(pair: GearPair) -> tuple[float, float]:
    """Return the parts of ε before and behind the pitch point [1].

    Parameters
    ----------
    pair : the gears in their operating position
    """
    return -pair.path.A / pair.base_pitch, pair.path.E / pair.base_pitch


class HeatPath(NamedTuple):
    """What the heat of one gear passes on its way out, in the guideline's units.

    Parameters
    ----------
    transfer : k_ϑ of the teeth [K (m/s)^0.75 mm^1.75/W]
    width : b [mm]
    module : m_n [mm]
    teeth : z of this gear [1]
    speed : v_t at the pitch circle [m/s]
    housing : R_λG/A_G, 0 of an open gearbox [K/W]
    duty : ED, share of the time under load [1]
    """

    transfer: float
    width: float
    module: float
    teeth: int
    speed: float
    housing: float
    duty: float


def thermal_resistance(path: HeatPath) -> float:
    """Return the rise of temperature per power of friction [K/W].

    ``(k_ϑ/(b z (v_t m_n)^0.75) + R_λG/A_G) ED^0.64`` with each gear's own z.

    Parameters
    ----------
    path : of the heat of one gear

    References
    ----------
    VDI 2736-2:2014, tooth temperature, second-hand; one of two public implementations
    takes the pinion's z for both gears.
    """
    carried_off = (path.speed * path.module) ** SPEED_EXPONENT
    of_teeth = path.transfer / (path.width * path.teeth * carried_off)
    return (of_teeth + path.housing) * path.duty**DUTY_EXPONENT


def flank_length(pair: GearPair, gear: int) -> float:
    """Return the length of the active flank, l_Fl = (d_Na² − d_Nf²)/(4 d_b) [m].

    Parameters
    ----------
    pair : the gears in their operating position
    gear : 0 driving, 1 driven
    """
    curvatures = [pair.curvature(end)[gear] for end in (pair.path.A, pair.path.E)]
    difference = abs(float(curvatures[1]) ** 2 - float(curvatures[0]) ** 2)
    return difference / (2.0 * pair.gears[gear].base_radius)


class WornGear(NamedTuple):
    """What the mean wear of a gear follows from.

    Parameters
    ----------
    torque : T of that gear [N m]
    cycles : N_L, turns of that gear [1]
    loss_factor : H_V [1]
    coefficient : k_w [m²/N]
    width : b [m]
    teeth : z [1]
    flank_length : l_Fl [m]
    """

    torque: float
    cycles: float
    loss_factor: float
    coefficient: float
    width: float
    teeth: int
    flank_length: float


def mean_wear(gear: WornGear) -> float:
    """Return the mean depth worn off the flanks, ``2π T N_L H_V k_w/(b z l_Fl)`` [m].

    Parameters
    ----------
    gear : the gear

    References
    ----------
    VDI 2736-2:2014, wear of the flank, second-hand.
    """
    work = 2.0 * math.pi * gear.torque * gear.cycles * gear.loss_factor
    area = gear.width * gear.teeth * gear.flank_length
    return work * gear.coefficient / area


def tooth_displacement(
    tangential_force: float, face_width: float, moduli: Sequence[float]
) -> float:
    """Return λ, ``7.5 F_t/b (1/E_1 + 1/E_2)`` of spur gears [m].

    Parameters
    ----------
    tangential_force : F_t at the reference circle [N]
    face_width : b [m]
    moduli : Young's moduli of both gears [Pa]

    References
    ----------
    VDI 2736-2:2014, deformation of the tooth, second-hand.
    """
    return tangential_force / pair_stiffness(face_width, moduli)


def root_stress(
    tangential_force: float,
    face_width: float,
    module: float,
    contact_ratio: float,
    form: float,
) -> float:
    """Return the stress of the root, ``Y_Fa Y_Sa Y_ε F_t/(b m_n)`` of spur gears [Pa].

    Parameters
    ----------
    tangential_force : F_t at the reference circle, with its factor K_F [N]
    face_width, module : b, m_n [m]
    contact_ratio : ε_α, for ``Y_ε = 0.25 + 0.75/ε_α`` [1]
    form : Y_Fa Y_Sa [1]

    References
    ----------
    VDI 2736-2:2014, load capacity of the root, second-hand.
    """
    contact_ratio_factor = 0.25 + 0.75 / contact_ratio
    nominal = tangential_force / (face_width * module)
    return form * contact_ratio_factor * nominal


def contact_stress(pair: GearPair, force: float) -> float:
    """Return the pressure at the pitch point by ISO's Z_E Z_H Z_ε, spur gears [Pa].

    ``Z_E Z_H Z_ε √(F_t/(b d_1) (u + 1)/u)`` with ``Z_ε² = (4 − ε_α)/3`` and the gears'
    materials as they are.

    Parameters
    ----------
    pair : the gears in their operating position, ε_α up to 2
    force : normal force of the mesh, with its factors [N]

    References
    ----------
    VDI 2736-2:2014, load capacity of the flank, after ISO 6336-2.
    """
    compliances = sum(
        1.0 / gear.material.at_flank.plane_strain_modulus for gear in pair.gears
    )
    radius = float(pair.equivalent_curvature(0.0))
    shared = math.sqrt((4.0 - pair.contact_ratio) / 3.0)
    line_load = force / pair.face_width
    return shared * math.sqrt(line_load / (math.pi * radius * compliances))


HIGHEST_STRENGTH = 120.0
"""Temperature up to which the strengths of plastics are known [°C]."""
STRENGTHS = ("POM", "PA66")
"""Plastics whose root strength the guideline has."""


def root_strength(plastic: str, temperature: float, cycles: float) -> float:
    """Return σ_Flim, the strength of the root under load cycles [Pa].

    ``26 − 0.0025 ϑ² + 400 N^−0.2`` of POM, ``30 − 0.22 ϑ + (4600 − 900 ϑ^0.3) N^−1/3``
    of PA66 [MPa, °C].

    Parameters
    ----------
    plastic : one of `STRENGTHS`
    temperature : of the root [°C]
    cycles : load cycles of the root [1]

    Raises
    ------
    ValueError : another plastic, or warmer than it is known for

    References
    ----------
    VDI 2736-2:2014, strength of the root, second-hand.
    """
    _check_strength(plastic, temperature)
    if plastic == "POM":
        strength = 26.0 - 0.0025 * temperature**2 + 400.0 * cycles**-0.2
    else:
        falling = 4600.0 - 900.0 * temperature**0.3
        strength = 30.0 - 0.22 * temperature + falling * cycles ** (-1.0 / 3.0)
    return 1e6 * strength


def flank_strength(temperature: float, cycles: float) -> float:
    """Return σ_Hlim of oiled PA66, the strength of the flank under load cycles [Pa].

    ``36 − 0.0012 ϑ² + (1000 − 0.025 ϑ²) N^−0.21`` [MPa, °C].

    Parameters
    ----------
    temperature : of the flank [°C]
    cycles : load cycles of the flank [1]

    Raises
    ------
    ValueError : warmer than it is known for

    References
    ----------
    VDI 2736-2:2014, strength of the flank, second-hand.
    """
    _check_strength("PA66", temperature)
    falling = 1000.0 - 0.025 * temperature**2
    return 1e6 * (36.0 - 0.0012 * temperature**2 + falling * cycles**-0.21)


def _check_strength(plastic: str, temperature: float) -> None:
    """Raise a `ValueError` where the guideline knows no strength."""
    if plastic not in STRENGTHS:
        raise ValueError(
            f"the strength of {plastic!r} is not known; of {' and '.join(STRENGTHS)} "
            "it is"
        )
    if not 0.0 <= temperature <= HIGHEST_STRENGTH:
        raise ValueError(
            f"{temperature:.4g} °C: strengths are known from 0 to "
            f"{HIGHEST_STRENGTH:g} °C"
        )
