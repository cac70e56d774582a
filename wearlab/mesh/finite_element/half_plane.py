"""The half-plane under a Hertzian patch: the local indentation that is not the tooth's own.

A load on a flank sinks in without bound as its patch shrinks. That part is the half-plane's, known in closed
form: with a unit load on the half plane (Flamant),

    u_z(r, φ) = 2 (1 − ν²)/(πE) [−ln r − sin²φ / (2 (1 − ν))]

φ from the load's direction. Averaged over the patch (half width w) with the pressure itself, and against
the point at depth t below its middle,

    c = 2 (1 − ν²)/(πE) {¼ − ln(w/2) − 1/(2(1 − ν)) + ⟨ln r + sin²φ/(2 (1 − ν))⟩_t}.

A tooth's compliance less this one is finite, and no longer depends on the patch. It complements exactly the
Hertzian approach of the flank against the same depth (Weber & Banaschek, Johnson Eq. 5.57).

References
----------
Johnson, Contact Mechanics, 1985, 2.2 and 5.6; Andersson & Vedmar, J. Sound Vib. 260 (2003) 195–212, and
Vedmar & Henriksson, J. Mech. Des. 120 (1998) 665–673: elements for the tooth, a formula for the contact.
"""

import math

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.materials import Material
from wearlab.mesh.finite_element.options import Plane
from wearlab.mesh.finite_element.patch import patch_rule


def half_plane_compliance(material: Material, plane: Plane, half_width: float, depth: Array) -> Array:
    """Return the compliance of a half plane under a patch against depths below it, per unit face width.

    Parameters
    ----------
    material : elastic constants
    plane : plane strain or stress
    half_width : w [m]
    depth : (n,) t [m]

    Returns
    -------
    (n,) [1/Pa]

    References
    ----------
    Johnson 1985, §2.2: the half plane under a line load (Flamant).
    """
    modulus, nu, _ = material.in_plane(plane)
    lateral = 0.5 * (1.0 + nu)
    offset, weight = patch_rule()
    x, t = half_width * offset, np.asarray(depth, dtype=float)[:, None]
    square = x**2 + t**2
    deep = np.sum(weight * (0.5 * np.log(square) + lateral * x**2 / square), axis=1)
    surface = 0.25 - math.log(0.5 * half_width) - lateral
    total: Array = 2.0 / (math.pi * modulus) * (surface + deep)
    return total
