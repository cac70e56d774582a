"""A made-up gear unit of two stages in REXS, as XML or JSON, to read in tests."""

import json
from typing import Any
from xml.etree import ElementTree

TORQUE = 420.0  # N m on the input shaft, first load case
SPEEDS = (1450.0, -300.0)  # 1/min of the input shaft; torque has the same sign
PINION, WHEEL, SECOND_PINION, SECOND_WHEEL = 21, 62, 19, 58

PLANETARY: dict[str, Any] = {
    "gears": {
        "kind": "planetary",
        "module": "2 mm",
        "face_width": "25 mm",
        "planets": 3,
        "sun": {"teeth": 20, "profile_shift_coefficient": 0.2},
        "planet": {"teeth": 31, "bore_diameter": "30 mm"},
        "ring": {"teeth": 82, "rim_diameter": "200 mm"},
        "centre_distance": "51.4 mm",
    },
    "operation": {"torque": "120 N*m", "speed": "900 rpm"},
    "mesh": {},
}
"""A set that goes out as REXS and comes back."""

Attributes = dict[str, tuple[Any, str]]


def _gear(
    teeth: int, helix: float, u: float, distance: float, module: float
) -> Attributes:
    return {
        "number_of_teeth": (teeth, "none"),
        "normal_module": (module, "mm"),
        "helix_angle_reference_diameter": (helix, "°"),
        "face_width": (40.0, "mm"),
        "u_coordinate_on_shaft": (u, "mm"),
        "support_vector": ([u, distance, 0.0], "mm"),
    }


COMPONENTS: dict[int, tuple[str, str, Attributes]] = {
    1: ("gear_unit", "two stages", {}),
    2: ("gear_casing", "casing", {}),
    3: ("shaft", "input", {"defines_speed": (True, "")}),
    4: ("shaft", "middle", {"defines_speed": (False, "")}),
    5: ("shaft", "output", {}),
    6: ("cylindrical_stage", "fast", {"center_distance": (129.3, "mm")}),
    7: ("cylindrical_stage", "slow", {"center_distance": (118000.0, "mum")}),
    8: ("cylindrical_gear", "pinion 1", _gear(PINION, 12.0, 50.0, 0.0, 3.0)),
    9: ("cylindrical_gear", "wheel 1", _gear(WHEEL, -12.0, 54.0, 129.3, 3.0)),
    10: ("cylindrical_gear", "pinion 2", _gear(SECOND_PINION, 0.0, 150.0, 129.3, 3.0)),
    11: ("cylindrical_gear", "wheel 2", _gear(SECOND_WHEEL, 0.0, 150.0, 247.3, 3.0)),
    12: (
        "cylindrical_gear_flank",
        "left",
        {"normal_pressure_angle": (20.0, "deg")},
    ),
    13: (
        "cylindrical_gear_flank",
        "right",
        {
            "normal_pressure_angle": (20.0, "deg"),
            "addendum_modification_coefficient": (0.21, ""),
            "arithmetic_average_roughness_flank": (0.4, "mum"),
        },
    ),
    14: (
        "rack_shaped_tool",
        "hob",
        {
            "addendum_coefficient_reference_profile": (1.4, "none"),
            "tip_radius_factor": (0.3, "none"),
        },
    ),
    15: (
        "material",
        "case-hardened",
        {
            "elastic_modulus": (206.0, "GPa"),
            "poisson_ratio": (0.3, "none"),
            "density": (7.83, "kg / dm^3"),
            "surface_hardness_vickers": (720.0, "HV"),
        },
    ),
    16: (
        "material",
        "rigid",
        {"elastic_modulus": (2.1e8, "N / mm^2"), "poisson_ratio": (0.3, "none")},
    ),
    17: (
        "lubricant",
        "oil",
        {
            "viscosity_at_40_degree_celsius": (220.0, "cSt"),
            "viscosity_at_100_degree_celsius": (19.0, "mm^2 / s"),
            "density_at_15_degree_celsius": (890.0, "kg/m^3"),
        },
    ),
    18: (
        "external_load",
        "motor",
        {"transmits_torque": (True, ""), "defines_torque": (True, "")},
    ),
    19: (
        "external_load",
        "machine",
        {"transmits_torque": (True, ""), "defines_torque": (False, "")},
    ),
    20: ("worm_stage", "worm at the fan", {}),
}
RELATIONS: list[tuple[str, dict[str, int]]] = [
    ("stage", {"stage": 6, "gear_1": 8, "gear_2": 9}),
    ("stage", {"stage": 7, "gear_1": 11, "gear_2": 10}),
    ("assembly", {"assembly": 3, "part": 8}),
    ("assembly", {"assembly": 4, "part": 9}),
    ("assembly", {"assembly": 4, "part": 10}),
    ("assembly", {"assembly": 5, "part": 11}),
    ("assembly", {"assembly": 3, "part": 18}),
    ("assembly", {"assembly": 5, "part": 19}),
    ("flank", {"gear": 8, "left": 12, "right": 13}),
    ("manufacturing_step", {"workpiece": 13, "tool": 14}),
    ("reference", {"origin": 8, "referenced": 15}),
    ("reference", {"origin": 4, "referenced": 16}),
    ("reference", {"origin": 2, "referenced": 17}),
]
CASES: list[dict[int, Attributes]] = [
    {
        1: {"load_duration_fraction": (60.0, "%")},
        2: {"temperature_lubricant": (65.0, "C")},
        3: {"rotational_speed": (SPEEDS[0], "1 / min")},
        18: {"torque_around_u_axis": (TORQUE, "N m")},
    },
    {
        1: {"load_duration_fraction": (40.0, "%")},
        2: {"temperature_lubricant": (65.0, "C")},
        3: {"rotational_speed": (SPEEDS[1], "1 / min")},
        18: {"torque_around_u_axis": (-0.25, "kN m")},
    },
]


