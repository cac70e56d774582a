"""A study goes out as REXS and comes back as the same runs."""

import math
from pathlib import Path
from xml.etree import ElementTree

import pytest
from rexs_files import PLANETARY

import wearlab as wl
from wearlab.assembly.sets import build_set
from wearlab.cli import app
from wearlab.rexs.container import read_document
from wearlab.rexs.export import export_rexs
from wearlab.rexs.stages import read_unit
from wearlab.rexs.stated import STATED
from wearlab.scene import Scene

CAMPAIGNS = Path(__file__).parents[2] / "campaigns"
DRAWING = {
    "gears": {
        "kind": "external-pair",
        "module": "2.5 mm",
        "pressure_angle": "17.5 deg",
        "helix_angle": "14 deg",
        "face_width": "30 mm",
        "material": "18CrNiMo7-6",
        "pinion": {
            "teeth": 23,
            "hand": "left",
            "profile_shift_coefficient": 0.3,
            "tip_relief": {"amount": "12 um", "length": "2 mm", "shape": "parabolic"},
            "tooth_thickness_allowance": {"upper": "-50 um", "lower": "-80 um"},
            "roughness_ra": "0.32 um",
        },
        "gear": {
            "teeth": 47,
            "profile_shift_coefficient": -0.1,
            "lead_crowning": "8 um",
            "end_relief": {"amount": "10 um", "length": "4 mm"},
            "material": {
                "youngs_modulus": "176 GPa",
                "poisson_ratio": 0.28,
                "density": "7200 kg/m^3",
            },
        },
    },
    "operation": {"torque": "310 N*m", "speed": "1480 rpm", "input": "gear"},
    "mesh": {},
    "lubricant": {
        "kinematic_viscosity_40": "150 mm^2/s",
        "kinematic_viscosity_100": "14.7 mm^2/s",
        "density": "881 kg/m^3",
        "temperature": "72 degC",
    },
}


def _back(scene: Scene, tmp_path: Path) -> dict:
    """Return the sections of a scene that went out and came back."""
    path = tmp_path / "out.rexs"
    path.write_bytes(export_rexs(scene, "study").content)
    table = read_unit(path).draft(1).table()
    return {
        key: table[key] for key in ("gears", "operation", "lubricant") if key in table
    }


def _with_tip(**tip):
    """Return the drawing with more said of the pinion's tip."""
    gears = DRAWING["gears"]
    return {**DRAWING, "gears": {**gears, "pinion": {**gears["pinion"], **tip}}}


SPECTRUM = [
    {"torque": torque, "speed": speed, "share": share}
    for torque, speed, share in (
        ("0 N*m", "0 rpm", 0.25),
        ("345 N*m", "1200 rpm", 0.5),
        ("-210 N*m", "1180 rpm", 0.125),
        ("0 N*m", "1500 rpm", 0.125),
    )
]
"""At rest, loaded, reversed, idle."""


@pytest.mark.parametrize(
    "study",
    [
        {**DRAWING, "operation": {"duty": SPECTRUM}},
        PLANETARY,
        DRAWING,
        _with_tip(tip_chamfer="0.117 mm"),
        _with_tip(usable_tip_diameter="65.1 mm"),
        _with_tip(tip_diameter="65.7 mm", usable_tip_diameter="65.1 mm"),
    ],
    ids=["spectrum", "planetary", "drawing", "chamfer", "usable tip", "both diameters"],
)
def test_a_study_comes_back_as_the_same_run(study, tmp_path):
    scene = Scene.from_mapping(study)
    assert export_rexs(scene, "study").no_place == ()
    assert Scene.from_mapping({**study, **_back(scene, tmp_path)}).id == scene.id


@pytest.mark.parametrize(
    "name", ["helical_pair", "helical_load_spectrum", "spur_tip_relief", "running_in"]
)
def test_campaigns_come_back_as_the_same_runs(name, tmp_path):
    scene = wl.load(CAMPAIGNS / f"{name}.toml").cases[0].scene
    back = _back(scene, tmp_path)
    assert scene.replace(back).id == scene.id


def test_what_has_no_place_is_named(tmp_path):
    gears = {
        **PLANETARY["gears"],
        "carrier": {"mass": "3 kg", "inertia": "0.01 kg*m^2"},
    }
    operation = {**PLANETARY["operation"], "drive_flank": "left"}
    scene = Scene.from_mapping({**PLANETARY, "gears": gears, "operation": operation})
    assert export_rexs(scene, "study").no_place == (
        "operation.drive_flank",
        "gears.carrier.inertia",
        "gears.carrier.mass",
    )


