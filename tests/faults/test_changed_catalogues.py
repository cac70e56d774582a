"""Catalogues that were changed, damaged, or made anew while others wrote: nothing is
wrong in silence.
"""

import multiprocessing
import random
import sqlite3
import time
from contextlib import closing

import pytest
from catalogues import change_texts
from fake_campaign import SIMULATE, sweep

import wearlab
from wearlab.cli.app import status_of
from wearlab.store import Store, StoreError

TOLD = ("life", "max_wear_depth", "verdict", "operation.speed", "speed")


@pytest.fixture
def store(tmp_path):
    with closing(Store(tmp_path / "store")) as made:
        wearlab.run(sweep(3), made, simulate=SIMULATE, progress=False, workers=0)
        assert made.verify() == []
        yield made


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE facts SET value = value * 1.5 WHERE key = (SELECT number FROM keys "
        "WHERE name = 'life')",
        "UPDATE facts SET value = value + 1e-9 WHERE typeof(value) = 'real'",
        "UPDATE facts SET value = CAST(value AS TEXT) WHERE typeof(value) = 'real'",
        "DELETE FROM facts WHERE key = (SELECT number FROM keys WHERE name = "
        "'max_wear_depth()')",
        "UPDATE facts SET value = zeroblob(length(value)) WHERE typeof(value) = 'blob'",
        "INSERT INTO facts SELECT 999, number, 7.0 FROM runs",
        "UPDATE keys SET name = 'stolen' WHERE name = 'life'",
        "UPDATE keys SET unit = 'mm' WHERE name = 'max_wear_depth'",
        "UPDATE keys SET display_unit = 'km' WHERE name = 'max_wear_depth'",
        "UPDATE runs SET layout = 'other'",
        "UPDATE layouts SET layout = replace(layout, 'cycles', 'weeks')",
        "UPDATE documents SET scene = replace(scene, '800', '801')",
    ],
)
def test_what_was_changed_in_the_catalogue_is_found_and_mended(store, statement):
    with closing(
        sqlite3.connect(store.archive.catalogue.path, isolation_level=None)
    ) as connection:
        if "999" in statement:
            key = (
                "INSERT INTO keys VALUES (999, 'added', 'result', 'number', '', NULL, "
                "'')"
            )
            connection.execute(key)
        assert connection.execute(statement).rowcount != 0
    found = store.verify()
    assert found and all(
        "'wearlab reindex' mends it" in problem.message for problem in found
    ), found
    assert store.reindex() == [] and store.verify() == []


@pytest.mark.parametrize("name", ["sizes", "digests", "summary", "scene"])
def test_texts_that_were_changed_are_found(store, name):
    changed = {
        "sizes": '{"update": 2}',
        "digests": "{}",
        "summary": '{"life": 3.0}',
        "scene": "{}",
    }[name]
    change_texts(store.archive.catalogue.path, name, lambda text: changed)
    problems = store.verify()
    assert {problem.kind for problem in problems} == {"altered"}
    files = {problem.path for problem in problems if problem.path.suffix == ".nc"}
    assert len(files) == 3
    assert status_of(["verify", "--store", str(store.path)]) == 1
    assert store.reindex() == [] and store.verify() == []


def told(store):
    return [
        tuple(row.values())
        for row in store.query("", columns=("life", "max_wear_depth", "speed"))
    ]


def test_a_flipped_bit_of_the_catalogue_gives_no_other_number_in_silence(store):
    """What still answers otherwise than before is named by ``verify``."""
    dice = random.Random(32)
    sound = store.archive.catalogue.path.read_bytes()
    before = told(store)
    silent = []
    for _ in range(60):
        store.close()
        bit = dice.randrange(8 * len(sound))
        content = bytearray(sound)
        content[bit // 8] ^= 1 << bit % 8
        store.archive.catalogue.path.write_bytes(content)
        try:
            if told(store) != before and not store.verify():
                silent.append(bit)
        except (StoreError, ValueError):
            continue
        finally:
            store.close()
    store.archive.catalogue.path.write_bytes(sound)
    assert silent == []


def write(folder: str, first: int, until: float) -> None:
    """Compute runs over and over into a store, as one of several processes."""
    with closing(Store(folder)) as store:
        number = 0
        while time.monotonic() < until or number < 3:
            campaign = sweep(3, updates=2 + number, log=f"{folder}.{first}")
            assert wearlab.run(
                campaign,
                store,
                workers=0,
                simulate=SIMULATE,
                progress=False,
                recompute="all",
            ).ok
            number += 1


def test_a_catalogue_that_another_process_is_about_to_make_is_not_set_aside(tmp_path):
    """A writer that had just made the file found it renamed under its
    hands: no such table.
    """
    folder = tmp_path / "store"
    folder.mkdir()
    (folder / "catalogue.sqlite").touch()
    with closing(Store(str(folder))) as store:
        assert store.reindex() == []
        assert store.archive.entries() == {} and store.archive.catalogue.exists()
    assert not (folder / "catalogue.damaged").exists()


def test_a_catalogue_made_anew_beside_four_writers_stays_readable(tmp_path):
    """Texts that needed another row to be read had made 29 of 34 entries unreadable."""
    folder = str(tmp_path / "store")
    until = time.monotonic() + 2.0
    spawned = multiprocessing.get_context("spawn")
    writers = [
        spawned.Process(target=write, args=(folder, n, until)) for n in range(1, 5)
    ]
    for writer in writers:
        writer.start()
    with closing(Store(folder)) as store:
        while any(writer.is_alive() for writer in writers):
            time.sleep(0.2)
            if store.archive.catalogue.exists():
                assert [
                    problem
                    for problem in store.reindex()
                    if problem.kind != "unfinished"
                ] == []
                store.archive.entries()
        for writer in writers:
            writer.join()
        assert [writer.exitcode for writer in writers] == [0] * 4
        entries = store.archive.entries()
        assert len(entries) >= 9 and {entry.state for entry in entries.values()} == {
            "done"
        }
        assert store.verify() == []
        assert len(store.query("life > 0")) == len(entries)
