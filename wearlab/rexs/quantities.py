"""Values of attributes in known units, under every name that REXS gave them."""

import math
from typing import Any, NamedTuple

from wearlab.rexs.document import Component, RexsError

Scale = tuple[float, float]
"""(factor, offset): value in the wanted unit = factor · (value + offset)."""

UNITS: dict[str, dict[str, Scale]] = {
    "mm": {
        "mm": (1.0, 0.0),
        "m": (1e3, 0.0),
        "cm": (10.0, 0.0),
        "mum": (1e-3, 0.0),
        "um": (1e-3, 0.0),
        "µm": (1e-3, 0.0),
        "μm": (1e-3, 0.0),
        "in": (25.4, 0.0),
        "inch": (25.4, 0.0),
    },
    "deg": {
        "deg": (1.0, 0.0),
        "°": (1.0, 0.0),
        "degree": (1.0, 0.0),
        "rad": (180.0 / math.pi, 0.0),
        "mrad": (0.18 / math.pi, 0.0),
    },
    "rpm": {
        "1/min": (1.0, 0.0),
        "rpm": (1.0, 0.0),
        "min^-1": (1.0, 0.0),
        "min-1": (1.0, 0.0),
        "U/min": (1.0, 0.0),
        "1/s": (60.0, 0.0),
        "rad/s": (30.0 / math.pi, 0.0),
    },
    "N*m": {
        "N*m": (1.0, 0.0),
        "Nm": (1.0, 0.0),
        "kNm": (1e3, 0.0),
        "Nmm": (1e-3, 0.0),
        "MNm": (1e6, 0.0),
    },
    "W": {"W": (1.0, 0.0), "kW": (1e3, 0.0), "MW": (1e6, 0.0), "Nm/s": (1.0, 0.0)},
    "GPa": {
        "N/mm^2": (1e-3, 0.0),
        "N/mm2": (1e-3, 0.0),
        "MPa": (1e-3, 0.0),
        "GPa": (1.0, 0.0),
        "kN/mm^2": (1.0, 0.0),
        "Pa": (1e-9, 0.0),
        "N/m^2": (1e-9, 0.0),
    },
    "kg/m^3": {
        "kg/dm^3": (1e3, 0.0),
        "kg/m^3": (1.0, 0.0),
        "g/cm^3": (1e3, 0.0),
        "kg/l": (1e3, 0.0),
    },
    "mm^2/s": {
        "mm^2/s": (1.0, 0.0),
        "cSt": (1.0, 0.0),
        "m^2/s": (1e6, 0.0),
        "mm2/s": (1.0, 0.0),
    },
    "degC": {
        "C": (1.0, 0.0),
        "°C": (1.0, 0.0),
        "degC": (1.0, 0.0),
        "K": (1.0, -273.15),
        "F": (5.0 / 9.0, -32.0),
        "°F": (5.0 / 9.0, -32.0),
    },
    "h": {
        "h": (1.0, 0.0),
        "s": (1.0 / 3600.0, 0.0),
        "min": (1.0 / 60.0, 0.0),
        "d": (24.0, 0.0),
    },
    "%": {"%": (1.0, 0.0)},
    "HV": {"HV": (1.0, 0.0)},
    "1": {"1": (1.0, 0.0), "%": (0.01, 0.0)},
}
"""Wanted unit → units that writers use, without blanks, and how each converts."""
USUAL = {"GPa": "N/mm^2", "kg/m^3": "kg/dm^3"}
"""The format's own unit, where it is not the wanted one."""
NO_UNIT = ("", "none", "-", "[]")
"""What stands where a writer has no unit: then the format's own unit is meant."""

RENAMED = (
    ("tip_corner_radius_factor_reference_profile", "tip_radius_factor"),
    ("tip_corner_radius_reference_profile", "tip_radius"),
    (
        "arithmetic_mean_roughness_flank_iso_4287_1997",
        "arithmetic_average_roughness_flank",
    ),
    ("active_tip_diameter", "usable_addendum_circle_diameter"),
    ("active_root_diameter", "usable_root_circle_diameter"),
    ("operating_time_fraction", "load_duration_fraction"),
    ("operating_time", "load_duration"),
)
"""Attributes that have had two names; files mix versions, so both are always read."""
TYPES = {
    "flank_geometry": "cylindrical_gear_flank",
    "stage_gear_data": "cylindrical_stage_gear_data",
}
"""Types of components that version 1.3 renamed: old → new."""


