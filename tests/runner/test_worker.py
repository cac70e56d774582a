import json
import subprocess
import sys

import fake_campaign
import netCDF4
from fake_campaign import SIMULATE, Scene

from wearlab.runner import worker
from wearlab.runner.cluster import LARGEST_BATCH, Pace
from wearlab.runner.worker import Task, execute, execute_all, warm_up


def outcome(**scene):
    scene = Scene(**scene)
    return execute(Task(scene.id, scene), SIMULATE)


def test_a_finished_case():
    made = outcome(speed=7.0)
    assert made.state == "done"
    assert made.summary["max_wear_depth"] == 7.0 + 20 + 1 + 0.3
    assert made.source_hash == "abc"  # of the code that made the dataset
    with netCDF4.Dataset("memory", memory=made.image) as file:
        assert file.id == made.id
        assert json.loads(file.scene)["speed"] == 7.0
        assert file.date_created == made.started


def test_a_refusal_keeps_its_reason_and_a_failure_its_traceback():
    refused = outcome(act="refuse")
    failed = outcome(act="fail")
    assert (refused.state, refused.image) == ("refused", None)
    assert refused.reason.startswith("contact ratio 0.93 is below one")
    assert (failed.state, failed.image) == ("failed", None)
    assert "Traceback" in failed.reason
    assert failed.reason.rstrip().endswith(
        "FloatingPointError: the shooting did not converge"
    )


def test_warnings_are_kept_once_and_do_not_escape(recwarn):
    assert outcome(act="warn").warnings == ("RuntimeWarning: the film is thin",)
    assert len(recwarn) == 0


def test_a_batch_goes_on_after_a_failure():
    tasks = [Task(s.id, s) for s in (Scene(act="fail"), Scene(), Scene(act="refuse"))]
    assert [o.state for o in execute_all(tasks, SIMULATE)] == [
        "failed",
        "done",
        "refused",
    ]


def test_an_unknown_simulation_is_a_failure():
    assert execute(Task("a", Scene()), "nowhere:nothing").state == "failed"


def test_warming_up_never_stops_the_work(capsys, monkeypatch, tmp_path):
    warm_up([Scene(log=str(tmp_path / "log"))], SIMULATE)
    assert (tmp_path / "log.warm").exists()
    monkeypatch.setattr(fake_campaign, "warm_up", lambda *given: 1 / 0)
    warm_up([Scene()], SIMULATE)
    monkeypatch.delattr(fake_campaign, "warm_up")
    warm_up([Scene()], SIMULATE)


def test_the_only_worker_tells_what_it_compiles(monkeypatch):
    """With ``--workers 1`` the progress said "compiling" for minutes, and no more."""
    told = []
    monkeypatch.setattr(worker, "from_worker", lambda: told.append)
    report = lambda scenes, turn, workers, report: report(1, 2, "contact")  # noqa: E731
    monkeypatch.setattr(fake_campaign, "warm_up", report)
    warm_up([Scene()], SIMULATE)
    assert told == [{"compiling": "contact", "turn": 0, "done": 1, "total": 2}]


def test_batches_follow_the_pace():
    pace = Pace()
    assert pace.batch(1000, 2) == 1  # nothing is known yet
    pace.count, pace.seconds = 10, 0.2
    assert pace.batch(1000, 2) == 20  # 0.4 s of 20 ms each
    assert pace.batch(8, 2) == 2  # every worker keeps something to do
    assert pace.batch(1, 2) == 1
    pace.seconds = 100.0
    assert pace.batch(1000, 2) == 1
    pace.seconds = 0.0
    assert pace.batch(1000, 2) == LARGEST_BATCH


def test_the_parent_side_stays_light():
    """Managing runs needs neither physics nor xarray nor HDF5: those
    live in workers and readers.
    """
    code = (
        "import sys, wearlab.runner, wearlab.store.store; "
        "print([m for m in ('numpy', 'numba', 'xarray', 'netCDF4', 'dask', 'rich') if "
        "m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"
