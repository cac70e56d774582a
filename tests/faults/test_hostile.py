"""Stores, conditions and campaign files from strangers: no code runs, nothing outside
the store is read.
"""

import json
import os
import re
import sqlite3
from contextlib import closing
from pathlib import Path

import h5py
import netCDF4
import numpy as np
import pytest
import xarray as xr
from catalogues import change_texts
from fake_campaign import SIMULATE, sweep

import wearlab
from wearlab.cli.app import status_of
from wearlab.query import QueryError
from wearlab.store import Store, StoreError, netcdf, updates
from wearlab.store.files import hash_of
from wearlab.store.locks import alive
from wearlab.store.merging import merge


@pytest.fixture
def store(tmp_path):
    with closing(Store(tmp_path / "store")) as made:
        wearlab.run(sweep(2), made, simulate=SIMULATE, progress=False, workers=0)
        made.close()
        yield made


def crafted(store, *statements):
    """Change a catalogue as its owner never would."""
    with closing(
        sqlite3.connect(store.archive.catalogue.path, isolation_level=None)
    ) as connection:
        for statement, *values in statements:
            connection.execute(statement, values)


# -- names become no paths
# ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name", ["../../victim", "/etc/passwd", "..", "a/../../b", "%2e%2e%2f", "a\x00b"]
)
def test_identities_that_would_be_paths(store, name, capsys):
    crafted(store, ("UPDATE runs SET id = ? WHERE number = 1", name))
    problems = store.verify()
    assert {problem.kind for problem in problems} == {"foreign", "unknown"}
    with pytest.raises(StoreError, match="no identity of a run"):
        store.run(name)
    for words in (["ls"], ["prune", "--yes"]):
        assert status_of([*words, "--store", str(store.path)]) == 2
        assert "no identity of a run" in capsys.readouterr().err


def test_owners_that_would_be_paths(tmp_path, store):
    """Asking whether an owner lives opens and removes a lock: never one elsewhere."""
    victim = tmp_path / "victim.lock"
    victim.touch()
    owner = "../../victim"
    assert not alive(store.path / "runners", owner)
    link = store.path / "runners" / "linked.lock"
    link.symlink_to(victim)
    assert not alive(store.path / "runners", "linked")
    crafted(store, ("UPDATE runs SET state = 'running', owner = ?", owner))
    assert store.verify() == []
    assert (
        wearlab.run(
            sweep(2), store, simulate=SIMULATE, progress=False, workers=0
        ).computed
        == 2
    )
    assert victim.exists()


def test_links_lead_nowhere(tmp_path, store):
    """A file, or the folder of a file, that is a link is neither read nor written."""
    first, second = (store.archive.files.path(case.id) for case in sweep(2).cases)
    first.replace(tmp_path / "secret")
    first.symlink_to(tmp_path / "secret")
    second.parent.replace(tmp_path / "folder")
    second.parent.symlink_to(tmp_path / "folder")
    kinds = {(problem.path, problem.kind) for problem in store.verify()}
    assert {(first, "foreign"), (second, "foreign")} <= kinds
    for case in sweep(2).cases:
        with pytest.raises(StoreError, match="is a link"):
            store.run(case.id)
    grid = store.open(sweep(2))
    for name in ("wear_depth", "life"):
        with pytest.raises(StoreError, match="is a link"):
            grid[name].load()
    problems = store.reindex()
    assert store.archive.entries() == {} and all(
        "is a link" in problem.message for problem in problems
    )
    other = Store(tmp_path / "other")
    wearlab.run(sweep(1), other, simulate=SIMULATE, progress=False, workers=0)
    with pytest.raises(StoreError, match="is a link"):
        wearlab.run(sweep(2), store, simulate=SIMULATE, progress=False, workers=0)
    assert (tmp_path / "secret").exists() and len(
        list((tmp_path / "folder").iterdir())
    ) == 1


# -- claims that would fill the memory
# ----------------------------------------------------------------------


def test_a_file_that_claims_more_than_it_holds(store):
    """A variable that was never written costs nothing in a file and
    everything in memory.
    """
    path = store.archive.files.path(sweep(2).cases[0].id)
    path.unlink()
    with netCDF4.Dataset(path, "w") as file:
        file.id = path.stem
        file.createDimension("wide", 10**12)
        file.createVariable("empty", "f8", ("wide",), chunksizes=(1000,))
    with pytest.raises(StoreError, match="is not what was written"):
        store.run(path.stem)
    crafted(
        store, ("UPDATE runs SET sha256 = ? WHERE id = ?", hash_of(path), path.stem)
    )
    with pytest.raises(
        StoreError, match=r"claims 8e\+12 bytes of values in a file of \d+ bytes"
    ):
        store.run(path.stem)
    assert [problem.path for problem in store.reindex()] == [path]


