"""Lives: snapshots change nothing, limits are landed on, a scene that
cannot be is refused.
"""

import numpy as np
import pytest

from wearlab.dynamics.steady.coexisting import FURTHER, RELEASES
from wearlab.figures.kind import Run
from wearlab.figures.runs import _with_states
from wearlab.life import history
from wearlab.life.coupling import Coupling
from wearlab.simulation import Refused, simulate


def test_snapshots_change_nothing(scene, run):
    with_one = run("base case")
    with_more = simulate(
        scene("base case").replace("wear.snapshots.cycles", [1e6, 5e6, 1.2e7])
    )
    without = simulate(scene("base case").replace("wear.snapshots", None))
    for name in (
        "wear_depth",
        "wear_rate",
        "dynamic_mesh_force",
        "mesh_deflection_rate",
    ):
        last = with_one[name].isel(update=-1).values
        np.testing.assert_array_equal(with_more[name].isel(update=-1), last)
        np.testing.assert_array_equal(without[name].isel(update=-1), last)
        np.testing.assert_array_equal(
            with_more[name].isel(update=2), with_one[name].isel(update=1)
        )
    assert without.sizes["update"] == int(without.count_wear_steps) + 1


def test_no_state_without_motion_is_evaluated_twice(scene, monkeypatch):
    looked_at = []
    evaluate = Coupling.evaluate

    def noted(coupling, wear, *near):
        looked_at.append(b"".join(depth.tobytes() for depth in wear))
        return evaluate(coupling, wear, *near)

    still = scene("quasi-static").replace("wear.snapshots", None)
    monkeypatch.setattr(Coupling, "evaluate", noted)
    found = simulate(still)
    assert int(found.count_contact_analyses) > found.sizes["update"] > 2
    assert len(looked_at) == len(set(looked_at))

    monkeypatch.setattr(history, "ACCEPTED_STATES", 1)
    again = simulate(still)
    assert len(looked_at) > 2 * len(set(looked_at))
    for name, values in found.variables.items():
        if not str(name).startswith("run_time"):
            np.testing.assert_array_equal(again[name].values, values.values)


def test_depth_limit_is_the_life(scene):
    limited = scene("quasi-static").replace(
        "wear.until", {"depth": "1 um", "flank": "gear"}
    )
    data = simulate(
        limited.replace("wear.snapshots", {"depth": ["0.4 um"], "flank": "gear"})
    )
    deepest = data.max_wear_depth.sel(flank="gear").values
    np.testing.assert_allclose(deepest, [0.0, 0.4e-6, 1e-6], rtol=1e-8)
    preset = data.preset_depth.sel(flank="gear").values
    np.testing.assert_array_equal(preset, [np.nan, 0.4e-6, 1e-6])
    assert np.isnan(data.preset_depth.sel(flank="pinion")).all()
    assert [label.text for label in _with_states([Run("", {}, data)])[0].states] == [
        "unworn",
        "0.4 µm on gear",
        "1 µm on gear",
    ]
    assert (
        str(data.end_reason.values) == "depth"
        and str(data.verdict.values) == "completed"
    )
    np.testing.assert_allclose(
        data.remaining_useful_life, float(data.life) - data.cycle
    )
    assert float(data.service_life) == pytest.approx(float(data.life) * 60 / 1100)
    by_cycles = simulate(
        limited.replace("wear.until", {"cycles": float(data.life)}).replace(
            "wear.snapshots", None
        )
    )
    assert "preset_depth" not in by_cycles.coords
    assert float(by_cycles.max_wear_depth.sel(flank="gear")[-1]) == pytest.approx(
        1e-6, rel=2e-3, abs=0
    )


@pytest.mark.parametrize(
    ("limit", "cycles"), [({"mesh_cycles": 5e7}, 1e6), ({"hours": 10}, 10 * 60 * 1100)]
)
def test_limits_in_other_counts(scene, limit, cycles):
    data = simulate(
        scene("quasi-static")
        .replace("wear.until", limit)
        .replace("wear.snapshots", None)
    )
    assert float(data.cycle[-1]) == pytest.approx(cycles, rel=1e-12)
    assert float(data.mesh_cycles[-1]) == pytest.approx(50 * cycles)
    assert float(data.operating_hours[-1]) == pytest.approx(cycles * 60 / 1100)


def test_impossible_gears_are_refused_with_the_reason(scene):
    apart = scene("quasi-static").replace("gears.centre_distance", "156.5 mm")
    with pytest.raises(Refused, match=r"contact ratio|centre distance|shift"):
        simulate(apart)


def test_tolerance_steers_every_part(scene):
    tight = simulate(scene("base case").replace("numerics.tolerance", 1e-5))
    loose = simulate(scene("base case").replace("numerics.tolerance", 1e-2))
    assert tight.sizes["profile"] > loose.sizes["profile"]
    assert int(tight.count_steps_per_period) > int(loose.count_steps_per_period)
    assert int(tight.count_contact_analyses) > int(loose.count_contact_analyses)
    np.testing.assert_allclose(
        loose.max_wear_depth.isel(update=-1),
        tight.max_wear_depth.isel(update=-1),
        rtol=1e-2,
    )


def test_a_life_ends_at_its_bound_on_the_work_and_says_what_to_do(scene):
    tight = (
        scene("base case")
        .replace("numerics.cycle_tolerance", 1e-6)
        .replace("wear.snapshots", None)
    )
    whole = simulate(tight)
    most = 0.05 * int(
        whole.count_right_hand_sides
    )  # of the whole run: the life takes a part of it
    part = simulate(tight.replace("numerics.most_right_hand_sides", most))
    assert (str(part.verdict.values), str(part.end_reason.values)) == (
        "stopped",
        "work limit",
    )
    assert 0.0 < float(part.cycle[-1]) < float(whole.cycle[-1])
    assert int(part.count_right_hand_sides) < int(whole.count_right_hand_sides)
    for remedy in ("numerics.most_right_hand_sides", "[start]", 'wear.load = "static"'):
        assert remedy in str(part.validity.values)
    assert "used up before its end" in str(part.estimate_quality.values)
    assert (
        "work" not in str(whole.validity.values)
        and str(whole.verdict.values) == "completed"
    )


def test_searches_for_attractors_are_counted(run):
    data = run("base case")
    assert set(data.attractor_search.values) == {"none found"}
    assert int(data.count_attractor_starts) == RELEASES + FURTHER * (
        data.sizes["update"] - 1
    )
    assert int(data.count_attractor_periods) < int(data.count_period_maps)


def test_only_wanted_variables_are_stored(scene):
    data = simulate(
        scene("base case").replace("store.variables", ["wear_depth", "mesh_stiffness"])
    )
    assert set(data.data_vars) == {"wear_depth", "mesh_stiffness"}
