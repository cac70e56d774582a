"""Values of attributes in known units, under every name that REXS gave them."""

from typing import Any, NamedTuple

from wearlab import units
from wearlab.rexs.document import Component, RexsError
from wearlab.rexs.xml_file import THOUSANDS

UNITS: dict[str, dict[str, str]] = {
    "mm": {
        **{unit: unit for unit in ("mm", "m", "cm", "um", "inch")},
        **dict.fromkeys(("mum", "µm", "μm", "micron", "micrometer"), "um"),
        **dict.fromkeys(("millimeter", "millimetre"), "mm"),
        "in": "inch",
    },
    "deg": {
        "rad": "rad",
        "mrad": "mrad",
        **dict.fromkeys(("deg", "°", "degree"), "deg"),
    },
    "rpm": {
        **dict.fromkeys(
            ("1/min", "rpm", "min^-1", "min-1", "min^(-1)", "U/min"), "rpm"
        ),
        **dict.fromkeys(("rev/min", "r/min", "1/Min"), "rpm"),
        "1/s": "turn/s",
        "rad/s": "rad/s",
    },
    "N*m": {"N*m": "N*m", **{unit: unit for unit in ("Nm", "kNm", "Nmm", "MNm")}},
    "W": {"Nm/s": "W", **{unit: unit for unit in ("W", "kW", "MW")}},
    "GPa": {
        **dict.fromkeys(("N/mm^2", "N/mm2", "MPa"), "MPa"),
        **dict.fromkeys(("GPa", "kN/mm^2"), "GPa"),
        **dict.fromkeys(("Pa", "N/m^2"), "Pa"),
    },
    "kg/m^3": {
        **dict.fromkeys(("kg/dm^3", "g/cm^3", "kg/l"), "g/cm^3"),
        "kg/m^3": "kg/m^3",
    },
    "mm^2/s": {
        **dict.fromkeys(("mm^2/s", "mm2/s", "cSt"), "mm^2/s"),
        "m^2/s": "m^2/s",
    },
    "degC": {
        **dict.fromkeys(("C", "°C", "degC"), "degC"),
        **dict.fromkeys(("F", "°F"), "degF"),
        "K": "K",
    },
    "h": {"h": "h", "s": "s", "min": "min", "d": "day"},
    "HV": dict.fromkeys(("HV", "HV1", "HV5", "HV10", "HV30"), "HV"),
    "1": {"1": "1", "%": "%", "percent": "%"},
}
"""Wanted unit → units that writers use, without blanks, and what wearlab calls them."""
PREFIXED = ("N*m", "W")
"""Wanted units whose prefixes differ by large and small letters alone."""
USUAL = {"GPa": "N/mm^2", "kg/m^3": "kg/dm^3"}
"""The format's own unit, where it is not the wanted one."""
LARGEST_NUMBER = 1e300
"""Beyond it a number is nonsense, and a whole one would be no float."""
LARGEST_SIZE = 1e6
"""Of lengths [mm], and of numbers of teeth."""
NO_UNIT = ("", "none", "-")
"""What stands where a writer has no unit: then the format's own unit is meant."""

LEFT_OUT = str.maketrans({letter: None for letter in "*·.[]"})
RAISED = str.maketrans({"²": "^2", "³": "^3"})

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
    RexsError : a unit that is not known, or what is no number

    Examples
    --------
    >>> from wearlab.rexs.document import Attribute
    >>> gear = Component("15", "cylindrical_gear", "", {"d": Attribute(50.0, "mum")})
    >>> number(gear, "d", "mm")
    Read(value=0.05, source='component 15, d')
    """
    value, stated_unit, name = _raw(component, attribute)
    if component is None:
        return None
    source = place_of(component, name)
    if isinstance(value, str) and THOUSANDS.fullmatch(value):
        raise RexsError(
            f"{source}: {value!r} is {value.replace(',', '.')} or "
            f"{value.replace(',', '')}: write it with a decimal point"
        )
    is_wrong = isinstance(value, str | bool) or (
        units.is_number(value) and abs(value) >= LARGEST_NUMBER
    )
    if is_wrong:
        raise RexsError(
            f"{source}: {str(value)[:40]!r} is no number: mend it in the file, or "
            "delete the attribute"
        )
    if not _is_number(value):
        return None

    known = _known(stated_unit, unit, source)
    converted = value if known == unit else units.convert(value, known, unit)
    return Read(units.rounded(converted), source)


def size(component: Component | None, attribute: str, unit: str = "1") -> Read | None:
    """Return an attribute without its sign, which rings have in some files.

    It is None where it is absent, nought, or larger than anything made.

    Parameters
    ----------
    component : whose it is, None without
    attribute : its id, in any version
    unit : unit of the value that is returned, a key of `UNITS`

    Raises
    ------
    RexsError : a unit that is not known
    """
    read = number(component, attribute, unit)
    if read is None or not 1.0 / LARGEST_SIZE < abs(read.value) < LARGEST_SIZE:
        return None
    return read._replace(value=abs(read.value))


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

    unit = _known(stated_unit, "mm", place_of(component, name))
    return [units.convert(part, unit, "mm") for part in value]


def _raw(component: Component | None, attribute: str) -> tuple[Any, str, str]:
    """Return value, unit and name of an attribute under the first name that has one."""
    for name in names_of(attribute):
        found = component.attributes.get(name) if component is not None else None
        if found is not None and found.value is not None:
            return found.value, found.unit, name
    return None, "", attribute


def _is_number(value: Any) -> bool:
    """Tell whether a value is a finite number, not a truth value."""
    return units.is_number(value) and abs(value) < LARGEST_NUMBER


def _known(stated: str, wanted: str, source: str) -> str:
    """Return what wearlab calls a stated unit, the format's own where there is none."""
    compact = "".join(stated.split()).translate(LEFT_OUT).translate(RAISED)
    known = UNITS[wanted]
    if compact in NO_UNIT:
        return known.get(USUAL.get(wanted, wanted), wanted)
    if compact.isupper() and compact not in known and wanted not in PREFIXED:
        shouted = [unit for unit in known if unit.upper() == compact]
        compact = shouted[0] if len(shouted) == 1 else compact
    if compact not in known:
        raise RexsError(
            f"{source}: the unit {stated!r} is not one of {', '.join(known)}: correct "
            "it in the file"
        )
    return known[compact]
