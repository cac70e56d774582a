"""Planetary sets: sun, planets on a carrier and ring, from specifications to a set that can be assembled."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from wearlab.arrays import Array
from wearlab.gears.build import build_gear
from wearlab.gears.errors import GearError
from wearlab.gears.external import assemble_external, check_basics, check_pair
from wearlab.gears.gear import Gear
from wearlab.gears.internal import assemble_internal
from wearlab.gears.lags import mesh_phase_offsets
from wearlab.gears.pair import GearPair
from wearlab.gears.ring import build_ring
from wearlab.gears.room import make_room
from wearlab.gears.shifts import planetary_position
from wearlab.gears.spacing import assembled_angles, check_neighbours
from wearlab.gears.specification import Basics, GearSpec

ONE_DISTANCE, TWO_DISTANCES = 0.005, 0.1
"""How far pins may be from the centre distance, as a share: where there is one, where a paper prints two."""


@dataclass(frozen=True)
class Carrier:
    """What carries the planets' pins.

    Parameters
    ----------
    mass, inertia : without the planets [kg], [kg·m²]
    pin_circle_radius : of the pins [m]; None: the centre distance
    name : the member's name
    """

    mass: float
    inertia: float
    pin_circle_radius: float | None = None
    name: str = "carrier"


@dataclass(frozen=True)
class PlanetarySet:
    """A planetary set in its operating position.

    Meshes are ordered sun–planet 1 … N, then planet–ring 1 … N.

    Parameters
    ----------
    sun_planet : external pair, driven in the sense of ``sun_drives``
    planet_ring : internal pair; its planet is the sun–planet pair's
    carrier : with its pin circle radius resolved
    planet_angles : (N,) ψ, counted in the sense in which the sun turns relative to the carrier [rad]
    sun_drives : whether power flows sun → planet → ring as seen from the carrier, or the other way
    """

    sun_planet: GearPair
    planet_ring: GearPair
    carrier: Carrier
    planet_angles: tuple[float, ...]
    sun_drives: bool

    @property
    def planets(self) -> int:
        """Number of planets N."""
        return len(self.planet_angles)

    @property
    def sun(self) -> Gear:
        """The sun."""
        return self.sun_planet.driving if self.sun_drives else self.sun_planet.driven

    @property
    def planet(self) -> Gear:
        """Every planet; its mass turns with its pin."""
        return self.sun_planet.driven if self.sun_drives else self.sun_planet.driving

    @property
    def ring(self) -> Gear:
        """The ring."""
        return self.planet_ring.driven if self.sun_drives else self.planet_ring.driving

    @property
    def mesh_phase_offset(self) -> Array:
        """Lags γ of every mesh on the clock of the first, (2N,) in [0, 1) [1]."""
        return mesh_phase_offsets(
            self.sun_planet, self.planet_ring, self.planet_angles, sun_drives=self.sun_drives
        )

    @property
    def passes(self) -> dict[str, float]:
        """Passes of each flank per cycle, a revolution of the sun relative to the carrier [1]."""
        N, z_s = self.planets, self.sun.teeth
        return {
            "sun": float(N),
            "planet-sun": z_s / self.planet.teeth,
            "planet-ring": z_s / self.planet.teeth,
            "ring": N * z_s / self.ring.teeth,
        }


def planetary_set(
    sun: GearSpec,
    planet: GearSpec,
    ring: GearSpec,
    carrier: Carrier,
    basics: Basics,
    *,
    planets: int,
    planet_angles: Sequence[float] | None = None,
    centre_distance: float | tuple[float, float] | None = None,
    sun_drives: bool = True,
) -> PlanetarySet:
    """Return the planetary set of these members, or refuse it.

    Parameters
    ----------
    sun, planet, ring : the gears as specified
    carrier : the carrier
    basics : what the gears share
    planets : N [1]
    planet_angles : ψ of each planet, in the sense in which the sun turns relative to the carrier [rad];
        absent: equally spaced from 0
    centre_distance : operating distance of both meshes, or (sun–planet, planet–ring) of a set as printed
        [m]; absent: from the profile shifts
    sun_drives : direction of the power flow seen from the carrier, as ``Train.sun_drives`` says

    Returns
    -------
    PlanetarySet

    Raises
    ------
    GearError : a gear or a pair that cannot exist, shifts or tooth numbers that contradict the centre
        distance, planets that cannot be assembled or that collide; with numbers and a remedy

    References
    ----------
    ISO 21771:2007 for the gears; Parker & Lin 2004 for the phases of their meshes.
    """
    check_basics(sun, planet, basics)
    check_basics(planet, ring, basics)
    position = planetary_position(
        (sun.teeth, planet.teeth, ring.teeth),
        (sun.profile_shift_coefficient, planet.profile_shift_coefficient, ring.profile_shift_coefficient),
        module=basics.module,
        pressure_angle=basics.pressure_angle,
        centre_distance=centre_distance,
    )
    built = [
        build_gear(
            spec, basics, profile_shift=x, tip_alteration=position.tip_alteration, assumed=position.assumed
        )
        for spec, x in zip((sun, planet), position.shifts[:2], strict=True)
    ]
    outer = build_ring(ring, basics, profile_shift=position.shifts[2], assumed=position.assumed)
    a_sp, a_pr = position.centre_distances
    inner, (middle, outer) = built[0], make_room(built[1], outer, a_pr, shorten=ring.tip_is_derived)
    driving, driven = (inner, middle) if sun_drives else (middle, inner)
    alpha_w = math.acos((inner.base_radius + middle.base_radius) / a_sp)
    external = assemble_external(driving, driven, a_sp, alpha_w)
    check_pair(external)
    internal = assemble_internal(middle, outer, a_pr, ring_drives=not sun_drives)
    held = _resolved(carrier, a_sp, a_pr)
    angles = assembled_angles(sun.teeth + ring.teeth, planets, planet_angles)
    assert held.pin_circle_radius is not None
    check_neighbours(angles, held.pin_circle_radius, middle)
    return PlanetarySet(external, internal, held, angles, sun_drives)


def _resolved(carrier: Carrier, a_sp: float, a_pr: float) -> Carrier:
    """Return the carrier with its pin circle, or refuse what no carrier has."""
    for word in ("mass", "inertia"):
        if not getattr(carrier, word) > 0.0:
            raise GearError(f"{carrier.name}: {word} must be positive, not {getattr(carrier, word):g}")
    radius = carrier.pin_circle_radius
    if radius is None:
        if abs(a_sp - a_pr) > 1e-9 * a_sp:
            raise GearError(
                f"{carrier.name}: two centre distances, {a_sp * 1e3:.5g} and {a_pr * 1e3:.5g} mm, give no "
                "pin circle; give pin_circle_diameter"
            )
        return replace(carrier, pin_circle_radius=a_sp)
    apart = ONE_DISTANCE if abs(a_sp - a_pr) <= 1e-9 * a_sp else TWO_DISTANCES
    if not (1.0 - apart) * min(a_sp, a_pr) < radius < (1.0 + apart) * max(a_sp, a_pr):
        raise GearError(
            f"{carrier.name}: pin_circle_diameter {2e3 * radius:.5g} mm is far from twice the centre "
            f"distance, {2e3 * a_sp:.5g} mm"
        )
    return carrier
