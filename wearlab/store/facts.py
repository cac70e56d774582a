"""What can be asked of runs: every value of their scenes and results, by key; written beside each run."""

import json
import operator
import sqlite3
from array import array
from collections.abc import Iterator, Mapping
from math import inf
from typing import Any

from wearlab.query.flat import flat

LONGEST = 200  # characters of a text that can be asked for
CYCLE = "cycle"
MARKS = {"history": "()", "rate": "'"}  # after the name of a variable: all its values; its largest rate
SIGNS = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}
Fact = tuple[str, str, Any]  # source, name, value


class Facts:
    """Writes facts; knows the numbers of the keys it has met."""

    def __init__(self) -> None:
        self._numbers: dict[tuple[str, str], tuple[int, str]] = {}

    def write(self, connection: sqlite3.Connection, run: int, facts: Iterator[Fact]) -> None:
        """Write the facts of one run, within a transaction."""
        rows = []
        for source, name, value in facts:
            kind = source if source in MARKS else "text" if isinstance(value, str) else "number"
            number, known = self._number(connection, source, name, kind)
            rows.append((number, run, value if known == kind else str(value)))
        connection.executemany("INSERT OR REPLACE INTO facts VALUES (?, ?, ?)", rows)

    def forget(self, connection: sqlite3.Connection, runs: list[int]) -> None:
        """Remove the facts of runs, within a transaction."""
        keys = [row[0] for row in connection.execute("SELECT number FROM keys")]
        connection.executemany(
            "DELETE FROM facts WHERE key = ? AND run = ?", ((key, run) for key in keys for run in runs)
        )

    def add_rates(self, connection: sqlite3.Connection) -> None:
        """Write the largest rate of every history of a catalogue that has none, within a transaction."""
        keys = dict(connection.execute("SELECT name, number FROM keys WHERE kind = 'history'").fetchall())
        cycle = keys.pop(CYCLE + MARKS["history"], 0)
        connection.create_function("largest_rate", 2, largest_rate, deterministic=True)
        for stored, history in keys.items():
            rate, _ = self._number(connection, "rate", stored.removesuffix(MARKS["history"]), "rate")
            connection.execute(
                "INSERT OR REPLACE INTO facts SELECT ?2, h.run, largest_rate(h.value, c.value) "
                "FROM facts AS h JOIN facts AS c ON c.run = h.run AND c.key = ?3 WHERE h.key = ?1",
                (history, rate, cycle),
            )

    def clear(self) -> None:
        """Forget the numbers of keys, where a transaction was given up or the tables were emptied."""
        self._numbers.clear()

    def _number(self, connection: sqlite3.Connection, source: str, name: str, kind: str) -> tuple[int, str]:
        """Return the number of a key and its kind; histories and rates stand beside the value so named."""
        stored = name + MARKS.get(kind, "")
        number = self._numbers.get((source, stored))
        if number is None:
            from wearlab.query.result_keys import key_of

            key = key_of(name, source, kind)
            connection.execute(
                "INSERT OR IGNORE INTO keys (name, source, kind, unit, quantity, display_unit) "
                "VALUES (?, ?, ?, ?, ?, ?)",
                (stored, source, kind, key.unit, key.quantity, key.display_unit),
            )
            number = connection.execute("SELECT number, kind FROM keys WHERE name = ?", (stored,)).fetchone()
            self._numbers[source, stored] = number
        return number


def facts_of(scene: str, summary: Mapping[str, Any], histories: Mapping[str, bytes]) -> Iterator[Fact]:
    """Yield every fact of a run: values of its scene, scalar results, and values along its life.

    Parameters
    ----------
    scene : canonical JSON
    summary : results by name
    histories : per variable its values at all wear states, the lower ones first where there are two of each
    """
    taken = set()
    for name, value in flat(json.loads(scene or "{}")):
        taken.add(name)
        yield from _fact("scene", name, value)
    for name, value in summary.items():
        if name not in taken:
            yield from _fact("result", name, value)
    for name, values in histories.items():
        yield "history", name, values
        if name != CYCLE and CYCLE in histories:
            yield "rate", name, largest_rate(values, histories[CYCLE])


def _fact(source: str, name: str, value: Any) -> Iterator[Fact]:
    if isinstance(value, bool):
        yield source, name, int(value)
    elif isinstance(value, int | float) or (isinstance(value, str) and len(value) <= LONGEST):
        yield source, name, value


def largest_rate(values: bytes, cycles: bytes) -> float:
    """Return the largest x/N along a history x(N) [1/cycle], ∞ where it begins above 0.

    Straight lines between states stay below x = rate N, so that x > L > 0 is first met at N ≥ L/rate.

    Parameters
    ----------
    values, cycles : as the catalogue keeps them
    """
    at = array("d", cycles)
    line = array("d", values)[-len(at) :]
    rates = (x / n if n > 0.0 else inf for x, n in zip(line, at, strict=False) if x > 0.0)
    return max(rates, default=0.0)


def first_cycle(
    sign: str, limit: float, values: bytes | None, cycles: bytes | None, edge: float | None = None
) -> float | None:
    """Return the first cycle at which a history is beyond a limit, None when it never is.

    Between two wear states the history is taken as a straight line over cycles. Where it has several values
    at a state (flanks, meshes), the one that comes first counts.

    Parameters
    ----------
    sign : one of < <= > >=
    limit : where the line is cut [SI]
    values, cycles : as the catalogue keeps them
    edge : beyond which a value counts as beyond the limit, to the digits of identity [limit]
    """
    if values is None or cycles is None:
        return None
    at, line = array("d", cycles), array("d", values)
    count = len(at)
    if len(line) != count:
        line = line[count:] if sign[0] == ">" else line[:count]
    is_beyond = SIGNS[sign]
    for i, value in enumerate(line):
        if is_beyond(value, limit if edge is None else edge):
            below = line[i - 1]
            if i == 0 or below != below or value == below:
                return at[i]
            share = min(max((limit - below) / (value - below), 0.0), 1.0)
            return at[i - 1] + share * (at[i] - at[i - 1])
    return None