def as_xml(version: str = "1.4") -> str:
    """Return the gear unit as XML."""
    model = ElementTree.Element(
        "model", version=version, applicationId="made up", applicationVersion="1"
    )
    relations = ElementTree.SubElement(model, "relations")
    for place, (kind, members) in enumerate(RELATIONS, 1):
        relation = ElementTree.SubElement(
            relations, "relation", id=str(place), type=kind
        )
        for role, number in members.items():
            ElementTree.SubElement(relation, "ref", id=str(number), role=role)

    components = ElementTree.SubElement(model, "components")
    for number, (kind, name, attributes) in COMPONENTS.items():
        entry = ElementTree.SubElement(
            components, "component", id=str(number), type=kind, name=name
        )
        _add(entry, attributes)

    spectrum = ElementTree.SubElement(model, "load_spectrum", id="1")
    for place, case in enumerate(CASES, 1):
        block = ElementTree.SubElement(spectrum, "load_case", id=str(place))
        for number, attributes in case.items():
            _add(ElementTree.SubElement(block, "component", id=str(number)), attributes)
    return ElementTree.tostring(model, "unicode")


def _add(entry: ElementTree.Element, attributes: Attributes) -> None:
    for key, (value, unit) in attributes.items():
        attribute = ElementTree.SubElement(entry, "attribute", id=key, unit=unit)
        if isinstance(value, list):
            array = ElementTree.SubElement(attribute, "array")
            for number in value:
                ElementTree.SubElement(array, "c").text = str(number)
        else:
            attribute.text = (
                str(value).lower() if isinstance(value, bool) else str(value)
            )


def as_json(version: str = "1.4") -> str:
    """Return the same gear unit as JSON."""
    model = {
        "version": version,
        "applicationId": "made up",
        "applicationVersion": "1",
        "relations": [
            {
                "id": place,
                "type": kind,
                "refs": [{"id": n, "role": role} for role, n in members.items()],
            }
            for place, (kind, members) in enumerate(RELATIONS, 1)
        ],
        "components": [
            {
                "id": number,
                "type": kind,
                "name": name,
                "attributes": _listed(attributes),
            }
            for number, (kind, name, attributes) in COMPONENTS.items()
        ],
        "load_spectrum": {
            "id": 1,
            "load_cases": [
                {
                    "id": place,
                    "components": [
                        {"id": number, "attributes": _listed(attributes)}
                        for number, attributes in case.items()
                    ],
                }
                for place, case in enumerate(CASES, 1)
            ],
        },
    }
    return json.dumps({"model": model})


def _listed(attributes: Attributes) -> list[dict[str, Any]]:
    return [
        {"id": key, "unit": unit, _type(value): value}
        for key, (value, unit) in attributes.items()
    ]


def _type(value: Any) -> str:
    if isinstance(value, bool):
        return "boolean"
    return "floating_point_array" if isinstance(value, list) else "floating_point"
