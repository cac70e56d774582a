"""Scores of drawn scenes: told apart, kept as they come, never
computed twice, and what they promise.
"""

import contextlib
import math
import multiprocessing
import resource
import signal
import time

import estimate_rows
import estimate_score as scoring
import estimate_table
import estimates
import pytest
import xarray as xr
from drawn_scenes import KINDS, draw_any, small_scenes
from estimate_score import LESS_TIGHT, TIGHT, Apart, Score, reference_within, summary
from processor_time import OutOfTime, bounded

from wearlab.assembly import build


def row(scene, outcome=estimate_rows.SCORED, kind="external-pair", **cells):
    said = {
        "seed": 5,
        "scene": scene,
        "kind": kind,
        "motion": "torsional",
        "friction": "no",
        "face": "no",
    }
    return {
        **said,
        "outcome": outcome,
        "quality": "trusted",
        "seconds": 1.0,
        "run_seconds": 0.5,
        **cells,
    }


SCORES = [
    Score((1.0, 2.0), (1.0, 4.0), None, 0.1),
    Score((1.0, 6.0), (2.0, 1.0), (1.0, math.nan), 0.3),
]
ROWS = [
    row(number, **estimate_rows._cells(score)) for number, score in enumerate(SCORES)
]


def test_a_missing_estimate_counts_as_a_miss():
    found = summary(SCORES[:1])
    assert found == {"wear_depth": (1, 1.0, 2.0), "life": (1, 1.0, 4.0)}
    assert summary(SCORES)["mesh_force"][:2] == (1, 0.0)
    assert summary(SCORES)["life"] == (2, 0.5, 2.25)


def test_scenes_without_a_score_are_told_apart_with_what_it_means():
    others = (
        "refused: undercut",
        "refused: too thin",
        "reference too long",
        "life not reached: evaluation limit",
    )
    rows = [
        *ROWS[:1],
        *(row(number, text, "planetary") for number, text in enumerate(others, 2)),
    ]
    told = estimate_table.apart_rows(rows)
    assert [(reason, count) for reason, count, _ in told] == [
        ("refused", "2"),
        ("reference too long", "1"),
        ("life not reached", "1"),
    ]
    assert all(meaning for _, _, meaning in told)
    assert estimate_table.costs(rows) == (0.1, 0.1)
    # The reference that took too long counts as an error above its estimate.
    assert ("all", "life", "2", "50.0%", "4.0") in estimate_table.score_rows(rows)
    assert not any(kind == "planetary" for kind, *_ in estimate_table.score_rows(rows))


def test_doubtful_runs_are_counted_apart_and_time_is_a_miss():
    doubtful = {"quality": "doubtful"}
    rows = [
        *ROWS[:1],
        *(
            row(number, text)
            for number, text in enumerate(
                ("run too long", "failed: x", "unfinished: y"), 1
            )
        ),
        row(4, "reference too long", **doubtful),
        row(5, **estimate_rows._cells(SCORES[1]), **doubtful),
    ]
    found = {
        (group, name): (count, share)
        for group, name, count, share, _ in estimate_table.score_rows(rows)
    }
    assert found["all", "wear depth"] == ("4", "25.0%")
    assert found["doubtful", "wear depth"] == ("1", "100.0%") and found[
        "doubtful", "life"
    ] == ("1", "0.0%")
    told = {reason: words for reason, _, words in estimate_table.apart_rows(rows)}
    assert told["doubtful, reference too long"].startswith("apart")
    assert all(
        told[one].startswith("missed")
        for one in ("run too long", "failed", "unfinished")
    )


def test_what_is_promised_and_not_kept_is_said():
    def told(error, estimate, cost=0.1):
        return " ".join(
            estimate_table.missed(
                [row(0, cost=cost, life_error=error, life_estimate=estimate)]
            )
        )

    assert told(1.0, 7.0) == ""
    assert "below its estimate in 0.0%" in told(1.0, 0.9)
    assert "median of estimate over error is 11.0" in told(1.0, 11.0)
    assert "up to 60%" in told(1.0, 7.0, cost=0.6)
    assert estimate_table.missed([row(0, "aperiodic")]) == []
    assert "refused" in estimate_table.missed([row(0, "refused: x")])[0]
    assert "60 s" in estimate_table.missed([row(7, "aperiodic", run_seconds=61.0)])[0]


