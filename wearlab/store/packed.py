"""Texts of runs kept small: the scene of one run says what that of the next says, but for a few numbers.

What the catalogue keeps of a run as text is deflated, with the texts of an earlier run of the same kind of
scene as a dictionary: that leaves a tenth of them.
"""

import json
import sqlite3
import zlib
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from wearlab.query.flat import flat
from wearlab.store.memberships import key_of

MOST_DICTIONARIES = 500  # kinds of scenes of one catalogue; texts of further ones are deflated by themselves
LARGEST = 16_000_000  # bytes of the texts of one run
RAW = -15  # zlib's window, without head and checksum
BETWEEN = "\0"  # which no JSON holds


class Texts(NamedTuple):
    """What the catalogue keeps of a run as JSON."""

    sizes: str = ""
    digests: str = ""
    summary: str = ""
    scene: str = ""


class Packing:
    """Packs texts with the dictionaries of one catalogue; knows those it has met."""

    def __init__(self) -> None:
        self._contents: dict[int, bytes] = {}
        self._numbers: dict[str, int] = {}

    def clear(self) -> None:
        """Forget the dictionaries, where a transaction was given up."""
        self._contents.clear()
        self._numbers.clear()

    def pack(self, connection: sqlite3.Connection, texts: Sequence[str | None]) -> tuple[int, bytes]:
        """Return the number of a dictionary and the texts deflated with it, within a transaction."""
        whole = BETWEEN.join(text or "" for text in texts).encode()
        number = self._number(connection, texts[-1] or "", whole)
        deflate = zlib.compressobj(wbits=RAW, zdict=self._contents.get(number, b""))
        return number, deflate.compress(whole) + deflate.flush()

    def unpack(self, read: Callable[..., list[Any]], number: Any, packed: Any) -> Texts:
        """Return texts; empty ones of a run that is not finished.

        Parameters
        ----------
        read : asks the catalogue
        number, packed : as `pack` returned them

        Raises
        ------
        ValueError : no wearlab packed this
        """
        if packed is None:
            return Texts()
        if number and number not in self._contents:
            ((content,),) = read("SELECT content FROM dictionaries WHERE number = ?", (number,))
            self._contents[number] = content
        try:
            inflate = zlib.decompressobj(wbits=RAW, zdict=self._contents.get(number, b""))
            whole = inflate.decompress(packed, LARGEST)
        except (zlib.error, TypeError) as error:
            raise ValueError(f"its texts cannot be unpacked: {error}") from error
        if not inflate.eof:
            raise ValueError("its texts have no end")
        return Texts(*_parted(whole.decode()))

    def _number(self, connection: sqlite3.Connection, scene: str, whole: bytes) -> int:
        """Return the number of the dictionary for a kind of scene, made of its first run; 0: none."""
        kind = key_of(json.dumps([name for name, _ in flat(json.loads(scene or "{}"))]))
        if kind not in self._numbers:
            known = connection.execute(
                "SELECT number, content FROM dictionaries WHERE kind = ?", (kind,)
            ).fetchone()
            if known is None:
                ((count,),) = connection.execute("SELECT count(*) FROM dictionaries").fetchall()
                if count >= MOST_DICTIONARIES:
                    return 0
                known = connection.execute(
                    "INSERT INTO dictionaries (kind, content) VALUES (?, ?) RETURNING number, content",
                    (kind, whole),
                ).fetchone()
            self._numbers[kind], self._contents[known[0]] = known[0], known[1]
        return self._numbers[kind]


def _parted(whole: str) -> list[str]:
    parts = whole.split(BETWEEN)
    if len(parts) != len(Texts._fields):
        raise ValueError(f"{len(parts)} texts instead of {len(Texts._fields)}")
    return parts
