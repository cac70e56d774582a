"""Names of scenes that no run has, of tables, of files, and of the
axes of campaigns.
"""

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
