"""Compiling ahead of the first run: what campaigns will call, on all cores."""

import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from wearlab.runner.local import local_client
from wearlab.runner.worker import SIMULATE, warm_up

if TYPE_CHECKING:
    from wearlab.campaign import Campaign

HALVES = 2
"""Parts in which what one kind of scene calls is compiled, see `wearlab.simulation.warm.warm_up`."""


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

    from wearlab.simulation.warm import kinds_of

    clock = time.perf_counter()
    named = {id(case.scene): case.label for campaign in campaigns for case in campaign.cases}
    kinds = kinds_of(case.scene for campaign in campaigns for case in campaign.cases)
    told = begin(HALVES * len(kinds)) if begin else lambda name: None
    with local_client(workers, dashboard=False) as client:
        flight = {
            client.submit(warm_up, [scene], SIMULATE, half, HALVES, pure=False, priority=-place): scene
            for place, scene in enumerate(kinds)
            for half in range(HALVES)
        }
        for future in as_completed(list(flight)):
            told(named[id(flight[future])])
    return len(kinds), time.perf_counter() - clock
