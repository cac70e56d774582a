"""``wearlab compare``: the same comparison as table, JSON, dataset and figure."""

import json

import pytest
import xarray as xr
from made_up import put, run

from wearlab.cli.app import status_of
from wearlab.figures.question import embedded
from wearlab.store import Store


@pytest.fixture(scope="module")
def store(tmp_path_factory) -> Store:
    store = Store(tmp_path_factory.mktemp("comparison") / "store")
    store.archive.create()
    put(
        store,
        "a" * 20,
        run(800.0).assign_attrs(id="a" * 20, scene='{"operation":{"torque":340}}'),
    )
    worse = run(800.0).assign_attrs(id="b" * 20, scene='{"operation":{"torque":300}}')
    worse["max_wear_depth"] = 1.1 * worse["max_wear_depth"]
    put(store, "b" * 20, worse)
    return store


def test_table_and_files(store, tmp_path, capsys):
    files = ["--out", str(tmp_path / "c.nc"), "--figure", str(tmp_path / "c.png")]
    assert status_of(["compare", "a", "b", "--store", str(store.path), *files]) == 0
    told = capsys.readouterr().out
    assert "operation.torque  340  300  N*m" in told
    assert "largest wear depth" in told and "9.09 %" in told
    with xr.open_dataset(tmp_path / "c.nc") as found:
        assert float(
            found["largest_relative_difference"].sel(quantity="max_wear_depth")
        ) == pytest.approx(1 / 11)
        assert found["first_difference"].attrs["units"] == "1"
    first = (tmp_path / "c.png").read_bytes()
    assert embedded(tmp_path / "c.png")["run_b"] == "b" * 20
    assert status_of(["compare", "a", "b", "--store", str(store.path), *files]) == 0
    assert (tmp_path / "c.png").read_bytes() == first


def test_json(store, capsys):
    assert (
        status_of(
            [
                "compare",
                "a",
                "b",
                "--store",
                str(store.path),
                "--json",
                "--on",
                "wear_depth",
            ]
        )
        == 0
    )
    found = json.loads(capsys.readouterr().out)
    assert found["aligned_on"] == "wear_depth" and found["run_a"] == "a" * 20
    assert found["scene_differences"] == [
        {"key": "operation.torque", "a": 340.0, "b": 300.0, "units": "N*m"}
    ]
    assert len(found["quantities"]) == len(found["largest_relative_difference"])


@pytest.mark.parametrize(
    "words, message",
    [
        (["a", "c"], "run 'c': no such run"),
        (["a", "b", "--on", "hours"], "'cycle' and 'wear_depth'"),
        (["a", "none.toml"], "none.toml"),
        (["a", "b", "--figure", "x.jpg"], ".png, .svg or .pdf"),
    ],
)
def test_misuse(words, message, store, capsys):
    assert status_of(["compare", *words, "--store", str(store.path)]) == 2
    assert message in capsys.readouterr().err