@pytest.mark.parametrize(
    ("column", "change", "said"),
    [
        (
            "sizes",
            lambda sizes: sizes | {"profile": 10**12},
            "claims .* bytes of values",
        ),
        ("sizes", lambda sizes: {"profile": "x"}, "cannot be understood"),
        ("sizes", lambda sizes: [1, 2], "cannot be understood"),
    ],
)
def test_a_catalogue_that_claims_more_than_the_files_hold(store, column, change, said):
    change_texts(
        store.archive.catalogue.path,
        column,
        lambda text: json.dumps(change(json.loads(text))),
    )
    with pytest.raises(StoreError, match=said):
        store.open(sweep(2)).wear_depth.load()


@pytest.mark.parametrize(
    "dtype", ["O", "f8,(99999999,)f8", "V9999999999", "<U99999999", "object"]
)
def test_types_that_no_run_has(store, dtype):
    ((key, text),) = store.archive.catalogue.read("SELECT key, layout FROM layouts")
    layout = json.loads(text)
    layout["variables"]["wear_depth"]["dtype"] = dtype
    crafted(
        store, ("UPDATE layouts SET layout = ? WHERE key = ?", json.dumps(layout), key)
    )
    with pytest.raises(StoreError, match="as a type of numbers"):
        store.open(sweep(2)).wear_depth.load()


# -- no code runs
# --------------------------------------------------------------------------------


def test_triggers_and_views_are_refused(store, capsys):
    crafted(
        store, ("CREATE TRIGGER t AFTER INSERT ON runs BEGIN DELETE FROM runs; END",)
    )
    assert status_of(["ls", "--store", str(store.path)]) == 2
    assert (
        "holds 1 views or triggers, which no wearlab makes" in capsys.readouterr().err
    )
    assert status_of(["reindex", "--store", str(store.path)]) == 0
    assert len(store.archive.entries()) == 2


@pytest.mark.parametrize("column", ["sizes", "digests", "summary", "scene"])
def test_texts_that_are_no_json(store, column, capsys):
    change_texts(
        store.archive.catalogue.path,
        column,
        lambda text: "__import__('os').system('true')",
    )
    assert status_of(["show", sweep(1).cases[0].id, "--store", str(store.path)]) == 2
    assert "cannot be understood" in capsys.readouterr().err


def test_rows_that_are_no_json(store, capsys):
    crafted(
        store, ("UPDATE documents SET warnings = ?", "__import__('os').system('true')")
    )
    assert status_of(["show", sweep(1).cases[0].id, "--store", str(store.path)]) == 2
    assert "cannot be understood" in capsys.readouterr().err


@pytest.mark.parametrize(
    "position", ['{"variables": {"a": {}}}', '{"speed": [1]}', "[1]", "{{{", "5"]
)
def test_places_that_are_none(store, position, capsys):
    crafted(store, ("UPDATE members SET position = ?", position))
    assert status_of(["ls", "--store", str(store.path)]) == 2
    assert "cannot be understood" in capsys.readouterr().err


@pytest.mark.parametrize(
    "condition",
    [
        "life > 1; DROP TABLE runs",
        "life > 1 UNION SELECT * FROM runs",
        "__import__('os').system('touch /tmp/x')",
        "life > (SELECT 1)",
        "load_extension('x') = 1",
        "status = 'done' OR 1=1 --",
        "(" * 50_000 + "life > 1" + ")" * 50_000,
        "not " * 50_000 + "life > 1",
        "life > " + "9" * 100_000,
        " and ".join(["life > 1"] * 20_000),
        "life > 1e999",
        "torque > 1 N**999999999*m",
        "life > 1 N" + "**9" * 200,
        "\x00",
    ],
)
def test_conditions_are_read_by_the_grammar_alone(store, condition):
    try:
        found = store.query(condition)
    except (QueryError, StoreError) as error:
        assert len(str(error)) < 1000
    else:
        assert len(found) <= 2
    assert len(store.archive.entries()) == 2


def test_quotes_in_values_stay_values(store):
    assert len(store.query("status = \"done' OR 'a'='a\"")) == 0
    assert len(store.query('status contains "\'; DROP TABLE runs; --"')) == 0
    assert len(store.query("status = 'done'")) == 2


BASE = 'title = "a stranger\'s"\n'


@pytest.mark.parametrize(
    "text",
    [
        '[[sweep]]\n"operation.speed" = { linspace = ["1 rpm", "2 rpm", 1000000000] }',
        '[[sweep]]\n"operation.speed" = { from = "1 rpm", to = "2 rpm", n = '
        "1000000000 }",
        "\n".join(
            f'[[sweep]]\n"operation.speed" = {list(range(40))}' for _ in range(12)
        ),
        '[[sweep]]\nsample = { method = "sobol", n = 1000000000000, seed = 1 }\n'
        '"operation.torque" = { normal = { mean = "340 N*m", sd = "10 N*m" } }',
        "a = " + "[" * 20_000 + "]" * 20_000,
        "a." * 20_000 + "a = 1",
        'exclude = "' + "(" * 20_000 + '"',
        'extends = "' + "../" * 40 + 'etc/passwd"',
        'extends = "/dev/zero"',
        "[numerics]\nphase_points = 100000000000",
        '[[sweep]]\n"../.." = ["10 um"]',
    ],
)
def test_campaign_files_are_refused_in_a_moment(tmp_path, text, capsys):
    file = tmp_path / "strange.toml"
    file.write_text(BASE + text)
    assert status_of(["plan", str(file), "--store", str(tmp_path / "none")]) == 2
    said = capsys.readouterr().err
    assert "Traceback" not in said and "root:" not in said and len(said) < 5000
    assert os.listdir(tmp_path) == ["strange.toml"]


