import json
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import fake_campaign
import pytest
from fake_campaign import Campaign, alter, sweep
from scenes import external_pair

from wearlab.campaign import load
from wearlab.cli import app, output
from wearlab.runner import plan as planner
from wearlab.runner.plan import Amount, differing, least_bytes, parts_of, plan
from wearlab.runner.worker import Task, execute
from wearlab.scene import MODEL_VERSION
from wearlab.store import Store


@dataclass(frozen=True)
class WithExcluded(Campaign):
    excluded: tuple = ()


@dataclass(frozen=True)
class Excluded:
    label: str
    position: dict
    condition: str


@pytest.fixture
def store(tmp_path):
    """A store of two done runs, 2 s and 4 s, 1000 and 3000 bytes.

    One failed, one refused.
    """
    made = Store(tmp_path / "store")
    made.archive.create()
    campaign = alter(alter(sweep(4), 2, act="fail"), 3, act="refuse")
    with made.archive.presence() as presence:
        for case, seconds in zip(campaign.cases, (2.0, 4.0, 1.0, 1.0), strict=True):
            outcome = execute(Task(case.id, case.scene), fake_campaign.SIMULATE)
            made.archive.save([replace(outcome, seconds=seconds)], presence.token)
    return made


def states(found):
    return [run.state for run in found.runs]


def test_what_is_known_of_each_run(store):
    campaign = alter(alter(sweep(6), 2, act="fail"), 3, act="refuse")
    found = plan(campaign, store)
    assert states(found) == ["cached", "cached", "failed", "refused", "new", "new"]
    assert found.runs[4].position == {"speed": "1200 rpm"}
    assert [run.other_code for run in found.runs] == [
        True,
        True,
        False,
        False,
        False,
        False,
    ]
    store.archive.files.path(campaign.cases[0].id).unlink()
    assert states(plan(campaign, store))[0] == "lost"


def test_what_another_process_computes_and_what_a_dead_one_left(store):
    campaign = sweep(6)
    with store.archive.presence() as presence:
        store.archive.claim([campaign.cases[4].id], presence.token, lambda head: False)
        store.archive.claim([campaign.cases[5].id], "dead", lambda head: False)
        assert states(plan(campaign, store))[4:] == ["running", "new"]


def test_a_plan_writes_nothing_and_needs_no_store(tmp_path):
    found = plan(sweep(3), Store(tmp_path / "none"))
    assert states(found) == ["new"] * 3 and found.seconds is None and found.free > 0
    assert not (tmp_path / "none").exists()


def test_time_and_size_come_from_runs_with_the_same_parts(store):
    sizes = [
        head.size
        for head in store.archive.heads(case.id for case in sweep(2).cases).values()
    ]
    found = plan(
        sweep(7), store, workers=2
    )  # 5 new: the last two of the store are other scenes
    assert found.seconds == Amount(15.0, 10.0, 20.0)
    assert found.bytes == Amount(2.5 * sum(sizes), 5 * min(sizes), 5 * max(sizes))
    assert found.basis == "2 recorded runs with the same parts" and found.workers == 2
    other = plan(sweep(1, act="warn"), store)
    assert other.basis == "all 2 recorded runs: none has the same parts"
    assert other.seconds == Amount(3.0, 2.0, 4.0) and other.workers == 1
    again = plan(alter(sweep(3), 2, act="fail"), store, retry=True)
    assert again.seconds == Amount(3.0, 2.0, 4.0)


def test_time_comes_from_runs_by_this_version_where_there_are_any(store, tmp_path):
    """A store of slow runs by version 5 foretold 9.3 minutes for 2."""
    mixed = Store(tmp_path / "mixed")
    mixed.archive.create()
    versions = (5, 5, MODEL_VERSION, MODEL_VERSION)
    seconds = (100.0, 120.0, 2.0, 4.0)
    with mixed.archive.presence() as presence:
        for case, version, time in zip(sweep(4).cases, versions, seconds, strict=True):
            outcome = execute(Task(case.id, case.scene), fake_campaign.SIMULATE)
            summary = {**outcome.summary, "model_version": str(version)}
            made = replace(outcome, seconds=time, summary=summary)
            mixed.archive.save([made], presence.token)
    found = plan(sweep(5), mixed)
    assert found.seconds == Amount(3.0, 2.0, 4.0)
    assert found.basis == "2 recorded runs with the same parts"