def test_other_programs_find_numbers_in_their_units(tmp_path):
    """Nothing of the study's text is hidden in the file."""
    path = tmp_path / "out.rexs"
    path.write_bytes(export_rexs(Scene.from_mapping(DRAWING), "study").content)
    document = read_document(path)
    pinion = next(document.of_type("cylindrical_gear"))
    value = pinion.attributes["helix_angle_reference_diameter"]
    assert (value.value, value.unit) == (-14.0, "deg")
    span = pinion.attributes["upper_backlash_allowance_referenced_to_span"]
    assert span.value == pytest.approx(-0.05 * math.cos(math.radians(17.5)))
    stage = next(document.of_type("cylindrical_stage"))
    spur_distance = 0.5 * 2.5 * 70 / math.cos(math.radians(14.0))
    assert stage.attributes["center_distance"].value > spur_distance
    shaft = next(part for part in document.of_type("shaft") if part.name == "gear")
    assert shaft.attributes["rotational_speed"].value == pytest.approx(1480.0)
    assert b"[gears" not in path.read_bytes()


def test_planets_stand_on_their_circle_and_the_ring_is_fixed(tmp_path):
    path = tmp_path / "out.rexs"
    path.write_bytes(export_rexs(Scene.from_mapping(PLANETARY), "study").content)
    unit = read_unit(path)
    assert [(s.kind, s.teeth) for s in unit.stages] == [("planetary", (20, 31, 82))]
    draft = unit.draft(1)
    assert "planets at 0, 120, 240 deg" in draft.derived
    operation = draft.table()["operation"]
    assert operation["input"] == "sun"
    assert operation["torque"] == "120 N*m"


def test_ring_of_a_cutter_ends_its_involute_where_the_cutter_does(tmp_path):
    """23 teeth of addendum 1.25, no rounding: d_f 254 mm, d_Ff 252.651 mm."""
    gears = {
        "kind": "planetary",
        "module": "4 mm",
        "face_width": "50 mm",
        "planets": 3,
        "sun": {"teeth": 17, "fillet_radius_coefficient": 0.25},
        "planet": {"teeth": 22, "fillet_radius_coefficient": 0.25},
        "ring": {"teeth": 61, "rim_diameter": "280 mm"},
    }
    scene = Scene.from_mapping({**PLANETARY, "gears": gears})
    root = ElementTree.fromstring(export_rexs(scene, "study").content)
    tool = [c for c in root.iter("component") if c.get("type") == "rack_shaped_tool"][1]
    tool.set("type", "cutter_wheel_tool")
    for attribute in list(tool):
        if attribute.get("id") == "tip_radius_factor":
            tool.remove(attribute)
    ElementTree.SubElement(tool, "attribute", id="number_of_teeth", unit="").text = "23"
    for component in root.iter("component"):
        for attribute in list(component):
            if attribute.get("id") == STATED:
                component.remove(attribute)
    path = tmp_path / "cutter.rexs"
    path.write_bytes(ElementTree.tostring(root))

    table = read_unit(path).draft(1).table()
    del table["title"]
    assert table["gears"]["ring"]["root_diameter"] == "254 mm"
    read = Scene.from_mapping(table)
    ring = build_set(read).gears["ring"]
    assert 2e3 * ring.form_radius == pytest.approx(252.651, abs=5e-4)
    assert not any("reduced" in flag for flag in ring.assumed)


def test_commands_take_a_study_out_and_back(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    source = CAMPAIGNS / "helical_load_spectrum.toml"
    assert app.status_of(["export", str(source), "out.rexs"]) == 0
    assert app.status_of(["import", "out.rexs"]) == 0
    assert "external-pair" in capsys.readouterr().out

    assert app.status_of(["import", "out.rexs", "--stage", "1", "--out", "a.toml"]) == 0
    assert app.status_of(["check", "a.toml"]) == 0
    output = capsys.readouterr()
    assert "duty" in output.out

    # nothing that is there is written over
    assert app.status_of(["import", "out.rexs", "--stage", "1", "--out", "a.toml"]) == 2
    assert app.status_of(["import", "out.rexs", "--stage", "2"]) == 2
    assert app.status_of(["import", "out.rexs", "--out", "b.toml"]) == 2
    assert app.status_of(["import", "nowhere.rexs"]) == 2
    assert "nowhere.rexs: No such file" in capsys.readouterr().err
