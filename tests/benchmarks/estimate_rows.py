"""Scores of the error estimates of many scenes, computed one by one and kept as they
come.

Every scene runs in a process of its own, within a time of the processor. Its row is
added to a table at once, so that an interruption loses no more than what is under way;
rows that other sources made do not count.
"""

import csv
import os
import signal
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from math import inf
from multiprocessing import Pipe, get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from queue import SimpleQueue
from typing import Any, NamedTuple

from drawn_scenes import draw_any, small_scenes
from estimate_score import QUANTITIES, TIGHT, TOO_LONG, Apart, Score, score
from face_score import score_over_face
from processor_time import limit_work

from wearlab.scene import Scene

COLUMNS = (
    "source",
    "seed",
    "scene",
    "kind",
    "motion",
    "friction",
    "face",
    "outcome",
    "quality",
    "seconds",
    "run_seconds",
    "cost",
    "reference",
    *(f"{name}_{what}" for name in QUANTITIES for what in ("error", "estimate")),
)
TEXTS = ("source", "kind", "motion", "friction", "face", "outcome", "quality")
"""Columns of words; the others hold numbers."""
SCORED = "scored"
RUN, REFERENCE = "run", "reference"
TRUSTED, DOUBTFUL = "trusted", "doubtful"
CONTEXT: Any = get_context("spawn")
Row = dict[str, Any]
Report = Callable[[str], None]


class Asked(NamedTuple):
    """The scenes that are scored.

    Parameters
    ----------
    scenes, seed : how many of which
    longest : processor time after which a run is given up: it counts as missed [s]
    longest_reference : processor time after which its reference is given up: it counts
        as missed [s]
    """

    scenes: int
    seed: int
    longest: float
    longest_reference: float


def scored(
    seed: int, number: int, told: Callable[[str, float], None], longest: float
) -> Row:
    """Return the row of one scene, with the time of the processor that it took, and its
    run alone [s].

    Parameters
    ----------
    seed, number : which scene
    told : told, when the reference begins, whether the run trusts its estimates, and
        its time [s]
    longest : what a reference may take of the processor [s]
    """
    begun = time.process_time()
    scene = draw_any(seed, number)
    run: Row = {}

    def reference_begins(trusted: bool) -> None:
        run["run_seconds"] = round(time.process_time() - begun, 3)
        run["quality"] = TRUSTED if trusted else DOUBTFUL
        told(run["quality"], run["run_seconds"])

    try:
        judged = score_over_face if scene.face_keys else score
        cells = {"outcome": SCORED, **_cells(judged(scene, reference_begins, longest))}
    except Apart as apart:
        cells = {"outcome": str(apart)}
    except Exception as error:  # a defect of one scene does not cost the others
        cells = {"outcome": f"failed: {error!r}"}
    seconds = round(time.process_time() - begun, 3)
    return {**_names(seed, number), **run, **cells, "seconds": seconds}


def _names(seed: int, number: int) -> Row:
    """Return what a scene is."""
    scene = draw_any(seed, number)
    motion = scene.dynamics
    return {
        "seed": seed,
        "scene": number,
        "kind": scene.gears.kind,
        "motion": "still" if motion is None else str(getattr(motion, "model", "")),
        "friction": "no" if motion is None or motion.friction is None else "yes",
        "face": "yes" if scene.face_keys else "no",
    }


def _work(line: Connection) -> None:
    """Score scenes as they are asked for, in a process of its own that ends when a run
    takes too long.
    """
    from wearlab.simulation import simulate

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who asked ends this process
    for scene in small_scenes():  # compiled before any clock runs
        simulate(scene)
    while True:
        seed, number, longest, reference = line.recv()
        with suppress(Exception):  # what is wrong with the scene shows in its run
            simulate(one_state(draw_any(seed, number)))
        limit_work(longest)

        def told(quality: str, seconds: float) -> None:
            limit_work(inf)
            line.send((quality, seconds))

        line.send(scored(seed, number, told, reference))


def one_state(scene: Scene) -> Scene:
    """Return a scene that wears no further: it compiles what the
    scene needs before any clock runs.
    """
    if scene.wear is None:
        return scene
    left = {
        name: None
        for name in ("until", "snapshots")
        if getattr(scene.wear, name) is not None
    }
    return scene.with_sections(wear=scene.wear.model_copy(update=left))


