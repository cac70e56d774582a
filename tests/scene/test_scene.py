import json
import math
import pickle

import pytest
from scenes import CAMPAIGNS

from wearlab.campaign import load
from wearlab.dynamics.models.pair import Spur3dofDynamics, TorsionalDynamics
from wearlab.life.steps.adaptive import AdaptiveStep
from wearlab.life.steps.euler import EulerStep
from wearlab.mesh.contacts.displacement import DisplacementContact
from wearlab.mesh.excitations.fourier import FourierExcitation
from wearlab.mesh.excitations.pairs import PairsExcitation
from wearlab.mesh.stiffnesses.constant import ConstantStiffness
from wearlab.mesh.stiffnesses.finite_element import FiniteElementStiffness
from wearlab.scene import Scene, SceneError, parts_left_out, parts_present
from wearlab.scene.merge import merge, nested, without
from wearlab.scene.operation import SeveralConditions
from wearlab.scene.sections import Sections
from wearlab.wear.coefficients.constant import ConstantCoefficient
from wearlab.wear.coefficients.hardness import HardnessCoefficient


def test_values_are_si(table):
    scene = Scene.from_mapping(table)
    assert scene.gears.module == 0.003
    assert scene.gears.pressure_angle == math.radians(20)
    assert scene.operation.speed == pytest.approx(1100 * math.pi / 30)
    assert scene.mesh.damping == 1000.0
    assert scene.dynamics.supports.get("gear").radial_stiffness == 1.15e9
    assert scene.gears.material.youngs_modulus == 206e9
    assert scene.gears.material.density == 7830.0


def test_defaults(table):
    scene = Scene.from_mapping(table)
    assert (scene.operation.input, scene.operation.output) == ("pinion", "gear")
    assert scene.mesh.stiffness == FiniteElementStiffness()
    assert scene.mesh.extended_contact
    assert scene.mesh.contact == DisplacementContact()
    assert scene.mesh.contact.threshold == 1e-4
    assert scene.mesh.excitation == PairsExcitation()
    assert scene.mesh.normal_backlash is None
    assert scene.mesh.damping_in == "contact"
    assert scene.errors is None and scene.lubricant is None
    assert scene.dynamics.method == "periodic"
    assert scene.wear.load.chosen == "instant" and scene.wear.step == AdaptiveStep()
    assert (
        scene.wear.pressure.chosen == "mean"
        and scene.wear.projection.chosen == "normal"
    )
    assert scene.numerics.tolerance == 1e-3 and scene.numerics.phase_points is None
    assert scene.store.variables is None


def test_defaults_that_depend_on_other_keys(table):
    pinion = Scene.from_mapping(table).gears.pinion
    assert pinion.profile_shift_coefficient == 0.0
    assert pinion.addendum_coefficient == 1.0 and pinion.tip_diameter is None
    assert pinion.dedendum_coefficient is None and pinion.root_diameter == 0.14
    table["gears"]["centre_distance"] = "151 mm"
    table["gears"]["pinion"]["tip_diameter"] = "156 mm"
    pinion = Scene.from_mapping(table).gears.pinion
    assert pinion.profile_shift_coefficient is None
    assert pinion.addendum_coefficient is None


def test_the_other_member_is_driven(table):
    table["operation"]["input"] = "gear"
    assert Scene.from_mapping(table).operation.output == "pinion"
    table["operation"]["output"] = "gear"
    with pytest.raises(
        SceneError, match="one member in two roles: input 'gear', output 'gear'"
    ):
        Scene.from_mapping(table)


def test_without_dynamics_the_load_is_static(table):
    del table["dynamics"]
    assert Scene.from_mapping(table).wear.load.chosen == "static"


@pytest.mark.parametrize("written", [90, "90 h", "5400 min"])
def test_hours_are_a_count_or_a_time(table, written):
    table["wear"]["until"] = {"hours": written}
    assert Scene.from_mapping(table).wear.until.hours == pytest.approx(90.0, rel=1e-15)


def test_one_tolerance_needs_no_list(table):
    table["errors"] = {"pinion": {"installation": "3 um"}}
    assert Scene.from_mapping(table).errors.members["pinion"].installation == (3e-6,)


