"""Mutated files, conditions, stores and bits.

``python tests/benchmarks/faults/attack.py [KIND=COUNT …] [seed=N]``

Kinds and counts in full: ``files=3000 conditions=3000 stores=500 flips=1000``. Survived
is what ends in a result or in one message (exit status 0, 1 or 2, no traceback), within
ten seconds; of flips, what is refused. Prints one line a kind, and every fault that was
not survived; ends with status 0 when there is none.
"""

import contextlib
import io
import random
import shutil
import sqlite3
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "support"))

import made_up
from catalogues import TEXTS, change_texts

from wearlab.cli.app import status_of
from wearlab.query import QueryError
from wearlab.store import Store, StoreError

FEW = (
    "wear_depth",
    "max_wear_depth",
    "life",
    "mesh_stiffness",
    "contact_ratio",
    "dynamic_mesh_force",
)
"""Results of every shape that a catalogue knows: what stores suffer is in their
catalogues."""
FULL = {"files": 3000, "conditions": 3000, "stores": 500, "flips": 1000}
LONGEST = 10.0  # s
CAMPAIGNS = Path(__file__).parents[3] / "campaigns"
ODD = [
    *(
        '""',
        "9" * 400,
        "-1",
        "0",
        "nan",
        "inf",
        "1e999",
        "true",
        "[]",
        "{}",
        '"x"',
        '"-5 furlong"',
        "[[]]",
    ),
    *(
        '"1 rpm"',
        '"1e300 N*m"',
        '"/dev/zero"',
        '"../.."',
        "2026-01-01",
        '"\\u0000"',
        "{ linspace = [1] }",
    ),
    *(
        "[" * 200 + "]" * 200,
        '"' + "a" * 5000 + '"',
        "0x7fffffffffffffff",
        "1_000",
        '"µ"',
        '"340 N*m"',
    ),
]
WORDS = [
    *(
        "speed",
        "torque",
        "life",
        "verdict",
        "scene.operation.speed",
        "first_cycle(",
        "max_wear_depth",
        ")",
    ),
    *(
        "(",
        "and",
        "or",
        "not",
        "in",
        "between",
        "is",
        "missing",
        "contains",
        "=",
        "<",
        ">=",
        "!=",
        "[",
        "]",
    ),
    *(
        ",",
        "1100 rpm",
        "5 N*m",
        "1e9",
        "'x'",
        '"',
        "'",
        "2026-01-01",
        "µ",
        "\x00",
        "10 um",
        "-",
        "1 1/min",
    ),
    *(
        "9" * 300,
        "\\",
        "%",
        ";",
        "--",
        "*",
        "0 furlong",
        "status",
        "campaign",
        "case",
        "1e-400",
        "nan",
    ),
]


