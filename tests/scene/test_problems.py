import copy
import pickle
import re

import pytest

from wearlab.scene import Scene, SceneError
from wearlab.scene.merge import merge, nested

CASES = [
    (
        "wear.coeficient",
        1,
        "scene.wear.coeficient: unknown key, did you mean 'coefficient'?",
    ),
    (
        "friction",
        {"coefficient": 0.1},
        "scene.friction: unknown key; it belongs in dynamics.friction; there",
    ),
    (
        "mesh.wohler_slope",
        6.6,
        "scene.mesh.wohler_slope: unknown key; it belongs in wear.wohler_slope",
    ),
    (
        "wear.coefficient",
        4e-16,
        "no table: wear coefficient k; required with until: a table",
    ),
    ("gears.pinion.tip_relief", 4, "a table with amount, length"),
    ("geers", {}, "scene.geers: unknown key, did you mean 'gears'?"),
    (
        "operation.torque",
        340,
        "scene.operation.torque: 340 has no unit: write a torque",
    ),
    (
        "operation.torque",
        "-3 N*m",
        "scene.operation.torque: '-3 N*m' must be at least 0",
    ),
    ("operation.torque", "nan N*m", "scene.operation.torque: 'nan N*m'"),
    (
        "operation.speed",
        "25 Hz",
        "scene.operation.speed: '25 Hz': 'Hz' is not a unit like 'rad/s'",
    ),
    (
        "operation.speed",
        "0 rpm",
        "scene.operation.speed: '0 rpm' must be greater than 0",
    ),
    (
        "gears.pinion.teeth",
        "50",
        "scene.gears.pinion.teeth: '50' is not a plain number",
    ),
    (
        "gears.pinion.teeth",
        50.5,
        "scene.gears.pinion.teeth: 50.5 is not a whole number",
    ),
    (
        "gears.pinion.teeth",
        True,
        "scene.gears.pinion.teeth: True is not a plain number",
    ),
    ("gears.material", "stel", "scene.gears.material: 'stel' is not a known material"),
    ("gears.pinion", 3, "scene.gears.pinion: 3 is no table"),
    ("gears.pinion.addendum_coefficient", float("nan"), "is not a finite number"),
    (
        "gears.pinion.tip_relief",
        {"amount": "10 um"},
        "scene.gears.pinion.tip_relief: give length along the path, start_diameter or "
        "start_roll_angle",
    ),
    (
        "mesh.stiffness",
        "potental-energy",
        "scene.mesh.stiffness.model: 'potental-energy' is not one of",
    ),
    ("mesh.stiffness", "potental-energy", "did you mean 'potential-energy'?"),
    (
        "wear.coefficient",
        "1e-18 m^2/N",
        "; write { model = 'constant', value = '1e-18 m^2/N' }",
    ),
    (
        "mesh.stiffness.value",
        3,
        "scene.mesh.stiffness.value: not an option of 'finite-element', but of "
        "'constant'",
    ),
    (
        "mesh.stiffness.hertzz",
        3,
        "scene.mesh.stiffness.hertzz: unknown key, did you mean 'hertz'?",
    ),
    ("mesh.stiffness.correction", [1], "scene.mesh.stiffness.correction[1]: required"),
    ("mesh.stiffness.correction", 1, "scene.mesh.stiffness.correction: 1 is no list"),
    (
        "mesh.excitation",
        "fourier",
        "scene.mesh.excitation.stiffness_harmonics: required: harmonics l",
    ),
    (
        "mesh.damping_in",
        "alway",
        "scene.mesh.damping_in: 'alway' is not one of 'contact', 'always'; did you",
    ),
    (
        "mesh.damping",
        "100 um",
        "scene.mesh.damping: '100 um': 'um' is not a unit like 'N*s/m'",
    ),
    (
        "dynamics.methd",
        "rk4",
        "scene.dynamics.methd: unknown key, did you mean 'method'?",
    ),
    (
        "dynamics.method",
        "rk5",
        "scene.dynamics.method: 'rk5' is not one of 'periodic', 'newmark', 'rk4', "
        "'rk45'; did you mean 'rk45'?",
    ),
    (
        "dynamics.supports.gear.damping_ratio",
        "3",
        "scene.dynamics.supports.gear.damping_ratio: '3' is not a plain",
    ),
    ("errors.harmonic", [{"order": 1}], "scene.errors.harmonic[0].amplitude: required"),
    ("errors.harmonic", {"order": 1}, "scene.errors.harmonic: {'order': 1} is no list"),
    ("errors.seed", -1, "scene.errors.seed: -1 must be at least 0"),
    ("wear", 7, "scene.wear: 7 is no table"),
    ("wear.coefficient", "hardness", "scene.wear.coefficient.k: required"),
    (
        "wear.coefficient.gear.valu",
        1,
        "scene.wear.coefficient.gear.valu: unknown key, did you mean 'value'?",
    ),
    (
        "wear.coefficient.film",
        "yes",
        "scene.wear.coefficient.film: 'yes' is not true or false: whether",
    ),
    ("wear.coefficient.film", 1, "scene.wear.coefficient.film: 1"),
    (
        "wear.step",
        {"method": "fixed", "size": {"stabilty": 1}},
        "scene.wear.step.size.stabilty: unknown key, did",
    ),
    (
        "wear.step",
        {"method": "fixed", "size": -1},
        "scene.wear.step.size: -1 must be greater than 0",
    ),
    (
        "wear.step",
        "eulr",
        "scene.wear.step.method: 'eulr' is not one of 'adaptive', 'euler', 'fixed'",
    ),
    (
        "wear.step",
        "euler",
        "scene.wear.step.threshold: required: wear per step, ε^q, such as '0.3 um'",
    ),
    ("wear.snapshots.cycles", [], "scene.wear.snapshots.cycles: [] has 0 entries"),
    (
        "wear.snapshots.cycles",
        [-1],
        "scene.wear.snapshots.cycles[0]: -1 must be greater than 0",
    ),
    (
        "wear.snapshots",
        {"cycles": [1], "depth": ["1 um"]},
        "scene.wear.snapshots: give one of 'cycles' and 'depth'",
    ),
    ("wear.snapshots", {"flank": "gear"}, "scene.wear.snapshots: give one of 'cycles'"),
    (
        "wear.until",
        {"flank": "gear", "hours": 3},
        "scene.wear.until: 'flank' belongs to a 'depth'",
    ),
    ("wear.until.hours", "3 mm", "scene.wear.until.hours: '3 mm'"),
    ("numerics.tolerance", 2, "scene.numerics.tolerance: 2 must be less than 1"),
    (
        "mesh.face_load_factor",
        0.9,
        "scene.mesh.face_load_factor: 0.9 must be at least 1",
    ),
    (
        "mesh.contact",
        "exakt",
        "scene.mesh.contact.model: 'exakt' is not one of 'algorithm-1', "
        "'displacement', 'exact'",
    ),
    (
        "mesh.contact.extended_contact",
        True,
        "scene.mesh.contact.extended_contact: unknown key; it belongs in "
        "mesh.extended_contact; there",
    ),
    (
        "dynamics.friction",
        {},
        "scene.dynamics.friction.coefficient: required: coefficient of friction μ",
    ),
    (
        "dynamics.model",
        "planetary",
        "scene.dynamics.model: 'planetary' does not belong to gears of kind 'ext",
    ),
    (
        "wear.coefficient.model",
        "calibrated",
        "scene.wear.coefficient.life: required: life, in cycles",
    ),
    (
        "wear.initial.pinion",
        {"file": "x.csv"},
        "scene.wear.initial.pinion: cannot read x.csv",
    ),
    (
        "operation.power",
        "10 N*m",
        "scene.operation.power: '10 N*m': 'N*m' is not a unit",
    ),
    ("operation.fixed", "gear", "scene.operation.fixed: belongs to planetary sets"),
    (
        "operation.input",
        "sun",
        "scene.operation.input: 'sun' is no member that may be that; there are "
        "pinion, gear",
    ),
    ("dynamics.supports.ring.preload", "1 N", "scene.dynamics.supports.ring"),
    (
        "wear.coefficient.ring",
        "constant",
        "scene.wear.coefficient: 'ring': no member with teeth of this gear set",
    ),
    (
        "store.variables",
        ["wear_dept"],
        "scene.store.variables: 'wear_dept' is no variable",
    ),
]
PYTHON = re.compile(
    r"Input should|'\w+' object|NoneType|iterable|sequence|unhashable|not supported "
    r"between"
)


