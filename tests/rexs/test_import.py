"""Gear units of other programs come in as campaign files."""

import base64
import json
import math
import random
import struct
import time
import tomllib
import zipfile
from pathlib import Path

import pytest
import rexs_files as files

import wearlab as wl
from wearlab.gears.shifts import internal_position, operating_position
from wearlab.gears.specification import Basics
from wearlab.rexs import RexsError, read_rexs
from wearlab.rexs.document import Attribute, by_id
from wearlab.rexs.stages import read_unit
from wearlab.scene import Scene


@pytest.fixture
def gearbox(tmp_path: Path) -> Path:
    path = tmp_path / "gearbox.rexs"
    path.write_text(files.as_xml())
    return path


def _written(tmp_path: Path, text: str, name: str = "changed.rexs") -> Path:
    path = tmp_path / name
    path.write_text(text)
    return path


def test_stages_are_listed_and_a_worm_is_refused_by_name(gearbox):
    unit = read_unit(gearbox)
    assert [(s.name, s.kind, s.teeth, s.centre_distance) for s in unit.stages] == [
        ("fast", "external-pair", (21, 62), 129.3),
        ("slow", "external-pair", (19, 58), 118.0),
        ("worm at the fan", "", (), None),
    ]
    assert unit.stages[2].reason == (
        '"worm at the fan" is a worm_stage: wearlab has cylindrical gears and '
        "planetary sets only"
    )
    with pytest.raises(RexsError, match="worm_stage"):
        unit.draft(3)


def test_values_come_with_their_units_and_sources(gearbox):
    draft = read_unit(gearbox).draft(1)
    gears = draft.table()["gears"]
    assert gears["module"] == "3 mm"
    assert gears["helix_angle"] == "12 deg"
    assert gears["face_width"] == "36 mm"  # faces of 40 mm that stand 4 mm apart
    assert gears["pinion"] == {
        "teeth": 21,
        "face_width": "40 mm",
        "profile_shift_coefficient": 0.21,  # of the right flank
        "dedendum_coefficient": 1.4,  # the addendum of the tool
        "fillet_radius_coefficient": 0.3,
        "material": {
            "youngs_modulus": "206 GPa",
            "poisson_ratio": 0.3,
            "density": "7830 kg/m^3",
            "hardness": "720 HV",
        },
        "roughness_ra": "0.4 um",
        "hand": "right",
    }
    assert gears["gear"]["hand"] == "left"
    assert "material" not in gears["gear"]  # a rigid one is of a dummy shaft
    entry = draft.entries["gears.pinion"]["profile_shift_coefficient"]
    assert entry.comment == "component 13, addendum_modification_coefficient"
    left_out = "\n".join(draft.left_out)
    assert "left and right flank differ; the right one is taken" in left_out
    assert "rigid material" in left_out


def test_load_cases_become_a_duty_of_the_driving_gear(gearbox):
    unit = read_unit(gearbox)
    assert unit.draft(1).table()["operation"] == {
        "input": "pinion",
        "duty": [
            {"torque": "420 N*m", "speed": "1450 rpm", "share": 0.6},
            {"torque": "250 N*m", "speed": "300 rpm", "share": 0.4},
        ],
    }
    assert unit.draft(1, case=2).table()["operation"] == {
        "input": "pinion",
        "torque": "250 N*m",
        "speed": "300 rpm",
    }


def test_power_reaches_the_second_stage_without_losses(gearbox):
    first, second = read_unit(gearbox).draft(2).table()["operation"]["duty"]
    ratio = files.WHEEL / files.PINION
    assert float(first["torque"].split()[0]) == pytest.approx(files.TORQUE * ratio)
    assert float(first["speed"].split()[0]) == pytest.approx(1450.0 / ratio)
    assert float(second["torque"].split()[0]) == pytest.approx(250.0 * ratio)


