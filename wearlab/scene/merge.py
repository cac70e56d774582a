"""One table over another: key by key, where a choice or an alternative replaces what it supersedes."""

from collections.abc import Iterator, Mapping
from typing import Any

from wearlab.nearest import meant
from wearlab.scene.sections import MEMBERS, Path, choice_of, chooser_at, parts_at

Table = dict[str, Any]


class DropError(ValueError):
    """A path to be dropped is not there."""


def merge(base: Table, own: Table, path: Path = ()) -> Table:
    """Return ``own`` over ``base``, neither of which is changed.

    Tables merge key by key; lists and values replace; another ``model`` replaces its
    table, save members' tables with a model of their own; one of several alternatives
    (``damping``, ``damping_ratio``) drops the others.

    Parameters
    ----------
    base, own : tables as a campaign file writes them
    path : where in a scene they stand
    """
    merged = {
        key: value for key, value in base.items() if key not in _superseded(own, path)
    }
    for key, value in own.items():
        merged[key] = _over(merged.get(key), value, (*path, key))
    return merged


def _superseded(own: Table, path: Path) -> set[str]:
    """Return the keys that alternatives in ``own`` replace."""
    gone: set[str] = set()
    for groups in (groups for part in parts_at(path) for groups in part.alternatives):
        for given in (group for group in groups if any(key in own for key in group)):
            gone |= {key for group in groups if group is not given for key in group}
    return gone


def _over(base: Any, own: Any, path: Path) -> Any:
    chooser = chooser_at(path)
    if chooser is not None:
        base = _as_table(base, chooser)
        own = _as_table(own, chooser)
    if not (isinstance(base, dict) and isinstance(own, dict)):
        return merge({}, own, path) if isinstance(own, dict) else own
    if (
        chooser is not None
        and chooser in own
        and not any(part.keeps_table for part in parts_at(path))
    ):
        before = choice_of(path, base)
        if before is not None and before != own[chooser]:
            kept = {
                m: t
                for m, t in base.items()
                if m in MEMBERS and isinstance(t, dict) and chooser in t
            }
            return {
                **(kept if any(p.per_member for p in parts_at(path)) else {}),
                **own,
            }
    return merge(base, own, path)


def _as_table(value: Any, chooser: str) -> Any:
    return {chooser: value} if isinstance(value, str) else value


def nested(key: str, value: Any) -> Table:
    """Return ``{"a": {"b": value}}`` for the dotted key ``a.b``."""
    for word in reversed(key.split(".")):
        value = {word: value}
    table: Table = value
    return table


def without(table: Table, key: str) -> Table:
    """Return the table without a section or dotted key.

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
        return {k: v for k, v in table.items() if k != word}
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
