"""What no campaign file needs and what would keep its reader busy: refused before anything else sees it."""

import re
from collections.abc import Iterator
from typing import Any

DEEPEST = 50  # tables within tables
LONGEST = 1_000  # characters of a key
WIDEST = 2**63  # whole numbers, as TOML has them
WORD = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
CHAIN = re.compile(rf"(?:^|[{{,])[ \t\[]*+(?:{WORD}[ \t]*+\.[ \t]*+){{{DEEPEST}}}", re.MULTILINE)


def too_deep(text: str) -> str | None:
    """Return why a text is not given to the TOML reader, which takes long over long dotted keys."""
    chain = CHAIN.search(text)
    if chain is None:
        return None
    line = text.count("\n", 0, chain.start()) + 1
    return f"line {line}: a key of more than {DEEPEST} parts"


def faults(table: dict[str, Any]) -> Iterator[str]:
    """Yield what is wrong with keys and whole numbers, each with its path."""
    waiting: list[tuple[str, Any, int]] = [("", table, 0)]
    while waiting:
        path, value, depth = waiting.pop()
        if depth > DEEPEST:
            yield f"{_short(path)}: keys nested more than {DEEPEST} deep"
            return
        if isinstance(value, dict):
            for key, inner in value.items():
                if fault := _of_key(key):
                    yield f"{_short(path) or 'the file'}: {fault}"
                else:
                    waiting.append((f"{path}.{key}" if path else key, inner, depth + 1))
        elif isinstance(value, list):
            waiting += [(f"{path}[{number}]", inner, depth + 1) for number, inner in enumerate(value)]
        elif isinstance(value, int) and not -WIDEST <= value < WIDEST:
            digits = len(f"{abs(value):x}")
            yield f"{_short(path)}: a whole number of {digits} hexadecimal digits: TOML has no more than 16"


def _of_key(key: str) -> str | None:
    if not key.strip():
        return "an empty key"
    if len(key) > LONGEST:
        return f"a key of {len(key)} characters, {key[:20]!r}…"
    if key.count(".") > DEEPEST:
        return f"a key of {key.count('.') + 1} parts, {key[:20]!r}…"
    return None


def _short(path: str) -> str:
    return path if len(path) < 200 else f"{path[:200]}…"