def test_a_quarter_is_internal_a_quarter_planetary_with_errors_a_quarter_has_a_face():
    scenes = [draw_any(77, number) for number in range(25)]
    over_face = [scene for scene in scenes if scene.face_keys]
    assert len(over_face) == 6
    others = [scene for scene in scenes if not scene.face_keys]
    kinds = [scene.gears.kind for scene in others]
    assert [kinds.count(kind) for kind in KINDS] == [7, 6, 6]
    sets = [scene for scene in others if scene.gears.kind == "planetary"]
    assert all(scene.errors is not None for scene in sets)
    assert (
        draw_any(77, 9).id
        == draw_any(77, 9).id
        != draw_any(78, 9).id
        != draw_any(77, 34).id
    )
    small = small_scenes()
    assert {one.gears.kind for one in small} == set(KINDS)
    assert {None if one.dynamics is None else one.dynamics.model for one in small} == {
        None,
        "torsional",
        "spur-3dof",
        "planetary",
        "planetary-torsional",
    }


@pytest.mark.parametrize("number", [10, 18, 52])
def test_rings_that_are_drawn_have_their_rim_outside_their_root(number):
    """Of oblique teeth the root lies further out than modules tell."""
    scene = draw_any(985998, number)
    assert scene.gears.helix_angle
    build(scene.replace({"mesh.face_points": 5, "numerics.profile_points": 15}))


def test_scenes_are_scored_kept_and_completed(tmp_path, monkeypatch, capsys):
    asked = []

    class Fake(estimate_rows.Worker):
        def scored(self, seed, number, longest, reference):
            asked.append((seed, number, longest))
            return ROWS[number % 2] | {"seed": seed, "scene": number}

    monkeypatch.setattr(estimate_rows, "Worker", Fake)
    out = tmp_path / "out"

    def command(scenes):
        words = [
            "--seed",
            "5",
            "--scenes",
            str(scenes),
            "--longest",
            "9",
            "--workers",
            "1",
            str(out),
        ]
        return estimates.main(words), capsys.readouterr()

    command(2)
    status, said = command(3)
    assert asked == [(5, 0, 9.0), (5, 1, 9.0), (5, 2, 9.0)]
    assert status == 1 and "life: the error is below its estimate in 66.7%" in said.err
    assert len(said.err.splitlines()) == 3 and "Scenes without a score" not in said.out
    with xr.open_dataset(out / "estimates.nc") as made:
        assert made.life_estimate.values.tolist() == [4.0, 1.0, 4.0]
        assert made.attrs["seed"] == 5 and made.wear_depth_error.attrs["units"] == "m"
    assert (out / "estimates.png").read_bytes()[:4] == b"\x89PNG"
    table = out / "estimates.csv"
    assert estimate_rows.of_row(estimate_rows.read(table)[0]) == SCORES[0]
    table.write_text(
        table.read_text().replace(estimate_rows.read(table)[1]["source"], "other", 1)
    )
    command(3)
    assert asked[3:] == [(5, 0, 9.0)]  # what other sources made does not count
    table.write_text(table.read_text()[:-60])
    command(3)
    assert len(asked) == 5  # nor does a row that was cut off


def test_an_interruption_keeps_what_is_done(tmp_path, monkeypatch):
    class Fake(estimate_rows.Worker):
        def scored(self, seed, number, longest, reference):
            if number == 1:
                raise KeyboardInterrupt
            return ROWS[0] | {"scene": number}

    monkeypatch.setattr(estimate_rows, "Worker", Fake)
    with pytest.raises(KeyboardInterrupt):
        estimate_rows.run(
            estimate_rows.Asked(3, 5, 9.0, 9.0),
            "here",
            tmp_path / "t.csv",
            1,
            lambda text: None,
        )
    assert estimate_rows.read(tmp_path / "t.csv")[0]["scene"] == 0


