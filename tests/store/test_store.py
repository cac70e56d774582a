import json
from dataclasses import replace

import fake_campaign
import pytest
import xarray as xr
from fake_campaign import alter, sweep

from wearlab.store import Store, StoreError


def kinds(store):
    return {(problem.path.name, problem.kind) for problem in store.verify()}


def test_naming_a_store_makes_nothing(store):
    assert not store.path.exists()
    with pytest.raises(StoreError, match="there is no store here"):
        store.verify()
    assert not store.path.exists()


def test_a_run_is_loaded_and_its_file_closed(fill):
    case = sweep(1).cases[0]
    store = fill(sweep(1))
    run = store.run(case.id[:8])
    xr.testing.assert_equal(run, fake_campaign.dataset(case.scene))
    assert run.attrs["id"] == case.id
    assert json.loads(run.attrs["scene"]) == json.loads(case.scene.canonical())


def test_which_run_is_meant(fill):
    store = fill(alter(sweep(20), 0, act="fail"))
    with pytest.raises(StoreError, match="no such run"):
        store.run("zzz")
    with pytest.raises(StoreError, match="no such run"):
        store.run("")
    shared = next(
        p for p in "0123456789abcdef" if len(store.archive.catalogue.matching(p)) > 1
    )
    with pytest.raises(StoreError, match="runs begin so"):
        store.run(shared)
    with pytest.raises(StoreError, match="failed"):
        store.run(alter(sweep(20), 0, act="fail").cases[0].id)


def test_a_run_can_be_named_by_a_condition(fill):
    campaign = sweep(3)
    store = fill(campaign)
    assert store.archive.find("speed = 900").id == campaign.cases[1].id
    with pytest.raises(StoreError, match="2 runs meet this"):
        store.archive.find("speed > 850")
    with pytest.raises(StoreError, match="no such run"):
        store.archive.find("speed > 1e6")
    with pytest.raises(StoreError, match="unknown name 'sped'"):
        store.archive.find("sped > 1")


def test_a_sound_store_has_no_problems(fill):
    assert fill(sweep(3)).verify() == []


def _two_the_catalogue_forgot(fill, store):
    """Return a run as it was written, and one whose content was changed by who knows
    how to write netCDF.
    """
    others = sweep(7).cases[5:]
    fill(replace(sweep(7), cases=others))
    store.archive.catalogue.forget(case.id for case in others)
    unknown, forged = (store.archive.files.path(case.id) for case in others)
    changed = xr.load_dataset(forged)
    changed["wear_depth"] = 0.5 * changed["wear_depth"]
    changed.to_netcdf(forged)
    return unknown, forged


def test_every_kind_of_damage_is_named(fill):
    campaign = sweep(4)
    store = fill(campaign)
    truncated, flipped, gone, _ = paths = [
        store.archive.files.path(case.id) for case in campaign.cases
    ]
    truncated.write_bytes(truncated.read_bytes()[:-10])
    image = bytearray(flipped.read_bytes())
    image[len(image) // 2] ^= 1
    flipped.write_bytes(image)
    gone.unlink()
    (store.archive.files.folder / "notes.txt").write_text("mine")
    part = store.archive.files.part(campaign.cases[0].id, "dead")
    part.write_bytes(b"half")
    stranger = store.archive.files.path("f" * 32)
    stranger.parent.mkdir(exist_ok=True)
    stranger.write_bytes(paths[3].read_bytes())
    unknown, forged = _two_the_catalogue_forgot(fill, store)
    assert kinds(store) == {
        (truncated.name, "truncated"),
        (flipped.name, "altered"),
        (gone.name, "missing"),
        ("notes.txt", "foreign"),
        (part.name, "unfinished"),
        (stranger.name, "foreign"),
        (unknown.name, "unknown"),
        (forged.name, "altered"),
    }


def test_a_part_being_written_now_is_no_problem(fill):
    store = fill(sweep(1))
    with store.archive.presence() as presence:
        store.archive.claim(["c" * 32], presence.token, lambda entry: False)
        part = store.archive.files.part("c" * 32, presence.token)
        part.parent.mkdir(exist_ok=True)
        part.write_bytes(b"half")
        assert kinds(store) == set()
    assert kinds(store) == set()  # accounted for: the next run removes it
    store.archive.catalogue.forget(["c" * 32])
    assert kinds(store) == {(part.name, "unfinished")}


def test_a_claim_clears_what_the_dead_left(store):
    store.archive.create()
    with store.archive.presence() as dead:
        store.archive.claim(["c" * 32], dead.token, lambda entry: False)
        part = store.archive.files.part("c" * 32, dead.token)
        part.parent.mkdir(parents=True)
        part.write_bytes(b"half")
    (entry,) = store.archive.entries().values()
    assert store.archive.is_stale(entry)
    with store.archive.presence() as presence:
        assert store.archive.claim(["c" * 32], presence.token, lambda entry: False) == [
            "c" * 32
        ]
    assert not part.exists()


def test_the_catalogue_is_made_anew_from_the_files(fill, tmp_path):
    campaign = alter(sweep(4), 1, act="fail")
    store = fill(campaign)
    before = {i: e for i, e in store.archive.entries().items() if e.state == "done"}
    grid = store.open(campaign).compute()
    store.close()
    store.archive.catalogue.path.unlink()
    again = Store(store.path)
    assert again.reindex() == []
    after = again.archive.entries()
    for run_id, entry in before.items():
        same = (
            "sha256",
            "size",
            "scene",
            "summary",
            "sizes",
            "digests",
            "layout",
            "source_hash",
            "started",
        )
        assert [getattr(after[run_id], key) for key in same] == [
            getattr(entry, key) for key in same
        ]
    assert set(after) == set(before)
    again_grid = again.open(campaign).compute()
    xr.testing.assert_identical(
        again_grid.drop_vars(["status", "reason"]).drop_attrs(),
        grid.drop_vars(["status", "reason"]).drop_attrs(),
    )


def test_reindexing_names_what_it_cannot_read(fill):
    store = fill(sweep(2))
    bad = store.archive.files.path(sweep(2).cases[0].id)
    bad.write_bytes(b"\x89HDF nonsense")
    (problem,) = store.reindex()
    assert problem.path == bad
    assert list(store.archive.entries()) == [sweep(2).cases[1].id]


@pytest.mark.parametrize("below", ["", "store"])
def test_a_store_where_none_can_be(tmp_path, below):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(StoreError, match=r"no store can be made here"):
        Store(tmp_path / "file" / below).archive.create()
    assert (tmp_path / "file").read_text() == "mine"


def test_a_notebook_shows_the_states_of_ls_and_lists_runs(fill):
    campaign = alter(sweep(3), 1, act="fail")
    store = fill(campaign)
    store.archive.claim(["c" * 20], "a-process-that-died", lambda entry: False)
    store.archive.files.path(campaign.cases[2].id).unlink()
    page = store._repr_html_()
    for state in ("done", "failed", "interrupted", "lost"):
        assert page.count(f"<td>{state}</td>") == 2, state
    assert "running" not in page
    assert all(case.id[:10] in page for case in campaign.cases)
