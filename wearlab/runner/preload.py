"""What worker processes need, imported once.

Workers are forked from the process that imported this.

Importing what is only found out to be wanted on first use (the array types that xarray
looks for) is a good part of a worker's start. No thread is begun here and no file is
left open, so that forking is safe.
"""

import gc
import importlib
import signal
from contextlib import suppress

from wearlab.sources import source_hash

signal.signal(
    signal.SIGINT, signal.SIG_IGN
)  # an interrupted parent sees to its workers

for name in (
    "distributed",
    "distributed.nanny",
    "wearlab.simulation",
    "netCDF4",
    "dask.array",
    "pint",
):
    with suppress(ImportError):  # is told where it is wanted
        importlib.import_module(name)

source_hash()  # remembered by every worker

gc.collect()
gc.freeze()  # pages that no collection touches stay shared: 35 MB less in every worker
