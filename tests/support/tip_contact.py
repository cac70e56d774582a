"""Contact beyond the path: how far a tip corner is from the mating flank before A and
after E.

Rigid gears part there, at first quadratically; a deflection as large as the separation
keeps them touching (Munro, Morrish & Palmer, Proc. IMechE C 213 (1999) 245–259, treat
the same corner contact).
"""

import math

from wearlab.gears.gear import TIP_AT, GearPair


def tip_separation(pair: GearPair, end: str, distance: float) -> float:
    """Return the gap along the line of action between a tip corner and the mating flank
    [m].

    The tip corner turns on by ``distance / r_b``; through it passes one involute of the
    mate, and the gap is how far that involute lies from where the mate's flank has
    turned to. The corner of a ring's tip lies on the other side of the pitch point, and
    moves the other way.

    Parameters
    ----------
    pair : the pair
    end : "A" (tip of the driven gear) or "E" (tip of the driving gear)
    distance : how far beyond the end of the path the gears have turned, along the line
        of action [m]

    References
    ----------
    Munro, Morrish & Palmer 1999: tip corners touch beyond the ends of the path.
    """
    own = pair.gears[TIP_AT[end]]
    mate = pair.gears[1 - TIP_AT[end]]
    direction = -1.0 if own.internal else 1.0
    centre = -pair.centre_distance if mate.internal else pair.centre_distance
    angle = pair.working_pressure_angle
    along = complex(math.sin(angle), math.cos(angle))
    corner = (
        own.base_radius / math.cos(angle)
        + direction * abs(getattr(pair.path, end)) * along
    )
    # the mate turns against an external gear and with a ring
    ratio = own.teeth / mate.teeth * (-1.0 if pair.internal else 1.0)
    seen = corner - centre
    sign = min(
        (1, -1),
        key=lambda sign: abs(_drift(corner, seen, mate.base_radius, 1e-6, ratio, sign)),
    )
    drift = _drift(
        corner,
        seen,
        mate.base_radius,
        direction * distance / own.base_radius,
        ratio,
        sign,
    )
    return abs(mate.base_radius * drift)


def _drift(
    corner: complex,
    seen: complex,
    base_radius: float,
    turn: float,
    ratio: float,
    sign: int,
) -> float:
    """Return by how much the involute through the corner leaves the mate's flank [rad].

    ``seen`` is the corner from the mate's centre before both gears turn.
    """
    turned = seen + corner * (complex(math.cos(turn), math.sin(turn)) - 1.0)
    before = _base_angle(seen, base_radius, sign)
    after = _base_angle(turned, base_radius, sign)
    return (after - before + turn * ratio + math.pi) % (2 * math.pi) - math.pi


def _base_angle(point: complex, base_radius: float, sign: int) -> float:
    """Return where on the base circle the involute through a point begins [rad]."""
    alpha = math.acos(min(1.0, base_radius / abs(point)))
    return math.atan2(point.imag, point.real) + sign * (math.tan(alpha) - alpha)
