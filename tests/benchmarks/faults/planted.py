"""Stores that a stranger changed: ``python tests/benchmarks/faults/planted.py
[KIND=COUNT …] [seed=N]``.

Kinds and counts in full: ``checkpoints=2000 facts=500 bits=500 answers=300``.

- checkpoints: of a life under way, mutated or planted. Survived is a life that ends as
  one that nobody disturbed, goes on from the numbers that stand there, or ends in an
  error of Python's own within ten seconds; nothing is called meanwhile that Python
  tells of by its audit events.
- facts: numbers, texts and rows of the catalogue. Survived is what ``verify`` names and
  ``reindex`` mends, and what changes no answer.
- bits: of the catalogue's file, one at a time, likewise.
- answers: of a store that is read over HTTP, cut off, longer, changed. Survived is what
  was asked, or a refusal.
"""

import importlib
import json
import pickle
import random
import shutil
import sqlite3
import struct
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from functools import cache, partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "support"))
sys.path.insert(0, str(Path(__file__).parent))

from attack import ODD, VALUES, Tally
from fake_campaign import filled, sweep

from wearlab.life import checkpoint
from wearlab.life.integrate import integrate
from wearlab.life.limits import Limits
from wearlab.store import Store, StoreError, open_store

FULL = {"checkpoints": 2000, "facts": 500, "bits": 500, "answers": 300}
FORBIDDEN = (
    *(
        "subprocess.Popen",
        "os.system",
        "os.exec",
        "os.posix_spawn",
        "os.fork",
        "os.remove",
        "os.rename",
    ),
    *("pickle.find_class", "exec", "socket.connect", "shutil.rmtree", "ctypes.dlopen"),
)
"""What Python tells of when it happens; a checkpoint makes none of it happen."""
WATCHED: list[str] = []
WATCHING = threading.Event()


def watch(event: str, given: tuple[Any, ...]) -> None:
    """Write down what nothing in a checkpoint may do.

    Files are opened to be written as well.
    """
    if WATCHING.is_set() and (
        event in FORBIDDEN or (event == "open" and set(str(given[1])) & set("wax+"))
    ):
        WATCHED.append(f"{event} {str(given)[:80]}")


@cache
def hooked() -> None:
    """Have Python tell of what happens; nothing ends that in this process."""
    sys.addaudithook(watch)


@contextmanager
def watched() -> Iterator[None]:
    """Fail when something forbidden happens within."""
    WATCHED.clear()
    WATCHING.set()
    try:
        yield
    finally:
        WATCHING.clear()
    if WATCHED:
        raise AssertionError(f"it did {WATCHED[0]}")


def lived(
    image: bytes | None, keep: Callable[[bytes], None] = lambda image: None
) -> tuple[float, ...]:
    """Return where a short life ends that goes on from an image.

    ``keep`` gets one of each of its states.
    """

    def rate(depth: np.ndarray) -> np.ndarray:
        return 1e-9 * (1.0 + np.linspace(0.0, 1.0, depth.size)) - 1e-4 * (
            depth - depth.mean()
        )

    with checkpoint.checkpoints(lambda reached, make: keep(make()), image):
        life = integrate(rate, np.zeros(7), limits=Limits(depth=2e-5), tolerance=1e-6)
    return float(life.cycle[-1]), *life.depth[-1].tolist()


def short_text(text: str) -> bytes:
    return pickle.SHORT_BINUNICODE + struct.pack("<B", len(text)) + text.encode()


def command(dice: random.Random) -> bytes:
    """Return a pickle that calls a name, dotted ones among them, with a command."""
    module = dice.choice(
        (
            "subprocess",
            "os",
            "wearlab.simulation.label",
            "wearlab.life.checkpoint",
            "builtins",
        )
    )
    name = dice.choice(
        ("Popen", "system", "subprocess.Popen", "importlib.import_module", "exec")
    )
    called = short_text(module) + short_text(name) + pickle.STACK_GLOBAL
    words = b"(" + short_text("touch") + b"l"
    return (
        pickle.PROTO + b"\x04" + called + words + pickle.TUPLE1 + pickle.REDUCE + b"."
    )


