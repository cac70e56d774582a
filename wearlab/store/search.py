"""Questions to the catalogue: a bound condition becomes SQL in which every value is a parameter."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from wearlab.query import Key, QueryError, Vocabulary, read_column, read_condition
from wearlab.query.digits import edges
from wearlab.query.evaluate import compared
from wearlab.query.grammar import DAY, All, Compare, FirstCycle, Literal, Missing, Not, Some
from wearlab.store.database import Database
from wearlab.store.errors import StoreError
from wearlab.store.facts import CYCLE, MARKS, first_cycle
from wearlab.store.rows import understood
from wearlab.store.table import Column, Table
from wearlab.units import KINDS

COLUMNS = {
    "id": "r.id",
    "status": "r.state",
    "started": "r.started",
    "seconds": "r.seconds",
    "bytes": "r.size",
    "source_hash": "r.source_hash",
    "wearlab_version": "r.wearlab_version",
}
DOCUMENTS = ("reason", "warnings")
MEMBERS = {"campaign": "title", "case": "label"}
OF_MEMBERS = "SELECT m.run FROM members AS m JOIN campaigns AS c ON m.campaign = c.key"
OF_AXES = "FROM members AS m, json_each(m.position) AS j"
OTHER_CODE = "other_code"
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
MOST_JOINS = 50
ROUNDING = 1e-9  # relative, far above that of an interpolated cycle
SIGNS = {"<": "<", "<=": "<=", ">": ">", ">=": ">=", "=": "=", "!=": "<>"}


class Walk(NamedTuple):
    """A way through the runs: all of them, or through the values of a key.

    Parameters
    ----------
    key : whose values are gone through, None: none
    order : the index by which they are found in order
    driver : the comparison with which that key is restricted
    """

    key: str | None
    order: str | None
    driver: Compare | None

    @property
    def leaves_out(self) -> bool:
        """Whether runs without the key, which a question may ask for, are not found."""
        return self.key is not None and self.driver is None


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
            question = _Question(self, condition, walk)
            wanted = ", ".join(question.value(column) for column in shown.values())
            order = question.order(by, sort) if sort else question.run
            tail = " LIMIT ?" if limit is not None else ""
            text = f"SELECT {wanted} {question.source} ORDER BY {order}{tail}"
            values = (*question.values, *(() if limit is None else (limit,)))
            rows = self.catalogue.read(text, values)
            if not walk.leaves_out or len(rows) == limit:
                break
        return Table(heads, rows)

    def _walks(self, condition: Any, by: Any, limit: int | None) -> Iterator["Walk"]:
        """Yield the ways to go through the runs, the quickest first; the last finds all of them.

        Through the values of the key that a condition restricts most, or, for a few of many in the order of a
        key, along that order, until as many meet the condition; runs without that key come after all others.
        """
        fitting = _walkable(condition, self)
        met = {id(row): self._met(row) for row in fitting}
        driver = min(fitting, key=lambda one: met[id(one)], default=None)
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

    def _met(self, one: Compare) -> int:
        """Return how many runs meet a comparison, or `COUNTED`; of few runs as if all did."""
        index = self.index(one.left.name)
        if index is None:
            return self.runs
        question = _Question(self, one, Walk(one.left.name, index, one))
        counted = f"SELECT count(*) FROM (SELECT 1 {question.facts} LIMIT {COUNTED})"
        return int(self.catalogue.read(counted, question.values)[0][0])


def _key(name: Any, source: Any, kind: Any, unit: Any, quantity: Any, shown: Any) -> Key:
    """Return a key as the catalogue tells it, which may be a stranger's."""
    if not all(isinstance(text, str) for text in (name, kind, unit, shown)):
        raise TypeError(f"{str(name)[:20]!r} is not told in words")
    if quantity is not None and quantity not in KINDS:
        raise ValueError(f"{str(quantity)[:20]!r} is no quantity")
    return Key(name, kind, unit, quantity, shown, source == "scene")