class Tally:
    """What was tried and what was not survived."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self.ends = Counter()
        self.faults = []

    def attempt(self, what: str, act) -> None:
        begun = time.process_time()
        try:
            with (
                contextlib.redirect_stdout(io.StringIO()),
                contextlib.redirect_stderr(io.StringIO()),
            ):
                end = act()
        except Exception as error:
            where = traceback.extract_tb(error.__traceback__)[-1]
            return self.fault(
                what,
                f"{type(error).__name__}: {error} ({where.filename}:{where.lineno})",
            )
        self.ends[end] += 1
        if time.process_time() - begun > LONGEST:
            self.fault(
                what, f"took {time.process_time() - begun:.0f} s of processor time"
            )

    def fault(self, what: str, said: str) -> None:
        self.faults.append(f"{self.kind}: {what[:300]!r}: {said[:300]}")

    def tell(self) -> bool:
        tried = sum(self.ends.values()) + len(self.faults)
        ends = ", ".join(
            f"{count} {end}" for end, count in sorted(self.ends.items(), key=str)
        )
        print(
            f"{self.kind}: {tried} tried, {tried - len(self.faults)} survived ({ends})",
            flush=True,
        )
        for fault in self.faults[:20]:
            print(" ", fault)
        return not self.faults


def command(*words: str) -> str:
    """Run a command; anything but a proper exit status is a fault."""
    status = status_of(words)
    if status not in (0, 1, 2):
        raise AssertionError(f"exit status {status}")
    return f"status {status}"


def mutated(dice: random.Random, text: str) -> str:
    """Return a text with a few values, lines or characters changed."""
    lines = text.splitlines()
    for _ in range(dice.randint(1, 4)):
        at = dice.randrange(len(lines))
        line = lines[at]
        match dice.randrange(7):
            case 0 | 1 if "=" in line:
                lines[at] = f"{line.split('=')[0]}= {dice.choice(ODD)}"
            case 2 if "=" in line:
                lines[at] = f"{dice.choice(ODD)} = {line.split('=', 1)[1]}"
            case 3:
                lines[at] = dice.choice(lines)
            case 4:
                lines.insert(at, dice.choice(lines))
            case 5:
                del lines[at : at + dice.randint(1, 3)]
                lines = lines or [""]
            case _:
                place = dice.randrange(len(line) + 1)
                lines[at] = (
                    line[:place]
                    + chr(dice.choice((0, 10, 34, 39, 91, 93, 123, 46, 955)))
                    + line[place:]
                )
    return "\n".join(lines)


def files(count: int, dice: random.Random, folder: Path) -> Tally:
    tally = Tally("files")
    shutil.copytree(CAMPAIGNS, folder / "campaigns")
    own = sorted((folder / "campaigns").glob("*.toml"))
    inherited = sorted((folder / "campaigns/base").glob("*.toml"))
    texts = {path: path.read_text() for path in (*own, *inherited)}
    for _ in range(count):
        path = dice.choice(inherited if dice.random() < 0.7 else own)
        text = mutated(dice, texts[path])
        strange = path.with_name("strange.toml")
        strange.write_text(text, errors="replace")
        tally.attempt(
            text,
            lambda at=str(strange): command(
                "plan", at, "--store", str(folder / "none")
            ),
        )
    return tally


def filled(folder: Path, only: Sequence[str] = ()) -> Path:
    """Return a store with two runs and a campaign.

    Of the run's variables those named, or all.
    """
    whole = made_up.run(800.0)
    data = whole[list(only)].assign_attrs(whole.attrs) if only else whole
    with closing(Store(folder)) as store:
        store.archive.create()
        made_up.put(store, "a" * 20, data, scene='{"operation":{"speed":3.0}}')
        made_up.put(store, "b" * 20, None)
        store.archive.catalogue.record_campaign(
            "t", None, "x.toml", [("a" * 20, "base", {}), ("b" * 20, "base", {})]
        )
    return folder


def conditions(count: int, dice: random.Random, folder: Path) -> Tally:
    tally = Tally("conditions")
    with closing(Store(filled(folder / "asked"))) as store:
        for _ in range(count):
            text = " ".join(dice.choice(WORDS) for _ in range(dice.randint(1, 12)))

            def ask(text: str = text) -> str:
                try:
                    return f"{len(store.query(text))} runs"
                except (QueryError, StoreError) as error:
                    assert len(str(error)) < 3000
                    return "refused"

            tally.attempt(text, ask)
    return tally


VALUES = [
    *(
        "{{{",
        "[" * 100_000,
        "5",
        "null",
        '"x"',
        "[1]",
        '{"operation": 5}',
        '{"a":' * 3000 + "1" + "}" * 3000,
    ),
    *(
        b"\xff\xfe",
        5,
        -1,
        1e300,
        None,
        "",
        "../../../x",
        "\x00",
        '{"variables": 5}',
        '{"variables": {"a": {}}}',
    ),
]
COLUMNS = {
    "runs": "id state owner size sha256 started seconds source_hash wearlab_version "
    "layout",
    "documents": "reason warnings sizes digests summary scene",
    "layouts": "key layout",
    "keys": "name source kind unit quantity display_unit",
    "facts": "value",
    "campaigns": "title reference path recorded metadata",
    "members": "campaign number run label position",
}


def vandalised(dice: random.Random, store: Path) -> str:
    """Change a store as nobody should; return what was done."""
    catalogue = store / "catalogue.sqlite"
    match dice.randrange(10):
        case 0:
            content = bytearray(catalogue.read_bytes())
            for _ in range(dice.randint(1, 50)):
                content[dice.randrange(len(content))] = dice.randrange(256)
            catalogue.write_bytes(content)
            return "bytes of the catalogue"
        case 1:
            keep = dice.randrange(catalogue.stat().st_size)
            catalogue.write_bytes(catalogue.read_bytes()[:keep])
            return f"catalogue cut to {keep}"
        case 7:
            column = dice.choice(TEXTS)
            value = dice.choice(VALUES)
            change_texts(catalogue, column, lambda text: value)
            return f"{column} = {str(value)[:40]}"
        case 2:
            table = dice.choice(list(COLUMNS))
            statement: tuple[object, ...] = (
                dice.choice((f"DROP TABLE {table}", f"DELETE FROM {table}")),
            )
        case _:
            table = dice.choice(list(COLUMNS))
            column = dice.choice(COLUMNS[table].split())
            value = dice.choice(VALUES)
            statement = (f"UPDATE {table} SET {column} = ?", value)
    with closing(sqlite3.connect(catalogue, isolation_level=None)) as connection:
        with contextlib.suppress(sqlite3.Error):
            connection.execute(str(statement[0]), statement[1:])
    return f"{statement[0]} {str(statement[1:])[:40]}"


def stores(count: int, dice: random.Random, folder: Path) -> Tally:
    tally = Tally("stores")
    whole = filled(folder / "whole", FEW)
    store = folder / "vandalised"
    file = str(CAMPAIGNS / "base" / "spur_50_50.toml")
    asked = [
        *(
            ["ls"],
            ["ls", "--where", "speed > 1 rpm"],
            ["show", "aaaa"],
            ["show", "bbbb"],
            ["plan", file],
        ),
        *(
            ["verify"],
            ["prune"],
            ["cite", "aaaa"],
            ["merge", str(store)],
            ["reindex"],
            ["ls", "--json"],
        ),
    ]
    for _ in range(count):
        shutil.rmtree(store, ignore_errors=True)
        shutil.copytree(whole, store)
        what = vandalised(dice, store)
        for words in asked:
            at = folder / "into" if words[0] == "merge" else store
            shutil.rmtree(folder / "into", ignore_errors=True)
            tally.attempt(
                f"{what}; {words[0]}",
                lambda w=words, at=at: command(*w, "--store", str(at)),
            )
    return tally


def flips(count: int, dice: random.Random, folder: Path) -> Tally:
    """Change single bits of a run's file.

    Reading it, whole or lazily, must refuse every one.
    """
    tally = Tally("flips")
    run_id = "a" * 20
    campaign = made_up.Campaign((made_up.Case("base", run_id),))
    with closing(Store(filled(folder / "flipped"))) as store:
        path = store.archive.files.path(run_id)
        image = path.read_bytes()
        sound = store.run(run_id)
        for _ in range(count):
            bit = dice.randrange(8 * len(image))
            content = bytearray(image)
            content[bit // 8] ^= 1 << bit % 8
            path.write_bytes(content)

            def read() -> str:
                for one in (
                    lambda: store.run(run_id),
                    lambda: store.open(campaign).wear_depth.load(),
                ):
                    try:
                        one()
                    except StoreError:
                        continue
                    raise AssertionError("was read in silence")
                return "refused"

            tally.attempt(f"bit {bit}", read)
        path.write_bytes(image)
        np.testing.assert_array_equal(store.run(run_id).wear_depth, sound.wear_depth)
    return tally


KINDS = {"files": files, "conditions": conditions, "stores": stores, "flips": flips}


def main(words: list[str]) -> int:
    asked = dict(word.split("=") for word in words)
    dice = random.Random(int(asked.pop("seed", 1)))
    counts = {kind: int(count) for kind, count in asked.items()} or FULL
    well = True
    for kind, count in counts.items():
        with tempfile.TemporaryDirectory() as folder:
            well &= KINDS[kind](count, dice, Path(folder)).tell()
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
