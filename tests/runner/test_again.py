"""What is computed again on request, and that an interruption loses nothing."""

import pytest
from fake_campaign import SIMULATE, sweep

import wearlab as wl
from wearlab import sources
from wearlab.runner import Interrupted, RunnerError, execution
from wearlab.runner.preparation import chosen
from wearlab.store import Store, StoreError
from wearlab.store.catalogue import Entry


def run(campaign, store, **options):
    return wl.run(campaign, store, simulate=SIMULATE, progress=False, **options)


def head(state="done", source_hash="abc"):
    nothing = [None] * 8
    return Entry("a" * 20, state, None, 1, None, None, None, source_hash, *nothing)


def test_what_each_word_means():
    present = sources.present_hashes()[0]
    cases = [
        head(source_hash=present),
        head(source_hash="old"),
        head("failed", ""),
        head("refused", ""),
    ]
    for word, expected in (
        (None, [False, False, False, False]),
        ("failed", [False, False, True, True]),
        ("stale", [False, True, False, False]),
        ("all", [True, True, True, True]),
    ):
        assert [chosen(word, False)(one) for one in cases] == expected
    assert chosen(None, True)(head("failed")) and chosen("stale", True)(head("failed"))
    with pytest.raises(RunnerError, match="there are failed, stale, all"):
        chosen("everything", False)


def test_stale_runs_are_computed_once_more(tmp_path, monkeypatch):
    store = Store(tmp_path / "store")
    campaign = sweep(1, log=str(tmp_path / "log"))
    run(campaign, store)
    assert run(campaign, store).computed == 0
    monkeypatch.setattr(
        "wearlab.sources.present_hashes", lambda: ("abc",)
    )  # what the fake runs bear
    assert run(campaign, store, recompute="stale").computed == 0
    monkeypatch.setattr("wearlab.sources.present_hashes", lambda: ("new",))
    assert run(campaign, store, recompute="stale").computed == 1
    assert len((tmp_path / "log").read_text().splitlines()) == 2
    assert store.verify() == []


def test_an_interruption_leaves_the_old_run(tmp_path, monkeypatch):
    store = Store(tmp_path / "store")
    campaign = sweep(1)
    run(campaign, store)
    before = store.run(campaign.cases[0].id)

    def interrupted(task, simulate, send):
        assert store.archive.entries()[task.id].state == "running"
        raise KeyboardInterrupt

    monkeypatch.setattr(execution, "execute", interrupted)
    with pytest.raises(Interrupted):
        run(campaign, store, recompute="all")
    assert store.verify() == []
    assert store.run(campaign.cases[0].id).identical(before)


def test_nothing_is_touched_by_a_wrong_word(tmp_path):
    with pytest.raises(RunnerError):
        run(sweep(1), Store(tmp_path / "store"), recompute="some")
    assert not (tmp_path / "store").exists()


def test_a_grid_that_was_opened_before_says_that_its_run_was_computed_anew(tmp_path):
    store = Store(tmp_path / "store")
    campaign = sweep(1)
    run(campaign, store)
    grid = store.open(campaign)
    entry = store.archive.entries()[campaign.cases[0].id]
    while store.archive.entries()[entry.id].sha256 == entry.sha256:
        run(campaign, store, recompute="all")
    with pytest.raises(StoreError, match="computed anew after this was opened"):
        grid["wear_depth"].load()
    assert float(store.open(campaign).life[0]) > 0.0
