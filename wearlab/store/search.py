"""Questions to the catalogue: what can be asked for, and the quickest way to the answer."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from wearlab.query import Key, QueryError, Vocabulary, read_column, read_condition
from wearlab.query.evaluate import compared
from wearlab.query.grammar import All, Compare, FirstCycle, Missing, Not, Some
from wearlab.store.database import Database
from wearlab.store.facts import MARKS, first_cycle
from wearlab.store.inquiry import DOCUMENTS, MEMBERS, OF_AXES, OTHER_CODE, Inquiry
from wearlab.store.rows import understood
from wearlab.store.table import Column, Table
from wearlab.store.walks import Walk, walkable
from wearlab.units import KINDS

__all__ = ["CatalogueSearch", "QueryError"]

OWN_KEYS = (
    *(Key(name, "text") for name in ("id", "status", "source_hash", "wearlab_version")),
    *(Key(name, "text") for name in (*DOCUMENTS, *MEMBERS)),
    *(Key("started", "date"), Key("seconds", unit="s", display_unit="s"), Key("bytes"), Key(OTHER_CODE)),
)
ALIASES = {
    **{"state": "status", "date": "started", "run_time": "seconds", "run": "id", "code": "source_hash"},
    **{"life_hours": "service_life", "hours_of_life": "service_life", "hours": "operating_hours"},
    **{"torque": "operation.torque", "speed": "operation.speed"},  # not those of a duty or a calibration
}
MANY = 5_000  # runs from which values that are asked for get an index
FEW = 0.2  # share of the runs up to which an index is the quicker way to them
COUNTED = 20_000  # runs that are counted to choose a way


class CatalogueSearch:
    """Asks one catalogue.

    Parameters
    ----------
    catalogue : where the runs are
    """

    def __init__(self, catalogue: Database) -> None:
        self.catalogue = catalogue
        rows = catalogue.read("SELECT number, name, source, kind, unit, quantity, display_unit FROM keys")
        self.numbers = {row[1]: row[0] for row in rows}
        self.runs = int(catalogue.read("SELECT coalesce(max(number), 0) FROM runs")[0][0])
        keys = [understood("a key in the catalogue", _key, *row[1:]) for row in rows]
        named = [
            replace(key, history=key.name + MARKS["history"] in self.numbers)
            for key in keys
            if key.kind not in MARKS
        ]
        self.axes: set[str] = set()
        self.vocabulary = Vocabulary([*named, *OWN_KEYS], ALIASES, self._elsewhere)
        catalogue.teach("first_cycle", 5, first_cycle)
        catalogue.teach("met", 3, _met)

    def _elsewhere(self, name: str) -> Key | str | None:
        """Return the key of a result or a scene's value that no run here has, or of a campaign's axis."""
        from wearlab.query.result_keys import declared_key
        from wearlab.query.scene_keys import declared_scene_key

        if (declared := declared_key(name) or declared_scene_key(name)) is not None:
            return declared
        if not self.catalogue.read(f"SELECT 1 {OF_AXES} WHERE j.key = ? LIMIT 1", (name,)):
            return None
        self.axes.add(name)
        return Key(name, "text")

    def table(self, where: str, columns: Sequence[str] | None, sort: str | None, limit: int | None) -> Table:
        """Return the runs that meet a condition.

        Parameters
        ----------
        where : condition; empty: all runs
        columns : names or ``first_cycle(…)`` beside id and status [what the condition names]
        sort : a column; a minus sign before it turns the order
        limit : at most so many rows

        Raises
        ------
        QueryError : a name is unknown or a value does not fit; the message points at the place
        """
        condition = read_condition(where, self.vocabulary) if where.strip() else None
        asked = [(text, read_column(text, self.vocabulary)) for text in columns or ()]
        if columns is None:
            asked = [(key.name, key) for key in _named(condition)]
        first = [(name, self.vocabulary.keys[name]) for name in ("id", "status")]
        shown = dict(first + asked)
        by = read_column(sort.lstrip("-"), self.vocabulary) if sort else None
        heads = tuple(_column(text, column) for text, column in shown.items())
        for walk in self._walks(condition, by, limit):
            question = Inquiry(condition, walk, self.numbers, self.axes)
            wanted = ", ".join(question.value(column) for column in shown.values())
            order = question.order(by, sort) if sort else question.run
            tail = " LIMIT ?" if limit is not None else ""
            text = f"SELECT {wanted} {question.source} ORDER BY {order}{tail}"
            values = (*question.values, *(() if limit is None else (limit,)))
            rows = self.catalogue.read(text, values)
            if not walk.leaves_out or len(rows) == limit:
                break
        return Table(heads, rows)

    def _walks(self, condition: Any, by: Any, limit: int | None) -> Iterator[Walk]:
        """Yield the ways to go through the runs, the quickest first; the last finds all of them.

        Through the values of the key that a condition restricts most, or, for a few of many in the order of a
        key, along that order, until as many meet the condition; runs without that key come after all others.
        """
        fitting = walkable(condition, self.numbers)
        met = {id(row): self._met(row) for row in fitting}
        driver = min(fitting, key=lambda part: met[id(part)], default=None)
        share = min(1.0, met[id(driver)] / max(1, self.runs)) if driver is not None else 1.0
        named = by.name if isinstance(by, Key) and by.name in self.numbers else None
        if named and limit is not None and limit < share * share * self.runs:
            if index := self.index(named):
                yield Walk(named, index, None)
        if driver is None:
            yield Walk(None, None, None)
        else:
            yield Walk(driver.left.name, self.index(driver.left.name) if share < FEW else None, driver)

    def index(self, name: str) -> str | None:
        """Return the index of a key's values, made where many runs have none yet; None: there is none."""
        number = self.numbers[name]
        index = f"by_value_{number}"
        of = f"facts (value) WHERE key = {number}"
        return index if self.runs >= MANY and self.catalogue.has_index(index, of) else None

    def _met(self, comparison: Compare) -> int:
        """Return how many runs meet a comparison, or `COUNTED`; of few runs as if all did."""
        index = self.index(comparison.left.name)
        if index is None:
            return self.runs
        question = Inquiry(comparison, Walk(comparison.left.name, index, comparison), self.numbers)
        counted = f"SELECT count(*) FROM (SELECT 1 {question.facts} LIMIT {COUNTED})"
        return int(self.catalogue.read(counted, question.values)[0][0])


