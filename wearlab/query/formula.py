"""The grammar of a number read off stored runs: arithmetic, places, a few functions; no code is run.

::

    formula = term { ("+" | "-") term }
    term    = factor { ("*" | "/") factor }
    factor  = "-" factor | item { "[" place { "," place } "]" }
    item    = number | function "(" formula [ "," dimension ] ")" | name | "(" formula ")"
    place   = dimension "=" ( number | word | text in quotes )
"""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from wearlab.query.grammar import QueryError

FUNCTIONS = ("max", "min", "mean", "range", "abs", "largest_at", "smallest_at")
LONGEST = 1000
DEEPEST = 30
TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[^\W\d]\w*)"
    r"|(?P<text>'[^']*'|\"[^\"]*\")|(?P<sign>[-+*/()\[\],=]))"
)
WORD = re.compile(r"\s*([^\W\d][\w-]*)\s*(?=[,\]])")


@dataclass(frozen=True)
class PlainNumber:
    """A plain number."""

    value: float


@dataclass(frozen=True)
class Named:
    """A variable or coordinate of the runs."""

    name: str
    at: int


@dataclass(frozen=True)
class PlacedNumber:
    """A formula at places: of every variable in it, the part along these dimensions."""

    inner: Any
    places: tuple[tuple[str, float | str], ...]


@dataclass(frozen=True)
class Applied:
    """A function of a formula, along one dimension or along all."""

    function: str
    inner: Any
    dim: str | None


@dataclass(frozen=True)
class Joined:
    """Two formulas and the sign between them."""

    sign: str
    left: Any
    right: Any


def parse_formula(text: str) -> Any:
    """Return the tree of a formula.

    Raises
    ------
    QueryError : it does not follow the grammar; the message points at the place

    Examples
    --------
    >>> parse_formula("max(wear_depth[flank=sun]) / 2").sign
    '/'
    """
    if len(text) > LONGEST:
        raise QueryError(f"{len(text)} characters, more than {LONGEST}", text[:40] + "…", 0)
    reader = _FormulaReader(text)
    tree = reader.formula(0)
    if reader.rest().strip():
        raise reader.fail("an operator or the end")
    return tree


def names_in(tree: Any) -> Iterator[Named]:
    """Yield every name that a formula holds."""
    match tree:
        case Named():
            yield tree
        case PlacedNumber(inner) | Applied(_, inner):
            yield from names_in(inner)
        case Joined(_, left, right):
            yield from names_in(left)
            yield from names_in(right)


def spelled_out(text: str, meanings: Mapping[str, str]) -> str:
    """Return a formula in which names that stand for formulas are replaced by these, in brackets."""
    found = [(n.at, n.name) for n in names_in(parse_formula(text)) if n.name in meanings]
    for at, name in sorted(found, reverse=True):
        text = f"{text[:at]}({meanings[name]}){text[at + len(name) :]}"
    return text


class _FormulaReader:
    """Walks over the text of a formula."""

    def __init__(self, text: str) -> None:
        self.text, self.at = text, 0

    def rest(self) -> str:
        return self.text[self.at :]

    def fail(self, wanted: str) -> QueryError:
        return QueryError(f"expected {wanted}", self.text, self.at)

    def take(self, kind: str, *texts: str) -> str | None:
        """Step over the next word when it is one of these."""
        found = TOKEN.match(self.text, self.at)
        if found is None or found.lastgroup != kind or (texts and found[kind] not in texts):
            return None
        self.at = found.end()
        return found[kind]

    def expect(self, sign: str) -> None:
        if not self.take("sign", sign):
            raise self.fail(repr(sign))

    def formula(self, depth: int) -> Any:
        return self._joined(("+", "-"), self._term, depth)

    def _term(self, depth: int) -> Any:
        return self._joined(("*", "/"), self._factor, depth)

    def _joined(self, signs: tuple[str, ...], part: Callable[[int], Any], depth: int) -> Any:
        if depth > DEEPEST:
            raise QueryError(f"nested deeper than {DEEPEST}", self.text, self.at)
        left = part(depth + 1)
        while sign := self.take("sign", *signs):
            left = Joined(sign, left, part(depth + 1))
        return left

    def _factor(self, depth: int) -> Any:
        if self.take("sign", "-"):
            if depth > DEEPEST:
                raise QueryError(f"nested deeper than {DEEPEST}", self.text, self.at)
            return Joined("-", PlainNumber(0.0), self._factor(depth + 1))
        item = self._item(depth)
        while self.take("sign", "["):
            places = [self._place()]
            while self.take("sign", ","):
                places.append(self._place())
            self.expect("]")
            item = PlacedNumber(item, tuple(places))
        return item

    def _item(self, depth: int) -> Any:
        if number := self.take("number"):
            return PlainNumber(float(number))
        if self.take("sign", "("):
            inner = self.formula(depth + 1)
            self.expect(")")
            return inner
        name = self.take("name")
        if name is None:
            raise self.fail("a number, a name or '('")
        at = self.at - len(name)
        if not self.take("sign", "("):
            return Named(name, at)
        if name not in FUNCTIONS:
            raise QueryError(f"no function {name!r}; there are {', '.join(FUNCTIONS)}", self.text, at)
        inner = self.formula(depth + 1)
        dim = None
        if self.take("sign", ","):
            dim = self.take("name")
            if dim is None:
                raise self.fail("a dimension")
        elif name.endswith("_at"):
            raise self.fail(f"', dimension': {name}(formula, dimension)")
        self.expect(")")
        return Applied(name, inner, dim)

    def _place(self) -> tuple[str, float | str]:
        dim = self.take("name")
        if dim is None:
            raise self.fail("a dimension")
        self.expect("=")
        if (text := self.take("text")) is not None:
            return dim, text[1:-1]
        if word := WORD.match(self.text, self.at):
            self.at = word.end()
            return dim, word[1]
        sign = -1.0 if self.take("sign", "-") else 1.0
        number = self.take("number")
        if number is None:
            raise self.fail("a number, a word, or a text in quotes")
        return dim, sign * float(number)
