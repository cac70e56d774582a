"""What a REXS file holds, whatever it is written in: components, relations, load cases.

The exchange format is described in its schemas and change logs, versions 1.0 to 2.0.
"""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple


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
    attributes: Mapping[str, Attribute]


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
    attributes: Mapping[str, Mapping[str, Attribute]]


class Document(NamedTuple):
    """A REXS file.

    Parameters
    ----------
    version : of the format, such as "1.4"
    program : what wrote it
    components : by number, in the order of the file
    relations : in the order of the file
    load_cases : of its first load spectrum
    """

    version: str
    program: str
    components: Mapping[str, Component]
    relations: tuple[Relation, ...]
    load_cases: tuple[LoadCase, ...]

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
        for stated in self.relations:
            if stated.type == relation and stated.members.get(role) == component:
                yield stated

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
