"""Tables and blocks of a campaign file become option tables; wrong keys are refused."""

import re
from collections.abc import Callable
from types import NoneType, UnionType
from typing import Any, NamedTuple, TypeVar, Union, get_args, get_origin

from pydantic import ValidationError

from wearlab import nearest
from wearlab.options import OptionTable
from wearlab.scene.problems import (
    EXPECTED,
    Refusal,
    limit_of,
    not_a_choice,
    not_of_kind,
    shown,
)

QUOTED = re.compile(r"'([^']*)'")
Model = TypeVar("Model", bound=OptionTable)


class CampaignError(Refusal):
    """A campaign file is refused whole; its problems say file and path first."""


def attempt(faults: list[str], read: Callable[..., Any], *arguments: Any) -> Any:
    """Return what a reader returns; where it refuses, note its problems, return None.

    Parameters
    ----------
    faults : list to which the problems of a refusal are added
    read : reader that may raise a CampaignError
    arguments : what the reader is called with
    """
    try:
        return read(*arguments)
    except CampaignError as error:
        faults.extend(error.problems)
        return None


def is_list_of(value: Any, kind: type) -> bool:
    """Whether a value is a list, all of whose elements are of a kind.

    Parameters
    ----------
    value : anything that a file holds
    kind : type of the elements
    """
    return isinstance(value, list) and all(
        isinstance(element, kind) for element in value
    )


def listed(value: Any, name: str) -> list[Any]:
    """Return the ``[[name]]`` blocks of a file.

    Parameters
    ----------
    value : what the file has under the name
    name : of the blocks

    Raises
    ------
    CampaignError : the value is no list of tables
    """
    if not is_list_of(value, dict):
        raise CampaignError(
            f"{name}: {shown(value)} is no list of tables: write [[{name}]]"
        )
    return list(value)


def texts_of(value: Any, where: str, wanted: str) -> tuple[str, ...]:
    """Return a text, or a list of them, as texts.

    Parameters
    ----------
    value : what the file has
    where : its place in the file
    wanted : what a message says that the value is not, such as "not a list of files"

    Raises
    ------
    CampaignError : the value is neither
    """
    texts = [value] if isinstance(value, str) else value
    if not is_list_of(texts, str):
        raise CampaignError(f"{where}: {shown(value)} is {wanted}")
    return tuple(texts)


def blocks_of(model: type[Model], value: Any, name: str) -> tuple[Model, ...]:
    """Return the ``[[name]]`` blocks of a file as models.

    Parameters
    ----------
    model : what each block should be
    value : what the file has under the name
    name : of the blocks

    Raises
    ------
    CampaignError : they are no list, or with one line for each key that is wrong
    """
    if not isinstance(value, list):
        raise CampaignError(
            f"{name}: {shown(value)} is no list of tables: write [[{name}]]"
        )
    return tuple(
        modelled(model, block, f"{name}[{number}]")
        for number, block in enumerate(value)
    )


def modelled(model: type[Model], table: Any, where: str) -> Model:
    """Return a table of the file as a model.

    Parameters
    ----------
    model : what the table should be
    table : what the file says
    where : its place in the file

    Raises
    ------
    CampaignError : with one line for each key that is wrong
    """
    try:
        return model.model_validate(table)
    except ValidationError as error:
        places: dict[tuple[str, str], _Place] = {}
        errors: dict[tuple[str, str], list[dict[str, Any]]] = {}
        for problem in error.errors():
            location = _without_kinds(problem["loc"], table, model)
            if location is None:
                continue
            place = _place_of(location, table, model, where)
            name = (place.where, place.key)
            places.setdefault(name, place)
            errors.setdefault(name, []).append(dict(problem))
        raise CampaignError(
            _message(place, errors[name]) for name, place in places.items()
        ) from None


class _Place(NamedTuple):
    """A key that pydantic finds wrong.

    Parameters
    ----------
    where : place of the key's table in the file
    key : the key, "" where the whole table is wrong
    table : the table
    model : what the table should be
    """

    where: str
    key: str
    table: Any
    model: type[OptionTable]

    @property
    def path(self) -> str:
        """The table's place and the key, dotted."""
        return f"{self.where}.{self.key}".rstrip(".")


