"""What really ran: a load record against real runs with stages, and
what a record cannot be.
"""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from conftest import STATIC
from made import RATE, ErrorModel, blocks, history, observed, study

import wearlab as wl
from wearlab.campaign import CampaignError
from wearlab.campaign.update_options import RecordBlock, RecordColumns
from wearlab.updating import UpdateError, update
from wearlab.updating.answers import answer_of
from wearlab.updating.calendar import day_text
from wearlab.updating.cases import studies
from wearlab.updating.measurements import OperatingRecord, read_record
from wearlab.updating.record_clocks import clocked_run
from wearlab.updating.report_text import text_of
from wearlab.updating.run_curves import Clock

RPM = 1200.0
ROWS = (
    (0, 500, RPM),
    (100, 250, 0.5 * RPM),
    (400, 0, 0),
    (450, 420, RPM),
    (600, "", ""),
)
RECORD = "hours,torque,speed\n" + "".join(f"{h},{t},{n}\n" for h, t, n in ROWS)
RECORDED = STATIC.replace('cycle = "cycles"', 'hours = "hours"').replace(
    "[[update.data]]",
    """[update.record]
file    = "record.csv"
columns = { hours = "hours" }
units   = { hours = "h", torque = "N*m", speed = "rpm" }
[[update.data]]""",
)


def campaign(folder, weighings, record=RECORD, text=RECORDED):
    (folder / "record.csv").write_text(record)
    (folder / "weighings.csv").write_text(
        "hours,loss\n" + "".join(f"{h},{v!r}\n" for h, v in weighings)
    )
    (folder / "recorded.toml").write_text(text)
    return wl.load(folder / "recorded.toml")


@pytest.fixture(scope="module")
def staged(tmp_path_factory):
    """The scene with the record as stages and 1.3 times the coefficient: what brute
    force has worn.
    """
    scene = campaign(tmp_path_factory.mktemp("staged"), [(100, 1.0)]).cases[0].scene
    stages = [
        {"torque": f"{t} N*m", "speed": f"{n} rpm", "cycles": 60.0 * n * (after[0] - h)}
        for (h, t, n), after in pairwise(ROWS)
        if t
    ]
    own = scene.operation
    stages.append({"torque": f"{own.torque} N*m", "speed": f"{own.speed!r} rad/s"})
    scene = scene.replace("operation", {"stage": stages}).replace(
        "wear.coefficient.factor", 1.3
    )
    return wl.simulate(scene)


def test_a_record_gives_the_life_that_stages_have(staged, tmp_path):
    hours = staged.operating_hours.values / 3600.0
    mass = 1e6 * staged.worn_mass.isel(member=0).values
    running = {200: 200, 500: 450, 600: 550}  # 50 hours stood still
    weighings = [(h, float(np.interp(ran, hours, mass))) for h, ran in running.items()]
    made = campaign(tmp_path, weighings, text=RECORDED.replace("5 mg", "0.5 mg"))
    tree = update(made, wl.Store(tmp_path / "store"), progress=False)
    predictions = tree["predictions"].to_dataset()
    assert float(predictions["factor_quantile"][2]) == pytest.approx(1.3, rel=0.005)
    rest = (
        predictions["remaining_useful_life_quantile"].values
        * float(predictions["seconds_per_cycle"])
        / 3600
    )
    life = float(staged.life) if "life" in staged else float(staged.cycle[-1])
    truth = float(np.interp(life, staged.cycle.values, hours)) - 550.0
    assert rest[2] == pytest.approx(truth, rel=0.02)
    without = RECORDED.replace("5 mg", "0.5 mg").partition("[update.record]")
    plain = without[0] + "[[update.data]]" + without[2].partition("[[update.data]]")[2]
    other = update(
        campaign(tmp_path, weighings, text=plain),
        wl.Store(tmp_path / "store"),
        progress=False,
    )
    assert abs(float(other["predictions"]["factor_quantile"][2]) / 1.3 - 1.0) > 0.1
    assert any("wear" in line for line in text_of(tree))


