"""Conditions asked of the catalogue: what can be asked for, and the runs found.

What a question names is read for some thousand runs at once, one key after the other;
the condition is then asked of each run, by its `holds` as everywhere. So no more of a
large catalogue is in memory than which runs were found, by what they are sorted, and
what is to be shown of them.
"""

import json
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

from wearlab.query import Key, Vocabulary, evaluate, read_column, read_condition
from wearlab.query.evaluate import BoundCondition, FirstCycle
from wearlab.sources import present_hashes
from wearlab.store import catalogue, database, remarks
from wearlab.store.table import Column, Table
from wearlab.units import KINDS, split

COLUMNS = {
    "id": "id",
    "status": "state",
    "started": "started",
    "seconds": "seconds",
    "bytes": "size",
}
COLUMNS |= {"source_hash": "source_hash", "wearlab_version": "wearlab_version"}
DOCUMENTS = ("reason", "warnings")
OF_CAMPAIGNS = ("campaign", "case")
OF_REMARKS = ("tag", "note")
OTHER_CODE = "other_code"
ASKED = {**COLUMNS, OTHER_CODE: "source_hash"}
QUESTIONS = {
    name: f"SELECT number, {column} FROM runs WHERE number"
    for name, column in ASKED.items()
}
QUESTIONS |= {
    name: f"SELECT number, {name} FROM documents WHERE number" for name in DOCUMENTS
}
Names = Sequence[str] | None
Run = tuple[int, str]  # its number and its id
AT_ONCE = 2_000  # runs whose values are in memory together
TEXTS = (
    "id",
    "status",
    "source_hash",
    "wearlab_version",
    *DOCUMENTS,
    *OF_CAMPAIGNS,
    *OF_REMARKS,
)
OWN_KEYS = [
    *(Key(name, "text") for name in TEXTS),
    Key("started", "date"),
    Key("bytes"),
    Key(OTHER_CODE),
]
OWN_KEYS += [Key("seconds", unit="s", display_unit="s")]
ALIASES = {
    "state": "status",
    "date": "started",
    "run_time": "seconds",
    "run": "id",
    "code": "source_hash",
}
ALIASES |= {
    "life_hours": "service_life",
    "hours_of_life": "service_life",
    "hours": "operating_hours",
}
ALIASES |= {
    "torque": "operation.torque",
    "speed": "operation.speed",
}  # not those of a duty or a calibration


class Page(NamedTuple):
    """Some of the runs that were found, and how many were.

    Parameters
    ----------
    table : of some runs
    total : how many meet the condition
    """

    table: Table
    total: int


