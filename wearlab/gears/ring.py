"""Ring gears: from a specification to an internal gear, its tooth space and its root.

A ring's tooth *space* has the shape of an external tooth of the same numbers: half its angle at a radius is
``ψ(r) = π/2z + 2x tanα/z + inv α − inv α_r``, and half the tooth's is ``π/z − ψ(r)``, wider towards the root
outside. A positive profile shift moves the space outwards and widens it.

The cutter that made a ring is rarely known, so its root is the simple one: the involute ends on a circular
fillet that touches it and the root circle. With ``r_c = r_f − ρ_F`` and ``ρ_c = √(r_c² − r_b²)`` of the
fillet's centre, the involute ends at ``√(r_b² + (ρ_c + ρ_F)²)`` (centre and end lie on one normal), and the
centre stands ``ψ_c = π/2z + 2x tanα/z + inv α − ρ_F/r_b − inv α_c`` from the space's centre line.
"""

import math

from wearlab.gears.build import Circles, check_specification, gear_of, refuse_pointed
from wearlab.gears.errors import GearError
from wearlab.gears.gear import Gear
from wearlab.gears.involute import involute
from wearlab.gears.root import ToothRoot
from wearlab.gears.specification import Basics, GearSpec, RootProfile

BISECTIONS = 60


def build_ring(
    spec: GearSpec, basics: Basics, *, profile_shift: float, assumed: tuple[str, ...] = ()
) -> Gear:
    """Resolve every dimension of one ring gear.

    ``r_a = m (z/2 + x − h_a − k)``, ``r_f = m (z/2 + x + h_f)``, or the given diameters. Without a tip
    alteration of its own k = 0: profile shifts leave a ring's tip clearances at the standard ones or above,
    and the pair may shorten it further (:mod:`wearlab.gears.room`). ``tip_alteration = "wang-2023"`` puts
    the tip at ``r − m h_a + m/(z tan²α)``, about where an unshifted pinion's involute begins.

    Parameters
    ----------
    spec : what is given; ``rim_diameter`` is required
    basics : of the set
    profile_shift : x [1]; positive: larger tooth spaces, farther out
    assumed : flags to carry along

    Returns
    -------
    Gear : with ``internal``; its ``bore_radius`` is the outside radius of the rim

    Raises
    ------
    GearError : with the reason, its numbers and a remedy

    References
    ----------
    ISO 21771:2007, 4; Wang et al., Appl. Sci. 13 (2023) 2022, Table 1, for the tip alteration.
    """
    _check_ring_specification(spec, basics.face_width)
    module, pressure_angle = basics[:2]
    r = 0.5 * module * spec.teeth
    r_b = r * math.cos(pressure_angle)
    k = spec.tip_alteration_coefficient or 0.0
    if spec.tip_alteration == "wang-2023":
        k = -1.0 / (spec.teeth * math.tan(pressure_angle) ** 2)
    r_a = spec.tip_radius(module, profile_shift, k, -1.0)
    r_f = spec.root_radius(module, profile_shift, -1.0)
    assert spec.rim_diameter is not None  # _check_ring_specification
    rim = 0.5 * spec.rim_diameter
    _check_circles(spec.name, r_b, r_a, r_f, rim)
    space = math.pi / (2 * spec.teeth) + 2.0 * profile_shift * math.tan(pressure_angle) / spec.teeth
    space += involute(pressure_angle)
    wanted = 0.0 if spec.root_profile == "radial" else spec.fillet_radius_coefficient * module
    fillet, fillet_flag = _fitting_fillet(spec.name, wanted, (r_b, r_a, r_f), space, module)
    profile: RootProfile = "fillet" if fillet > 0.0 else "radial"
    root = ToothRoot(profile, _form_radius(r_b, r_f, fillet), fillet, fillet_flag)
    circles = Circles(r_b, r_a, r_f, rim)
    ring = gear_of(spec, basics, profile_shift, circles, root, (*assumed, *root.assumed))
    _check_tooth(ring)
    return ring


