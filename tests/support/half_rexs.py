"""Gear units in REXS, damaged in ways that know the format."""

import random
from collections.abc import Callable, Iterator
from pathlib import Path
from xml.etree import ElementTree

import rexs_files
from half_read import Mutant

from wearlab.rexs.stages import read_unit

Element = ElementTree.Element
Reading = list[tuple[str, str]]
ODD = ("abc", "1e999", "--", "3 mm", "1.2.3", "[]", "0x3", "true")
ODD_UNITS = ("gizmo", "kg", "s", "mm^2 / s")
STAGES = (1, 2)


def read(path: Path) -> Reading:
    """Return what a file says of its stages, and what is told beside it."""
    unit = read_unit(path)
    reading = [("stages", str(unit.stages))]
    for number in STAGES:
        draft = unit.draft(number)
        told = (draft.left_out, draft.missing, draft.derived)
        reading.append((str(draft.table()), str(told)))
    return reading


def _attributes(model: Element) -> list[tuple[Element, Element]]:
    """Return all attributes with what they stand in."""
    return [
        (component, attribute)
        for component in model.iter("component")
        for attribute in component.findall("attribute")
    ]


def _value(model: Element, chance: random.Random) -> str:
    _, attribute = chance.choice(_attributes(model))
    numbers = attribute.findall("array/c") or [attribute]
    chance.choice(numbers).text = chance.choice(ODD)
    return f"value of {attribute.get('id')}"


def _unit(model: Element, chance: random.Random) -> str:
    _, attribute = chance.choice(_attributes(model))
    attribute.set("unit", chance.choice(ODD_UNITS))
    return f"unit of {attribute.get('id')}"


def _gone(model: Element, chance: random.Random) -> str:
    component, attribute = chance.choice(_attributes(model))
    component.remove(attribute)
    return f"{attribute.get('id')} gone"


def _misspelt(model: Element, chance: random.Random) -> str:
    _, attribute = chance.choice(_attributes(model))
    name = str(attribute.get("id"))
    attribute.set("id", name[:-1])
    return f"{name} misspelt"


def _twice(model: Element, chance: random.Random) -> str:
    component, attribute = chance.choice(_attributes(model))
    number = ElementTree.SubElement(component, "attribute", dict(attribute.attrib))
    number.text = "17.5"
    return f"{attribute.get('id')} twice"


def _relation(model: Element, chance: random.Random) -> str:
    relations = model.find("relations")
    assert relations is not None
    relation = chance.choice(list(relations))
    if chance.random() < 0.5:
        relations.remove(relation)
        return f"relation {relation.get('id')} gone"
    chance.choice(list(relation)).set("id", chance.choice(("99", "1", "x", "")))
    return f"relation {relation.get('id')} elsewhere"


def _component(model: Element, chance: random.Random) -> str:
    components = model.find("components")
    assert components is not None
    component = chance.choice(list(components))
    name = f"component {component.get('id')}"
    match chance.randrange(3):
        case 0:
            components.remove(component)
        case 1:
            components.append(component)
        case _:
            component.set("type", chance.choice(("bevel_gear", "shaft", "")))
    return f"{name} gone, twice or of another type"


def _case(model: Element, chance: random.Random) -> str:
    cases = list(model.iter("load_case"))
    case = chance.choice(cases)
    component = chance.choice(list(case))
    case.remove(component)
    return f"component {component.get('id')} gone from a load case"


CHANGES: tuple[Callable[[Element, random.Random], str], ...] = (
    _value,
    _value,
    _unit,
    _gone,
    _misspelt,
    _twice,
    _relation,
    _component,
    _case,
)


def mutants(count: int, seed: int) -> Iterator[Mutant]:
    """Yield damaged gear units."""
    chance = random.Random(seed)
    for number in range(count):
        model = ElementTree.fromstring(rexs_files.as_xml())
        what = CHANGES[number % len(CHANGES)](model, chance)
        yield Mutant(what, "unit.rexs", ElementTree.tostring(model), [])


def is_explained(what: str, reading: Reading, sound: Reading) -> bool:
    """Say whether a damaged unit may be read so, beside the sound one.

    What differs is told: in words beside the draft of its stage, or as a stage that is
    not read.

    Parameters
    ----------
    what : was done
    reading, sound : of the damaged and of the sound file
    """
    if what.endswith((" gone", " misspelt")):  # nobody says it then
        return True
    if reading[0] != sound[0]:
        return True
    pairs = zip(reading[1:], sound[1:], strict=True)
    return all(one[0] == other[0] or one[1] != other[1] for one, other in pairs)
