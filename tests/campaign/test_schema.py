import json
import tomllib

import jsonschema
import pytest
from scenes import CAMPAIGNS

from wearlab.campaign import schema_json
from wearlab.scene.sections import MEMBERS, Sections, parts_at
from wearlab.units import KINDS, quantity

SCHEMA = json.loads(schema_json())
DIMENSIONAL = {
    "loss",
    "helix_angle",
    "equivalent_misalignment",
    "lead_crowning",
    "lead_slope",
    "bias",
    "misalignment",
    "in_plane",
    "out_of_plane",
    "amplitude",
    "centre_distance",
    "damping",
    "density",
    "depth",
    "face_width",
    "hardness",
    "inertia",
    "length",
    "mass",
    "module",
    "normal_backlash",
    "phase",
    "preload",
    "pressure_angle",
    "pressure_viscosity",
    "amount",
    "kinematic_viscosity_40",
    "kinematic_viscosity_100",
    "start_diameter",
    "start_roll_angle",
    "temperature",
    "axial_damping",
    "axial_stiffness",
    "radial_stiffness",
    "root_diameter",
    "roughness_ra",
    "speed",
    "tip_diameter",
    "torque",
    "torsional_damping",
    "torsional_stiffness",
    "tangential_stiffness",
    "total_composite",
    "viscosity",
    "youngs_modulus",
    "carrier",
    "threshold",
    "rim_diameter",
    "pin_circle_diameter",
    "planet_angles",
    "planet_position",
    "eccentricity",
    "power",
    "smooth",
    "bore_diameter",
    "profile_crowning",
    "profile_slope",
    "tooth_composite",
    "pitch",
    "values",
    "fm",
    "am_phase",
    "worn_mass",
    "allowable_contact_stress",
    "viscosity_40",
}


def properties(node=SCHEMA, name="campaign"):
    """Yield every property of the schema with its owner and name."""
    for key, inner in node.get("properties", {}).items():
        yield name, key, inner
    for key, inner in node.get("$defs", {}).items():
        yield from properties(inner, key)


PROPERTIES = list(properties())


def test_every_option_says_what_it_means():
    assert len(PROPERTIES) > 500
    tables = {"campaign": SCHEMA["anyOf"][0]} | SCHEMA["$defs"]
    for owner, key, node in PROPERTIES:
        place = f"{owner}.{key}"
        assert len(node["description"]) > 3, place
        alternatives = [tables[owner], *tables[owner].get("anyOf", [])]
        needed = any(key in table.get("required", []) for table in alternatives)
        told = needed or {
            "default",
            "derived",
            "$ref",
        } & set(node)
        assert told, f"{place}: neither required, nor a default"
        if "unit" in node:
            kind = KINDS[node["kind"]]
            assert node["unit"] == kind.unit and node["type"] == "string", place
            assert quantity(node["examples"][0], kind.name), place
            if "default" in node:
                quantity(node["default"], kind.name)


def leaves(node):
    return (
        [node]
        + [
            leaf
            for key in ("anyOf", "oneOf")
            for inner in node.get(key, [])
            for leaf in leaves(inner)
        ]
        + (leaves(node["items"]) if isinstance(node.get("items"), dict) else [])
    )


def test_every_dimensional_option_has_a_unit():
    exponents = {"CheckBlock", "PopulationBlock"}  # whose power is one
    columns = {"Columns", "RecordColumns"}  # which name a column of a file
    plain = {"StiffnessUnits", "ProfileUnits", *columns, *exponents}
    for owner, key, node in PROPERTIES:
        if (
            key in DIMENSIONAL
            and owner not in plain
            and "$ref" not in node
            and node.get("type") != "object"
        ):
            assert any("unit" in leaf for leaf in leaves(node)), f"{owner}.{key}"


def test_every_dimensional_option_is_known_to_this_test():
    measured = {
        key
        for _, key, node in PROPERTIES
        if any("unit" in leaf for leaf in leaves(node))
    }
    assert measured - DIMENSIONAL <= {
        "hours",
        "volume",
        "usable_tip_diameter",
        "tip_chamfer",
        "tooth_thickness_allowance",
        "upper",
        "lower",
        "frequency",
        "longest",
        "value",
        "mean",
        "carrier_phase",
        "longest_reference",
        "fm_phase",
        "installation",
        "from",
        "to",
        "sun_planet",
        "planet_ring",
        "ambient",
        "area",
        "resistance",
        "service_temperature",
        "thermal_expansion",
    }


def test_every_key_of_a_scene_is_in_the_schema():
    known = {key for _, key, _ in PROPERTIES}
    pending = [()]
    while pending:
        path = pending.pop()
        parts = parts_at(path)
        members = MEMBERS if any(part.per_member for part in parts) else ()
        for key in {*(key for part in parts for key in part.model_fields), *members}:
            assert key in known or key in ("along", "abscissa", "ordinate", "across"), (
                path,
                key,
            )
            if parts_at((*path, key)) and key not in path:
                pending.append((*path, key))


