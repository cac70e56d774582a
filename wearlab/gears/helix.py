"""Helical gears: from the normal section of a drawing to the transverse section.

Modifications of leads.

A helical pair is a spur pair of the transverse section, turned along the face: at y it
is ahead by ``y tan β_b`` on the line of action. So a
:class:`wearlab.gears.gear.GearPair` of the transverse numbers is all of its profile,
and a :class:`Helix` the rest.
"""

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.gears.specification import Basics, GearError, GearSpec

LARGEST = math.radians(45.0)
"""Largest helix angle that is built."""
IN_MODULES = (
    "profile_shift_coefficient",
    "addendum_coefficient",
    "dedendum_coefficient",
    "tip_alteration_coefficient",
    "fillet_radius_coefficient",
)
"""Numbers of a gear that count modules."""


class Helix(NamedTuple):
    """What turns a transverse section into a helical pair.

    All angles 0 for a spur pair.

    Parameters
    ----------
    angle : β, helix angle at the reference circle, unsigned [rad]
    base_angle : β_b, helix angle at the base circle [rad]
    sense : 1 where contact reaches larger y later, −1 where earlier
    """

    angle: float = 0.0
    base_angle: float = 0.0
    sense: float = 1.0

    @property
    def slope(self) -> float:
        """Signed tan β_b: lag of a section at y = 1 m on the line of action [1]."""
        return self.sense * math.tan(self.base_angle)

    @property
    def cosine(self) -> float:
        """Cosine of β_b [1]."""
        return math.cos(self.base_angle)


SPUR = Helix()


def helix(
    helix_angle: float, normal_pressure_angle: float, sense: float = 1.0
) -> Helix:
    """Return the helix of a helix angle, ``sin β_b = sin β cos α_n``.

    Parameters
    ----------
    helix_angle : β at the reference circle [rad]
    normal_pressure_angle : α_n [rad]
    sense : of :class:`Helix`

    Raises
    ------
    GearError
        For an angle that no gear has.

    References
    ----------
    ISO 21771:2007, 4.3.

    Examples
    --------
    >>> turned = helix(math.radians(10.0), math.radians(20.0))
    >>> round(math.degrees(turned.base_angle), 3)
    9.391
    """
    if not 0.0 <= helix_angle <= LARGEST:
        raise GearError(
            f"helix_angle must lie between 0 and {math.degrees(LARGEST):g} deg, not "
            f"{math.degrees(helix_angle):.4g} deg; the hand says which way it turns"
        )
    return Helix(
        helix_angle,
        math.asin(math.sin(helix_angle) * math.cos(normal_pressure_angle)),
        sense,
    )


def transverse_basics(basics: Basics, helix_angle: float) -> Basics:
    """Return module and pressure angle of the transverse section.

    ``m_t = m_n / cos β``, ``tan α_t = tan α_n / cos β``.

    Parameters
    ----------
    basics : of the normal section
    helix_angle : β [rad]

    References
    ----------
    ISO 21771:2007, 4.3.

    Examples
    --------
    >>> section = transverse_basics(Basics(8e-3), math.radians(15.8))
    >>> round(1e3 * section.module, 6), round(math.degrees(section.pressure_angle), 6)
    (8.314124, 20.719712)
    """
    cosine = math.cos(helix_angle)
    angle = math.atan(math.tan(basics.pressure_angle) / cosine)
    return basics._replace(module=basics.module / cosine, pressure_angle=angle)


