"""What is given of gears, and the refusal of what cannot be.

Material, modification of the profile as material removed normal to the flank, teeth and
dimensions.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array


class GearError(ValueError):
    """A gear or a pair that cannot exist: the reason with its numbers, and a remedy."""


Plane = Literal["strain", "stress"]


class Material(NamedTuple):
    """An isotropic, linearly elastic material.

    Parameters
    ----------
    youngs_modulus : Young's modulus E [Pa]
    poisson_ratio : Poisson's ratio ν [1]
    density : density [kg/m³]
    flank_modulus : E of the flanks where these are warmer or colder than the teeth,
        None: as of the teeth [Pa]
    """

    youngs_modulus: float
    poisson_ratio: float
    density: float
    flank_modulus: float | None = None

    @property
    def at_flank(self) -> "Material":
        """The material of the flanks, which the contact itself presses."""
        if self.flank_modulus is None:
            return self
        return self._replace(youngs_modulus=self.flank_modulus, flank_modulus=None)

    @property
    def shear_modulus(self) -> float:
        """Shear modulus, G = E / (2 (1 + ν)) [Pa]."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def plane_strain_modulus(self) -> float:
        """Plane-strain modulus, E / (1 − ν²) [Pa]."""
        return self.youngs_modulus / (1.0 - self.poisson_ratio**2)

    def in_plane(self, plane: Plane) -> "Material":
        """Return the material whose plane stress is this one's in a plane state.

        In plane strain that of the same G with ``E/(1 − ν²)`` and ``ν/(1 − ν)``.

        Parameters
        ----------
        plane : "stress" or "strain"
        """
        if plane == "stress":
            return self
        nu = self.poisson_ratio
        return self._replace(
            youngs_modulus=self.plane_strain_modulus, poisson_ratio=nu / (1.0 - nu)
        )


STEEL = Material(youngs_modulus=206e9, poisson_ratio=0.3, density=7830.0)


def refuse_first(name: str, problems: Iterable[str]) -> None:
    """Refuse a gear for its first problem.

    Parameters
    ----------
    name : of the gear, "" for a pair
    problems : each with its remedy; none where the gear is right

    Raises
    ------
    GearError : there is one
    """
    for problem in problems:
        raise GearError(f"{name}: {problem}" if name else problem)


RELIEF_SLACK = 1e-9  # relative, of a length that is the whole active path
POWERS = {"linear": 1, "parabolic": 2}
"""Power of the distance from its beginning with which a relief of each shape grows."""


class Relief(NamedTuple):
    """Material removed over a length of the path at one end of the active profile.

    Parameters
    ----------
    amount : material removed at the very end [m]
    length : length along the path of contact over which the relief fades to 0 [m]
    shape : "linear" or "parabolic" (tangent to the unmodified profile where it begins)
    """

    amount: float
    length: float
    shape: Literal["linear", "parabolic"] = "linear"

    def removed(self, distance: Array) -> Array:
        """Return the material removed, (n,) [m].

        Parameters
        ----------
        distance : (n,) from the profile's end [m]
        """
        return (
            self.amount
            * np.clip(1.0 - distance / self.length, 0.0, None) ** POWERS[self.shape]
        )


class ReliefFrom(NamedTuple):
    """A tip relief by where it starts on the flank.

    Parameters
    ----------
    amount : material removed at the tip [m]
    radius : where the relief starts [m], None when it is given by roll angle
    roll_angle : where it starts [rad], None when it is given by radius
    shape : "linear" or "parabolic"
    """

    amount: float
    radius: float | None = None
    roll_angle: float | None = None
    shape: Literal["linear", "parabolic"] = "linear"

    def of(
        self, base_radius: float, tip_radius: float, name: str, *, internal: bool
    ) -> Relief:
        """Return the relief of a gear, ``length = |√(r_a² − r_b²) − ρ|``.

        ρ is r_b φ or √(r² − r_b²).

        Raises
        ------
        GearError : it would start below the base circle or not before the tip
        """
        tip = math.sqrt(tip_radius**2 - base_radius**2)
        if self.roll_angle is not None:
            start = base_radius * self.roll_angle
            place = f"{math.degrees(self.roll_angle):.4g} deg"
        else:
            assert self.radius is not None
            place = f"{2e3 * self.radius:.6g} mm"
            square = self.radius**2 - base_radius**2
            if square <= 0.0:
                raise GearError(
                    f"{name}: tip_relief cannot start at {place}, inside the base "
                    f"circle of {2e3 * base_radius:.6g} mm; give a start_diameter "
                    "between it and the tip diameter of "
                    f"{2e3 * tip_radius:.6g} mm"
                )
            start = math.sqrt(square)
        if not (start > tip if internal else start < tip):
            raise GearError(
                f"{name}: tip_relief starts at {place}, which is not between root and "
                f"tip; the tip lies at a diameter of {2e3 * tip_radius:.6g} mm and a "
                f"roll angle of {math.degrees(tip / base_radius):.4g} deg"
            )
        return Relief(self.amount, abs(tip - start), self.shape)


