"""The table of one campaign file: its TOML, with limits on size and keys."""

import re
import tomllib
from collections.abc import Iterator, Mapping
from itertools import islice
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from wearlab import files
from wearlab.campaign.blocks import CampaignError
from wearlab.scene.merge import Table

MAX_FILE_SIZE = 10_000_000  # bytes
MAX_DEPTH = 50  # tables within tables
MAX_KEY_LENGTH = 1_000  # characters
MAX_SHOWN_PATH = 200  # characters of a path in a message
MAX_FAULTS = 20  # in one message
INTEGER_LIMIT = 2**63  # whole numbers, as TOML has them

WORD = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
LONG_DOTTED_KEY = re.compile(
    rf"(?:^|[{{,])[ \t\[]*+(?:{WORD}[ \t]*+\.[ \t]*+){{{MAX_DEPTH}}}", re.MULTILINE
)
AT_LINE = re.compile(r"at line (\d+)")
DECIMAL_COMMA = re.compile(r"=\s*(-?\d+),(\d+)\s*(?:$|#|\})")
BARE_QUANTITY = re.compile(
    r"=\s*(-?\d+(?:\.\d+)?(?:e[+-]?\d+)?)\s*([A-Za-zµ°][A-Za-z0-9µ°*/^]{0,20})"
)


def read_toml(file: Path) -> Table:
    """Return the table that a TOML file holds.

    Parameters
    ----------
    file : a campaign file

    Raises
    ------
    CampaignError : the file cannot be read, or is no TOML
    """
    try:
        text = files.read_regular(file, MAX_FILE_SIZE).decode("utf-8-sig")
        _refuse_long_dotted_key(text, file)
        return tomllib.loads(text)
    except RecursionError:
        raise CampaignError(f"{file}: brackets or keys nested too deeply") from None
    except OSError as error:
        reason = error.strerror or error
        raise CampaignError(f"{file}: cannot read it: {reason}") from None
    except UnicodeDecodeError as error:
        raise CampaignError(f"{file}: no TOML file: {error}") from None
    except tomllib.TOMLDecodeError as error:
        remedy = _remedy(text, str(error))
        raise CampaignError(f"{file}: no TOML file: {error}{remedy}") from None


def _refuse_long_dotted_key(text: str, file: Path) -> None:
    """Refuse dotted keys of many parts, for which the TOML reader takes long."""
    if key := LONG_DOTTED_KEY.search(text):
        line = text.count("\n", 0, key.start()) + 1
        raise CampaignError(
            f"{file}: line {line}: a key of more than {MAX_DEPTH} parts"
        )


def _remedy(text: str, problem: str) -> str:
    """Return how to write the quantity of the line that is no TOML, "" for others."""
    place = AT_LINE.search(problem)
    lines = text.splitlines()
    if place is None or not 0 < int(place[1]) <= len(lines):
        return ""
    line = lines[int(place[1]) - 1]
    if comma := DECIMAL_COMMA.search(line):
        return f"; write a decimal point: {comma[1]}.{comma[2]}"
    if bare := BARE_QUANTITY.search(line):
        return f'; write a quantity with its unit in quotes: "{bare[1]} {bare[2]}"'
    return ""


def plain(value: Any) -> Any:
    """Return a value of Python as a TOML file would hold it.

    Mappings become tables, arrays and tuples lists, numbers of NumPy those of Python,
    paths texts.

    Parameters
    ----------
    value : anything, such as the mapping that a user gives in place of a file
    """
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, PathLike):
        return fspath(value)
    if hasattr(value, "tolist"):  # an array, or one of its numbers
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [plain(element) for element in value]
    return value


def check_table(table: Table, file: Path) -> None:
    """Refuse keys and whole numbers of a table that are too long or too deep.

    Parameters
    ----------
    table : of a campaign file
    file : what messages call it

    Raises
    ------
    CampaignError : with one line for each of the first faults
    """
    if problems := list(islice(_faults(table), MAX_FAULTS)):
        raise CampaignError(f"{file}: {problem}" for problem in problems)


def _faults(value: Any, path: str = "", depth: int = 0) -> Iterator[str]:
    """Yield what is wrong with keys and whole numbers of a table, path first."""
    if depth > MAX_DEPTH:
        yield f"{_short(path)}: keys nested more than {MAX_DEPTH} deep"
    elif isinstance(value, dict):
        for key, inner in value.items():
            if fault := _key_fault(key):
                yield f"{_short(path) or 'the file'}: {fault}"
            else:
                inner_path = f"{path}.{key}" if path else key
                yield from _faults(inner, inner_path, depth + 1)
    elif isinstance(value, list):
        for number, inner in enumerate(value):
            yield from _faults(inner, f"{path}[{number}]", depth + 1)
    elif isinstance(value, int) and not -INTEGER_LIMIT <= value < INTEGER_LIMIT:
        digits = len(f"{abs(value):x}")
        yield (
            f"{_short(path)}: a whole number of {digits} hexadecimal digits: TOML has "
            "no more than 16"
        )


def _key_fault(key: str) -> str | None:
    """Return what is wrong with one key, None where nothing is."""
    if not key.strip():
        return "an empty key"
    if len(key) > MAX_KEY_LENGTH:
        return f"a key of {len(key)} characters, {key[:20]!r}…"
    if key.count(".") > MAX_DEPTH:
        return f"a key of {key.count('.') + 1} parts, {key[:20]!r}…"
    return None


def _short(path: str) -> str:
    """Return a path, cut where it is long."""
    return path if len(path) < MAX_SHOWN_PATH else f"{path[:MAX_SHOWN_PATH]}…"
