"""What no campaign refers to."""

from dataclasses import replace

import pytest
from fake_campaign import filled, sweep

from wearlab.store import Store, StoreError, catalogue
from wearlab.store.merging import merge
from wearlab.store.pruning import prunable, prune


def recorded(store, campaign, path, content=""):
    members = [(case.id, case.label, {}) for case in campaign.cases]
    store.archive.catalogue.record_campaign(
        campaign.title, None, path, members, content=content
    )


def part(campaign, first, last):
    return replace(campaign, cases=campaign.cases[first:last])


def test_only_what_no_campaign_asks_for_now(fill):
    five = sweep(5)
    ids = [case.id for case in five.cases]
    store = fill(five)
    recorded(store, sweep(3), "a.toml")
    recorded(store, sweep(2), "a.toml")  # the file was edited: the third speed went
    recorded(store, sweep(1), "b.toml")
    found = {one.id: one for one in prunable(store)}
    assert set(found) == set(ids[2:])
    assert (
        "earlier version" in found[ids[2]].reason
        and "no campaign" in found[ids[3]].reason
    )
    assert {one.id for one in prunable(store, kept=[ids[4]])} == set(ids[2:4])
    size = sum(store.archive.files.size(i) for i in ids[2:])
    assert sum(one.bytes for one in found.values()) == size
    assert prune(store, found.values()) == size
    assert (
        set(store.archive.entries()) == set(ids[:2])
        and store.verify() == []
        and prunable(store) == []
    )


def test_what_is_being_computed_stays(fill):
    store = fill(sweep(1))
    store.archive.catalogue.record_campaign("other", None, "other.toml", [])
    with store.archive.presence() as presence:
        store.archive.claim(["a" * 20], presence.token, lambda entry: False)
        assert [one.id for one in prunable(store)] == [sweep(1).cases[0].id]
    assert {one.id for one in prunable(store)} == {sweep(1).cases[0].id, "a" * 20}


def test_what_a_kept_run_continues_stays(fill, monkeypatch):
    two = sweep(2)
    store = fill(two)
    recorded(store, sweep(1), "a.toml")
    child, parent = (case.id for case in two.cases)
    entry = store.archive.entries([child])[child]
    object.__setattr__(entry, "scene", f'{{"start":{{"run":"{parent}"}}}}')
    every = store.archive.entries() | {child: entry}
    monkeypatch.setattr(type(store.archive), "entries", lambda self, ids=None: every)
    assert prunable(store) == []


def test_without_any_campaign_nothing_is_offered(tmp_path):
    """Was every run of the store, after a catalogue had been lost and made anew."""
    filled(tmp_path / "store", sweep(3))
    for file in (tmp_path / "store").glob("catalogue*"):
        file.unlink()
    store = Store(tmp_path / "store")
    assert store.reindex() == [] and len(store.archive.entries()) == 3
    with pytest.raises(StoreError, match="knows no campaign"):
        prunable(store)
    assert prunable(store, [case.id for case in sweep(3).cases]) == []


def test_what_another_store_brought_is_no_earlier_version(tmp_path, fill):
    """Was: a second machine's part of a file made the first one's runs removable."""
    five = sweep(5)
    ours = fill(part(five, 0, 3))
    recorded(ours, part(five, 0, 3), "/home/u/study.toml")
    theirs = filled(tmp_path / "theirs", part(five, 3, 5))
    recorded(theirs, part(five, 3, 5), "/home/u/study.toml")
    merge(ours, theirs)
    assert len(ours.archive.entries()) == 5 and prunable(ours) == []
    recorded(ours, part(five, 0, 2), "/home/u/study.toml")  # ours was edited
    assert [run.id for run in prunable(ours)] == [five.cases[2].id]


def test_two_machines_on_one_store_have_files_of_their_own(fill, monkeypatch):
    four = sweep(4)
    store = fill(four)
    recorded(store, part(four, 0, 2), "/home/u/study.toml")
    monkeypatch.setattr(catalogue, "machine", lambda: "the-other")
    recorded(store, part(four, 2, 4), "/home/u/study.toml")
    assert prunable(store) == []


def test_parts_of_one_file_that_says_the_same_are_one_version(fill):
    four = sweep(4)
    store = fill(four)
    recorded(store, part(four, 0, 2), "a.toml", content="as it is")
    recorded(store, part(four, 2, 4), "a.toml", content="as it is")
    assert prunable(store) == []
    recorded(store, part(four, 3, 4), "a.toml", content="edited")
    assert {run.id for run in prunable(store)} == {case.id for case in four.cases[:3]}


def test_what_an_older_wearlab_recorded_stays(fill):
    """It did not say who recorded it."""
    four = sweep(4)
    store = fill(four)
    recorded(store, part(four, 0, 2), "a.toml")
    recorded(store, part(four, 2, 4), "a.toml")
    with store.archive.catalogue._transaction() as connection:
        connection.execute("DROP TABLE origins")
    store.close()
    assert prunable(Store(store.path)) == []


@pytest.mark.parametrize("time", ["z", "9999-12-31T23:59:59.999+00:00", None, 5])
def test_a_campaign_that_was_recorded_at_no_time_stops_nothing(tmp_path, fill, time):
    """Was: a merged campaign of the year 9999 made every later run end in an error."""
    ours = fill(sweep(1))
    theirs = filled(tmp_path / "theirs", sweep(2))
    recorded(theirs, sweep(2), "/home/u/study.toml")
    with theirs.archive.catalogue._transaction() as connection:
        connection.execute("UPDATE campaigns SET recorded = ?", (time,))
    merge(ours, theirs)
    recorded(ours, sweep(1), "mine.toml")
    rows = ours.archive.catalogue.read(
        "SELECT path FROM campaigns ORDER BY recorded DESC LIMIT 1"
    )
    assert rows == [("mine.toml",)]
