"""Hashes of wearlab's sources and tables, without importing any.

A run bears the hash of the code that it used. What comes after a run (the store,
figures, commands) is no part of it, nor is `dynamics` of a run without ``[dynamics]``:
a run is of other code only when code that it used has changed.
"""

import hashlib
from collections.abc import Iterable
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parent
ROOMS_AFTER = (
    "gradients query campaign rexs store runner comparison updating figures report "
    "accuracy browsing cli"
)
AFTER = frozenset((*ROOMS_AFTER.split(), "__init__.py"))
"""Rooms that no run's numbers come from."""
DYNAMICS = "dynamics"
SHORT_ID = 10
"""Characters of a hash by which people know a run."""


@cache
def source_hash() -> str:
    """Return the hash of all of wearlab's sources and tables, 16 hexadecimal digits."""
    return hash_of(_sources())


def _sources() -> list[Path]:
    """Return all Python files and tables of the package, sorted."""
    return sorted(
        [
            *PACKAGE.rglob("*.py"),
            *PACKAGE.glob("*.toml"),
            *PACKAGE.glob("schema/*.toml"),
        ]
    )


def code_and_place() -> tuple[str, str]:
    """Return the hash of the sources of this process, and the folder they lie in."""
    return source_hash(), str(PACKAGE)


@cache
def used_hash(dynamics: bool) -> str:
    """Return the hash of the code that a run uses, 16 hexadecimal digits.

    Parameters
    ----------
    dynamics : whether its scene has ``[dynamics]``
    """
    left_out = AFTER if dynamics else AFTER | {DYNAMICS}
    return hash_of(
        file
        for file in _sources()
        if file.relative_to(PACKAGE).parts[0] not in left_out
    )


def present_hashes() -> tuple[str, ...]:
    """Return the hashes that runs of the present code bear."""
    return used_hash(True), used_hash(False)


def is_other_code(recorded: str | None) -> bool:
    """Return whether a run was made by code that has changed since.

    Parameters
    ----------
    recorded : the hash that the run bears; None: it bears none
    """
    return bool(recorded) and recorded not in present_hashes()


def hash_of(files: Iterable[Path]) -> str:
    """Return the hash of files by their names and bytes, 16 hexadecimal digits.

    Parameters
    ----------
    files : files of the package
    """
    digest = hashlib.sha256()
    for file in files:
        name = file.relative_to(PACKAGE).as_posix().encode()
        digest.update(name + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
