"""Tables of runs, page by page: columns, order and condition as by command."""

import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from wearlab.query import (
    Key,
    QueryError,
    Vocabulary,
    read_column,
    read_condition,
    split_columns,
)
from wearlab.report.run import value_text
from wearlab.schema import VARIABLES
from wearlab.store import Store, grid
from wearlab.store.search import CatalogueSearch, Page
from wearlab.units import KINDS, shown_unit

ROWS = 50  # of a page
USUAL: tuple[str, ...] = (
    "case",
    "operation.torque",
    "operation.speed",
    "life",
    "service_life",
)
USUAL += ("max_wear_depth", "verdict", "tag", "campaign", "started")
SIGNS = {
    ">=": "at least",
    "<=": "at most",
    "=": "is",
    "!=": "is not",
    ">": "more than",
    "<": "less than",
}
SIGNS |= {"contains": "contains"}
TEXTS = {
    "id": "identity of the run",
    "status": "state of the run",
    "campaign": "title of its campaign",
}
TEXTS |= {
    "case": "label of its case",
    "tag": "a tag on it, or on its campaign",
    "note": "a note on it",
}
TEXTS |= {
    "started": "when it was computed",
    "seconds": "how long that took",
    "bytes": "size of its file",
}
TEXTS |= {"other_code": "whether other code than the present made it"}
BARE = re.compile(r"[+-]?\d+(?:\.\d+)?(?:e[+-]?\d+)?", re.IGNORECASE)
IN_CYCLES = ("life", "max(remaining_useful_life)", "max(load_cycles)")


class ConditionWord(NamedTuple):
    """Something that can be asked for: its name, what it is, and a value of it."""

    name: str
    meaning: str
    example: str