@pytest.mark.parametrize(
    ("key", "value", "said"), CASES, ids=[f"{key}={value}" for key, value, _ in CASES]
)
def test_a_problem_names_path_value_and_remedy(table, key, value, said):
    with pytest.raises(SceneError) as caught:
        Scene.from_mapping(merge(table, nested(key, value)))
    assert any(said in line for line in caught.value.problems), caught.value.problems


def paths(table, above=()):
    """Yield every place of a table and of its lists."""
    for key, value in table.items() if isinstance(table, dict) else enumerate(table):
        yield (*above, key)
        if isinstance(value, dict | list):
            yield from paths(value, (*above, key))


@pytest.mark.parametrize(
    "wrong", ["text", 3, True, [1, "x"], [], {"a": {"b": 1}}], ids=repr
)
def test_no_value_of_the_wrong_kind_gives_a_message_of_python(full, wrong):
    for *above, last in paths(full):
        table = copy.deepcopy(full)
        inner = table
        for key in above:
            inner = inner[key]
        inner[last] = wrong
        try:
            Scene.from_mapping(table)
        except SceneError as error:
            assert not PYTHON.search(str(error)), error


def test_all_problems_are_collected_once(table):
    table["operation"] = {"torqe": "3 N*m", "speed": "3 Hz"}
    table["gears"]["pinion"] = {}
    with pytest.raises(SceneError) as caught:
        Scene.from_mapping(table)
    paths = sorted(line.split(":")[0] for line in caught.value.problems)
    assert paths == [
        "scene.gears.pinion.teeth",
        "scene.operation.speed",
        "scene.operation.torqe",
    ]
    assert str(caught.value).count("\n") == 2


