"""Steady states to a wanted error, timed."""

from steady_time import steady_time, time_text

from wearlab.scene import Scene


def test_the_fewest_steps_that_reach_an_error_are_timed(planetary: Scene) -> None:
    coarse = steady_time(planetary, 0.001, budget=0.01)
    fine = steady_time(planetary, 1e-07, budget=0.01)
    assert coarse is not None and fine is not None and coarse.steps < fine.steps
    for found, error in ((coarse, 1e-3), (fine, 1e-7)):
        assert 0.0 < found.error < error and 0.0 < found.warm_error < error
        assert min(found.cold, found.warm, found.first) > 0.0
    assert time_text(fine).startswith(f"{fine.steps:5} steps, error ")
    assert steady_time(planetary, 1e-15, budget=0.0) is None
