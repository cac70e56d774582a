"""A life in two runs is the life in one; replaced gears are new.

Other nodes keep steps.
"""

import numpy as np
import pytest
from scenes import external_pair

from wearlab.scene import Scene
from wearlab.simulation import Refused, simulate
from wearlab.simulation.initial_wear import moved
from wearlab.store.align import start_wear
from wearlab.store.files import StoreError

PAIR = {
    "gears": external_pair(50, 50),
    "operation": {"torque": "340 N*m", "speed": "1100 rpm"},
    "wear": {
        "coefficient": {"model": "constant", "value": "9.65e-19 m^2/N"},
        "until": {"cycles": 4e7},
        "snapshots": {"cycles": [1e7, 2e7, 3e7]},
    },
}


@pytest.fixture(scope="module")
def parent():
    return simulate(Scene.from_mapping(PAIR))


def child(parent, cycle, until, **start):
    wear = {
        **PAIR["wear"],
        "until": {"cycles": until},
        "snapshots": {"cycles": [until / 2]},
    }
    own = Scene.from_mapping(
        {
            **PAIR,
            "wear": wear,
            "start": {"run": parent.attrs["id"], "cycle": cycle, **start},
        }
    )
    return simulate(own.with_start_wear(start_wear(parent, own.start)))


def test_two_runs_make_the_life_of_one(parent):
    tail = child(parent, 2.5e7, 1.5e7)
    assert tail["cycle"].values[0] == 0.0
    assert float(tail["max_wear_depth"][-1].max()) == pytest.approx(
        float(parent["max_wear_depth"][-1].max()), rel=1e-3
    )
    np.testing.assert_allclose(
        tail["wear_depth"].values[-1],
        parent["wear_depth"].values[-1],
        atol=2e-3 * 3.2e-6,
    )
    assert tail.attrs["parents"] == parent.attrs["id"]
    assert float(tail.attrs["parent_cycle"]) == 2.5e7
    assert tail.attrs["parent_interpolation_error"].endswith(" m")


def test_wear_of_another_model_version_is_not_taken_on(parent):
    of_old = parent.assign_attrs(model_version="5")
    with pytest.raises(StoreError, match=r"model version 5, this is \d+: .* run its"):
        child(of_old, 2.5e7, 1.5e7)


def test_the_error_of_the_parent_is_added(parent):
    cycle = 2.5e7
    of_parent = float(
        np.interp(cycle, parent["cycle"], parent["error_estimate_wear_depth"])
    )
    assert of_parent > 0.0
    own = Scene.from_mapping(
        {**PAIR, "start": {"run": parent.attrs["id"], "cycle": cycle}}
    )
    given = start_wear(parent, own.start)
    assert given.estimate == pytest.approx(of_parent)
    tail = child(parent, cycle, 1.5e7)
    error = tail["error_estimate_wear_depth"].values
    assert (
        error[0] == pytest.approx(of_parent + given.error)
        and (np.diff(error) >= 0.0).all()
    )
    new = child(parent, cycle, 1.5e7, replace=["pinion", "gear"])
    assert new["error_estimate_wear_depth"].values[0] == 0.0
    bare = start_wear(parent.drop_vars("error_estimate_wear_depth"), own.start)
    assert np.isnan(bare.estimate)


def test_the_error_of_the_parent_moves_the_end_of_the_life(parent):
    until = {"depth": "6 um", "cycles": 1e9}
    own = Scene.from_mapping(
        {
            **PAIR,
            "wear": {**PAIR["wear"], "until": until, "snapshots": {"cycles": [1e6]}},
            "start": {"run": parent.attrs["id"], "cycle": 2e7},
        }
    )
    given = start_wear(parent, own.start)
    sure = simulate(own.with_start_wear(given._replace(estimate=0.0)))
    unsure = simulate(own.with_start_wear(given._replace(estimate=1e-07)))
    more = float(unsure["error_estimate_life"] - sure["error_estimate_life"])
    assert more == pytest.approx(
        1e-7 / float(sure["wear_rate"].values[-1].max()), rel=1e-6
    )


def test_it_begins_with_the_wear_of_its_parent_and_a_new_gear(parent):
    tail = child(parent, 2e7, 1e6, replace=["gear"])
    np.testing.assert_array_equal(
        tail["wear_depth"].sel(flank="pinion").values[0],
        parent["wear_depth"].sel(flank="pinion").values[2],
    )
    assert not tail["wear_depth"].sel(flank="gear").values[0].any()
    assert tail.attrs["replaced_members"] == "gear"


def test_without_its_parents_wear_it_is_refused(parent):
    own = Scene.from_mapping(
        {**PAIR, "start": {"run": parent.attrs["id"], "cycle": 1e7}}
    )
    with pytest.raises(Refused, match="this scene continues run"):
        simulate(own)
    wear = start_wear(parent, own.start)
    with pytest.raises(Refused, match="wore the left flanks"):
        simulate(
            own.with_start_wear(wear._replace(side={"pinion": "left", "gear": "left"}))
        )
    with pytest.raises(Refused, match="has no flank 'gear'"):
        simulate(
            own.with_start_wear(wear._replace(depth={"pinion": wear.depth["pinion"]}))
        )


def test_other_nodes_keep_steps():
    own = np.array([-2.0, 0.0, 1.0, 1.0, 3.0])
    depth = np.array([2.0, 0.0, 1.0, 5.0, 7.0])
    wanted = np.array([-3.0, -1.0, 1.0, 1.0, 2.0, 3.0, 4.0])
    np.testing.assert_allclose(
        moved(own, depth, wanted), [0.0, 1.0, 1.0, 5.0, 6.0, 7.0, 0.0], atol=1e-6
    )
    assert moved(own, depth, own) is not depth