def test_nothing_in_a_dataset_is_unpickled(store):
    """Arrays of objects could carry code; text is all that is read as such."""
    with pytest.raises(StoreError):
        store.run("none")
    run = store.run(sweep(1).cases[0].id)
    assert {value.dtype.kind for value in run.variables.values()} <= set("biufOUS")
    assert all(
        isinstance(item, str)
        for value in run.variables.values()
        if value.dtype.kind == "O"
        for item in np.ravel(value.values)
    )


# -- updates that strangers made
# ----------------------------------------------------------------------

UPDATE = "c" * 20


def planted_update(store, change, groups=updates.GROUPS):
    """Keep an update, then let a stranger change its file, and say so everywhere."""
    datasets = {
        f"/{name}": xr.Dataset({"x": ("point", np.arange(3.0))}) for name in groups
    }
    attributes = {"id": UPDATE, "title": "theirs", "subject": "s", "runs": ""}
    tree = xr.DataTree.from_dict({"/": xr.Dataset(attrs=attributes), **datasets})
    tree.attrs[netcdf.SEAL] = updates.seal_of(tree)
    path = updates.keep_update(store, tree)
    with h5py.File(path, "r+") as file:
        change(file)
    crafted(
        store,
        (
            "UPDATE updates SET sha256 = ?, size = ? WHERE id = ?",
            hash_of(path),
            path.stat().st_size,
            UPDATE,
        ),
    )
    return path


def half_precision(file):
    file["posterior"]["half"] = np.zeros(3, "f2")


def values_of_another_file(file):
    outside = Path(file.filename).parents[3] / "secret"
    outside.write_bytes(b"s" * 24)
    file["posterior"].create_dataset(
        "seen", (3,), "f8", external=[(str(outside), 0, 24)]
    )


def a_link_to_another_file(file):
    file["posterior"]["away"] = h5py.ExternalLink("other.nc", "/x")


def a_group_within_itself(file):
    file["posterior"]["again"] = file["posterior"]


def what_fills_the_memory(file):
    file["posterior"].create_dataset(
        "wide", (10**9,), "f8", chunks=(1000,), compression="gzip"
    )


def another_filter(file):
    file["posterior"].create_dataset("lzf", data=np.zeros(9), compression="lzf")


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (half_precision, "holds neither numbers, as a run has them, nor texts"),
        (values_of_another_file, "has its values in other files"),
        (a_link_to_another_file, "is a link to elsewhere"),
        (a_group_within_itself, "once more"),
        (what_fills_the_memory, "claims 8e.09 bytes of values"),
        (another_filter, "stored by other filters"),
    ],
)
def test_an_update_file_that_no_wearlab_made_is_refused(
    tmp_path, change, reason, capsys
):
    """Was: the process aborted, took 4.5 GB, or returned the content
    of another file.
    """
    store = Store(tmp_path / "store")
    store.archive.create()
    path = planted_update(store, change)
    with pytest.raises(StoreError, match=reason):
        updates.read_update(store, UPDATE)
    (problem,) = store.verify()
    assert problem.path == path and re.search(reason, problem.message)
    ours = Store(tmp_path / "ours")
    assert re.search(reason, merge(ours, store).damaged[UPDATE])
    assert updates.kept_updates(ours) == {}
    capsys.readouterr()
    assert status_of(["show", UPDATE[:6], "--store", str(store.path)]) == 2
    assert re.search(reason, capsys.readouterr().err)
    assert [problem.path for problem in store.reindex()] == [path]


def test_an_update_without_one_of_its_groups_is_one_line(tmp_path, capsys):
    store = Store(tmp_path / "store")
    store.archive.create()
    planted_update(store, lambda file: None, updates.GROUPS[:1])
    with pytest.raises(StoreError, match="has no group 'predictions'"):
        updates.read_update(store, UPDATE)
    capsys.readouterr()
    assert status_of(["show", UPDATE[:6], "--store", str(store.path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_what_the_catalogue_says_of_an_update_is_compared_with_its_file(tmp_path):
    """Was not seen: a list showed another answer than the file has."""
    store = Store(tmp_path / "store")
    store.archive.create()
    path = planted_update(store, lambda file: None)
    assert store.verify() == []
    crafted(store, ("UPDATE updates SET summary = ?", '{"life": "2 h"}'))
    problems = store.verify()
    assert path in [problem.path for problem in problems]
    assert any("(summary)" in problem.message for problem in problems)
    assert store.reindex() == [] and store.verify() == []
