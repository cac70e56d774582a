"""Two stores become one: nothing lost, nothing overwritten, nothing believed."""

import hashlib
import json
import multiprocessing
import os
from dataclasses import replace

import pytest
import xarray as xr
from fake_campaign import SIMULATE, Scene, filled, sweep

from wearlab.runner.worker import Task, execute
from wearlab.store import Store, StoreError
from wearlab.store.files import RunFiles
from wearlab.store.merging import merge
from wearlab.store.netcdf import to_image


@pytest.fixture
def two(tmp_path):
    """Ours has speeds 1 to 3; theirs 1 to 5, a failure, and a campaign of its own."""
    bad = replace(sweep(1).cases[0], scene=Scene(act="fail"))
    theirs = replace(sweep(5), title="theirs", cases=(*sweep(5).cases, bad))
    return (
        filled(tmp_path / "ours", sweep(3)),
        filled(tmp_path / "theirs", theirs),
        theirs,
    )


def test_what_we_lack_comes_verified(two):
    ours, others, campaign = two
    made = merge(ours, others)
    ids = [case.id for case in campaign.cases]
    assert made.copied == ids[3:] and sorted(made.same) == sorted(ids[:3])
    assert not made.conflicting and not made.damaged and made.campaigns == 1
    assert ours.verify() == []
    assert (
        ours.archive.entries([ids[5]])[ids[5]].reason
        == others.archive.entries([ids[5]])[ids[5]].reason
    )
    xr.testing.assert_identical(ours.run(ids[4]), others.run(ids[4]))
    assert (
        len(
            [
                member
                for member in ours.archive.catalogue.members()
                if member.campaign == "theirs"
            ]
        )
        == 6
    )
    again = merge(ours, others)
    assert not again.copied and again.campaigns == 0


def die_after_writing(ours, others):
    """Merge as a process that is killed when its second file is in
    place and nothing says so.
    """
    written = []
    whole = RunFiles.write

    def write(self, images, writer):
        whole(self, images, writer)
        written.extend(images)
        if len(written) == 2:
            os._exit(9)

    RunFiles.write = write
    merge(Store(ours), Store(others))


def test_a_merge_that_was_killed_leaves_no_unknown_run(two):
    ours, others, _ = two
    ours.close()
    others.close()
    dying = multiprocessing.get_context("spawn").Process(
        target=die_after_writing, args=(str(ours.path), str(others.path))
    )
    dying.start()
    dying.join()
    assert dying.exitcode == 9 and ours.verify() == []
    merge(ours, others)
    assert ours.verify() == [] and len(ours.archive.entries()) == 6
    assert {entry.state for entry in ours.archive.entries().values()} == {
        "done",
        "failed",
    }


def test_a_merge_that_is_interrupted_keeps_what_it_wrote(two, monkeypatch):
    ours, others, _ = two

    def stop(run_id):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        merge(ours, others, stop)
    assert ours.verify() == [] and "running" not in {
        head.state for head in ours.archive.entries().values()
    }


def test_what_was_spoilt_is_left_there(two):
    ours, others, campaign = two
    cut, flipped = (others.archive.files.path(case.id) for case in campaign.cases[3:5])
    cut.write_bytes(cut.read_bytes()[:-1])
    image = bytearray(flipped.read_bytes())
    image[len(image) // 2] ^= 1
    flipped.write_bytes(image)
    made = merge(ours, others)
    assert set(made.damaged) == {cut.stem, flipped.stem}
    assert not ours.archive.files.path(cut.stem).exists() and ours.verify() == []


def test_a_damaged_run_of_ours_is_replaced_by_theirs(two):
    """Was 'the same', and stayed damaged."""
    ours, others, campaign = two
    run_id = campaign.cases[0].id
    path = ours.archive.files.path(run_id)
    image = bytearray(path.read_bytes())
    image[len(image) // 2] ^= 1
    path.write_bytes(image)
    assert [problem.kind for problem in ours.verify()] == ["altered"]
    assert merge(ours, others).repaired == [run_id]
    assert ours.verify() == []
    xr.testing.assert_identical(ours.run(run_id), others.run(run_id))


def test_what_plugins_declare_comes_along(two):
    """Was left there, so that plans of their runs asked for the plug-in."""
    ours, others, _ = two
    source = "law = 1\n"
    name = f"{hashlib.sha256(source.encode()).hexdigest()}.json"
    (others.path / "plugins").mkdir()
    (others.path / "plugins" / name).write_text(json.dumps({"source": source}))
    (others.path / "plugins" / f"{'0' * 64}.json").write_text(
        json.dumps({"source": source})
    )
    merge(ours, others)
    assert [file.name for file in (ours.path / "plugins").iterdir()] == [name]


def replaced(ours, others, campaign, factor):
    """Multiply the depths of their first run, and merge; return its id and result."""
    run_id = campaign.cases[0].id
    forged = others.run(run_id).drop_attrs()
    forged = forged.assign(wear_depth=factor * forged.wear_depth)
    forged = forged.assign_attrs(id=run_id)
    image, sha256 = to_image(forged)
    outcome = execute(Task(run_id, campaign.cases[0].scene), SIMULATE)
    before = ours.archive.files.path(run_id).read_bytes()
    with others.archive.presence() as presence:
        others.archive.save(
            [replace(outcome, image=image, sha256=sha256)], presence.token
        )
    made = merge(ours, others)
    assert ours.archive.files.path(run_id).read_bytes() == before
    return run_id, made


def test_other_results_under_one_id_are_flagged_and_ours_stay(two):
    run_id, made = replaced(*two, 2.0)
    assert made.conflicting == [run_id]
    assert made.differences == {run_id: "by up to 50 % (wear_depth)"}


def test_round_off_is_no_conflict(two):
    """Was one, as where another machine had computed the run."""
    run_id, made = replaced(*two, 1.0 + 5e-15)
    assert run_id in made.same and not made.conflicting and not made.differences


def test_a_name_never_leaves_the_store(two, tmp_path):
    ours, others, campaign = two
    (tmp_path / "secret.nc").write_bytes(
        others.archive.files.path(campaign.cases[4].id).read_bytes()
    )
    with others.archive.catalogue._transaction() as connection:
        connection.execute(
            "UPDATE runs SET id = '../../../secret' WHERE id = ?",
            (campaign.cases[4].id,),
        )
    made = merge(ours, others)
    assert "no identity" in made.damaged["../../../secret"]
    with pytest.raises(StoreError, match="no identity"):
        others.run("../../../secret")


def test_not_into_itself(two):
    with pytest.raises(StoreError, match="into itself"):
        merge(two[0], Store(two[0].path))
    with pytest.raises(StoreError, match="no store here"):
        merge(two[0], Store(two[0].path / "none"))
