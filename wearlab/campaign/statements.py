"""What notes, titles and claims state, held: no number and no direction by itself.

A campaign with ``readings`` is read strictly. In a note every number is read off the
runs, quoted from a source, or one of the file itself; every word of direction names the
claim that it makes. What a claim or a file of points says of a source stands in both
tables of readings, and a wide tolerance has its reason.
"""

import ast
import operator
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from decimal import Decimal
from math import isclose
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from wearlab import units
from wearlab.campaign.claims import (
    PLACEHOLDER,
    ClaimRecord,
    ClaimSpec,
    spelled_note,
)
from wearlab.campaign.inheritance import inherit
from wearlab.campaign.marks import EXPECTED, QUOTATION, WORD
from wearlab.campaign.readings import (
    PrintedNumber,
    normal,
    points_of,
    read_readings,
)

if TYPE_CHECKING:
    from wearlab.campaign import Campaign

WIDE = 0.25
"""Largest tolerance over the value that needs no reason."""
TEXTS = ("title", "reference", "metadata", "figure", "claim", "report", "readings")
"""Keys of a file whose numbers say nothing of a scene."""
REFERENCE = re.compile(
    r"(?:\b(?:Figs?|Eqs?|Tables?|Algorithm|[Cc]onclusions?|ISO|DIN)\b\.?|§)\s*\d+[a-z]?"
    r"(?:(?:,| and| to|-|–)\s*\d*[a-z]?\b)*(?:\s*\(\d+\))?"
    r"|\b[^\W\d]+\d[\w-]*|\b\d[- ]DOF\b"
)
UNIT = r"%|[µu]m|N/[µu]m|N·m|kN|N|rpm|mm|rad|MPa|GPa|Pa·s|1/Pa|m²/N|kHz|Hz|kW"
NUMBER = re.compile(
    r"(?<![\w.^])([-−+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?)(?!\w)"
    rf"(?: (million|thousand)\b)?(?: ?({UNIT})(?![\w/]))?"
)
LIST = re.compile(
    rf"(?:\s*(?:,|and|to|or)\s+[-−+]?\d[\d.e+-]*)*\s*(?:,|and|to|or)\s+"
    rf"[-−+]?\d[\d.e+-]*(?: (million|thousand)\b)?(?: ?({UNIT})(?![\w/]))?"
)
SHORT = re.compile(r"[A-Z]\d\d")
PAPER = "§paper"
OF_PAPER = re.compile(rf"{PAPER}(?:'s)?\b[^.;¤]{{0,24}}?(?:: |\bat )$")
"""What stands before a number that is a paper's: ``L16: 3720 rpm``, ``L16's at``."""
MILLIONS = re.compile(r"_(\d+)_million")
MULTIPLES = {"": 1.0, "thousand": 1e3, "million": 1e6}

Holds = Callable[[float], bool]
RISES = (
    "rise rises rising grow grows growing increase increases widen widens gain gains "
    "growing deeper higher"
).split()
FALLS = (
    "fall falls falling shrink shrinks shrinking decrease decreases narrow narrows "
    "drop drops shallower lower"
).split()
LARGEST = "deepest largest highest heaviest strongest longest steepest".split()
SMALLEST = "shallowest smallest lowest lightest weakest shortest least".split()
RATIOS = {
    "doubles": (1.5, 2.5),
    "halves": (0.4, 0.67),
    "trebles": (2.5, 3.5),
}
LARGEST_OF = re.compile(r"\blargest_at\(|^(?!.*_at\().*(?:\bmax\(|\bmax_|_max\b)")
SMALLEST_OF = re.compile(r"\bsmallest_at\(|^(?!.*_at\().*(?:\bmin\(|\bmin_|_min\b)")
DIRECTION = re.compile(
    rf"\b({'|'.join([*RISES, *FALLS, *LARGEST, *SMALLEST, *RATIOS])})\b", re.IGNORECASE
)
MOTION = re.compile(rf"\b({'|'.join([*RISES, *FALLS, *RATIOS])})\b", re.IGNORECASE)
"""Words of direction that no name of a quantity has: a title may say *largest*."""