class Modification(NamedTuple):
    """All profile modifications of one flank.

    Parameters
    ----------
    tip_relief, root_relief : reliefs, or None
    profile_crowning : amount removed at both ends, parabola with 0 in the middle [m]
    profile_slope : surplus of material at the tip end against the root end, 0 in the
        middle [m]; positive as f_Hα of ISO 1328-1 (material grows towards the tip)
    """

    tip_relief: Relief | None = None
    root_relief: Relief | None = None
    profile_crowning: float = 0.0
    profile_slope: float = 0.0

    def removed(
        self, position: ArrayLike, active_length: float, overreach: float = 0.0
    ) -> Array:
        """Return the material removed normal to the flank.

        ``g(x) = tip(L + o − x) + root(x) + c (2x/L − 1)² − f (x/L − ½)``

        Parameters
        ----------
        position : (n,) x, distance along the path from the root end of the active
            profile [m]
        active_length : L, length of the active path A–E [m]
        overreach : o, how far the tip lies beyond the active profile [m]

        Returns
        -------
        (n,) material removed [m]; positive is a gap, negative (slope only) a surplus
        """
        x = np.asarray(position, dtype=float)
        centred = x / active_length - 0.5
        removed = (
            4.0 * self.profile_crowning * centred**2 - self.profile_slope * centred
        )
        if self.tip_relief is not None:
            removed = removed + self.tip_relief.removed(active_length - x + overreach)
        if self.root_relief is not None:
            removed = removed + self.root_relief.removed(x)
        return removed


