"""Words and units of figures: labels of wear states and sweeps, labels of axes."""

import math
import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.units import convert

SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
LATEX = {
    "µ": r"$\mu$",
    "λ": r"$\lambda$",
    "η": r"$\eta$",
    "ε": r"$\varepsilon$",
    "°": r"$^\circ$",
}
LATEX |= {
    "±": r"$\pm$",
    "×": r"$\times$",
    "≤": r"$\le$",
    "→": r"$\to$",
    "·": r"$\cdot$",
    "−": "$-$",
}
LATEX |= {
    "…": r"\ldots{}",
    "–": "--",
    "₀": "$_0$",
    "₁": "$_1$",
    "\N{NO-BREAK SPACE}": "~",
}
COUNTS = {3: "thousands", 6: "millions", 9: "billions"}


class Label(NamedTuple):
    """A place along a dimension: its value orders, its text is read."""

    value: float | str
    text: str


def cycles(count: float) -> Label:
    """Return the label of a wear state, such as ``20 million cycles``."""
    rounded = float(f"{count:.4g}")
    for size, word in ((1e9, " billion"), (1e6, " million")):
        if rounded >= size:
            return Label(rounded, f"{rounded / size:.4g}{word} cycles")
    return Label(
        rounded, f"{rounded:,.0f} cycles" if rounded >= 100 else f"{rounded:g} cycles"
    )


def place(name: str, value: object, units: str | None) -> Label:
    """Return the label of a place along a sweep axis or a dimension of the run."""
    if isinstance(value, str):
        return Label(value, value)
    number = float(value)  # type: ignore[arg-type]
    if units and units != "1":
        return Label(number, f"{number:g}{joined(units)}")
    return Label(number, f"{name.replace('_', ' ')} {number:g}")


def within(text: str) -> str:
    """Return words as within a sentence: an abbreviation keeps its capitals."""
    return text if text[:2].isupper() else text[:1].lower() + text[1:]


def ordinal(number: int) -> str:
    """Return 1st, 2nd, 3rd, 4th ..."""
    return {1: "1st", 2: "2nd", 3: "3rd"}.get(number, f"{number}th")


def joined(units: str) -> str:
    """Return a unit as it follows a number: no space before the sign of degrees."""
    pretty = typeset(units)
    return pretty if pretty == "°" else f" {pretty}"


def typeset(units: str) -> str:
    """Return a unit as a paper prints it: µm, N·m, m²/N; nothing for plain numbers."""
    if units in ("", "1"):
        return ""
    text = units.strip()
    if not any(sign in text for sign in "*/^%"):
        text = _as_fraction(text)
    text = re.sub(
        r"(?:\*\*|\^)(-?\d+)", lambda power: power[1].translate(SUPERSCRIPTS), text
    )
    text = re.sub(r"\bu(?=[a-zA-Z])", "µ", text)
    text = re.sub(r"\b(?:deg|degree)\b", "°", text)
    return text.replace("degC", "°C").replace("*", "·")


def _as_fraction(text: str) -> str:
    """Return ``m2 N-1`` as ``m^2/N``."""
    over: list[str] = []
    under: list[str] = []
    for part in text.split():
        unit = re.fullmatch(r"([A-Za-zµ%]+)(-?\d+)?", part)
        if unit is None:
            return text
        power = int(unit[2] or 1)
        (over if power > 0 else under).append(
            unit[1] + (f"^{abs(power)}" if abs(power) != 1 else "")
        )
    return "*".join(over or ["1"]) + "".join(f"/{part}" for part in under)


def converted(values: Array, units: str, target: str) -> Array:
    """Return values in display units."""
    if units == target or not target:
        return np.asarray(values, float)
    return np.asarray(convert(np.asarray(values, float), units or "1", target), float)


def power_of_ten(arrays: Iterable[Array], units: str) -> int:
    """Return the power of ten to take out of an axis.

    Of counts from 10⁴ on, of other values far from 1.

    Parameters
    ----------
    arrays : values on the axis
    units : of the values
    """
    finite = [np.abs(values[np.isfinite(values)]) for values in arrays]
    largest = max(
        (float(np.max(values, initial=0.0)) for values in finite), default=0.0
    )
    if largest == 0.0:
        return 0
    exponent = math.floor(math.log10(largest) + 1e-9)
    if typeset(units) == "" and exponent >= 4:
        return min(9, exponent // 3 * 3)
    return exponent if exponent < -2 else (exponent // 3 * 3 if exponent >= 6 else 0)


def axis_label(label: str, units: str, power: int) -> str:
    """Return an axis label: label, then power of ten and unit in brackets."""
    pretty = typeset(units)
    ten = f"$10^{{{power}}}$" if power else ""
    inside = (
        COUNTS[power] if not pretty and power in COUNTS else f"{ten} {pretty}".strip()
    )
    start = label[:1].upper() + label[1:] if label[:1].isascii() else label
    unbroken = inside.replace(" ", "\N{NO-BREAK SPACE}")
    return f"{start} ({unbroken})" if inside else start


def first_of(names: Sequence[str], count: int, between: str = ", ") -> str:
    """Return names in one line: of many the first, and how many more there are.

    >>> first_of(["a", "b", "c"], 2)
    'a, b and 1 more'
    """
    return between.join(names[:count]) + (
        f" and {len(names) - count} more" if len(names) > count else ""
    )


def scaled(values: Sequence[Array], words: str, units: str) -> tuple[list[Array], str]:
    """Return values over the power of ten of their axis label, and that label."""
    power = power_of_ten(values, units)
    return [array / 10.0**power for array in values], axis_label(words, units, power)


def latex(text: str) -> str:
    r"""Return a text as LaTeX reads it: signs escaped, powers as mathematics.

    What stands in $ as it is.

    Examples
    --------
    >>> print(latex("5 % of 20 µm at 10⁻³ m²/N"))
    5 \% of 20 $\mu$m at 10$^{-3}$ m$^{2}$/N
    """
    parts = text.split("$")
    if len(parts) % 2 == 0:  # a lone sign of the currency
        parts = [text.replace("$", r"\$")]
    return "$".join(
        part if number % 2 else _latex(part) for number, part in enumerate(parts)
    )


def _latex(text: str) -> str:
    text = re.sub(r"([%&#_{}])", r"\\\1", text)
    normal = {above: plain for plain, above in SUPERSCRIPTS.items()}
    text = re.sub(
        "[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+", lambda power: f"$^{{{power[0].translate(normal)}}}$", text
    )
    return "".join(LATEX.get(sign, sign) for sign in text)
