"""A campaign's gears, operation and lubricant as a REXS file, version 1.4."""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple
from xml.etree import ElementTree

from wearlab.materials import grades
from wearlab.options import Part
from wearlab.rexs.document import RexsError
from wearlab.rexs.stated import STATED
from wearlab.scene import Scene
from wearlab.version import __version__

VERSION = "1.4"
PLACES_OF_SET = {
    "kind",
    "module",
    "diametral_pitch",
    "transverse_diametral_pitch",
    "pressure_angle",
    "helix_angle",
    "face_width",
    "centre_distance",
    "material",
    "planets",
    "planet_angles",
}
PLACES_OF_GEAR = {
    "teeth",
    "profile_shift_coefficient",
    "tip_diameter",
    "root_diameter",
    "tip_chamfer",
    "usable_tip_diameter",
    "addendum_coefficient",
    "dedendum_coefficient",
    "fillet_radius_coefficient",
    "face_width",
    "material",
    "hand",
    "bore_diameter",
    "rim_diameter",
    "tooth_thickness_allowance",
    "roughness_ra",
    "tip_relief",
    "lead_crowning",
    "end_relief",
}
PLACES_OF_OPERATION = {"torque", "speed", "power", "input", "output", "fixed", "duty"}
PLACES_OF_OIL = {
    "viscosity",
    "pressure_viscosity",
    "kinematic_viscosity_40",
    "kinematic_viscosity_100",
    "density",
    "temperature",
}
"""Keys of a campaign file that REXS has a place for."""


class Exported(NamedTuple):
    """A REXS file, and what has no place in it.

    Parameters
    ----------
    content : its bytes
    no_place : dotted keys of the study that are not in it
    """

    content: bytes
    no_place: tuple[str, ...]


class _Writer:
    """Collects components and relations, each with a number of its own."""

    def __init__(self) -> None:
        self.components = ElementTree.Element("components")
        self.relations = ElementTree.Element("relations")

    def component(
        self, type_: str, name: str, attributes: Mapping[str, tuple[Any, str] | None]
    ) -> str:
        """Add a component; return its number."""
        number = str(len(self.components) + 1)
        element = ElementTree.SubElement(
            self.components, "component", id=number, type=type_, name=name
        )
        _add_attributes(element, attributes)
        return number

    def relate(self, type_: str, **members: str) -> None:
        """Add a relation of some components."""
        number = str(len(self.relations) + 1)
        relation = ElementTree.SubElement(
            self.relations, "relation", id=number, type=type_
        )
        for role, component in members.items():
            ElementTree.SubElement(relation, "ref", id=component, role=role)


def _add_attributes(
    element: ElementTree.Element, attributes: Mapping[str, tuple[Any, str] | None]
) -> None:
    """Add attributes that have a value."""
    for key, pair in attributes.items():
        if pair is None:
            continue
        value, unit = pair
        attribute = ElementTree.SubElement(element, "attribute", id=key, unit=unit)
        if isinstance(value, list):
            array = ElementTree.SubElement(attribute, "array")
            for number in value:
                ElementTree.SubElement(array, "c").text = _text(number)
        else:
            attribute.text = _text(value)


