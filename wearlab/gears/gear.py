"""An involute gear with every dimension resolved, and two gears in mesh."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.gears import root, specification
from wearlab.gears.shifts import ROUNDING, involute


class Gear(NamedTuple):
    """An involute spur gear, external or internal (a ring).

    Parameters
    ----------
    name : the member's name
    teeth : number of teeth z [1]
    module : m [m]
    pressure_angle : α at the reference circle [rad]
    profile_shift : profile shift coefficient x [1]; positive moves the profile
        outwards, ring or not
    base_radius, reference_radius, tip_radius, root_radius : r_b, r, r_a, r_f [m]
    form_radius : where the involute ends and the root curve begins [m]
    fillet_radius : tip rounding of the generating rack, or the root fillet of a ring
        [m]
    root_profile : "trochoid", "radial" or "fillet" (a ring's), resolved
    bore_radius : radius at which the body is clamped [m]; a ring's is the outside
        radius of its rim
    face_width : [m]
    material : elastic constants and density
    mass, inertia : [kg], [kg·m²]
    assumed : what nobody gave and was assumed, in words
    modification : profile modification, or None
    internal : whether the teeth point inwards: tip_radius < reference_radius <
        root_radius < bore_radius
    usable_tip_radius : r_Na, where a chamfer of the tip ends the active flank [m];
        None: at the tip circle
    """

    name: str
    teeth: int
    module: float
    pressure_angle: float
    profile_shift: float
    base_radius: float
    reference_radius: float
    tip_radius: float
    root_radius: float
    form_radius: float
    fillet_radius: float
    root_profile: specification.RootProfile
    bore_radius: float
    face_width: float
    material: specification.Material
    mass: float
    inertia: float
    assumed: tuple[str, ...] = ()
    modification: specification.Modification | None = None
    internal: bool = False
    usable_tip_radius: float | None = None

    @property
    def base_half_angle(self) -> float:
        """Half the tooth (ring: space) angle at the base circle [rad].

        ``π/2z + 2x tanα/z + inv α``.
        """
        return self.cut.base_half_angle

    @property
    def outwards(self) -> float:
        """1 where the teeth point outwards, −1 of a ring [1]."""
        return -1.0 if self.internal else 1.0

    @property
    def dedendum(self) -> float:
        """Depth of the generating rack below its own reference line [m].

        Of a ring's root beyond its own.
        """
        return self.outwards * (
            self.reference_radius + self.profile_shift * self.module - self.root_radius
        )

    @property
    def cut(self) -> root.RackCut:
        """The generating rack that leaves this tooth.

        Of a ring the one that would leave its space.
        """
        return root.RackCut(
            teeth=self.teeth,
            module=self.module,
            pressure_angle=self.pressure_angle,
            profile_shift=self.profile_shift,
            root_radius=self.root_radius,
            fillet=self.fillet_radius / self.module,
        )

    @property
    def active_tip_radius(self) -> float:
        """Radius at which the active flank ends: of the tip circle or its chamfer [m].

        References
        ----------
        ISO 21771:2007, 4.6: tip form diameter and usable tip diameter.
        """
        if self.usable_tip_radius is None:
            return self.tip_radius
        return self.usable_tip_radius

    @property
    def tip_curvature(self) -> float:
        """Radius of curvature of the involute where it ends, √(r_Na² − r_b²) [m]."""
        return math.sqrt(self.active_tip_radius**2 - self.base_radius**2)

    @property
    def form_curvature(self) -> float:
        """Radius of curvature where the involute begins, √(r_Ff² − r_b²) [m]."""
        return math.sqrt(max(self.form_radius**2 - self.base_radius**2, 0.0))

    @property
    def is_undercut(self) -> bool:
        """Whether the generating rack cut into the involute: it begins at an edge."""
        is_generated = not self.internal and self.root_profile == "trochoid"
        return is_generated and self.cut.end_curvature < 0.0

    def half_angle(self, radius: float) -> float:
        """Return half the tooth angle at a radius [rad].

        ``α2 − inv α_r``, of a ring ``π/z − α2 + inv α_r``.

        Parameters
        ----------
        radius : r [m]
        """
        pressure_angle = math.acos(min(1.0, self.base_radius / radius))
        half = self.base_half_angle - involute(pressure_angle)
        return math.pi / self.teeth - half if self.internal else half


FORM_SLACK = 1e-9  # relative, of a contact that begins at the form circle
DRIVING, DRIVEN = 0, 1
TIP_AT = {"A": DRIVEN, "E": DRIVING}
"""Whose tip touches at each end of the path."""


class PathOfContact(NamedTuple):
    """Characteristic points along the path of contact [m].

    The coordinate s counts from the pitch point and is positive in recess. ``B = E −
    ⌊ε⌋ p_b`` and ``D = A + ⌊ε⌋ p_b``: for 1 < ε < 2 the ends of single contact.
    """

    A: float
    B: float
    C: float
    D: float
    E: float


class GearPair(NamedTuple):
    """Two gears that mesh; arrays over the gears are ordered (driving, driven).

    Parameters
    ----------
    driving, driven : the gears
    centre_distance : a [m]
    working_pressure_angle : α_w [rad]
    base_pitch : p_b [m]
    path : the points A–E [m]
    face_width : common face width [m]
    overreach : (driving, driven) length along the path by which the tip of a gear
        reaches below the involute of its undercut mate, where nothing touches it [m]
    """

    driving: Gear
    driven: Gear
    centre_distance: float
    working_pressure_angle: float
    base_pitch: float
    path: PathOfContact
    face_width: float
    overreach: tuple[float, float] = (0.0, 0.0)

    @property
    def gears(self) -> tuple[Gear, Gear]:
        """The gears, (driving, driven)."""
        return self.driving, self.driven

    def corner_at(self, end: str) -> int:
        """Return whose corner touches beyond an end of the path, 0 driving, 1 driven.

        It is the tip of the gear whose tip touches there, but where that reaches below
        the involute of an undercut mate: then it is the edge of the mate.

        Parameters
        ----------
        end : "A" or "E"
        """
        tip = TIP_AT[end]
        return tip if self.overreach[tip] == 0.0 else 1 - tip

    def useful_tip_diameter(self, gear: int) -> float:
        """Return the tip diameter that touches where the mate's involute begins [m].

        ``d = 2 √(r_b² + ρ²)``, with ρ the curvature of this flank there: ``a sinα_w −
        ρ_F`` of an external gear, ``a sinα_w + ρ_F`` of a ring. A tip that reaches
        further has no more contact.

        Parameters
        ----------
        gear : 0 driving, 1 driven
        """
        toothing = self.gears[gear]
        mate = self.gears[1 - gear]
        lead = self.centre_distance * math.sin(self.working_pressure_angle)
        curvature = lead - toothing.outwards * mate.form_curvature
        if mate.internal:
            curvature = mate.form_curvature - lead
        return 2.0 * math.hypot(toothing.base_radius, curvature)

    @property
    def undercut_notes(self) -> tuple[str, ...]:
        """What is to be known of tips that reach below an undercut mate's involute."""
        notes = []
        for number, length in enumerate(self.overreach):
            if length == 0.0:
                continue
            gear = self.gears[number]
            mate = self.gears[1 - number]
            bound = "least" if gear.internal else "largest"
            notes.append(
                f"{gear.name}: its tip reaches {1e3 * length:.3g} mm of the path below "
                f"the involute of {mate.name}, into what the undercut left free: "
                f"contact ends at the sharp edge of {mate.name} (the {bound} useful "
                "tip_diameter is "
                f"{1e3 * self.useful_tip_diameter(number):.6g} mm)"
            )
        return tuple(notes)

    @property
    def internal(self) -> bool:
        """Whether one of the gears is a ring."""
        return self.driving.internal or self.driven.internal

    @property
    def ratio(self) -> float:
        """Speed of the driven over that of the driving gear, ``z_1 / z_2`` [1]."""
        return self.driving.teeth / self.driven.teeth

    @property
    def contact_ratio(self) -> float:
        """Transverse contact ratio, ε = (s_E − s_A) / p_b [1]."""
        return (self.path.E - self.path.A) / self.base_pitch

    def total_contact_ratio(self, base_helix_angle: float) -> float:
        """Return ε_γ = ε_α + ε_β, with ``ε_β = b tan β_b / p_bt`` [1].

        Parameters
        ----------
        base_helix_angle : β_b [rad]

        References
        ----------
        ISO 21771:2007, 5.4.
        """
        overlap = self.face_width * math.tan(base_helix_angle) / self.base_pitch
        return self.contact_ratio + overlap

    @property
    def backlash(self) -> float:
        """Backlash on the line of action, ``(2π r_w1 / z1 − s_w1 − s_w2) cos α_w`` [m].

        The normal backlash j_bn of spur gears, ``j_bn / cos β_b`` of helical ones: what
        the teeth leave free on the operating pitch circles; 0 where one of centre
        distance and shifts follows from the others and no tooth is thinned, negative
        where teeth jam.

        References
        ----------
        ISO 21771:2007, 5.5: circumferential and normal backlash.
        """
        cosine = math.cos(self.working_pressure_angle)
        radii = [gear.base_radius / cosine for gear in self.gears]
        pitch = 2.0 * math.pi * radii[0] / self.driving.teeth
        thick = sum(
            2.0 * r * gear.half_angle(r)
            for r, gear in zip(radii, self.gears, strict=True)
        )
        return (pitch - thick) * cosine

    @property
    def drawn_backlash(self) -> float | None:
        """The backlash along the line of action that a drawing's numbers leave [m].

        None where it is less than the numbers are rounded.
        """
        backlash = self.backlash
        return None if abs(backlash) <= self.rounding else backlash

    @property
    def rounding(self) -> float:
        """Backlash that shifts of three decimals leave open, ``2 m sin α Δx`` [m]."""
        return (
            2.0
            * self.driving.module
            * math.sin(self.driving.pressure_angle)
            * ROUNDING
            * (1.0 + 1e-6)
        )

    def curvature(self, s: ArrayLike) -> tuple[Array, Array]:
        """Return the radii of curvature of both flanks.

        ``ρ1 = r_b1 tanα_w ± s``, ``ρ2 = r_b2 tanα_w ∓ s``, upper signs without a ring.
        Contact moves from root to tip on the driving and from tip to root on the driven
        gear; a ring's root is where its radius is large, so a ring's sign is the lower
        one.

        Parameters
        ----------
        s : (n,) path coordinate [m]

        Returns
        -------
        (ρ1, ρ2), each (n,) [m]
        """
        position = np.asarray(s, dtype=float)
        t = math.tan(self.working_pressure_angle)
        first = self.driving.base_radius * t + self.driving.outwards * position
        return first, self.driven.base_radius * t - self.driven.outwards * position

    def equivalent_curvature(self, s: ArrayLike) -> Array:
        """Return the equivalent radius, 1/ρ = ±1/ρ1 ± 1/ρ2, minus of a ring, (n,) [m].

        Parameters
        ----------
        s : (n,) path coordinate [m]
        """
        rho1, rho2 = self.curvature(s)
        return (
            rho1 * rho2 / (self.driving.outwards * rho2 + self.driven.outwards * rho1)
        )

    def radius(self, gear: int, s: ArrayLike) -> Array:
        """Return the radius at which a gear touches at s, √(r_b² + ρ²), (n,) [m].

        Parameters
        ----------
        gear : 0 driving, 1 driven
        s : (n,) path coordinate [m]
        """
        return np.hypot(self.gears[gear].base_radius, self.curvature(s)[gear])

    def roll_angle(self, gear: int, s: ArrayLike) -> Array:
        """Return the roll angle ρ / r_b of a gear at s, (n,) [rad].

        Parameters
        ----------
        gear : 0 driving, 1 driven
        s : (n,) path coordinate [m]
        """
        return self.curvature(s)[gear] / self.gears[gear].base_radius

    def sliding(self, s: ArrayLike) -> Array:
        """Return the sliding velocity per speed of the driving gear, (n,) [m/rad].

        ``ρ1 − ρ2 z1/z2``, positive where the driving flank is the faster one (recess);
        0 at the pitch point.

        Parameters
        ----------
        s : (n,) path coordinate [m]
        """
        rho1, rho2 = self.curvature(s)
        return rho1 - rho2 * self.ratio

    def specific_sliding(self, s: ArrayLike) -> Array:
        """Return the specific sliding 1 − v_other / v_i of both flanks.

        Parameters
        ----------
        s : (n,) path coordinate [m]

        Returns
        -------
        (2, n) for (driving, driven) [1]
        """
        rho1, rho2 = self.curvature(s)
        v1 = rho1
        v2 = rho2 * self.ratio
        return np.stack([1.0 - v2 / v1, 1.0 - v1 / v2])

    def modification(self, gear: int, s: ArrayLike) -> Array:
        """Return what the modification of a flank removes at s, (n,) [m].

        Parameters
        ----------
        gear : 0 driving, 1 driven
        s : (n,) path coordinate [m]
        """
        position = np.asarray(s, dtype=float)
        modification = self.gears[gear].modification
        if modification is None:
            return np.zeros_like(position)
        if gear == DRIVING:
            from_root = position - self.path.A
        else:
            from_root = self.path.E - position
        length = self.path.E - self.path.A
        return modification.removed(from_root, length, self.overreach[gear])

    def from_root(self, gear: int, s: ArrayLike) -> Array:
        """Return the share of the active profile between its root end and s, (n,) [1].

        Parameters
        ----------
        gear : 0 driving, 1 driven
        s : (n,) path coordinate [m]
        """
        length = self.path.E - self.path.A
        share = (np.asarray(s, dtype=float) - self.path.A) / length
        return np.asarray(share if gear == DRIVING else 1.0 - share)


def in_mesh(driving: Gear, driven: Gear, centre_distance: float) -> GearPair:
    """Return the pair with its path of contact between the two tip circles.

    The pair is not yet checked. ``cos α_w = (r_b2 ± r_b1)/a``, ``s_E = ±(√(r_a1² −
    r_b1²) − r_b1 tanα_w)``, ``s_A = ∓(√(r_a2² − r_b2²) − r_b2 tanα_w)``, lower signs of
    a ring. The path ends where the involute of an undercut gear begins, however far the
    tip of its mate reaches.

    Parameters
    ----------
    driving, driven : the gears
    centre_distance : a [m]

    References
    ----------
    ISO 21771:2007, clause 5.
    """
    distance_of_bases = abs(
        driving.outwards * driving.base_radius + driven.outwards * driven.base_radius
    )
    alpha_w = math.acos(distance_of_bases / centre_distance)
    recess = _path_to_tip(driving, alpha_w)
    approach = _path_to_tip(driven, alpha_w)
    overreach = (
        _overreach(driven, recess, alpha_w),
        _overreach(driving, approach, alpha_w),
    )
    recess -= overreach[DRIVING]
    approach -= overreach[DRIVEN]
    p_b = math.pi * driving.module * math.cos(driving.pressure_angle)
    whole = math.floor((recess + approach) / p_b)
    path = PathOfContact(
        A=-approach,
        B=recess - whole * p_b,
        C=0.0,
        D=-approach + whole * p_b,
        E=recess,
    )
    width = min(driving.face_width, driven.face_width)
    return GearPair(
        driving, driven, centre_distance, alpha_w, p_b, path, width, overreach
    )


def _path_to_tip(gear: Gear, working_pressure_angle: float) -> float:
    """Return the length of the path from the pitch point to a gear's tip circle [m]."""
    at_pitch_point = gear.base_radius * math.tan(working_pressure_angle)
    return gear.outwards * (gear.tip_curvature - at_pitch_point)


def _overreach(gear: Gear, path_to_tip: float, working_pressure_angle: float) -> float:
    """Return by how much the mate's tip reaches below an undercut gear's involute [m].

    ``path_to_tip`` is the length of the path from the pitch point to that tip.
    """
    if not gear.is_undercut:
        return 0.0
    at_pitch_point = gear.base_radius * math.tan(working_pressure_angle)
    touched = at_pitch_point - path_to_tip
    radius = math.hypot(gear.base_radius, touched)
    if touched > 0.0 and gear.form_radius - radius <= FORM_SLACK * gear.form_radius:
        return 0.0
    return max(0.0, gear.form_curvature - touched)
