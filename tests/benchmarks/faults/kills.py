"""Kill parents and workers.

``python tests/benchmarks/faults/kills.py [PHASE …] [workers] [starting[=N]] [seed=N]``

Parents at three moments of each phase of saving (`PHASES`), workers at 30 random
moments, and in N campaigns [30] both workers at a random moment about when they begin
to work. Without words all phases, then workers.

Prints the phase that each kill of a parent hit, and ends with status 0 only when
afterwards nothing done was lost, ``verify`` was clean, the campaign completed, and
every dataset had the seal of an undisturbed one.
"""

import random
import sys
import tempfile
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "support"))

import storm
from phases import PHASES
from storm import (
    begin,
    done,
    finish,
    kill_parent,
    kill_starting,
    kill_workers,
    reference,
)

CASES = 40
STARTED = 120  # cases of a campaign whose workers are killed as they begin
LATEST = 3.0  # s after a worker came until it is killed: by then it computes
AT = (3, 6, 9)  # the first transactions make the store and enter the campaign


def parents(folder: Path, phases: list[str]) -> None:
    whole = reference(folder / "undisturbed", CASES)
    hits: Counter[str] = Counter()
    for phase in phases:
        for at in AT:
            store = folder / f"{phase}-{at}"
            hit, kept = kill_parent(store, CASES, phase, at)
            hits[hit] += 1
            assert kept.items() <= whole.items()
            status, said = finish(begin(store, CASES))
            assert status == 0, said
            assert done(store) == whole
            assert not list(store.rglob("*.part"))
            print(
                f"parent killed at {hit} ({at}): {len(kept)} of {CASES} were done; "
                f"then {said}",
                flush=True,
            )
    print(dict(hits))


def workers(folder: Path) -> None:
    moments, (status, said) = kill_workers(folder / "bereft", 600, 30, seed=7)
    assert (status, said) == (0, "computed 600 of 600"), said
    whole = reference(folder / "quiet", 600, folder / "bereft.log", act="slow")
    assert done(folder / "bereft") == whole
    print(
        f"{len(moments)} workers killed, when so many cases had begun: {moments}; "
        f"{said}"
    )


def starting(folder: Path, trials: int, dice: random.Random) -> None:
    """Kill both workers at a moment between their coming and their
    first work, in each trial another.
    """
    ended: Counter[str] = Counter()
    for trial in range(trials):
        store = folder / f"started-{trial}"
        after = dice.uniform(0.0, LATEST)
        killed, (status, said) = kill_starting(store, STARTED, 2, after, act="slow")
        well = (status, said) == (0, f"computed {STARTED} of {STARTED}") and len(
            done(store)
        ) == STARTED
        ended["completed" if well else f"status {status}: {said}"] += 1
        print(
            f"{killed} workers killed {after:.2f} s after they came: {said}", flush=True
        )
        assert killed == 2
    print(dict(ended))
    assert ended["completed"] == trials


if __name__ == "__main__":
    storm.PATIENCE = 600.0
    seeds = [
        int(word.removeprefix("seed="))
        for word in sys.argv[1:]
        if word.startswith("seed=")
    ]
    words = [word for word in sys.argv[1:] if not word.startswith("seed=")] or [
        *PHASES,
        "workers",
    ]
    with tempfile.TemporaryDirectory() as folder:
        if phases := [word for word in words if word in PHASES]:
            parents(Path(folder), phases)
        if "workers" in words:
            workers(Path(folder))
        for trials in (
            word.partition("=")[2] or "30"
            for word in words
            if word.startswith("starting")
        ):
            starting(Path(folder), int(trials), random.Random(*seeds or [1]))
