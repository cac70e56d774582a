"""The example of a cluster with SLURM.

``sbatch`` and ``scancel`` start and end jobs on this machine.
"""

import importlib.util
import os
import shlex
import sys
from pathlib import Path

import pytest
from scenes import TWO_TORQUES

pytest.importorskip("dask_jobqueue")


from wearlab.store import Store

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "slurm.py"
SBATCH = """#!/bin/sh
cp "$1" "$0.$$"  # which the sender removes
setsid bash "$0.$$" > "$0.$$.out" 2>&1 &
echo "Submitted batch job $!"
"""
SCANCEL = """#!/bin/sh
kill -- -"$1"
"""


@pytest.fixture
def example():
    """The script, as a module."""
    spec = importlib.util.spec_from_file_location("slurm_example", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_job_script_asks_slurm_for_what_is_told(example, tmp_path, capsys):
    asked = (
        "study.toml store --queue short --cores 8 --memory 16GB --walltime 01:30:00 "
        "--directive --exclusive"
    )
    assert (
        example.main(
            [*shlex.split(asked.replace("--directive ", "--directive=")), "--show"]
        )
        == 0
    )
    said = capsys.readouterr().out
    for line in (
        "-p short",
        "--cpus-per-task=8",
        "--mem=15G",
        "-t 01:30:00",
        "--exclusive",
    ):
        assert f"#SBATCH {line}\n" in said
    assert "--nworkers 8" in said and "--nthreads 1" in said
    assert said.index("export WEARLAB_CACHE=$HOME") < said.index("dask_worker")


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="jobs as POSIX has them")
def test_a_campaign_is_run_by_jobs(example, tmp_path, monkeypatch):
    for name, text in (("sbatch", SBATCH), ("scancel", SCANCEL)):
        (tmp_path / name).write_text(text)
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(path for path in sys.path if path))
    (tmp_path / "study.toml").write_text(TWO_TORQUES)
    words = [
        "study.toml",
        "store",
        "--cores",
        "1",
        "--memory",
        "4GB",
        "--jobs",
        "2",
        "--cache",
        "$WEARLAB_CACHE",
    ]
    monkeypatch.chdir(tmp_path)
    assert example.main(words) == 0
    entries = Store(tmp_path / "store").archive.entries()
    assert [entry.state for entry in entries.values()] == ["done", "done"]
