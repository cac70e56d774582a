"""Names of scenes that no run has, of tables, of files, and of the
axes of campaigns.
"""

import json

import pytest
from made_up import put, run

from wearlab.query import QueryError
from wearlab.store import Store

MEASURED = (
    '{"wear":{"initial":{"pinion":{"y":"depth","x":"diameter","abscissa":[0.1,0.2]}}}}'
)


@pytest.fixture(scope="module")
def store(tmp_path_factory) -> Store:
    store = Store(tmp_path_factory.mktemp("names") / "store")
    store.archive.create()
    for letter, scene in zip("ab", (MEASURED, '{"wear":{}}'), strict=True):
        put(store, letter * 20, run(800.0), scene)
    places = [
        ("a" * 20, "base", {"k": "1e-10 mm^3/Nm"}),
        ("b" * 20, "base", {"k": "9e-11 mm^3/Nm"}),
    ]
    store.archive.catalogue.record_campaign("Decade", None, None, places)
    return store


def test_an_axis_is_a_column_and_sorts_by_its_number(store):
    found = store.query("", columns=("k", "id"), sort="k")
    assert list(found["k"]) == ["9e-11 mm^3/Nm", "1e-10 mm^3/Nm"]
    assert list(store.query("k = '1e-10 mm^3/Nm'")["id"]) == ["a" * 20]


def test_a_declared_key_that_no_run_has_may_be_asked_for(store):
    assert len(store.query("wear.law.model is missing")["id"]) == 2
    assert list(store.query("wear.initial.pinion.y is missing")["id"]) == ["b" * 20]


@pytest.mark.parametrize(
    "condition, message",
    [
        (
            "wear.initial.pinion.file is missing",
            "stands in campaign files only.*'wear.initial.pinion.y'",
        ),
        (
            "wear.initial is missing",
            "is a table: ask for one of its keys; there are 'wear.initial.pinion.x'",
        ),
        ("wear.initial.pinion.bubu is missing", "unknown name"),
    ],
)
def test_what_has_no_value_says_what_has(store, condition, message):
    with pytest.raises(QueryError, match=message) as found:
        store.query(condition)
    assert "abscissa.0" not in str(found.value)


def aligned(value):
    return json.dumps({"mesh": {"misalignment": {"value": value}}})


@pytest.fixture(scope="module")
def opened(tmp_path_factory) -> Store:
    """Flanks that open by 20 µm, by 5 µm, and aligned ones."""
    store = Store(tmp_path_factory.mktemp("opened") / "store")
    store.archive.create()
    for letter, scene in zip(
        "abc", (aligned([2e-5]), aligned([5e-6]), "{}"), strict=True
    ):
        put(store, letter * 20, run(800.0), scene)
    return store


@pytest.mark.parametrize("name", ["misalignment", "mesh.misalignment"])
def test_a_table_of_one_value_is_called_as_files_write_it(opened, name):
    assert list(opened.query(f"{name} > 10 um")["id"]) == ["a" * 20]
    assert list(opened.query(f"{name} is missing")["id"]) == ["c" * 20]
    found = opened.query(f"{name} > 1 um", sort=name)
    assert list(found["id"]) == ["b" * 20, "a" * 20]


def test_a_table_of_several_values_asks_which(tmp_path):
    store = Store(tmp_path / "store")
    store.archive.create()
    put(store, "a" * 20, run(800.0), aligned([1e-5, 2e-5]))
    with pytest.raises(QueryError, match=r"several values: .*\.0' or '.*value\.1'"):
        store.query("misalignment > 1 um")
    remedy = store.query("misalignment.value.1 > 15 um")
    assert list(remedy["id"]) == ["a" * 20]


@pytest.mark.parametrize(
    "condition",
    [
        "misalignment > 1 um",
        "mesh.misalignment > 1 um",
        "face_points > 11",
        "normal_backlash > 1 um",
        "tolerance < 1e-3",
    ],
)
def test_last_words_of_keys_that_no_run_has_may_be_asked_for(store, condition):
    assert len(store.query(condition)["id"]) == 0
    name = condition.split()[0]
    assert len(store.query(f"{name} is missing")["id"]) == 2


def test_last_words_of_several_keys_that_no_run_has_ask_which(store):
    message = r"may mean '.*gears\.pinion\.lead_crowning'.*: write more of it"
    with pytest.raises(QueryError, match=message):
        store.query("lead_crowning > 1 um")
    assert len(store.query("gears.pinion.lead_crowning > 1 um")["id"]) == 0
