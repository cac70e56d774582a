"""What work takes of the processor, whatever else runs on the machine.

And work that may take no more.
"""

import math
import resource
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

REPEATS = 4


class OutOfTime(BaseException):
    """The processor was used for as long as allowed: like an interruption, nothing on
    the way catches it.
    """


def limit_work(longest: float) -> None:
    """Let this process use the processor for so long from now on, before the system
    tells it to end [s].
    """
    used = resource.getrusage(resource.RUSAGE_SELF)
    _, most = resource.getrlimit(resource.RLIMIT_CPU)
    soft = (
        math.ceil(used.ru_utime + used.ru_stime + longest)
        if math.isfinite(longest)
        else most
    )
    resource.setrlimit(resource.RLIMIT_CPU, (soft, most))


@contextmanager
def bounded(longest: float) -> Iterator[None]:
    """Raise `OutOfTime` inside once it has used the processor for so long [s].

    In the main thread alone. What compiled code makes of it, a `SystemError`, is told
    as `OutOfTime` too.
    """
    if not math.isfinite(longest):
        yield
        return

    is_late = False

    def late(number: int, frame: FrameType | None) -> None:
        nonlocal is_late
        is_late = True
        raise OutOfTime

    before = signal.signal(signal.SIGXCPU, late)
    try:
        limit_work(longest)
        yield
        if is_late:  # caught on the way
            raise OutOfTime
    except SystemError as error:
        if not is_late:
            raise
        raise OutOfTime from error
    finally:
        limit_work(math.inf)
        signal.signal(signal.SIGXCPU, before)


def least(work: Callable[[], object]) -> float:
    """Return the least processor time of several repeats, after one
    that warms up [s].
    """
    work()
    times = []
    for _ in range(REPEATS):
        begun = time.process_time()
        work()
        times.append(time.process_time() - begun)
    return min(times)
