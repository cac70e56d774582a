"""Against real runs: one run serves every k.

An update is kept, verified and read back as runs are.
"""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from scenes import SPUR_50_50

import wearlab as wl
from wearlab.campaign.update_options import Limit
from wearlab.store.updates import kept_updates, seal_of, update_files, verify_updates
from wearlab.updating import UpdateError, update
from wearlab.updating.cases import Subject, required_variables, studies
from wearlab.updating.report_text import _unknowns, answers, text_of
from wearlab.updating.run_curves import history_of


@pytest.mark.parametrize(
    "load", ["static", pytest.param("instant", marks=pytest.mark.slow)]
)
def test_wear_is_a_function_of_k_times_cycles(campaign, load):
    scene = campaign.cases[0].scene
    if load == "instant":
        whole = wl.load(SPUR_50_50).cases[0].scene
        scene = whole.replace("wear.until", {"cycles": 2e7}).replace(
            "wear.snapshots", {"cycles": [1e7]}
        )
    one = wl.simulate(scene.replace("wear.coefficient.factor", 1.0))
    other = wl.simulate(scene.replace("wear.coefficient.factor", 2.5))
    if (
        load == "instant"
    ):  # the same states by cycles: a shorter life with more wear a cycle
        shorter = scene.replace("wear.until", {"cycles": 8e6}).replace(
            "wear.snapshots", {"cycles": [4e6]}
        )
        other = wl.simulate(shorter.replace("wear.coefficient.factor", 2.5))
    assert other.cycle.values * 2.5 == pytest.approx(one.cycle.values, rel=1e-9)
    scale = float(one.wear_depth.max())
    assert np.abs(other.wear_depth.values - one.wear_depth.values).max() < 1e-9 * scale
    assert other.worn_mass.values == pytest.approx(
        one.worn_mass.values, rel=1e-9, abs=1e-15
    )


def test_a_run_made_longer_ends_later_by_all_that_ends_it():
    scene = (
        wl.load(SPUR_50_50.parents[1] / "update_spur_twin.toml")
        .cases[0]
        .scene.replace("wear.until.cycles", 3e8)
    )
    wear = Subject(
        "base", scene, None, Limit("max_wear_depth", 3e-5), (), longer=2.0
    ).first.wear
    assert wear.until.cycles == 6e8 and wear.until.depth == pytest.approx(8e-5)
    assert (
        wear.until.flank == "pinion"
        and wear.snapshots.depth[:8] == scene.wear.snapshots.depth
    )
    assert (
        np.diff(wear.snapshots.depth[7:]) == pytest.approx(3.5e-6)
        and wear.snapshots.depth[-1] > 6.5e-5
    )


def test_an_update_has_the_groups_of_arviz_and_names_of_the_contract(tree):
    groups = (
        "prior posterior posterior_predictive predictions log_likelihood observed_data "
        "sample_stats"
    )
    assert set(groups.split()) <= set(tree.children)
    posterior = tree["posterior"].to_dataset()
    assert {"factor", "wear_coefficient", "life", "remaining_useful_life"} <= set(
        posterior.data_vars
    )
    assert (
        posterior["factor"].dims == ("chain", "draw") and posterior.sizes["draw"] == 500
    )
    predictions = tree["predictions"].to_dataset()
    assert predictions["life_quantile"].dims == ("quantile",)
    assert predictions["quantile"].values.tolist() == [0.05, 0.25, 0.5, 0.75, 0.95]
    draws = np.quantile(posterior["life"], [0.25, 0.5, 0.75])
    assert draws == pytest.approx(predictions["life_quantile"].values[1:4], rel=0.01)
    assert any(
        line.startswith("  remaining life at 1.5e+08 cycles") for line in text_of(tree)
    )
    (sentence,) = answers(tree)
    hours = float(predictions["remaining_useful_life_quantile"][2]) * float(
        predictions["seconds_per_cycle"]
    )
    assert sentence.startswith(
        f"20 µm of wear on the pinion is reached {hours / 3600.0:,.3g}"[:44]
    )
    assert "after the last inspection (90 %: " in sentence


def test_it_is_kept_sealed_and_read_back(campaign, store, tree):
    before = kept_updates(store)
    own = str(tree.attrs["id"])
    path = update_files(store).path(before[own].id)
    with xr.open_datatree(path) as found:
        assert found.attrs["content_sha256"] == seal_of(found.load())
    again = update(campaign, store, progress=False)
    assert again.attrs["id"] == own and list(kept_updates(store)) == list(before)
    assert list(verify_updates(store)) == [] and store.verify() == []


def test_replay_adds_inspections(campaign, store):
    replayed = update(campaign, store, replay=True, progress=False)[
        "predictions"
    ].to_dataset()
    rest = replayed["remaining_useful_life_quantile"]
    assert (
        set(rest.dims) == {"inspection", "quantile"} and rest.sizes["inspection"] == 3
    )
    width = rest.sel(quantile=0.95) - rest.sel(quantile=0.05)
    assert (np.diff(width.values) < 0.0).all()


