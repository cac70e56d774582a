"""The grammar of conditions: a recursive descent over their words; nothing is ever evaluated as code.

::

    condition  = conjunction { "or" conjunction }
    conjunction= negation { "and" negation }
    negation   = "not" negation | "(" condition ")" | comparison
    comparison = operand [ sign operand [ sign operand ] | ["not"] "in" list
               | ["not"] "between" operand "and" operand | ["not"] "contains" text | "is" ["not"] "missing" ]
    operand    = name | "first_cycle" "(" comparison ")" | number [unit] | text | date | "true" | "false"
"""

import re
from dataclasses import dataclass
from typing import Any, NamedTuple


class QueryError(ValueError):
    """A condition cannot be read or does not fit what is known; the message points at the place.

    Parameters
    ----------
    reason : one sentence with a remedy
    text : the condition
    position : where in it, from 0
    """

    def __init__(self, reason: str, text: str, position: int) -> None:
        self.reason, self.text, self.position = reason, text, position
        super().__init__(f"{reason}\n  {text}\n  {' ' * position}^")

    def __reduce__(self) -> tuple[type["QueryError"], tuple[str, str, int]]:
        return type(self), (self.reason, self.text, self.position)


LONGEST = 4000
KEYWORDS = ("and", "or", "not", "in", "between", "is", "missing", "contains", "true", "false")
SPACE = re.compile(r"\s+")
DATE = re.compile(
    r"\d{4}-\d{2}-\d{2}(?:T\d{2}(?::\d{2}(?::\d{2}(?:\.\d+)?)?)?)?(?:Z|[+-]\d{2}:\d{2})?(?![\w.])"
)
NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
NAME = re.compile(r"[^\W\d]\w*(?:[.-]\w+)*")
SIGN = re.compile(r"<=|>=|==|!=|<>|[<>=≤≥≠()\[\],]")
QUOTED = re.compile(r"'((?:[^']|'')*)'|\"((?:[^\"]|\"\")*)\"")
FACTOR = re.compile(r"[A-Za-zµμ°%]+(?:\s*(?:\^|\*\*)\s*[+-]?\d+|[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+|[+-]?\d+)?")
JOINT = re.compile(r"\s*[*/·⋅]\s*|\s+")
ONE_OVER = re.compile(r"\s*1\s*/\s*")
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

    Raises
    ------
    QueryError : a character belongs nowhere, or the text is longer than `LONGEST`
    """
    if len(text) > LONGEST:
        raise QueryError(f"{len(text)} characters, more than {LONGEST}", text[:40] + "…", 0)
    read: list[Token] = []
    at = 0
    while at < len(text):
        if space := SPACE.match(text, at):
            at = space.end()
            continue
        token, at = _next(text, at)
        read.append(token)
    return [*read, Token("end", "", len(text))]


def _next(text: str, at: int) -> tuple[Token, int]:
    if match := QUOTED.match(text, at):
        inner = match[1].replace("''", "'") if match[1] is not None else match[2].replace('""', '"')
        return Token("text", inner, at), match.end()
    if match := DATE.match(text, at):
        return Token("date", match[0], at), match.end()
    if match := NUMBER.match(text, at):
        unit, end = _unit(text, match.end())
        return Token("number", match[0], at, unit), end
    if match := NAME.match(text, at):
        word = match[0].lower()
        return (Token("keyword", word, at) if word in KEYWORDS else Token("name", match[0], at)), match.end()
    if match := SIGN.match(text, at):
        return Token("sign", SIGNS.get(match[0], match[0]), at), match.end()
    if text[at] in "'\"":
        raise QueryError(f"the text that begins with {text[at]} does not end", text, at)
    raise QueryError(f"{text[at]!r} belongs nowhere here; texts stand in quotes", text, at)


def _unit(text: str, at: int) -> tuple[str, int]:
    """Return the unit that follows a number, and where it ends; keywords are no units."""
    start = at
    if match := ONE_OVER.match(text, at):
        at = match.end()
    elif match := SPACE.match(text, at):
        at = match.end()
    begin, end, depth = at, start, 0
    while True:
        if text[at : at + 1] == "(":
            depth, at = depth + 1, at + 1
        factor = FACTOR.match(text, at)
        if factor is None or factor[0].lower() in KEYWORDS:
            break
        at = factor.end()
        while depth and text[at : at + 1] == ")":
            depth, at = depth - 1, at + 1
        end = at
        joint = JOINT.match(text, at)
        if joint is None:
            break
        at = joint.end()
    if end == start:
        return "", start
    return ("1/" if text[start:begin].strip() else "") + text[begin:end], end


DEEPEST = 40
DAY = len("2026-01-01")
COMPARISONS = ("<", "<=", ">", ">=", "=", "!=")
MIRRORED = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "=": "=", "!=": "!="}
FIRST_CYCLE = "first_cycle"


@dataclass(frozen=True)
class Name:
    """A key as somebody writes it."""

    text: str
    at: int


@dataclass(frozen=True)
class Literal:
    """A number with its unit, a text, a date, or true or false."""

    value: float | str | bool
    at: int
    unit: str = ""
    is_date: bool = False

    @property
    def is_day(self) -> bool:
        """Whether it is a date without a time, and so means the whole day."""
        return self.is_date and len(str(self.value)) == DAY


@dataclass(frozen=True)
class FirstCycle:
    """The first cycle at which a comparison holds along a life."""

    condition: "Compare"
    at: int


@dataclass(frozen=True)
class Compare:
    """``left sign right``; the sign is one of `COMPARISONS` or "contains"."""

    sign: str
    left: Any
    right: Any


@dataclass(frozen=True)
class Missing:
    """The operand has no value."""

    operand: Any


@dataclass(frozen=True)
class Not:
    """The opposite."""

    condition: Any


@dataclass(frozen=True)
class All:
    """Every condition holds."""

    conditions: tuple[Any, ...]


@dataclass(frozen=True)
class Some:
    """At least one condition holds."""

    conditions: tuple[Any, ...]


def parse(text: str) -> Any:
    """Return the tree of a condition.

    Raises
    ------
    QueryError : it does not follow the grammar; the message points at the place
    """
    reader = _Grammar(text)
    tree = reader.condition(0)
    reader.expect_end()
    return tree


def parse_operand(text: str) -> Any:
    """Return a name or a ``first_cycle(…)``: what may be a column of a table."""
    reader = _Grammar(text)
    operand = reader.operand()
    reader.expect_end()
    if isinstance(operand, Literal):
        raise QueryError("a column is a name, or first_cycle(…)", text, operand.at)
    return operand


class _Grammar:
    """Walks over the words of a condition."""

    def __init__(self, text: str) -> None:
        self.text, self.words, self.place = text, tokens(text), 0

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

    def fail(self, wanted: str) -> QueryError:
        word = f"not {self.word.text!r}" if self.word.kind != "end" else "but it ends"
        return QueryError(f"expected {wanted}, {word}", self.text, self.word.at)

    def expect(self, sign: str, wanted: str) -> None:
        if not self.take("sign", sign):
            raise self.fail(wanted)

    def expect_end(self) -> None:
        if self.word.kind != "end":
            raise self.fail("'and', 'or' or the end")

    def condition(self, depth: int) -> Any:
        alternatives = [self.conjunction(depth)]
        while self.take("keyword", "or"):
            alternatives.append(self.conjunction(depth))
        return alternatives[0] if len(alternatives) == 1 else Some(tuple(alternatives))

    def conjunction(self, depth: int) -> Any:
        parts = [self.negation(depth)]
        while self.take("keyword", "and"):
            parts.append(self.negation(depth))
        return parts[0] if len(parts) == 1 else All(tuple(parts))

    def negation(self, depth: int) -> Any:
        if depth > DEEPEST:
            raise QueryError(f"nested deeper than {DEEPEST}", self.text, self.word.at)
        if self.take("keyword", "not"):
            return Not(self.negation(depth + 1))
        if self.take("sign", "("):
            inner = self.condition(depth + 1)
            self.expect(")", "')'")
            return inner
        return self.comparison()

    def comparison(self) -> Any:
        left = self.operand()
        if sign := self.take("sign", *COMPARISONS):
            middle = self.operand()
            first = self._compared(sign.text, left, middle)
            if then := self.take("sign", *COMPARISONS):  # 100 N*m < torque < 200 N*m
                return All((first, self._compared(then.text, middle, self.operand())))
            return first
        negated = bool(self.take("keyword", "not"))
        worded = self._worded(left, negated)
        return Not(worded) if negated else worded

    def _worded(self, left: Any, negated: bool) -> Any:
        if self.take("keyword", "in"):
            items = self._list()
            return Some(tuple(self._compared("=", left, item) for item in items))
        if self.take("keyword", "between"):
            low = self.operand()
            if not self.take("keyword", "and"):
                raise self.fail("'and' of between")
            return All((self._compared(">=", left, low), self._compared("<=", left, self.operand())))
        if self.take("keyword", "contains"):
            return self._compared("contains", left, self.operand())
        if not negated and self.take("keyword", "is"):
            other = bool(self.take("keyword", "not"))
            if not self.take("keyword", "missing"):
                raise self.fail("'missing'")
            return Not(Missing(left)) if other else Missing(left)
        if negated or isinstance(left, Literal | FirstCycle):
            raise self.fail("a comparison (<, <=, >, >=, =, !=, in, between, contains, is missing)")
        if self.word.kind == "end" or self.word.text in (")", "and", "or"):  # a switch by itself
            return Compare("=", left, Literal(True, left.at))
        raise self.fail("a comparison (<, <=, >, >=, =, !=, in, between, contains, is missing)")

    def _compared(self, sign: str, left: Any, right: Any) -> Compare:
        """Return a comparison with the literal on the right."""
        if isinstance(left, Literal) and not isinstance(right, Literal) and sign in MIRRORED:
            return Compare(MIRRORED[sign], right, left)
        if isinstance(left, Literal):
            raise QueryError("nothing is asked: one side must be a name", self.text, left.at)
        return Compare(sign, left, right)

    def _list(self) -> list[Any]:
        opened = self.take("sign", "[", "(")
        if opened is None:
            raise self.fail("a list in [ ]")
        items = [self.operand()]
        while self.take("sign", ","):
            items.append(self.operand())
        closing = "]" if opened.text == "[" else ")"
        self.expect(closing, f"',' or {closing!r}")
        return items

    def operand(self) -> Any:
        word = self.word
        if self.take("name"):
            if word.text == FIRST_CYCLE and self.take("sign", "("):
                inner = self.comparison()
                if not isinstance(inner, Compare) or inner.sign not in ("<", "<=", ">", ">="):
                    raise QueryError("first_cycle(…) holds one comparison with < or >", self.text, word.at)
                self.expect(")", "')'")
                return FirstCycle(inner, word.at)
            return Name(word.text, word.at)
        if self.take("number"):
            return Literal(float(word.text), word.at, word.unit)
        if self.take("text"):
            return Literal(word.text, word.at)
        if self.take("date"):
            return Literal(word.text, word.at, is_date=True)
        if self.take("keyword", "true", "false"):
            return Literal(word.text == "true", word.at)
        raise self.fail("a name or a value")