def test_a_unit_of_a_fleet_has_the_record_and_the_clocks_of_a_lone_one(
    staged, tmp_path
):
    hours = staged.operating_hours.values / 3600.0
    mass = 1e6 * staged.worn_mass.isel(member=0).values
    weighed = [
        f"A,{h},{float(np.interp(ran, hours, mass))!r}\n"
        for h, ran in ((200, 200), (500, 450), (600, 550))
    ]
    text = RECORDED.replace("5 mg", "0.5 mg").replace(
        ", value =", ', unit = "box", value ='
    )
    made = campaign(
        tmp_path, [(100, 1.0)], text=text + "[update.population]\nstraying = 0.01\n"
    )
    (tmp_path / "weighings.csv").write_text("box,hours,loss\n" + "".join(weighed))
    tree = update(made, wl.Store(tmp_path / "store"), progress=False)
    assert float(tree["predictions"]["factor_quantile"][0, 2]) == pytest.approx(
        1.3, rel=0.005
    )


def block(folder, text, **columns):
    (folder / "record.csv").write_text(text)
    units = {"torque": "N*m", "speed": "rpm"} | (
        {"hours": "h"} if "hours" in columns else {}
    )
    units |= {"duration": "h"} if "duration" in columns else {}
    return RecordBlock(
        file=Path(folder / "record.csv"), columns=RecordColumns(**columns), units=units
    )


def test_dates_tell_the_hours_in_operation(tmp_path):
    rows = (
        "date,torque,speed\n2026-01-01,100,1000\n2026-01-11,0,0\n"
        "2026-01-21,200,1000\n2026-01-31,,\n"
    )
    record = read_record(block(tmp_path, rows, date="date"), None, None)
    assert record.time / 3600.0 == pytest.approx([0.0, 240.0, 240.0, 480.0])
    at = np.array(["2026-01-06", "2026-01-16", "2026-01-26"], "datetime64[D]")
    days = record.calendar(None)
    assert days.hours(at) == pytest.approx([120.0, 240.0, 360.0])
    assert day_text(days.day[-1]) == "2026-01-31" and days.time[-1] == 480.0
    assert days.a_year == pytest.approx(480.0 * 365.2425 / 30.0)
    assert days.texts(np.array([120.0, 360.0])).tolist() == [
        "2026-01-06",
        "2026-01-26",
    ]  # not evenly
    ended = days._replace(a_year=np.nan)
    assert np.isnan(ended.hours(["2026-01-06", "2026-03-01"])).tolist() == [False, True]


def test_bins_have_no_order_and_many_conditions_are_classed(tmp_path):
    bins = "duration,torque,speed\n" + "".join(
        f"10,{t},{n}\n" for t in range(0, 100, 5) for n in (500, 900)
    )
    record = read_record(block(tmp_path, bins, duration="duration"), None, None)
    conditions, which = record.conditions()
    assert record.mixed and record.time[-1] == 400 * 3600.0 and len(conditions) <= 12
    cycles = np.diff(record.time) * record.speed * (which >= 0)
    assert conditions[which, 0] @ cycles == pytest.approx(record.torque @ cycles)
    assert (which[:2] == -1).all()


def test_bins_of_cycles_and_ranges_are_those_of_hours_and_middles(tmp_path):
    """1e5 turns at 1000 1/min last 100 min; 50 to 150 N m count as 100 N m."""
    cycles = "turns,torque from,torque to,speed\n1e5,50,150,1000\n2e5,-30,-10,500\n"
    hours = f"duration,torque,speed\n{1e5 / 6e4!r},100,1000\n{2e5 / 3e4!r},-20,500\n"
    expected = read_record(block(tmp_path, hours, duration="duration"), None, None)
    by_name = read_record(block(tmp_path, cycles, cycles="turns"), None, None)
    torque = ("torque from", "torque to")
    named = block(tmp_path, cycles, cycles="turns", torque=torque)
    for record in (by_name, read_record(named, None, None)):
        np.testing.assert_allclose(record.time, expected.time, rtol=1e-12)
        np.testing.assert_allclose(record.torque, expected.torque)
        np.testing.assert_allclose(record.speed, expected.speed)
        assert record.mixed


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("turns,torque,speed\n1e5,1,0\n", "'speed': tells no time of its cycles: give"),
        (
            "turns,torque from,torque to,speed\n1e5,-1,1,5\n",
            "line 2, column 'torque from': -1 to 1: a range on both sides of 0",
        ),
    ],
)
def test_bins_without_a_time_or_a_middle_are_refused(tmp_path, rows, said):
    with pytest.raises(UpdateError, match=said):
        read_record(block(tmp_path, rows, cycles="turns"), None, None)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (
            "hours,torque\n0,1\n5,1\n",
            "no column 'speed' for speed; there are hours, torque: name it in",
        ),
        ("hours,torque,speed\n0,1,1\n", "a row holds until the next"),
        (
            "hours,torque,speed\n0,1,1\n5,2,2\n5,,\n",
            "line 4, column 'hours': is not after the row before it",
        ),
        (
            "hours,torque,speed\n0,,1\n5,,\n",
            "line 2, column 'torque': is empty; 0 stands for",
        ),
        ("hours,torque,speed\n7,1,1\n9,,\n", "the record begins after 7 h: begin at 0"),
        ("hours,torque,speed\n0,1,0\n9,,\n", "nothing ran: speed is 0 in every row"),
    ],
)
def test_a_wrong_record_is_one_line(tmp_path, rows, said):
    with pytest.raises(UpdateError, match=said):
        read_record(block(tmp_path, rows, hours="hours"), None, None)