class Statement(NamedTuple):
    """A text of a campaign, and where it stands."""

    place: str
    text: str


def problems(campaign: "Campaign", record: ClaimRecord) -> list[str]:
    """Return what a campaign states that nothing holds, a line each.

    Parameters
    ----------
    campaign : without ``readings`` nothing is looked for
    record : what its runs said
    """
    if not campaign.readings:
        return []
    readings, differences = read_readings(*campaign.readings)
    quoted = {(row.source, row.printed) for row in readings}
    file_numbers = _numbers_of_file(campaign)
    measured = {claim.name: claim.measured for claim in record.claims}

    lines = list(differences)
    for claim in campaign.claims:
        lines += _claim_problems(claim, readings)
        lines += _state_problems(claim, file_numbers)
    for note in _notes(campaign):
        lines += _quotation_problems(note, quoted)
        lines += _word_problems(note, campaign.claims, measured)
        lines += _expectation_problems(note, campaign.claims, record.numbers)
        lines += _bare_problems(note, file_numbers, DIRECTION)
    for title in _titles(campaign):
        lines += _bare_problems(title, file_numbers, MOTION)
    for spec in campaign.figures:
        if isinstance(spec.published, Path):
            lines += _point_problems(spec.published, readings)
    return lines


def _notes(campaign: "Campaign") -> Iterator[Statement]:
    """Yield the notes of a campaign's figures."""
    for number, spec in enumerate(campaign.figures, 1):
        if spec.note:
            yield Statement(f"figure {number} ({spec.kind}): note", spec.note)


def _titles(campaign: "Campaign") -> Iterator[Statement]:
    """Yield the titles of a campaign and of its figures."""
    yield Statement("title", campaign.title)
    for number, spec in enumerate(campaign.figures, 1):
        if spec.title:
            yield Statement(f"figure {number} ({spec.kind}): title", spec.title)


def _claim_problems(
    claim: ClaimSpec, readings: Sequence[PrintedNumber]
) -> Iterator[str]:
    """Yield what a claim says of its source that no reading has; a wide tolerance."""
    if claim.printed is not None:
        source = (claim.source or "").split(",")[0]
        printed = normal(str(claim.printed))
        rows = [row for row in readings if row.name == claim.name]
        if (source, printed) not in [(row.source, row.printed) for row in rows]:
            known = " or ".join(repr(row.printed) for row in rows) or "nothing"
            yield (
                f"claim {claim.name}: printed {claim.printed!r}: the readings have "
                f"{known} of that name at {source or 'no source'}"
            )

    if not claim.is_loose(WIDE):
        return
    if claim.loose is None:
        yield (
            f"claim {claim.name}: a tolerance of {claim.tolerance} is over "
            f"{100 * WIDE:.0f} % of {claim.value}: narrow it, or say why in `loose`, "
            f'beginning with "{claim.tolerance}: "'
        )
    elif not claim.loose.startswith(f"{claim.tolerance}: "):
        yield (
            f"claim {claim.name}: `loose` is the reason of another tolerance than "
            f'{claim.tolerance}: begin it with "{claim.tolerance}: "'
        )


def _state_problems(claim: ClaimSpec, file_numbers: "_FileNumbers") -> Iterator[str]:
    """Yield that a claim reads another wear state than its name says."""
    formula = claim.formula.replace(" ", "")
    if "unworn" in claim.name.split("_") and "update=0" not in formula:
        yield f"claim {claim.name}: its formula does not read update=0 (unworn)"

    if (named := MILLIONS.search(claim.name)) is None:
        return
    cycles = 1e6 * float(named[1])
    states = [f"cycle={named[1]}e6"]
    if cycles == max(
        (n for key, n in file_numbers.plain if key == "cycles"), default=0
    ):
        states.append("update=-1")
    if not any(state in formula for state in states):
        yield f"claim {claim.name}: its formula does not read {' or '.join(states)}"