def test_scenes_are_alike_when_numbers_alone_differ():
    one = '{"dynamics":{"model":"a","damping":1},"operation":{"torque":1}}'
    assert parts_of(one) == parts_of(one.replace("1", "2"))
    assert parts_of(one) != parts_of(one.replace('"a"', '"b"'))
    assert parts_of(one) != parts_of('{"operation":{"torque":1}}')


def test_warnings_of_full_disks_and_absurd_grids(store, monkeypatch):
    assert plan(sweep(7), store).warnings == ()
    monkeypatch.setattr(planner, "_free", lambda path: 100)
    (warning,) = plan(sweep(7), store).warnings
    assert "the disk will be full" in warning and "100 bytes free" in warning
    monkeypatch.setattr(planner, "MANY_RUNS", 2)
    assert "more than 2" in plan(sweep(7), store).warnings[0]


@pytest.fixture
def command(store, monkeypatch, capsys):
    campaign = sweep(6)
    left_out = (
        Excluded("base", {"speed": 1}, "speed_ratio > 1"),
        Excluded("base", {"speed": 2}, "speed_ratio > 1"),
    )
    campaign = WithExcluded(
        campaign.cases[:1] + campaign.cases[3:], campaign.axes, excluded=left_out
    )
    monkeypatch.setattr(output, "read_campaign", lambda file: campaign)

    def run(*words):
        capsys.readouterr()
        status = app.status_of(
            ["plan", "a.toml", "--store", str(store.path), "--workers", "2", *words]
        )
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return run


def test_the_command_in_words(command, monkeypatch):
    status, out, err = command()
    assert (status, err) == (0, "")
    for words in (
        *(
            "4 cases, 4 distinct runs, 2 excluded",
            "3 new",
            "1 cached",
            "2 excluded by speed_ratio > 1",
        ),
        *(
            "time: about 4.5 s with 2 workers (3.0 s to 6.0 s)",
            " kB ",
            "from 2 recorded runs with the same parts",
        ),
    ):
        assert words in out
    monkeypatch.setattr(planner, "_free", lambda path: 100)
    status, _, err = command()
    assert status == 1 and err.startswith("warning: the disk will be full")


def test_the_command_as_json(command):
    content = json.loads(command("--json")[1])
    assert [run["state"] for run in content["runs"]] == ["cached", "new", "new", "new"]
    assert content["excluded"][0] == ["speed_ratio > 1", {"speed": "900 rpm"}]
    assert content["seconds"] == {"value": 9.0, "low": 6.0, "high": 12.0}


def test_a_billion_cases_are_refused_before_they_are_made(tmp_path, capsys):
    text = "".join(
        f'[[sweep]]\n"a.{name}" = {{ integers = [1, 1000] }}\n' for name in "xyz"
    )
    (tmp_path / "absurd.toml").write_text(text)
    assert (
        app.status_of(
            ["plan", str(tmp_path / "absurd.toml"), "--store", str(tmp_path / "s")]
        )
        == 2
    )
    assert "1,000,000,000 cases, more than 100,000" in capsys.readouterr().err
    assert not (tmp_path / "s").exists()


def test_what_has_changed_since_a_case_ran(store):
    campaign = replace(sweep(3), path=Path("a.toml"))
    members = [
        (case.id, case.label, {"speed": f"{case.scene.speed:g} rpm"})
        for case in campaign.cases
    ]
    store.archive.catalogue.record_campaign(campaign.title, None, "a.toml", members)
    found = plan(alter(campaign, 1, updates=4), store)
    assert [(run.state, run.changed) for run in found.runs[:2]] == [
        ("cached", ()),
        ("new", ("updates",)),
    ]
    assert (
        plan(replace(alter(campaign, 1, updates=4), path=Path("b.toml")), store)
        .runs[1]
        .changed
        == ()
    )