def test_power_over_speed_is_a_torque(tmp_path):
    power = files.TORQUE * 1450.0 * math.pi / 30.0 / 1e3
    text = files.as_xml().replace(
        '<attribute id="torque_around_u_axis" unit="N m">420.0',
        f'<attribute id="power" unit="kW">{power!r}',
    )
    duty = read_unit(_written(tmp_path, text)).draft(1).table()["operation"]["duty"]
    assert float(duty[0]["torque"].split()[0]) == pytest.approx(files.TORQUE)


def test_a_gear_that_drives_the_pinion_is_the_input(tmp_path):
    text = (
        files.as_xml()
        .replace('unit="N m">420.0', 'unit="N m">-420.0')
        .replace('unit="kN m">-0.25', 'unit="kN m">0.25')
    )
    operation = read_unit(_written(tmp_path, text)).draft(1).table()["operation"]
    assert operation["input"] == "gear"
    ratio = files.WHEEL / files.PINION
    torque, unit = operation["duty"][0]["torque"].split()
    assert float(torque) == pytest.approx(420.0 * ratio)
    assert unit == "N*m"


def test_json_and_zip_give_what_xml_gives(gearbox, tmp_path):
    expected = read_rexs(gearbox)
    assert len(expected) == 2
    assert read_rexs(_written(tmp_path, files.as_json(), "gearbox.rexsj")) == expected

    packed = tmp_path / "gearbox.rexsz"
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("__MACOSX/._gearbox.rexs", "nothing")
        archive.writestr("gearbox.rexs", files.as_xml())
    assert read_rexs(packed) == expected
    assert read_rexs(_written(tmp_path, files.as_xml(), "wrong.suffix")) == expected


def test_names_of_version_2_and_of_version_1_are_read(gearbox, tmp_path):
    renamed = {
        "tip_radius_factor": "tip_corner_radius_factor_reference_profile",
        "arithmetic_average_roughness_flank": (
            "arithmetic_mean_roughness_flank_iso_4287_1997"
        ),
        "load_duration_fraction": "operating_time_fraction",
    }
    text = files.as_xml("2.0")
    for old, new in renamed.items():
        assert old in text
        text = text.replace(old, new)
    newer = _written(tmp_path, text, "newer.rexs")
    assert read_rexs(newer) == read_rexs(gearbox)

    older = files.as_xml("1.1").replace("cylindrical_gear_flank", "flank_geometry")
    older = older.replace(
        'type="manufacturing_step"><ref id="13" role="workpiece" /><ref id="14" '
        'role="tool" />',
        'type="ordered_reference" order="1"><ref id="8" role="origin" /><ref id="14" '
        'role="referenced" />',
    )
    assert "ordered_reference" in older
    assert read_rexs(_written(tmp_path, older, "old.rexs")) == read_rexs(gearbox)


def test_coded_arrays_are_those_written_out(gearbox, tmp_path):
    coded = base64.b64encode(struct.pack("<3d", 54.0, 129.3, 0.0)).decode()
    plain = "<array><c>54.0</c><c>129.3</c><c>0.0</c></array>"
    text = files.as_xml()
    assert plain in text
    whole = text.replace(plain, f'<array code="float64">{coded}</array>')
    assert read_rexs(_written(tmp_path, whole)) == read_rexs(gearbox)

    cut = text.replace(plain, f'<array code="float64">{coded[:-5]}</array>')
    with pytest.raises(RexsError, match="component 9, support_vector: the array is no"):
        read_rexs(_written(tmp_path, cut))


def test_a_value_of_the_wrong_type_is_refused(tmp_path):
    """It was taken as not given, and nothing said so but for the pressure angle."""
    document = json.loads(files.as_json())
    for component in document["model"]["components"]:
        for attribute in component["attributes"]:
            if attribute["id"] == "normal_pressure_angle":
                del attribute["floating_point"]
                attribute["boolean"] = False
    path = _written(tmp_path, json.dumps(document), "wrong.rexsj")
    with pytest.raises(RexsError, match=r"normal_pressure_angle: .False. is no number"):
        read_unit(path).draft(1)