def test_shares_of_a_duty_without_a_unit_are_parts(table, tmp_path):
    units = {"torque": "N*m", "speed": "rpm"}
    for parts in ("0.75", "0.25"), ("75", "25"):
        rows = f"100,900,{parts[0]}\n200,800,{parts[1]}\n"
        (tmp_path / "duty.csv").write_text(f"torque,speed,share\n{rows}")
        table["operation"] = {"duty": {"file": "duty.csv", "units": units}}
        duty = Scene.from_mapping(table, base_directory=tmp_path).operation.duty
        assert [block.share for block in duty] == [0.75, 0.25]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"units": "h"}, "units: 'h' is no table: write units = { torque = "),
        (
            {"columns": "time"},
            "columns: 'time' is no table: write columns = { share = ",
        ),
        ({"file": 3}, "file: 3 is no text"),
    ],
)
def test_a_duty_file_of_the_wrong_kind_is_refused(table, given, said):
    table["operation"] = {
        "duty": {"file": "duty.csv", "units": {"torque": "N*m"}, **given}
    }
    with pytest.raises(SceneError, match=f"scene.operation.duty: {said}"):
        Scene.from_mapping(table)


def test_a_duty_that_is_the_name_of_a_file_is_told_how_to_name_it(table):
    table["operation"] = {"duty": "spectrum.csv"}
    with pytest.raises(SceneError, match=r'write duty = \{ file = "spectrum.csv" \}'):
        Scene.from_mapping(table)


def test_a_string_is_a_model(table):
    table["mesh"]["stiffness"] = {"model": "constant", "value": "300 N/um"}
    table["mesh"]["excitation"] = "modulated"
    scene = Scene.from_mapping(table)
    assert scene.mesh.stiffness == ConstantStiffness(value="300 N/um")
    assert scene.mesh.excitation.stiffness_modulation is None
    table["mesh"]["excitation"] = "pairs"
    table["dynamics"] = "torsional"
    assert isinstance(Scene.from_mapping(table).dynamics, TorsionalDynamics)


def test_given_modulation(table):
    given = {
        "mean": "300 N/um",
        "carrier": "30 N/um",
        "am": 0.1,
        "fm": "5 deg",
        "fm_phase": "1 rad",
    }
    table["mesh"]["excitation"] = {"model": "modulated", "stiffness_modulation": given}
    modulation = Scene.from_mapping(table).mesh.excitation.stiffness_modulation
    assert (modulation.mean, modulation.carrier, modulation.am) == (3e8, 3e7, 0.1)
    assert (modulation.fm, modulation.fm_phase, modulation.carrier_phase) == (
        math.radians(5),
        1.0,
        0.0,
    )


def test_every_option_at_once(full):
    scene = Scene.from_mapping(full)
    assert isinstance(scene.mesh.excitation, FourierExcitation)
    assert isinstance(scene.dynamics, Spur3dofDynamics)
    assert scene.gears.pinion.tip_relief.amount == 1e-5
    assert scene.gears.pinion.profile_slope == -2e-6
    assert scene.operation.torque_fluctuation.phase == math.pi / 2
    assert scene.errors.members["pinion"].installation == (3e-6, 4e-6)
    assert "gear" not in scene.errors.members
    assert scene.errors.harmonic[0].amplitude == 3e-6
    assert scene.mesh.normal_backlash == 0.0
    assert scene.wear.snapshots.depth == (5e-6, 1e-5)
    assert scene.wear.step.size.stability == 0.9
    assert scene.store.variables == ("mesh_stiffness", "wear_depth")


def test_one_coefficient_per_member(full):
    wear = Scene.from_mapping(full).wear
    assert wear.coefficient_of("pinion") == ConstantCoefficient(
        model="constant", value="9.65e-19 m^2/N", film=True
    )
    assert wear.coefficient_of("gear") == HardnessCoefficient(
        model="hardness", k=1e-7, hardness="2.7 GPa"
    )


def test_a_member_overrides_the_general_coefficient(table):
    table["wear"]["coefficient"]["gear"] = {"factor": 2}
    wear = Scene.from_mapping(table).wear
    assert (
        wear.coefficient_of("pinion").factor,
        wear.coefficient_of("gear").factor,
    ) == (1.0, 2.0)
    assert wear.coefficient_of("gear").value == 9.65e-19
    table["wear"]["coefficient"]["gear"] = {"factor": 1}
    assert isinstance(Scene.from_mapping(table).wear.coefficient, ConstantCoefficient)


def test_a_scene_is_frozen(table):
    scene = Scene.from_mapping(table)
    with pytest.raises(ValueError, match="frozen"):
        scene.operation.torque = 3.0
    with pytest.raises(AttributeError):
        scene.wear = None


