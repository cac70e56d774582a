"""Two runs of other wear states: what is compared, and what is not invented."""

import numpy as np
import pytest
import xarray as xr

from wearlab.comparison import compare
from wearlab.comparison.rows import QUANTITY_HEADS, quantity_rows, states_text
from wearlab.comparison.states import beyond_jumps

LIFE = 1e7


def depth(cycle):
    """Return a depth that runs in: 4 µm at the end, most of it early."""
    return 4e-6 * (1.0 - np.exp(-4.0 * cycle / LIFE)) / (1.0 - np.exp(-4.0))


def rate(cycle):
    return 4e-6 * 4.0 / LIFE * np.exp(-4.0 * cycle / LIFE) / (1.0 - np.exp(-4.0))


def run(cycle, factor=1.0, error=0.0, force=4000.0):
    """Return a life whose stiffness and force follow the depth of its wear."""
    cycle = np.asarray(cycle, float)
    shape = np.linspace(0.2, 1.0, 5)
    node_depth = factor * depth(cycle)[:, None, None] * shape
    phase = np.arange(16) / 16
    swing = 1.0 + 1e5 * factor * depth(cycle)[:, None, None]
    wave = np.cos(2.0 * np.pi * phase)
    data = {
        "wear_depth": (("update", "flank", "profile"), node_depth),
        "wear_rate": (
            ("update", "flank", "profile"),
            factor * rate(cycle)[:, None, None] * shape,
        ),
        "max_wear_depth": (("update", "flank"), node_depth.max(axis=2)),
        "mesh_stiffness": (("update", "mesh", "phase"), 3e8 + 1e8 * swing * wave),
        "dynamic_mesh_force": (
            ("update", "mesh", "phase"),
            force + 500.0 * swing * wave,
        ),
        "error_estimate_wear_depth": (("update",), error * depth(cycle)),
        "error_estimate_mesh_force": (("update",), np.full(len(cycle), 20.0)),
        "life": ((), LIFE / factor),
        "error_estimate_life": ((), 1e-3 * LIFE),
    }
    return xr.Dataset(
        data,
        {"cycle": ("update", cycle), "flank": ["pinion"], "phase": phase},
        {"id": "a" * 20, "scene": "{}"},
    )


FEW = np.array([0.0, 0.3, 1.0]) * LIFE
STEPS = np.array([0.0, 0.02, 0.06, 0.13, 0.3, 0.6, 1.0]) * LIFE


@pytest.mark.parametrize("on", ["cycle", "wear_depth"])
def test_one_life_stored_at_other_states_does_not_differ(on):
    """Was 10 % of the depth, 1 % of the stiffness: straight lines between states."""
    found = compare(run(STEPS), run(FEW), on=on)
    assert found["differs"].values.sum() == 0
    assert found["first_difference"].isnull().all()
    assert float(found["largest_relative_difference"].max()) < 0.06
    waves = found["relative_difference"].sel(quantity="mesh_stiffness").values
    is_common = found["has_state"].values.all(axis=0)
    assert is_common.sum() == 3 and np.isnan(waves[~is_common]).all()
    assert "compared at 3 of 7 places" in states_text(found)


def test_the_same_states_are_compared_everywhere_without_a_word():
    found = compare(run(STEPS), run(STEPS, factor=1.1))
    assert np.isfinite(found["relative_difference"]).all() and not states_text(found)
    assert found["differs"].sel(quantity="wear_depth") == 1


def test_on_depth_the_cycle_is_that_of_the_curve():
    found = compare(run(STEPS), run(FEW), on="wear_depth")
    cycle_a, cycle_b = found["cycle"].values
    np.testing.assert_allclose(cycle_a, STEPS, rtol=1e-6, atol=1.0)
    assert np.max(np.abs(cycle_b - STEPS)) < 0.05 * LIFE


def test_what_the_estimates_explain_is_not_called_a_difference():
    a = run(STEPS, error=0.02)
    b = run(STEPS, factor=1.03, error=0.02)
    found = compare(a, b)
    largest = float(found["largest_relative_difference"].sel(quantity="wear_depth"))
    assert largest == pytest.approx(0.03 / 1.03)
    estimate = found["relative_estimate"].sel(quantity="wear_depth").values[-1]
    assert estimate == pytest.approx(0.04 / 1.03)
    assert found["differs"].sel(quantity="wear_depth") == 0
    assert np.isnan(found["first_difference"].sel(quantity="wear_depth"))
    rows = {
        row[0]: dict(zip(QUANTITY_HEADS, row, strict=True))
        for row in quantity_rows(found)
    }
    row = rows["wear depth"]
    assert row["largest difference"] == "2.91 % (within the estimates)"
    assert row["estimated error"] == "3.88 %"
    sure = compare(run(STEPS, error=0.01), run(STEPS, factor=1.03, error=0.01))
    assert sure["differs"].sel(quantity="wear_depth") == 1
    assert sure["first_difference"].sel(quantity="wear_depth") > 0.0


