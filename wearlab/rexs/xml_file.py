"""REXS as XML."""

import re
from collections.abc import Iterator, Mapping
from typing import Any
from xml.etree import ElementTree

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

TRUTH = {"true": True, "false": False}


DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+(e[+-]?\d+)?", re.IGNORECASE)
"""A number of a program that writes as its country does: REXS has decimal points."""

THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
"""What may be a thousand as well."""


class _Builder(ElementTree.TreeBuilder):
    """Builds the tree without namespaces, and refuses documents that define entities.

    Some programs give their elements a namespace; the format has none.
    """

    def start(self, tag: str, attrs: dict[str, str]) -> ElementTree.Element:
        """Begin an element, by its local name."""
        return super().start(tag.rpartition("}")[2], attrs)

    def end(self, tag: str) -> ElementTree.Element:
        """End an element, by its local name."""
        return super().end(tag.rpartition("}")[2])

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        """Refuse a DOCTYPE: entities come in by it, and REXS has none."""
        raise RexsError(
            "a DOCTYPE stands in it, which no REXS file has: delete that line"
        )


def read(content: bytes) -> Document:
    """Return what an XML file holds.

    Parameters
    ----------
    content : its bytes

    Raises
    ------
    RexsError : no XML, a DOCTYPE, or another root than ``model``
    """
    parser = ElementTree.XMLParser(target=_Builder())
    try:
        parser.feed(content)
        root: ElementTree.Element = parser.close()
    except ElementTree.ParseError as error:
        raise RexsError(f"it is no whole XML file ({error}): export it anew") from None
    except (LookupError, ValueError) as error:
        if isinstance(error, RexsError):
            raise
        raise RexsError(
            f"its text cannot be decoded ({error}): save it as UTF-8"
        ) from None

    if root.tag != "model":
        raise RexsError(
            f"its root is <{root.tag}>, not the <model> of a REXS file: export as REXS"
        )
    program = (root.get("applicationId"), root.get("applicationVersion"))
    return document_of(
        version=root.get("version", ""),
        program=" ".join(part for part in program if part),
        components=_components(root.find("components")),
        relations=_relations(root.find("relations")),
        load_cases=_load_cases(root.find("load_spectrum")),
    )


def _components(element: ElementTree.Element | None) -> Iterator[Component]:
    """Yield the components in the order of the file."""
    for entry in element if element is not None else ():
        yield Component(
            entry.get("id", ""),
            entry.get("type", ""),
            entry.get("name", ""),
            _attributes(entry),
        )


def _attributes(component: ElementTree.Element) -> Attributes:
    """Return the attributes of a component by id."""
    stated = []
    for entry in component:
        place = f"component {component.get('id')}, {entry.get('id')}"
        attribute = Attribute(_value(entry, place), entry.get("unit", ""))
        stated.append((entry.get("id", ""), attribute))
    return by_id(component.get("id", ""), stated)


def _value(entry: ElementTree.Element, place: str) -> Any:
    """Return the value of an attribute: number, truth value, text or array."""
    if len(entry) == 0:
        return plain(entry.text or "")

    block = entry[0]
    code = block.get("code")
    if block.tag == "matrix":
        return _matrix(block, code, place)
    if code:
        return arrays.decode(code, block.text or "", place)
    return [plain(cell.text or "") for cell in block]


def _matrix(
    block: ElementTree.Element, code: str | None, place: str
) -> list[list[Any]]:
    """Return the rows of a matrix, written out or coded."""
    if code:
        shape = _size(block.attrib, place)
        return arrays.decode_matrix(code, block.text or "", shape, place)
    return [[plain(cell.text or "") for cell in row] for row in block]


def _size(stated: Mapping[str, str], place: str) -> tuple[int, int]:
    """Return rows and columns as a matrix states them."""
    try:
        return int(stated["rows"]), int(stated["columns"])
    except (KeyError, ValueError):
        raise RexsError(
            f"{place}: a coded matrix needs whole rows and columns: export the file "
            "anew"
        ) from None


def plain(text: str) -> Any:
    """Return a text as a truth value or a number where it is one; None where empty.

    Parameters
    ----------
    text : as it stands in the file

    Examples
    --------
    >>> plain(" 17.0 "), plain("0,35"), plain("true"), plain("c25"), plain("")
    (17.0, 0.35, True, 'c25', None)
    """
    text = text.strip()
    if not text:
        return None
    if text.lower() in TRUTH:
        return TRUTH[text.lower()]
    if DECIMAL_COMMA.fullmatch(text) and not THOUSANDS.fullmatch(text):
        text = text.replace(",", ".")
    try:
        return float(text)
    except ValueError:
        return text


def _relations(element: ElementTree.Element | None) -> Iterator[Relation]:
    """Yield the relations in the order of the file."""
    for entry in element if element is not None else ():
        members = {ref.get("role", ""): ref.get("id", "") for ref in entry}
        yield Relation(entry.get("type", ""), members)


def _load_cases(element: ElementTree.Element | None) -> Iterator[LoadCase]:
    """Yield the load cases; accumulated results beside them are left."""
    for entry in element if element is not None else ():
        if entry.tag == "load_case":
            parts = [(part.get("id", ""), _attributes(part)) for part in entry]
            yield LoadCase(entry.get("id", ""), of_components(parts))
