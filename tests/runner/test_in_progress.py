"""Lives under way: kept through the parent, taken up bit for bit,
shown where nobody watches.
"""

import io
import time

import fake_life
import numpy as np
import pytest
from fake_campaign import sweep

import wearlab
from wearlab.cli import output
from wearlab.runner import Interrupted, progress
from wearlab.runner.progress import Lines
from wearlab.store import Store
from wearlab.store.locks import Checkpoints


def run(campaign, store, **options):
    return wearlab.run(
        campaign, store, simulate=fake_life.SIMULATE, progress=False, **options
    )


def rates(log):
    return [int(line.split()[1]) for line in log.read_text().splitlines()]


@pytest.fixture
def undisturbed(tmp_path):
    store = Store(tmp_path / "whole")
    log = tmp_path / "undisturbed"
    whole = sweep(2, log=str(log))
    assert run(whole, store, workers=2).ok
    return store, whole, min(rates(log))


def test_an_interrupted_life_goes_on_where_it_was(tmp_path, undisturbed):
    store = Store(tmp_path / "part")
    log = tmp_path / "log"
    campaign = sweep(1, act="interrupt", gate=str(tmp_path / "gate"), log=str(log))
    with pytest.raises(Interrupted):
        run(campaign, store)
    (case,) = campaign.cases
    assert (store.path / "checkpoints" / f"{case.id}.life").exists()
    assert case.id not in store.archive.heads(
        [case.id]
    )  # no finished run, and none that runs
    assert run(campaign, store).ok
    assert not (store.path / "checkpoints").exists()
    whole, other, all_rates = undisturbed
    np.testing.assert_array_equal(
        store.run(case.id).wear_depth, whole.run(other.cases[0].id).wear_depth
    )
    assert rates(log)[0] < all_rates  # what was done before was not done again


def test_a_life_whose_worker_was_killed_goes_on_where_it_was(tmp_path, undisturbed):
    """Its case is tried once more by itself, from what the parent heard."""
    store = Store(tmp_path / "part")
    log = tmp_path / "log"
    campaign = sweep(2, act="die", gate=str(tmp_path / "gate"), log=str(log))
    assert run(campaign, store, workers=2).ok
    assert not (store.path / "checkpoints").exists()
    whole, other, all_rates = undisturbed
    for one, never in zip(campaign.cases, other.cases, strict=True):
        np.testing.assert_array_equal(
            store.run(one.id).wear_depth, whole.run(never.id).wear_depth
        )
    assert min(rates(log)) < all_rates


def test_checkpoints_of_other_code_and_damaged_ones_are_none(tmp_path):
    kept = Checkpoints(tmp_path / "checkpoints")
    assert kept.read("ab12", "code") is None
    kept.write("ab12", b"state", "code")
    assert kept.read("ab12", "code") == b"state"
    assert kept.read("ab12", "other") is None
    path = tmp_path / "checkpoints" / "ab12.life"
    path.write_bytes(path.read_bytes()[:-1] + b"x")
    assert kept.read("ab12", "code") is None
    (
        tmp_path / "checkpoints" / "ab12.77.part"
    ).touch()  # of a process that was killed as it wrote
    kept.forget(["ab12"])
    assert not (tmp_path / "checkpoints").exists()


def test_lines_tell_where_a_life_is():
    stream = io.StringIO()
    with Lines(0.02, stream) as lines:
        lines.step("compiling")
        time.sleep(0.1)
        lines.start(3)
        lines.in_progress("ab12", "ab12: 134 µm at 6.2e+06 cycles")
        time.sleep(0.1)
    told = stream.getvalue().splitlines()
    assert told[0] == "compiling"
    assert told[-1] == "0 of 3 cases done; ab12: 134 µm at 6.2e+06 cycles"


def test_what_is_compiled_and_how_much_is_left_is_shown():
    """Of all workers together, until cases run."""
    stream = io.StringIO()
    with Lines(1e3, stream) as lines:
        lines.compiling(0, 1, 2, "contact and wear, external-pair")
        lines.compiling(1, 0, 3, "changes of contact, planetary")
        assert (
            lines.description
            == "compiling changes of contact, planetary (1 of 5 parts done)"
        )
        lines.start(4)
        lines.compiling(1, 1, 3, "late")
        assert lines.description == "cases"


def test_work_of_many_steps_tells_how_far_it_is_where_nobody_watches(
    monkeypatch, capsys
):
    """Lines on standard error: ``accuracy`` and ``browse --static`` take minutes."""
    shown = []
    monkeypatch.setattr(
        progress, "watched", lambda wanted: shown.append(Lines(1e3)) or shown[-1]
    )
    with output.counted("pages") as report:
        report(0, 12)
        report(5, 12)
        shown[0]._tell()
    assert capsys.readouterr().err == "5 of 12 pages done\n"
    with output.bar(3) as advance:
        advance("800 rpm: reference")
        shown[1]._tell()
    assert capsys.readouterr().err == "800 rpm: reference; 1 of 3 done\n"