class Worker:
    """A process that scores scenes.

    One that works too long ends, and the next scene gets another.
    """

    def __init__(self) -> None:
        self.process: BaseProcess | None = None

    def scored(self, seed: int, number: int, longest: float, reference: float) -> Row:
        """Return the row of one scene, within a time of the processor for its run and
        its reference [s].
        """
        if self.process is None:
            self.line, theirs = Pipe()
            self.process = CONTEXT.Process(target=_work, args=(theirs,), daemon=True)
            self.process.start()
            theirs.close()
        self.line.send((seed, number, longest, reference))
        stage = RUN
        run = {}
        seconds = longest
        try:
            while isinstance(told := self.line.recv(), tuple):
                stage = REFERENCE
                run = {"quality": told[0], "run_seconds": told[1]}
                seconds = told[1] + reference
            found: Row = told
            return found
        except (EOFError, ConnectionError):
            self.process.join()
            late = self.process.exitcode == -signal.SIGXCPU
            outcome = f"{stage} {TOO_LONG}" if late else "failed: its process ended"
        self.close()
        return {**_names(seed, number), **run, "outcome": outcome, "seconds": seconds}

    def close(self) -> None:
        """End the process."""
        if self.process is not None:
            self.process.kill()
            self.process.join()
            self.line.close()
        self.process = None


def _cells(found: Score) -> Row:
    cells: Row = {"cost": found.cost, "reference": found.reference}
    for name in QUANTITIES:
        pair = getattr(found, name)
        if pair is not None:
            cells |= {f"{name}_error": pair[0], f"{name}_estimate": pair[1]}
    return cells


def read(file: Path) -> list[Row]:
    """Return the rows of a table, none where there is no file.

    A row that was cut off does not count.
    """
    if not file.exists():
        return []
    with file.open(newline="") as lines:
        rows = csv.DictReader(lines)
        return [
            {key: _value(key, text) for key, text in row.items() if text}
            for row in rows
            if row["outcome"]
        ]


def _value(key: str, text: str) -> Any:
    if key in TEXTS:
        return text
    return int(text) if key in ("seed", "scene") else float(text)


def of_row(row: Row) -> Score | None:
    """Return the score of a row, None when it has none."""
    if row["outcome"] != SCORED:
        return None
    pairs = {
        name: (row[f"{name}_error"], row[f"{name}_estimate"])
        if f"{name}_error" in row
        else None
        for name in QUANTITIES
    }
    tolerance = row.get("reference", TIGHT)
    return Score(
        **pairs,
        cost=row["cost"],
        trusted=row["quality"] == TRUSTED,
        reference=tolerance,
    )


def run(
    asked: Asked, source: str, file: Path, workers: int | None, report: Report
) -> list[Row]:
    """Score the scenes that the table lacks, on several processes, and add each to the
    table when done.

    Parameters
    ----------
    asked : the scenes
    source : hash of the sources that score them
    file : the table
    workers : processes; None: the cores
    report : told of every scene that is done
    """
    wanted = range(asked.scenes)
    known = {row["scene"]: row for row in done(asked, source, file)}
    for number in known:
        report(f"scene {number}")
    missing = [number for number in wanted if number not in known]
    new = not file.exists()
    with file.open("a", newline="") as lines:
        writer = csv.DictWriter(lines, COLUMNS)
        if new:
            writer.writeheader()
        for row in _rows(asked, missing, workers or os.cpu_count() or 1):
            row = {"source": source, **row}
            writer.writerow(row)
            lines.flush()
            known[row["scene"]] = row
            report(f"scene {row['scene']}")
    return [known[number] for number in wanted]


def done(asked: Asked, source: str, file: Path) -> list[Row]:
    """Return the rows that the table has of the scenes asked for, by these sources."""
    known = {
        row["scene"]: row
        for row in read(file)
        if row["source"] == source
        and row["seed"] == asked.seed
        and row["scene"] < asked.scenes
    }
    return [known[number] for number in sorted(known)]


def _rows(asked: Asked, missing: list[int], count: int) -> Iterator[Row]:
    """Yield the rows of scenes as they are done.

    Nothing goes on when nobody waits for them any more.
    """
    idle: SimpleQueue[Worker] = SimpleQueue()
    workers = [Worker() for _ in range(min(count, len(missing)))]
    for worker in workers:
        idle.put(worker)

    def one(number: int) -> Row:
        worker = idle.get()
        try:
            return worker.scored(
                asked.seed, number, asked.longest, asked.longest_reference
            )
        finally:
            idle.put(worker)

    pool = ThreadPoolExecutor(max(1, len(workers)))
    try:
        for done in as_completed([pool.submit(one, number) for number in missing]):
            yield done.result()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        for worker in workers:
            worker.close()
