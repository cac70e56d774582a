"""Contact compliance of two flanks: a constant, or a load-dependent line contact."""

import math

import numpy as np

from wearlab.compiled import jit
from wearlab.gears.specification import Material


def yang_sun(first: Material, second: Material, face_width: float) -> float:
    """Return the constant Hertzian compliance of a line contact.

    ``c_h = 2/(π B) [(1 − ν1²)/E1 + (1 − ν2²)/E2]``: ``k_h = π E B / (4 (1 − ν²))`` for equal materials.

    Parameters
    ----------
    first, second : materials of the two flanks
    face_width : B [m]

    Returns
    -------
    compliance [m/N]

    References
    ----------
    Yang & Sun, J. Mech. Transm. Autom. Des. 107 (1985) 529–535, https://doi.org/10.1115/1.3260759, for
    equal materials; the sum over the two half spaces is the form that keeps each body's own share.
    """
    compliances = 1.0 / first.plane_strain_modulus + 1.0 / second.plane_strain_modulus
    return 2.0 / (math.pi * face_width) * compliances


@jit
def weber_compliance(
    force: float,
    equivalent_radius: float,
    depth1: float,
    depth2: float,
    modulus1: float,
    modulus2: float,
    poisson1: float,
    poisson2: float,
    face_width: float,
) -> float:
    """Return the secant compliance δ/F of a loaded line contact, after Weber and Banaschek.

    ``δ/F = 2/(π B) Σ_i (1 − ν_i²)/E_i [ln(2 t_i/a) − ν_i / (2 (1 − ν_i))]`` with the half width
    ``a² = 4 F ρ / (π B) [(1 − ν1²)/E1 + (1 − ν2²)/E2]`` and t_i the depth from the contact point along the
    line of action to the tooth's centre line. It grows without bound, as −ln F, towards zero load: the
    half width is kept above a millionth of the depth. A contact wider than the tooth is deep has no
    such form: each bracket is kept at 0 or above.

    Parameters
    ----------
    force : F, normal force on the pair [N]
    equivalent_radius : ρ, 1/ρ = 1/ρ1 + 1/ρ2 [m]
    depth1, depth2 : t1, t2 [m]
    modulus1, modulus2 : Young's moduli [Pa]
    poisson1, poisson2 : Poisson's ratios [1]
    face_width : B [m]

    Returns
    -------
    compliance [m/N]

    References
    ----------
    Weber & Banaschek, Formänderung und Profilrücknahme bei gerad- und schrägverzahnten Rädern,
    Schriftenreihe Antriebstechnik 11, Vieweg 1953; Johnson, Contact Mechanics, 1985, Eq. 5.57.
    """
    c1 = (1.0 - poisson1 * poisson1) / modulus1
    c2 = (1.0 - poisson2 * poisson2) / modulus2
    half_width = math.sqrt(4.0 * max(force, 0.0) * equivalent_radius / (math.pi * face_width) * (c1 + c2))
    half_width = max(half_width, 1e-6 * max(depth1, depth2))
    term1 = max(math.log(2.0 * depth1 / half_width) - 0.5 * poisson1 / (1.0 - poisson1), 0.0)
    term2 = max(math.log(2.0 * depth2 / half_width) - 0.5 * poisson2 / (1.0 - poisson2), 0.0)
    return 2.0 / (math.pi * face_width) * (c1 * term1 + c2 * term2)


@jit
def weber_compliances(
    force: np.ndarray,
    equivalent_radius: np.ndarray,
    depth: np.ndarray,
    modulus1: float,
    modulus2: float,
    poisson1: float,
    poisson2: float,
    face_width: float,
    out: np.ndarray,
) -> None:
    """Fill ``out`` (n,) [m/N] with :func:`weber_compliance` at every node.

    Parameters
    ----------
    force : (n,) force on the pair at each node [N]
    equivalent_radius : (n,) [m]
    depth : (2, n) depths on the two gears [m]
    modulus1, modulus2, poisson1, poisson2, face_width : as in :func:`weber_compliance`
    out : (n,) [m/N]

    References
    ----------
    Weber & Banaschek 1953.
    """
    for i in range(force.size):
        out[i] = weber_compliance(
            force[i],
            equivalent_radius[i],
            depth[0, i],
            depth[1, i],
            modulus1,
            modulus2,
            poisson1,
            poisson2,
            face_width,
        )
