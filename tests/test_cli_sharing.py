"""``export``, ``merge``, ``prune``, ``reindex``, ``cite`` as commands: what they say,
and their status.
"""

import json
import shutil
import sys

import pytest
import xarray as xr
from made_up import put, run
from scenes import SPUR_50_50

import wearlab as wl
import wearlab.browsing
from wearlab.cli.app import status_of
from wearlab.runner import progress
from wearlab.store import Store


@pytest.fixture
def study(tmp_path):
    """A campaign of two speeds, one of them stored, beside a run nobody asks for."""
    file = tmp_path / "study.toml"
    file.write_text(
        f'extends = "{SPUR_50_50.as_posix()}"\n[[sweep]]\n'
        '"operation.speed" = ["800 rpm", '
        '"1100 rpm"]\n'
    )
    campaign = wl.load(file)
    store = Store(tmp_path / "store")
    store.archive.create()
    put(store, campaign.cases[0].id, run(800.0).assign_attrs(id=campaign.cases[0].id))
    put(store, "e" * 20, run(1.0).assign_attrs(id="e" * 20))
    members = [(case.id, case.label, {}) for case in campaign.cases]
    store.archive.catalogue.record_campaign("Study", None, str(file), members)
    return file, store, campaign


def asked(capsys, *words):
    status = status_of([str(word) for word in words])
    told = capsys.readouterr()
    return status, told.out, told.err


def test_export(study, tmp_path, capsys):
    file, store, _ = study
    status, out, err = asked(
        capsys, "export", file, tmp_path / "o.nc", "--store", store.path
    )
    assert (
        status == 1
        and out.strip() == str(tmp_path / "o.nc")
        and "1 of 2 runs have no data" in err
    )
    with xr.open_dataset(tmp_path / "o.nc") as found:
        assert found["status"].values.tolist() == ["done", "missing"]
    assert (
        asked(capsys, "export", file, tmp_path / "p.nc", "--store", tmp_path / "none")[
            0
        ]
        == 2
    )
    assert not (tmp_path / "p.nc").exists()


def test_prune_says_before_it_does(study, capsys):
    _, store, campaign = study
    status, out, _ = asked(capsys, "prune", "--store", store.path)
    assert status == 0 and "1 runs can go" in out and "--yes" in out
    assert len(store.archive.entries()) == 2
    status, out, _ = asked(capsys, "prune", "--store", store.path, "--yes", "--json")
    assert json.loads(out)["runs"][0]["id"] == "e" * 20
    assert (
        set(store.archive.entries()) == {campaign.cases[0].id} and store.verify() == []
    )


def test_merge_and_reindex(study, tmp_path, capsys):
    _, store, _ = study
    status, out, _ = asked(capsys, "merge", store.path, "--store", tmp_path / "new")
    assert status == 0 and "2 runs copied" in out
    new = Store(tmp_path / "new")
    shutil.copy(
        new.archive.files.path("e" * 20),
        new.archive.files.folder / "ee" / ("f" * 20 + ".nc"),
    )
    (new.archive.files.folder / "ff").mkdir()
    shutil.copy(new.archive.files.path("e" * 20), new.archive.files.path("f" * 20))
    status, out, err = asked(capsys, "reindex", "--store", new.path)
    assert status == 1 and "2 runs in the catalogue" in out and "not its name" in err
    assert asked(capsys, "merge", tmp_path / "none", "--store", new.path)[0] == 2
    assert asked(capsys, "reindex", "--store", tmp_path / "none")[0] == 2


def test_a_catalogue_that_was_cut_off_is_made_anew(tmp_path, capsys):
    """Before the first run was stored: run sent to reindex, which saw no store."""
    store = Store(tmp_path / "store")
    store.archive.create()
    path = store.archive.catalogue.path
    (tmp_path / "cut").mkdir()
    (tmp_path / "cut" / path.name).write_bytes(path.read_bytes()[:5000])
    place = ("--store", tmp_path / "cut")
    status, _, err = asked(capsys, "ls", *place)
    assert status == 2 and "wearlab reindex" in err
    assert asked(capsys, "reindex", *place)[0] == 0
    assert asked(capsys, "ls", *place)[0] == 0


def test_cite(study, capsys):
    _, store, campaign = study
    status, out, _ = asked(
        capsys, "cite", campaign.cases[0].id[:8], "--store", store.path
    )
    assert (
        status == 0
        and "@misc{wearlab-" in out
        and "provenance: wearlab 9.9, sources feed" in out
    )
    assert asked(capsys, "cite", "nothing", "--store", store.path)[0] == 2


def test_a_static_copy_without_bokeh_is_refused_in_a_sentence(
    study, capsys, monkeypatch, tmp_path
):
    _, store, _ = study
    monkeypatch.delattr(wearlab.browsing, "pages", raising=False)
    monkeypatch.setitem(sys.modules, "wearlab.browsing.pages", None)
    status, _, err = asked(capsys, "browse", store.path, "--static", tmp_path / "copy")
    assert status == 2 and "pip install 'wearlab[browse]'" in err
    assert not (tmp_path / "copy").exists()


@pytest.mark.parametrize(
    ("words", "what", "total"),
    [
        (["verify"], "runs", 2),
        (["reindex"], "runs", 2),
        (["report", "FILE", "--out", "page.html"], "figures", 1),
        (["figures", "FILE"], "figures", 1),
    ],
    ids=["verify", "reindex", "report", "figures"],
)
def test_long_commands_tell_how_far_they_are(
    study, words, what, total, tmp_path, monkeypatch, capsys
):
    file, store, _ = study
    file.write_text(file.read_text() + '\n[[figure]]\nkind = "wear-profile"\n')
    monkeypatch.chdir(tmp_path)
    shown = []
    monkeypatch.setattr(
        progress,
        "watched",
        lambda wanted: shown.append(progress.Lines(1e3)) or shown[-1],
    )
    command = [str(file) if word == "FILE" else word for word in words]
    asked(capsys, *command, "--store", store.path)
    (bar,) = shown
    assert (bar.what, bar.done, bar.total) == (what, total, total)
