"""What no campaign refers to."""

import pytest
from fake_campaign import filled, sweep

from wearlab.store import Store, StoreError
from wearlab.store.pruning import prunable, prune


def recorded(store, campaign, path):
    members = [(case.id, case.label, {}) for case in campaign.cases]
    store.archive.catalogue.record_campaign(campaign.title, None, path, members)


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
