"""Tables that are laid over each other, key by key, and paths within them."""

from collections.abc import Iterator, Mapping
from typing import Any

from wearlab.nearest import meant
from wearlab.scene.sections import MEMBERS, Path, choice_of, chooser_at, parts_at

Table = dict[str, Any]


class DropError(ValueError):
    """A path to be dropped is not there."""


def merge(base: Table, over: Table, path: Path = ()) -> Table:
    """Return ``over`` over ``base``, neither of which is changed.

    Tables merge key by key; lists and values replace; another ``model`` replaces its
    table, save members' tables with a model of their own; one of several alternatives
    (``damping``, ``damping_ratio``) drops the others.

    Parameters
    ----------
    base, over : tables as a campaign file writes them
    path : where in a scene they stand
    """
    merged = {
        key: value for key, value in base.items() if key not in _superseded(over, path)
    }
    for key, value in over.items():
        merged[key] = _over(merged.get(key), value, (*path, key))
    return merged


def _superseded(over: Table, path: Path) -> set[str]:
    """Return the keys that alternatives in ``over`` replace."""
    superseded: set[str] = set()
    for part in parts_at(path):
        for groups in part.alternatives:
            for written in groups:
                if any(key in over for key in written):
                    superseded |= {
                        key for group in groups if group is not written for key in group
                    }
    return superseded


def contradictions(
    table: Table, over: Table, path: Path = ()
) -> Iterator[tuple[str, str]]:
    """Yield keys of a table that exclude each other, where ``over`` would drop one.

    Parameters
    ----------
    table, over : tables as a campaign file writes them
    path : where in a scene they stand
    """
    for part in parts_at(path):
        for groups in part.alternatives:
            for written in groups:
                if not any(key in over for key in written):
                    continue
                present = [key for key in written if key in table]
                others = {
                    key for group in groups if group is not written for key in group
                }
                for key in sorted(others & table.keys()) if present else ():
                    yield ".".join([*path, present[0]]), ".".join([*path, key])
    for key, value in over.items():
        if isinstance(value, dict) and isinstance(table.get(key), dict):
            yield from contradictions(table[key], value, (*path, key))


def _over(base: Any, over: Any, path: Path) -> Any:
    """Return one value over another: merged where both are tables of one choice."""
    chooser = chooser_at(path)
    if chooser is not None:
        base = _as_table(base, chooser)
        over = _as_table(over, chooser)
    if not isinstance(over, dict):
        return over
    if not isinstance(base, dict):
        return merge({}, over, path)
    if chooser is not None and _is_another_choice(base, over, path):
        if not any(part.per_member for part in parts_at(path)):
            return {**over}
        members = {
            name: table
            for name, table in base.items()
            if name in MEMBERS and isinstance(table, dict) and chooser in table
        }
        return {**members, **over}
    return merge(base, over, path)


def _is_another_choice(base: Table, over: Table, path: Path) -> bool:
    """Say whether ``over`` chooses another part than ``base``."""
    chooser = chooser_at(path)
    if chooser not in over or any(part.keeps_table for part in parts_at(path)):
        return False
    choice = choice_of(path, base)
    return choice is not None and choice != over[chooser]


def _as_table(value: Any, chooser: str) -> Any:
    """Return a name as the table that chooses it."""
    return {chooser: value} if isinstance(value, str) else value


def nested(key: str, value: Any) -> Table:
    """Return ``{"a": {"b": value}}`` for the dotted key ``a.b``.

    Parameters
    ----------
    key : dotted
    value : what stands there
    """
    for word in reversed(key.split(".")):
        value = {word: value}
    table: Table = value
    return table


def without(table: Table, key: str) -> Table:
    """Return the table without a section or dotted key.

    Parameters
    ----------
    table : as a campaign file writes it
    key : dotted

    Raises
    ------
    DropError
        When there is nothing at that path.
    """
    word, _, rest = key.partition(".")
    if word not in table or (rest and not isinstance(table[word], dict)):
        listed = f"; there are {', '.join(sorted(table)) or 'no keys'}"
        raise DropError(
            f"{key!r} is not there to be dropped{meant(word, table, listed)}"
        )
    if not rest:
        return {name: value for name, value in table.items() if name != word}
    try:
        return {**table, word: without(table[word], rest)}
    except DropError:
        raise DropError(
            f"{key!r} is not there to be dropped{meant(key, paths(table))}"
        ) from None


def leaves(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every dotted path of a table at which no table stands, and what does."""
    for key, value in table.items():
        if isinstance(value, dict):
            yield from leaves(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", value


def paths(table: Table) -> list[str]:
    """Return every dotted path of a table, tables included."""
    words = [key.split(".") for key, _ in leaves(table)]
    return list(
        dict.fromkeys(
            ".".join(key[:count]) for key in words for count in range(1, len(key) + 1)
        )
    )
