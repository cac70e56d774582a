"""A nanny of dask's that does not wait for her worker to say goodbye."""

import os
import signal
from contextlib import suppress

from distributed import Nanny
from distributed.core import Status

GOING = (Status.closing, Status.closed, Status.closing_gracefully, Status.failed)
ATTEMPTS = 4  # to start a worker process that is killed before it has begun


class SwiftNanny(Nanny):
    """Watches over one worker process and, when all work is done, ends it at once.

    A worker holds nothing that is not in the store by then; its own way out takes a second. One that is
    killed while it starts is started again, where dask's nanny would give up, and the whole cluster with her.
    """

    async def instantiate(self) -> Status:
        """Start the worker process, again when it ended before it was up."""
        for _ in range(ATTEMPTS - 1):
            status = await super().instantiate()
            if status == Status.running or self.status in GOING:
                return status
        return await super().instantiate()

    async def kill(self, timeout: float = 5, reason: str = "nanny-kill") -> None:
        """End the worker process; a replacement that never began has none."""
        worker = self.process
        if worker is not None and worker.status == Status.starting:
            await worker.running.wait()
        if worker is not None and worker.process is not None and worker.process.pid is None:
            return
        if self.status == Status.closing and self.pid is not None:
            with suppress(ProcessLookupError):
                os.kill(self.pid, getattr(signal, "SIGKILL", signal.SIGTERM))
        await super().kill(timeout=timeout, reason=reason)