def test_replay_of_what_was_never_inspected_says_so_and_no_more(campaign, store, tree):
    """The text of an answer without inspections ended in a KeyError."""
    unmeasured = replace(
        campaign, update=campaign.update.model_copy(update={"data": ()})
    )
    lines = text_of(update(unmeasured, store, replay=True, progress=False))
    assert any("nothing was measured: this is the prior" in line for line in lines)
    assert not any("after every inspection" in line for line in lines)


def test_arviz_reads_a_stored_tree(store, tree):
    base = pytest.importorskip("arviz_base")
    stats = pytest.importorskip("arviz_stats.summary")
    path = update_files(store).path(str(tree.attrs["id"]))
    found = base.convert_to_datatree(str(path))
    assert found["posterior"]["factor"].values == pytest.approx(
        tree["posterior"]["factor"].values
    )
    told = stats.summary(found, var_names=["factor", "life"])
    mean = float(tree["posterior"]["factor"].mean())
    assert float(told.loc["factor", "mean"]) == pytest.approx(mean, rel=0.02)
    assert (
        float(told.loc["factor", "ess_bulk"]) > 0.8 * tree["posterior"].sizes["draw"]
    )  # not a walk


def test_a_damaged_update_is_found_and_a_lost_index_made_anew(campaign, store, tree):
    path = update_files(store).path(str(tree.attrs["id"]))
    content = path.read_bytes()
    path.write_bytes(content[:-20] + b"x" * 20)
    assert [problem.kind for problem in verify_updates(store)] == ["altered"]
    path.write_bytes(content)
    before = set(kept_updates(store))
    (store.path / "catalogue.sqlite").unlink()
    store.close()
    assert store.reindex() == [] and set(kept_updates(store)) == before


def test_a_campaign_without_measurements_is_refused(store):
    with pytest.raises(UpdateError, match="nothing was measured"):
        update(wl.load(SPUR_50_50), store, progress=False)


def test_masses_and_largest_depths_are_as_far_off_as_the_life_says(
    campaign, store, tree
):
    """A run with a hundredth of the tolerance: masses differ by less
    than the error of the life.
    """
    scene = campaign.cases[0].scene
    run = store.run(scene.id)
    better = wl.simulate(scene.replace("numerics.tolerance", 1e-5))
    seen = studies(campaign)[0].observations
    limit = studies(campaign)[0].limit
    history = history_of(run, scene, seen, limit)
    for name, dim in (("worn_mass", "member"), ("max_wear_depth", "flank")):
        assert history.numerical_of(name) == float(run.error_estimate_life / run.life)
        mine = run[name].isel({dim: 0}).values
        theirs = better[name].isel({dim: 0}).values
        there = np.interp(run.cycle.values[-1], better.cycle.values, theirs)
        assert abs(mine[-1] / there - 1.0) < history.numerical_of(name)


def test_depths_are_interpolated_with_the_wear_rates_of_their_run(
    campaign, store, tree
):
    """The life's run had not been asked for wear_rate: the life was off by 4.6e-3."""
    scene = campaign.cases[0].scene
    study = studies(campaign)[0]
    assert {"wear_rate", "wear_depth"} <= required_variables((), study.limit)
    fine = scene.replace(
        "wear.snapshots",
        {"depth": [f"{n} um" for n in range(1, 20)], "flank": "pinion"},
    )
    seen = study.observations
    coarse = history_of(store.run(scene.id), scene, seen, study.limit)
    better = history_of(wl.simulate(fine), fine, seen, study.limit)
    plain = history_of(
        store.run(scene.id).drop_vars("wear_rate"), scene, (), study.limit
    )
    depths = np.array([3.5e-6, 7.5e-6, 12.5e-6])
    exact = better.limit.first_above(depths)
    mine = np.abs(coarse.limit.first_above(depths) / exact - 1.0)
    theirs = np.abs(plain.limit.first_above(depths) / exact - 1.0)
    assert (mine < 0.5 * theirs).all() and mine.max() < 2e-3


def test_every_unknown_is_told_after_and_before():
    """With the torque alone unknown it was said that the data moved k
    by a factor of 1.
    """
    about = {"units": "N m", "display_units": "N m", "long_name": "torque"}
    prior, after = (
        xr.Dataset(
            {
                "torque": (
                    ("chain", "draw"),
                    340.0 + spread * np.linspace(-1, 1, 41)[None],
                    about,
                )
            }
        )
        for spread in (40.0, 10.0)
    )
    (one,) = _unknowns(prior, after, xr.Dataset())
    assert (one["name"], one["unit"]) == ("torque", "N m")
    assert one["after"] == pytest.approx([331.0, 335.0, 340.0, 345.0, 349.0])
    assert one["before"] == pytest.approx([304.0, 320.0, 340.0, 360.0, 376.0])
    assert one["narrowed"] == pytest.approx(np.log(376 / 304) / np.log(349 / 331))


def test_an_update_takes_a_file_and_the_path_of_a_store(campaign, store, tree):
    """As ``wl.run`` and ``wl.plan`` do; was an AttributeError."""
    again = wl.update(campaign.path, store.path, progress=False)
    assert again.attrs["id"] == tree.attrs["id"]
    with pytest.raises(UpdateError, match=r"no \[update\] section"):
        wl.update(SPUR_50_50, store.path, progress=False)
    with pytest.raises(TypeError, match="int is no campaign"):
        wl.update(5, store.path)
