"""Gear units as other programs write them: the same stages come in.

Each writer is the made-up gear unit, or an exported set, written otherwise: namespaces,
encodings, units, names of other versions, ids, orders, JSON.
"""

import json
import math
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
import rexs_files as files
from scenes import internal_pair

from wearlab.rexs import RexsError
from wearlab.rexs.export import export_rexs
from wearlab.rexs.stages import read_unit
from wearlab.scene import Scene

GEAR_UNIT = files.as_xml()
INTERNAL = {
    "gears": internal_pair(
        25, {"teeth": 65, "rim_diameter": "230 mm"}, centre_distance="60 mm"
    ),
    "operation": {"torque": "40 N*m", "speed": "900 rpm"},
}


def read(path: Path, content: str | bytes) -> list[Any]:
    """Return the sections of every stage of a file, or why it has none."""
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    unit = read_unit(path)
    return [stage.reason or unit.draft(stage.number).table() for stage in unit.stages]


@pytest.fixture
def expected(tmp_path: Path) -> list[Any]:
    """Return the stages of the gear unit as it is usually written."""
    return read(tmp_path / "usual.rexs", GEAR_UNIT)


def in_unit(text: str, old: str, new: str) -> str:
    """Return a file that writes a unit otherwise."""
    assert f'unit="{old}"' in text
    return text.replace(f'unit="{old}"', f'unit="{new}"')


WRITERS: dict[str, str | bytes] = {
    "a default namespace": GEAR_UNIT.replace(
        "<model ", '<model xmlns="http://www.rexs.info/schema" ', 1
    ),
    "a prefix": re.sub(r"<(/?)(\w+)", r"<\1r:\2", GEAR_UNIT).replace(
        "<r:model ", '<r:model xmlns:r="http://www.rexs.info" ', 1
    ),
    "Latin-1": (
        '<?xml version="1.0" encoding="ISO-8859-1"?>'
        + GEAR_UNIT.replace("case-hardened", "einsatzgehärtet")
    ).encode("latin-1"),
    "UTF-16": ('<?xml version="1.0" encoding="UTF-16"?>' + GEAR_UNIT).encode("utf-16"),
    "a mark": b"\xef\xbb\xbf" + GEAR_UNIT.encode(),
    "decimal commas": re.sub(r">(-?\d+)\.(\d\d?)<", r">\1,\2<", GEAR_UNIT),
    "exponents": re.sub(
        r">(-?\d+\.\d+)<", lambda found: f">{float(found[1]):.15E}<", GEAR_UNIT
    ),
    "blanks about values": re.sub(r">(-?\d+\.\d+)<", ">\n   \\1\n<", GEAR_UNIT),
    "large truth values": GEAR_UNIT.replace(">true<", ">TRUE<").replace(
        ">false<", ">False<"
    ),
    "ids that are words": re.sub(
        r'(<component[^>]* id|<component id|<ref id)="(\d+)"', r'\1="G_\2"', GEAR_UNIT
    ),
    "results beside the cases": GEAR_UNIT.replace(
        '<load_spectrum id="1">',
        '<load_spectrum id="1"><accumulation id="9"><component id="3">'
        '<attribute id="rotational_speed" unit="1 / min">1</attribute></component>'
        "</accumulation>",
    ),
}


@pytest.mark.parametrize("writer", WRITERS)
def test_writers_of_xml_say_the_same(writer, expected, tmp_path):
    assert read(tmp_path / "written.rexs", WRITERS[writer]) == expected


