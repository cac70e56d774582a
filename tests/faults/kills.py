"""Kill parents at 30 moments of saving, workers at 30: ``python tests/faults/kills.py [PHASE …] [workers]``.

Without words all phases of `PHASES`, then workers.

Prints the phase that each kill of a parent hit, and ends with status 0 only when afterwards nothing done was
lost, ``verify`` was clean, the campaign completed, and every dataset had the seal of an undisturbed one.
"""

import sys
import tempfile
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

import storm
from phases import PHASES
from storm import begin, done, finish, kill_parent, kill_workers, reference

CASES = 40
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
            print(f"parent killed at {hit} ({at}): {len(kept)} of {CASES} were done; then {said}", flush=True)
    print(dict(hits))


def workers(folder: Path) -> None:
    moments, (status, said) = kill_workers(folder / "bereft", 600, 30, seed=7)
    assert (status, said) == (0, "computed 600 of 600"), said
    whole = reference(folder / "quiet", 600, folder / "bereft.log", act="slow")
    assert done(folder / "bereft") == whole
    print(f"{len(moments)} workers killed, when so many cases had begun: {moments}; {said}")


if __name__ == "__main__":
    storm.PATIENCE = 600.0
    words = sys.argv[1:] or [*PHASES, "workers"]
    with tempfile.TemporaryDirectory() as folder:
        if phases := [word for word in words if word in PHASES]:
            parents(Path(folder), phases)
        if "workers" in words:
            workers(Path(folder))
