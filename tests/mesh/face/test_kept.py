"""Teeth kept on disk: found again bit by bit, made anew where a file
is not what was written.
"""

import os

import numpy as np
import pytest

from wearlab.mesh.finite_element import solid
from wearlab.mesh.finite_element.solid import kept_or_made


@pytest.fixture
def made(tmp_path, monkeypatch):
    """Return ``ask(given)`` and the list of what was made, with a folder of its own."""
    monkeypatch.setenv("WEARLAB_CACHE", str(tmp_path))
    calls = []

    def ask(given):
        def make():
            calls.append(given)
            random = np.random.default_rng(given)
            return random.normal(size=3), random.normal(size=(4, 3))

        return kept_or_made((given,), make)

    return ask, calls, tmp_path / "teeth"


def test_what_was_made_is_read_again_bit_by_bit(made):
    ask, calls, _ = made
    first = ask(1)
    again = ask(1)
    other = ask(2)
    assert calls == [1, 2]
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))
    assert not np.array_equal(first[0], other[0])


@pytest.mark.parametrize(
    "harm", ["cut", "changed", "no archive", "pickled", "flipped", "a pipe"]
)
def test_a_file_that_is_not_what_was_written_is_made_anew(made, harm):
    ask, calls, folder = made
    whole = ask(1)
    (file,) = folder.iterdir()
    content = file.read_bytes()
    if harm == "cut":
        file.write_bytes(content[: len(content) // 2])
    elif harm == "flipped":  # how the archive says that its first part is packed
        file.write_bytes(content[:8] + bytes([content[8] ^ 1]) + content[9:])
    elif harm == "a pipe":
        file.unlink()
        os.mkfifo(file)
    elif harm == "no archive":
        file.write_bytes(b"")
    elif harm == "pickled":
        np.savez(
            file,
            first=np.array([object()]),
            second=whole[1],
            digest=np.zeros(32, np.uint8),
        )
    else:
        with np.load(file) as arrays:
            parts = dict(arrays)
        parts["second"][0, 0] += 1e-3
        np.savez(file, **parts)
    again = ask(1)
    assert calls == [1, 1]
    assert all(np.array_equal(a, b) for a, b in zip(whole, again, strict=True))
    ask(1)
    assert calls == [1, 1]
    assert [one.name for one in folder.iterdir()] == [file.name]


def test_those_used_last_are_kept(made, monkeypatch):
    ask, calls, folder = made
    ask(1)
    monkeypatch.setattr(
        solid, "KEPT_BYTES", 2.5 * next(folder.iterdir()).stat().st_size
    )
    ask(2)
    ask(1)
    ask(3)
    assert len(list(folder.iterdir())) == 2
    ask(1)
    assert calls == [1, 2, 3]


def test_a_folder_that_cannot_be_written_keeps_none(made, tmp_path):
    ask, calls, folder = made
    folder.touch()
    ask(1)
    ask(1)
    assert calls == [1, 1]