def _text(value: Any) -> str:
    """Return a value as REXS writes it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:.12g}" if isinstance(value, float) else str(value)


def _scaled(value: float | None, factor: float, unit: str) -> tuple[float, str] | None:
    """Return an SI value in the unit of the format, None where there is none."""
    return None if value is None else (value * factor, unit)


def export_rexs(scene: Scene, title: str) -> Exported:
    """Return the gears, operation and lubricant of a scene as a REXS file.

    Parameters
    ----------
    scene : with gears and an operation
    title : name of the gear unit

    Raises
    ------
    RexsError : the scene has no operation

    Notes
    -----
    Units are those of the format: mm, degrees, 1/min, N m. The file states by name
    which keys the study has, so that an import leaves the others to their defaults.
    """
    if scene.operation is None:
        raise RexsError("a REXS file needs [operation]: torque and speed")

    writer = _Writer()
    unit = writer.component(
        "gear_unit", title, {STATED: (_stated(scene.operation), "none")}
    )
    casing = writer.component("gear_casing", "casing", _temperature(scene))
    writer.relate("assembly", assembly=unit, part=casing)
    if scene.gears.descriptor.kind == "planetary":
        shafts = _planetary(writer, unit, casing, scene)
    else:
        shafts = _pair(writer, unit, scene)

    spectrum = _loads(writer, unit, shafts, scene)
    _oil(writer, casing, scene)
    return Exported(_document(writer, spectrum), tuple(_no_place(scene)))


def _document(writer: _Writer, spectrum: ElementTree.Element | None) -> bytes:
    """Return the whole file."""
    model = ElementTree.Element(
        "model",
        version=VERSION,
        applicationId="wearlab",
        applicationVersion=__version__,
    )
    model.extend([writer.relations, writer.components])
    if spectrum is not None:
        model.append(spectrum)
    ElementTree.indent(model)
    content: bytes = ElementTree.tostring(model, "utf-8", xml_declaration=True)
    return content + b"\n"


def _stated(part: Part) -> str:
    """Return the names of the keys that a study states, in a line."""
    return " ".join(sorted(_stated_keys(part)))


def _stated_keys(part: Part) -> set[str]:
    """Return the keys of a part that have a value."""
    return {key for key, value in part if value is not None}


def _no_place(scene: Scene) -> Iterator[str]:
    """Yield the dotted keys that are not at their default and have no place in REXS."""
    from wearlab.scene.identity import essence

    parts: list[tuple[str, Part | None, set[str]]] = [
        ("gears", scene.gears, PLACES_OF_SET | set(scene.gears.descriptor.members)),
        *(
            (f"gears.{name}", gear, PLACES_OF_GEAR)
            for name, gear in scene.gears.gears().items()
        ),
        ("operation", scene.operation, PLACES_OF_OPERATION),
        ("lubricant", scene.lubricant, PLACES_OF_OIL),
    ]
    oil = scene.lubricant
    if oil is not None and oil.kinematic_viscosity_40 is None:
        yield "lubricant.viscosity"

    for name, gear in scene.gears.gears().items():
        if gear.tip_relief is not None and gear.tip_relief.start_roll_angle is not None:
            yield f"gears.{name}.tip_relief.start_roll_angle"

    carrier = getattr(scene.gears, "carrier", None)
    parts.append(("gears.carrier", carrier, set()))
    for section, part, places in parts:
        if part is not None:
            keys = sorted(set(essence(part)) - places)
            yield from (f"{section}.{key}" for key in keys)


def _shaft(writer: _Writer, unit: str, name: str) -> str:
    """Add a shaft of the gear unit; return its number."""
    shaft = writer.component("shaft", name, {})
    writer.relate("assembly", assembly=unit, part=shaft)
    return shaft


def _pair(writer: _Writer, unit: str, scene: Scene) -> dict[str, str]:
    """Add a pair; return the shaft of each member."""
    gears = scene.gears.gears()
    shafts = {name: _shaft(writer, unit, name) for name in gears}
    numbers = {
        name: _gear(writer, scene, name, shafts[name], (0.0, 0.0)) for name in gears
    }
    stage = _stage(writer, unit, scene, scene.gears, _distances(scene)[0])
    first, second = numbers.values()
    writer.relate("stage", stage=stage, gear_1=first, gear_2=second)
    return shafts


def _stage(
    writer: _Writer, assembly: str, scene: Scene, part: Part, distance: float
) -> str:
    """Add a pair of gears as a stage of an assembly; return its number."""
    stage = writer.component(
        "cylindrical_stage",
        "stage",
        {
            "center_distance": (distance, "mm"),
            "common_face_width": _scaled(scene.gears.face_width, 1e3, "mm"),
            STATED: (_stated(part), "none"),
        },
    )
    writer.relate("assembly", assembly=assembly, part=stage)
    return stage


def _distances(scene: Scene) -> list[float]:
    """Return the centre distance of each kind of mesh, given or derived [mm]."""
    from wearlab.assembly import sets

    gears = sets.build_set(scene.in_heaviest_condition)
    return [
        1e3 * float(kind.pair.centre_distance) for kind in gears.kind_of_each_section
    ]


def _planetary(writer: _Writer, unit: str, casing: str, scene: Scene) -> dict[str, str]:
    """Add a planetary stage; return the shaft of each central member."""
    options: Any = scene.gears
    stage = writer.component(
        "planetary_stage", "planetary stage", {STATED: (_stated(options), "none")}
    )
    writer.relate("assembly", assembly=unit, part=stage)
    shafts = {name: _shaft(writer, unit, name) for name in ("sun", "ring", "carrier")}
    for name in ("sun", "ring"):
        writer.relate("central_shaft", planetary_stage=stage, shaft=shafts[name])
    writer.relate(
        "planet_carrier_shaft", planetary_stage=stage, shaft=shafts["carrier"]
    )

    sun = _gear(writer, scene, "sun", shafts["sun"], (0.0, 0.0))
    ring = _gear(writer, scene, "ring", shafts["ring"], (0.0, 0.0))
    distances = _distances(scene)
    for angle in _planet_angles(options):
        place = (distances[0] * math.cos(angle), distances[0] * math.sin(angle))
        shaft = _shaft(writer, unit, "planet")
        writer.relate("planet_shaft", planetary_stage=stage, shaft=shaft)
        planet = _gear(writer, scene, "planet", shaft, place)
        for mate, distance in ((sun, distances[0]), (ring, distances[1])):
            mesh = _stage(writer, stage, scene, options, distance)
            writer.relate("stage", stage=mesh, gear_1=planet, gear_2=mate)

    fixed = getattr(scene.operation, "fixed", None)
    if fixed is not None:
        joint = writer.component("coupling", f"{fixed} to casing", {})
        writer.relate(
            "side", assembly=joint, inner_part=shafts[fixed], outer_part=casing
        )
    return shafts


def _planet_angles(options: Any) -> Iterable[float]:
    """Return the angles of the planets [rad], equal ones where none are given."""
    if options.planet_angles is not None:
        return [float(angle) for angle in options.planet_angles]
    return [2.0 * math.pi * place / options.planets for place in range(options.planets)]


def _gear(
    writer: _Writer, scene: Scene, name: str, shaft: str, place: tuple[float, float]
) -> str:
    """Add a gear with its flanks, tool and material; return its number."""
    gear: Any = scene.gears.gears()[name]
    is_ring = name == "ring"
    face = gear.face_width if gear.face_width is not None else scene.gears.face_width
    allowance = gear.tooth_thickness_allowance
    cosine = math.cos(scene.gears.pressure_angle)
    attributes = {
        "number_of_teeth": (int(gear.teeth), "none"),
        "normal_module": _scaled(scene.gears.module, 1e3, "mm"),
        "helix_angle_reference_diameter": (_helix(scene, name), "deg"),
        "face_width": _scaled(face, 1e3, "mm"),
        "tip_diameter": _scaled(gear.tip_diameter, 1e3, "mm"),
        "root_diameter": _scaled(gear.root_diameter, 1e3, "mm"),
        "usable_addendum_circle_diameter": _scaled(gear.usable_tip_diameter, 1e3, "mm"),
        "addendum_coefficient_basic_profile": _scaled(
            gear.addendum_coefficient, 1.0, "none"
        ),
        "inner_diameter": None if is_ring else _scaled(gear.bore_diameter, 1e3, "mm"),
        "outer_diameter": _scaled(gear.rim_diameter, 1e3, "mm") if is_ring else None,
        "support_vector": ([0.0, *place], "mm"),
        STATED: (_stated(gear), "none"),
    }
    if allowance is not None:
        for end in ("upper", "lower"):
            attributes[f"{end}_backlash_allowance_referenced_to_span"] = (
                getattr(allowance, end) * cosine * 1e3,
                "mm",
            )
    number = writer.component(
        "ring_gear" if is_ring else "cylindrical_gear", name, attributes
    )
    writer.relate("assembly", assembly=shaft, part=number)
    _flanks(writer, scene, gear, number)
    _material(writer, scene, gear, number)
    return number


def _helix(scene: Scene, name: str) -> float:
    """Return the helix angle of a member, positive for a right hand [deg]."""
    if not scene.gears.helix_angle:
        return 0.0
    hand = scene.hands()[name]
    sign = 1.0 if hand == "right" else -1.0
    return sign * math.degrees(scene.gears.helix_angle)


def _flanks(writer: _Writer, scene: Scene, gear: Any, number: str) -> None:
    """Add the two flanks of a gear, alike, and the tool that makes them."""
    relief = gear.tip_relief
    ends = gear.end_relief
    attributes: dict[str, tuple[Any, str] | None] = {
        "normal_pressure_angle": (math.degrees(scene.gears.pressure_angle), "deg"),
        "addendum_modification_coefficient": _scaled(
            gear.profile_shift_coefficient, 1.0, "none"
        ),
    }
    attributes["arithmetic_average_roughness_flank"] = _scaled(
        gear.roughness_ra, 1e6, "mum"
    )
    attributes["tooth_tip_chamfer"] = _scaled(gear.tip_chamfer, 1e3, "mm")
    if relief is not None:
        attributes |= {
            "tip_relief_depth": _scaled(relief.amount, 1e6, "mum"),
            "tip_relief_datum_length": _scaled(relief.length, 1e3, "mm"),
            "tip_relief_datum_diameter": _scaled(relief.start_diameter, 1e3, "mm"),
            "shape_of_relief": (relief.shape, "none"),
        }
    for side in ("datum_face", "non_datum_face"):
        attributes[f"helix_crowning_amount_{side}"] = _scaled(
            gear.lead_crowning, 1e6, "mum"
        )
        if ends is not None:
            attributes[f"end_relief_depth_{side}"] = _scaled(ends.amount, 1e6, "mum")
            attributes[f"end_relief_length_{side}"] = _scaled(ends.length, 1e3, "mm")

    flanks = {
        side: writer.component("cylindrical_gear_flank", side, attributes)
        for side in ("left", "right")
    }
    writer.relate("flank", gear=number, left=flanks["left"], right=flanks["right"])
    tool = writer.component(
        "rack_shaped_tool",
        "tool",
        {
            "addendum_coefficient_reference_profile": _scaled(
                gear.dedendum_coefficient, 1.0, "none"
            ),
            "tip_radius_factor": _scaled(gear.fillet_radius_coefficient, 1.0, "none"),
        },
    )
    for flank in flanks.values():
        writer.relate("manufacturing_step", workpiece=flank, tool=tool)


def _material(writer: _Writer, scene: Scene, gear: Any, number: str) -> None:
    """Add the material of a gear."""
    material = gear.material if gear.material is not None else scene.gears.material
    component = writer.component(
        "material",
        material.name or "material",
        {
            "elastic_modulus": _scaled(material.cold_modulus, 1e-6, "N / mm^2"),
            "poisson_ratio": (material.poisson_ratio, "none"),
            "density": _scaled(material.density, 1e-3, "kg / dm^3"),
            "surface_hardness_vickers": _scaled(
                material.hardness, 1.0 / grades.KGF_PER_MM2, "HV"
            ),
        },
    )
    writer.relate("reference", origin=number, referenced=component)


def _temperature(scene: Scene) -> dict[str, tuple[Any, str] | None]:
    """Return the temperature of the oil as an attribute of the casing."""
    temperature = getattr(scene.lubricant, "temperature", None)
    if temperature is None:
        return {}
    return {"temperature_lubricant": (temperature - 273.15, "C")}


def _oil(writer: _Writer, casing: str, scene: Scene) -> None:
    """Add the lubricant where its viscosities are given at 40 and 100 degrees."""
    oil: Any = scene.lubricant
    if oil is None or getattr(oil, "kinematic_viscosity_40", None) is None:
        return
    component = writer.component(
        "lubricant",
        "lubricant",
        {
            "viscosity_at_40_degree_celsius": _scaled(
                oil.kinematic_viscosity_40, 1e6, "mm^2 / s"
            ),
            "viscosity_at_100_degree_celsius": _scaled(
                oil.kinematic_viscosity_100, 1e6, "mm^2 / s"
            ),
            "density_at_15_degree_celsius": _scaled(oil.density, 1e-3, "kg / dm^3"),
        },
    )
    writer.relate("reference", origin=casing, referenced=component)


def _loads(
    writer: _Writer, unit: str, shafts: dict[str, str], scene: Scene
) -> ElementTree.Element | None:
    """Add torque and speed of the input; return the load cases of a duty."""
    operation: Any = scene.operation
    is_one = not operation.several
    torque = (operation.torque, "N m") if is_one else None
    speed = _scaled(operation.speed, 30.0 / math.pi, "1 / min") if is_one else None
    load = writer.component(
        "external_load",
        "input",
        {
            "transmits_torque": (True, "none"),
            "defines_torque": (True, "none"),
            "torque_around_u_axis": torque,
        },
    )
    reaction = writer.component(
        "external_load",
        "output",
        {"transmits_torque": (True, "none"), "defines_torque": (False, "none")},
    )
    driving = shafts[operation.input]
    writer.relate("assembly", assembly=driving, part=load)
    writer.relate("assembly", assembly=shafts[operation.output], part=reaction)
    shaft = next(part for part in writer.components if part.get("id") == driving)
    _add_attributes(shaft, {"defines_speed": (True, "none"), "rotational_speed": speed})
    if not operation.blocks:
        return None

    spectrum = ElementTree.Element("load_spectrum", id="1")
    for place, block in enumerate(operation.blocks, 1):
        case = ElementTree.SubElement(spectrum, "load_case", id=str(place))
        for component, attributes in (
            (unit, {"load_duration_fraction": (100.0 * block.share, "%")}),
            (driving, {"rotational_speed": (block.speed * 30.0 / math.pi, "1 / min")}),
            (load, {"torque_around_u_axis": (float(block.torque), "N m")}),
        ):
            entry = ElementTree.SubElement(case, "component", id=component)
            _add_attributes(entry, attributes)
    return spectrum
