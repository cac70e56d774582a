"""``"134 N*m"`` to SI and back, through pint, with its traps closed.

A quantity with a dimension is a string with its unit; what it may be is told by its
*kind* ("torque", "speed", ...): a dimension, an SI unit and a plausible range. Angles
count as a dimension here, so that ``25 Hz`` is no speed and ``N*m`` no torsional
stiffness; ``1/min`` means revolutions where a speed is meant. pint is imported when the
first unit is read.
"""

import math
import re
import tomllib
from contextlib import suppress
from decimal import Decimal
from difflib import get_close_matches
from functools import cache
from numbers import Real
from pathlib import Path
from typing import Any, NamedTuple, TypeGuard, TypeVar

from wearlab.materials.grades import SCALES, HardnessError, pressure_of

_ROOTS = tomllib.loads((Path(__file__).parent / "units.toml").read_text("utf-8"))
USUAL = {
    name: (float(factor), root)
    for root, units in _ROOTS.items()
    for name, factor in units.items()
}
"""What pint says of usual units, so that it need not be imported: factor, and the root
unit it goes with."""


Value = TypeVar("Value")
MICROMETRE = re.compile(r"\bum\b")
MINUTE, HOUR = 60.0, 3600.0  # s


class UnitError(ValueError):
    """A text is not a quantity of the wanted kind; the message says what would be."""


class Measure(NamedTuple):
    """A kind of quantity.

    Parameters
    ----------
    name : what messages call it
    unit : SI unit of the stored number
    example : how one is written
    units : usual units, the choices offered when a unit is misspelt
    low, high : plausible range of the magnitude in SI; zero is always plausible
    """

    name: str
    unit: str
    example: str
    units: tuple[str, ...]
    low: float
    high: float

    @property
    def article(self) -> str:
        """The name with its article."""
        return f"{'an' if self.name[0] in 'aeiou' else 'a'} {self.name}"


MEASURES = (
    Measure("length", "m", "20 mm", ("mm", "m", "um", "cm", "inch"), 1e-6, 1e2),
    Measure("depth", "m", "0.3 um", ("um", "mm", "nm", "m"), 1e-13, 1e-2),
    Measure("angle", "rad", "20 deg", ("deg", "rad", "mrad", "arcmin"), 1e-12, 1e3),
    Measure(
        "speed",
        "rad/s",
        "1100 rpm",
        ("rpm", "rad/s", "rev/min", "1/min", "deg/s"),
        1e-6,
        1e5,
    ),
    Measure("frequency", "Hz", "25 Hz", ("Hz", "kHz"), 1e-6, 1e7),
    Measure(
        "torque", "N*m", "340 N*m", ("N*m", "kN*m", "N*mm", "Nm", "kNm"), 1e-9, 1e9
    ),
    Measure("power", "W", "1 kW", ("kW", "W", "MW", "N*m/s"), 1e-9, 1e12),
    Measure("force", "N", "100 N", ("N", "kN", "MN"), 1e-9, 1e9),
    Measure("mass", "kg", "2.8 kg", ("kg", "g", "t"), 1e-9, 1e7),
    Measure(
        "inertia", "kg*m^2", "7300 kg*mm^2", ("kg*m^2", "kg*mm^2", "g*mm^2"), 1e-15, 1e9
    ),
    Measure(
        "stiffness",
        "N/m",
        "1150 N/um",
        ("N/m", "N/um", "N/mm", "kN/mm", "MN/m"),
        1e1,
        1e15,
    ),
    Measure(
        "torsional stiffness",
        "N*m/rad",
        "1e6 N*m/rad",
        ("N*m/rad", "kN*m/rad", "N*m/deg"),
        1e-6,
        1e14,
    ),
    Measure(
        "damping", "N*s/m", "1000 N*s/m", ("N*s/m", "N*s/mm", "kN*s/m"), 1e-6, 1e10
    ),
    Measure(
        "torsional damping",
        "N*m*s/rad",
        "2 N*m*s/rad",
        ("N*m*s/rad", "N*mm*s/rad"),
        1e-12,
        1e9,
    ),
    Measure("loss per speed", "s/m", "0.3 s/m", ("s/m",), 1e-6, 1e6),
    Measure("pressure", "Pa", "206 GPa", ("GPa", "MPa", "Pa", "N/mm^2"), 1e3, 1e13),
    Measure("density", "kg/m^3", "7830 kg/m^3", ("kg/m^3", "g/cm^3"), 1e0, 1e5),
    Measure("viscosity", "Pa*s", "0.012 Pa*s", ("Pa*s", "mPa*s", "cP"), 1e-5, 1e3),
    Measure(
        "pressure-viscosity coefficient",
        "1/Pa",
        "1.6e-8 1/Pa",
        ("1/Pa", "1/GPa", "mm^2/N"),
        1e-10,
        1e-6,
    ),
    Measure(
        "wear coefficient",
        "m^2/N",
        "9.65e-19 m^2/N",
        ("m^2/N", "mm^3/Nm", "mm^2/N", "1/Pa"),
        1e-24,
        1e-8,
    ),
    Measure(
        "kinematic viscosity",
        "m^2/s",
        "220 mm^2/s",
        ("mm^2/s", "cSt", "m^2/s"),
        1e-7,
        1e-1,
    ),
    Measure("hardness", "Pa", "60 HRC", (*SCALES, "GPa", "MPa"), 1e6, 3e10),
    Measure("time", "s", "10 h", ("s", "min", "h"), 1e-12, 1e12),
    Measure("temperature", "K", "60 degC", ("degC", "K"), 1e2, 2e3),
)
KINDS = {measure.name: measure for measure in MEASURES}

