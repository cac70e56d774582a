"""The grammar of conditions: a recursive descent over their words.

Nothing is ever evaluated as code.

::

    condition  = conjunction { "or" conjunction }
    conjunction= negation { "and" negation }
    negation   = "not" negation | "(" condition ")" | comparison
    comparison = operand [ sign operand [ sign operand ] | ["not"] "in" list
               | ["not"] "between" operand "and" operand | ["not"] "contains" text
               | "is" ["not"] "missing" ]
    operand    = name | formula | "first_cycle" "(" comparison ")" | number [unit]
               | text | date | "true" | "false"

A formula is a function of a variable, or a variable at places, as
`wearlab.query.formula` has it: ``min(iso_pitting_safety)``,
``iso_pitting_safety[flank='pinion']``. A bare name of a result with several values
means any of them.
"""

import math
import re
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple

from wearlab import units
from wearlab.query.evaluate import (
    BoundCondition,
    FirstCycle,
    Holds,
    Literal,
    joined,
    meets,
    missing,
    negated,
    one_value_meets,
)
from wearlab.query.keys import FUNCTIONS, PLAIN, Key, QueryError, Vocabulary, listed

LONGEST = 4000
KEYWORDS = (
    "and",
    "or",
    "not",
    "in",
    "between",
    "is",
    "missing",
    "contains",
    "true",
    "false",
)
DATE = (
    r"\d{4}-\d{2}-\d{2}(?:T\d{2}(?::\d{2}(?::\d{2}(?:\.\d+)?)?)?)?"
    r"(?:Z|[+-]\d{2}:\d{2})?(?![\w.])"
)
NO_WORD = rf"(?!(?i:{'|'.join(KEYWORDS)})\b)"
FACTOR = (
    rf"{NO_WORD}[A-Za-zµμ°%]+(?:\s*(?:\^|\*\*)\s*[+-]?\d+|[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+|[+-]?\d+)?"
)
JOINT = r"(?:\s*[*/·⋅]\s*|\s+)"
GROUP = rf"(?:{FACTOR}|\({FACTOR}(?:{JOINT}{FACTOR})*\))"
TOKEN = re.compile(
    rf"(?P<space>\s+)|(?P<text>'(?:[^']|'')*'|\"(?:[^\"]|\"\")*\")|(?P<date>{DATE})"
    r"|(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
    rf"(?:(?P<over>\s*1\s*/)?\s*(?P<unit>{GROUP}(?:{JOINT}{GROUP})*))?"
    r"|(?P<name>[^\W\d]\w*(?:[.-]\w+)*)|(?P<sign><=|>=|==|!=|<>|[<>=≤≥≠()\[\],])"
)
SIGNS = {"==": "=", "<>": "!=", "≤": "<=", "≥": ">=", "≠": "!="}


class Token(NamedTuple):
    """One word of a condition.

    Parameters
    ----------
    kind : name | keyword | number | text | date | sign | end
    text : as it counts: keywords in lower case, texts without quotes
    at : where it stands
    unit : of a number, "" when it has none
    """

    kind: str
    text: str
    at: int
    unit: str = ""


def tokens(text: str) -> list[Token]:
    """Return the words of a condition, an end after the last.

    Parameters
    ----------
    text : the condition

    Raises
    ------
    QueryError : a character belongs nowhere, or the text is longer than `LONGEST`
    """
    if len(text) > LONGEST:
        raise QueryError(
            f"{len(text)} characters, more than {LONGEST}", text[:40] + "…", 0
        )
    words: list[Token] = []
    at = 0
    while match := TOKEN.match(text, at):
        part = match[0]
        kind = "number" if match["number"] else str(match.lastgroup)
        if kind == "name" and part.lower() in KEYWORDS:
            kind = "keyword"
            part = part.lower()
        elif kind == "text":
            part = part[1:-1].replace(2 * part[0], part[0])
        elif kind == "number":
            part = match["number"]
        if kind != "space":
            unit = f"{'1/' if match['over'] else ''}{match['unit'] or ''}"
            words.append(
                Token(kind, SIGNS.get(part, part) if kind == "sign" else part, at, unit)
            )
        at = match.end()
    if at < len(text):
        alien = f"{text[at]!r} belongs nowhere here; texts stand in quotes"
        open_text = f"the text that begins with {text[at]} does not end"
        raise QueryError(open_text if text[at] in "'\"" else alien, text, at)
    return [*words, Token("end", "", len(text))]


