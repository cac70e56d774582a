"""What a REXS file holds, whatever it is written in: components, relations, load cases.

The exchange format is described in its schemas and change logs, versions 1.0 to 2.0.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

MAX_ENTRIES = 20_000
"""Components, and relations, of a file; the largest public ones have hundreds."""
MAX_STAGES = 200
MAX_CASES = 1_000
"""Load cases of a file."""
SHOWN = 40
"""Characters of a value in a message."""
TYPES = {
    "flank_geometry": "cylindrical_gear_flank",
    "stage_gear_data": "cylindrical_stage_gear_data",
}
"""Types of components that version 1.3 renamed: old → new."""


class RexsError(ValueError):
    """A REXS file cannot be read, or what is asked of it is not in it."""


class Attribute(NamedTuple):
    """One attribute of a component.

    Parameters
    ----------
    value : number, text, truth value, or a list of them; None where the writer left it
        out or gave it another type
    unit : as the file writes it, "" without
    """

    value: Any
    unit: str = ""


Attributes = Mapping[str, Attribute]
CaseAttributes = Mapping[str, Attributes]


class Component(NamedTuple):
    """One component of a gear unit.

    Parameters
    ----------
    id : its number in the file
    type : what it is, such as ``cylindrical_gear``
    name : what its writer calls it
    attributes : by id
    """

    id: str
    type: str
    name: str
    attributes: Attributes


class Relation(NamedTuple):
    """How components belong together.

    Parameters
    ----------
    type : such as ``stage``
    members : role → number of the component
    """

    type: str
    members: Mapping[str, str]


class LoadCase(NamedTuple):
    """One load case: attributes that it sets, by component.

    Parameters
    ----------
    name : its number in the file
    attributes : number of a component → its attributes
    """

    name: str
    attributes: CaseAttributes


class Document(NamedTuple):
    """A REXS file.

    Parameters
    ----------
    version : of the format, such as "1.4"
    program : what wrote it
    components : by number, in the order of the file
    relations : in the order of the file
    load_cases : of its first load spectrum
    by_member : (type, role, number of a component) → the relations
    """

    version: str
    program: str
    components: Mapping[str, Component]
    relations: tuple[Relation, ...]
    load_cases: tuple[LoadCase, ...]
    by_member: Mapping[tuple[str, str, str], tuple[Relation, ...]]

    def of_type(self, *types: str) -> Iterator[Component]:
        """Yield the components of some types.

        Parameters
        ----------
        types : names of types
        """
        for component in self.components.values():
            if component.type in types:
                yield component

    def related(self, relation: str, role: str, component: str) -> Iterator[Relation]:
        """Yield the relations of a type in which a component has a role.

        Parameters
        ----------
        relation : type of the relation
        role : role of the component
        component : its number
        """
        yield from self.by_member.get((relation, role, component), ())

    def partners(
        self, relation: str, role: str, component: str, partner: str
    ) -> Iterator[Component]:
        """Yield what stands in another role of such relations.

        Parameters
        ----------
        relation : type of the relation
        role : role of the component
        component : its number
        partner : role of what is asked for
        """
        for stated in self.related(relation, role, component):
            found = self.components.get(stated.members.get(partner, ""))
            if found is not None:
                yield found

    def in_case(self, case: LoadCase | None) -> "Document":
        """Return the document with the attributes that a load case sets.

        Parameters
        ----------
        case : the load case; None changes nothing
        """
        if case is None:
            return self

        components = dict(self.components)
        for number, attributes in case.attributes.items():
            if number in components:
                component = components[number]
                merged = {**component.attributes, **attributes}
                components[number] = component._replace(attributes=merged)

        return self._replace(components=components)


def by_id(component: str, attributes: Iterable[tuple[str, Attribute]]) -> Attributes:
    """Return the attributes of a component by id.

    Parameters
    ----------
    component : its number, for messages
    attributes : each with its id

    Raises
    ------
    RexsError : one stands twice, with two values
    """
    found: dict[str, Attribute] = {}
    for name, attribute in attributes:
        other = found.setdefault(name, attribute)
        if not _is_same(other, attribute):
            raise RexsError(
                f"component {component}, {name}: stands twice, with {_shown(other)} "
                f"and {_shown(attribute)}: leave one in the file"
            )
    return found


def _is_same(one: Attribute, other: Attribute) -> bool:
    """Say whether two attributes have the same value and unit; NaN is like NaN."""
    return one == other or repr(one) == repr(other)


def _shown(attribute: Attribute) -> str:
    """Return the value and the unit for a message, a long value cut."""
    value = str(attribute.value)
    beginning = value if len(value) <= SHOWN else f"{value[:SHOWN]}…"
    return f"{beginning} {attribute.unit}".strip()


def of_components(attributes: Iterable[tuple[str, Attributes]]) -> CaseAttributes:
    """Return the attributes that a load case sets, by component.

    Parameters
    ----------
    attributes : each with the number of its component

    Raises
    ------
    RexsError : a component stands twice, with two values of an attribute
    """
    found: dict[str, list[tuple[str, Attribute]]] = {}
    for number, stated in attributes:
        found.setdefault(number, []).extend(stated.items())
    return {number: by_id(number, stated) for number, stated in found.items()}


def document_of(
    version: str,
    program: str,
    components: Iterable[Component],
    relations: Iterable[Relation],
    load_cases: Iterable[LoadCase],
) -> Document:
    """Return a document whose types bear their newer names.

    Parameters
    ----------
    version, program : as of `Document`
    components, relations, load_cases : in the order of the file

    Raises
    ------
    RexsError : two components of one number, or more entries than a gear unit has
    """
    by_number: dict[str, Component] = {}
    for component in components:
        if component.id in by_number:
            raise RexsError(
                f"two components have the id {component.id}: export the file anew"
            )
        newer = TYPES.get(component.type, component.type)
        by_number[component.id] = component._replace(type=newer)

    stated = tuple(relations)
    cases = tuple(load_cases)
    stages = sum(part.type.endswith("_stage") for part in by_number.values())
    for count, largest, noun in (
        (len(by_number), MAX_ENTRIES, "components"),
        (len(stated), MAX_ENTRIES, "relations"),
        (stages, MAX_STAGES, "stages"),
        (len(cases), MAX_CASES, "load cases"),
    ):
        if count > largest:
            raise RexsError(
                f"{count} {noun} are more than the {largest} of a gear unit: export "
                "one gear unit alone"
            )
    return Document(version, program, by_number, stated, cases, _by_member(stated))


def _by_member(
    relations: Iterable[Relation],
) -> dict[tuple[str, str, str], tuple[Relation, ...]]:
    """Return relations by their type and each member's role and number."""
    found: dict[tuple[str, str, str], list[Relation]] = {}
    for relation in relations:
        for role, component in relation.members.items():
            found.setdefault((relation.type, role, component), []).append(relation)
    return {key: tuple(entries) for key, entries in found.items()}
