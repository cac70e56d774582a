"""How a catalogue grows, in processor time and bytes: ``python tests/faults/growth.py 100 1000 100000``."""

import json
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path

from wearlab.store import Store
from wearlab.store.outcome import Outcome

BATCH = 500


def outcome(number: int) -> Outcome:
    scene = {"operation": {"torque": 100.0 + number, "speed": 100.0}, "gears": {"pinion": {"teeth": 20}}}
    summary = {"life": 1e6 + number, "max_wear_depth": 1e-5, "verdict": "completed"}
    return Outcome(f"{number:020x}", "done", "2026-01-01", 1.0, json.dumps(scene), summary=summary)


def seconds(act) -> float:
    begun = time.process_time()
    act()
    return time.process_time() - begun


def measure(count: int, folder: Path) -> None:
    with closing(Store(folder)) as store:
        store.create()
        filled = sum(
            seconds(lambda at=at: store.catalogue.record(map(outcome, range(at, min(at + BATCH, count)))))
            for at in range(0, count, BATCH)
        )
        size = store.catalogue.path.stat().st_size
        found = seconds(lambda: store.find(f"{count // 2:020x}"))
        asked = seconds(lambda: store.query("torque > 150 N*m", sort="life", limit=10))
        listed = seconds(lambda: store.query("torque > 150 N*m"))
    print(
        f"{count:>7} runs: {1e3 * filled / count:.2f} ms and {size / count:.0f} bytes a run; "
        f"find {1e3 * found:.1f} ms, ten of a query {1e3 * asked:.1f} ms, all of it {1e3 * listed:.1f} ms",
        flush=True,
    )


if __name__ == "__main__":
    for words in sys.argv[1:] or ["100", "1000"]:
        with tempfile.TemporaryDirectory() as name:
            measure(int(words), Path(name) / "store")