COMMA = re.compile(r"\s*[+-]?\d*,(\d+)(?![\d,.])")
NUMBER = re.compile(
    r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?![\d.])\s*(.*?)\s*", re.DOTALL
)
TOKEN = re.compile(
    r"\s*(?:([A-Za-z_µμ°%]+)\s*(?:(?:\^|\*\*)\s*\(?([+-]?\d+)\)?|([+-]?\d+))?|(1)(?=\s*/)|([*/·⋅()]))"
)
SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
ALIASES = {
    **{"Nm": "(N*m)", "kNm": "(kN*m)", "MNm": "(MN*m)", "Nmm": "(N*mm)"},
    **{"rev": "turn", "r": "turn", "°": "degree", "°C": "degC", "%": "percent"},
}
DIGITS = 12
"""In which numbers are told apart: a scene keeps no more of them, and a condition asks
for no more."""
PER_MINUTE = frozenset(("1/min", "min-1", "min^-1", "U/min", "Upm", "r/min", "rev/min"))
HARDNESS = re.compile(
    r"(HRC|HV|HBW|HB)(?:\s?[\d./]+)?"
)  # HV 10 and HBW 2.5/187.5 tell the load
THOUSANDS = 3  # digits behind a comma that may part thousands
ENERGIES = re.compile(r"joule|watt|calorie|volt|thermal_unit|erg")


def quantity(text: object, kind: str) -> float:
    """Return a written quantity in the SI unit of its kind.

    Parameters
    ----------
    text : a number and its unit, such as ``"1100 rpm"``
    kind : a key of `KINDS`

    Returns
    -------
    The value [SI].

    Raises
    ------
    UnitError
        When there is no unit, a unit of something else, no finite number, or an
        implausible magnitude.
    """
    wanted = KINDS[kind]
    number, unit = split(text, wanted)
    try:
        if kind == "hardness" and (scale := HARDNESS.fullmatch(unit)):
            return pressure_of(float(number), scale[1])
        value = _to_si(number, unit, wanted)
    except (UnitError, HardnessError) as error:
        raise UnitError(f"{text!r}: {error}") from None
    if value != 0.0 and not wanted.low <= abs(value) <= wanted.high:
        raise UnitError(
            f"{text!r} is {value:.3g} {wanted.unit}, outside the plausible range of "
            f"{wanted.article} "
            f"({wanted.low:g} to {wanted.high:g} {wanted.unit}); is the unit right?"
        )
    return value


