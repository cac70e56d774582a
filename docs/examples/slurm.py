"""Run a campaign on a cluster with SLURM: ``python slurm.py study.toml STORE --queue normal --jobs 20``.

Needs ``pip install wearlab dask-jobqueue``, the same on every node. Start it where jobs
can be sent from, in ``tmux`` or as a small job: it is the parent, which alone writes
the store. Jobs come and go with the work; one that is preempted or reaches its walltime
costs what its cases had computed since they last told of it. ``--show`` prints what
would be handed to ``sbatch``.
"""

import argparse
import sys

from dask_jobqueue import SLURMCluster

import wearlab


def cluster(asked: argparse.Namespace) -> SLURMCluster:
    """Return a cluster without jobs: one worker process a core, each with a thread and its share of the memory."""
    return SLURMCluster(
        queue=asked.queue,
        cores=asked.cores,
        processes=asked.cores,
        memory=asked.memory,
        walltime=asked.walltime,
        local_directory="$TMPDIR",
        job_script_prologue=[
            "export OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1",
            # compiled code: once for all nodes of a kind
            f"export WEARLAB_CACHE={asked.cache}",
        ],
        job_extra_directives=asked.directive,
    )


def options(words: list[str]) -> argparse.Namespace:
    """Return what is asked for on the command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("file", help="campaign file")
    parser.add_argument("store", help="folder of the results, on this machine")
    parser.add_argument("--queue", help="partition of the cluster")
    parser.add_argument("--cores", type=int, default=16, help="cores of one job")
    parser.add_argument("--memory", default="64GB", help="memory of one job")
    parser.add_argument(
        "--walltime", default="04:00:00", help="of one job; lives go on in the next"
    )
    parser.add_argument("--jobs", type=int, default=4, help="most jobs at once")
    parser.add_argument(
        "--cache",
        default="$HOME/.cache/wearlab",
        help="folder of compiled code on the nodes",
    )
    parser.add_argument(
        "--directive", action="append", default=[], help="a further #SBATCH line"
    )
    parser.add_argument(
        "--show", action="store_true", help="print the job script and end"
    )
    return parser.parse_args(words)


def main(words: list[str]) -> int:
    """Run the campaign; return 0 when every case is done."""
    asked = options(words)
    with cluster(asked) as jobs:
        if asked.show:
            print(jobs.job_script())
            return 0
        jobs.adapt(minimum_jobs=1, maximum_jobs=asked.jobs)
        report = wearlab.run(asked.file, asked.store, scheduler=jobs.scheduler_address)
    print(f"{report.done} of {report.total} done, {report.computed} computed")
    return 0 if report.ok else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