CLASSES = [
    f"wearlab.life.{module}:{name}"
    for module in ("step", "integrate", "history", "limits")
    for name, kind in vars(importlib.import_module(f"wearlab.life.{module}")).items()
    if isinstance(kind, type)
]
STORED: list[Any] = [
    ["shared", 0],
    ["shared", 10**9],
    ["array", "<f8", [10**12], "C", 0],
    ["array", "|O", [1], "C", 0],
    ["array", "<f8", [0, 10**18], "C", 0],
    ["number", "<U9999", [], "C", 0],
    ["table", [[[0], [0]]]],
    ["tuple", [[0]] * 1000],
    ["slice", [0], [0], [0]],
    [
        "record",
        "wearlab.life.step:Node",
        {"cycle": float("nan"), "depth": [0], "rate": [0]},
    ],
    [],
    "x" * 10_000,
    None,
]


def nested(depth: int) -> list[Any]:
    """Return tuples within tuples, each twice: a hash of the
    outermost would take 2^depth steps.
    """
    return [
        ["tuple", []],
        *(["tuple", [[k], [k]]] for k in range(depth)),
        ["table", [[[depth], 1]]],
    ]


def replaced(dice: random.Random, value: Any) -> Any:
    """Return JSON with one of its values replaced by another."""
    if isinstance(value, list) and value and dice.random() < 0.9:
        at = dice.randrange(len(value))
        return [*value[:at], replaced(dice, value[at]), *value[at + 1 :]]
    if isinstance(value, dict) and value and dice.random() < 0.9:
        key = dice.choice(list(value))
        return {**value, key: replaced(dice, value[key])}
    if type(value) in (int, float) and dice.random() < 0.7:
        return dice.choice((value + 1, value - 1, 2 * value, -value, float(value), 0))
    kinds = (
        ["record", dice.choice(CLASSES), {}],
        dice.choice(STORED),
        dice.choice((0, -1, 1e999, None, "", True, [3])),
    )
    return dice.choice(kinds)


def mutated(dice: random.Random, image: bytes) -> bytes:
    """Return an image of a checkpoint as a stranger may leave it.

    Its lengths fit where that is possible.
    """
    ((key, _),) = json.loads(image.partition(b"\n")[0]).items()
    life = image.partition(b"\n")[2]
    head, _, arrays = life.partition(b"\n")
    match dice.randrange(7):
        case 0:
            content = bytearray(image)
            for _ in range(dice.randint(1, 20)):
                content[dice.randrange(len(content))] = dice.randrange(256)
            return bytes(content)
        case 1:
            return image[: dice.randrange(len(image))]
        case 2:
            life = command(dice)
        case 3 if arrays:
            content = bytearray(arrays)
            for _ in range(dice.randint(1, 20)):
                content[dice.randrange(len(content))] = dice.randrange(256)
            life = head + b"\n" + bytes(content)
        case 4:
            life = (
                json.dumps(
                    {"values": nested(dice.randint(30, 60)), "root": [0]}
                ).encode()
                + b"\n"
            )
        case _:
            document = json.loads(head)
            for _ in range(dice.randint(1, 3)):
                document = replaced(dice, document)
            life = json.dumps(document).encode() + b"\n" + arrays
    return json.dumps({key: len(life)}).encode() + b"\n" + life


def checkpoints(count: int, dice: random.Random, folder: Path) -> Tally:
    tally = Tally("checkpoints")
    images: list[bytes] = []
    undisturbed = lived(None, images.append)
    hooked()

    def resume(image: bytes) -> str:
        with watched():
            try:
                return (
                    "as undisturbed"
                    if lived(image) == undisturbed
                    else "from the numbers that stand there"
                )
            except (
                ValueError,
                TypeError,
                AttributeError,
                KeyError,
                IndexError,
                ArithmeticError,
            ) as error:
                return type(error).__name__

    for _ in range(count):
        image = mutated(dice, dice.choice(images))
        tally.attempt(repr(image), partial(resume, image))
    return tally


COLUMNS = {
    "runs": "id state owner size sha256 layout",
    "documents": "sizes digests summary scene reason",
    "layouts": "key layout",
    "keys": "name source kind unit quantity display_unit",
    "facts": "key run value",
}
CHANGES = (
    "value * 1.5",
    "value + 1e-9",
    "-value",
    "0",
    "NULL",
    "1e400",
    "CAST(value AS TEXT)",
    "zeroblob(9)",
)
ASKED = ("id", "life", "max_wear_depth", "verdict")


def told(store: Store) -> list[tuple[Any, ...]]:
    return sorted(tuple(row.values()) for row in store.query("", columns=ASKED))


def judged(store: Store, before: list[tuple[Any, ...]]) -> str:
    """Return what became of a catalogue that was changed.

    Another answer in silence is a fault.
    """
    try:
        answers = told(store)
        found = store.verify()
    except (StoreError, ValueError):
        return "refused"
    if answers != before and not found:
        raise AssertionError("another answer, and verify names nothing")
    if not found:
        return "no other answer"
    again = store.reindex()
    left = store.verify()
    if again or left or told(store) != before:
        raise AssertionError(f"reindex did not mend it: {again} {left}")
    return "named and mended"


