import errno
import os
import signal
import subprocess
import sys

import pytest

from wearlab.store.locks import Presence, alive

HOLD = """
import sys, time
from pathlib import Path
from wearlab.store.locks import Presence
presence = Presence(Path(sys.argv[1]))
print(presence.token, flush=True)
time.sleep(60)
"""


def test_present_until_left(tmp_path):
    with Presence(tmp_path / "runners") as presence:
        assert alive(tmp_path / "runners", presence.token)
        assert alive(
            tmp_path / "runners", presence.token
        )  # looking does not break the lock
    assert not alive(tmp_path / "runners", presence.token)
    assert not any((tmp_path / "runners").iterdir())


def test_a_name_nobody_took(tmp_path):
    assert not alive(tmp_path, "nobody")


def test_a_killed_process_is_not_present(tmp_path):
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        token = child.stdout.readline().strip()
        assert alive(tmp_path, token)
        os.kill(child.pid, signal.SIGKILL)
        child.wait()
    assert not alive(tmp_path, token)
    assert not any(tmp_path.iterdir())  # what it left is cleared away


def test_a_file_system_without_locks_is_told_of(tmp_path, monkeypatch, caplog):
    with Presence(tmp_path):
        assert caplog.text == ""
    fcntl = pytest.importorskip("fcntl")
    monkeypatch.setattr(fcntl, "fcntl", lambda *arguments: 0)  # as some mounts answer
    with Presence(tmp_path):
        assert "keeps no locks: let one process at a time write here" in caplog.text
    caplog.clear()

    def refuse(*arguments):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "fcntl", refuse)
    with Presence(tmp_path):
        assert "keeps no locks" in caplog.text