def _check_ring_specification(spec: GearSpec, face_width: float | None) -> None:
    check_specification(spec, face_width)
    if spec.rim_diameter is None or not spec.rim_diameter > 0.0:
        raise GearError(
            f"{spec.name}: rim_diameter is missing: a ring needs the outside diameter of its rim, above its "
            "root diameter"
        )
    if spec.bore_diameter is not None:
        raise GearError(f"{spec.name}: a ring has no bore_diameter; give rim_diameter, outside its teeth")
    if spec.root_profile == "trochoid":
        raise GearError(
            f'{spec.name}: root_profile "trochoid" needs the cutter that made the ring; give "fillet" (a '
            'circle between involute and root circle) or "radial" (the involute up to the root circle)'
        )
    if spec.fillet_radius_coefficient < 0.0:
        raise GearError(
            f"{spec.name}: fillet_radius_coefficient must not be negative, not "
            f"{spec.fillet_radius_coefficient:g}"
        )


def _check_circles(name: str, r_b: float, r_a: float, r_f: float, rim: float) -> None:
    if not r_a > r_b:
        raise GearError(
            f"{name}: involute interference: the ring's tip diameter {2e3 * r_a:.5g} mm is not above its "
            f"base diameter {2e3 * r_b:.5g} mm, where the involute ends; shorten the tip with "
            'tip_alteration = "wang-2023", a larger tip_diameter or a smaller addendum_coefficient'
        )
    if not r_f > r_a:
        raise GearError(
            f"{name}: the root diameter {2e3 * r_f:.5g} mm of a ring must lie above its tip diameter "
            f"{2e3 * r_a:.5g} mm"
        )
    if not rim > r_f:
        raise GearError(
            f"{name}: rim_diameter {2e3 * rim:.5g} mm must lie above the root diameter {2e3 * r_f:.5g} mm"
        )


def _centre_half_angle(fillet: float, r_b: float, r_f: float, space: float) -> float:
    """Return ψ_c, how far a fillet's centre stands from the centre line of the tooth space [rad]."""
    return space - fillet / r_b - involute(math.acos(r_b / (r_f - fillet)))


def _form_radius(r_b: float, r_f: float, fillet: float) -> float:
    return math.hypot(r_b, math.sqrt((r_f - fillet) ** 2 - r_b**2) + fillet)


def _fitting_fillet(
    name: str, wanted: float, radii: tuple[float, float, float], space: float, module: float
) -> tuple[float, tuple[str, ...]]:
    """Return the wanted fillet radius, or the largest that two flanks of one tooth space leave room for.

    Parameters
    ----------
    name : of the ring
    wanted : fillet radius [m]
    radii : of the base, tip and root circle [m]
    space : half the angle of a tooth space on the base circle [rad]
    module : m [m]
    """
    r_b, r_a, r_f = radii
    width = _centre_half_angle(0.0, r_b, r_f, space)
    if width <= 0.0:
        raise GearError(
            f"{name}: the tooth space ends in a point below the root diameter {2e3 * r_f:.5g} mm; reduce the "
            "dedendum or raise profile_shift_coefficient"
        )
    limit = min(r_f - r_a, 0.999 * (r_f - r_b))
    if wanted <= limit and _centre_half_angle(wanted, r_b, r_f, space) >= 0.0:
        return wanted, ()
    low, high = 0.0, min(wanted, limit)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _centre_half_angle(middle, r_b, r_f, space) >= 0.0 else (low, middle)
    flag = (
        f"root fillet reduced from {wanted / module:.3g} to {low / module:.3g} modules: "
        "the largest in its tooth space"
    )
    return low, (flag,)


def _check_tooth(ring: Gear) -> None:
    if not ring.tip_radius < ring.form_radius:
        raise GearError(
            f"{ring.name}: no involute is left between the tip diameter {2e3 * ring.tip_radius:.5g} mm and "
            f"the form diameter {2e3 * ring.form_radius:.5g} mm; reduce fillet_radius_coefficient"
        )
    refuse_pointed(ring)
