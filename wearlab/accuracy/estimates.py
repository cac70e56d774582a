"""Scores of the error estimates of many scenes.

``python -m wearlab.accuracy.estimates --scenes 200 --seed 2 --out scores.csv`` prints how often the error
stays below its estimate, and by what factor the estimate exceeds it. Scenes without a score are told apart
by the reason. The table grows scene by scene; asked again, what it holds is not computed again.
"""

import argparse
import csv
import json
import math
import resource
import signal
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from multiprocessing import Pipe, get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import numpy as np

from wearlab.accuracy.drawn import QUANTITIES, Apart, Score, draw, score, summary

COLUMNS = (
    "seed", "scene", "outcome", "seconds", "cost",
    *(f"{name}_{what}" for name in QUANTITIES for what in ("error", "estimate")),
)  # fmt: skip
SCORED = "scored"
CONTEXT: Any = get_context("spawn")
Row = dict[str, Any]


def scored(seed: int, number: int) -> Row:
    """Return the row of one scene, with the time of the processor that it took [s]."""
    begun = time.process_time()
    try:
        cells = {"outcome": SCORED, **_cells(score(draw(seed, number)))}
    except Apart as apart:
        cells = {"outcome": str(apart)}
    except Exception as error:  # a defect of one scene does not cost the others
        cells = {"outcome": f"failed: {error!r}"}
    return {"seed": seed, "scene": number, **cells, "seconds": round(time.process_time() - begun, 3)}


def _work(line: Connection) -> None:
    """Score scenes as they are asked for, in a process of its own that ends when a scene takes too long."""
    while True:
        seed, number, longest = line.recv()
        limit_work(longest)
        line.send(scored(seed, number))


def limit_work(longest: float) -> None:
    """End this process once it has used the processor for so long from now on [s], whatever else runs."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    _, most = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(used.ru_utime + used.ru_stime + longest), most))


class Worker:
    """A process that scores scenes; one that works too long ends, and the next scene gets another."""

    def __init__(self) -> None:
        self.process: BaseProcess | None = None

    def scored(self, seed: int, number: int, longest: float) -> Row:
        """Return the row of one scene, within a time of the processor [s]."""
        if self.process is None:
            self.line, theirs = Pipe()
            self.process = CONTEXT.Process(target=_work, args=(theirs,), daemon=True)
            self.process.start()
            theirs.close()
        self.line.send((seed, number, longest))
        try:
            found: Row = self.line.recv()
            return found
        except EOFError:
            self.process.join()
            outcome = "too long" if self.process.exitcode == -signal.SIGXCPU else "failed: its process ended"
        self.close()
        return {"seed": seed, "scene": number, "outcome": outcome, "seconds": longest}

    def close(self) -> None:
        """End the process."""
        if self.process is not None:
            self.process.kill()
            self.process.join()
            self.line.close()
        self.process = None


def _cells(found: Score) -> Row:
    cells: Row = {"cost": found.cost}
    for name in QUANTITIES:
        pair = getattr(found, name)
        if pair is not None:
            cells |= {f"{name}_error": pair[0], f"{name}_estimate": pair[1]}
    return cells


def read(file: Path) -> list[Row]:
    """Return the rows of a table, none where there is no file."""
    if not file.exists():
        return []
    with file.open(newline="") as lines:
        rows = csv.DictReader(lines)
        return [{key: _value(key, text) for key, text in row.items() if text} for row in rows]


def _value(key: str, text: str) -> Any:
    if key == "outcome":
        return text
    return int(text) if key in ("seed", "scene") else float(text)


def of_row(row: Row) -> Score | None:
    """Return the score of a row, None when it has none."""
    if row["outcome"] != SCORED:
        return None
    depth, life, force = (
        (row[f"{name}_error"], row[f"{name}_estimate"]) if f"{name}_error" in row else None
        for name in QUANTITIES
    )
    return Score(depth, life, force, row["cost"])


def table(rows: Sequence[Row]) -> dict[str, Any]:
    """Return what the rows say: counts, scenes apart by reason, shares and ratios of each quantity."""
    scores = [one for one in map(of_row, rows) if one is not None]
    told: dict[str, Any] = {"scenes": len(rows), "scored": len(scores)}
    reasons = [row["outcome"].partition(":")[0] for row in rows]
    told["apart"] = dict(Counter(reason for reason in reasons if reason != SCORED))
    if scores:
        told["cost_median"] = float(np.median([one.cost for one in scores]))
        told["cost_largest"] = max(one.cost for one in scores)
    for name, (count, share, ratio) in summary(scores).items():
        told[name] = {"scenes": count, "below_estimate": share, "median_ratio": ratio}
    return told


def run(asked: argparse.Namespace) -> list[Row]:
    """Score the scenes that the table lacks, on several processes, and add each to the table when done."""
    from rich.console import Console
    from rich.progress import track

    wanted = range(asked.first, asked.first + asked.scenes)
    rows = [row for row in read(asked.out) if row["seed"] == asked.seed and row["scene"] in wanted]
    there = {row["scene"] for row in rows}
    new = not asked.out.exists()
    console = Console(stderr=True)
    idle: SimpleQueue[Worker] = SimpleQueue()
    for _ in range(asked.workers):
        idle.put(Worker())

    def one(number: int) -> Row:
        worker = idle.get()
        try:
            return worker.scored(asked.seed, number, asked.longest)
        finally:
            idle.put(worker)

    with ThreadPoolExecutor(asked.workers) as pool, asked.out.open("a", newline="") as lines:
        writer = csv.DictWriter(lines, COLUMNS)
        if new:
            writer.writeheader()
        todo = [pool.submit(one, n) for n in wanted if n not in there]
        for done in track(as_completed(todo), "scenes", total=len(todo), console=console, transient=True):
            rows.append(done.result())
            writer.writerow(rows[-1])
            lines.flush()
    for _ in range(asked.workers):
        idle.get().close()
    return rows


def main(words: Sequence[str] | None = None) -> None:
    """Score scenes of a seed, keep the table and print what it says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=200, help="how many")
    parser.add_argument("--first", type=int, default=0, help="number of the first")
    parser.add_argument("--seed", type=int, default=2, help="1 set the weights of the estimates")
    parser.add_argument("--longest", type=float, default=600.0, help="processor time of one scene [s]")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--out", type=Path, default=Path("estimates.csv"), help="table of the scores")
    parser.add_argument("--figure", type=Path, help="estimates against errors, as PNG, PDF or SVG")
    parser.add_argument("--json", action="store_true", help="print for machines")
    asked = parser.parse_args(words)
    rows = run(asked)
    told = table(rows)
    if asked.figure is not None:
        from wearlab.accuracy.scores_figure import draw_scores

        draw_scores([one for one in map(of_row, rows) if one is not None], asked.figure)
    if asked.json:
        print(json.dumps(told, indent=1))
        return
    print(f"{told['scenes']} scenes, {told['scored']} scored; apart: {told['apart'] or 'none'}")
    for name in (name for name in QUANTITIES if name in told):
        count, share, ratio = told[name].values()
        print(f"{name:12s}{count:4d} scenes: error below estimate in {share:.1%}, median ratio {ratio:.2f}")
    if told["scored"]:
        print(f"estimates add {told['cost_median']:.0%} to a run, at most {told['cost_largest']:.0%}")


if __name__ == "__main__":
    main()