def shown_unit(text: str) -> str:
    """Return a unit, or a text with units in it, as people read it.

    >>> shown_unit("25 um at 134 N*m")
    '25 µm at 134 N·m'
    """
    return MICROMETRE.sub("µm", text).replace("*", "·")


def split(text: object, wanted: Measure | None = None) -> tuple[str, str]:
    """Return the number and the unit of a written quantity, both as texts.

    Raises
    ------
    UnitError
        When ``text`` is no string of a finite number and a unit.
    """
    named = (
        f"{wanted.article} with its unit, such as {wanted.example!r}" if wanted else ""
    )
    example = named or "a number with its unit"
    if not isinstance(text, str):
        raise UnitError(
            f"{text!r} {'has no unit' if is_number(text) else 'is no quantity'}: "
            f"write {example}"
        )
    if comma := COMMA.match(text):
        thousands = (
            f", or {text.replace(',', '')!r} for thousands"
            if len(comma[1]) == THOUSANDS
            else ""
        )
        point = f"the decimal sign is a point, write {text.replace(',', '.')!r}"
        raise UnitError(f"{text!r} has a comma: {point}{thousands}")
    if (match := NUMBER.fullmatch(text)) is None:
        raise UnitError(f"{text!r}: write {example}")
    if not math.isfinite(float(match[1])):
        raise UnitError(f"{text!r} is not finite: write {example}")
    if not match[2]:
        raise UnitError(f"{text!r} has no unit: write {example}")
    return match[1], match[2]


