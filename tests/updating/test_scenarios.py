"""What if: other loads and speeds from some day on, beside real runs and by hand."""

from datetime import date

import numpy as np
import pytest
from conftest import STATIC
from scenes import external_pair
from test_fleet import FLEET, ROWS, TODAY, fleet

import wearlab as wl
from wearlab.campaign import CampaignError
from wearlab.campaign.scenario import Scenario, scene_of
from wearlab.campaign.update import read_update
from wearlab.report.dates_file import content_of
from wearlab.updating import UpdateError, update
from wearlab.updating.report_text import text_of

UNKNOWN = {"wear.coefficient.factor": {"lognormal": {"median": 1.0, "cov": 1.0}}}
POWERED = {
    "gears": external_pair(20, 40),
    "operation": {"power": "5 kW", "torque": "50 N*m"},
}
HARDER = """
[[update.scenario]]
label = "load + 20 %"
from  = 2027-01-01
torque_factor = 1.2
[[update.scenario]]
label = "half the speed"
from  = 2027-01-01
scene = { "operation.speed" = "550 rpm" }
"""
ONE = STATIC.replace('cycle = "cycles"', 'hours = "hours"')
WEIGHED = "hours,loss\n280,70\n840,200\n"


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return wl.Store(tmp_path_factory.mktemp("store"))


def of_one(folder, store, scenarios, weighed=WEIGHED):
    (folder / "weighings.csv").write_text(weighed)
    head, _, data = ONE.partition("[[update.data]]")
    (folder / "weighed.toml").write_text(head + scenarios + "[[update.data]]" + data)
    return update(wl.load(folder / "weighed.toml"), store, progress=False)


def scenario(label, *lines, begin="1000"):
    return "\n".join(
        ["[[update.scenario]]", f'label = "{label}"', f"from = {begin}", *lines, ""]
    )


def test_a_harder_load_is_a_real_run_with_stages(tmp_path, store):
    """Until 1,000 h as the file says, then 1.5 times the torque: brute force."""
    tree = of_one(
        tmp_path, store, scenario("half as much again", "torque_factor = 1.5")
    )
    predictions = tree["predictions"].to_dataset()
    factor = float(predictions["factor_quantile"][2])
    scene = wl.load(tmp_path / "weighed.toml").cases[0].scene
    cycles = 1000.0 * 3600.0 / float(predictions["seconds_per_cycle"])
    torque, speed = float(scene.operation.torque), float(scene.operation.speed)
    stages = [
        {"torque": f"{torque!r} N*m", "speed": f"{speed!r} rad/s", "cycles": cycles},
        {"torque": f"{1.5 * torque!r} N*m", "speed": f"{speed!r} rad/s"},
    ]
    stages[-1]["cycles"] = 1e10
    run = wl.simulate(
        scene.replace(
            {
                "operation.torque": None,
                "operation.speed": None,
                "operation.stage": stages,
                "wear.coefficient.factor": factor,
            }
        )
    )
    median = float(predictions["scenario_life_quantile"].sel(quantile=0.5).item())
    # joined at equal depth, as conditions of a record are: 1.2 % of the life
    assert median == pytest.approx(float(run.life), rel=0.02)
    assert median < 0.9 * float(predictions["life_quantile"][2])
    assert any("if half as much again, from 1,000 h" in line for line in text_of(tree))


def test_half_the_speed_takes_twice_the_hours_that_are_left(tmp_path, store):
    """Static loads know no speed; cycles of the answer are those of today's speed."""
    speed = 'scene = { "operation.speed" = "550 rpm" }'
    tree = of_one(tmp_path, store, scenario("half the speed", speed))
    predictions = tree["predictions"].to_dataset()
    begin = 1000.0 * 3600.0 / float(predictions["seconds_per_cycle"])
    left = predictions["life_quantile"].values - begin
    slow = predictions["scenario_life_quantile"].values[0] - begin
    assert slow == pytest.approx(2.0 * left, rel=1e-3)


def test_a_scenario_that_changes_nothing_is_today(tmp_path, store):
    same = 'scene = { "operation.torque" = "340 N*m" }'
    predictions = of_one(tmp_path, store, scenario("as now", same))["predictions"]
    beside = predictions["life_quantile"].values
    assert predictions["scenario_life_quantile"].values[0] == pytest.approx(
        beside, rel=1e-4
    )


