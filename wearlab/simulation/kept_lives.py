"""A life that many scenes are calibrated on: lived once on a machine, by whichever process needs it first."""

import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

import numba

from wearlab.sources import source_hash

FOLDER = Path(numba.config.CACHE_DIR) / "lives"  # type: ignore[attr-defined]
"""Beside the compiled code, whose lifetime it shares."""
PACKAGES = ("numba", "numpy", "scipy")

Life = tuple[float, float]
"""A life and its estimated error, both in cycles."""


def once(scene: str, live: Callable[[], Life]) -> Life:
    """Return a life, bit for bit the one that was lived first with these sources and packages.

    Processes that need the same life wait for each other; where nothing can be kept, each lives it.

    Parameters
    ----------
    scene : what lives, as canonical text
    live : lives it
    """
    code = [source_hash(), *(f"{name} {version(name)}" for name in PACKAGES)]
    path = FOLDER / hashlib.sha256("\0".join([scene, *code]).encode()).hexdigest()[:32]
    found = _read(path)
    if found is not None:
        return found
    with _alone(path.with_suffix(".lock")):
        found = _read(path)
        if found is None:
            found = live()
            _write(path, found)
    return found


def _read(path: Path) -> Life | None:
    """Return a kept life, None where there is none or only a part of one."""
    try:
        life, error = map(float.fromhex, path.read_text(encoding="ascii").split())
    except (OSError, ValueError):
        return None
    return life, error


def _write(path: Path, found: Life) -> None:
    part = path.with_suffix(".part")
    try:
        part.write_text(" ".join(value.hex() for value in found), encoding="ascii")
        part.replace(path)
    except OSError:
        pass  # an unwritable home: the next process lives it again


@contextmanager
def _alone(path: Path) -> Iterator[None]:
    """Hold a lock that ends with the process, where the system has any."""
    try:
        import fcntl

        path.parent.mkdir(parents=True, exist_ok=True)
        held = path.open("a")
    except (ImportError, OSError):
        yield
        return
    with held:
        try:
            fcntl.flock(held, fcntl.LOCK_EX)
        except OSError:
            pass  # a file system without locks
        yield