def test_what_a_record_cannot_go_with_is_refused(tmp_path):
    with pytest.raises(CampaignError, match="say when by hours or date"):
        campaign(
            tmp_path,
            [(1, 1)],
            text=RECORDED.replace('hours = "hours", value', 'cycle = "hours", value'),
        )
    with pytest.raises(
        CampaignError, match="name one of hours, date, duration, cycles, not 2"
    ):
        campaign(
            tmp_path,
            [(1, 1)],
            text=RECORDED.replace('{ hours = "hours" }', '{ hours = "a", date = "b" }'),
        )
    torque = (
        '[update.unknown]\n"operation.torque" = { normal = { mean = "340 N*m", sd = '
        '"10 N*m" } }'
    )
    made = campaign(
        tmp_path, [(1, 1)], text=RECORDED.replace("[update.unknown]", torque)
    )
    with pytest.raises(
        UpdateError,
        match=r"update.record: goes with the unknown wear\.coefficient\.factor",
    ):
        studies(made)


def test_hours_between_dates_are_those_of_the_calendar_or_a_note_says_that_all_count(
    tmp_path,
):
    a_year = 6200.0
    two_years = (
        "date,torque,speed\n2024-01-01,100,1000\n2025-01-01,200,1000\n{}2026-01-01,,\n"
    )
    made = block(tmp_path, two_years.format(""), date="date")
    record = read_record(made, None, a_year)
    assert record.time[-1] / 3600.0 == pytest.approx(731 / 365.2425 * 6200.0)
    assert (
        record.excess(a_year) is None
        and read_record(made, None, None).excess(None) is None
    )
    assert read_record(made, None, None).time[-1] == 731 * 86400.0
    stood = block(
        tmp_path, two_years.format("2025-07-01,0,0\n2025-07-15,200,1000\n"), date="date"
    )
    record = read_record(stood, None, a_year)
    assert record.excess(a_year) == pytest.approx((717 * 24.0, 731 / 365.2425 * 6200.0))
    told = stood.model_copy(update={"hours_per_year": 6000.0})
    record = read_record(told, None, a_year)
    assert record.time[-1] / 3600.0 == pytest.approx(717 / 365.2425 * 6000.0)
    assert record.excess(a_year) is None


@pytest.mark.parametrize("fleet", [None, "a unit of one"])
def test_masses_are_mixed_at_equal_mass(fleet):
    """Were mixed at equal depth, at which a harder load has worn
    less: k came out 2 % off.
    """
    cycles = np.array([1e5, 2e5])
    seen = (observed(cycles, 1.05 * RATE * cycles, ErrorModel(1e-5)),)
    own = replace(history(seen, rate=1.0 * RATE), seconds_per_cycle=1.0)
    deep = replace(history(seen, rate=1.1 * RATE), seconds_per_cycle=1.0)
    heavy = replace(history(seen, rate=1.05 * RATE), seconds_per_cycle=1.0)
    record = OperatingRecord(
        np.array([0.0, 2e5]), np.ones(1), np.ones(1), None, False, ""
    )
    asked = replace(
        study({"lognormal": {"median": 1.0, "cov": 1.0}}, seen), record=record
    )
    asked = replace(asked, spec=asked.spec.model_copy(update={"fleet": fleet}))
    found = clocked_run(asked, own, [replace(deep, points=heavy.points)])
    assert found.equal(cycles) == pytest.approx(1.1 * cycles)
    assert found.equal(cycles, found.points[0].clock) == pytest.approx(1.05 * cycles)