def test_a_command_that_is_cut_off_prints_what_it_has(tmp_path, monkeypatch, capsys):
    class Fake(estimate_rows.Worker):
        def scored(self, seed, number, longest, reference):
            if number == 2:
                raise KeyboardInterrupt
            return ROWS[number % 2] | {"scene": number}

    monkeypatch.setattr(estimate_rows, "Worker", Fake)
    estimates.main(["--seed", "5", "--scenes", "4", "--workers", "1", str(tmp_path)])
    said = capsys.readouterr()
    assert "cut off after 2 of 4 scenes" in said.err
    assert "median of estimate over error" in said.out


def test_time_is_that_of_the_processor_and_work_goes_on_after_it():
    for _ in range(2):
        with pytest.raises(OutOfTime), bounded(0.0):
            time.sleep(0.01)  # takes none
            while True:
                pass
    used, _ = resource.getrlimit(resource.RLIMIT_CPU)
    assert (
        used == resource.RLIM_INFINITY
        and signal.getsignal(signal.SIGXCPU) == signal.SIG_DFL
    )


def test_time_that_ends_inside_compiled_code_is_told_alike():
    """Compiled code makes a SystemError of what interrupts it."""
    with pytest.raises(OutOfTime), bounded(0.0):
        try:
            while True:
                pass
        except OutOfTime as late:
            raise SystemError("returned a result with an exception set") from late
    with pytest.raises(SystemError), bounded(100.0):
        raise SystemError
    with pytest.raises(OutOfTime), bounded(0.0), contextlib.suppress(OutOfTime):
        while True:
            pass


def test_a_less_tight_reference_serves_where_the_tightest_takes_too_long(monkeypatch):
    asked = []
    late = {TIGHT}

    def reference(scene, cycle, tolerance=TIGHT):
        asked.append(tolerance)
        if tolerance in late:
            raise OutOfTime
        return tolerance

    monkeypatch.setattr(scoring, "reference", reference)
    scene = small_scenes()[0]
    assert reference_within(scene, 1e6, 60.0) == LESS_TIGHT and asked == [
        TIGHT,
        LESS_TIGHT,
    ]
    late.add(LESS_TIGHT)
    with pytest.raises(Apart, match="reference too long"):
        reference_within(scene, 1e6, 60.0)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (
            ["--seed", "1", "--scenes", "0"],
            "--scenes: 0 is not a whole number from 1 on",
        ),
        (["--seed", "1", "--scenes", "2.5"], "--scenes: 2.5 is not a whole number"),
        (["--scenes", "2"], "--seed"),
        (["--seed", "-1"], "--seed"),
        (["--seed", "1", "--longest", "0"], "--longest: 0 is no time"),
        (["--seed", "1", "--longest", "5 s"], "--longest: 5 s is no time"),
    ],
)
def test_wrong_words_are_refused(tmp_path, words, told, capsys):
    with pytest.raises(SystemExit) as ended:
        estimates.main([*words, str(tmp_path / "out")])
    assert ended.value.code == 2 and told in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def _never(line):
    line.recv()
    line.send(("doubtful", 0.5))
    estimate_rows.limit_work(0.0)
    while True:
        pass


def _dies(line):
    line.recv()


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
@pytest.mark.parametrize(
    ("work", "told"),
    [(_never, "reference too long"), (_dies, "failed: its process ended")],
)
def test_a_scene_that_takes_too_long_or_ends_its_process_costs_no_other(
    work, told, monkeypatch
):
    monkeypatch.setattr(estimate_rows, "_work", work)
    monkeypatch.setattr(estimate_rows, "CONTEXT", multiprocessing.get_context("fork"))
    worker = estimate_rows.Worker()
    found = worker.scored(1, 11, 20.0, 20.0)
    assert (found["outcome"], found["kind"]) == (told, "planetary")
    assert worker.process is None
