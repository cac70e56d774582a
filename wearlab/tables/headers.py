"""Headers of columns: names, units, and usual names of quantities."""

import re
from functools import cache

from wearlab.units import KINDS, comparable, of_speed

BRACKETS = " []()"
UNIT_IN_HEADER = re.compile(
    r"\s*(.+?)\s*(?:\[([^\]]*)\]|\(([^)]*)\)|/\s*(\S+)|\s+in\s+(\S+))\s*"
)
UNITS_BY_NAME = re.compile(r"(.+)_(mm|um|µm|nm|m|deg|rad|inch|mg|g|kg|h|Nm|kNm|rpm)")
SHORT_UNITS = frozenset("m g h s N W K % °".split())
_USUAL_NAMES = """
    diameter: diameter, durchmesser, dia, d, dy, d_y, ø, measuring diameter
    roll_angle: roll_angle, roll angle, wälzwinkel, waelzwinkel, xi, ξ
    roll_length: roll_length, length of roll, roll length, wälzlänge, wälzweg, ly
    path_position: path_position, path position
    face_position: face_position, face position, lead position, flankenlinie
    depth: depth, wear depth, wear, verschleiß, verschleisstiefe, verschleißtiefe
    deviation: deviation, abweichung, profile deviation, profilabweichung, f, fa
    torque: torque, drehmoment, moment, input torque
    speed: speed, drehzahl, rotational speed, input speed
    share: share, time, time share, duration, hours, zeit, zeitanteil, dauer, stunden
    cycle: cycle, cycles, revolutions, umdrehungen
    cycles: cycles, cycle, load cycles, revolutions, umdrehungen, lastspiele
    hours: hours, operating hours, running hours, h, betriebsstunden, stunden
    date: date, day, datum, tag
    worn_mass: worn_mass, worn mass, mass loss, loss, masseverlust, verlust
"""
NAMES = {
    quantity.strip(): tuple(name.strip() for name in names.split(","))
    for quantity, names in (
        line.split(":") for line in _USUAL_NAMES.strip().splitlines()
    )
}
"""Quantity → what its column may be called, the most certain name first."""


def name_and_unit(header: str) -> tuple[str, str]:
    """Return name and unit of a header: ``Diameter [mm]``, ``d / mm``, ``depth_um``.

    >>> name_and_unit("Diameter [mm]"), name_and_unit("depth_um"), name_and_unit("note")
    (('Diameter', 'mm'), ('depth', 'um'), ('note', ''))
    """
    plain = header.strip().strip('"')
    bracketed = UNIT_IN_HEADER.fullmatch(plain)
    if bracketed:
        unit = next((text for text in bracketed.groups()[1:] if text is not None), "")
        if is_unit(unit):
            return bracketed[1].strip(), unit.strip()
    tail = UNITS_BY_NAME.fullmatch(plain)
    return (tail[1], tail[2]) if tail else (plain, "")


def is_bare_unit(text: str) -> bool:
    """Say whether a cell under a header is its unit.

    One letter may also be a name, such as d.
    """
    plain = text.strip(BRACKETS)
    return (len(plain) > 1 or plain in SHORT_UNITS) and is_unit(plain)


@cache
def is_unit(text: str) -> bool:
    """Say whether a text is a unit that something in a scene has."""
    plain = text.strip(BRACKETS)
    if of_speed(plain) == "rpm":
        return True
    units = ("1", *(kind.unit for kind in KINDS.values()))
    return bool(plain) and any(comparable(plain, unit) for unit in units)
