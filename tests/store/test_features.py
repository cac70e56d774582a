"""Features: one row for each wear state of each run, names and units
of every column known.
"""

import numpy as np
import pytest
import xarray as xr
from scipy.stats import kurtosis

import wearlab as wl
from wearlab.cli.app import status_of
from wearlab.schema import VARIABLES, origin_of
from wearlab.store.features import indicators


def test_indicators_of_a_cosine_are_those_of_the_formulas():
    """x = 3 + 2 cos 2πφ: RMS √2, crest factor √2, kurtosis 3/2, one order of 2."""
    phase = np.arange(256) / 256
    found = indicators(np.tile(3.0 + 2.0 * np.cos(2.0 * np.pi * phase), (2, 1)))
    expected = {
        "mean": 3.0,
        "rms": 2**0.5,
        "peak_to_peak": 4.0,
        "crest_factor": 2**0.5,
        "kurtosis": 1.5,
    }
    expected |= {"order_1": 2.0, "order_2": 0.0}
    assert {key: found[key] for key in expected} == pytest.approx(expected, abs=1e-12)


def test_indicators_of_noise_are_those_of_scipy():
    x = np.random.default_rng(1).standard_normal((3, 100))
    assert indicators(x)["kurtosis"] == pytest.approx(
        kurtosis(x, axis=None, fisher=False), rel=1e-12
    )
    assert indicators(x)["rms"] == pytest.approx(x.std(), rel=1e-12)


def test_periods_that_only_pad_are_left_out_of_many_signals_at_once():
    x = np.random.default_rng(2).standard_normal((4, 3, 5, 16))
    x[1, 2, 3:] = np.nan
    x[2, 0] = np.nan
    found = indicators(x)
    alone = indicators(x[1, 2, :3])
    assert all(
        found[name][1, 2] == pytest.approx(float(alone[name]), rel=1e-12)
        for name in alone
    )
    assert all(np.isnan(values[2, 0]) for values in found.values())
    assert np.isfinite(found["order_5"]).sum() == 11


def test_what_does_not_move_has_no_shape():
    still = indicators(np.full((1, 8), 5.0))
    assert (
        still["rms"] == 0.0
        and np.isnan(still["kurtosis"])
        and np.isnan(still["crest_factor"])
    )
    assert np.isnan(indicators(np.empty((0, 8)))["mean"])


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    study = {
        "extends": wl.__path__[0] + "/../campaigns/base/spur_50_50.toml",
        "drop": ["dynamics"],
        "wear": {"load": "static", "until": {"cycles": 1e7}},
        "sweep": [{"operation.torque": ["200 N*m", "300 N*m"]}],
    }
    return wl.run(
        study, tmp_path_factory.mktemp("features") / "store", progress=False
    ).store


def test_one_row_for_each_wear_state_with_what_differs_first(store):
    table = store.features()
    frame = table.to_pandas()
    runs = {run_id: store.run(run_id) for run_id in store.query()["id"]}
    assert len(frame) == sum(run.sizes["update"] for run in runs.values())
    assert list(frame.columns[:6]) == [
        *(
            "run",
            "state",
            "cycle",
            "operating_hours",
            "operation.speed",
            "operation.torque",
        ),
    ]
    assert set(frame["operation.torque"]) == {200.0, 300.0} and set(
        frame["operation.speed"]
    ) == {1100.0}
    assert frame.attrs["units"]["operation.speed"] == "rpm"
    last = frame[frame["run"] == next(iter(runs))].iloc[-1]
    run = next(iter(runs.values())).isel(update=-1)
    assert last["cycle"] == run.cycle.item()
    assert last["max_wear_depth.gear"] == run.max_wear_depth.sel(flank="gear").item()
    assert (
        last["ste_harmonics.pinion-gear.2"] == run.ste_harmonics.sel(harmonic=2).item()
    )
    assert last["mesh_stiffness_peak_to_peak.pinion-gear"] == np.ptp(
        run.mesh_stiffness.values
    )
    assert last["stiffness_rms.pinion-gear"] == run.stiffness_rms.item()
    assert not {
        "mesh_stiffness_rms.pinion-gear",
        "mesh_stiffness_order_1.pinion-gear",
    } & set(frame)
    assert not [
        name for name in frame if name.startswith(("run_time", "count_", "residual"))
    ]


def test_chosen_variables_in_si_and_the_command(store, tmp_path, capsys):
    table = store.features("torque > 250 N*m", variables=["ste_rms"])
    assert [column.name for column in table.columns[6:]] == ["ste_rms.pinion-gear"]
    assert table.to_pandas(si=True)["operation.speed"][0] == pytest.approx(
        1100 * np.pi / 30, rel=1e-11
    )
    for name in ("features.csv", "features.nc"):
        out = tmp_path / name
        assert (
            status_of(
                ["features", "--store", str(store.path), "--out", str(out), "--si"]
            )
            == 0
        )
    assert (
        (tmp_path / "features.csv")
        .read_text()
        .startswith("run,state,cycle,operating_hours [s],")
    )
    assert xr.load_dataset(tmp_path / "features.nc").sizes["row"] == len(
        store.features()
    )
    capsys.readouterr()
    wrong = ["features", "--store", str(store.path), "--variables"]
    assert status_of([*wrong, "ste_rmss"]) == 2
    assert (
        "'ste_rmss': there is no such variable; did you mean 'ste_rms'?"
        in capsys.readouterr().err
    )
    assert status_of([*wrong, "dynamic_factor"]) == 2
    assert "no run here has it" in capsys.readouterr().err
    assert (
        status_of(
            ["features", "--store", str(store.path), "--out", str(tmp_path / "a.xlsx")]
        )
        == 2
    )
    assert (
        status_of(
            ["features", "--store", str(store.path), "--where", "torque > 1 kN*m"]
        )
        == 2
    )


def test_every_variable_is_listed_with_where_it_comes_from(capsys):
    assert all(all(origin_of(name)) for name in VARIABLES)
    assert origin_of("dynamic_factor") == ("dynamics", "[dynamics]")
    assert origin_of("mesh_deflection_orders")[1].endswith("names it")
    assert status_of(["variables"]) == 0
    told = capsys.readouterr().out
    assert all(f"\n{name} " in told for name in VARIABLES)
    assert status_of(["variables", "dynamic_factr"]) == 2
    assert "did you mean 'dynamic_factor'?" in capsys.readouterr().err
