"""New parts in units of a fleet, or under a record: beside units and runs that need
none of it.
"""

import numpy as np
import pytest
from conftest import STATIC
from test_fleet import FLEET, ROWS, fleet

import wearlab as wl
from wearlab.campaign import CampaignError
from wearlab.updating import UpdateError, update
from wearlab.updating.measurements import OperatingRecord
from wearlab.updating.report_text import text_of

AT = 840.0  # hours after which a unit got a new pinion
OLD = "E,2025-01-01,280,160\nE,2026-01-01,840,440\n"
NEW = "E,2026-07-02,1120,120\nE,2026-12-31,1400,260\n"
REPLACED = """
[[update.replaced]]
unit    = "E"
members = ["pinion"]
hours   = 840
"""
# the same as a unit of its own, whose clock begins when the pinion was new
APART = "F,2025-07-02,280,120\nF,2025-12-31,560,260\n"
LIMITED = FLEET.replace(
    "[update]", '[update]\nlimit = { depth = "20 um", flank = "pinion" }'
)


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return wl.Store(tmp_path_factory.mktemp("store"))


def answer(folder, store, rows, text, today=None):
    return update(fleet(folder, rows, text), store, today=today, progress=False)


@pytest.fixture(scope="module")
def replaced(tmp_path_factory, store):
    folder = tmp_path_factory.mktemp("replaced")
    return answer(folder, store, ROWS + OLD + NEW, LIMITED + REPLACED)


def gear_worn_at(folder, cycle):
    """The gear's profile after so many cycles of a run that has lost E's 440 mg."""
    scene = fleet(folder, ROWS, LIMITED).cases[0].scene
    until = scene.replace({"wear.until": {"cycles": cycle}, "wear.snapshots": None})
    mass = 1e6 * float(wl.simulate(until).worn_mass.sel(member="pinion")[-1])
    run = wl.simulate(until.replace("wear.coefficient.factor", 440.0 / mass))
    place = run.path_position.sel(flank="gear").values
    worn = run.wear_depth.isel(update=-1).sel(flank="gear").values
    order = np.argsort(place)
    rows = zip(place[order].tolist(), worn[order].tolist(), strict=True)
    text = "".join(f"{x!r},{y!r}\n" for x, y in rows)
    (folder / "gear.csv").write_text("path_position [m],depth [m]\n" + text)
    return folder / "gear.csv"


def test_a_new_part_is_one_more_unit_that_began_later(replaced, store, tmp_path):
    """Beside a unit of its own whose gear was as worn from the first hour on."""
    seconds = float(replaced["predictions"]["seconds_per_cycle"].sel(unit="E"))
    begin = AT * 3600.0 / seconds
    file = gear_worn_at(tmp_path, begin)
    apart_scene = (
        f'\n[[update.unit]]\nname = "F"\nscene = {{ "wear.initial.gear" = {{ file = '
        f'"{file.as_posix()}", x = "path_position", y = "depth", continuation = "hold" '
        "} }\n"
    )
    apart = answer(tmp_path, store, ROWS + OLD + APART, LIMITED + apart_scene)
    lives = replaced["predictions"]["life_quantile"]
    lives_apart = apart["predictions"]["life_quantile"]
    since_new = lives.sel(unit="E").values - begin
    assert since_new == pytest.approx(lives_apart.sel(unit="F").values, rel=0.01)
    for unit in "ABCD":
        beside = lives_apart.sel(unit=unit).values
        assert lives.sel(unit=unit).values == pytest.approx(beside, rel=0.01)


def test_the_old_part_tells_of_the_others_and_is_no_unit(replaced):
    predictions = replaced["predictions"].to_dataset()
    assert predictions["unit"].values.tolist() == ["A", "B", "C", "D", "E", "new"]
    rows = replaced["observed_data"].to_dataset()
    assert np.sum(rows["unit_name"].values == "E") == 4
    assert not rows["flagged"].values.any()
    assert 0.3 < float(predictions["worn"].sel(unit="E")) < 0.8
    text = "\n".join(text_of(replaced))
    assert "replaced: E: pinion new at" in text


def test_a_new_part_that_was_not_measured_starts_from_the_fleet(
    tmp_path, store, replaced
):
    """Its factor is that of a unit not yet measured, its age counts from its day."""
    tree = answer(tmp_path, store, ROWS + OLD, LIMITED + REPLACED)
    predictions = tree["predictions"].to_dataset()
    of_new = predictions["factor_quantile"].sel(unit="E").values
    of_another = predictions["factor_quantile"].sel(unit="new").values
    assert of_new == pytest.approx(of_another, rel=0.1)
    assert float(predictions["worn"].sel(unit="E")) == pytest.approx(0.0, abs=1e-9)
    assert float(predictions["end_passed"].sel(unit="E")) == 0.0
    width = np.ptp(np.log(of_new[[0, 4]]))
    narrow = replaced["predictions"]["factor_quantile"].sel(unit="E").values
    assert np.ptp(np.log(narrow[[0, 4]])) < 0.7 * width


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('unit    = "E"\n', "", "replaced[0].unit: required of a fleet"),
        ('"E"\n', '"Z"\n', "replaced[0].unit: 'Z' is not one of"),
        ('["pinion"]', '["sun"]', "replaced[0].members: 'sun' is not one of"),
    ],
)
def test_a_wrong_replacement_in_a_fleet_is_one_line(tmp_path, store, old, new, message):
    text = LIMITED + REPLACED.replace(old, new)
    with pytest.raises((CampaignError, UpdateError)) as caught:
        answer(tmp_path, store, ROWS + OLD, text)
    assert message in str(caught.value)