DEEPEST = 40
COMPARISONS = ("<", "<=", ">", ">=", "=", "!=")
MIRRORED = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "=": "=", "!=": "!="}
PLAIN_COLUMN = re.compile(r"\s*(?:first_cycle\s*\(|[^\W\d]\w*(?:[.-]\w+)*\s*$)")
"""A name, or the begin of ``first_cycle(…)``; any other column is a formula."""
LARGEST = re.compile(r"\s*max\(\s*\w+\s*\)\s*")
OTHER_UNIT = re.compile(r"_at\s*\(|[*/]")
"""What of a formula may have another unit than the variable in it."""
THEN = "'and', 'or' or the end"


def read_condition(text: str, vocabulary: Vocabulary) -> BoundCondition:
    """Return a condition with keys for names and SI values for quantities.

    Parameters
    ----------
    text : the condition
    vocabulary : what may be asked for

    Raises
    ------
    QueryError : it cannot be read, a name is unknown, or a value does not fit
    """
    reader = _Grammar(text, vocabulary)
    answer = reader.condition(0)
    reader.expect(THEN, "end")
    return BoundCondition(tuple(reader.keys), answer, frozenset(reader.whole))


def read_column(text: str, vocabulary: Vocabulary) -> Key | FirstCycle:
    """Return the key, or the ``first_cycle(…)`` of a key, that a column shows.

    The key of a formula where it is one; of a name with values along a profile, say,
    that of the largest of these.

    Parameters
    ----------
    text : of the column
    vocabulary : what may be asked for
    """
    is_formula = not PLAIN_COLUMN.match(text)
    if vocabulary.reads_formulas and is_formula:
        return formula_key(text, 0, text, vocabulary)
    reader = _Grammar(text, vocabulary)
    operand = reader.operand()
    reader.expect(THEN, "end")
    if isinstance(operand, Literal):
        raise QueryError("a column is a name, or first_cycle(…)", text, operand.at)
    column = reader.bound(operand)
    if vocabulary.reads_formulas and isinstance(column, Key) and not column.is_kept:
        return formula_key(f"max({column.name})", 0, text, vocabulary)
    return column


def formula_key(formula: str, at: int, text: str, vocabulary: Vocabulary) -> Key:
    """Return the key of a formula of stored variables.

    ``max(name)`` is what the catalogue keeps of a result with several values.

    Parameters
    ----------
    formula : of the grammar of `wearlab.query.formula`
    at : where it stands in the text
    text : the condition or the column
    vocabulary : what may be asked for

    Raises
    ------
    QueryError : it cannot be read, or names what is no variable of numbers
    """
    # NumPy, which conditions do without, takes a moment to load
    from wearlab.query.formula import parse_formula, spelled_out

    if not vocabulary.reads_formulas:
        raise QueryError("a formula is asked of stored runs alone", text, at)
    try:
        parsed = parse_formula(formula)
    except QueryError as error:
        raise QueryError(error.reason, text, at + error.position) from None
    named = {}
    for name, place in parsed.names:
        key = vocabulary.find(name, min(at + place, len(text)), text)
        if key.is_path or key.kind != "number":
            raise QueryError(f"{name!r} is no variable of numbers", text, at + place)
        named[name] = key
    if not named:
        raise QueryError("a formula names a variable", text, at)
    first, *further = named.values()
    if LARGEST.fullmatch(formula) and first.is_kept:
        return first._replace(any_value=False)

    has_unit_of_first = not further and not OTHER_UNIT.search(formula)
    meanings = {name: key.name for name, key in named.items() if name != key.name}
    key = Key(
        formula.strip(),
        unit=first.unit if has_unit_of_first else "",
        display_unit=first.display_unit if has_unit_of_first else "",
        formula=parse_formula(spelled_out(formula, meanings)),
    )
    vocabulary.formulas[key.name] = key
    return key