def test_lives_stand_beside_their_estimates():
    rows = {
        row[0]: row for row in quantity_rows(compare(run(STEPS), run(STEPS, 1.001)))
    }
    *_, share, estimate, _, _ = rows["cycles to the depth limit"]
    assert share.endswith("(within the estimates)") and estimate == "0.2 %"
    rows = {row[0]: row for row in quantity_rows(compare(run(STEPS), run(STEPS, 1.1)))}
    assert rows["cycles to the depth limit"][4] == "9.09 %"


def test_forces_have_their_own_estimates():
    found = compare(run(STEPS), run(STEPS, force=4030.0))
    forces = found.sel(quantity=["dynamic_mesh_force", "mesh_force_peak"])
    assert forces["differs"].values.tolist() == [0, 1]  # 30 N of 40 N; no estimate


def test_without_rates_depths_are_compared_at_states_of_both():
    a = run(STEPS).drop_vars("wear_rate")
    found = compare(a, run(FEW).drop_vars("wear_rate"))
    known = np.isfinite(found["relative_difference"].sel(quantity="wear_depth"))
    assert int(known.sum()) == 3


def test_no_state_in_common_but_the_first_leaves_a_dash():
    late = run([0.2 * LIFE, 0.7 * LIFE])
    found = compare(run([0.0, 0.5 * LIFE, LIFE]), late)
    row = next(row for row in quantity_rows(found) if row[0].startswith("mesh stiff"))
    assert row[1:3] == ("—", "—") and row[4] == "—"


PHASES = np.arange(64) / 64


def jumping(onset, between=0.0):
    """Return a run whose pairs come into contact at a phase, at states of a life."""
    data = run(STEPS)
    step = np.where((PHASES >= 0.25) & (PHASES < 0.6), 1.0, 0.0)
    beside = np.where((PHASES >= onset) & (PHASES < 0.6), 1.0, 0.0)
    wave = 4e8 + 1e8 * ((1.0 - between) * step + between * beside)
    waves = np.broadcast_to(wave, (len(STEPS), 1, len(PHASES)))
    attributes = data["mesh_stiffness"].attrs
    stiffness = (("update", "mesh", "phase"), waves, attributes)
    return data.drop_dims("phase").assign(mesh_stiffness=stiffness)


@pytest.mark.parametrize("between", [0.3, 1.0])
def test_a_jump_between_two_phases_is_no_difference(between):
    """One scene with other snapshots was 2.6 % off where pairs come into contact."""
    found = compare(jumping(0.25), jumping(0.25 + 1 / 64, between))
    stiffness = found.sel(quantity="mesh_stiffness")
    assert float(stiffness["largest_relative_difference"]) == 0.0
    moved = compare(jumping(0.25), jumping(0.25 + 3 / 64, between))
    stiffness = moved.sel(quantity="mesh_stiffness")
    share = float(stiffness["largest_relative_difference"])
    assert share == pytest.approx(between * 1e8 / 5e8)


def test_periods_are_compared_beside_their_estimates():
    """Harmonics and transmission errors had an estimate, which was not shown."""
    runs = []
    for factor in (1.0, 1.002):
        data = run(STEPS)
        dims = ("update", "mesh", "harmonic")
        harmonics = np.full((len(STEPS), 1, 3), 1e7 * factor)
        estimate = np.full(len(STEPS), 1.5e4)
        data = data.assign(
            stiffness_harmonics=(dims, harmonics, {"units": "N m-1"}),
            error_estimate_stiffness=("update", estimate, {"units": "N m-1"}),
        )
        runs.append(data)
    found = compare(*runs).sel(quantity="stiffness_harmonics")
    assert found["relative_estimate"].values[-1] == pytest.approx(3e4 / 1.002e7)
    assert found["differs"] == 0


def test_a_gap_in_a_wave_hides_no_difference_beside_it():
    """One unknown phase took the two beside it along."""
    phase = np.arange(8) / 8
    known = xr.DataArray(np.ones(8), {"phase": phase}, ("phase",))
    gap = known.copy(data=np.where(phase == 0.5, np.nan, 3.0))
    for difference in (beyond_jumps(known, gap), -beyond_jumps(gap, known)):
        assert np.isnan(difference).tolist() == (phase == 0.5).tolist()
        assert np.nanmin(difference) == np.nanmax(difference) == 2.0