@pytest.mark.parametrize("key", ["torque", "speed", "power"])
@pytest.mark.parametrize("several", ["duty", "stage"])
def test_no_torque_speed_or_power_of_one_condition_stands_for_several(
    table, key, several
):
    del table["operation"]["torque"], table["operation"]["speed"]
    table["operation"][several] = TWO if several == "duty" else ORDERED
    scene = Scene.from_mapping(table)
    with pytest.raises(SeveralConditions, match=f"operation.{key}: there are 2 cond"):
        getattr(scene.operation, key)
    torques = {c.operation.torque for c in scene.in_conditions()}
    assert torques == {340.0, 100.0}
    assert scene.in_heaviest_condition.operation.torque == 340.0
    assert key not in json.loads(scene.canonical())["operation"]
    assert Scene.from_canonical(scene.canonical()) == scene


def test_scenes_stored_with_the_torque_of_their_first_condition_are_read(table):
    del table["operation"]["torque"], table["operation"]["speed"]
    table["operation"]["duty"] = TWO
    scene = Scene.from_mapping(table)
    stored = json.loads(scene.canonical())
    stored["operation"] |= {"torque": 340, "speed": 115.191730632}
    assert Scene.from_canonical(json.dumps(stored)) == scene


def test_a_scene_shows_what_users_may_call(table):
    shown = {name for name in dir(Scene.from_mapping(table)) if name[0] != "_"}
    assert shown == {
        *Sections.model_fields,
        *("sections", "with_sections", "replace", "id", "canonical"),
        *("from_mapping", "from_canonical", "plugins_used", "duty_table"),
        "duty_ranges",
        *("in_conditions", "in_heaviest_condition", "in_front"),
        *("meshes", "coefficients", "prescribed", "initial_of", "face_keys", "hands"),
        *("start_wear", "with_start_wear", "calibration", "with_calibration"),
    }


def test_a_scene_travels_to_workers(full):
    scene = Scene.from_mapping(full)
    copy = pickle.loads(pickle.dumps(scene))
    assert copy == scene and copy.id == scene.id and hash(copy) == hash(scene)
    assert copy.replace("operation.torque", "1 N*m") == scene.replace(
        "operation.torque", "1 N*m"
    )


def test_replace_gives_a_new_scene(table):
    scene = Scene.from_mapping(table)
    other = scene.replace("operation.torque", "300 N*m")
    assert other.operation.torque == 300.0 and scene.operation.torque == 340.0
    assert other.id != scene.id
    assert other.replace("operation.torque", "0.34 kNm") == scene


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("operation.torque", "300 N*m"),
        ("mesh.damping_ratio", 0.05),
        ("store", None),
        ("gears.pinion.tip_relief.amount", "12 um"),
        ("wear.until", {"cycles": 1e6}),
    ],
)
def test_a_scene_that_keeps_what_was_read_is_as_one_read_anew(full, key, value):
    scene = Scene.from_mapping(full)
    assert (
        scene.id and scene.replace("numerics.tolerance", 1e-5).id
    )  # what its sections say is known
    for before in (
        scene,
        scene.with_start_wear(None),
        pickle.loads(pickle.dumps(scene)),
    ):
        kept = before.replace(key, value)
        anew = Scene.from_mapping(
            merge(full, nested(key, value)) if value else without(full, key)
        )
        assert (kept.id, kept.canonical()) == (anew.id, anew.canonical())


@pytest.mark.parametrize(
    "file", sorted(CAMPAIGNS.glob("*.toml")), ids=lambda file: file.stem
)
def test_scenes_of_campaigns_keep_what_was_read_as_read_anew(file):
    scene = load(file).cases[0].scene
    for _ in range(2):
        scene = scene.replace("store.variables", ["life"]).replace("store", None)
        anew = Scene.from_mapping(scene._mapping, scene._base)
        assert (scene.id, scene.canonical()) == (anew.id, anew.canonical())


def test_replace_makes_alternatives_and_models_make_way(table):
    scene = Scene.from_mapping(table)
    assert scene.replace("mesh.damping_ratio", 0.05).mesh.damping is None
    assert scene.replace("dynamics.model", "torsional").dynamics == TorsionalDynamics(
        model="torsional"
    )
    assert (
        scene.replace("mesh.stiffness.coupling", "shared").mesh.stiffness.coupling
        == "shared"
    )
    assert scene.replace(
        "wear.step", {"method": "euler", "threshold": "1 um"}
    ).wear.step == EulerStep(threshold="1 um")


def test_replace_with_nothing_regains_the_default(table):
    scene = Scene.from_mapping(table)
    static = scene.replace("dynamics", None)
    assert static.dynamics is None and static.wear.load.chosen == "static"
    with pytest.raises(
        SceneError, match=r"scene\.mesh\.dampin: .*did you mean 'mesh.damping'"
    ):
        scene.replace("mesh.dampin", None)


