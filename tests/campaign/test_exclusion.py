import math
from fractions import Fraction

import pytest
from scenes import CAMPAIGNS

from wearlab.assembly.sets import build_set
from wearlab.campaign import CampaignError, load
from wearlab.campaign.case import CaseValues

SWEEPS = """
[[sweep]]
"operation.torque" = ["100 N*m", "200 N*m", "300 N*m"]
[[sweep]]
"operation.speed" = ["1000 rpm", "2000 rpm"]
"""


def torques_and_speeds(campaign):
    by_name = {axis.name: axis.values for axis in campaign.axes}
    return [
        tuple(by_name[name][i] for name, i in case.position.items())
        for case in campaign.cases
    ]


def test_conditions_on_keys(study):
    campaign = study(
        'exclude = ["torque >= 0.2 kN*m and operation.speed > 1500 rpm"]' + SWEEPS
    )
    assert torques_and_speeds(campaign) == [
        (100, 1000),
        (100, 2000),
        (200, 1000),
        (300, 1000),
    ]
    assert [one.position for one in campaign.excluded] == [
        {"torque": 1, "speed": 1},
        {"torque": 2, "speed": 1},
    ]
    assert (
        campaign.excluded[0].condition
        == "torque >= 0.2 kN*m and operation.speed > 1500 rpm"
    )


def test_the_first_condition_that_is_met_is_named(study):
    campaign = study('exclude = ["torque > 250 N*m", "speed > 1500 rpm"]' + SWEEPS)
    assert [one.condition for one in campaign.excluded] == [
        *("speed > 1500 rpm", "speed > 1500 rpm"),
        *("torque > 250 N*m", "torque > 250 N*m"),
    ]


def test_identity_is_unaffected(study):
    every = {case.id for case in study(SWEEPS).cases}
    some = {case.id for case in study('exclude = "speed > 1500 rpm"' + SWEEPS).cases}
    assert len(some) == 3 and some < every


def test_more_values_are_more_runs_and_no_others(study):
    few = {case.id for case in study(SWEEPS).cases}
    more = {
        case.id
        for case in study(SWEEPS.replace('"2000 rpm"', '"1500 rpm", "2000 rpm"')).cases
    }
    assert few < more and len(more) == len(few) + 3


def test_raising_n_of_a_sobol_sample_adds_runs(study):
    text = """
    [[sweep]]
    sample = {{ method = "sobol", n = {n}, seed = 3 }}
    "wear.coefficient.factor" = {{ lognormal = {{ median = 1.0, cov = 0.3 }} }}
    "operation.torque" = {{ normal = {{ mean = "340 N*m", sd = "10 N*m" }} }}
    """
    few = {case.id for case in study(text.format(n=5)).cases}
    more = {case.id for case in study(text.format(n=8)).cases}
    assert few < more and len(more) == 8


def derive(name, scene):
    return CaseValues(scene, {}, {}).get(name)


def test_derived_quantities_are_computed_when_named(study, monkeypatch):
    asked = []
    monkeypatch.setattr(
        CaseValues, "derived", lambda self, name: asked.append(name) or 2.0
    )
    study('exclude = "torque > 250 N*m"' + SWEEPS)
    assert asked == []
    campaign = study('exclude = "torque > 250 N*m and speed_ratio > 1.5"' + SWEEPS)
    assert asked == ["speed_ratio"] * 2 and len(campaign.excluded) == 2


def test_mesh_frequency_and_contact_ratio(study):
    campaign = study(
        'exclude = "mesh_frequency > 1000 Hz"' + SWEEPS
    )  # 50 teeth at 1000, 2000 rpm: 833, 1667 Hz
    assert [speed for _, speed in torques_and_speeds(campaign)] == [1000] * 3
    teeth = '[[sweep]]\n"gears.gear.teeth" = [20, 100]\n'
    ratios = [derive("contact_ratio", case.scene) for case in study(teeth).cases]
    assert ratios[0] < ratios[1] and 1.5 < ratios[0] < 1.9
    assert (
        len(study(f'exclude = "contact_ratio < {sum(ratios) / 2}"\n{teeth}').cases) == 1
    )


