"""Linear algebra of a run takes one thread, however many cores there are."""

from scenes import external_pair
from threadpoolctl import threadpool_info, threadpool_limits

from wearlab.scene import Scene
from wearlab.simulation import calibration, simulate
from wearlab.threads import one_thread


def _threads() -> set[int]:
    return {
        library["num_threads"]
        for library in threadpool_info()
        if library["user_api"] == "blas"
    }


def test_within_it_is_one_thread_and_after_it_as_many_as_before():
    with threadpool_limits(2, user_api="blas"):
        with one_thread():
            assert _threads() == {1}
        assert _threads() == {2}


def test_a_run_takes_one(monkeypatch):
    seen = []
    calibrated = calibration.calibrated
    monkeypatch.setattr(
        calibration,
        "calibrated",
        lambda scene: seen.append(_threads()) or calibrated(scene),
    )
    scene = Scene.from_mapping(
        {
            "gears": external_pair(28, 41),
            "operation": {"torque": "70 N*m", "speed": "1900 rpm"},
        }
    )
    with threadpool_limits(2, user_api="blas"):
        simulate(scene)
    assert seen == [{1}]