def test_replace_refuses_bare_numbers_even_beside_stored_ones(table):
    restored = Scene.from_canonical(Scene.from_mapping(table).canonical())
    assert restored.replace("operation.torque", "300 N*m").operation.torque == 300.0
    with pytest.raises(SceneError, match="300 has no unit"):
        restored.replace("operation.torque", 300)


def test_parts(table, full):
    scene = Scene.from_mapping(table)
    assert "dynamics: spur-3dof, periodic" in parts_present(scene)
    assert {"back flank", "errors", "film", "initial wear"} <= set(
        parts_left_out(scene)
    )
    static = scene.replace("dynamics", None)
    assert {"dynamics", "excitation"} <= set(parts_left_out(static))
    assert "wear: constant coefficient, static load" in parts_present(static)
    others = ["face", "rating", "friction", "duty", "stages", "start from another run"]
    assert parts_left_out(Scene.from_mapping(full)) == others


TWO = [
    {"torque": "340 N*m", "speed": "1100 rpm", "share": 0.25},
    {"torque": "100 N*m", "speed": "900 rpm", "share": 0.75},
]
ORDERED = [
    {"torque": "100 N*m", "speed": "900 rpm", "cycles": 1e5},
    {"torque": "340 N*m", "speed": "1100 rpm", "label": "rated"},
]


@pytest.mark.parametrize(
    ("key", "value", "part", "read"),
    [
        (
            "dynamics.friction",
            {"coefficient": 0.06},
            "friction",
            lambda s: s.dynamics.friction.coefficient == 0.06,
        ),
        (
            "operation.duty",
            TWO,
            "duty: 2 conditions",
            lambda s: (
                [b.share for b in s.operation.blocks] == [0.25, 0.75]
                and [b.torque for b in s.operation.blocks] == [340.0, 100.0]
                and s.in_heaviest_condition.operation.torque == 340.0
            ),
        ),
        (
            "operation.stage",
            ORDERED,
            "stages: 2 in order",
            lambda s: (
                [b.cycles for b in s.operation.stages] == [1e5, None]
                and s.operation.stages[1].label == "rated"
                and s.in_conditions()[0].operation.torque == 100.0
            ),
        ),
        (
            "start.run",
            "0123456789abcdef0123",
            "start from another run: 0123456789",
            lambda s: s.wear.initial is None,
        ),
        (
            "mesh.contact",
            "exact",
            "contact: exact",
            lambda s: s.mesh.contact.threshold == 1e-4,
        ),
        (
            "wear.coefficient",
            {
                "model": "calibrated",
                "life": 1.6e7,
                "depth": "400 um",
                "flank": "gear",
                "torque": "90 N*m",
                "speed": "1000 rpm",
            },
            "wear: calibrated coefficient, instant load",
            lambda s: (
                (s.wear.coefficient.life, s.wear.coefficient.torque) == (1.6e7, 90.0)
                and s.wear.coefficient.depth == pytest.approx(4e-4)
                and s.wear.coefficient.speed == pytest.approx(104.71975511966)
            ),
        ),
    ],
)
def test_parts_that_are_asked_for_are_present_and_read(table, key, value, part, read):
    without = Scene.from_mapping(table)
    scene = without.replace(key, value)
    assert part in parts_present(scene) and part not in parts_present(without)
    assert read(scene)
    assert Scene.from_canonical(scene.canonical()).id == scene.id != without.id


def test_the_face_load_factor_is_read(table):
    assert Scene.from_mapping(table).mesh.face_load_factor == 1.0
    assert (
        Scene.from_mapping(table)
        .replace("mesh.face_load_factor", 1.2)
        .mesh.face_load_factor
        == 1.2
    )


def test_several_options_are_replaced_at_once(table):
    """One by one the first change alone would be refused: the
    distance fits the old teeth only.
    """
    scene = Scene.from_mapping(table)
    changes = {"operation.torque": "80 N*m", "operation.speed": "900 rpm"}
    both = scene.replace(changes)
    assert both == scene.replace("operation.torque", "80 N*m").replace(
        "operation.speed", "900 rpm"
    )
    assert (
        both.replace({key: table["operation"][key.split(".")[1]] for key in changes})
        == scene
    )
    fixed = scene.replace("gears.centre_distance", "150 mm")
    with pytest.raises(SceneError):
        fixed.replace({"gears.centre_distance": None, "gears.nonsense": 3})
