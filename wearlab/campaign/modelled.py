"""A table of the campaign file read by a pydantic model; what is wrong with it in one line a key."""

from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from wearlab.campaign.errors import CampaignError
from wearlab.nearest import meant
from wearlab.scene.problems import EXPECTED, not_of_kind, shown

Model = TypeVar("Model", bound=BaseModel)


def modelled(model: type[Model], given: Any, where: str) -> Model:
    """Return a table of the file as a model.

    Parameters
    ----------
    model : what it should be
    given : what the file says
    where : its place in the file

    Raises
    ------
    CampaignError : with one line for each key that is wrong
    """
    try:
        return model.model_validate(given)
    except ValidationError as error:
        faults: dict[str, list[dict[str, Any]]] = {}
        for problem in error.errors():
            faults.setdefault(str(problem["loc"][0]) if problem["loc"] else "", []).append(dict(problem))
        raise CampaignError(
            _line(key, errors, given, model, where) for key, errors in faults.items()
        ) from None


def _line(key: str, errors: list[dict[str, Any]], given: Any, model: type[BaseModel], where: str) -> str:
    """Return what is wrong with one key, "" for the whole table."""
    error = errors[0]
    if not key:
        return f"{where}: {shown(given)} is {not_of_kind([error['type']])}: write {_header(where)}"
    if error["type"] == "extra_forbidden":
        remedy = meant(key, model.model_fields, f"; there are {', '.join(model.model_fields)}")
        return f"{where}.{key}: unknown key{remedy}"
    if error["type"] == "value_error":  # says itself what is wrong
        return f"{where}.{key}: {error['msg'].removeprefix('Value error, ')}"
    if error["type"] == "literal_error":
        return f"{where}.{key}: {shown(given[key])} is not {error['ctx']['expected']}"
    meaning = model.model_fields[key].description
    if error["type"] == "missing":
        return f"{where}.{key}: required: {meaning}"
    if any(problem["type"] not in EXPECTED for problem in errors):
        said = str(error["msg"])
        return f"{where}.{key}: {shown(given[key])}: {said[:1].lower()}{said[1:]}: {meaning}"
    wrong = not_of_kind(problem["type"] for problem in errors)
    return f"{where}.{key}: {shown(given[key])} is {wrong}: {meaning}"


def _header(where: str) -> str:
    """Return how the table is begun in a file: ``[[figure]]`` for one of several."""
    name, several, _ = where.partition("[")
    return f"[[{name}]]" if several else f"[{name}]"
