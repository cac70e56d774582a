"""A little of what ``growth.py`` does in full: what one more run
takes of the catalogue.
"""

import sys
from contextlib import closing
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks" / "faults"))

from growth import Runs

from wearlab.store import Store, files

MAX_BYTES = 8_800  # of a run with about a hundred facts: scene, results, histories


def test_one_more_run_takes_few_bytes(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "_synchronise", lambda paths: None)
    some = Runs()
    sizes = []
    with closing(Store(tmp_path / "store")) as store:
        store.archive.create()
        with store.archive.presence() as here:
            for at in (0, 400):
                store.archive.save(
                    [some[number] for number in range(at, at + 400)], here.token
                )
                sizes.append(store.archive.catalogue.path.stat().st_size)
        facts = store.archive.catalogue.read("SELECT count(*) FROM facts")[0][0] / 800
    assert facts > 90
    assert (sizes[1] - sizes[0]) / 400 < MAX_BYTES
