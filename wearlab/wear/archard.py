"""Archard's wear of one pass, per cycle, along the flanks; Hertz' line contact.

One pass removes ``dh = k p ds`` over a contact of width 2a whose flanks slide ``2a |v1 − v2|/v_i``. With the
mean Hertz pressure ``p = F/(2aB)`` the width cancels:

    ``Δh_i = k (F/B) |1 − v_other/v_i|``

Source: PHYSICS §7; W23 Eq. 39, 45–47; L16 Eq. 19. The peak pressure instead multiplies by 4/π.
"""

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.compiled import jit
from wearlab.wear.path import WearPath
from wearlab.wear.pressures.peak import PeakPressure


@jit
def wear_per_cycle(force: Array, coefficient: Array, slide: Array, passes: Array, face_width: float) -> Array:
    """Return the depth that one cycle removes at every node, ``n_i k (F/B) |1 − v_other/v_i|``.

    Parameters
    ----------
    force : (n,) normal force of one tooth pair when it touches at the node, ≥ 0 [N]
    coefficient : (2, n) wear coefficient k [m²/N]
    slide : (2, n) sliding per contact width, times any pressure or projection factor [1]
    passes : (2,) passes of a flank per cycle [1]
    face_width : B [m]

    Returns
    -------
    (2, n) wear rate, (driving, driven) [m per cycle]

    References
    ----------
    Archard, J. Appl. Phys. 24 (1953) 981–988, with the Hertz width, which cancels.
    """
    rate = np.empty(slide.shape)
    for gear in range(slide.shape[0]):
        per_length = passes[gear] / face_width
        for node in range(slide.shape[1]):
            rate[gear, node] = coefficient[gear, node] * force[node] * per_length * slide[gear, node]
    return rate


def contact_half_width(force: ArrayLike, path: WearPath) -> Array:
    """Return Hertz' half width ``a = √(4 (F/B) R'/(π E*))``, (n,) [m] (W23 Eq. 46).

    Parameters
    ----------
    force : (n,) normal force on the line contact, ≥ 0 [N]
    path : WearPath of the same nodes
    """
    w = np.asarray(force, float) / path.face_width
    return np.asarray(np.sqrt(4.0 * w * path.equivalent_radius / (np.pi * path.contact_modulus)))


def mean_pressure(force: ArrayLike, path: WearPath) -> Array:
    """Return the mean Hertz pressure ``F/(2aB)``, (n,) [Pa]; 0 without load.

    References
    ----------
    Johnson 1985, §4.2.
    """
    return np.asarray(peak_pressure(force, path) / PeakPressure.factor)


def peak_pressure(force: ArrayLike, path: WearPath) -> Array:
    """Return the peak Hertz pressure ``√((F/B) E*/(π R'))``, (n,) [Pa]; 0 without load (W23 Eq. 45)."""
    w = np.asarray(force, float) / path.face_width
    return np.asarray(np.sqrt(w * path.contact_modulus / (np.pi * path.equivalent_radius)))
