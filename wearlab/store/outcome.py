"""What one case became: a finished file image, a refusal, or a failure."""

from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

State = Literal["running", "done", "failed", "refused"]


def last_line(reason: str | None) -> str:
    """Return what went wrong from a reason that may be a traceback: its last line."""
    return (reason or "").strip().rpartition("\n")[2]


class Comparison(NamedTuple):
    """What a case came to, beside what its campaign expects.

    Parameters
    ----------
    verdict : the verdict of the run, or its state when it gave no data
    expected, measured : both in words
    met : whether they agree
    """

    verdict: str
    expected: str
    measured: str
    met: bool


@dataclass(frozen=True)
class Outcome:
    """One computed case, small enough to travel between processes.

    Parameters
    ----------
    id : the run's identity
    state : done, failed or refused
    started : UTC start in ISO form
    seconds : wall time of simulation and serialisation [s]
    scene : the scene as canonical JSON
    image, sha256 : the finished netCDF file and its hash, when done
    sizes, layout : lengths of the dimensions; variables with dims, dtypes and attributes as JSON
    digests : hash of each coordinate's values, to see which coordinates runs share
    summary : scalar results (life, max wear, error estimates …)
    histories : values along the life by variable, and the cycles they belong to; float64
    reason : traceback of a failure, reason of a refusal
    warnings : distinct warnings raised on the way
    source_hash, wearlab_version : the code that ran
    """

    id: str
    state: State
    started: str
    seconds: float
    scene: str
    image: bytes | None = field(default=None, repr=False)
    sha256: str | None = None
    sizes: dict[str, int] = field(default_factory=dict)
    layout: str | None = field(default=None, repr=False)
    digests: dict[str, str] = field(default_factory=dict)
    summary: dict[str, Any] = field(default_factory=dict)
    histories: dict[str, bytes] = field(default_factory=dict, repr=False)
    reason: str | None = None
    warnings: tuple[str, ...] = ()
    source_hash: str = ""
    wearlab_version: str = ""
