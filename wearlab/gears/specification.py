"""What a user may say about one gear: absent means "derive it"."""

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

from wearlab.gears.materials import STEEL, Material
from wearlab.gears.modification import Relief, ReliefFrom

RootProfile = Literal["trochoid", "radial", "fillet"]
TipAlteration = Literal["wang-2023"]


class Basics(NamedTuple):
    """What the gears of a set share.

    Parameters
    ----------
    module, pressure_angle : m [m], α [rad]
    face_width, material : of gears without their own
    """

    module: float
    pressure_angle: float = math.radians(20.0)
    face_width: float | None = None
    material: Material = STEEL


@dataclass(frozen=True, kw_only=True)
class GearSpec:
    """The given properties of one gear, external or ring; ``None`` is derived.

    Parameters
    ----------
    name : the member's name, used in messages
    teeth : number of teeth [1]
    profile_shift_coefficient : x [1]; absent: 0, or derived from a given centre distance. Positive: thicker
        teeth, farther out (external); larger tooth spaces, farther out (ring; ISO 21771 and DIN 3960 count a
        ring's teeth negative, and its shift with the opposite sign)
    addendum_coefficient : h_a* [1]; absent: 1. Not together with ``tip_diameter``
    dedendum_coefficient : h_f* [1]; absent: 1.25. Not together with ``root_diameter``
    tip_alteration_coefficient : k [1], negative shortens; absent: keeps the standard tip clearance
        (ISO 21771), and a ring's tip clear of its mate's root curve
    tip_alteration : "wang-2023" shortens a ring's teeth as Y23 does; not with another tip alteration
    tip_diameter, root_diameter : explicit diameters [m]
    fillet_radius_coefficient : tip rounding of the generating rack, or a ring's root fillet, in modules [1]
    root_profile : "trochoid" or "radial"; absent: a trochoid where a rack can generate it, else radial.
        A ring: "fillet" (absent) or "radial", the involute up to the root circle
    rim_diameter : outside diameter of a ring's rim [m], required for a ring
    bore_diameter : bore of the wheel body [m]; absent: half the root diameter, flagged as assumed
    face_width : [m]; absent: that of the pair
    material : absent: that of the pair
    mass, inertia : [kg], [kg·m²]; absent: the solid between the bore and the reference circle
    tip_relief, root_relief : reliefs at the ends of the active profile
    profile_crowning : 0 in the middle, this amount removed at both ends of the active profile [m]
    profile_slope : surplus of material at the tip end against the root end [m] (f_Hα of ISO 1328-1)
    """

    name: str
    teeth: int
    profile_shift_coefficient: float | None = None
    addendum_coefficient: float | None = None
    dedendum_coefficient: float | None = None
    tip_alteration_coefficient: float | None = None
    tip_alteration: TipAlteration | None = None
    tip_diameter: float | None = None
    root_diameter: float | None = None
    fillet_radius_coefficient: float = 0.38
    root_profile: RootProfile | None = None
    rim_diameter: float | None = None
    bore_diameter: float | None = None
    face_width: float | None = None
    material: Material | None = None
    mass: float | None = None
    inertia: float | None = None
    tip_relief: Relief | ReliefFrom | None = None
    root_relief: Relief | None = None
    profile_crowning: float | None = None
    profile_slope: float | None = None

    @property
    def tip_is_derived(self) -> bool:
        """Whether nothing was said about the tip but its addendum."""
        return (
            self.tip_diameter is None
            and self.tip_alteration is None
            and self.tip_alteration_coefficient is None
        )

    def tip_radius(self, module: float, profile_shift: float, alteration: float, outwards: float) -> float:
        """Return the radius of the tip circle, ``m (z/2 + x ± (h_a + k))`` unless it is given [m].

        Parameters
        ----------
        module, profile_shift, alteration : m [m], x [1], k [1]
        outwards : 1 where teeth point outwards, −1 of a ring
        """
        if self.tip_diameter is not None:
            return 0.5 * self.tip_diameter
        height = 1.0 if self.addendum_coefficient is None else self.addendum_coefficient
        return module * (0.5 * self.teeth + profile_shift + outwards * height + outwards * alteration)

    def root_radius(self, module: float, profile_shift: float, outwards: float) -> float:
        """Return that of the root circle, ``m (z/2 + x ∓ h_f)``, parameters as of `tip_radius` [m]."""
        if self.root_diameter is not None:
            return 0.5 * self.root_diameter
        height = 1.25 if self.dedendum_coefficient is None else self.dedendum_coefficient
        return module * (0.5 * self.teeth + profile_shift - outwards * height)
