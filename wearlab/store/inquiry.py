"""A bound condition as SQL, in which every value is a parameter."""

from collections.abc import Collection, Mapping
from typing import Any

from wearlab.query import Key
from wearlab.query.digits import edges
from wearlab.query.grammar import DAY, All, Compare, FirstCycle, Literal, Missing, Not, Some
from wearlab.store.errors import StoreError
from wearlab.store.facts import CYCLE, MARKS
from wearlab.store.walks import SIGNS, Walk, parts_of

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
MOST_JOINS = 50


class Inquiry:
    """One condition as SQL: tests of values joined to each run; every value is a numbered parameter.

    Parameters
    ----------
    condition : bound, None: all runs
    walk : the way through the runs
    numbers : those of the catalogue's keys, by name
    axes : of campaigns, that the condition names
    """

    def __init__(
        self, condition: Any, walk: Walk, numbers: Mapping[str, int], axes: Collection[str] = ()
    ) -> None:
        self.walk, self.numbers, self.axes = walk, numbers, axes
        self.values: tuple[Any, ...] = ()
        self.joins: dict[int, str] = {}
        self.run = "r.number" if walk.key is None else "d.run"
        tests = []
        if walk.key is not None:
            tests.append(f"d.key = {numbers[walk.key]}")
        if walk.driver is not None:
            tests.append(self.beside("d.value", walk.driver.sign, walk.driver.right.value))
        self.walked = " AND ".join(tests)
        tests += [self.condition(part) for part in parts_of(condition) if part is not walk.driver]
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
        """Return the test of a condition."""
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
        """Return the test of two operands, or of what campaigns say of the run."""
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
        if name in self.axes:
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
        number = self.numbers.get(name)
        if number is None:
            return "NULL"
        return f"(SELECT value FROM facts WHERE key = {number} AND run = {self.run})"

    def _fact(self, name: str) -> str:
        number = self.numbers.get(name)
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
        if isinstance(operand, Key) and operand.name in self.axes:  # a number with its unit
            return f"{value} IS NULL, CAST({value} AS REAL){down}, {value}{down}, {self.run}"
        return f"{value}{down}{last}, {self.run}"


def edge(sign: str, value: float) -> float:
    """Return the number beyond which, by one of < <= > >=, values are as conditions mean it."""
    low, high = edges(value)
    return low if sign in ("<", ">=") else high


def _is_number(value: Any) -> bool:
    return isinstance(value, float | int) and not isinstance(value, bool)