@pytest.mark.parametrize(
    ("usual", "other"),
    [
        ("N m", "N*m"),
        ("N m", "N·m"),
        ("N m", "N.m"),
        ("N m", "Nm"),
        ("1 / min", "1/Min"),
        ("1 / min", "rev/min"),
        ("1 / min", "min^(-1)"),
        ("1 / min", "RPM"),
        ("°", "[deg]"),
        ("mm", "MM"),
        ("mm", "[mm]"),
        ("mum", "µm"),
        ("mum", "micron"),
        ("cSt", "mm²/s"),
        ("kg / dm^3", "kg/dm³"),
        ("kg/m^3", "kg/m³"),
        ("GPa", "kN/mm²"),
        ("C", "°C"),
        ("%", "percent"),
        ("HV", "HV10"),
    ],
)
def test_units_are_those_that_programs_write(usual, other, expected, tmp_path):
    written = in_unit(GEAR_UNIT, usual, other)
    assert read(tmp_path / "written.rexs", written) == expected


@pytest.mark.parametrize("version", ["1.0", "1.1", "1.2", "1.3", "1.6", "2.0", "2.1"])
def test_versions_say_the_same(version, expected, tmp_path):
    assert read(tmp_path / "written.rexs", files.as_xml(version)) == expected


def test_what_is_a_thousand_or_a_decimal_is_asked(tmp_path):
    text = GEAR_UNIT.replace(">1450.0<", ">1,450<")
    with pytest.raises(RexsError, match=r"'1,450' is 1\.450 or 1450: write it with a"):
        read(tmp_path / "written.rexs", text)


def test_what_is_a_thousand_or_a_decimal_is_asked_of_json_too(tmp_path):
    text = files.as_json().replace("1450.0", '"1,450"')
    assert '"1,450"' in text
    with pytest.raises(RexsError, match=r"'1,450' is 1\.450 or 1450: write it with a"):
        read(tmp_path / "written.rexsj", text)


def changed(value: Any, change: Any) -> Any:
    """Return a JSON document whose objects are changed, innermost first."""
    if isinstance(value, list):
        return [changed(entry, change) for entry in value]
    if isinstance(value, dict):
        return change({key: changed(entry, change) for key, entry in value.items()})
    return value


@pytest.mark.parametrize(
    "change",
    [
        lambda entry: dict(sorted(entry.items(), reverse=True)),
        lambda entry: {"comment": "x", **entry},
        lambda entry: {
            key: str(value) if key == "floating_point" else value
            for key, value in entry.items()
        },
    ],
    ids=["keys in another order", "comments first", "numbers as texts"],
)
def test_writers_of_json_say_the_same(change, expected, tmp_path):
    document = changed(json.loads(files.as_json()), change)
    assert read(tmp_path / "written.rexsj", json.dumps(document)) == expected


@pytest.mark.parametrize(
    ("torque", "speed", "row"),
    [
        ("0.0", "-300.0", {"torque": "0 N*m", "speed": "300 rpm", "share": 0.4}),
        ("0.0", "0.0", {"torque": "0 N*m", "speed": "0 rpm", "share": 0.4}),
        ("0.25", "-300.0", {"torque": "-250 N*m", "speed": "300 rpm", "share": 0.4}),
    ],
    ids=["idle", "at rest", "reversed"],
)
def test_load_cases_without_torque_keep_their_time(torque, speed, row, tmp_path):
    text = GEAR_UNIT.replace(">-0.25<", f">{torque}<").replace(">-300.0<", f">{speed}<")
    fast, slow, _ = read(tmp_path / "cases.rexs", text)
    assert fast["operation"]["duty"][1] == row
    assert slow["operation"]["duty"][1]["share"] == 0.4


def exported(tmp_path: Path) -> ElementTree.Element:
    """Return an exported planetary set."""
    scene = Scene.from_mapping(files.PLANETARY)
    return ElementTree.fromstring(export_rexs(scene, "set").content)


