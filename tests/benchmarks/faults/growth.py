"""How a store grows: ``python tests/benchmarks/faults/growth.py [FIGURE.png] 100 1000
10000 100000``.

Runs with the scene, results and histories of a spur pair that wears under its static
load are recorded through the store's own writer, each with a file (a small part of the
run's, not waited for until the disk has it). Prints processor time, bytes and memory,
and how costs grow between the first and the last count: cost ~ runs^power.
"""

import contextlib
import json
import math
import os
import resource
import sys
import tempfile
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "support"))

import made_up
import xarray as xr

from wearlab.cli.app import status_of
from wearlab.runner.worker import Task, execute
from wearlab.scene import Scene
from wearlab.store import Store, files
from wearlab.store.netcdf import to_image
from wearlab.store.outcome import Outcome
from wearlab.store.pruning import prunable, prune

BATCH = 500
OPENED = 1000
GEARS = {
    "gears": {
        "kind": "external-pair",
        "module": "3 mm",
        "face_width": "20 mm",
        "pinion": {"teeth": 50},
        "gear": {"teeth": 50},
    },
    "operation": {"torque": "340 N*m", "speed": "800 rpm"},
    "wear": {
        "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
        "until": {"cycles": 1e7},
    },
}


class Runs:
    """Runs at one torque after the other, told apart by nothing else."""

    def __init__(self) -> None:
        scene = Scene.from_mapping(GEARS)
        self.scene = json.loads(scene.canonical())
        self.whole = execute(Task(scene.id, scene))
        assert self.whole.state == "done", self.whole.reason
        self.image, self.sha256 = to_image(
            xr.Dataset({"max_wear_depth": ("update", [0.0, 1e-6])})
        )

    def __getitem__(self, number: int) -> Outcome:
        self.scene["operation"]["torque"] = 100.0 + number
        factor = 1.0 + 1e-6 * number
        summary = {
            name: value * factor if isinstance(value, float) else value
            for name, value in self.whole.summary.items()
        } | {"life": 1e9 - 1e3 * (number * 7919 % 1_000_003)}
        return replace(
            self.whole,
            **{
                "id": f"{number * 2654435761 % 2**64:020x}",
                "scene": json.dumps(self.scene),
            },
            **{"summary": summary, "image": self.image, "sha256": self.sha256},
        )


def seconds(act) -> float:
    begun = time.process_time()
    with open(os.devnull, "w") as nothing, contextlib.redirect_stdout(nothing):
        act()
    return time.process_time() - begun


def measure(count: int, folder: Path) -> dict[str, float]:
    """Return costs by name: processor time [s], bytes, peak memory [MB]."""
    some_runs = Runs()
    filled = 0.0
    with closing(Store(folder)) as store:
        store.archive.create()
        with store.archive.presence() as here:
            for at in range(0, count, BATCH):
                some = [
                    some_runs[number] for number in range(at, min(at + BATCH, count))
                ]
                filled += seconds(
                    lambda some=some: store.archive.save(some, here.token)
                )
        cases = [
            made_up.Case("base", some_runs[number].id)
            for number in range(min(count, OPENED))
        ]
        members = [(case.id, "base", {}) for case in cases]
        store.archive.catalogue.record_campaign("growth", None, "growth.toml", members)
        size = store.archive.catalogue.path.stat().st_size
        store.query(
            "torque > 150 N*m", sort="life", limit=10
        )  # the first question makes an index
        half = some_runs[count // 2].id
        found = {
            "write a run": filled / count,
            "find a run": seconds(lambda: [store.archive.find(half) for _ in range(20)])
            / 20,
            "ten, sorted": seconds(
                lambda: store.query("torque > 150 N*m", sort="life", limit=10)
            ),
            "one by its torque": seconds(
                lambda: store.archive.find(f"torque = {100 + count // 2} N*m")
            ),
            "all of a query": seconds(lambda: store.query("torque > 150 N*m")),
            "ls": seconds(lambda: status_of(["ls", "--store", str(folder)])),
            f"open {OPENED}": seconds(
                lambda: store.open(made_up.Campaign(tuple(cases)))
            ),
            "verify": seconds(lambda: store.verify()),
            "bytes a run": size / count,
        }
        going = prunable(store)
        found["prune"] = seconds(lambda: prune(store, going))
        assert len(store.archive.entries()) == len(cases)
    return found | {"memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3}


def shown(name: str, value: float) -> str:
    if name in ("bytes a run", "memory"):
        return f"{value:.0f}{' MB' if name == 'memory' else ''}"
    return f"{1e3 * value:.3g} ms"


def draw(path: str, table: dict[int, dict[str, float]]) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6.4, 4.2), layout="constrained")
    for name in next(iter(table.values())):
        if name not in ("bytes a run", "memory"):
            axes.loglog(
                list(table),
                [1e3 * row[name] for row in table.values()],
                "o-",
                label=name,
            )
    axes.set(
        xlabel="runs in the store",
        ylabel="processor time in ms",
        title="What a store costs as it grows",
    )
    axes.grid(True, which="major", alpha=0.3)
    axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.savefig(path, dpi=150)


if __name__ == "__main__":
    words = sys.argv[1:] or ["100", "1000"]
    files._synchronise = lambda paths: None
    counts = [int(word) for word in words if word.isdigit()]
    table = {}
    for count in counts:
        with tempfile.TemporaryDirectory() as name:
            table[count] = measure(count, Path(name) / "store")
        told = ", ".join(
            f"{key} {shown(key, value)}" for key, value in table[count].items()
        )
        print(f"{count} runs: {told}", flush=True)
    first = counts[0]
    last = counts[-1]
    if last > first:
        powers = {
            name: math.log(max(table[last][name], 1e-9) / max(table[first][name], 1e-9))
            / math.log(last / first)
            for name in table[last]
        }
        print(
            "cost ~ runs^p: "
            f"{', '.join(f'{name} {power:.2f}' for name, power in powers.items())}"
        )
    for word in words:
        if word.endswith(".png"):
            draw(word, table)