def test_idle_and_reversed_rows_of_a_record_pass_time_alone(tmp_path):
    """Negative torques were refused, so that people deleted their hours."""
    rows = (
        (0, 300, 1000),
        (10, -200, -1000),
        (13, 0, 900),
        (20, 300, -1000),
        (30, "", ""),
    )
    for heads in ("hours,torque,speed", "hours,Drehmoment,Drehzahl"):
        text = heads + "\n" + "".join(f"{h},{t},{n}\n" for h, t, n in rows)
        names = heads.split(",")[1:]
        made = block(tmp_path, text, hours="hours")
        units = {names[0]: "N*m", names[1]: "rpm", "hours": "h"}
        made = made.model_copy(update={"units": units})
        record = read_record(made, None, None)
        assert record.time[-1] == 30 * 3600.0
        conditions, which = record.conditions()
        assert list(which) == [0, -1, -1, 0] and len(conditions) == 1
        assert record.reversed_work == pytest.approx(200 * 3 / (300 * 20))


def test_what_back_flanks_would_change_is_refused_and_what_not_is_told(tmp_path):
    reversed_rows = RECORD.replace("400,0,0", "400,-300,1200")
    with pytest.raises(UpdateError, match=r"negative torque wear back .*, worn_mass, "):
        studies(campaign(tmp_path, [(200, 1.0)], reversed_rows))
    mostly = reversed_rows.replace("-300", "-9000")
    with pytest.raises(UpdateError, match="give all torques the other sign, and oper"):
        studies(campaign(tmp_path, [(200, 1.0)], mostly))

    record = read_record(block(tmp_path, mostly, hours="hours"), None, None)
    other_sign = replace(record, torque=-record.torque)
    assert record.reversed_work > 1.0 > other_sign.reversed_work

    of_depth = (  # the remedy
        RECORDED.replace('quantity = "worn_mass"', 'quantity = "max_wear_depth"')
        .replace('member   = "pinion"', 'flank    = "pinion"')
        .replace('loss = "mg"', 'loss = "um"')
        .replace("5 mg", "0.1 um")
    )
    trees = [
        update(
            campaign(tmp_path, [(200, 1.0)], record, of_depth),
            wl.Store(tmp_path / "store"),
            progress=False,
        )
        for record in (reversed_rows, RECORD)
    ]
    factors = [tree["predictions"]["factor_quantile"].values for tree in trees]
    assert factors[0] == pytest.approx(factors[1], rel=1e-9)
    said = ["\n".join(text_of(tree)) for tree in trees]
    assert "rows of negative torque in update.record wear back flanks, 1" in said[0]
    assert "negative torque" not in said[1]


def test_a_record_that_begins_with_a_standstill_is_no_life_that_has_ended():
    """Its clock has two knots at the first cycle, between which 0 was divided by 0."""
    cycles = np.linspace(1e5, 8e5, 8)
    seen = (observed(cycles, RATE * cycles, ErrorModel(3e-4)),)
    knots = np.array([0.0, 0.0, 1e6, 2e6])
    run = replace(history(seen, end=4e6), clock=Clock(knots, knots))
    asked = study({"lognormal": {"median": 1.0, "cov": 1.0}}, seen)
    alone = answer_of(asked, [run], blocks(seen))
    several = answer_of(asked, [run] * 6, blocks(seen))
    at = np.array([0.0, 1e5, 1.4e6, 1.6e6])
    np.testing.assert_allclose(several.life_below(at), alone.life_below(at), atol=1e-9)
    assert several.life_below(0.0)[0] < 1e-6


UNITS_WITH_RANGES = """box,hours,torque from,torque to,speed
A,0,50,150,1000
B,0,-10,20,1000
A,10,100,200,1000
A,20,,,
B,20,,,
"""


def test_a_range_of_another_unit_refuses_nobody_and_the_last_row_may_be_empty(tmp_path):
    made = block(tmp_path, UNITS_WITH_RANGES, hours="hours", unit="box")
    record = read_record(made, "A", None)
    np.testing.assert_allclose(record.torque, [100.0, 150.0])
    with pytest.raises(UpdateError, match="line 3, column 'torque from': -10 to 20"):
        read_record(made, "B", None)

    gap = UNITS_WITH_RANGES.replace("A,10,100,200", "A,10,100,")
    made = block(tmp_path, gap, hours="hours", unit="box")
    with pytest.raises(UpdateError, match=r"line 4, column 'middle of .*: is empty"):
        read_record(made, "A", None)