def test_each_unit_of_a_fleet_gets_its_day_in_each_scenario(tmp_path, store):
    wide = FLEET.replace(
        "[update]", '[update]\nlimit = { depth = "60 um", flank = "pinion" }'
    )
    tree = update(
        fleet(tmp_path, ROWS, wide + HARDER), store, today=TODAY, progress=False
    )
    predictions = tree["predictions"].to_dataset()
    now = predictions["end_of_life_quantile"].values.astype("datetime64[D]")
    ends = predictions["scenario_end_of_life_quantile"].values.astype("datetime64[D]")
    begin = np.datetime64("2027-01-01")
    left = (now - begin).astype(float)
    harder = (ends[:, 0] - begin).astype(float)
    slower = (ends[:, 1] - begin).astype(float)
    open_ends = left > 180.0
    assert open_ends.sum() >= 10
    assert harder[open_ends] == pytest.approx(left[open_ends] / 1.2, rel=0.05)
    assert slower[open_ends] == pytest.approx(2.0 * left[open_ends], rel=0.02, abs=2)
    text = "\n".join(text_of(tree))
    assert "if load + 20 %, from 2027-01-01:" in text and "as now" in text

    from io import BytesIO

    from openpyxl import load_workbook

    book = load_workbook(BytesIO(content_of(tree, tmp_path / "days.xlsx")))
    sheet = book["what if 1"]
    assert sheet.cell(1, 1).value == "if load + 20 %, from 2027-01-01:"
    assert sheet.cell(3, 2).value.date() > date(2026, 1, 1)


@pytest.mark.parametrize(
    ("lines", "begin", "said"),
    [
        (["torque_factor = 1.2"], "800", "is before the last inspection"),
        ([], "1000", "nothing is different"),
        (["torque_factor = -1"], "1000", "update.scenario[0].torque_factor"),
        (['scene = { "operation.torqe" = "1 N*m" }'], "1000", "did you mean"),
        (["torque = 3"], "1000", "update.scenario[0].torque"),
    ],
)
def test_a_scenario_that_cannot_be_is_one_line(tmp_path, store, lines, begin, said):
    with pytest.raises((CampaignError, UpdateError)) as caught:
        of_one(tmp_path, store, scenario("x", *lines, begin=begin))
    assert said in str(caught.value)
    assert "update.scenario[0]" in str(caught.value)


def test_a_day_without_a_calendar_is_refused(tmp_path, store):
    """It was left out, and the life of today stood under its name."""
    later = scenario("harder", "torque_factor = 1.5", begin="2027-01-01")
    with pytest.raises(
        UpdateError, match=r"2027-01-01 is a day, .* or operating hours"
    ):
        of_one(tmp_path, store, later)


def test_a_load_that_is_said_twice_is_refused(tmp_path, store):
    twice = scenario(
        "harder", "torque_factor = 1.5", 'scene = { "operation.torque" = "900 N*m" }'
    )
    with pytest.raises((CampaignError, UpdateError), match="load in one place"):
        of_one(tmp_path, store, twice)


def test_a_factor_goes_with_a_power_too():
    scene = wl.Scene.from_mapping(POWERED)
    harder = Scenario.model_validate(
        {"label": "harder", "from": 10.0, "torque_factor": 1.5}
    )
    changed = scene_of(harder, 0, scene)
    assert changed.operation.torque == pytest.approx(1.5 * scene.operation.torque)
    assert changed.operation.speed == pytest.approx(scene.operation.speed)


def test_a_scenario_begins_at_hours_with_their_unit_too():
    def begin(value):
        scenario = {"label": "less", "from": value, "torque_factor": 0.8}
        return read_update({"unknown": UNKNOWN, "scenario": [scenario]}).scenario[0]

    assert begin("9000 h").begin == begin(9000.0).begin == 9000.0
    assert begin("2027-01-01").begin == date(2027, 1, 1)


@pytest.mark.parametrize(
    ("scenario", "said"),
    [
        ({"label": "less"}, r"scenario\[0\]\.from: required: day from which"),
        ({"label": "less", "from": "soon"}, r"scenario\[0\]\.from: 'soon'"),
        ({"label": "less", "from": "9 mm"}, r"scenario\[0\]\.from: '9 mm'"),
    ],
)
def test_a_wrong_begin_is_one_line(scenario, said):
    """`from` is no field's name: saying what was wrong with it was a KeyError."""
    with pytest.raises(CampaignError, match=said):
        read_update({"unknown": UNKNOWN, "scenario": [scenario]})