def _key(name: Any, source: Any, kind: Any, unit: Any, quantity: Any, shown: Any) -> Key:
    """Return a key as the catalogue tells it, which may be a stranger's."""
    if not all(isinstance(text, str) for text in (name, kind, unit, shown)):
        raise TypeError(f"{str(name)[:20]!r} is not told in words")
    if quantity is not None and quantity not in KINDS:
        raise ValueError(f"{str(quantity)[:20]!r} is no quantity")
    return Key(name, kind, unit, quantity, shown, source == "scene")


def _met(sign: str, left: Any, right: Any) -> bool | None:
    """Return a comparison of two stored values for SQL, None where one is missing."""
    if left is None or right is None:
        return None
    return compared({"<>": "!="}.get(sign, sign), left, right)


def _named(tree: Any) -> list[Key]:
    """Return the keys that a condition names, each once."""
    match tree:
        case All(conditions) | Some(conditions):
            names = [key for condition in conditions for key in _named(condition)]
        case Not(inner):
            names = _named(inner)
        case Missing(operand):
            names = _named(operand)
        case Compare(_, left, right):
            names = _named(left) + _named(right)
        case FirstCycle(inner):
            names = _named(inner)
        case Key():
            names = [tree]
        case _:
            names = []
    return list(dict.fromkeys(names))


def _column(text: str, column: Any) -> Column:
    if isinstance(column, FirstCycle):
        return Column(text)
    return Column(text, column.unit, column.display_unit, column.is_path)
