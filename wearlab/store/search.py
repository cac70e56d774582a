"""Conditions asked of the catalogue: what can be asked for, and the runs found.

What a question names is read for some thousand runs at once, one key after the other;
the condition is then asked of each run, by its `holds` as everywhere. So no more of a
large catalogue is in memory than which runs were found, by what they are sorted, and
what is to be shown of them.
"""

import json
import math
from array import array
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

from wearlab.query import (
    Key,
    QueryError,
    Vocabulary,
    evaluate,
    keys,
    read_column,
    read_condition,
)
from wearlab.query.evaluate import (
    ALL,
    EVERY,
    HISTORY,
    BoundCondition,
    FirstCycle,
)
from wearlab.query.formula import AmountError, parse_formula
from wearlab.sources import present_hashes
from wearlab.store import catalogue, database, description, remarks
from wearlab.store.files import RunFiles
from wearlab.store.formula_columns import FormulaColumns
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


class Matches(NamedTuple):
    """The runs that meet a condition.

    Parameters
    ----------
    runs : in order
    ambiguous : results that the condition names of which a run has several values
    """

    runs: list[Run]
    ambiguous: frozenset[str] = frozenset()


class CatalogueSearch:
    """Asks one catalogue.

    Parameters
    ----------
    catalogue : where the runs are
    files : of the runs, from which formulas are computed [none are]
    at_once : number of runs whose values are in memory together
    """

    def __init__(
        self,
        catalogue: catalogue.Catalogue,
        files: RunFiles | None = None,
        at_once: int = AT_ONCE,
    ) -> None:
        self.catalogue = catalogue
        self.at_once = at_once
        self.formulas = None if files is None else FormulaColumns(catalogue, files)
        rows = catalogue.read(
            "SELECT name, number, source, kind, unit, quantity, display_unit FROM keys"
        )
        self.numbers = {row[0]: row[1] for row in rows}
        stored_keys = [
            self._with_dims(
                database.understood("a key in the catalogue", _key, row[0], *row[2:])
            )
            for row in rows
            if row[3] != "history"
        ]
        self.axes: set[str] = set()
        self.in_files: dict[str, Key] = {}  # results that no catalogue keeps
        self.vocabulary = Vocabulary(
            [*stored_keys, *OWN_KEYS],
            ALIASES,
            self._elsewhere,
            reads_formulas=self.formulas is not None,
        )

    def _with_dims(self, key: Key) -> Key:
        """Return a key with whether it is kept along the life, and its dimensions."""
        history = key.name + HISTORY in self.numbers
        if key.is_path or key.kind != "number":
            return key._replace(history=history)
        declared = keys.declared_key(key.name)
        dims = () if declared is None else declared.dims
        if history and not dims:  # of a plug-in's result
            dims = ("update",)
        any_value = bool(dims) and self.formulas is not None
        return key._replace(history=history, dims=dims, any_value=any_value)

    def _elsewhere(self, name: str) -> Key | str | None:
        """Return the key of a name that no run here has a value of.

        A result, a value of a scene, or a campaign's axis.
        """
        result = keys.declared_key(name)
        if result is not None and result.dims:
            return self._in_files(result)
        declared = result or keys.declared_scene_key(name)
        if declared is not None:
            return declared
        mark = f"%{json.dumps(name)}:%"
        if not self.catalogue.read(
            "SELECT 1 FROM members WHERE position LIKE ? LIMIT 1", [mark]
        ):
            return keys.declared_scene_end(name)
        self.axes.add(name)
        return Key(name, "text")

    def _in_files(self, key: Key) -> Key | str:
        """Return the key of a result with several values that only files have."""
        if key.kind == "text":
            return (
                f"has a text at each place of {' and '.join(key.dims)}, which stands "
                "in the run's dataset alone"
            )
        if key.is_kept or self.formulas is None:
            return key
        self.in_files[key.name] = key._replace(any_value=True)
        return self.in_files[key.name]

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
        by = read_column(sort.lstrip("-"), self.vocabulary) if sort else None
        shown = self._shown(columns, condition)
        descending = bool(sort and sort.startswith("-"))
        if (
            condition is None
            and not isinstance(by, FirstCycle)
            and self._is_of_tables(by)
        ):
            runs, count = self._in_order(by, descending, limit, skip)
            ambiguous: frozenset[str] = frozenset()
        else:
            matching, ambiguous = self._matches(condition, by, descending)
            runs = matching[skip:] if limit is None else matching[skip : skip + limit]
            count = len(matching)

        needed = [key.name for column in shown.values() for key in _keys_of(column)]
        rows = [
            tuple(_cell(evaluate.value_of(column, run)) for column in shown.values())
            for run in self._values(needed, runs)
        ]
        heads = tuple(self._head(text, column) for text, column in shown.items())
        names = {key.name for key in condition.keys} if condition else set()
        notes = (*self._notes(ambiguous), *self._notes_of_conditions(names))
        return Page(Table(heads, rows, notes), count)

    def _shown(
        self, columns: Names, condition: BoundCondition | None
    ) -> "dict[str, Key | FirstCycle]":
        """Return the columns by what they are called: id, status, and those chosen.

        Or, where none were chosen, what the condition names.
        """
        shown: dict[str, Key | FirstCycle] = {
            name: self.vocabulary.keys[name] for name in ("id", "status")
        }
        if columns is not None:
            for text in columns:
                column = read_column(text, self.vocabulary)
                shown[_title(text, column)] = column
        elif condition is not None:
            for key in condition.keys:
                if not key.name.endswith(HISTORY):
                    shown[_title(key.name, key)] = key
        return shown

    def _head(self, title: str, column: Key | FirstCycle) -> Column:
        """Return what stands above the values of a column."""
        if isinstance(column, FirstCycle):
            return Column(title)
        unit = column.unit
        display_unit = column.display_unit
        if column.formula is not None and self.formulas is not None:
            computed = self.formulas.units.get(column.name, unit)
            if computed != unit:
                unit = display_unit = computed
        source = column.name if column.formula is None else ""
        return Column(title, unit, display_unit, column.is_path, source)

    def _notes(self, ambiguous: Iterable[str]) -> tuple[str, ...]:
        """Return what is to be known of the runs that were found."""
        notes = [
            f"{name} has several values in a run: any of them counts; write "
            f"max({name}) or min({name}), or {name}[…] for one of them"
            for name in sorted(ambiguous)
        ]
        unreadable = {} if self.formulas is None else self.formulas.unreadable
        if unreadable:
            first = next(iter(unreadable.values()))
            noun = "run" if len(unreadable) == 1 else "runs"
            notes.append(f"{len(unreadable)} {noun} could not be read: {first}")
        return tuple(notes)

    def _notes_of_conditions(self, names: set[str]) -> list[str]:
        """Return which runs have several torques or speeds, where one is asked for."""
        notes = []
        for quantity in ("torque", "speed"):
            for several in ("duty", "stage"):
                variable = f"{several}_{quantity}"
                is_asked = any(variable in name for name in names)
                if f"operation.{quantity}" not in names or is_asked:
                    continue
                ((count,),) = self.catalogue.read(
                    "SELECT count(*) FROM documents WHERE "
                    f"json_type(scene, '$.operation.{several}') = 'array'"
                )
                if count:
                    has = "run has" if count == 1 else "runs have"
                    notes.append(
                        f"{quantity}: {count} {has} operation.{several}, each "
                        f"condition its own, and {'is' if count == 1 else 'are'} not "
                        f"found by it: ask for max({variable}) or min({variable})"
                    )
        return notes

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

    def _matches(
        self, condition: BoundCondition | None, by: Key | FirstCycle | None, down: bool
    ) -> Matches:
        """Return number and id of the runs that meet a condition, in order."""
        runs = self.catalogue.read("SELECT number, id FROM runs ORDER BY number")
        names = [key.name for key in _keys_of(by)] if by else []
        several_values = []
        for key in condition.keys if condition else ():
            names.append(key.name)
            if key.any_value:
                several_values.append(key.name)
        whole = frozenset() if condition is None else condition.whole
        asked = {
            name: name + (ALL if name in whole else EVERY) for name in several_values
        }
        names += asked.values()

        ambiguous = set()
        known: list[tuple[Any, Run]] = []
        missing: list[tuple[Any, Run]] = []
        for run, values in zip(runs, self._values(names, runs), strict=True):
            for name, every in asked.items():
                if len(values.get(every) or ()) > 1:
                    ambiguous.add(name)
            if condition is None or condition.holds(values):
                rank = None if by is None else _rank(evaluate.value_of(by, values))
                (missing if rank is None else known).append((rank, run))
        known.sort(key=lambda pair: pair[0], reverse=down)
        in_order = [run for _, run in known + missing]
        return Matches(in_order, frozenset(ambiguous))

    def _values(
        self, names: Iterable[str], runs: Sequence[Run]
    ) -> Iterator[dict[str, Any]]:
        """Yield the values of names for each run.

        They are read for some thousand runs at once.
        """
        distinct_names = dict.fromkeys(names)
        for batch in database.batched(runs, self.at_once):
            read_columns = {name: self._column(name, batch) for name in distinct_names}
            columns = {
                name: values
                for name, values in read_columns.items()
                if values is not None
            }
            for place in range(len(batch)):
                yield {name: values[place] for name, values in columns.items()}
        if self.formulas is not None:
            try:
                self.formulas.refuse_unknown_places()
            except AmountError as error:
                text = str(error).partition(":")[0]
                raise QueryError(str(error), text, 0) from error

    def _column(self, name: str, runs: Sequence[Run]) -> list[Any] | None:
        """Return the value of a name for each of some runs.

        None where no run has any.
        """
        numbers, ids = zip(*runs, strict=True)
        formula = self.vocabulary.formulas.get(name)
        if name in self.in_files:
            formula = _formula(f"max({name})")
        if formula is not None and self.formulas is not None:
            try:
                return self.formulas.values(formula, ids)
            except AmountError as error:
                raise QueryError(str(error), name, 0) from error
        if name.endswith(ALL):
            return self._all_values(name.removesuffix(ALL), runs)
        if name.endswith(EVERY):
            return self._every_value(name.removesuffix(EVERY), runs)
        if name in (*OF_REMARKS, *OF_CAMPAIGNS, *self.axes):
            remarked = name in OF_REMARKS
            texts = (
                remarks.texts_of(self.catalogue, ids, name)
                if remarked
                else self._of_campaigns(name, ids)
            )
            return [texts.get(run_id, ()) for run_id in ids]
        question = QUESTIONS.get(name)
        if question is None:
            if name not in self.numbers:
                return None
            number = int(self.numbers[name])
            question = f"SELECT run, value FROM facts WHERE key = {number} AND run"
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

    def _every_value(
        self, name: str, runs: Sequence[Run]
    ) -> list[tuple[float, ...] | None] | None:
        """Return the values that a comparison asks, of a result with several values.

        The smallest and the largest at every wear state; None where no run has any.
        """
        if name + HISTORY not in self.numbers:
            return self._extremes(name, runs)
        histories = self._column(name + HISTORY, runs) or ()
        return [
            None if history is None else _finite(array("d", history))
            for history in histories
        ]

    def _all_values(
        self, name: str, runs: Sequence[Run]
    ) -> list[tuple[float, ...] | None] | None:
        """Return all values of a result, None where no run has any.

        They are read from files where what the catalogue keeps is not all.
        """
        kept = self._every_value(name, runs)
        if kept is None or self.formulas is None:
            return kept
        dims = set(self._dims(name))
        if name + HISTORY in self.numbers:
            dims.discard(description.LIFE)  # each state has extremes of its own
        entries = self.catalogue.entries((run_id for _, run_id in runs), "sizes")
        unread = [
            entry
            for entry in entries.values()
            if math.prod(entry.sizes.get(dim, 1) for dim in dims) > 2
        ]
        read = self.formulas.all_values(name, unread)
        values = []
        for (_, run_id), known in zip(runs, kept, strict=True):
            values.append(_finite(read[run_id]) if run_id in read else known)
        return values

    def _dims(self, name: str) -> tuple[str, ...]:
        """Return the dimensions of a result."""
        return (self.in_files.get(name) or self.vocabulary.keys[name]).dims

    def _extremes(
        self, name: str, runs: Sequence[Run]
    ) -> list[tuple[float, ...] | None] | None:
        """Return the smallest and the largest value of a result, of each run.

        The catalogue keeps the largest of most; the smallest is read from the files of
        those runs that have several.
        """
        largest = self._column(name, runs)
        if largest is None or self.formulas is None:
            return None
        dims = self._dims(name)
        entries = self.catalogue.entries((run_id for _, run_id in runs), "sizes")
        several = [
            run_id
            for run_id, entry in entries.items()
            if math.prod(entry.sizes.get(dim, 1) for dim in dims) > 1
        ]
        values = self.formulas.values(_formula(f"min({name})"), several)
        smallest = dict(zip(several, values, strict=True))
        extremes: list[tuple[float, ...] | None] = []
        for (_, run_id), value in zip(runs, largest, strict=True):
            numbers = [value, smallest.get(run_id)]
            extremes.append(_finite(n for n in numbers if n is not None))
        return extremes

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


def _formula(text: str) -> Key:
    """Return the key of a formula of results."""
    return Key(text, formula=parse_formula(text))


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


def _title(text: str, column: Key | FirstCycle) -> str:
    """Return what a column is called.

    Of a result with several values the largest stands there, and says so.
    """
    if isinstance(column, FirstCycle):
        return text
    if column.formula is not None:
        return column.name
    return f"max({column.name})" if column.dims else text


def _finite(values: Iterable[float]) -> tuple[float, ...] | None:
    """Return the distinct values that are numbers, None where there is none."""
    return tuple(dict.fromkeys(filter(math.isfinite, values))) or None