class _InnerTables(NamedTuple):
    """What a key of a model holds.

    Parameters
    ----------
    model : of its tables, None where it holds none
    is_list : whether it holds a list of them
    has_other_kinds : whether something else than a table may stand there
    """

    model: type[OptionTable] | None
    is_list: bool
    has_other_kinds: bool


def _inner_tables(model: type[OptionTable], key: str) -> _InnerTables:
    """Return which tables a key of a model holds."""
    if key not in model.model_fields:
        return _InnerTables(None, False, False)
    annotation = model.model_fields[key].annotation
    kinds = (annotation, *get_args(annotation))
    tables = [
        kind
        for kind in kinds
        if isinstance(kind, type) and issubclass(kind, OptionTable)
    ]
    if not tables:
        return _InnerTables(None, False, False)

    origin = get_origin(annotation)
    others = {*get_args(annotation)} - {tables[0], NoneType}
    is_union = origin in (Union, UnionType)
    return _InnerTables(tables[0], origin is tuple, is_union and bool(others))


def _without_kinds(
    location: tuple[int | str, ...], table: Any, model: type[OptionTable]
) -> tuple[int | str, ...] | None:
    """Return pydantic's location of an error without the kinds that it tried.

    Of a key that holds a table or something else, pydantic tells the errors of every
    kind. Where a table stands only its errors count: None for the others'.
    """
    if len(location) < 2:
        return location
    key = str(location[0])
    inner = _inner_tables(model, key)
    if not (inner.model and inner.has_other_kinds):
        return location

    if not isinstance(table[key], dict):
        return location[:1]
    is_of_table = location[1] == inner.model.__name__
    return (key, *location[2:]) if is_of_table else None


def _place_of(
    location: tuple[int | str, ...], table: Any, model: type[OptionTable], where: str
) -> _Place:
    """Return the innermost table and key that pydantic's location of an error means."""
    if not location:
        return _Place(where, "", table, model)

    key = str(location[0])
    rest = location[1:]
    inner = _inner_tables(model, key)
    is_whole = not rest and (inner.is_list or inner.has_other_kinds)
    if inner.model is None or key not in table or is_whole:
        return _Place(where, key, table, model)

    path = f"{where}.{key}"
    if inner.is_list:
        number = rest[0]
        block = table[key][number]
        return _place_of(rest[1:], block, inner.model, f"{path}[{number}]")
    return _place_of(rest, table[key], inner.model, path)


def _message(place: _Place, errors: list[dict[str, Any]]) -> str:
    """Return the line that says what is wrong with one key, or with a whole table."""
    error = errors[0]
    if error["type"] == "value_error":  # a validator's own message
        return f"{place.path}: {error['msg'].removeprefix('Value error, ')}"
    if not place.key:
        name, bracket, _ = place.where.partition("[")
        header = f"[[{name}]]" if bracket else f"[{name}]"
        kind = not_of_kind([error["type"]])
        return f"{place.where}: {shown(place.table)} is {kind}: write {header}"
    return f"{place.path}: {_problem_of_key(place, errors)}"


def _problem_of_key(place: _Place, errors: list[dict[str, Any]]) -> str:
    """Return what is wrong with the key of a table, and its remedy."""
    key = place.key
    valid = place.model.model_fields
    error = errors[0]
    if error["type"] == "extra_forbidden":
        remedy = nearest.meant(key, valid, f"; there are {', '.join(valid)}")
        return f"unknown key{remedy}"
    if error["type"] == "literal_error":
        choices = QUOTED.findall(error["ctx"]["expected"])
        return not_a_choice(place.table[key], choices)

    field = place.model.field_of(key)
    meaning = place.model.texts()[field]["description"]
    if error["type"] == "missing":
        return f"required: {meaning}"

    value = shown(place.table[key])
    if limit := limit_of(error.get("ctx", {})):
        return f"{value} {limit}: {meaning}"
    kinds = [problem["type"] for problem in errors]
    if any(kind not in EXPECTED for kind in kinds):
        message = str(error["msg"])
        return f"{value}: {message[:1].lower()}{message[1:]}: {meaning}"
    if _inner_tables(place.model, key).is_list:
        return f"{value} is {not_of_kind(kinds)} of tables: write [[{place.path}]]"
    return f"{value} is {not_of_kind(kinds)}: {meaning}"