class _Grammar:
    """Walks over the words of a condition.

    Names become keys, values those of their units.
    """

    def __init__(self, text: str, vocabulary: Vocabulary) -> None:
        self.text = text
        self.vocabulary = vocabulary
        self.words = tokens(text)
        self.place = 0
        self.keys: dict[Key, None] = {}
        self.whole: set[str] = set()

    @property
    def word(self) -> Token:
        return self.words[self.place]

    def take(self, kind: str, *texts: str) -> Token | None:
        """Step over the next word when it is one of these."""
        word = self.word
        if word.kind != kind or (texts and word.text not in texts):
            return None
        self.place += 1
        return word

    def fail(self, expected: str) -> QueryError:
        word = f"not {self.word.text!r}" if self.word.kind != "end" else "but it ends"
        return QueryError(f"expected {expected}, {word}", self.text, self.word.at)

    def expect(self, expected: str, kind: str, *texts: str) -> Token:
        """Step over the next word, which has to be one of these."""
        if (word := self.take(kind, *texts)) is None:
            raise self.fail(expected)
        return word

    def condition(self, depth: int) -> Holds:
        return self._joined(
            "or", lambda: self._joined("and", lambda: self.negation(depth))
        )

    def _joined(self, word: str, part: Callable[[], Holds]) -> Holds:
        parts = [part()]
        while self.take("keyword", word):
            parts.append(part())
        return parts[0] if len(parts) == 1 else partial(joined, parts, word == "or")

    def negation(self, depth: int) -> Holds:
        if depth > DEEPEST:
            raise QueryError(f"nested deeper than {DEEPEST}", self.text, self.word.at)
        if self.take("keyword", "not"):
            return partial(negated, self.negation(depth + 1))
        if self.take("sign", "("):
            inner = self.condition(depth + 1)
            self.expect("')'", "sign", ")")
            return inner
        return self.comparison()

    def comparison(self) -> Holds:
        left = self.operand()
        if sign := self.take("sign", *COMPARISONS):
            middle = self.operand()
            first = self._compared(sign.text, left, middle)
            second_sign = self.take("sign", *COMPARISONS)
            if second_sign is None:
                return first
            # 100 N*m < torque < 200 N*m
            second = self._compared(second_sign.text, middle, self.operand())
            return self._both(middle, first, second)
        opposite = bool(self.take("keyword", "not"))
        worded = self._worded(left, opposite)
        return partial(negated, worded) if opposite else worded

    def _worded(self, left: Any, opposite: bool) -> Holds:
        if self.take("keyword", "in"):
            items = self._list()
            return partial(
                joined, [self._compared("=", left, item) for item in items], True
            )
        if self.take("keyword", "between"):
            low = self.operand()
            self.expect("'and' of between", "keyword", "and")
            above = self._compared(">=", left, low)
            below = self._compared("<=", left, self.operand())
            return self._both(left, above, below)
        if self.take("keyword", "contains"):
            return self._compared("contains", left, self.operand())
        if not opposite and self.take("keyword", "is"):
            is_negated = bool(self.take("keyword", "not"))
            self.expect("'missing'", "keyword", "missing")
            absent = partial(missing, self.bound(left))
            return partial(negated, absent) if is_negated else absent
        is_bare = self.word.kind == "end" or self.word.text in (")", "and", "or")
        if is_bare and not opposite and isinstance(left, Token):  # a switch by itself
            return self._compared("=", left, Literal(True, left.at))
        raise self.fail(
            "a comparison (<, <=, >, >=, =, !=, in, between, contains, is missing)"
        )

    def _both(self, middle: Any, first: Holds, second: Holds) -> Holds:
        """Return two comparisons of one operand, that a single value has to meet."""
        key = None if isinstance(middle, Literal) else self.bound(middle)
        if isinstance(key, Key) and key.any_value:
            self.whole.add(key.name)
            return partial(one_value_meets, key, (first, second))
        return partial(joined, (first, second), False)

    def _compared(self, sign: str, left: Any, right: Any) -> Holds:
        return partial(meets, *self._sides(sign, left, right))

    def _sides(self, sign: str, left: Any, right: Any) -> tuple[str, Any, Any]:
        """Return sign and both sides of a comparison, the literal on the right."""
        if (
            isinstance(left, Literal)
            and not isinstance(right, Literal)
            and sign in MIRRORED
        ):
            sign, left, right = MIRRORED[sign], right, left
        bound = self.bound(left)
        key = Key("cycle") if isinstance(bound, FirstCycle) else bound
        if sign == "contains" and key.kind == "number":
            raise QueryError(
                f"{key.name!r} is a number and contains no text", self.text, left.at
            )
        limit = self.value(right, key)
        if sign in ("=", "!="):
            sides = (one for one in (key, limit) if isinstance(one, Key))
            self.whole.update(one.name for one in sides if one.any_value)
        return sign, bound, limit

    def _list(self) -> list[Any]:
        closing = (
            "]" if self.expect("a list in [ ]", "sign", "[", "(").text == "[" else ")"
        )
        items = [self.operand()]
        while self.take("sign", ","):
            items.append(self.operand())
        self.expect(f"',' or {closing!r}", "sign", closing)
        return items

    def operand(self) -> Any:
        """Return a literal, a ``first_cycle(…)``, or the word of a name."""
        word = self.word
        if self.take("name"):
            if word.text == "first_cycle" and self.take("sign", "("):
                return self._first_cycle(word)
            is_call = word.text in FUNCTIONS and self.word.text == "("
            if self.vocabulary.reads_formulas and (is_call or self.word.text == "["):
                return self._formula(word)
            return word
        if self.take("number"):
            return Literal(float(word.text), word.at, word.unit)
        if self.take("text") or self.take("date"):
            return Literal(word.text, word.at, is_date=word.kind == "date")
        if self.take("keyword", "true", "false"):
            return Literal(word.text == "true", word.at)
        raise self.fail("a name or a value")

    def _formula(self, word: Token) -> Token:
        """Return a formula from its first word to the bracket that closes it."""
        depth = 0
        while True:
            sign = self.word
            if sign.kind == "end":
                raise self.fail("the bracket that closes the formula")
            self.place += 1
            if sign.kind == "sign" and sign.text in "([":
                depth += 1
            elif sign.kind == "sign" and sign.text in ")]":
                depth -= 1
            if depth == 0 and self.word.text != "[":
                text = self.text[word.at : sign.at + 1]
                return Token("formula", text, word.at)

    def _first_cycle(self, word: Token) -> FirstCycle:
        keys = dict(self.keys)  # of comparisons outside
        left = self.operand()
        sign = self.take("sign", "<", "<=", ">", ">=")
        sides = None if sign is None else self._sides(sign.text, left, self.operand())
        if sides is None or self.word.text in COMPARISONS:
            raise QueryError(
                "first_cycle(…) holds one comparison with < or >", self.text, word.at
            )
        self.expect("')'", "sign", ")")
        beyond, key, limit = sides
        if not isinstance(key, Key) or not isinstance(limit, Literal):
            raise QueryError(
                "first_cycle(…) compares a name with a value", self.text, word.at
            )
        if not key.history:
            names = sorted(
                key.name for key in self.vocabulary.keys.values() if key.history
            )
            remedy = f"there are {listed(names, 'and')}" if names else "no run has any"
            raise QueryError(
                f"{key.name!r} is not kept along a life; {remedy}", self.text, word.at
            )
        key = key._replace(any_value=False)
        operand = FirstCycle(beyond, key, float(limit.value), word.at)
        self.keys = keys | dict.fromkeys(operand.keys)
        return operand

    def bound(self, operand: Any) -> Any:
        """Return the key that a name means, or a ``first_cycle(…)`` as it is."""
        if isinstance(operand, Literal):
            raise QueryError(
                "nothing is asked: one side must be a name", self.text, operand.at
            )
        if isinstance(operand, FirstCycle):
            return operand
        if operand.kind == "formula":
            key = formula_key(operand.text, operand.at, self.text, self.vocabulary)
        else:
            key = self.vocabulary.find(operand.text, operand.at, self.text)
        self.keys[key] = None
        return key

    def value(self, operand: Any, key: Key) -> Any:
        """Return what a key is compared with.

        That is a literal in its unit, or another key of the same unit.
        """
        if isinstance(operand, Token) and key.kind != "number":
            return Literal(operand.text, operand.at)  # a word without quotes
        if not isinstance(operand, Literal):
            bound_operand = self.bound(operand)
            if (
                isinstance(bound_operand, Key)
                and bound_operand.kind == key.kind
                and _same(bound_operand.unit, key.unit)
            ):
                return bound_operand
            raise QueryError(
                f"{key.name!r} and this have different units", self.text, operand.at
            )
        if isinstance(operand.value, str):
            if key.kind == "number":
                example = f", such as {_example(key)}" if key.unit not in PLAIN else ""
                raise QueryError(
                    f"{key.name!r} is a number{example}", self.text, operand.at
                )
            return operand
        if key.kind != "number":
            raise QueryError(
                f"{key.name!r} is a text: write the value in quotes",
                self.text,
                operand.at,
            )
        return (
            operand
            if isinstance(operand.value, bool)
            else operand._replace(value=self._number(operand, key))
        )

    def _number(self, literal: Literal, key: Key) -> float:
        number = float(literal.value)
        if not literal.unit and key.unit not in PLAIN and number != 0.0:
            raise QueryError(
                f"{key.name!r} needs a unit, such as {_example(key)}",
                self.text,
                literal.at,
            )
        if not literal.unit or (
            literal.unit in ("cycle", "cycles") and key.unit in PLAIN
        ):
            return number
        if key.name.endswith("module") and literal.unit in units.PER_INCH and number:
            return units.INCH / number
        try:
            if key.quantity:
                return units.quantity(f"{number!r} {literal.unit}", key.quantity)
            return float(units.convert(number, literal.unit, key.unit or "1"))
        except units.UnitError as error:
            raise QueryError(str(error), self.text, literal.at) from None


def _same(unit: str, other_unit: str) -> bool:
    if unit == other_unit or {unit, other_unit} <= set(PLAIN):
        return True
    with suppress(units.UnitError):
        return math.isclose(float(units.convert(1.0, unit, other_unit)), 1.0)
    return False


def _example(key: Key) -> str:
    return (
        f"'{units.KINDS[key.quantity].example}'"
        if key.quantity
        else f"'1 {key.display_unit or key.unit}'"
    )
