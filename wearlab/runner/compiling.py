"""Compiling ahead of the first run: what campaigns will call, on all cores."""

import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from wearlab.runner.local import local_client

if TYPE_CHECKING:
    from wearlab.campaign import Campaign
    from wearlab.simulation.warm import Job


def compile_ahead(
    campaigns: "Sequence[Campaign]",
    workers: int | None = None,
    begin: Callable[[int], Callable[[str], None]] | None = None,
) -> tuple[int, float]:
    """Compile what the runs of campaigns will call, and keep it on disk.

    Parameters
    ----------
    campaigns : whose runs are to come
    workers : number of worker processes [the cores of this machine]
    begin : is told how many steps there are, and returns what is told the name of each one done

    Returns
    -------
    kinds of scenes, none of which calls the kernels of another; seconds by the clock [s]
    """
    from dask.distributed import as_completed

    from wearlab.simulation.warm import jobs_of, kinds_of

    clock = time.perf_counter()
    named = {id(case.scene): case.label for campaign in campaigns for case in campaign.cases}
    kinds = kinds_of(case.scene for campaign in campaigns for case in campaign.cases)
    jobs = jobs_of(kinds)
    told = begin(len(jobs)) if begin else lambda name: None
    with local_client(workers, dashboard=False) as client:
        futures = {client.submit(_done, job, pure=False, priority=-n): job for n, job in enumerate(jobs)}
        for future in as_completed(futures):
            future.result()
            told(named[id(futures[future][1])])
    return len(kinds), time.perf_counter() - clock


def _done(job: "Job") -> None:
    """Do a job in a worker; its errors are left to the runs themselves, which report them."""
    from wearlab.simulation.warm import do

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            do(job)
    except Exception:
        traceback.print_exc()