@pytest.mark.parametrize(
    ("operation", "said"),
    [
        (
            {"power": "1 kW"},
            "torque and speed missing: give torque and speed, such as '340 N*m' and "
            "'1100 rpm'",
        ),
        ({"torque": "3 N*m"}, "speed missing: give torque and speed"),
        (
            {"power": "1 kW", "torque": "0 N*m"},
            "a torque of 0 has no power: give speed",
        ),
        (
            {"power": "1 kW", "torque": "1 N*m", "speed": "1 rpm"},
            "torque = 1 N*m, speed = 1 rpm and power = 1000 W are one too many: leave "
            "one out; drop",
        ),
    ],
)
def test_two_of_torque_speed_and_power(table, operation, said):
    table["operation"] = operation
    with pytest.raises(SceneError) as caught:
        Scene.from_mapping(table)
    assert len(caught.value.problems) == 1
    assert caught.value.problems[0].startswith(f"scene.operation: {said}")


def test_both_alternatives_in_one_table_are_refused(table):
    table["mesh"]["damping_ratio"] = 0.07
    table["gears"]["pinion"]["dedendum_coefficient"] = 1.2
    with pytest.raises(SceneError) as caught:
        Scene.from_mapping(table)
    assert (
        "scene.mesh: give one of 'damping' and 'damping_ratio', not both"
        in caught.value.problems
    )
    assert any(
        "'root_diameter' and 'dedendum_coefficient'" in line
        for line in caught.value.problems
    )


def test_missing_sections(table):
    with pytest.raises(SceneError) as caught:
        Scene.from_mapping({})
    assert [line.split(": ")[:2] for line in caught.value.problems] == [
        ["scene.gears", "required"],
        ["scene.operation", "required"],
    ]


def test_errors_travel_between_processes():
    error = SceneError(["a", "b", "a"])
    assert pickle.loads(pickle.dumps(error)).problems == ("a", "b")


def test_a_choice_without_default_must_be_made(table):
    table["wear"]["coefficient"] = {
        "gear": {"model": "constant", "value": "1e-18 m^2/N"}
    }
    with pytest.raises(SceneError) as caught:
        Scene.from_mapping(table)
    assert caught.value.problems == (
        "scene.wear.coefficient.pinion: required key 'model': one of 'calibrated', "
        "'constant', "
        "'hardness', 'janakiraman', 'over-temperature'",
    )
