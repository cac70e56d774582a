"""REXS as JSON."""

from collections.abc import Iterator, Mapping
from typing import Any

from wearlab.files import finite_json
from wearlab.rexs import arrays
from wearlab.rexs.document import (
    Attribute,
    Attributes,
    Component,
    Document,
    LoadCase,
    Relation,
    RexsError,
    by_id,
    document_of,
    of_components,
)
from wearlab.rexs.xml_file import plain
from wearlab.units import is_number

NUMBERS = ("floating_point", "integer", "reference_component", "file_reference")
LARGEST = 1e300
"""Beyond it a number is nonsense, and a whole one would be no float."""
TEXTS = ("string", "enum", "date_time")
SCALARS = (*NUMBERS, *TEXTS, "boolean")


def read(content: bytes) -> Document:
    """Return what a JSON file holds.

    Parameters
    ----------
    content : its bytes

    Raises
    ------
    RexsError : no JSON, or no ``model`` in it
    """
    try:
        root = finite_json(content.decode("utf-8-sig"))
    except ValueError as error:
        raise RexsError(f"it is no whole JSON file ({error}): export it anew") from None

    model = root.get("model") if isinstance(root, dict) else None
    if not isinstance(model, dict):
        raise RexsError('it has no "model" as REXS files have: export as REXS')

    program = (model.get("applicationId"), model.get("applicationVersion"))
    return document_of(
        version=str(model.get("version", "")),
        program=" ".join(str(part) for part in program if part),
        components=_components(model),
        relations=_relations(model),
        load_cases=_load_cases(model),
    )


def _tables(parent: Any, key: str) -> Iterator[dict[str, Any]]:
    """Yield the tables of a list; what is none is refused."""
    entries = parent.get(key) or []
    if not isinstance(entries, list) or not all(isinstance(e, dict) for e in entries):
        raise RexsError(f'"{key}" is not a list of objects: export the file anew')
    yield from entries


def _components(model: Mapping[str, Any]) -> Iterator[Component]:
    """Yield the components in the order of the file."""
    for entry in _tables(model, "components"):
        yield Component(
            _number(entry),
            str(entry.get("type", "")),
            str(entry.get("name", "")),
            _attributes(entry),
        )


def _number(entry: Mapping[str, Any]) -> str:
    """Return an id as the XML of the same file has it."""
    number = entry.get("id", "")
    whole = isinstance(number, float) and number.is_integer()
    return str(int(number)) if whole else str(number)


def _attributes(component: Mapping[str, Any]) -> Attributes:
    """Return the attributes of a component by id."""
    stated = []
    for entry in _tables(component, "attributes"):
        place = f"component {component.get('id')}, {entry.get('id')}"
        unit = entry.get("unit")
        attribute = Attribute(
            _value(entry, place), unit if isinstance(unit, str) else ""
        )
        stated.append((str(entry.get("id", "")), attribute))
    return by_id(_number(component), stated)


def _value(entry: Mapping[str, Any], place: str) -> Any:
    """Return the value of an attribute, None where it has another type than stated."""
    for key, value in entry.items():
        if key.endswith("_array_coded"):
            return arrays.decode(*_coded(value, place), place)
        if key.endswith("_matrix_coded"):
            code, text = _coded(value, place)
            return arrays.decode_matrix(code, text, _size(value, place), place)
        if key.endswith("_array") or key.endswith("_matrix"):
            return value if isinstance(value, list) else None
        if key in SCALARS:
            return _scalar(key, value)
    return None


def _scalar(key: str, value: Any) -> Any:
    """Return a single value, None where it is not of the type that its key names."""
    if key == "boolean":
        return value if isinstance(value, bool) else None
    if key in NUMBERS:
        value = plain(value) if isinstance(value, str) else value
        if isinstance(value, str):
            return value  # refused with its place where it is needed as a number
        is_finite = is_number(value) and abs(value) < LARGEST
        return float(value) if is_finite else None
    if key in TEXTS:
        return value if isinstance(value, str) else None
    return None


def _coded(value: Any, place: str) -> tuple[str, str]:
    """Return code and text of a coded array."""
    if isinstance(value, dict):
        code, text = value.get("code"), value.get("value")
        if isinstance(code, str) and isinstance(text, str):
            return code, text
    raise RexsError(
        f"{place}: a coded array needs code and value: export the file anew"
    )


def _size(value: Mapping[str, Any], place: str) -> tuple[int, int]:
    """Return rows and columns as a matrix states them."""
    rows, columns = value.get("rows"), value.get("columns")
    if isinstance(rows, int) and isinstance(columns, int):
        return rows, columns
    raise RexsError(
        f"{place}: a coded matrix needs whole rows and columns: export the file anew"
    )


def _relations(model: Mapping[str, Any]) -> Iterator[Relation]:
    """Yield the relations in the order of the file."""
    for entry in _tables(model, "relations"):
        members = {
            str(ref.get("role", "")): _number(ref) for ref in _tables(entry, "refs")
        }
        yield Relation(str(entry.get("type", "")), members)


def _load_cases(model: Mapping[str, Any]) -> Iterator[LoadCase]:
    """Yield the load cases of the (first) load spectrum."""
    spectrum = model.get("load_spectrum")
    if isinstance(spectrum, list):
        spectrum = spectrum[0] if spectrum else None
    if not isinstance(spectrum, dict):
        return

    for entry in _tables(spectrum, "load_cases"):
        parts = _tables(entry, "components")
        attributes = [(_number(part), _attributes(part)) for part in parts]
        yield LoadCase(_number(entry), of_components(attributes))
