"""When each mesh of a planetary set meets its pairs, on the clock of the first mesh.

Seen from the carrier the sun turns towards rising ψ and brings the same teeth to planet n after
``z_s ψ_n / 2π`` mesh periods; the ring turns the other way. Both agree: ``(z_s + z_r) ψ_n / 2π`` is whole.

Between the two meshes of one planet stands the planet itself. Let χ be the angle of a planet's tooth from the
line to the sun's centre, in the sense in which the planet turns; a tooth is half its angle at the pitch
circle, ψ_w, ahead of (driven) or behind (driving) a contact at the pitch point, s / r_b from one at s:

    sun side,  sun drives:    χ = ψ_w,sp + s_A,sp / r_b        ring side: χ = π − ψ_w,pr + s_A,pr / r_b
    sun side,  planet drives: χ = −ψ_w,sp + s_A,sp / r_b       ring side: χ = π + ψ_w,pr + s_A,pr / r_b

and ``γ_rs = z_p (χ_ring − χ_sun) / 2π``.
"""

import math
from collections.abc import Sequence

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.gear import Gear
from wearlab.gears.pair import GearPair


def mesh_phase_offsets(
    sun_planet: GearPair, planet_ring: GearPair, planet_angles: Sequence[float], *, sun_drives: bool
) -> Array:
    """Return the lag of every mesh: the phase of the clock at which a pair of it enters at A.

    ``γ_sn = z_s (ψ_n − ψ_1) / 2π``, ``γ_rn = γ_rs − z_r (ψ_n − ψ_1) / 2π = γ_rs + γ_sn``.

    Parameters
    ----------
    sun_planet, planet_ring : the two kinds of mesh
    planet_angles : (N,) ψ, in the sense in which the sun turns relative to the carrier [rad]
    sun_drives : direction of the power flow

    Returns
    -------
    (2N,) sun–planet 1 … N, planet–ring 1 … N, in [0, 1) [1]

    References
    ----------
    Parker & Lin, J. Mech. Des. 126 (2004) 365–370: mesh phasing of planetary gears, with γ_rs at the pitch
    points; here each mesh's own entry A.
    """
    sun = sun_planet.driving if sun_drives else sun_planet.driven
    ring = planet_ring.driven if sun_drives else planet_ring.driving
    # whole numbers of teeth apart: lags that are equal are the same number
    total = sun.teeth + ring.teeth
    apart = np.rint(total * (np.asarray(planet_angles) - planet_angles[0]) / (2.0 * math.pi))
    around = sun.teeth * apart % total / total
    between = entry_lag(sun_planet, planet_ring, sun_drives=sun_drives)
    return np.concatenate([around, fraction(between + around)])


def entry_lag(sun_planet: GearPair, planet_ring: GearPair, *, sun_drives: bool) -> float:
    """Return γ_rs: by how much a planet's ring mesh enters at A after its sun mesh, in [0, 1) [1].

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
    halves = sum(planet.half_angle(_pitch_radius(planet, pair)) for pair in (sun_planet, planet_ring))
    side = -halves if sun_drives else halves
    return float(fraction(planet.teeth * (math.pi + side + travelled) / (2.0 * math.pi)))


def _pitch_radius(planet: Gear, pair: GearPair) -> float:
    return planet.base_radius / math.cos(pair.working_pressure_angle)


def fraction(turns: Array | float) -> Array:
    """Return the fractional part in [0, 1); a rounding error below a whole number counts as 0."""
    part = np.asarray(turns) % 1.0
    return np.where(part > 1.0 - 1e-9, 0.0, part)
