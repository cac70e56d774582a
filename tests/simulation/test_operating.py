"""Duties and stages of operation: one condition is the plain run.

Rates are mixed per cycle.
"""

import numpy as np
import pytest
import xarray as xr

from wearlab.life.history import SetRate
from wearlab.life.limits import StopWear
from wearlab.scene import Scene
from wearlab.scene.problems import SceneError
from wearlab.simulation import life_run, simulate
from wearlab.simulation.dataset.conditions import along_duty, in_order
from wearlab.simulation.operating import operating_conditions

RATED = {"torque": "340 N*m", "speed": "1100 rpm"}
EASY = {"torque": "170 N*m", "speed": "2200 rpm"}
WEARS = (
    "wear_depth",
    "wear_rate",
    "max_wear_depth",
    "worn_mass",
    "cycle",
    "operating_hours",
)


def duty(scene, *blocks):
    return scene.replace(
        "operation.duty", [{**block, "share": share} for block, share in blocks]
    )


@pytest.fixture
def short(scene):
    """A quasi-static life of few steps, without film."""
    given = (
        scene("quasi-static")
        .replace("wear.until", {"cycles": 1e6})
        .replace("wear.snapshots", None)
    )
    return given.replace("wear.coefficient.film", False)


@pytest.mark.parametrize("shares", [(1.0,), (0.3, 0.7), (0.2, 0.3, 0.5)])
def test_the_same_condition_over_and_over_is_the_plain_run(short, shares):
    plain = simulate(short)
    mixed = simulate(duty(short, *[(RATED, share) for share in shares]))
    for name in WEARS:
        np.testing.assert_array_equal(mixed[name], plain[name])
    assert mixed.sizes["duty"] == len(shares)
    assert mixed.load_share.dims == ("update", "duty", "mesh", "pair", "phase")
    assert mixed.wear_depth.dims == plain.wear_depth.dims
    np.testing.assert_array_equal(mixed.load_share.isel(duty=-1), plain.load_share)


def test_the_same_condition_twice_vibrates_as_the_plain_run(scene):
    given = (
        scene("base case")
        .replace("wear.until", {"cycles": 2e5})
        .replace("wear.snapshots", None)
    )
    plain = simulate(given)
    mixed = simulate(duty(given, (RATED, 0.5), (RATED, 0.5)))
    np.testing.assert_array_equal(mixed.wear_depth, plain.wear_depth)
    for block in (0, 1):
        np.testing.assert_array_equal(
            mixed.dynamic_mesh_force.isel(duty=block), plain.dynamic_mesh_force
        )
    assert float(mixed.error_estimate_wear_depth[-1]) == pytest.approx(
        float(plain.error_estimate_wear_depth[-1])
    )


def test_rates_are_mixed_by_cycles_not_by_time(short):
    """Unworn and without film the rate is the load's times the flank's: shares of time
    3:1 at 1:2 speed.
    """
    mixed = simulate(duty(short, (RATED, 0.75), (EASY, 0.25)))
    weight = np.array([0.75 * 1100, 0.25 * 2200]) / (0.75 * 1100 + 0.25 * 2200)
    mean = short.replace("operation.torque", f"{weight @ [340, 170]:.15g} N*m")
    np.testing.assert_allclose(
        mixed.wear_rate.isel(update=0),
        simulate(mean).wear_rate.isel(update=0),
        rtol=1e-9,
        atol=1e-30,
    )
    hours = mixed.operating_hours.values[-1] / mixed.cycle.values[-1]
    assert hours == pytest.approx(60.0 / (0.75 * 1100 + 0.25 * 2200))
    np.testing.assert_allclose(mixed.duty_speed, np.array([1100, 2200]) * np.pi / 30)
    np.testing.assert_allclose(mixed.duty_torque, [340, 170])


def test_every_condition_has_its_own_film(scene):
    given = (
        scene("quasi-static")
        .replace("wear.until", {"cycles": 1e5})
        .replace("wear.snapshots", None)
    )
    mixed = simulate(duty(given, (RATED, 0.5), (EASY, 0.5)))
    easy = simulate(
        given.replace("operation.torque", "170 N*m").replace(
            "operation.speed", "2200 rpm"
        )
    )
    np.testing.assert_allclose(
        mixed.film_thickness.isel(update=0, duty=1),
        easy.film_thickness.isel(update=0),
        rtol=1e-12,
    )
    assert float(mixed.film_thickness[0, 1].max()) > 1.2 * float(
        mixed.film_thickness[0, 0].max()
    )


def test_hours_end_a_duty_at_its_mean_speed(short):
    mixed = simulate(
        duty(short, (RATED, 0.5), (EASY, 0.5)).replace("wear.until", {"hours": 10})
    )
    assert float(mixed.cycle[-1]) == pytest.approx(10 * 60 * 1650, rel=1e-12)


def test_a_load_table_is_its_contents(short, tmp_path):
    (tmp_path / "loads.csv").write_text("T,n,time\n340,1100,6\n50,900,0\n170,2200,2\n")
    table = {
        "file": str(tmp_path / "loads.csv"),
        "columns": {"torque": "T", "speed": "n", "share": "time"},
        "units": {"torque": "N*m", "speed": "rpm", "share": "h"},
    }
    read = short.replace("operation.duty", table)
    assert read.id == duty(short, (RATED, 0.75), (EASY, 0.25)).id
    assert Scene.from_canonical(read.canonical()).id == read.id


def stages(scene, *each):
    return scene.replace("operation.stage", [{**one, **more} for one, more in each])


