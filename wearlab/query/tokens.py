"""A condition cut into words: names, numbers with their units, texts, dates, signs."""

import re
from typing import NamedTuple

from wearlab.query.errors import QueryError

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