def test_sources_are_explained():
    codes = {
        node["source"].split()[0].rstrip(",")
        for _, _, node in PROPERTIES
        if "source" in node
    }
    assert {code for code in codes if code[0] in "LWYB" and code[1:].isdigit()} <= set(
        SCHEMA["sources"]
    )


def test_choices_may_be_written_as_a_word():
    stiffness = SCHEMA["$defs"]["MeshSection"]["properties"]["stiffness"]
    words = ["finite-element", "potential-energy", "vdi-2736"]
    assert stiffness["anyOf"][0] == {"enum": words}
    assert stiffness["default"] == "finite-element"
    assert SCHEMA["$defs"]["WearSection"]["properties"]["step"]["default"] == "adaptive"
    assert (
        SCHEMA["$defs"]["DisplacementContact"]["properties"]["threshold"]["default"]
        == "0.0001 rad"
    )
    assert (
        SCHEMA["$defs"]["ExternalPair"]["properties"]["pressure_angle"]["default"]
        == "20 deg"
    )
    assert SCHEMA["$defs"]["Numerics"]["properties"]["tolerance"]["minimum"] == 1e-10


def test_flanks_are_named_as_in_files():
    flanks = {"pinion", "gear", "sun", "planet-sun", "planet-ring", "ring"}
    assert set(SCHEMA["$defs"]["InitialWears"]["properties"]) == flanks
    assert {"sun_planet", "planet_ring"} < set(
        SCHEMA["$defs"]["MeshSection"]["properties"]
    )


def allows(node, value):
    """Return whether a value fits a schema, by the keywords that wearlab's own uses."""
    if "$ref" in node:
        return allows(SCHEMA["$defs"][node["$ref"].removeprefix("#/$defs/")], value)
    if any(
        not any(allows(inner, value) for inner in node[key])
        for key in ("anyOf", "oneOf")
        if key in node
    ):
        return False
    if ("const" in node and value != node["const"]) or (
        "enum" in node and value not in node["enum"]
    ):
        return False
    if "type" in node and not isinstance(value, TYPES[node["type"]]):
        return False
    if isinstance(value, bool) and node.get("type") in ("number", "integer"):
        return False
    if isinstance(value, dict):
        known = node.get("properties", {})
        more = node.get("additionalProperties", True)
        return all(key in value for key in node.get("required", [])) and all(
            allows(known.get(key, more if isinstance(more, dict) else {}), inner)
            and (key in known or more is not False)
            for key, inner in value.items()
        )
    if isinstance(value, list) and isinstance(node.get("items"), dict):
        return all(allows(node["items"], inner) for inner in value)
    return True


TYPES = {
    "object": dict,
    "array": list,
    "string": str,
    "number": (int, float),
    "integer": int,
    "boolean": bool,
}
WRITTEN = {
    file: tomllib.loads(file.read_text()) for file in sorted(CAMPAIGNS.rglob("*.toml"))
}
WHOLE = [
    file
    for file, written in WRITTEN.items()
    if "gears" in written and not {"extends", "plugins"} & set(written)
]


@pytest.mark.parametrize("file", WHOLE, ids=[file.stem for file in WHOLE])
def test_campaigns_fit_the_schema(file):
    written = json.loads(
        json.dumps(tomllib.loads(file.read_text()), default=str)
    )  # a day, as editors have it
    assert allows(SCHEMA, written)
    assert not allows(
        SCHEMA, {**written, "gears": {**written["gears"], "modul": "3 mm"}}
    )
    assert not allows(
        SCHEMA, {**written, "operation": {**written["operation"], "torque": 3}}
    )
    assert not allows(
        SCHEMA, {key: value for key, value in written.items() if key != "gears"}
    )


def test_top_level_keys():
    own = {
        "title",
        "reference",
        "extends",
        "drop",
        "metadata",
        "plugins",
        "sweep",
        "case",
        "figure",
        "claim",
        "readings",
        "expect",
        "exclude",
        "update",
        "report",
    }
    demands = [["gears", "operation"], ["extends"]]
    assert SCHEMA["anyOf"] == [{"required": keys} for keys in demands]
    assert set(SCHEMA["properties"]) == own | set(Sections.model_fields)
    for file in CAMPAIGNS.rglob("*.toml"):
        assert set(tomllib.loads(file.read_text())) <= set(SCHEMA["properties"])


def test_loads_of_a_duty_are_quantities_or_ranges_of_two():
    validator = jsonschema.Draft202012Validator(
        {**SCHEMA["$defs"]["DutyBlock"], "$defs": SCHEMA["$defs"]}
    )
    one = {"torque": "340 N*m", "speed": ["1000 rpm", "1200 rpm"], "share": 1}
    assert validator.is_valid(one)
    assert not validator.is_valid({**one, "speed": ["1000 rpm"]})
    assert not validator.is_valid({**one, "torque": 340})
