"""Where planets can stand: angles at which they can be assembled, and room between neighbours."""

import math
from collections.abc import Sequence
from itertools import pairwise

from wearlab.gears.errors import GearError
from wearlab.gears.gear import Gear

PRINTED = 5e-3
"""How far from a whole number of teeth an angle may be: printed angles carry two decimals of a degree."""


def assembled_angles(teeth: int, planets: int, wanted: Sequence[float] | None = None) -> tuple[float, ...]:
    """Return the planets' angles, each at a whole number of ``(z_s + z_r) ψ / 2π`` from the first.

    Parameters
    ----------
    teeth : z_s + z_r [1]
    planets : N [1]
    wanted : ψ of each planet, rising [rad]; absent: equally spaced from 0

    Returns
    -------
    (N,) ψ [rad], rounding of printed angles removed

    Raises
    ------
    GearError : fewer than two planets, or angles at which they cannot be assembled; names the nearest

    References
    ----------
    Parker & Lin, J. Mech. Des. 126 (2004) 365–370, for the condition of assembly.
    """
    if planets < 2:
        raise GearError(f"a planetary set needs at least 2 planets, not {planets}")
    angles = [2.0 * math.pi * n / planets for n in range(planets)] if wanted is None else list(wanted)
    if len(angles) != planets:
        raise GearError(f"{len(angles)} planet angles for {planets} planets; give one angle each")
    if any(b <= a for a, b in pairwise(angles)) or angles[-1] - angles[0] >= 2 * math.pi:
        raise GearError("planet angles must rise, and lie within one turn")
    steps = [teeth * (angle - angles[0]) / (2.0 * math.pi) for angle in angles]
    whole = [round(step) for step in steps]
    nearest = tuple(angles[0] + 2.0 * math.pi * step / teeth for step in whole)
    for n, (step, count) in enumerate(zip(steps, whole, strict=True)):
        if abs(step - count) > PRINTED:
            listed = ", ".join(f"{math.degrees(angle):.6g}" for angle in nearest)
            spacing = "equally spaced planets" if wanted is None else "planets at these angles"
            raise GearError(
                f"{spacing} cannot be assembled: z_s + z_r = {teeth} teeth put planet {n + 1} {step:.4g} "
                f"teeth from the first, which must be whole; the nearest planet_angles are {listed} deg"
            )
    return nearest


def check_neighbours(angles: Sequence[float], pin_circle_radius: float, planet: Gear) -> None:
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
        apart = 2.0 * pin_circle_radius * math.sin(0.5 * min(second - first, 2.0 * math.pi - second + first))
        if apart <= 2.0 * planet.tip_radius:
            raise GearError(
                f"planets {n + 1} and {(n + 1) % len(angles) + 1} collide: their pins are "
                f"{apart * 1e3:.5g} mm apart and their tip diameter is {2e3 * planet.tip_radius:.5g} mm; use "
                "fewer planets or teeth"
            )
