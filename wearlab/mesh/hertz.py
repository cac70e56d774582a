"""Contact compliance of two flanks: a constant, or a load-dependent line contact."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
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


@dataclass(frozen=True)
class ConstantContact:
    """A contact that yields in proportion to its force.

    Parameters
    ----------
    value : compliance [m/N]
    """

    load_dependent: ClassVar[bool] = False
    softening: ClassVar[float] = 0.0

    value: float

    def compliance(self, force: ArrayLike | None) -> float:
        """Return the compliance, whatever the force [m/N]."""
        return self.value


@dataclass(frozen=True)
class WeberContact:
    """Load-dependent line contact after Weber and Banaschek.

    Parameters
    ----------
    equivalent_radius : (n,) ρ, 1/ρ = 1/ρ1 + 1/ρ2 [m]
    depth : (2, n) t_i, from the contact point along the line of action to each tooth's centre line [m]
    materials : of the two gears
    face_width : B [m]
    """

    load_dependent: ClassVar[bool] = True

    equivalent_radius: ArrayLike
    depth: ArrayLike
    materials: tuple[Material, Material]
    face_width: float

    def compliance(self, force: ArrayLike | None) -> Array:
        """Return the secant compliance δ/F under pair forces (n,), (n,) [m/N].

        ``δ/F = 2/(π B) Σ_i (1 − ν_i²)/E_i [ln(2 t_i/a) − ν_i / (2 (1 − ν_i))]`` with the half width
        ``a² = 4 F ρ / (π B) [(1 − ν1²)/E1 + (1 − ν2²)/E2]``. It grows without bound, as −ln F, towards zero
        load: the half width is kept above a millionth of the depth. A contact wider than the tooth is deep
        has no such form: each bracket is kept at 0 or above.

        References
        ----------
        Weber & Banaschek, Formänderung und Profilrücknahme bei gerad- und schrägverzahnten Rädern,
        Schriftenreihe Antriebstechnik 11, Vieweg 1953; Johnson, Contact Mechanics, 1985, Eq. 5.57.
        """
        F, depth = np.asarray(force, float), np.asarray(self.depth)
        c1, c2 = (1.0 / each.plane_strain_modulus for each in self.materials)
        square = 4.0 * np.maximum(F, 0.0) * self.equivalent_radius / (math.pi * self.face_width) * (c1 + c2)
        a = np.maximum(np.sqrt(square), 1e-6 * depth.max(axis=0))
        t1, t2 = (
            np.maximum(np.log(2.0 * t / a) - 0.5 * each.poisson_ratio / (1.0 - each.poisson_ratio), 0.0)
            for t, each in zip(depth, self.materials, strict=True)
        )
        return np.asarray(2.0 / (math.pi * self.face_width) * (c1 * t1 + c2 * t2))

    @property
    def softening(self) -> float:
        """The same under all forces, ``1/(π B) Σ (1 − ν²)/E``: the compliance goes with −ln √F [m/N]."""
        return sum(1.0 / each.plane_strain_modulus for each in self.materials) / (math.pi * self.face_width)


HertzContact = ConstantContact | WeberContact
"""How the contact itself yields: ``load_dependent`` says whether that takes the force; ``softening`` by how
much the compliance grows as the force shrinks, ``−F dc/dF`` [m/N]."""