def test_stages_of_one_condition_are_the_plain_run(short):
    split = stages(short, (RATED, {"label": "first", "cycles": 4e5}), (RATED, {}))
    plain = simulate(short)
    run = simulate(split)
    assert float(run.cycle[-1]) == float(plain.cycle[-1]) == 1e6
    np.testing.assert_allclose(
        run.wear_depth[-1], plain.wear_depth[-1], rtol=3e-3, atol=1e-12
    )
    assert run.update_stage.values[0] == "first" and run.update_stage.values[-1] == "2"
    assert list(run.stage.values) == ["first", "2"]
    assert 4e5 in run.cycle.values and np.all(np.diff(run.cycle.values) > 0.0)


def test_wear_carries_over_from_stage_to_stage(short):
    asked = short.replace("wear.snapshots", {"cycles": [2e5, 7e5]})
    run = simulate(stages(asked, (RATED, {"cycles": 5e5}), (EASY, {"cycles": 3e5})))
    np.testing.assert_allclose(run.cycle, [0, 2e5, 5e5, 7e5, 8e5])
    np.testing.assert_allclose(
        run.operating_hours, np.array([0, 2e5, 5e5, 5e5 + 1e5, 5e5 + 1.5e5]) * 60 / 1100
    )
    first = simulate(short.replace("wear.until", {"cycles": 5e5}))
    np.testing.assert_allclose(run.wear_depth[2], first.wear_depth[-1], rtol=1e-12)
    grown = (run.max_wear_depth[4] - run.max_wear_depth[2]) / 3e5
    rate = (
        simulate(short.replace("operation.torque", "170 N*m"))
        .wear_rate[0]
        .max("profile")
    )
    np.testing.assert_allclose(grown, rate, rtol=0.1)
    assert str(run.end_reason.values) == "cycles" and run.static_mesh_force.dims == (
        "stage",
        "mesh",
    )
    assert run.static_mesh_force.values[1, 0] == pytest.approx(
        0.5 * run.static_mesh_force.values[0, 0]
    )


def test_a_depth_ends_the_stage_that_reaches_it(short):
    until = short.replace("wear.until", None).replace(
        "wear.until", {"depth": "0.1 um", "flank": "gear"}
    )
    run = simulate(
        stages(until, (EASY, {"cycles": 1e5}), (RATED, {"cycles": 1e9}), (EASY, {}))
    )
    assert str(run.end_reason.values) == "depth" and set(run.update_stage.values) == {
        "1",
        "2",
    }
    assert float(run.life) == float(run.cycle[-1])
    assert float(run.max_wear_depth.sel(flank="gear")[-1]) == pytest.approx(
        1e-7, rel=1e-9
    )
    expected = 1e5 * 60 / 2200 + (float(run.life) - 1e5) * 60 / 1100
    assert float(run.service_life) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("duty", [{**RATED, "share": 0.4}], "sum to 0.4, not to 1"),
        ("duty", {"file": "loads.csv"}, "cannot read loads.csv"),
        ("stage", [RATED, EASY], "stage 1 needs 'cycles'"),
        (
            "stage",
            [{**RATED, "label": "a", "cycles": 1}, {**EASY, "label": "a"}],
            "two stages have one label",
        ),
        ("stage", [], "there is no stage"),
    ],
)
def test_impossible_conditions_are_refused(short, key, value, text):
    with pytest.raises(SceneError, match=text):
        short.replace(f"operation.{key}", value)


def test_stages_need_a_law_and_an_end(short):
    each = [{**RATED, "cycles": 1e5}, EASY]
    with pytest.raises(SceneError, match=r"last stage needs 'cycles'"):
        short.replace("wear.until", None).replace("operation.stage", each)


def test_a_duty_at_rest_wears_as_under_its_static_loads(scene):
    """What held steps follow is mixed like the rates of the motion."""
    given = duty(scene("base case"), (RATED, 0.4), (EASY, 0.6))
    moving = operating_conditions(given.replace("wear.load", "instant"))[0].coupling
    still = operating_conditions(given.replace("wear.load", "static"))[0].coupling
    depth = still.flat(still.unworn()) + 1e-6
    np.testing.assert_array_equal(
        SetRate(moving.static_only())(depth), SetRate(still)(depth)
    )
    assert still.static_only() is None


@pytest.mark.parametrize("join", [along_duty, in_order])
def test_conditions_may_have_more_or_fewer_rivals_each(join):
    def condition(rivals: int) -> xr.Dataset:
        found = {
            "rival_force_max": (
                ("update", "rival"),
                np.full((2, rivals), 5.0),
                {"units": "N"},
            )
        }
        return xr.Dataset(
            {"cycles": ("update", np.zeros(2)), **(found if rivals else {})}
        )

    joined = join([condition(0), condition(2), condition(1)]).rival_force_max
    assert joined.units == "N" and joined.sizes["rival"] == 2
    assert int(joined.notnull().sum()) == 2 * 2 + 2 * 1


def test_a_stage_that_cannot_begin_says_why_the_life_ends(short, monkeypatch):
    """With one stage behind it, too: the run had said that it ran all its cycles."""
    whole = life_run._integrated

    def no_second(stage, wear, until, before, worn_beyond):
        if before > 0.0:
            raise StopWear("unbounded motion")
        return whole(stage, wear, until, before, worn_beyond)

    monkeypatch.setattr(life_run, "_integrated", no_second)
    run = simulate(stages(short, (RATED, {"cycles": 4e5}), (EASY, {})))
    assert (run.end_reason.item(), run.verdict.item()) == (
        "unbounded motion",
        "stopped",
    )
    assert float(run.cycle[-1]) == 4e5 and run.sizes["stage"] == 1