def _quotation_problems(note: Statement, quoted: set[tuple[str, str]]) -> Iterator[str]:
    """Yield the quotations of a note that no reading has."""
    for match in QUOTATION.finditer(note.text):
        if (match[2], normal(match[1])) not in quoted:
            yield (
                f"{note.place}: {match[0]}: {match[2]} does not print that, as the "
                "readings have it"
            )


def _word_problems(
    note: Statement, claims: Sequence[ClaimSpec], measured: Mapping[str, float | None]
) -> Iterator[str]:
    """Yield the words of direction of a note that the runs do not bear out."""
    formulas = {claim.name: claim.formula for claim in claims}
    for match in WORD.finditer(note.text):
        word = match[1].lower()
        if (subject := EXTREMES.get(word)) is not None:
            formula = formulas.get(match[2], match[2])
            if subject.search(formula) is None:
                yield f"{note.place}: {match[0]}: {formula} is not the {word}"
            is_place = match[2] in formulas and "_at(" in formula
            if is_place and not re.search(rf"\{{{match[2]}\b", note.text):
                yield (
                    f"{note.place}: {match[0]}: the note does not say where: write "
                    f"{{{match[2]}:.0f = number}}"
                )
            continue

        holds = DIRECTIONS.get(word)
        if holds is None:
            valid = ", ".join([*DIRECTIONS, *EXTREMES])
            yield f"{note.place}: {match[0]}: no word of direction; there are {valid}"
            continue
        try:
            value = _value(ast.parse(match[2].strip(), mode="eval").body, measured)
        except (SyntaxError, ValueError, ZeroDivisionError) as error:
            yield f"{note.place}: {match[0]}: {error}; write claims, + - * /"
            continue
        if not holds(value):
            yield f"{note.place}: {match[0]}: it is {value:.4g}"


def _value(node: ast.AST, measured: Mapping[str, float | None]) -> float:
    """Return what a formula of claims gives with their measured values.

    Raises
    ------
    ValueError : it has something else, or a claim was not measured
    """
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.Name(id=name):
            value = measured.get(name)
            if value is None:
                raise ValueError(f"no claim {name!r} was measured")
            return value
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_value(operand, measured)
        case ast.BinOp(left=left, op=sign, right=right) if type(sign) in OPERATORS:
            return OPERATORS[type(sign)](
                _value(left, measured), _value(right, measured)
            )
    raise ValueError("no formula of claims")


OPERATORS: dict[type, Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}


def _between(low: float, high: float) -> Holds:
    """Return whether a ratio lies between two bounds, as a function of it."""
    return lambda ratio: low < ratio < high


DIRECTIONS: dict[str, Holds] = {
    **dict.fromkeys(RISES, lambda change: change > 0.0),
    **dict.fromkeys(FALLS, lambda change: change < 0.0),
    **{word: _between(low, high) for word, (low, high) in RATIOS.items()},
}
EXTREMES = dict.fromkeys(LARGEST, LARGEST_OF) | dict.fromkeys(SMALLEST, SMALLEST_OF)


def _expectation_problems(
    note: Statement, claims: Sequence[ClaimSpec], numbers: Mapping[str, str]
) -> Iterator[str]:
    """Yield the numbers of a note that are not those the runs give."""
    text = WORD.sub("", QUOTATION.sub("", note.text))
    for match in PLACEHOLDER.finditer(text):
        spelled = spelled_note(match[0], claims)
        measured = numbers.get(spelled)
        expected = EXPECTED.search(match[0])
        if measured is None:
            continue  # told as not measured
        if expected is None:
            yield (
                f"{note.place}: {match[0]}: no number is expected: write "
                f"{match[0][:-1]} = {measured}}}"
            )
        elif not _same(expected[1], measured):
            yield f"{note.place}: {match[0]}: the runs give {measured}"


def _same(expected: str, measured: str) -> bool:
    """Whether two numbers are alike; of two digits and more but for the last."""
    wanted = Decimal(expected)
    try:
        difference = abs(Decimal(measured) - wanted)
    except ArithmeticError:
        return False
    last_digit = Decimal(1).scaleb(int(wanted.as_tuple().exponent))
    return not difference or (
        abs(wanted) >= 10 * last_digit and difference <= last_digit
    )


