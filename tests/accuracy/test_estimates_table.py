"""The table of scores: told apart, kept on disk, and never computed twice."""

import math
import multiprocessing

import pytest

from wearlab.accuracy import estimates
from wearlab.accuracy.drawn import Score, summary


def row(scene, outcome=estimates.SCORED, **cells):
    return {"seed": 5, "scene": scene, "outcome": outcome, "seconds": 1.0, **cells}


SCORES = [
    Score((1.0, 2.0), (1.0, 4.0), None, 0.1),
    Score((1.0, 6.0), (2.0, 1.0), (1.0, math.nan), 0.3),
]
ROWS = [row(number, **estimates._cells(score)) for number, score in enumerate(SCORES)]


def test_a_missing_estimate_counts_as_a_miss():
    found = summary(SCORES[:1])
    assert found == {"wear_depth": (1, 1.0, 2.0), "life": (1, 1.0, 4.0)}
    assert summary(SCORES)["mesh_force"][:2] == (1, 0.0)
    assert summary(SCORES)["life"] == (2, 0.5, 2.25)


def test_scenes_without_a_score_are_told_apart():
    rows = [*ROWS[:1], row(2, "refused: undercut"), row(3, "refused: too thin"), row(4, "too long")]
    told = estimates.table(rows)
    assert (told["scenes"], told["scored"], told["apart"]) == (4, 1, {"refused": 2, "too long": 1})
    assert told["cost_median"] == told["cost_largest"] == 0.1
    assert told["life"] == {"scenes": 1, "below_estimate": 1.0, "median_ratio": 4.0}


def test_the_table_is_read_back_and_completed(tmp_path, monkeypatch, capsys):
    asked = []

    class Fake(estimates.Worker):
        def scored(self, seed, number, longest):
            asked.append((seed, number, longest))
            return ROWS[0] | {"seed": seed, "scene": number}

    monkeypatch.setattr(estimates, "Worker", Fake)
    out = tmp_path / "scores.csv"
    for scenes in ("2", "3"):
        estimates.main(["--scenes", scenes, "--seed", "5", "--longest", "9", "--out", str(out)])
    assert asked == [(5, 0, 9.0), (5, 1, 9.0), (5, 2, 9.0)]
    assert estimates.of_row(estimates.read(out)[2]) == SCORES[0]
    assert "3 scenes, 3 scored; apart: none" in capsys.readouterr().out


def _never(line):
    line.recv()
    estimates.limit_work(0.0)
    while True:
        pass


def _dies(line):
    line.recv()


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
@pytest.mark.parametrize(("work", "told"), [(_never, "too long"), (_dies, "failed: its process ended")])
def test_a_scene_that_takes_too_long_or_ends_its_process_costs_no_other(work, told, monkeypatch):
    monkeypatch.setattr(estimates, "_work", work)
    monkeypatch.setattr(estimates, "CONTEXT", multiprocessing.get_context("fork"))
    worker = estimates.Worker()
    assert worker.scored(1, 2, 20.0)["outcome"] == told
    assert worker.process is None
