"""ISO 6336-1, method B of the mesh stiffness and method C of the face load factor K_Hβ.

The equations are second-hand, from a public implementation whose printed values of ISO/TR 6336-30 and of a
commercial program are reproduced digit by digit; the standard itself was not opened.
"""

import math
from typing import NamedTuple

PER_MM_UM = 1e9
"""N/(mm µm) in N/m²."""
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
    """Return the number of teeth of the virtual spur gear, ``z_n = z/(cos²β_b cos β)`` [1].

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
    z1, z2 = (virtual_teeth(g.teeth, rack.helix_angle, rack.pressure_angle) for g in (first, second))
    x1, x2 = first.shift, second.shift
    q = 0.04723 + 0.15551 / z1 + 0.25791 / z2 - 0.00635 * x1 - 0.11654 * x1 / z1 - 0.00193 * x2
    q += -0.24188 * x2 / z2 + 0.00529 * x1**2 + 0.00182 * x2**2
    return PER_MM_UM / q


def single_stiffness(
    first: Tooth, second: Tooth, rack: Rack, *, body_factor: float = 1.0, modulus: float = 206e9
) -> float:
    """Return the single stiffness ``c' = c'_th C_M C_R C_B cos β`` per face width [N/m²].

    Parameters
    ----------
    first, second, rack : as in `theoretical_stiffness`
    body_factor : C_R, 1 for solid bodies [1]
    modulus : of both, ``2 E1 E2/(E1 + E2)`` [Pa]

    References
    ----------
    ISO 6336-1:2019, 9.3: C_M = 0.8, ``C_B = [1 + 0.5 (1.2 − h_fP/m)] [1 − 0.02 (20° − α_n)]``.
    """
    degrees = math.degrees(rack.pressure_angle)
    basic = (1.0 + 0.5 * (1.2 - rack.dedendum)) * (1.0 - 0.02 * (20.0 - degrees))
    theoretical = theoretical_stiffness(first, second, rack)
    return theoretical * 0.8 * body_factor * basic * math.cos(rack.helix_angle) * modulus / 206e9


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
    """Return K_Hβ of a linear opening, ``1 + u`` up to 2 and ``2 √u`` beyond, ``u = F_βy c_γβ/(2 F_m/b)``.

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
    """Return ``K_Fβ = K_Hβ^N_F`` with ``N_F = (b/h)²/(1 + b/h + (b/h)²)``, b/h at least 3 [1].

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