class CatalogueSearch:
    """Asks one catalogue.

    Parameters
    ----------
    catalogue : where the runs are
    """

    def __init__(self, catalogue: catalogue.Catalogue) -> None:
        self.catalogue = catalogue
        rows = catalogue.read(
            "SELECT name, number, source, kind, unit, quantity, display_unit FROM keys"
        )
        self.numbers = {row[0]: row[1] for row in rows}
        own = [row for row in rows if row[3] != "history"]
        keys = [
            database.understood("a key in the catalogue", _key, row[0], *row[2:])
            for row in own
        ]
        named = [
            key._replace(history=key.name + evaluate.HISTORY in self.numbers)
            for key in keys
        ]
        self.axes: set[str] = set()
        self.vocabulary = Vocabulary([*named, *OWN_KEYS], ALIASES, self._elsewhere)

    def _elsewhere(self, name: str) -> Key | str | None:
        """Return the key of a name that no run here has a value of.

        A result, a value of a scene, or a campaign's axis.
        """
        from wearlab.query import keys

        if (
            declared := keys.declared_key(name) or keys.declared_scene_key(name)
        ) is not None:
            return declared
        mark = f"%{json.dumps(name)}:%"
        if not self.catalogue.read(
            "SELECT 1 FROM members WHERE position LIKE ? LIMIT 1", [mark]
        ):
            return None
        self.axes.add(name)
        return Key(name, "text")

    def page(
        self,
        where: str,
        columns: Names,
        sort: str | None,
        limit: int | None,
        skip: int = 0,
    ) -> Page:
        """Return some of the runs that meet a condition, and how many do.

        Parameters
        ----------
        where : condition; empty: all runs
        columns : names or ``first_cycle(…)`` beside id and status [what the condition
            names]
        sort : a column; a minus sign before it turns the order; what is missing comes
            last
        limit, skip : at most so many rows, after so many

        Raises
        ------
        QueryError : a name is unknown or a value does not fit; the message points at
            the place
        """
        condition = read_condition(where, self.vocabulary) if where.strip() else None
        asked = [(text, read_column(text, self.vocabulary)) for text in columns or ()]
        if columns is None and condition is not None:
            asked = [
                (key.name, key)
                for key in condition.keys
                if not key.name.endswith(evaluate.HISTORY)
            ]
        by = read_column(sort.lstrip("-"), self.vocabulary) if sort else None
        shown = {
            **{name: self.vocabulary.keys[name] for name in ("id", "status")},
            **dict(asked),
        }
        descending = bool(sort and sort.startswith("-"))
        if (
            condition is None
            and not isinstance(by, FirstCycle)
            and self._is_of_tables(by)
        ):
            some, count = self._in_order(by, descending, limit, skip)
        else:
            found = self._found(condition, by, descending)
            some = found[skip:] if limit is None else found[skip : skip + limit]
            count = len(found)
        values = self._values(
            [key for column in shown.values() for key in _keys_of(column)], some
        )
        heads = tuple(_head(text, column) for text, column in shown.items())
        rows = [
            tuple(_cell(evaluate.value_of(column, run)) for column in shown.values())
            for run in values
        ]
        return Page(Table(heads, rows), count)

    def _is_of_tables(self, by: Key | None) -> bool:
        return by is None or by.name in COLUMNS or by.name in self.numbers

    def _in_order(
        self, by: Key | None, down: bool, limit: int | None, skip: int
    ) -> tuple[list[Run], int]:
        """Return number and id of some of all runs, and how many there are.

        Ordered by a column of the tables.
        """
        ((count,),) = self.catalogue.read("SELECT count(*) FROM runs")
        value = by and f"r.{COLUMNS.get(by.name)}"
        beside = ""
        if by and by.name not in COLUMNS:
            number = int(self.numbers[by.name])
            value = "f.value"
            beside = f"LEFT JOIN facts AS f ON f.run = r.number AND f.key = {number}"
        order = (
            f"{value} IS NULL, {value}{' DESC' if down else ''}, r.number"
            if value
            else "r.number"
        )
        question = (
            f"SELECT r.number, r.id FROM runs AS r {beside} ORDER BY {order} LIMIT ? "
            "OFFSET ?"
        )
        return self.catalogue.read(
            question, (-1 if limit is None else limit, skip)
        ), count

    def _found(
        self, condition: BoundCondition | None, by: Key | FirstCycle | None, down: bool
    ) -> list[Run]:
        """Return number and id of the runs that meet a condition, in order."""
        runs = self.catalogue.read("SELECT number, id FROM runs ORDER BY number")
        keys = (*(condition.keys if condition else ()), *(_keys_of(by) if by else ()))
        known: list[tuple[Any, Run]] = []
        missing: list[tuple[Any, Run]] = []
        for run, values in zip(runs, self._values(keys, runs), strict=True):
            if condition is None or condition.holds(values):
                rank = None if by is None else _rank(evaluate.value_of(by, values))
                (missing if rank is None else known).append((rank, run))
        known.sort(key=lambda pair: pair[0], reverse=down)
        return [run for _, run in known + missing]

    def _values(
        self, keys: Iterable[Key], runs: Sequence[Run]
    ) -> Iterator[dict[str, Any]]:
        """Yield the values of keys for each run.

        They are read for some thousand runs at once.
        """
        names = dict.fromkeys(key.name for key in keys)
        for batch in database.batched(runs, AT_ONCE):
            read_columns = {name: self._column(name, batch) for name in names}
            columns = {
                name: values
                for name, values in read_columns.items()
                if values is not None
            }
            for place in range(len(batch)):
                yield {name: values[place] for name, values in columns.items()}

    def _column(self, name: str, runs: Sequence[Run]) -> list[Any] | None:
        """Return the value of a name for each of some runs.

        None where no run has any.
        """
        numbers, ids = zip(*runs, strict=True)
        if name in (*OF_REMARKS, *OF_CAMPAIGNS, *self.axes):
            remarked = name in OF_REMARKS
            texts = (
                remarks.texts_of(self.catalogue, ids, name)
                if remarked
                else self._of_campaigns(name, ids)
            )
            return [texts.get(run_id, ()) for run_id in ids]
        if (question := QUESTIONS.get(name)) is None:
            if name not in self.numbers:
                return None
            question = (
                f"SELECT run, value FROM facts WHERE key = {int(self.numbers[name])} "
                "AND run"
            )
        low = min(numbers)
        high = max(numbers)
        listed_numbers = ", ".join(map(str, numbers))
        of_some = (
            f"BETWEEN {low} AND {high}"
            if high - low < 2 * len(numbers)
            else f"IN ({listed_numbers})"
        )
        rows = dict(self.catalogue.read(f"{question} {of_some}"))
        values = [rows.get(number) for number in numbers]
        if name != OTHER_CODE:
            return values
        present = present_hashes()
        return [source not in present if source else None for source in values]

    def _of_campaigns(
        self, name: str, ids: Sequence[str]
    ) -> dict[str, tuple[str, ...]]:
        """Return what campaigns say of each run.

        Their titles, its labels, or its places on an axis.
        """
        texts: dict[str, dict[str, None]] = {}
        for member in self.catalogue.members(ids):
            of = {"campaign": member.campaign, "case": member.label}
            value = of[name] if name in of else member.position.get(name)
            if value is not None:
                texts.setdefault(member.run, {})[str(value)] = None
        return {run: tuple(values) for run, values in texts.items()}


def _key(
    name: Any, source: Any, kind: Any, unit: Any, quantity: Any, shown: Any
) -> Key:
    """Return a key as the catalogue tells it, which anybody may have written."""
    if not all(isinstance(text, str) for text in (name, kind, unit, shown)):
        raise TypeError(f"{str(name)[:20]!r} is not told in words")
    if quantity is not None and quantity not in KINDS:
        raise ValueError(f"{str(quantity)[:20]!r} is no quantity")
    return Key(name, kind, unit, quantity, shown, source == "scene")


def _keys_of(column: Key | FirstCycle) -> tuple[Key, ...]:
    return column.keys if isinstance(column, FirstCycle) else (column,)


def _rank(value: Any) -> tuple[bool, Any, str] | None:
    """Return what a value is sorted by: numbers before texts.

    Values of an axis by their number.
    """
    if isinstance(value, tuple):
        value = value[0] if value else None
        with suppress(ValueError):  # of a quantity with its unit
            return False, float(split(value or "")[0]), value
    if value is None:
        return None
    return (True, 0.0, value) if isinstance(value, str) else (False, value, "")


def _cell(value: Any) -> Any:
    return (",".join(value) or None) if isinstance(value, tuple) else value


def _head(text: str, column: Any) -> Column:
    if isinstance(column, FirstCycle):
        return Column(text)
    return Column(text, column.unit, column.display_unit, column.is_path)