class Read(NamedTuple):
    """A value that was read, and where it stood.

    Parameters
    ----------
    value : in the unit that was asked for
    source : such as ``component 15, normal_module``
    """

    value: float
    source: str


def place_of(component: Component, attribute: str) -> str:
    """Return where an attribute stands, in words.

    Parameters
    ----------
    component : whose it is
    attribute : its id
    """
    return f"component {component.id}, {attribute}"


def names_of(attribute: str) -> tuple[str, ...]:
    """Return every name that an attribute has had, the one that was asked for first.

    Parameters
    ----------
    attribute : one of its names
    """
    for names in RENAMED:
        if attribute in names:
            others = tuple(name for name in names if name != attribute)
            return (attribute, *others)
    return (attribute,)


def text(component: Component | None, attribute: str) -> str | None:
    """Return an attribute that is a text, None where it is absent or something else.

    Parameters
    ----------
    component : whose it is, None without
    attribute : its id, in any version
    """
    value = _raw(component, attribute)[0]
    return value if isinstance(value, str) else None


def truth(component: Component | None, attribute: str) -> bool | None:
    """Return an attribute that is true or false, None where it is absent.

    An array, one value for each gear shift, gives its first value.

    Parameters
    ----------
    component : whose it is, None without
    attribute : its id, in any version
    """
    value = _raw(component, attribute)[0]
    if isinstance(value, list) and value:
        value = value[0]
    return value if isinstance(value, bool) else None


def number(component: Component | None, attribute: str, unit: str = "1") -> Read | None:
    """Return an attribute that is a finite number, None where it is absent.

    Parameters
    ----------
    component : whose it is, None without
    attribute : its id, in any version
    unit : unit of the value that is returned, a key of `UNITS`

    Raises
    ------
    RexsError : a unit that is not known

    Examples
    --------
    >>> from wearlab.rexs.document import Attribute
    >>> gear = Component("15", "cylindrical_gear", "", {"d": Attribute(50.0, "mum")})
    >>> number(gear, "d", "mm")
    Read(value=0.05, source='component 15, d')
    """
    value, stated_unit, name = _raw(component, attribute)
    if component is None or not _is_number(value):
        return None

    source = place_of(component, name)
    factor, offset = _scale(stated_unit, unit, source)
    converted = factor * (value + offset)
    rounded = float(f"{converted:.12g}")
    return Read(rounded, source)


def position(component: Component | None, attribute: str) -> list[float] | None:
    """Return a vector of three lengths [mm], None where it is absent.

    Parameters
    ----------
    component : whose it is, None without
    attribute : its id, in any version
    """
    value, stated_unit, name = _raw(component, attribute)
    if component is None or not isinstance(value, list) or len(value) != 3:
        return None
    if not all(_is_number(part) for part in value):
        return None

    factor, _ = _scale(stated_unit, "mm", place_of(component, name))
    return [factor * part for part in value]


def _raw(component: Component | None, attribute: str) -> tuple[Any, str, str]:
    """Return value, unit and name of an attribute under the first name that has one."""
    for name in names_of(attribute):
        found = component.attributes.get(name) if component is not None else None
        if found is not None and found.value is not None:
            return found.value, found.unit, name
    return None, "", attribute


def _is_number(value: Any) -> bool:
    """Tell whether a value is a finite number, not a truth value."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and math.isfinite(value)


def _scale(stated: str, wanted: str, source: str) -> Scale:
    """Return how a stated unit converts to the wanted one."""
    compact = "".join(stated.split()).replace("*", "").replace("·", "")
    if compact in NO_UNIT:
        return UNITS[wanted][USUAL.get(wanted, wanted)]

    known = UNITS[wanted]
    if compact not in known:
        raise RexsError(
            f"{source}: the unit {stated!r} is not one of {', '.join(known)}: correct "
            "it in the file"
        )
    return known[compact]