def test_of_one_gear_set_no_unit_is_named(tmp_path):
    text = STATIC + REPLACED
    (tmp_path / "weighings.csv").write_text("cycles,loss\n5e7,140\n")
    (tmp_path / "weighed.toml").write_text(text)
    with pytest.raises(CampaignError, match="here is one gear set"):
        wl.load(tmp_path / "weighed.toml")


def test_a_record_goes_on_with_the_new_part():
    """What is left of it, from the hour of the new part on."""
    time = np.array([0.0, 100.0, 300.0, 400.0])
    record = OperatingRecord(
        time, np.array([5.0, 7.0, 6.0]), np.array([1.0, 2.0, 1.0]), None, False, ""
    )
    later = record.since(150.0)
    assert later.time.tolist() == [0.0, 150.0, 250.0]
    assert later.torque.tolist() == [7.0, 6.0] and later.speed.tolist() == [2.0, 1.0]
    assert record.since(400.0) is None
    mixed = OperatingRecord(time, record.torque, record.speed, None, True, "")
    assert mixed.since(100.0).time.tolist() == pytest.approx([0.0, 75.0, 225.0, 300.0])


PLAIN = STATIC.replace('cycle = "cycles"', 'hours = "hours"').replace(
    "[[update.data]]",
    '[[update.replaced]]\nmembers = ["pinion"]\nhours = 840\n[[update.data]]',
)
RECORDED = PLAIN.replace(
    "[[update.replaced]]",
    """[update.record]
file    = "record.csv"
columns = { hours = "hours" }
units   = { hours = "h", torque = "N*m", speed = "rpm" }
[[update.replaced]]""",
)
WEIGHED = "hours,loss\n280,130\n840,400\n1120,120\n1400,250\n"


def of_one(folder, store, text, weighed=WEIGHED, record=""):
    (folder / "weighings.csv").write_text(weighed)
    (folder / "record.csv").write_text("hours,torque,speed\n" + record)
    (folder / "weighed.toml").write_text(text)
    return update(wl.load(folder / "weighed.toml"), store, progress=False)


def test_a_record_of_what_the_file_says_changes_nothing(tmp_path, store):
    plain = of_one(tmp_path, store, PLAIN)
    recorded = of_one(tmp_path, store, RECORDED, record="0,340,1100\n1400,340,1100\n")
    for name in ("life_quantile", "factor_quantile"):
        beside = plain["predictions"][name].values
        assert recorded["predictions"][name].values == pytest.approx(beside, rel=5e-3)


def test_a_new_part_waits_where_the_record_is_idle(tmp_path, store):
    """Nothing ran since the change: its record had no condition, and was dropped."""
    weighed = "hours,loss\n280,130\n840,400\n"
    plain = of_one(tmp_path, store, PLAIN, weighed=weighed)
    idle = "0,340,1100\n840,0,0\n1400,340,1100\n"
    waited = of_one(tmp_path, store, RECORDED, weighed=weighed, record=idle)
    seconds = float(plain["predictions"]["seconds_per_cycle"])
    later = (
        waited["predictions"]["life_quantile"] - plain["predictions"]["life_quantile"]
    )
    assert later.values * seconds / 3600.0 == pytest.approx(560.0, rel=0.01)


def test_under_a_harder_record_the_new_part_counts_what_it_carried(tmp_path, store):
    """Twice the load wears about twice as fast: a coefficient half as large, the same
    wear to come under twice the load.
    """
    of_mass = 'limit = { worn_mass = "500 mg", member = "pinion" }'
    plain, recorded = (
        text.replace("[update]", f"[update]\n{of_mass}", 1)
        for text in (PLAIN, RECORDED)
    )
    plain = of_one(tmp_path, store, plain)
    harder = of_one(tmp_path, store, recorded, record="0,680,1100\n1400,680,1100\n")
    ratio = (
        harder["predictions"]["factor_quantile"].values[2]
        / plain["predictions"]["factor_quantile"].values[2]
    )
    assert 0.45 < ratio < 0.6
    left = harder["predictions"]["remaining_useful_life_quantile"].values[2]
    left_plain = plain["predictions"]["remaining_useful_life_quantile"].values[2]
    assert left == pytest.approx(left_plain / ratio, rel=0.03)


@pytest.mark.parametrize("recorded", [False, True])
def test_a_change_of_k_is_seen_across_a_replacement(tmp_path, store, recorded):
    """The rate doubles at the same time as the pinion is new: masses say so."""
    text = (RECORDED if recorded else PLAIN).replace(
        "[update]", '[update]\nchange = "once"', 1
    )
    record = "0,340,1100\n1400,340,1100\n"
    steady = of_one(tmp_path, store, text, record=record)
    weighed = WEIGHED.replace("1120,120", "1120,250").replace("1400,250", "1400,520")
    doubled = of_one(tmp_path, store, text, weighed, record)
    assert float(steady["sample_stats"]["log_evidence_of_change"]) < 0.0
    stats = doubled["sample_stats"].to_dataset()
    assert float(stats["log_evidence_of_change"]) > 5.0
    assert float(stats["change_ratio_50"]) == pytest.approx(2.0, rel=0.15)
    assert "contradict" not in str(stats["notes"].values)


def test_a_part_that_wears_twice_as_fast_as_the_old_one_is_told(tmp_path, store):
    weighed = WEIGHED.replace("1120,120", "1120,250").replace("1400,250", "1400,520")
    text = "\n".join(text_of(of_one(tmp_path, store, PLAIN, weighed)))
    assert "before and after a replacement contradict" in text
    assert "two files" not in text
