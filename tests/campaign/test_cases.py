import math

import pytest

from wearlab.campaign import CampaignError

SPEEDS = """
[[sweep]]
"operation.speed" = ["800 rpm", "1100 rpm", "1860 rpm"]
"""
STATIC = """
[[case]]
label = "static"
drop = ["dynamics"]
"wear.load" = "static"
"""


def refused(study, text):
    with pytest.raises(CampaignError) as caught:
        study(text)
    return caught.value.problems


def test_one_run_without_sweeps_and_cases(study):
    campaign = study()
    assert [(c.label, c.position) for c in campaign.cases] == [("base", {})]


def test_sweeps_multiply_and_the_last_is_fastest(study):
    campaign = study(SPEEDS + '[[sweep]]\n"operation.torque" = ["1 N*m", "2 N*m"]')
    assert [axis.name for axis in campaign.axes] == ["speed", "torque"]
    assert [tuple(case.position.values()) for case in campaign.cases] == [
        (0, 0),
        (0, 1),
        (1, 0),
        (1, 1),
        (2, 0),
        (2, 1),
    ]
    last = campaign.cases[-1].scene.operation
    assert last.torque == 2.0 and last.speed == pytest.approx(1860 * math.pi / 30)


def test_a_case_beside_the_sweep_is_one_run(study):
    campaign = study(SPEEDS + STATIC)
    assert [(c.label, c.position) for c in campaign.cases] == [
        ("base", {"speed": 0}),
        ("base", {"speed": 1}),
        ("base", {"speed": 2}),
        ("static", {}),
    ]
    static = campaign.cases[-1].scene
    assert static.dynamics is None and static.wear.load.chosen == "static"
    assert static.operation.speed == pytest.approx(1100 * math.pi / 30)
    assert len({case.id for case in campaign.cases}) == 4


def test_a_swept_case(study):
    campaign = study(SPEEDS + STATIC + "sweep = true")
    assert [(c.label, c.position["speed"]) for c in campaign.cases] == [
        ("base", 0),
        ("base", 1),
        ("base", 2),
        ("static", 0),
        ("static", 1),
        ("static", 2),
    ]
    assert campaign.cases[3].scene.operation.speed == pytest.approx(800 * math.pi / 30)


def test_without_sweeps_the_cases_stand_alone(study):
    campaign = study(
        STATIC + '[[case]]\nlabel = "soft"\n[case.mesh.stiffness]\nscale = 0.5'
    )
    assert [case.label for case in campaign.cases] == ["static", "soft"]
    assert campaign.cases[1].scene.mesh.stiffness.scale == 0.5


def test_equal_scenes_share_an_id(study):
    campaign = study(
        SPEEDS + '[[case]]\nlabel = "again"\n"operation.speed" = "1.1e3 rpm"'
    )
    assert campaign.cases[3].id == campaign.cases[1].id != campaign.cases[0].id


def test_models_and_alternatives_make_way_in_sweeps_and_cases(study):
    campaign = study(
        """
        [[sweep]]
        "dynamics.model" = ["torsional"]
        "mesh.damping_ratio" = [0.07]
        name = "model"
        [[case]]
        label = "static"
        drop = "dynamics"
        wear.coefficient = { model = "hardness", k = 1e-7, hardness = "2 GPa" }
        """
    )
    assert campaign.cases[0].scene.mesh.damping is None
    assert campaign.cases[0].scene.mesh.damping_ratio == 0.07
    assert campaign.cases[1].scene.mesh.damping == 1000.0
    assert campaign.cases[1].scene.wear.coefficient.model == "hardness"


def test_tables_along_an_axis(study):
    campaign = study(
        """
        [[sweep]]
        "mesh.stiffness" = [
            { model = "constant", value = "300 N/um" }, "potential-energy"
        ]
        labels = ["constant", "computed"]
        """
    )
    assert (
        campaign.axes[0].values == ("constant", "computed")
        and campaign.axes[0].name == "stiffness"
    )
    assert [case.scene.mesh.stiffness.model for case in campaign.cases] == [
        "constant",
        "potential-energy",
    ]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[[case]]", "case[0].label: required"),
        (
            '[[case]]\nlabel = "base"',
            "case[0].label: 'base' is the file without its [[case]] blocks",
        ),
        (STATIC + STATIC, "case[1].label: 'static' stands twice"),
        (
            '[[case]]\nlabel = "a"\nlable = "b"',
            "case[0].lable: unknown key, did you mean 'label'?",
        ),
        (
            '[[case]]\nlabel = "a"\n"opration.torque" = "1 N*m"',
            "unknown key, did you mean 'operation'?",
        ),
        (
            '[[case]]\nlabel = "a"\n"operation.torqe" = "1 N*m"',
            "case 'a': scene.operation.torqe: unknown key",
        ),
        (
            '[[case]]\nlabel = "a"\ndrop = ["dynamic"]',
            "case[0].drop: 'dynamic' is not there to be dropped",
        ),
        (
            '[[case]]\nlabel = "a"\ndrop = [1]',
            "case[0].drop: [1] is no text: sections or dotted keys",
        ),
        (
            '[[case]]\nlabel = "a"\nsweep = "yes"',
            "case[0].sweep: 'yes' is not true or false: whether",
        ),
        (
            SPEEDS + STATIC + 'sweep = true\n"operation.speed" = "1 rpm"',
            "case[0].operation.speed: is swept already",
        ),
        ('[case]\nlabel = "a"', "write [[case]]"),
        (
            '[[sweep]]\n"operation.speed" = ["800 rpm", "25 Hz"]',
            "values of one axis need one unit",
        ),
        (
            '[[sweep]]\n"operation.speed" = ["25 Hz"]',
            "scene.operation.speed: '25 Hz': 'Hz' is not a unit",
        ),
        (
            '[[sweep]]\n"operation.sped" = ["25 rpm"]',
            "scene.operation.sped: unknown key, did you mean 'speed'?",
        ),
        (
            '[[sweep]]\n"operation.speed" = []',
            "sweep[0].operation.speed: an empty sweep",
        ),
        ('[[sweep]]\n"gears.pinion.teeth" = [20, nan]', "not finite"),
        (
            '[[sweep]]\n"operation.torque" = ["3 N*m", "-3 N*m"]',
            "scene.operation.torque: '-3 N*m' must be at least 0",
        ),
    ],
)
def test_wrong_cases_refuse_the_file(study, text, said):
    (line,) = refused(study, text)
    assert said in line and "study.toml: " in line


def test_a_fault_of_the_file_is_told_once_not_for_every_run(study):
    lines = refused(
        study, SPEEDS + STATIC + "sweep = true\n[numerics]\ntolerence = 1e-3"
    )
    assert (
        len(lines) == 1
        and "scene.numerics.tolerence: unknown key, did you mean 'tolerance'?"
        in lines[0]
    )


def test_a_spectrum_beside_a_swept_torque_is_not_dropped_in_silence(study):
    """Without the sweep the file was refused; with it the spectrum did not count."""
    duty = 'duty = [{ torque = "5 N*m", speed = "900 rpm", share = 1.0 }]'
    one = f'[operation]\ntorque = "5 N*m"\nspeed = "900 rpm"\n{duty}\n'
    swept = '[[sweep]]\n"operation.torque" = ["5 N*m", "6 N*m"]'
    (line,) = refused(study, f"{one}{swept}")
    assert "scene.operation.duty: stands beside operation.torque" in line
    (line,) = refused(study, f'{one}[[case]]\nlabel = "a"\n"operation.speed" = "1 rpm"')
    assert "leave one of them out" in line