def attacked(
    kind: str, count: int, folder: Path, change: Callable[[Path], str]
) -> Tally:
    """Change a catalogue again and again, each time anew, and judge each."""
    tally = Tally(kind)
    whole = filled(folder / "whole", sweep(4))
    before = told(whole)
    whole.close()
    for _ in range(count):
        shutil.rmtree(folder / "changed", ignore_errors=True)
        shutil.copytree(folder / "whole", folder / "changed")
        what = change(folder / "changed" / "catalogue.sqlite")
        with closing(Store(folder / "changed")) as store:
            tally.attempt(what, partial(judged, store, before))
    return tally


def facts(count: int, dice: random.Random, folder: Path) -> Tally:
    def change(path: Path) -> str:
        table = dice.choice(list(COLUMNS))
        column = dice.choice(COLUMNS[table].split())
        with (
            closing(sqlite3.connect(path, isolation_level=None)) as connection,
            suppress(sqlite3.Error),
        ):
            if table == "facts" and dice.random() < 0.7:
                statement = (
                    f"UPDATE facts SET value = {dice.choice(CHANGES)} WHERE "
                    "abs(random()) % 3 = 0"
                )
                connection.execute(statement)
            elif dice.random() < 0.3:
                statement = f"DELETE FROM {table} WHERE abs(random()) % 2 = 0"
                connection.execute(statement)
            else:
                statement = (
                    f"UPDATE {table} SET {column} = ? WHERE abs(random()) % 2 = 0"
                )
                connection.execute(statement, (dice.choice(VALUES),))
        return statement

    return attacked("facts", count, folder, change)


def bits(count: int, dice: random.Random, folder: Path) -> Tally:
    def change(path: Path) -> str:
        content = bytearray(path.read_bytes())
        bit = dice.randrange(8 * len(content))
        content[bit // 8] ^= 1 << bit % 8
        path.write_bytes(content)
        return f"bit {bit}"

    return attacked("bits", count, folder, change)


class Liar(SimpleHTTPRequestHandler):
    """Answers with a file's bytes as a die has them."""

    dice = random.Random(1)
    worst = 0.1

    def log_message(self, *words: Any) -> None:
        pass

    def do_GET(self) -> None:
        path = Path(self.translate_path(self.path))
        if not path.is_file():
            self.send_error(404)
            return
        content = bytearray(path.read_bytes())
        if self.dice.random() < self.worst and content:
            match self.dice.randrange(4):
                case 0:
                    del content[self.dice.randrange(len(content)) :]
                case 1:
                    content += bytes(self.dice.randrange(1, 3_000_000))
                case 2:
                    content[self.dice.randrange(len(content))] ^= (
                        1 << self.dice.randrange(8)
                    )
                case _:
                    content = bytearray(str(self.dice.choice(ODD)).encode())
        self.send_response(200)
        claimed = (
            len(content)
            if self.dice.random() < 0.9
            else self.dice.choice((0, 10**9, len(content) + 7))
        )
        self.send_header("Content-Length", str(claimed))
        self.end_headers()
        with suppress(OSError):
            self.wfile.write(content)

    do_HEAD = SimpleHTTPRequestHandler.do_HEAD


def answers(count: int, dice: random.Random, folder: Path) -> Tally:
    tally = Tally("answers")
    there = filled(folder / "there" / "store", sweep(3))
    before = told(there)
    ids = [case.id for case in sweep(3).cases]
    Liar.dice = dice
    server = ThreadingHTTPServer(
        ("127.0.0.1", 0), partial(Liar, directory=str(folder / "there"))
    )
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"http://127.0.0.1:{server.server_port}/store"

    def ask(run_id: str) -> str:
        try:
            with closing(open_store(address)) as here:
                assert told(here) == before, "another answer"
                np.testing.assert_array_equal(
                    here.run(run_id).wear_depth, there.run(run_id).wear_depth
                )
        except (StoreError, ValueError) as error:
            assert len(str(error)) < 3000, f"{len(str(error))} characters: {error}"
            return "refused"
        return "as it is there"

    for _ in range(count):
        tally.attempt(address, partial(ask, dice.choice(ids)))
    server.shutdown()
    server.server_close()
    return tally


KINDS = {"checkpoints": checkpoints, "facts": facts, "bits": bits, "answers": answers}


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