def test_a_scene_that_asks_for_too_much_is_told_without_any_record(
    monkeypatch, tmp_path
):
    text = {
        "numerics": {"phase_points": 1_000_000},
        "wear": {"snapshots": {"cycles": [1.0] * 9}},
    }
    scene = SimpleNamespace(canonical=lambda: json.dumps(text))
    assert least_bytes(scene) == 10 * 1_000_000 * 8 * 8 // 2
    assert least_bytes(SimpleNamespace(canonical=lambda: "{}")) == 64 * 8 * 8 // 2
    monkeypatch.setattr(planner, "_free", lambda path: 3000)
    (warning,) = plan(sweep(2), Store(tmp_path / "none")).warnings
    assert "the disk will be full: about 4.1e+03 bytes" in warning


def test_only_the_model_has_changed(store):
    entry = store.archive.find(sweep(1).cases[0].id)
    assert differing(entry, entry.scene) == ("version of the model",)


def test_another_version_of_the_model_is_named_instead_of_moved_defaults(store):
    entry = store.archive.find(sweep(1).cases[0].id)
    older = replace(entry, summary={**entry.summary, "model_version": "4"})
    scene = json.loads(entry.scene) | {"mesh": {"damping_law": "viscous"}}
    assert differing(older, json.dumps(scene)) == ("version of the model, 4 then",)
    scene["speed"] = 17.0
    told = differing(older, json.dumps(scene))
    assert told == ("version of the model, 4 then", "speed")


def test_a_plan_says_that_the_file_itself_is_not_run(tmp_path):
    file = tmp_path / "two.toml"
    case = '[[case]]\nlabel = "{}"\noperation.torque = "{} N*m"\n'
    head = f'extends = "{Path("campaigns/base/spur_50_50.toml").absolute()}"\n'
    file.write_text(head + case.format("a", 100) + case.format("b", 200))
    (warning,) = plan(file, Store(tmp_path / "none")).warnings
    assert "the file without its [[case]] blocks is not run" in warning
    file.write_text(file.read_text() + '[[case]]\nlabel = "as written"\n')
    assert len(plan(file, Store(tmp_path / "none")).runs) == 3


def test_the_time_of_a_coupled_life_is_not_foretold_from_other_runs(store):
    coupled = load(
        "campaigns/base/planetary_ngw11_coupled.toml"
    )  # with the life that calibrates it
    found = plan(coupled, store)
    assert found.seconds is None and found.bytes is not None
    assert found.basis.endswith(
        "the time of coupled lives (2) cannot be foretold, none with the same parts "
        "is recorded"
    )
    static = load({"extends": str(coupled.path), "wear": {"load": "static"}})
    assert plan(static, store).seconds is not None


def test_a_plan_is_made_of_whatever_can_be_run(tmp_path, monkeypatch):
    """``wl.plan`` takes what ``wl.run`` takes, and writes nothing."""
    import wearlab as wl

    pair = {
        "gears": external_pair(25, 30),
        "operation": {"torque": "100 N*m", "speed": "1100 rpm"},
    }
    monkeypatch.setenv("WEARLAB_STORE", str(tmp_path / "store"))
    scene = wl.Scene.from_mapping(pair)
    for given in (
        pair,
        scene,
        [scene, scene.replace("operation.torque", "80 N*m")],
        wl.load(pair),
    ):
        planned = wl.plan(given)
        assert planned.count("new") == len(planned.runs) >= 1
    assert not (tmp_path / "store").exists()
    assert wl.plan(pair, tmp_path / "other").cases == 1


def test_a_plan_shows_a_table(store):
    """In a REPL and in a notebook: one row a run."""
    made = plan(sweep(3), store)
    first, heads, *rows = repr(made).splitlines()
    assert first.startswith("<Plan of 'five speeds': 3 runs: 1 new, 2 cached")
    assert heads.split() == "case what sets it apart state run".split()
    assert [row.split()[-2:] for row in rows] == [
        [state, run.id[:10]]
        for state, run in zip(("code", "code", "new"), made.runs, strict=True)
    ]
    page = made._repr_html_()
    assert page.count("<tr>") == 4 and "speed = 1000 rpm" in page
    many = plan(sweep(40), store)
    assert repr(many).splitlines()[-1] == "and 10 more"
