"""Two runs of which everything is known: where they differ, by how
much, and where first.
"""

import json

import numpy as np
import pytest
import xarray as xr

from wearlab.comparison import CompareError, compare
from wearlab.comparison.runs import first_above

PHASE = np.arange(32) / 32
S = np.array([-3.0, -1.0, -1.0, 0.0, 2.0, 2.0, 4.0]) * 1e-3


def run(
    cycle=(0.0, 1e6, 4e6),
    rate=1e-12,
    stiffness=3e8,
    phases=PHASE,
    nodes=S,
    force=None,
    **scene,
) -> xr.Dataset:
    """A life of constant wear rate: h = rate·cycle·|s|/s_E, deepest at E."""
    cycle = np.array(cycle)
    shape = np.abs(nodes) / 4e-3
    depth = rate * cycle[:, None, None] * np.stack([shape, 0.5 * shape])
    wave = stiffness + 1e7 * np.cos(2 * np.pi * phases) * (
        1.0 + cycle[:, None, None] / 1e7
    )
    rates = rate * np.ones((len(cycle), 1, 1)) * np.stack([shape, 0.5 * shape])
    data = {
        "wear_depth": (("update", "flank", "profile"), depth),
        "wear_rate": (("update", "flank", "profile"), rates),
        "max_wear_depth": (("update", "flank"), depth.max(axis=2)),
        "mesh_stiffness": (("update", "mesh", "phase"), wave),
    }
    if force is not None:
        data["dynamic_mesh_force"] = (("update", "mesh", "mesh_period", "phase"), force)
    return xr.Dataset(
        data,
        coords={
            "cycle": ("update", cycle),
            "flank": ["pinion", "gear"],
            "mesh": ["pinion-gear"],
            "phase": phases,
            "path_position": (("flank", "profile"), np.stack([nodes, nodes])),
        },
        attrs={"id": f"{rate:g}", "scene": json.dumps(scene)},
    )


def summary(found, name, what="largest_relative_difference"):
    return float(found[what].sel(quantity=name))


def test_a_run_equals_itself():
    found = compare(run(), run())
    assert (found["largest_relative_difference"] == 0.0).all()
    assert found["first_difference"].isnull().all()
    assert json.loads(found.attrs["scene_differences"]) == []


def test_on_cycle_between_stored_states():
    """B wears 10 % faster; its states lie elsewhere.

    Wear is linear in cycles, so interpolation is exact.
    """
    found = compare(run(), run(cycle=(0.0, 2e6, 3e6), rate=1.1e-12), tolerance=0.05)
    np.testing.assert_allclose(found["cycle"], [0.0, 1e6, 2e6, 3e6])
    np.testing.assert_allclose(
        found["max_wear_depth"].sel(flank="pinion"),
        [[0.0, 1e-6, 2e-6, 3e-6], [0.0, 1.1e-6, 2.2e-6, 3.3e-6]],
    )
    np.testing.assert_allclose(
        found["max_wear_depth_difference"].sel(flank="gear"),
        [0.0, 5e-8, 1e-7, 1.5e-7],
        atol=1e-20,
    )
    assert summary(found, "max_wear_depth") == pytest.approx(0.1 / 1.1)
    # 0.1e-12 n / 3.3e-6 = 0.05
    assert summary(found, "max_wear_depth", "first_difference") == pytest.approx(1.65e6)
    assert summary(found, "wear_depth", "first_difference") == pytest.approx(1.65e6)
    assert np.isnan(summary(found, "mesh_stiffness", "first_difference"))


def test_on_wear_depth_the_same_wear_comes_at_other_cycles():
    found = compare(run(), run(rate=2e-12), on="wear_depth")
    np.testing.assert_allclose(found["aligned_depth"], [0.0, 1e-6, 2e-6, 4e-6])
    np.testing.assert_allclose(
        found["cycle"], [[0.0, 1e6, 2e6, 4e6], [0.0, 0.5e6, 1e6, 2e6]]
    )
    assert summary(found, "wear_depth") == pytest.approx(0.0, abs=1e-12)
    # the stiffness follows the cycle, not the wear: 1e7·cos·Δn/1e7, over the largest
    # stiffness; 2 and 4 µm are states of both no more than of one
    assert found["has_state"].values.tolist() == [[1, 1, 0, 1], [1, 0, 1, 0]]
    assert summary(found, "mesh_stiffness") == 0.0
    same = compare(run(), run(cycle=(0.0, 5e5, 2e6), rate=2e-12), on="wear_depth")
    assert summary(same, "mesh_stiffness") == pytest.approx(
        1e7 * 2e6 / 1e7 / (3e8 + 1.4e7), rel=1e-9
    )


