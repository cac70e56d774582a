"""One involute gear, every dimension resolved."""

import math
from dataclasses import dataclass

from wearlab.gears.involute import involute
from wearlab.gears.materials import Material
from wearlab.gears.modification import Modification
from wearlab.gears.specification import RootProfile


@dataclass(frozen=True)
class Gear:
    """An involute spur gear, external or internal (a ring).

    Parameters
    ----------
    name : the member's name
    teeth : number of teeth z [1]
    module : m [m]
    pressure_angle : α at the reference circle [rad]
    profile_shift : profile shift coefficient x [1]; positive moves the profile outwards, ring or not
    base_radius, reference_radius, tip_radius, root_radius : r_b, r, r_a, r_f [m]
    form_radius : where the involute ends and the root curve begins [m]
    fillet_radius : tip rounding of the generating rack, or the root fillet of a ring [m]
    root_profile : "trochoid", "radial" or "fillet" (a ring's), resolved
    bore_radius : radius at which the body is clamped [m]; a ring's is the outside radius of its rim
    face_width : [m]
    material : elastic constants and density
    mass, inertia : [kg], [kg·m²]
    assumed : what nobody gave and was assumed, in words
    modification : profile modification, or None
    internal : whether the teeth point inwards: tip_radius < reference_radius < root_radius < bore_radius
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
    root_profile: RootProfile
    bore_radius: float
    face_width: float
    material: Material
    mass: float
    inertia: float
    assumed: tuple[str, ...] = ()
    modification: Modification | None = None
    internal: bool = False

    @property
    def base_half_angle(self) -> float:
        """Half the tooth (ring: space) angle at the base circle, π/2z + 2x tanα/z + inv α [rad]."""
        z, x, alpha = self.teeth, self.profile_shift, self.pressure_angle
        return math.pi / (2 * z) + 2.0 * x * math.tan(alpha) / z + involute(alpha)

    @property
    def dedendum(self) -> float:
        """Depth of the generating rack below its own reference line [m]; of a ring's root beyond its own."""
        if self.internal:
            return self.root_radius - self.reference_radius - self.profile_shift * self.module
        return self.reference_radius + self.profile_shift * self.module - self.root_radius

    def half_angle(self, radius: float) -> float:
        """Return half the tooth angle at a radius, α2 − inv α_r (ring: π/z − α2 + inv α_r) [rad]."""
        half = self.base_half_angle - involute(math.acos(min(1.0, self.base_radius / radius)))
        return math.pi / self.teeth - half if self.internal else half