class _Question:
    """One condition as SQL: tests of values joined to each run; every value is a numbered parameter."""

    def __init__(self, search: CatalogueSearch, condition: Any, walk: "Walk") -> None:
        self.search, self.walk = search, walk
        self.values: tuple[Any, ...] = ()
        self.joins: dict[int, str] = {}
        self.run = "r.number" if walk.key is None else "d.run"
        tests = []
        if walk.key is not None:
            tests.append(f"d.key = {search.numbers[walk.key]}")
        if walk.driver is not None:
            tests.append(self.beside("d.value", walk.driver.sign, walk.driver.right.value))
        self.walked = " AND ".join(tests)
        tests += [self.condition(part) for part in _parts(condition) if part is not walk.driver]
        self.where = " AND ".join(tests)

    @property
    def source(self) -> str:
        """Where the rows come from, once every value is joined."""
        facts = " ".join(
            f"LEFT JOIN facts AS {name} ON {name}.key = {key} AND {name}.run = {self.run}"
            for key, name in self.joins.items()
        )
        if len(self.joins) > MOST_JOINS:
            raise StoreError(f"{len(self.joins)} different values in one question, more than {MOST_JOINS}")
        last = f"CROSS JOIN runs AS r ON r.number = {self.run}"
        tables = f"runs AS r {facts}" if self.walk.key is None else f"{self._walked_facts} {facts} {last}"
        return f"FROM {tables}{f' WHERE {self.where}' if self.where else ''}"

    @property
    def facts(self) -> str:
        """Where the facts that are walked through come from."""
        return f"FROM {self._walked_facts} WHERE {self.walked}"

    @property
    def _walked_facts(self) -> str:
        return f"facts AS d{f' INDEXED BY {self.walk.order}' if self.walk.order else ''}"

    def mark(self, value: Any) -> str:
        """Return the mark of a parameter."""
        self.values += (value,)
        return f"?{len(self.values)}"

    def condition(self, tree: Any) -> str:
        match tree:
            case All(conditions):
                return f"({' AND '.join(self.condition(condition) for condition in conditions)})"
            case Some(conditions):
                return f"({' OR '.join(self.condition(condition) for condition in conditions)})"
            case Not(inner):
                return f"(NOT {self.condition(inner)})"
            case Missing(Key(name)) if name in MEMBERS:
                return "(r.id NOT IN (SELECT run FROM members))"
            case Missing(operand):
                return f"({self.value(operand)} IS NULL)"
            case Compare():
                return self.comparison(tree)
        raise AssertionError(tree)

    def comparison(self, tree: Compare) -> str:
        left = tree.left
        if isinstance(left, Key) and left.name in MEMBERS:
            return f"(r.id IN ({OF_MEMBERS} WHERE {self._test(tree.sign, MEMBERS[left.name], tree.right)}))"
        return self._test(tree.sign, self.value(left), tree.right)

    def _test(self, sign: str, left: str, right: Any) -> str:
        if not isinstance(right, Literal):
            text = isinstance(right, Key) and right.kind != "number"
            other = self.value(right)
            return f"({left} {SIGNS[sign]} {other})" if text else f"met('{SIGNS[sign]}', {left}, {other})"
        if sign == "contains":
            return f"(instr(lower({left}), lower({self.mark(right.value)})) > 0)"
        if right.is_day:
            left = f"substr({left}, 1, {DAY})"
        return f"({self.beside(left, sign, right.value)})"

    def beside(self, left: str, sign: str, value: Any) -> str:
        """Return the test of an expression against a value; a number stands for all that equal it."""
        if not _is_number(value):
            return f"{left} {SIGNS[sign]} {self.mark(value)}"
        low, high = edges(value)
        if sign in ("=", "!="):
            return f"{left} {'NOT ' * (sign == '!=')}BETWEEN {self.mark(low)} AND {self.mark(high)}"
        return f"{left} {SIGNS[sign]} {self.mark(edge(sign, value))}"

    def value(self, operand: Any) -> str:
        """Return the expression of a key's value, or of a first cycle, for the run ``r``."""
        if isinstance(operand, FirstCycle):
            return self._first_cycle(operand.condition)
        name = operand.name
        if name in COLUMNS:
            return COLUMNS[name]
        if name in DOCUMENTS:
            return f"(SELECT {name} FROM documents AS o WHERE o.number = r.number)"
        if name in MEMBERS:
            return (
                f"(SELECT group_concat(DISTINCT {MEMBERS[name]}) FROM members AS m "
                "JOIN campaigns AS c ON m.campaign = c.key WHERE m.run = r.id)"
            )
        if name == OTHER_CODE:
            from wearlab.sources import present_hashes

            known = ", ".join(self.mark(known_hash) for known_hash in present_hashes())
            return f"(nullif(r.source_hash, '') NOT IN ({known}))"
        if name in self.search.axes:
            on_axis = f"{OF_AXES} WHERE m.run = r.id AND j.key = {self.mark(name)}"
            return f"(SELECT group_concat(DISTINCT j.value) {on_axis})"
        return self._fact(name)

    def _first_cycle(self, inner: Compare) -> str:
        """Return the expression of a first cycle; where the largest value tells that there is none, NULL."""
        history, cycle = (self._looked_up(name + MARKS["history"]) for name in (inner.left.name, CYCLE))
        sign, limit = self.mark(inner.sign), self.mark(inner.right.value)
        beyond = self.mark(edge(inner.sign, inner.right.value))
        expression = f"first_cycle({sign}, {limit}, {history}, {cycle}, {beyond})"
        if inner.sign not in (">", ">="):
            return expression
        return f"(CASE WHEN {self._fact(inner.left.name)} {SIGNS[inner.sign]} {beyond} THEN {expression} END)"

    def _looked_up(self, name: str) -> str:
        """Return the expression of a value that is read only where it is needed."""
        number = self.search.numbers.get(name)
        if number is None:
            return "NULL"
        return f"(SELECT value FROM facts WHERE key = {number} AND run = {self.run})"

    def _fact(self, name: str) -> str:
        number = self.search.numbers.get(name)
        if number is None:
            return "NULL"
        if name == self.walk.key:
            return "d.value"
        return f"{self.joins.setdefault(number, f'f{len(self.joins)}')}.value"

    def order(self, operand: Any, text: str) -> str:
        """Return how rows are sorted: what is missing comes last."""
        down = " DESC" if text.startswith("-") else ""
        last = "" if self.walk.leaves_out else " NULLS LAST"
        value = self.value(operand)
        if isinstance(operand, Key) and operand.name in self.search.axes:  # a number with its unit
            return f"{value} IS NULL, CAST({value} AS REAL){down}, {value}{down}, {self.run}"
        return f"{value}{down}{last}, {self.run}"


