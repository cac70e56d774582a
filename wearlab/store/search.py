"""Questions to the catalogue: what can be asked for, and the runs that meet a condition.

What a question names is read for all runs at once, one key after the other; the condition is then asked of
each run, by `wearlab.query.holds` as everywhere.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from wearlab.query import Key, QueryError, Vocabulary, evaluate, grammar, holds, read_column, read_condition
from wearlab.store import catalogue, database
from wearlab.store.table import Column, Table
from wearlab.units import KINDS, split

__all__ = ["CatalogueSearch", "QueryError"]

COLUMNS = {
    **{"id": "id", "status": "state", "started": "started", "seconds": "seconds", "bytes": "size"},
    **{"source_hash": "source_hash", "wearlab_version": "wearlab_version"},
}
DOCUMENTS = ("reason", "warnings")
OF_CAMPAIGNS = ("campaign", "case")
OTHER_CODE = "other_code"
OWN_KEYS = (
    *(Key(name, "text") for name in ("id", "status", "source_hash", "wearlab_version")),
    *(Key(name, "text") for name in (*DOCUMENTS, *OF_CAMPAIGNS)),
    *(Key("started", "date"), Key("seconds", unit="s", display_unit="s"), Key("bytes"), Key(OTHER_CODE)),
)
ALIASES = {
    **{"state": "status", "date": "started", "run_time": "seconds", "run": "id", "code": "source_hash"},
    **{"life_hours": "service_life", "hours_of_life": "service_life", "hours": "operating_hours"},
    **{"torque": "operation.torque", "speed": "operation.speed"},  # not those of a duty or a calibration
}


class CatalogueSearch:
    """Asks one catalogue.

    Parameters
    ----------
    catalogue : where the runs are
    """

    def __init__(self, catalogue: catalogue.Catalogue) -> None:
        self.catalogue = catalogue
        rows = catalogue.read("SELECT name, number, source, kind, unit, quantity, display_unit FROM keys")
        self.numbers = {row[0]: row[1] for row in rows}
        own = [row for row in rows if row[3] != "history"]
        keys = [database.understood("a key in the catalogue", _key, row[0], *row[2:]) for row in own]
        named = [replace(key, history=key.name + evaluate.HISTORY in self.numbers) for key in keys]
        self.axes: set[str] = set()
        self.vocabulary = Vocabulary([*named, *OWN_KEYS], ALIASES, self._elsewhere)

    def _elsewhere(self, name: str) -> Key | str | None:
        """Return the key of a result or a scene's value that no run here has, or of a campaign's axis."""
        from wearlab.query import keys

        if (declared := keys.declared_key(name) or keys.declared_scene_key(name)) is not None:
            return declared
        if not any(name in member.position for member in self.catalogue.members()):
            return None
        self.axes.add(name)
        return Key(name, "text")

    def table(self, where: str, columns: Sequence[str] | None, sort: str | None, limit: int | None) -> Table:
        """Return the runs that meet a condition.

        Parameters
        ----------
        where : condition; empty: all runs
        columns : names or ``first_cycle(…)`` beside id and status [what the condition names]
        sort : a column; a minus sign before it turns the order; what is missing comes last
        limit : at most so many rows

        Raises
        ------
        QueryError : a name is unknown or a value does not fit; the message points at the place
        """
        condition = read_condition(where, self.vocabulary) if where.strip() else None
        asked = [(text, read_column(text, self.vocabulary)) for text in columns or ()]
        named = keys_of(condition)
        if columns is None:
            asked = [(key.name, key) for key in named if not key.name.endswith(evaluate.HISTORY)]
        by = read_column(sort.lstrip("-"), self.vocabulary) if sort else None
        first = [(name, self.vocabulary.keys[name]) for name in ("id", "status")]
        shown = dict(first + asked)
        named += [key for operand in (*shown.values(), by) for key in keys_of(operand)]
        runs = self._values(dict.fromkeys(key.name for key in named))
        found = [run for run in runs if condition is None or holds(condition, run)]
        if by is not None:
            found = _sorted(found, by, sort or "")
        heads = tuple(_column(text, column) for text, column in shown.items())
        return Table(
            heads,
            [
                tuple(_cell(evaluate.value_of(column, run)) for column in shown.values())
                for run in found[:limit]
            ],
        )

    def _values(self, names: Iterable[str]) -> list[dict[str, Any]]:
        """Return the values of these names for every run, in the order in which they were begun."""
        numbers = self.catalogue.read("SELECT number, id FROM runs ORDER BY number")
        columns: list[tuple[str, Callable[[int, str], Any]]] = []
        for name in names:
            if name in COLUMNS:
                columns.append((name, _by_number(self._rows(f"SELECT number, {COLUMNS[name]} FROM runs"))))
            elif name in DOCUMENTS:
                columns.append((name, _by_number(self._rows(f"SELECT number, {name} FROM documents"))))
            elif name == OTHER_CODE:
                columns.append((name, _by_number(self._other_code())))
            elif name in OF_CAMPAIGNS or name in self.axes:
                columns.append((name, _by_id(self._of_campaigns(name))))
            elif name in self.numbers:
                facts = f"SELECT run, value FROM facts WHERE key = {int(self.numbers[name])}"
                columns.append((name, _by_number(self._rows(facts))))
        return [{name: value(number, run_id) for name, value in columns} for number, run_id in numbers]

    def _rows(self, question: str) -> dict[int, Any]:
        return dict(self.catalogue.read(question))

    def _other_code(self) -> dict[int, bool | None]:
        """Return whether runs were made by other code than the present, where that is known."""
        from wearlab.sources import present_hashes

        known = present_hashes()
        rows = self._rows("SELECT number, source_hash FROM runs")
        return {number: source not in known if source else None for number, source in rows.items()}

    def _of_campaigns(self, name: str) -> dict[str, tuple[str, ...]]:
        """Return what campaigns say of each run: their titles, its labels, or its places on an axis."""
        told: dict[str, dict[str, None]] = {}
        for member in self.catalogue.members():
            of = {"campaign": member.campaign, "case": member.label}
            value = of[name] if name in of else member.position.get(name)
            if value is not None:
                told.setdefault(member.run, {})[str(value)] = None
        return {run: tuple(values) for run, values in told.items()}


def _by_number(values: Mapping[int, Any]) -> Callable[[int, str], Any]:
    return lambda number, run_id: values.get(number)


def _by_id(values: Mapping[str, tuple[str, ...]]) -> Callable[[int, str], Any]:
    return lambda number, run_id: values.get(run_id, ())


def _key(name: Any, source: Any, kind: Any, unit: Any, quantity: Any, shown: Any) -> Key:
    """Return a key as the catalogue tells it, which anybody may have written."""
    if not all(isinstance(text, str) for text in (name, kind, unit, shown)):
        raise TypeError(f"{str(name)[:20]!r} is not told in words")
    if quantity is not None and quantity not in KINDS:
        raise ValueError(f"{str(quantity)[:20]!r} is no quantity")
    return Key(name, kind, unit, quantity, shown, source == "scene")


def keys_of(tree: Any) -> list[Key]:
    """Return the keys that a condition or a column names, each once; histories marked by their names."""
    match tree:
        case grammar.All(conditions) | grammar.Some(conditions):
            names = [key for condition in conditions for key in keys_of(condition)]
        case grammar.Not(inner) | grammar.Missing(inner):
            names = keys_of(inner)
        case grammar.FirstCycle(grammar.Compare(_, left, _)):
            names = [left, Key(left.name + evaluate.HISTORY), Key(evaluate.CYCLE + evaluate.HISTORY)]
        case grammar.Compare(_, left, right):
            names = keys_of(left) + keys_of(right)
        case Key():
            names = [tree]
        case _:
            names = []
    return list(dict.fromkeys(names))


def _sorted(runs: list[dict[str, Any]], by: Any, sort: str) -> list[dict[str, Any]]:
    """Return runs in the order of a column; equal ones stay as they are."""
    ranked = [(_rank(evaluate.value_of(by, run)), run) for run in runs]
    known = [(rank, run) for rank, run in ranked if rank is not None]
    known.sort(key=lambda pair: pair[0], reverse=sort.startswith("-"))
    return [run for _, run in known] + [run for rank, run in ranked if rank is None]


def _rank(value: Any) -> tuple[bool, Any, str] | None:
    """Return what a value is sorted by: numbers before texts; values of an axis by their number."""
    if isinstance(value, tuple):
        value = value[0] if value else None
        with_number = _number_of(value)
        return None if value is None else (with_number is None, with_number or 0.0, value)
    if value is None:
        return None
    return (True, 0.0, value) if isinstance(value, str) else (False, value, "")


def _number_of(text: str | None) -> float | None:
    """Return the number of a quantity with its unit, None of any other text."""
    try:
        return float(split(text or "")[0])
    except ValueError:
        return None


def _cell(value: Any) -> Any:
    return (",".join(value) or None) if isinstance(value, tuple) else value


def _column(text: str, column: Any) -> Column:
    if isinstance(column, grammar.FirstCycle):
        return Column(text)
    return Column(text, column.unit, column.display_unit, column.is_path)