@pytest.mark.parametrize("name", ["gear.rexs", "gear.rexsj"])
def test_an_attribute_twice_is_refused(tmp_path, name):
    """The last one was taken, in silence."""
    text = files.as_xml() if name.endswith("s") else files.as_json()
    one = {
        "gear.rexs": '<attribute id="face_width" unit="mm">40.0</attribute>',
        "gear.rexsj": '{"id": "face_width", "unit": "mm", "floating_point": 40.0}',
    }[name]
    joint = "" if name.endswith("s") else ", "
    assert one in text
    again = text.replace(one, joint.join([one, one.replace("40.0", "41.0")]), 1)
    with pytest.raises(
        RexsError, match=r"face_width: stands twice, with 40.0 mm and 41"
    ):
        read_unit(_written(tmp_path, again, name))
    same = text.replace(one, joint.join([one, one]), 1)
    assert read_unit(_written(tmp_path, same, name)).stages


def test_long_values_of_an_attribute_twice_are_cut_in_the_message():
    """A message held both arrays, a megabyte."""
    numbers = [float("nan"), *map(float, range(100_000))]
    more = Attribute([*numbers, 1.0], "mm")
    with pytest.raises(
        RexsError, match=r"stands twice, with .*… mm and .*… mm"
    ) as said:
        by_id("4", [("curve", Attribute(numbers, "mm")), ("curve", more)])
    assert len(str(said.value)) < 200
    alike = [float("nan"), *numbers[1:]]
    pair = [("curve", Attribute(values, "mm")) for values in (numbers, alike)]
    assert len(by_id("4", pair)["curve"].value) == len(numbers)


@pytest.mark.parametrize("value", ["n. a. yet", "0.2.1", "true", "1e999"])
def test_a_text_where_a_number_belongs_is_refused(tmp_path, value):
    """The default was taken for it, in silence."""
    shift = '<attribute id="addendum_modification_coefficient" unit="">'
    text = files.as_xml()
    assert f"{shift}0.21" in text
    path = _written(tmp_path, text.replace(f"{shift}0.21", shift + value))
    with pytest.raises(
        RexsError, match=r"component 13, addendum_mod.*is no number: mend"
    ):
        read_unit(path).draft(1)


def test_nonsense_is_left_out_and_named(tmp_path):
    text = files.as_xml().replace(
        '<attribute id="number_of_teeth" unit="none">62',
        '<attribute id="tip_diameter" unit="mm">1</attribute>'
        '<attribute id="number_of_teeth" unit="none">62',
    )
    draft = read_unit(_written(tmp_path, text)).draft(1)
    assert "tip_diameter" not in draft.table()["gears"]["gear"]
    assert any("component 9, tip_diameter = 1 mm" in line for line in draft.left_out)


def test_what_is_written_reads_as_a_campaign_that_can_be(gearbox):
    draft = read_unit(gearbox).draft(1)
    assert tomllib.loads(draft.text()) == draft.table()
    scene = Scene.from_mapping(
        {key: value for key, value in draft.table().items() if key != "title"}
    )
    assert scene.gears.pinion.teeth == 21
    assert scene.lubricant.temperature == pytest.approx(338.15)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "neither XML nor JSON"),
        (b"teeth,21", "neither XML nor JSON"),
        (b"<gears/>", "not the <model>"),
        (b"<model><components>", "no whole XML"),
        (b"<!DOCTYPE model [<!ENTITY a 'b'>]><model/>", "a DOCTYPE stands in it"),
        (b'{"gears": 1}', 'no "model"'),
        (b'{"model": {"components": 3}}', '"components" is not a list'),
        (b"<model/>", "no stage in it"),
        (b"[" * 100_000, "neither XML nor JSON"),
        (b'{"model":' + b"[" * 100_000, "no whole JSON"),
        (b"PK\x03\x04 nothing", "cannot be unpacked"),
    ],
)
def test_what_is_no_rexs_costs_one_line(tmp_path, content, message):
    path = tmp_path / "odd.rexs"
    path.write_bytes(content)
    with pytest.raises(RexsError) as caught:
        read_rexs(path)
    assert message in str(caught.value)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_a_bomb_is_refused_before_it_is_unpacked(tmp_path):
    path = tmp_path / "bomb.rexsz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("bomb.rexs", b"0" * 60_000_000)
    started = time.perf_counter()
    with pytest.raises(RexsError, match="60000000 bytes, more than"):
        read_rexs(path)
    assert time.perf_counter() - started < 5.0