def _bare_problems(
    statement: Statement, file_numbers: "_FileNumbers", words: re.Pattern[str]
) -> Iterator[str]:
    """Yield numbers and words of direction of a text that nothing holds."""
    text = statement.text
    for marked in (QUOTATION, WORD, PLACEHOLDER):
        text = marked.sub("¤", text)
    text = REFERENCE.sub(
        lambda match: PAPER if SHORT.fullmatch(match[0]) else "¤", text
    )

    for match in words.finditer(text):
        yield (
            f"{statement.place}: {match[0]!r} is a claim by itself: write "
            f"{{{match[0]}|formula of claims}}, or quote it: {{'…' paper place}}"
        )
    for match in NUMBER.finditer(text):
        is_of_paper = OF_PAPER.search(text[: match.start()])
        if is_of_paper or not file_numbers.has(match, text[match.end() :]):
            yield (
                f"{statement.place}: {match[0]!r} is no number of this file: write "
                f"{{formula:format unit = number}}, or quote it: "
                f"{{'{match[0]}' paper place}}"
            )


class _FileNumbers(NamedTuple):
    """Numbers that a campaign's file says of its scenes.

    Parameters
    ----------
    quantities : number and unit
    plain : without unit, each with the last word of its key
    """

    quantities: frozenset[tuple[float, str]]
    plain: frozenset[tuple[str, float]]

    def has(self, match: re.Match[str], following: str) -> bool:
        """Whether a number of a text is one of the file's."""
        number = float(match[1].replace("−", "-"))
        if (
            match.string[match.start() - 1 : match.start()] == "/"
            or following[:1] == "/"
        ):
            return ("teeth", number) in self.plain  # a pair of gears by their teeth
        multiple = match[2]
        unit = match[3]
        if unit is None and (rest := LIST.match(following)):
            multiple = multiple or rest[1]
            unit = rest[2]
        number *= MULTIPLES[multiple or ""]

        if unit:
            written = unit.replace("µ", "u").replace("·", "*").replace("²", "^2")
            return any(
                units.comparable(file_unit, written)
                and isclose(units.convert(value, file_unit, written), number)
                for value, file_unit in self.quantities
            )
        word = re.match(r"\s*([a-z]+)", following)
        return any(
            isclose(value, number)
            and (multiple or number % 1.0 or (word is not None and word[1] == key))
            for key, value in self.plain
        )


def _numbers_of_file(campaign: "Campaign") -> _FileNumbers:
    """Return the numbers that a campaign's file says of its scenes."""
    quantities: set[tuple[float, str]] = set()
    plain: set[tuple[str, float]] = set()

    def note_down(value: Any, key: str) -> None:
        match value:
            case dict():
                for inner_key, inner in value.items():
                    note_down(inner, inner_key)
            case list():
                for inner in value:
                    note_down(inner, key)
            case str() if units.is_quantity(value):
                number, unit = units.split(value)
                quantities.add((float(number), unit))
            case int() | float() if not isinstance(value, bool):
                plain.add((re.split(r"[._]", key)[-1], float(value)))

    if campaign.path is not None:
        table = inherit(campaign.path.resolve()).table
        for key, value in table.items():
            if key not in TEXTS:
                note_down(value, key)
    for axis in campaign.axes:
        for value in axis.values:
            if units.is_number(value) and axis.units:
                quantities.add((float(value), axis.units))
            else:
                note_down(value, axis.name)
    return _FileNumbers(frozenset(quantities), frozenset(plain))


def _point_problems(path: Path, readings: Sequence[PrintedNumber]) -> Iterator[str]:
    """Yield the points of a file that no reading has, and the readings without one."""
    rows = {
        (row.at, row.printed) for row in readings if row.name == path.stem and row.at
    }
    points = set(points_of(path))
    for at, printed in sorted(points - rows):
        yield f"{path.name}: {printed} at {at}: no reading of that name has this point"
    for at, printed in sorted(rows - points):
        yield f"{path.name}: {printed} at {at}, as the readings have it, is no point"
