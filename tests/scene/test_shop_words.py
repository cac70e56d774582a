"""The words of the shop: oils by grade, materials by name, hardness numbers, classes,
reliefs by start.
"""

import math

import pytest

from wearlab.assembly.errors import class_flags
from wearlab.assembly.sets import build_pair, build_set
from wearlab.materials import oil
from wearlab.scene import Scene
from wearlab.scene.problems import SceneError

WARM = {"temperature": "60 degC"}


def made(table, **sections):
    """Return the scene with other sections; a dotted key goes into a section."""
    for key, value in sections.items():
        table[key] = value
    return Scene.from_mapping(table)


def test_an_oil_by_its_grade(table):
    words = {"grade": "ISO VG 220", "temperature": "60 degC"}
    scene = made(table, lubricant=words)
    expected = oil.of_grade(220)
    assert scene.lubricant.viscosity == oil.dynamic_viscosity(expected, 333.15)
    assert scene.lubricant.pressure_viscosity == oil.pressure_viscosity(
        expected, 333.15
    )
    assert any("ISO VG 220 at 60 °C" in line for line in scene.lubricant.sources)
    again = Scene.from_canonical(scene.canonical())
    assert again.id == scene.id
    assert again.lubricant.viscosity == pytest.approx(
        scene.lubricant.viscosity, rel=1e-11
    )


def test_an_oil_by_its_datasheet_is_the_same_oil(table):
    one = oil.of_grade(220)
    sheet = {
        "kinematic_viscosity_40": "220 cSt",
        "kinematic_viscosity_100": f"{1e6 * one.viscosity_100!r} mm^2/s",
        "density": f"{one.density_15!r} kg/m^3",
        "temperature": "60 degC",
    }
    by_sheet = made(dict(table), lubricant=sheet)
    by_grade = made(table, lubricant={"grade": 220, "temperature": "60 degC"})
    assert by_sheet.lubricant.viscosity == pytest.approx(
        by_grade.lubricant.viscosity, rel=1e-9
    )


def test_a_value_beside_a_grade_is_refused_but_alpha_may_be_known(table):
    with pytest.raises(SceneError, match="give one of 'viscosity' and 'grade'"):
        made(
            dict(table),
            lubricant={
                "viscosity": "0.1 Pa*s",
                "grade": "VG 220",
                "temperature": "60 degC",
            },
        )
    known = {
        "grade": "VG 220",
        "temperature": "60 degC",
        "pressure_viscosity": "2e-8 1/Pa",
    }
    assert made(table, lubricant=known).lubricant.pressure_viscosity == 2e-8


@pytest.mark.parametrize(
    "words, why",
    [
        (
            {"grade": "ISO VG 200", "temperature": "60 degC"},
            "no grade of ISO 3448.*150, 220",
        ),
        ({"grade": "ISO VG 220"}, "needs temperature, such as '60 degC'"),
        (
            {"viscosity": "0.1 Pa*s"},
            "give viscosity and pressure_viscosity; or grade and temperature",
        ),
        ({"kinematic_viscosity_40": "220 cSt", "temperature": "60 degC"}, "gives both"),
        (
            {
                **WARM,
                "kinematic_viscosity_40": "20 cSt",
                "kinematic_viscosity_100": "30 cSt",
            },
            "below",
        ),
        (
            {"grade": "ISO VG 220", "temperature": "60 degC", "viscosity_index": 900},
            "no oil of 220",
        ),
    ],
)
def test_an_oil_that_cannot_be(table, words, why):
    with pytest.raises(SceneError, match=rf"scene\.lubricant.*{why}"):
        made(table, lubricant=words)


@pytest.mark.parametrize(
    "name, modulus, number",
    [("18CrNiMo7-6", 206e9, 697), ("1.7225", 206e9, 300), ("POM", 2.8e9, None)],
)
def test_materials_by_name(table, name, modulus, number):
    table["gears"]["material"] = name
    found = Scene.from_mapping(table).gears.material
    assert found.youngs_modulus == modulus
    assert found.hardness == (
        None if number is None else pytest.approx(number * 9.80665e6)
    )
    assert found.sources


def test_a_named_material_with_a_hardness_of_its_own(table):
    table["gears"]["pinion"]["material"] = {"name": "16MnCr5", "hardness": "62 HRC"}
    table["wear"]["coefficient"] = {"model": "hardness", "k": 1e-8}
    with pytest.raises(
        SceneError, match=r"gears\.gear\.material: .* needs the hardness of both flanks"
    ):
        Scene.from_mapping(table)
    table["gears"]["gear"]["material"] = "42CrMo4"
    scene = Scene.from_mapping(table)
    assert scene.gears.pinion.material.hardness == pytest.approx(746 * 9.80665e6)
    assert not any(
        "62" in line or "assumed" in line
        for line in scene.gears.pinion.material.sources
    )


def test_an_unknown_material_names_the_nearest(table):
    table["gears"]["material"] = "18CrNiMo7"
    with pytest.raises(
        SceneError, match=r"gears\.material: .*did you mean '18CrNiMo7-6'\?"
    ):
        Scene.from_mapping(table)


def test_errors_of_a_class(table):
    scene = made(
        table,
        errors={
            "iso_1328_class": 7,
            "gear": {"iso_1328_class": 6, "total_composite": "5 um"},
        },
    )
    lines = class_flags(scene, build_set(scene))
    assert lines[0].startswith("pinion: ISO 1328-1:1995 class 7: F_i′ = ")
    assert lines[1].startswith(
        "gear: ISO 1328-1:1995 class 6: F_i′ = 5 µm"
    )  # what is given stays


def test_a_relief_by_where_it_starts(table):
    gears = table["gears"]

    def length(**start):
        gears["pinion"]["tip_relief"] = {"amount": "10 um", **start}
        pair = build_pair(Scene.from_mapping(table))
        return pair.driving.modification.tip_relief.length, pair.driving

    wanted, gear = length(length="2 mm")
    rho = math.sqrt(gear.tip_radius**2 - gear.base_radius**2) - wanted
    by_diameter, _ = length(
        start_diameter=f"{2e3 * math.hypot(gear.base_radius, rho)!r} mm"
    )
    by_roll, _ = length(
        start_roll_angle=f"{math.degrees(rho / gear.base_radius)!r} deg"
    )
    assert by_diameter == pytest.approx(wanted, rel=1e-9) and by_roll == pytest.approx(
        wanted, rel=1e-9
    )


@pytest.mark.parametrize(
    "end, relief, why",
    [
        (
            "tip_relief",
            {"amount": "10 um"},
            "give length along the path, start_diameter or start_roll_angle",
        ),
        (
            "tip_relief",
            {"amount": "10 um", "length": "1 mm", "start_diameter": "150 mm"},
            "give one of",
        ),
        (
            "root_relief",
            {"amount": "10 um", "start_diameter": "150 mm"},
            "give its length along the path",
        ),
    ],
)
def test_a_relief_that_cannot_be(table, end, relief, why):
    table["gears"]["pinion"][end] = relief
    with pytest.raises(SceneError, match=why):
        Scene.from_mapping(table)
