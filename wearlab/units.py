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
    """A text is no quantity of a kind; the message says what would be one."""


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
    Measure("velocity", "m/s", "2 m/s", ("m/s", "mm/s", "km/h"), 1e-12, 1e5),
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
    Measure("volume", "m^3", "60 l", ("l", "m^3", "dm^3"), 1e-6, 1e3),
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
    Measure("temperature difference", "K", "20 K", ("K",), 1e-6, 2e3),
    Measure("thermal expansion", "1/K", "1.2e-4 1/K", ("1/K",), 1e-8, 1e-2),
    Measure("area", "m^2", "0.01 m^2", ("m^2", "cm^2", "dm^2", "mm^2"), 1e-6, 1e4),
    Measure("thermal insulance", "K*m^2/W", "0.06 K*m^2/W", ("K*m^2/W",), 1e-6, 1e3),
)
KINDS = {measure.name: measure for measure in MEASURES}

COMMA = re.compile(r"\s*[+-]?\d*,(\d+)(?![\d,.])")
NUMBER = re.compile(
    r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?![\d.])\s*(.*?)\s*", re.DOTALL
)
OF_TWO_MEANINGS = {"grad": "'deg' or 'gon'"}
"""Units that some languages write for another: a German degree is ``Grad``."""
TOKEN = re.compile(
    r"""
    \s*(?:
        ([A-Za-z_µμ°%]+)                     # name of a unit
        \s*(?:
            (?:\^|\*\*)\s*\(?([+-]?\d+)\)?   # its exponent behind ^ or **
            |([+-]?\d+)                      # its exponent attached
        )?
        |(1)(?=\s*/)                        # the 1 of 1/s
        |([*/·⋅()])                         # a sign
    )
    """,
    re.VERBOSE,
)
RAISED = re.compile("[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+")
SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
ALIASES = {
    **{"Nm": "(N*m)", "kNm": "(kN*m)", "MNm": "(MN*m)", "Nmm": "(N*mm)"},
    **{"rev": "turn", "r": "turn", "°": "degree", "°C": "degC", "%": "percent"},
    "mil": "thou",
}
INCH = 25.4e-3
"""[m]"""
PER_INCH = frozenset(("1/in", "1/inch", "in^-1", "in-1", "DP"))
"""Units of a diametral pitch, which is no length."""
DIGITS = 12
"""In which numbers are told apart: a scene keeps no more of them, and a condition asks
for no more."""
PER_MINUTE = frozenset(("1/min", "min-1", "min^-1", "U/min", "Upm", "r/min", "rev/min"))
HARDNESS = re.compile(
    r"(HRC|HV|HBW|HB)(?:\s?[\d./]+)?"
)  # HV 10 and HBW 2.5/187.5 tell the load
SHORT = 12  # characters of a factor below which it is exact in decimals
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
    measure = KINDS[kind]
    number, unit = split(text, measure)
    if kind == "length" and unit in PER_INCH:
        raise UnitError(
            f"{text!r} is a diametral pitch: write diametral_pitch = {number} instead "
            "of module"
        )
    try:
        if kind == "hardness" and (scale := HARDNESS.fullmatch(unit)):
            return pressure_of(float(number), scale[1])
        value = _to_si(number, unit, measure)
    except (UnitError, HardnessError) as error:
        raise UnitError(f"{text!r}: {error}") from None

    if value != 0.0 and not measure.low <= abs(value) <= measure.high:
        raise UnitError(
            f"{text!r} is {value:.3g} {measure.unit}, outside the plausible range of "
            f"{measure.article} "
            f"({measure.low:g} to {measure.high:g} {measure.unit}); is the unit right?"
        )
    return value


def shown_unit(text: str) -> str:
    """Return a unit, or a text with units in it, as people read it.

    >>> shown_unit("25 um at 134 N*m")
    '25 µm at 134 N·m'
    """
    return MICROMETRE.sub("µm", text).replace("*", "·")


def split(text: object, measure: Measure | None = None) -> tuple[str, str]:
    """Return the number and the unit of a written quantity, both as texts.

    Parameters
    ----------
    text : such as ``"1100 rpm"``
    measure : the kind that the message of an error gives an example of

    Raises
    ------
    UnitError
        When ``text`` is no string of a finite number and a unit.
    """
    example = "a number with its unit"
    if measure is not None:
        example = f"{measure.article} with its unit, such as {measure.example!r}"
    if not isinstance(text, str):
        fault = "has no unit" if is_number(text) else "is no quantity"
        raise UnitError(f"{text!r} {fault}: write {example}")

    if comma := COMMA.match(text):
        remedy = f"the decimal sign is a point, write {text.replace(',', '.')!r}"
        if len(comma[1]) == THOUSANDS:
            remedy += f", or {text.replace(',', '')!r} for thousands"
        raise UnitError(f"{text!r} has a comma: {remedy}")

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
    """Return whether a value is a number; true and false are none.

    Parameters
    ----------
    value : of any type
    """
    return isinstance(value, Real) and not isinstance(value, bool)


def is_quantity(value: object) -> bool:
    """Return whether a value looks like a number with its unit.

    Parameters
    ----------
    value : of any type
    """
    match = NUMBER.fullmatch(value) if isinstance(value, str) else None
    return match is not None and bool(match[2])