def _walkable(condition: Any, search: CatalogueSearch) -> list[Compare]:
    """Return the comparisons of which one must be walked through to meet a condition."""
    parts = _parts(condition)
    return [part for part in parts if _is_walkable(part, search)]


def _parts(condition: Any) -> list[Any]:
    """Return what must hold, each by itself, for a condition."""
    parts = list(condition.conditions) if isinstance(condition, All) else [condition] if condition else []
    return parts + [key for whole in parts for key in _needed(whole)]


def _needed(whole: Any) -> Iterator[Compare]:
    """Yield what must hold for a comparison of a first cycle above a limit, and is quicker to look up.

    The largest value is above the limit; if that is to happen early, the largest rate is high enough.
    """
    if not (isinstance(whole, Compare) and isinstance(whole.left, FirstCycle)):
        return
    inner = whole.left.condition
    if inner.sign not in (">", ">="):
        return
    yield inner
    early = isinstance(whole.right, Literal) and whole.sign in ("<", "<=")
    last, limit = float(whole.right.value) if early else 0.0, inner.right.value
    if last > 0.0 and limit > 0.0:
        rate = limit / last * (1.0 - ROUNDING)
        yield Compare(">", Key(inner.left.name + MARKS["rate"]), Literal(rate, inner.right.at))


def _is_walkable(one: Any, search: CatalogueSearch) -> bool:
    return (
        isinstance(one, Compare)
        and isinstance(one.left, Key)
        and isinstance(one.right, Literal)
        and not one.right.is_date
        and one.sign in SIGNS
        and one.left.name in search.numbers
    )


def edge(sign: str, value: float) -> float:
    """Return the number beyond which, by one of < <= > >=, values are as conditions mean it."""
    low, high = edges(value)
    return low if sign in ("<", ">=") else high


def _is_number(value: Any) -> bool:
    return isinstance(value, float | int) and not isinstance(value, bool)


def _met(sign: str, one: Any, other: Any) -> bool | None:
    """Return a comparison of two stored values for SQL, None where one is missing."""
    if one is None or other is None:
        return None
    return compared({"<>": "!="}.get(sign, sign), one, other)


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


__all__ = ["CatalogueSearch", "QueryError"]