def test_speed_ratio_is_speed_over_the_first_critical_one(study):
    text = (
        '[mesh]\nstiffness = { model = "constant", value = "300 N/um", of = "mesh" }\n'
    )
    scene = study(text).cases[0].scene
    pair = built_pair(scene)
    yielding = sum(
        1.0 / gear.inertia for gear in (pair.driving, pair.driven)
    )  # their roots differ
    base_radius = 0.5 * 0.003 * 50 * math.cos(math.radians(20.0))
    frequency = math.sqrt(3e8 * base_radius**2 * yielding) / (2.0 * math.pi)
    mesh_frequency = 1100.0 / 60.0 * 50
    ratio = derive("speed_ratio", scene)
    assert ratio == pytest.approx(mesh_frequency / frequency, rel=1e-6)


def built_pair(scene):
    from wearlab.assembly.sets import build_pair

    return build_pair(scene)


def test_derived_quantities_of_planetary_and_internal_sets():
    """A mesh of the planets meets z_sun times for every turn of the
    sun relative to the carrier.
    """
    scene = load(CAMPAIGNS / "base" / "planetary_ngw11.toml").cases[0].scene
    sun = Fraction(scene.gears.sun.teeth)
    ring = Fraction(scene.gears.ring.teeth)
    assert (scene.operation.input, scene.operation.fixed) == ("sun", "ring")
    share = ring / (
        sun + ring
    )  # of the sun's speed, relative to the carrier: Willis with the ring at rest
    turns = scene.operation.speed / (2.0 * math.pi)
    assert derive("mesh_frequency", scene) == pytest.approx(
        turns * float(sun * share), rel=1e-12
    )
    both = [kind.pair.contact_ratio for kind in build_set(scene).kinds]
    assert len(set(both)) == 2
    assert derive("contact_ratio", scene) == min(both)
    internal = load(CAMPAIGNS / "base" / "internal_40_100.toml").cases[0].scene
    assert (
        1.5 < derive("contact_ratio", internal) < 2.2
    )  # an internal pair overlaps more than 40:100 outside


def test_a_scene_without_dynamics_has_no_speed_ratio(study):
    assert len(study('exclude = "speed_ratio > 0"\ndrop = ["dynamics"]\n').cases) == 1


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('exclude = ""', "is no condition"),
        ("exclude = 3", "is no condition"),
        (
            'exclude = "torqe > 3 N*m"',
            "did you mean 'torque'? (at character 1 of 'torqe > 3 N*m')",
        ),
        (
            'exclude = "teeth > 3"',
            "may mean 'gears.gear.teeth' or 'gears.pinion.teeth'",
        ),
        (
            'exclude = "torque > 3"',
            "'operation.torque' needs a unit, such as '340 N*m'",
        ),
        ('exclude = "torque > 1 N*m"', "every one of 1 cases is excluded"),
    ],
)
def test_wrong_conditions_are_refused(study, text, said):
    with pytest.raises(CampaignError) as caught:
        study(text)
    assert said in str(caught.value) and "study.toml: exclude" in str(caught.value)


@pytest.mark.parametrize("told", ["200 N*m", "0.2 kN*m", "200000 N*mm"])
def test_equality_in_every_unit(study, told):
    campaign = study(f'exclude = ["torque = {told}"]' + SWEEPS)
    assert torques_and_speeds(campaign) == [
        (100, 1000),
        (100, 2000),
        (300, 1000),
        (300, 2000),
    ]


@pytest.mark.parametrize(
    "condition", ["speed >= 1000 rpm", "speed in [1000 1/min]", "speed <= 1000 rpm"]
)
def test_the_speed_that_was_written_is_met(study, condition):
    sweeps = '[[sweep]]\n"operation.speed" = ["999 rpm", "1000 rpm", "1001 rpm"]\n'
    left = [
        speed
        for (speed,) in torques_and_speeds(
            study(f'exclude = ["{condition}"]\n{sweeps}')
        )
    ]
    assert 1000 not in left and len(left) in (1, 2)