def transverse(spec: GearSpec, turned: Helix) -> GearSpec:
    """Return a gear's numbers of the transverse section.

    Coefficients count modules, so they shrink by cos β (x_t = x_n cos β); an allowance
    of the tooth thickness grows by 1/cos β; what is removed along the flank normal
    leaves a gap of 1/cos β_b along the line of action. Lengths along the path,
    diameters and widths stay.

    Parameters
    ----------
    spec : the gear's numbers of the normal section
    turned : helix of the gear

    References
    ----------
    ISO 21771:2007, 4.3 and 4.8.
    """
    cosine = math.cos(turned.angle)
    normal = turned.cosine
    normal_section: dict[str, Any] = {}
    if not spec.tip_diameter:
        normal_section["addendum_coefficient"] = 1.0
    if not spec.root_diameter:
        normal_section["dedendum_coefficient"] = 1.25
    for key, value in vars(spec).items():
        if value is not None:
            normal_section[key] = value

    changed = {}
    for key in IN_MODULES:
        if key in normal_section:
            changed[key] = normal_section[key] * cosine
    for key in ("profile_crowning", "profile_slope"):
        if key in normal_section:
            changed[key] = normal_section[key] / normal
    for key in ("tip_relief", "root_relief"):
        if key in normal_section:
            relief = normal_section[key]
            changed[key] = relief._replace(amount=relief.amount / normal)
    return replace(
        spec,
        tooth_thickness_allowance=spec.tooth_thickness_allowance / cosine,
        **changed,
    )


def overlap_ratio(face_width: float, helix_angle: float, normal_module: float) -> float:
    """Return the overlap ratio ``ε_β = b sin β / (π m_n)`` [1].

    References
    ----------
    ISO 21771:2007, 5.4.

    Examples
    --------
    >>> round(overlap_ratio(0.1, math.radians(15.8), 8e-3), 6)
    1.083369
    """
    return face_width * math.sin(helix_angle) / (math.pi * normal_module)


class Lead(NamedTuple):
    """What is taken off one flank over its face, normal to the flank.

    ``g = 4 C η² − f η + r max(0, 1 − d/l) − t η (ξ − ½)`` with η = y/b, ξ the share of
    the active profile from its root end, and d the distance from the nearer end of the
    face.

    Parameters
    ----------
    crowning : C, removed at both ends of the face, a parabola with 0 at mid-face [m]
    slope : f, surplus of material at the end of positive y against the other, as f_Hβ
        [m]
    relief : r, removed at the very ends [m]
    relief_length : l, over which that fades to 0 [m]
    bias : t, profile slope at the end of positive y less that at the other [m]
    """

    crowning: float = 0.0
    slope: float = 0.0
    relief: float = 0.0
    relief_length: float = 1.0
    bias: float = 0.0

    def removed(
        self, face_position: ArrayLike, profile_share: ArrayLike, face_width: float
    ) -> Array:
        """Return the material removed normal to the flank, (n_face, n_profile) [m].

        Parameters
        ----------
        face_position : (n_face,) y from mid-face [m]
        profile_share : (n_profile,) ξ, 0 at the root end and 1 at the tip end of the
            active profile [1]
        face_width : b [m]

        References
        ----------
        ISO 21771:2007, 8: crowning, end relief, helix slope and twist.

        Examples
        --------
        >>> removed = Lead(crowning=8e-6).removed([-0.01, 0.0, 0.01], [0.5], 0.02)
        >>> (1e6 * removed).round(6).ravel().tolist()
        [8.0, 0.0, 8.0]
        """
        y = np.asarray(face_position, float)[:, None]
        eta = y / face_width
        xi = np.asarray(profile_share, float)[None, :]
        ends = np.clip(
            1.0 - (0.5 * face_width - np.abs(y)) / self.relief_length, 0.0, None
        )
        along = 4.0 * self.crowning * eta**2 - self.slope * eta + self.relief * ends
        return np.asarray(along - self.bias * eta * (xi - 0.5))


class SlicedFlank(NamedTuple):
    """A flank by slices of its face.

    Parameters
    ----------
    position : (n_face,) y of the middle of each slice from mid-face, ascending [m]
    width : b [m]
    lead : what is taken off on purpose over the face
    cosine : of β_b [1]
    """

    position: Array
    width: float
    lead: Lead
    cosine: float = 1.0