def test_an_unknown_unit_is_refused_with_those_that_are_known(tmp_path):
    text = files.as_xml().replace('unit="mum">118000.0', 'unit="furlong">1')
    with pytest.raises(RexsError, match="center_distance: the unit 'furlong'"):
        read_unit(_written(tmp_path, text)).draft(2)


def test_mutated_files_are_read_or_refused(tmp_path):
    """Five hundred damaged files: each is read, or costs one line."""
    chance = random.Random(20261129)
    path = tmp_path / "damaged.rexs"
    texts = (files.as_xml(), files.as_json())
    refused = 0
    for number in range(500):
        letters = bytearray(texts[number % 2].encode())
        for _ in range(chance.randrange(1, 8)):
            place = chance.randrange(len(letters))
            match chance.randrange(3):
                case 0:
                    letters[place] = chance.randrange(256)
                case 1:
                    del letters[place : place + chance.randrange(1, 60)]
                case 2:
                    letters[place:place] = letters[: chance.randrange(1, 60)]
        path.write_bytes(letters)
        try:
            wl.read_rexs(path)
        except RexsError as error:
            refused += 1
            assert "\n" not in str(error)
    assert 0 < refused < 500


def _derived(draft, word: str) -> str:
    """Return the line of a draft that says what was derived."""
    return next(line for line in draft.derived if word in line)


def test_the_centre_distance_gives_back_the_shifts_that_made_it(tmp_path):
    """Against the road from shifts to centre distance, which is another calculation."""
    position = operating_position((19, 58), (0.3, 0.25), Basics(3e-3))
    distance = 1e6 * position.centre_distance
    text = files.as_xml().replace('unit="mum">118000.0', f'unit="mum">{distance!r}')
    line = _derived(read_unit(_written(tmp_path, text)).draft(2), "working pressure")
    angle = math.degrees(position.working_pressure_angle)
    assert f"(transverse) {angle:.5f} deg" in line
    assert "sum of profile shifts 0.550000" in line


@pytest.mark.parametrize("stated", [0.4, -0.4])
def test_a_ring_has_the_shift_that_fits_whatever_its_sign(tmp_path, stated):
    position = internal_position((19, 58), (0.1, 0.4), Basics(3e-3))
    distance = 1e6 * position.centre_distance
    text = files.as_xml().replace('unit="mum">118000.0', f'unit="mum">{distance!r}')
    text = text.replace(
        'type="cylindrical_gear" name="wheel 2"', 'type="ring_gear" name="wheel 2"'
    )
    for gear, shift in ((10, 0.1), (11, stated)):
        flank = (
            f'<component id="{gear + 100}" type="cylindrical_gear_flank">'
            '<attribute id="normal_pressure_angle" unit="deg">20</attribute>'
            f'<attribute id="addendum_modification_coefficient">{shift}</attribute>'
            "</component>"
        )
        relation = (
            f'<relation type="flank"><ref id="{gear}" role="gear" />'
            f'<ref id="{gear + 100}" role="right" /></relation>'
        )
        text = text.replace("</components>", f"{flank}</components>")
        text = text.replace("</relations>", f"{relation}</relations>")
    draft = read_unit(_written(tmp_path, text)).draft(2)
    gears = draft.table()["gears"]
    assert gears["kind"] == "internal-pair"
    assert gears["pinion"]["profile_shift_coefficient"] == 0.1
    assert gears["ring"]["profile_shift_coefficient"] == 0.4
    assert "difference of profile shifts 0.300000" in _derived(draft, "difference")


EXTREMES = (0.0, -1.0, 1e-300, 1e300, -1e18, 90.0, 180.0, 3e4, 1e999)