def check_reliefs(
    modification: Modification | None, active_length: float, name: str
) -> None:
    """Refuse reliefs that are negative or longer than the active profile.

    Parameters
    ----------
    modification : of the gear, or None
    active_length : of the path of contact [m]
    name : of the gear

    Raises
    ------
    GearError : naming the relief, its numbers and the longest one possible
    """
    for key in ("tip_relief", "root_relief"):
        relief = getattr(modification, key, None)
        if relief is None:
            continue
        amount = relief.amount
        length = relief.length
        if not amount >= 0.0:
            raise GearError(
                f"{name}: {key} amount {amount * 1e6:.3g} µm is negative; give >= 0"
            )
        if not 0.0 < length <= active_length * (1.0 + RELIEF_SLACK):
            raise GearError(
                f"{name}: {key} length {length * 1e3:.4g} mm must lie above 0 and "
                f"within the active path of {active_length * 1e3:.4g} mm"
            )


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
    profile_shift_coefficient : x [1]; absent: 0, or derived from a given centre
        distance. Positive: thicker teeth, farther out (external); larger tooth spaces,
        farther out (ring; ISO 21771 and DIN 3960 count a ring's teeth negative, and its
        shift with the opposite sign)
    tooth_thickness_allowance : E_sn of the tooth thickness at the reference circle,
        below 0 thinner [m]
    addendum_coefficient : h_a* [1]; absent: 1. Not together with ``tip_diameter``
    dedendum_coefficient : h_f* [1]; absent: 1.25. Not together with ``root_diameter``
    tip_alteration_coefficient : k [1], negative shortens; absent: keeps the standard
        tip clearance (ISO 21771), and a ring's tip clear of its mate's root curve
    tip_alteration : "wang-2023" shortens a ring's teeth as Y23 does; not with another
        tip alteration
    tip_diameter, root_diameter : explicit diameters [m]
    tip_chamfer : radial height h_K of the chamfer at the tip [m]
    usable_tip_diameter : d_Na, where the active flank ends, instead of the chamfer [m]
    fillet_radius_coefficient : tip rounding of the generating rack, or a ring's root
        fillet, in modules [1]
    root_profile : "trochoid" or "radial"; absent: a trochoid where a rack can generate
        it, else radial. A ring: "fillet" (absent) or "radial", the involute up to the
        root circle
    rim_diameter : outside diameter of a ring's rim [m], required for a ring
    bore_diameter : bore of the wheel body [m]; absent: half the root diameter, flagged
        as assumed
    face_width : [m]; absent: that of the pair
    material : absent: that of the pair
    mass, inertia : [kg], [kg·m²]; absent: the solid between the bore and the reference
        circle
    tip_relief, root_relief : reliefs at the ends of the active profile
    profile_crowning : 0 in the middle, this amount removed at both ends of the active
        profile [m]
    profile_slope : surplus of material at the tip end against the root end [m] (f_Hα of
        ISO 1328-1)
    """

    name: str
    teeth: int
    profile_shift_coefficient: float | None = None
    tooth_thickness_allowance: float = 0.0
    addendum_coefficient: float | None = None
    dedendum_coefficient: float | None = None
    tip_alteration_coefficient: float | None = None
    tip_alteration: TipAlteration | None = None
    tip_diameter: float | None = None
    root_diameter: float | None = None
    tip_chamfer: float | None = None
    usable_tip_diameter: float | None = None
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
            self.tip_diameter
            is self.tip_alteration
            is self.tip_alteration_coefficient
            is self.usable_tip_diameter
            is None
        )

    def usable_tip_radius(self, tip_radius: float, outwards: float) -> float | None:
        """Return where a chamfer of the tip ends the active flank, ``r_a ∓ h_K`` [m].

        Parameters
        ----------
        tip_radius : r_a [m]
        outwards : 1 where teeth point outwards, −1 of a ring

        Returns
        -------
        r_Na [m], None without a chamfer
        """
        if self.usable_tip_diameter is not None:
            return 0.5 * self.usable_tip_diameter
        if self.tip_chamfer is None:
            return None
        return tip_radius - outwards * self.tip_chamfer

    def modification(
        self, base_radius: float, tip_radius: float, *, internal: bool
    ) -> Modification | None:
        """Return what is removed from the involute on purpose, None where nothing is.

        Parameters
        ----------
        base_radius, tip_radius : of the gear [m]
        internal : whether it is a ring
        """
        tip = self.tip_relief
        if isinstance(tip, ReliefFrom):
            tip = tip.of(base_radius, tip_radius, self.name, internal=internal)
        if (
            tip is None
            and self.root_relief is None
            and not self.profile_crowning
            and not self.profile_slope
        ):
            return None
        return Modification(
            tip,
            self.root_relief,
            self.profile_crowning or 0.0,
            self.profile_slope or 0.0,
        )

    def thinning(self, module: float, pressure_angle: float) -> float:
        """Return how much deeper the cutter is fed into a gear, in modules [1].

        It is ``E_sn / (2 m tan α)``.
        The generating profile shift is ``x_E = x + E_sn / (2 m tan α)``; a ring's
        spaces widen, x_E = x − … .

        Parameters
        ----------
        module, pressure_angle : m [m], α [rad]

        References
        ----------
        ISO 21771:2007, 4.8; DIN 3967 for the allowances.
        """
        return self.tooth_thickness_allowance / (
            2.0 * module * math.tan(pressure_angle)
        )

    def tip_radius(
        self, module: float, profile_shift: float, alteration: float, outwards: float
    ) -> float:
        """Return the radius of the tip circle as given, or as it follows [m].

        It follows as ``m (z/2 + x ± (h_a + k))``.

        Parameters
        ----------
        module, profile_shift, alteration : m [m], x [1], k [1]
        outwards : 1 where teeth point outwards, −1 of a ring
        """
        if self.tip_diameter is not None:
            return 0.5 * self.tip_diameter
        height = 1.0 if self.addendum_coefficient is None else self.addendum_coefficient
        return module * (
            0.5 * self.teeth + profile_shift + outwards * height + outwards * alteration
        )

    def root_radius(
        self, module: float, profile_shift: float, outwards: float
    ) -> float:
        """Return the radius of the root circle as given, or as it follows [m].

        It follows as ``m (z/2 + x ∓ h_f)``.

        Parameters
        ----------
        module, profile_shift, outwards : as of `tip_radius`
        """
        if self.root_diameter is not None:
            return 0.5 * self.root_diameter
        height = (
            1.25 if self.dedendum_coefficient is None else self.dedendum_coefficient
        )
        return module * (0.5 * self.teeth + profile_shift - outwards * height)
