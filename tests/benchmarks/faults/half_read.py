"""Damaged files that are read by halves.

``python tests/benchmarks/faults/half_read.py [NAME=COUNT …] [seed=N]``

Each file is refused in a message, or read as what is in it: the rows, or those before
the place where it was cut off. Anything else is a file read by halves in silence.
Prints one line a reader, and every file that was not judged well; ends with status 0
when there is none.
"""

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "support"))

from half_readers import READERS, fault_of

COUNT = 400


def attacked(name: str, count: int, seed: int) -> list[str]:
    """Return what was read by halves, and print how many files were refused."""
    faults = []
    refused = 0
    reader = READERS[name]
    with tempfile.TemporaryDirectory() as folder:
        for number, mutant in enumerate(reader.mutants(count, seed)):
            place = Path(folder) / str(number)
            place.mkdir()
            fault = fault_of(reader, mutant, place)
            refused += fault is None
            if fault:
                faults.append(f"{mutant.what}: {fault}\n    {mutant.content[:300]!r}")
    print(f"{name}: {count} files, {refused} refused, {len(faults)} read by halves")
    return faults


def main(words: list[str]) -> int:
    options = dict(word.split("=") for word in words)
    seed = int(options.pop("seed", 55))
    counts = {name: int(count) for name, count in options.items()}
    counts = counts or dict.fromkeys(READERS, COUNT)
    faults = []
    for name, count in counts.items():
        faults += attacked(name, count, seed)
    for fault in faults:
        print(" ", fault)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