def test_values_that_no_gear_has_are_read_or_refused(tmp_path):
    """Every number of the file in turn is one that divides by nought or overflows."""
    path = tmp_path / "extreme.rexsj"
    document = json.loads(files.as_json())
    model = document["model"]
    cases = model["load_spectrum"]["load_cases"]
    loads = [component for case in cases for component in case["components"]]
    places = [
        attribute
        for component in [*model["components"], *loads]
        for attribute in component["attributes"]
        if isinstance(attribute.get("floating_point"), float | int)
    ]
    assert len(places) > 40
    for attribute in places:
        before = attribute["floating_point"]
        for value in (*EXTREMES, 10**400):
            attribute["floating_point"] = value
            path.write_text(json.dumps(document))
            try:
                read_rexs(path)
            except RexsError as error:
                assert "\n" not in str(error)
        attribute["floating_point"] = before


def test_a_name_writes_no_lines_of_its_own(tmp_path):
    """A stranger's id or name with a line break would have named plug-ins."""
    text = files.as_xml()
    planted = "&#10;plugins = [&quot;stranger.py&quot;]&#10;"
    for old in ('id="13"', 'name="fast"'):
        assert old in text
        text = text.replace(old, old[:-1] + planted + '"')
    draft = read_unit(_written(tmp_path, text)).draft(1)
    assert "stranger.py" in draft.text()
    assert tomllib.loads(draft.text()).keys() == draft.table().keys()
    assert "plugins" not in tomllib.loads(draft.text())


def test_a_stage_that_cannot_be_taken_stops_no_other(tmp_path):
    text = files.as_xml().replace(
        '<component id="20" type="worm_stage" name="worm at the fan" />',
        '<component id="20" type="planetary_stage" name="no sun" />',
    )
    unit = read_unit(_written(tmp_path, text))
    assert "0 suns" in unit.stages[2].reason
    assert unit.draft(1).table()["operation"]["duty"]


def test_a_load_case_without_a_speed_is_named(tmp_path):
    speed = '<component id="3"><attribute id="rotational_speed" unit="1 / min">-300.0'
    text = files.as_xml()
    assert speed in text
    text = text.replace(speed, speed.replace("rotational_speed", "no_speed"))
    draft = read_unit(_written(tmp_path, text)).draft(1)
    assert draft.table()["operation"]["torque"] == "420 N*m"
    assert any("of 1 of 2 load cases" in line for line in draft.missing)


@pytest.mark.parametrize("noun", ["components", "relations", "load cases"])
def test_more_than_a_gear_unit_has_is_refused_at_once(tmp_path, noun):
    document = json.loads(files.as_json())["model"]
    many = {
        "components": (document, "components", {"type": "shaft"}),
        "relations": (document, "relations", {"type": "side", "refs": []}),
        "load cases": (document["load_spectrum"], "load_cases", {"components": []}),
    }
    table, key, entry = many[noun]
    table[key] = [{**entry, "id": number} for number in range(30_000)]
    started = time.perf_counter()
    with pytest.raises(RexsError, match=f"30000 {noun} are more than"):
        read_rexs(_written(tmp_path, json.dumps({"model": document}), "many.rexsj"))
    assert time.perf_counter() - started < 20.0


@pytest.mark.parametrize("teeth", ["19", "12", "0.4"])
def test_a_ring_of_no_more_teeth_has_no_centre_distance(tmp_path, teeth):
    """It ended in a division by zero, or in a working pressure angle of 160 degrees."""
    text = files.as_xml().replace(
        'type="cylindrical_gear" name="wheel 2"', 'type="ring_gear" name="wheel 2"'
    )
    head, mark, tail = text.partition('type="ring_gear" name="wheel 2"')
    text = head + mark + tail.replace(">58<", f">{teeth}<", 1)
    draft = read_unit(_written(tmp_path, text)).draft(2)
    assert not [line for line in draft.derived if "working pressure" in line]
    assert any("no centre distance goes with" in line for line in draft.left_out)