def rounded(value: float) -> float:
    """Return a number to the digits in which numbers are told apart."""
    return float(f"{value:.{DIGITS}g}")


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a number; true and false are none."""
    return isinstance(value, Real) and not isinstance(value, bool)


def is_quantity(value: object) -> bool:
    """Return whether a value looks like a number with its unit."""
    return (
        isinstance(value, str)
        and (match := NUMBER.fullmatch(value)) is not None
        and bool(match[2])
    )


def convert(value: Value, from_unit: str, to_unit: str) -> Value:
    """Return a value or an array in another unit of the same dimension, angles included.

    Parameters
    ----------
    value : number or array, in ``from_unit``
    from_unit, to_unit : units as campaign files or datasets (``"rad s-1"``) write them

    Raises
    ------
    UnitError
        When a unit is unknown or their dimensions differ.
    """
    scale, offset = _between(from_unit, to_unit)
    changed: Any = value
    if scale != 1.0:
        changed = (
            changed * scale
            if scale >= 1.0
            else changed / _between(to_unit, from_unit)[0]
        )
    return changed + offset if offset else changed


def comparable(unit: str, other: str) -> bool:
    """Return whether values in one unit can be told in another.

    Per minute means revolutions of a speed.
    """
    with suppress(UnitError):
        convert(1.0, of_speed(unit) if other == "rad/s" else unit, other)
        return True
    return False


def of_speed(unit: str) -> str:
    """Return a unit where a speed is meant: per minute means revolutions.

    >>> of_speed("U/min"), of_speed("min⁻¹"), of_speed("deg/s")
    ('rpm', 'rpm', 'deg/s')
    """
    return "rpm" if re.sub(r"\s|\*\*", "", _plain(unit)) in PER_MINUTE else unit


def _to_si(number: str, unit: str, wanted: Measure) -> float:
    if wanted.name == "speed":
        unit = of_speed(unit)
    try:
        scale, offset = _between(unit, wanted.unit)
    except UnitError as error:
        raise UnitError(f"{error}; {_advice(unit, wanted)}") from None
    if (
        wanted.name == "torque"
        and unit not in USUAL
        and ENERGIES.search(str(_unit(unit)))
    ):
        raise UnitError(f"{unit!r} is a unit of energy; {_advice(unit, wanted)}")
    if offset:
        return float(number) * scale + offset
    exact = repr(scale)  # a decimal factor: one rounding instead of two
    return (
        float(Decimal(number) * Decimal(exact))
        if len(exact) < 12
        else float(number) * scale
    )


def _advice(unit: str, wanted: Measure) -> str:
    near = get_close_matches(unit, wanted.units, 1, 0.5)
    meant = f"did you mean {near[0]!r}? " if near else ""
    return (
        f"{meant}expected {wanted.article} such as {wanted.example!r} (kept in "
        f"{wanted.unit})"
    )


@cache
def _between(from_unit: str, to_unit: str) -> tuple[float, float]:
    """Return factor and offset from one unit to another."""
    if (
        from_unit in USUAL
        and to_unit in USUAL
        and USUAL[from_unit][1] == USUAL[to_unit][1]
    ):
        return _decimal(USUAL[from_unit][0] / USUAL[to_unit][0]), 0.0
    registry = _registry()
    source = _unit(from_unit)
    target = _unit(to_unit)
    unlike = f"{from_unit!r} is not a unit like {to_unit!r}"
    if "degree_C" in f"{source}{target}" or "degree_F" in f"{source}{target}":
        try:
            at_zero = float(registry.Quantity(0.0, source).to(target).magnitude)
            at_one = float(registry.Quantity(1.0, source).to(target).magnitude)
        except Exception as error:
            raise UnitError(unlike) from error
        return _decimal(at_one - at_zero), at_zero
    try:
        (up, base) = registry.get_root_units(source)
        (down, other) = registry.get_root_units(target)
    except ArithmeticError as error:
        raise UnitError(f"{from_unit!r} is beyond all numbers") from error
    if base == other:
        return _decimal(float(up) / float(down)), 0.0
    if base in (other / registry.radian, other * registry.radian):
        frequency = base * registry.second == registry.dimensionless
        words = (
            "it says neither radians nor revolutions"
            if frequency
            else "one counts angle, the other not"
        )
        raise UnitError(f"{unlike}: {words}")
    raise UnitError(unlike)


def _decimal(scale: float) -> float:
    """Return the short decimal number that a factor is up to round-off, else the factor."""
    short = float(f"{scale:.10g}")
    return short if abs(short - scale) <= 4 * math.ulp(scale) else scale


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


@cache
def _unit(text: str) -> Any:
    """Return pint's unit for a text, after reading it by a grammar that has no room for numbers or prose."""
    try:
        return _registry().Unit(_expression(text))
    except UnitError:
        raise
    except Exception:  # pint raises errors of many kinds, tokenizer's included
        raise UnitError(f"{text!r} is not a known unit") from None


def _plain(text: str) -> str:
    return re.sub(
        r"[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+", lambda power: "^" + power[0].translate(SUPERSCRIPTS), text
    )


def _expression(text: str) -> str:
    """Return a unit as an expression with every product written out."""
    plain = _plain(text).strip()
    written = ""
    if plain in ("", "1"):
        return "dimensionless"
    tokens = [*TOKEN.finditer(plain)]
    if "".join(token[0] for token in tokens) != plain:
        raise UnitError(f"{text!r} is not a known unit")
    for name, power, attached, unity, sign in (token.groups() for token in tokens):
        factor = ALIASES.get(name, name) if name else unity
        exponent = power or attached
        if written and written[-1] not in "*/(" and (factor or sign == "("):
            written += "*"
        written += (
            f"{factor}**{exponent}"
            if exponent
            else factor or sign.replace("·", "*").replace("⋅", "*")
        )
    return written
