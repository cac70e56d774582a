"""Campaigns whose processes are killed, and what must be true of
their stores afterwards.
"""

import os
import random
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import fake_campaign
import psutil

from wearlab.store import Store
from wearlab.store.netcdf import SEAL, is_intact

SCRIPT = Path(__file__).parent / "run_fake.py"
PATIENCE = 120.0


def begin(store, count, log="-", **options):
    """Run a fake campaign in a process of its own."""
    words = [f"{name}={value}" for name, value in options.items()]
    command = [
        sys.executable,
        "-W",
        "error::UserWarning:__main__",
        SCRIPT,
        store,
        count,
        log,
        "-",
        *words,
    ]
    return subprocess.Popen(
        list(map(str, command)),
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )


def finish(child):
    """Return exit status and last line of a run."""
    output, _ = child.communicate(timeout=PATIENCE)
    return child.returncode, (output.strip().splitlines() or [""])[-1]


def done(path):
    """Return the seals of finished runs.

    Every file is what was sealed, and nothing is amiss.
    """
    if not (Path(path) / "catalogue.sqlite").exists():
        return {}
    store = Store(path)
    try:
        try:
            problems = store.verify()
        except Exception as error:
            assert "not a catalogue" in str(error), (
                error
            )  # killed while the first table was made
            return {}
        assert problems == []
        ids = [
            run_id
            for run_id, entry in store.archive.entries().items()
            if entry.state == "done"
        ]
        runs = {run_id: store.run(run_id) for run_id in ids}
        assert all(is_intact(run) for run in runs.values())
        return {run_id: run.attrs[SEAL] for run_id, run in runs.items()}
    finally:
        store.close()


def kill_parent(folder, count, phase, at, **options):
    """Run a campaign that dies at a phase.

    Return the phase logged, and the seals of what was finished.
    """
    log = Path(folder).with_suffix(".phases")
    log.unlink(missing_ok=True)
    status, _ = finish(begin(folder, count, die=f"{phase}:{at}", phases=log, **options))
    hit = log.read_text().strip() if log.exists() else "completed before"
    assert (status == -signal.SIGKILL) == (hit == phase), (status, hit)
    return hit, done(folder)


def kill_workers(folder, count, kills, seed):
    """Kill workers of one campaign at random moments.

    Return for each kill how many cases had begun.
    """
    dice = random.Random(seed)
    log = Path(folder).with_suffix(".log")
    moments = []
    child = begin(folder, count, log, act="slow")
    while child.poll() is None and len(moments) < kills:
        lines = log.read_text().splitlines() if log.exists() else []
        if lines:
            time.sleep(dice.uniform(0.0, 0.15))
            try:
                os.kill(int(lines[-1].split()[1]), signal.SIGKILL)
                moments.append(len(lines))
            except ProcessLookupError:
                pass
        time.sleep(dice.uniform(0.05, 0.6))
    return moments, finish(child)


def kill_starting(folder, count, kills, after=0.0, **options):
    """Kill worker processes so many seconds after they came.

    Return how many were, status and last line.
    """
    child = begin(folder, count, **options)
    parent = psutil.Process(child.pid)
    came = {}
    killed = set()
    while child.poll() is None:
        with suppress(psutil.Error):
            for one in parent.children(recursive=True):
                if one.ppid() == child.pid:
                    continue  # the process that workers are forked from
                since = time.monotonic() - came.setdefault(one.pid, time.monotonic())
                if since >= after and one.pid not in killed and len(killed) < kills:
                    killed.add(one.pid)
                    one.kill()
        time.sleep(0.005)
    return len(killed), finish(child)


def reference(folder, count, log="-", **options):
    """Return the seals of an undisturbed campaign; its log is part of its scenes."""
    status, said = finish(begin(folder, count, log, **options))
    assert (status, said) == (0, f"computed {count} of {count}")
    seals = done(folder)
    assert len(seals) == count == len(fake_campaign.sweep(count).cases)
    return seals
