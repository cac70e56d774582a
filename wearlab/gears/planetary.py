"""Planetary sets: sun, planets on a carrier, and ring; the lag between their meshes.

Seen from the carrier the sun turns towards rising ψ and brings the same teeth to planet
n after ``z_s ψ_n / 2π`` mesh periods; the ring turns the other way. Both agree: ``(z_s
+ z_r) ψ_n / 2π`` is whole.

Between the two meshes of one planet stands the planet itself. Let χ be the angle of a
planet's tooth from the line to the sun's centre, in the sense in which the planet
turns; a tooth is half its angle at the pitch circle, ψ_w, ahead of (driven) or behind
(driving) a contact at the pitch point, s / r_b from one at s:

    sun side,  sun drives:    χ = ψ_w,sp + s_A,sp / r_b        ring side: χ = π − ψ_w,pr
    + s_A,pr / r_b sun side,  planet drives: χ = −ψ_w,sp + s_A,sp / r_b       ring side:
    χ = π + ψ_w,pr + s_A,pr / r_b

and ``γ_rs = z_p (χ_ring − χ_sun) / 2π``.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, NamedTuple, get_args

import numpy as np

from wearlab.arrays import Array
from wearlab.gears import gear, helix, making, pairs, shifts
from wearlab.gears.specification import Basics, GearError, GearSpec

Central = Literal["sun", "ring", "carrier"]
PRINTED = 5e-3
"""How far from a whole number of teeth an angle may be: printed angles carry two
decimals of a degree."""
ONE_DISTANCE = 0.005
"""How far pins may be from the centre distance, as a share."""
TWO_DISTANCES = 0.1
"""The same where a paper prints two centre distances."""


class TrainSpeeds(NamedTuple):
    """Speeds of a train, positive in one sense for all members.

    Parameters
    ----------
    sun, planet, ring, carrier : absolute [rad/s]
    sun_relative, planet_relative, ring_relative : relative to the carrier [rad/s]
    """

    sun: float
    planet: float
    ring: float
    carrier: float
    sun_relative: float
    planet_relative: float
    ring_relative: float


class TrainTorques(NamedTuple):
    """External torques on the central members, positive as their speeds are [N·m]."""

    sun: float
    ring: float
    carrier: float


@dataclass(frozen=True)
class Train:
    """A planetary train with one degree of freedom.

    ``z_s (ω_s − ω_c) + z_r (ω_r − ω_c) = 0``, ``z_p (ω_p − ω_c) = −z_s (ω_s − ω_c)``,
    ``T_s / z_s = T_r / z_r = −T_c / (z_s + z_r)``.

    Parameters
    ----------
    sun_teeth, planet_teeth, ring_teeth : z_s, z_p, z_r [1]
    input, output, fixed : the three central members, in the three roles

    Raises
    ------
    GearError : a member in two roles

    References
    ----------
    Willis's equation; VDI 2157:2012.
    """

    sun_teeth: int
    planet_teeth: int
    ring_teeth: int
    input: Central = "sun"
    output: Central = "carrier"
    fixed: Central = "ring"

    def __post_init__(self) -> None:
        if {self.input, self.output, self.fixed} != set(get_args(Central)):
            raise GearError(
                f"input {self.input!r}, output {self.output!r} and fixed "
                f"{self.fixed!r} must be sun, ring and carrier, each once"
            )

    def _weight(self, member: Central) -> float:
        """Return w with Σ w ω = 0 over the central members.

        Torques are in the same ratio.
        """
        weights = {
            "sun": self.sun_teeth,
            "ring": self.ring_teeth,
            "carrier": -(self.sun_teeth + self.ring_teeth),
        }
        return weights[member]

    @property
    def ratio(self) -> float:
        """Speed of the output over that of the input [1]."""
        return -self._weight(self.input) / self._weight(self.output)

    def speeds(self, speed: float) -> TrainSpeeds:
        """Return all speeds from that of the input.

        Parameters
        ----------
        speed : of the input member [rad/s]
        """
        turning = {self.input: speed, self.output: speed * self.ratio, self.fixed: 0.0}
        sun = turning["sun"]
        ring = turning["ring"]
        carrier = turning["carrier"]
        planet = -(sun - carrier) * self.sun_teeth / self.planet_teeth
        return TrainSpeeds(
            sun, planet + carrier, ring, carrier, sun - carrier, planet, ring - carrier
        )

    def torques(self, torque: float, member: Central | None = None) -> TrainTorques:
        """Return the external torques on all central members from one, without losses.

        Parameters
        ----------
        torque : on that member [N·m]
        member : which; absent: the input
        """
        per_weight = torque / self._weight(member or self.input)
        return TrainTorques(
            *(per_weight * self._weight(name) for name in get_args(Central))
        )

    @property
    def sun_drives(self) -> bool:
        """Whether power flows from the sun to the ring, as seen from the carrier.

        It does when the torque on the sun acts in the sense in which the sun turns
        relative to the carrier.
        """
        return self.torques(1.0).sun * self.speeds(1.0).sun_relative > 0.0

    def mesh_frequency(self, speed: float) -> float:
        """Return the mesh frequency of both meshes, ``z_s |ω_s − ω_c| / 2π`` [Hz].

        Parameters
        ----------
        speed : of the input member [rad/s]
        """
        return self.sun_teeth * abs(self.speeds(speed).sun_relative) / (2.0 * math.pi)


def entry_lag(
    sun_planet: gear.GearPair, planet_ring: gear.GearPair, *, sun_drives: bool
) -> float:
    """Return γ_rs, by how much a planet's ring mesh enters at A after its sun mesh [1].

    It is a share of the mesh period in [0, 1).

    Parameters
    ----------
    sun_planet, planet_ring : the two kinds of mesh
    sun_drives : direction of the power flow

    References
    ----------
    Parker & Lin, J. Mech. Des. 126 (2004) 365–370; here from entry to entry.
    """
    planet = planet_ring.driving if sun_drives else planet_ring.driven
    travelled = (planet_ring.path.A - sun_planet.path.A) / planet.base_radius
    angles = [pair.working_pressure_angle for pair in (sun_planet, planet_ring)]
    halves = sum(
        planet.half_angle(planet.base_radius / math.cos(angle)) for angle in angles
    )
    side = -halves if sun_drives else halves
    return float(
        fraction(planet.teeth * (math.pi + side + travelled) / (2.0 * math.pi))
    )


def fraction(turns: Array | float) -> Array:
    """Return the fractional part in [0, 1).

    A rounding error below a whole number counts as 0.

    Parameters
    ----------
    turns : any numbers [1]
    """
    part = np.asarray(turns) % 1.0
    return np.where(part > 1.0 - 1e-9, 0.0, part)


def assembled_angles(
    teeth: int, planets: int, angles: Sequence[float] | None = None
) -> tuple[float, ...]:
    """Return the planets' angles, at whole numbers of ``(z_s + z_r) ψ / 2π``.

    Parameters
    ----------
    teeth : z_s + z_r [1]
    planets : N [1]
    angles : ψ of each planet, rising [rad]; absent: equally spaced from 0

    Returns
    -------
    (N,) ψ [rad], rounding of printed angles removed

    Raises
    ------
    GearError : fewer than two planets, or angles at which they cannot be assembled;
        names the nearest

    References
    ----------
    Parker & Lin, J. Mech. Des. 126 (2004) 365–370, for the condition of assembly.
    """
    if planets < 2:
        raise GearError(f"a planetary set needs at least 2 planets, not {planets}")
    spacing = "planets at these angles"
    if angles is None:
        spacing = "equally spaced planets"
        angles = [2.0 * math.pi * n / planets for n in range(planets)]
    if len(angles) != planets:
        raise GearError(
            f"{len(angles)} planet angles for {planets} planets; give one angle each"
        )
    falls = any(second <= first for first, second in pairwise(angles))
    if falls or angles[-1] - angles[0] >= 2 * math.pi:
        raise GearError("planet angles must rise, and lie within one turn")

    steps = [teeth * (angle - angles[0]) / (2.0 * math.pi) for angle in angles]
    whole = [round(step) for step in steps]
    nearest = tuple(angles[0] + 2.0 * math.pi * step / teeth for step in whole)
    for n, (step, count) in enumerate(zip(steps, whole, strict=True)):
        if abs(step - count) > PRINTED:
            listed = ", ".join(f"{math.degrees(angle):.6g}" for angle in nearest)
            raise GearError(
                f"{spacing} cannot be assembled: z_s + z_r = {teeth} teeth put planet "
                f"{n + 1} {step:.4g} teeth from the first, which must be whole; the "
                f"nearest planet_angles are {listed} deg"
            )
    return nearest


def check_neighbours(
    angles: Sequence[float], pin_circle_radius: float, planet: gear.Gear
) -> None:
    """Refuse planets whose tip circles meet.

    Parameters
    ----------
    angles : (N,) ψ [rad]
    pin_circle_radius : r_c [m]
    planet : every planet

    Raises
    ------
    GearError : naming the two planets and the overlap
    """
    following = [*angles[1:], angles[0] + 2.0 * math.pi]
    for n, (first, second) in enumerate(zip(angles, following, strict=True)):
        half_angle = 0.5 * min(second - first, 2.0 * math.pi - second + first)
        distance = 2.0 * pin_circle_radius * math.sin(half_angle)
        if distance <= 2.0 * planet.tip_radius:
            raise GearError(
                f"planets {n + 1} and {(n + 1) % len(angles) + 1} collide: their pins "
                f"are {distance * 1e3:.5g} mm apart and their tip diameter is "
                f"{2e3 * planet.tip_radius:.5g} mm; use fewer planets or teeth"
            )


class Carrier(NamedTuple):
    """What carries the planets' pins.

    Parameters
    ----------
    mass, inertia : without the planets [kg], [kg·m²]; None: not known, and nothing
        moves by it
    pin_circle_radius : of the pins [m]; None: the centre distance
    name : the member's name
    """

    mass: float | None = None
    inertia: float | None = None
    pin_circle_radius: float | None = None
    name: str = "carrier"


class PlanetarySet(NamedTuple):
    """A planetary set in its operating position.

    Meshes are ordered sun–planet 1 … N, then planet–ring 1 … N.

    Parameters
    ----------
    sun, planet, ring : the gears; the mass of a planet turns with its pin
    sun_planet : external pair, driven in the sense of ``sun_drives``
    planet_ring : internal pair; its planet is the sun–planet pair's
    carrier : with its pin circle radius resolved
    planet_angles : (N,) ψ, counted in the sense in which the sun turns relative to the
        carrier [rad]
    sun_drives : whether power flows sun → planet → ring as seen from the carrier, or
        the other way
    """

    sun: gear.Gear
    planet: gear.Gear
    ring: gear.Gear
    sun_planet: gear.GearPair
    planet_ring: gear.GearPair
    carrier: Carrier
    planet_angles: tuple[float, ...]
    sun_drives: bool

    @property
    def planets(self) -> int:
        """Number of planets N."""
        return len(self.planet_angles)

    @property
    def mesh_phase_offset(self) -> Array:
        """Lags γ of every mesh on the clock of the first, (2N,) in [0, 1) [1].

        The phase at which a pair of it enters at A, sun–planet 1 … N, planet–ring 1 …
        N: ``γ_sn = z_s (ψ_n − ψ_1) / 2π``, ``γ_rn = γ_rs − z_r (ψ_n − ψ_1) / 2π = γ_rs
        + γ_sn``.

        References
        ----------
        Parker & Lin, J. Mech. Des. 126 (2004) 365–370: mesh phasing of planetary gears,
        with γ_rs at the pitch points; here each mesh's own entry A.
        """
        # whole numbers of teeth apart: lags that are equal are the same number
        total = self.sun.teeth + self.ring.teeth
        turned = np.asarray(self.planet_angles) - self.planet_angles[0]
        around = (
            self.sun.teeth * np.rint(total * turned / (2.0 * math.pi)) % total / total
        )
        between = entry_lag(
            self.sun_planet, self.planet_ring, sun_drives=self.sun_drives
        )
        return np.concatenate([around, fraction(between + around)])

    @property
    def passes(self) -> dict[str, float]:
        """Passes of each flank per cycle [1].

        A cycle is a revolution of the sun relative to the carrier.
        """
        N = self.planets
        z_s = self.sun.teeth
        of_planet = z_s / self.planet.teeth
        return {
            "sun": float(N),
            "planet-sun": of_planet,
            "planet-ring": of_planet,
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
    turned: helix.Helix = helix.SPUR,
) -> PlanetarySet:
    """Return the planetary set of these members, or refuse it.

    Parameters
    ----------
    sun, planet, ring : the gears as specified
    carrier : the carrier
    basics : what the gears share
    planets : N [1]
    planet_angles : ψ of each planet, in the sense in which the sun turns relative to
        the carrier [rad]; absent: equally spaced from 0
    centre_distance : operating distance of both meshes, or (sun–planet, planet–ring) of
        a set as printed [m]; absent: from the profile shifts
    sun_drives : direction of the power flow seen from the carrier, as
        ``Train.sun_drives`` says
    turned : helix of the gears

    Returns
    -------
    PlanetarySet

    Raises
    ------
    GearError : a gear or a pair that cannot exist, shifts or tooth numbers that
        contradict the centre distance, planets that cannot be assembled or that
        collide; with numbers and a remedy

    References
    ----------
    ISO 21771:2007 for the gears; Parker & Lin 2004 for the phases of their meshes.
    """
    pairs.check_basics(sun, planet, basics)
    pairs.check_basics(planet, ring, basics)
    outer, inner = shifts.planetary_position(
        (sun.teeth, planet.teeth, ring.teeth),
        (
            sun.profile_shift_coefficient,
            planet.profile_shift_coefficient,
            ring.profile_shift_coefficient,
        ),
        basics,
        centre_distance,
    )
    a_sp = outer.centre_distance
    a_pr = inner.centre_distance
    sun_gear, planet_gear = (
        making.build_gear(spec, basics, x, outer.tip_alteration, outer.assumed)
        for spec, x in zip((sun, planet), outer.shifts, strict=True)
    )
    ring_gear = making.build_gear(
        ring,
        basics,
        inner.shifts[1],
        assumed=outer.assumed,
        internal=True,
        least_tip=pairs.least_ring_tip(planet_gear, ring.teeth, a_pr),
    )
    planet_gear, ring_gear = pairs.make_room(
        planet_gear, ring_gear, a_pr, shorten=ring.tip_is_derived
    )

    if sun_drives:
        external = gear.in_mesh(sun_gear, planet_gear, a_sp)
        internal = gear.in_mesh(planet_gear, ring_gear, a_pr)
    else:
        external = gear.in_mesh(planet_gear, sun_gear, a_sp)
        internal = gear.in_mesh(ring_gear, planet_gear, a_pr)
    pairs.check_pair(external, turned=turned)
    pairs.check_pair(internal, turned=turned)

    pin_circle = _pin_circle(carrier, a_sp, a_pr)
    angles = assembled_angles(sun.teeth + ring.teeth, planets, planet_angles)
    check_neighbours(angles, pin_circle or a_sp, planet_gear)
    return PlanetarySet(
        sun_gear,
        planet_gear,
        ring_gear,
        external,
        internal,
        carrier._replace(pin_circle_radius=pin_circle),
        angles,
        sun_drives,
    )


def _pin_circle(carrier: Carrier, a_sp: float, a_pr: float) -> float:
    """Return the radius of a carrier's pin circle [m], or refuse what no carrier has.

    ``a_sp`` and ``a_pr`` are the centre distances of both meshes.
    """
    for key, value in (("mass", carrier.mass), ("inertia", carrier.inertia)):
        if value is not None and not value > 0.0:
            raise GearError(f"{carrier.name}: {key} must be positive, not {value:g}")

    radius = carrier.pin_circle_radius
    is_one_distance = abs(a_sp - a_pr) <= 1e-9 * a_sp
    if radius is None:
        if not is_one_distance:
            raise GearError(
                f"{carrier.name}: two centre distances, {a_sp * 1e3:.5g} and "
                f"{a_pr * 1e3:.5g} mm, give no pin circle; give pin_circle_diameter"
            )
        return a_sp
    margin = ONE_DISTANCE if is_one_distance else TWO_DISTANCES
    smallest = (1.0 - margin) * min(a_sp, a_pr)
    largest = (1.0 + margin) * max(a_sp, a_pr)
    if not smallest < radius < largest:
        raise GearError(
            f"{carrier.name}: pin_circle_diameter {2e3 * radius:.5g} mm is far from "
            f"twice the centre distance: give {2e3 * a_sp:.5g} mm or nearly so, or "
            "leave it out"
        )
    return radius