def test_range_and_values_of_the_stiffness():
    found = compare(run(), run(stiffness=3.3e8))
    assert summary(found, "mesh_stiffness") == pytest.approx(3e7 / (3.3e8 + 1.4e7))
    assert summary(found, "stiffness_peak_to_peak") == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(
        found["stiffness_peak_to_peak"].sel(run="B", state=0), 2e7
    )


def test_phases_are_matched_periodically():
    """Twice as many phases: A's phases are among them, but for the last, which needs
    the period's end.
    """
    twice = np.arange(64) / 64
    found = compare(run(), run(phases=twice))
    assert summary(found, "mesh_stiffness") == pytest.approx(0.0, abs=1e-12)
    shifted = compare(run(phases=twice + 1 / 128), run(phases=twice))
    assert 0.0 < summary(shifted, "mesh_stiffness") < 1e-4


def test_nodes_are_matched_along_the_path_and_steps_stay_steps():
    other = np.array([-3.0, -2.0, -1.0, -1.0, 0.0, 1.0, 2.0, 2.0, 3.0, 4.0]) * 1e-3
    a = run()
    b = run(nodes=other)
    for data in (a, b):  # a step at s = 2 mm
        beyond = data["path_position"].isel(flank=0).values > 2e-3
        beyond |= (
            np.arange(len(beyond)) > np.flatnonzero(data["path_position"][0] == 2e-3)[0]
        )
        data["wear_depth"].values[..., beyond] *= 3.0
    assert summary(compare(a, b), "wear_depth") == pytest.approx(0.0, abs=1e-6)
    short = run(nodes=S[1:])
    assert summary(compare(a, short), "wear_depth") > 0.1  # without its step


def test_mesh_orders_and_what_lies_between():
    """A: period one, 500 cos(3·2πφ). B: period two, besides 200 cos(2πφ/2)."""
    time = np.concatenate([PHASE, 1.0 + PHASE])
    third = 4000.0 + 500.0 * np.cos(6 * np.pi * time)
    a = np.broadcast_to(third[:32], (3, 1, 1, 32))
    b = np.broadcast_to(
        (third + 200.0 * np.cos(np.pi * time)).reshape(2, 32), (3, 1, 2, 32)
    )
    found = compare(run(force=a), run(force=b))
    orders = found["mesh_force_orders"].isel(state=0, mesh=0)
    np.testing.assert_allclose(orders.sel(order=3), [500.0, 500.0])
    np.testing.assert_allclose(orders.sel(order=[1, 2, 4, 10]), 0.0, atol=1e-9)
    rest = found["mesh_force_between_orders"].isel(state=0, mesh=0)
    np.testing.assert_allclose(rest, [0.0, 200.0 / np.sqrt(2)], atol=1e-9)
    assert float(
        found["mesh_force_peak"].isel(run=1, state=0, mesh=0)
    ) == pytest.approx(4700.0)
    mean = found["dynamic_mesh_force"].isel(run=1, state=0, mesh=0)
    np.testing.assert_allclose(
        mean, third[:32], atol=1e-9
    )  # half a wave and its opposite cancel


def test_keys_of_the_scene_with_their_units():
    a = run(operation={"torque": 340, "speed": 104.719755119660})
    b = run(
        operation={"torque": 300, "speed": 104.719755119660}, wear={"load": "static"}
    )
    found = json.loads(compare(a, b).attrs["scene_differences"])
    assert found == [
        {"key": "operation.torque", "a": 340.0, "b": 300.0, "units": "N*m"},
        {"key": "wear.load", "a": None, "b": "static", "units": None},
    ]


def test_first_above_is_linear_between_states():
    x = np.array([0.0, 10.0, 30.0])
    assert first_above(x, np.array([0.0, 0.02, 0.06]), 0.03) == pytest.approx(15.0)
    assert first_above(x, np.array([0.5, 0.0, 0.0]), 0.03) == 0.0
    assert np.isnan(first_above(x, np.zeros(3), 0.03))
    assert first_above(x, np.array([np.nan, 0.5, 0.6]), 0.03) == 10.0


@pytest.mark.parametrize(
    "a, b, options, message",
    [
        (run(), run(cycle=(5e6, 6e6, 7e6)), {}, "nothing in common"),
        (
            run().drop_vars(["wear_depth", "max_wear_depth"]),
            run(),
            {"on": "wear_depth"},
            "A has no wear",
        ),
        (run(), run().assign_coords(flank=["sun", "ring"]), {}, "no flank in common"),
        (run(), xr.Dataset(attrs={"id": "b"}), {}, "no variable in common"),
        (run(), run(), {"on": "hours"}, "'cycle' and 'wear_depth'"),
        (run(), run(), {"tolerance": 0.0}, "greater than 0"),
        (run(), "abc", {}, "looked up in a store"),
    ],
)
def test_what_cannot_be_compared(a, b, options, message):
    with pytest.raises(CompareError, match=message):
        compare(a, b, **options)