def as_json(model: ElementTree.Element) -> str:
    """Return a model as JSON, all ids as numbers with a point."""

    def value_of(entry: ElementTree.Element) -> dict[str, Any]:
        if len(entry):
            return {"floating_point_array": [float(cell.text) for cell in entry[0]]}
        text = (entry.text or "").strip()
        if text in ("true", "false"):
            return {"boolean": text == "true"}
        try:
            return {"floating_point": float(text)}
        except ValueError:
            return {"string": text}

    def attributes(part: ElementTree.Element) -> list[dict[str, Any]]:
        return [
            {"id": entry.get("id"), "unit": entry.get("unit"), **value_of(entry)}
            for entry in part
        ]

    components = [
        {
            "id": float(part.get("id")),
            "type": part.get("type"),
            "name": part.get("name"),
            "attributes": attributes(part),
        }
        for part in model.find("components")
    ]
    relations = [
        {
            "type": entry.get("type"),
            "refs": [{"id": float(r.get("id")), "role": r.get("role")} for r in entry],
        }
        for entry in reversed(model.find("relations"))
    ]
    stated = {
        "applicationId": model.get("applicationId"),
        "applicationVersion": model.get("applicationVersion"),
        "components": components,
        "relations": relations,
    }
    return json.dumps({"model": stated})


def test_planetary_sets_in_other_dress_say_the_same(tmp_path):
    """As JSON with its relations backwards, and with angles in radian and metres."""
    model = exported(tmp_path)
    expected = read(tmp_path / "set.rexs", ElementTree.tostring(model))
    assert read(tmp_path / "set.rexsj", as_json(model)) == expected

    factors = {"mm": ("m", 1e-3), "deg": ("rad", math.pi / 180.0)}
    for entry in model.iter("attribute"):
        if entry.get("unit") in factors and not len(entry):
            unit, factor = factors[entry.get("unit")]
            entry.set("unit", unit)
            entry.text = repr(float(entry.text) * factor)
    assert read(tmp_path / "metres.rexs", ElementTree.tostring(model)) == expected


def test_load_cases_of_a_planetary_set_become_its_duty(tmp_path):
    """Half and full torque, as hours; the carrier's torque follows by Willis."""
    model = exported(tmp_path)
    parts = {part.get("id"): part for part in model.find("components")}
    load = next(
        number
        for number, part in parts.items()
        if part.get("type") == "external_load"
        and any(entry.get("id") == "torque_around_u_axis" for entry in part)
    )
    unit = next(n for n, part in parts.items() if part.get("type") == "gear_unit")
    spectrum = ElementTree.SubElement(model, "load_spectrum", id="1")
    for place, (torque, hours) in enumerate(((60.0, 300.0), (120.0, 100.0)), 1):
        case = ElementTree.SubElement(spectrum, "load_case", id=str(place))
        for number, attribute, unit_, value in (
            (load, "torque_around_u_axis", "N m", torque),
            (unit, "operating_time", "h", hours),
        ):
            part = ElementTree.SubElement(case, "component", id=number)
            entry = ElementTree.SubElement(part, "attribute", id=attribute, unit=unit_)
            entry.text = str(value)
    (table,) = read(tmp_path / "cases.rexs", ElementTree.tostring(model))
    assert table["operation"]["duty"] == [
        {"torque": "60 N*m", "speed": "900 rpm", "share": 0.75},
        {"torque": "120 N*m", "speed": "900 rpm", "share": 0.25},
    ]


@pytest.mark.parametrize("written", ["", "nan"])
def test_a_centre_distance_that_is_not_stated_is_told(written, tmp_path):
    """It was left out without a word, and a ring's shift, whose sign goes by it, came
    in with the sign of the file.
    """
    scene = Scene.from_mapping(INTERNAL)
    model = ElementTree.fromstring(export_rexs(scene, "pair").content)
    entry = next(e for e in model.iter("attribute") if e.get("id") == "center_distance")
    entry.text = written
    file = tmp_path / "pair.rexs"
    file.write_bytes(ElementTree.tostring(model))
    draft = read_unit(file).draft(1)
    assert "centre_distance" not in draft.table()["gears"]
    told = [line for line in draft.missing if "gears.centre_distance" in line]
    assert told == [
        "gears.centre_distance: it follows from the profile shifts, the ring's with "
        "the sign that the file has"
    ]