@dataclass(frozen=True)
class Listed:
    """A page of a table of runs.

    Parameters
    ----------
    where, columns, sort, number : the condition, what is shown, by what it is sorted,
        and the page, from 1
    heads : column and its heading with unit
    rows : of each run its id, and its cells as texts
    count : of all runs that meet the condition
    words : what can be asked for
    problem : why there are none, "" where nothing is wrong
    refused : word, sign and value that were to be added to the condition and cannot be,
        to be written again
    notes : what is to be known of the runs that were found
    """

    where: str
    columns: tuple[str, ...]
    sort: str
    number: int
    heads: tuple[tuple[str, str], ...] = ()
    rows: tuple[tuple[str, tuple[str, ...]], ...] = ()
    count: int = 0
    words: tuple[ConditionWord, ...] = ()
    problem: str = ""
    refused: tuple[str, str, str] = ("", ">=", "")
    notes: tuple[str, ...] = ()

    @property
    def pages(self) -> int:
        """How many pages there are."""
        return max(1, -(-self.count // ROWS))

    @property
    def asked(self) -> dict[str, str]:
        """What the address of another page of the table says."""
        return {
            "where": self.where,
            "columns": ",".join(self.columns),
            "sort": self.sort,
        }

    @property
    def reach(self) -> str:
        """Which rows these are, in words."""
        if not self.rows:
            return "no run"
        first = (self.number - 1) * ROWS
        return f"runs {first + 1:,} to {first + len(self.rows):,} of {self.count:,}"


def listed(store: Store, arguments: Mapping[str, str]) -> Listed:
    """Return the page of runs that the arguments of an address ask for.

    Parameters
    ----------
    store : asked for one page of its runs
    arguments : where, columns (joined by commas), sort, page; add: a column; word,
        sign, value: a condition
    """
    search = CatalogueSearch(store.archive.catalogue, store.archive.files)
    known = search.vocabulary
    given = {name: text.strip() for name, text in arguments.items()}
    names = split_columns(given.get("columns", ""))
    shown = [*names] or [name for name in USUAL if name in known.keys]
    columns = tuple(dict.fromkeys(filter(None, [*shown, given.get("add", "")])))
    number = whole(given.get("page", ""))
    words = _words(known.keys.values())
    asked = Listed(
        given.get("where", ""), columns, given.get("sort", ""), number, words=words
    )
    if given.get("word") or given.get("value"):
        chosen = (
            given.get("word", ""),
            given.get("sign") or "=",
            given.get("value", ""),
        )
        added, problem = _added(*chosen, known)
        if problem:
            return replace(asked, problem=problem, refused=chosen)
        asked = replace(
            asked, where=f"{asked.where} and {added}" if asked.where else added
        )
    try:
        page = search.page(
            asked.where, columns, asked.sort or None, ROWS, (number - 1) * ROWS
        )
    except QueryError as error:
        return replace(
            asked,
            problem=str(error),
            columns=tuple(c for c in columns if _is_readable(c, known)),
        )
    heads, rows = rows_of(store, page)
    return replace(
        asked, heads=heads, rows=rows, count=page.total, notes=page.table.notes
    )


def _is_readable(column: str, names: Vocabulary) -> bool:
    """Whether a text names a column."""
    try:
        read_column(column, names)
    except QueryError:
        return False
    return True


def rows_of(store: Store, page: Page) -> tuple[Any, Any]:
    """Return headings and rows of some runs, with the states of their processes."""
    heads, rows = page.table.displayed()
    names = [column.name for column in page.table.columns]
    states = {
        head.id: store.archive.state_of(head)
        for head in store.archive.heads(row[0] for row in rows).values()
    }
    at = names.index("status")
    told = []
    for row in rows:
        state = states.get(row[0], "")
        cells = [
            state if i == at else _cell(v, names[i], state)
            for i, v in enumerate(row)
            if i
        ]
        told.append((row[0], tuple(cells)))
    return tuple(
        (name, _heading(head)) for name, head in zip(names, heads, strict=True)
    )[1:], tuple(told)


def _cell(value: Any, name: str = "", state: str = "") -> str:
    """Return a value as a table shows it: to five digits, a large one in full."""
    if value is None and name in ("life", "service_life") and state == "done":
        return "no limit reached"
    if (
        isinstance(value, float) and 1e5 <= abs(value) < 1e15
    ):  # it would be written with an exponent
        return f"{float(f'{value:.5g}'):,.0f}"
    return value_text(float(f"{value:.5g}") if isinstance(value, float) else value)


def _heading(head: str) -> str:
    """Return a heading as people read it: the last words of a key, and its unit."""
    name, bracket, unit = head.partition(" [")
    is_formula = "(" in name or "[" in name
    words = (
        grid.key_text(name)
        if "." in name and not is_formula
        else name.replace("_", " ")
    )
    return f"{words}{bracket}{shown_unit(unit)}" + (
        " [cycles]" if name in IN_CYCLES else ""
    )


def _added(word: str, sign: str, value: str, known: Vocabulary) -> tuple[str, str]:
    """Return the condition of a chosen word, sign and value, or why there is none.

    Of a bare number it is told how it is written with its unit.
    """
    if not word or not value:
        return "", "choose both what and its value, such as torque and 340 N*m"
    name = (
        word if word in known.keys else word.lower().replace(" ", "_")
    )  # as headings write it
    key = known.keys.get(known.aliases.get(name, name))
    text = value
    if key is not None and key.kind == "text" and value[:1] not in "'\"":
        text = f"'{value}'" if "'" not in value else f'"{value}"'
    added = f"{name} {sign if sign in SIGNS else '='} {text}"
    try:
        read_condition(added, known)
    except QueryError as error:
        with suppress(QueryError):
            column = read_column(word, known)
            unit = (
                (column.display_unit or column.unit) if isinstance(column, Key) else ""
            )
            if BARE.fullmatch(value) and unit not in ("", "1"):
                return (
                    added,
                    f"{value} of what? Write {word} with its unit: {value} {unit}",
                )
        return added, str(error)
    return added, ""


def _words(keys: Iterable[Key]) -> tuple[ConditionWord, ...]:
    """Return what can be asked for, results before the values of scenes.

    Nothing of an entry of a list.
    """
    named = ((key, key.name.split(".")) for key in keys if not key.name.endswith("()"))
    told = [_word(key) for key, words in named if not any(map(str.isdigit, words))]
    return tuple(sorted(told, key=lambda word: (word.name.count("."), word.name))[:400])


def _word(key: Key) -> ConditionWord:
    meaning = TEXTS.get(key.name) or (
        VARIABLES[key.name].long_name if key.name in VARIABLES else ""
    )
    if key.quantity:
        example = KINDS[key.quantity].example
    elif key.unit in ("", "1", "cycles"):
        example = (
            "word"
            if key.kind == "text"
            else "2026-11-01"
            if key.kind == "date"
            else "1"
        )
    else:
        example = f"1 {key.display_unit or key.unit}"
    return ConditionWord(
        key.name, meaning or ("of the scene" if key.is_path else ""), example
    )


def whole(text: str) -> int:
    """Return the whole number from 1 on that a text is, 1 where it is none."""
    return (
        max(1, int(text)) if text.isascii() and text.isdigit() and len(text) < 9 else 1
    )