def convert(value: Value, from_unit: str, to_unit: str) -> Value:
    """Return a value or an array in another unit of its dimension, angles included.

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
    converted: Any = value
    if scale > 1.0:
        converted = converted * scale
    elif scale < 1.0:  # a division by a whole number rounds once
        converted = converted / _between(to_unit, from_unit)[0]
    return converted + offset if offset else converted


def comparable(unit: str, reference: str) -> bool:
    """Return whether values in one unit can be converted to another.

    Per minute means revolutions of a speed.

    Parameters
    ----------
    unit : unit of the values
    reference : unit to convert to
    """
    source = of_speed(unit) if reference == "rad/s" else unit
    with suppress(UnitError):
        convert(1.0, source, reference)
        return True
    return False


def of_speed(unit: str) -> str:
    """Return a unit of a speed; per minute means revolutions per minute.

    >>> of_speed("U/min"), of_speed("min⁻¹"), of_speed("deg/s")
    ('rpm', 'rpm', 'deg/s')

    Parameters
    ----------
    unit : as somebody wrote it
    """
    compact = re.sub(r"\s|\*\*", "", _plain(unit))
    return "rpm" if compact in PER_MINUTE else unit


def _to_si(number: str, unit: str, measure: Measure) -> float:
    """Return a number with a unit in the SI unit of its kind."""
    if measure.name == "speed":
        unit = of_speed(unit)
    try:
        scale, offset = _between(unit, measure.unit)
    except UnitError as error:
        raise UnitError(f"{error}; {_advice(unit, measure)}") from None
    if measure.name == "torque" and _is_energy(unit):
        raise UnitError(f"{unit!r} is a unit of energy; {_advice(unit, measure)}")

    if offset and measure.name == "temperature difference":
        raise UnitError(f"{unit!r} counts from a zero; {_advice(unit, measure)}")
    if offset:
        return float(number) * scale + offset
    factor = repr(scale)
    if len(factor) < SHORT:  # a short decimal factor: one rounding instead of two
        return float(Decimal(number) * Decimal(factor))
    return float(number) * scale


def _is_energy(unit: str) -> bool:
    """Return whether a unit with the dimension of a torque is one of energy."""
    return unit not in USUAL and bool(ENERGIES.search(str(_unit(unit))))


def _advice(unit: str, measure: Measure) -> str:
    """Return the end of a message: the nearest unit, and what is expected."""
    names = re.findall(r"[^\W\d_]+", unit.lower())
    is_ambiguous = any(name in OF_TWO_MEANINGS for name in names)
    near = () if is_ambiguous else get_close_matches(unit, measure.units, 1, 0.5)
    question = f"did you mean {near[0]!r}? " if near else ""
    return (
        f"{question}expected {measure.article} such as {measure.example!r} (kept in "
        f"{measure.unit})"
    )


@cache
def _between(from_unit: str, to_unit: str) -> tuple[float, float]:
    """Return factor and offset from one unit to another."""
    if from_unit in USUAL and to_unit in USUAL:
        from_factor, from_root = USUAL[from_unit]
        to_factor, to_root = USUAL[to_unit]
        if from_root == to_root:
            return _decimal(from_factor / to_factor), 0.0

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
        from_factor, from_root = registry.get_root_units(source)
        to_factor, to_root = registry.get_root_units(target)
    except ArithmeticError as error:
        raise UnitError(f"{from_unit!r} is beyond all numbers") from error
    if from_root == to_root:
        return _decimal(float(from_factor) / float(to_factor)), 0.0

    if from_root in (to_root / registry.radian, to_root * registry.radian):
        is_frequency = from_root * registry.second == registry.dimensionless
        reason = "one counts angle, the other not"
        if is_frequency:
            reason = "it says neither radians nor revolutions"
        raise UnitError(f"{unlike}: {reason}")
    raise UnitError(unlike)


def _decimal(scale: float) -> float:
    """Return a factor without its round-off where it is a short decimal number."""
    short = float(f"{scale:.10g}")
    return short if abs(short - scale) <= 4 * math.ulp(scale) else scale


@cache
def _registry() -> Any:
    """Return pint's units."""
    import pint

    return pint.UnitRegistry()


@cache
def _unit(text: str) -> Any:
    """Return pint's unit of a text that holds nothing but names of units and signs."""
    try:
        return _registry().Unit(_expression(text))
    except UnitError:
        raise
    except Exception:  # pint raises errors of many kinds, tokenizer's included
        raise UnitError(f"{text!r} is not a known unit") from None


def _plain(text: str) -> str:
    """Return a unit with plain exponents: "m^2" for "m²"."""
    return RAISED.sub(lambda power: "^" + power[0].translate(SUPERSCRIPTS), text)


def _expression(text: str) -> str:
    """Return a unit as an expression with every product written out."""
    plain = _plain(text).strip()
    if plain in ("", "1"):
        return "dimensionless"
    tokens = [*TOKEN.finditer(plain)]
    if "".join(token[0] for token in tokens) != plain:
        raise UnitError(f"{text!r} is not a known unit")

    expression = ""
    for token in tokens:
        name, power, attached_power, unity, sign = token.groups()
        if name and name.lower() in OF_TWO_MEANINGS:
            raise UnitError(
                f"{name!r} is {OF_TWO_MEANINGS[name.lower()]}: write one of these"
            )
        factor = ALIASES.get(name, name) if name else unity
        exponent = power or attached_power

        starts_factor = factor or sign == "("
        if expression and expression[-1] not in "*/(" and starts_factor:
            expression += "*"
        if exponent:
            expression += f"{factor}**{exponent}"
        else:
            expression += factor or sign.replace("·", "*").replace("⋅", "*")
    return expression
