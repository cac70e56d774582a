"""The outcome of one case, in full and in a few words, and its place."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from wearlab.units import HOUR

if TYPE_CHECKING:
    from wearlab.campaign import Campaign, Case

State = Literal["running", "done", "failed", "refused", "interrupted"]
"""Of a run; a catalogue calls interrupted runs running, and a store knows whether their
process is."""


HIDDEN = [*range(32), *range(127, 160), *range(0x202A, 0x202F), *range(0x2066, 0x206A)]
"""Control characters, and those that turn the direction of what follows."""
ESCAPES = {code: f"\\u{code:04x}" for code in HIDDEN if chr(code) not in ("\n", "\t")}


def printable(text: str) -> str:
    r"""Return a text that cannot steer a terminal: its control characters as escapes.

    Titles and labels may come from a stranger's store.

    Parameters
    ----------
    text : of one or more lines

    >>> print(printable("a title" + chr(27) + "[2J"))
    a title\u001b[2J
    """
    return text.translate(ESCAPES)


def last_line(reason: str | None) -> str:
    """Return what went wrong from a reason that may be a traceback: its last line.

    Parameters
    ----------
    reason : a sentence or a traceback, None: there is none
    """
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
    sizes, layout : lengths of the dimensions; variables with dims, dtypes and
        attributes as JSON
    digests : hash of each coordinate's values, to see which coordinates runs share
    summary : scalar results (life, max wear, error estimates …)
    histories : values along the life by variable, and the cycles they belong to;
        float64
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


def place(campaign: "Campaign", case: "Case") -> dict[str, str]:
    """Return the case's value on every axis it stands on.

    With the unit that the file wrote.

    Parameters
    ----------
    campaign : with the axes
    case : one of its cases
    """
    axes = {axis.name: axis for axis in campaign.axes}
    return {
        name: value_text(axes[name].values[i], axes[name].units)
        for name, i in case.position.items()
    }


def value_text(value: object, units: str | None) -> str:
    """Return a value with its unit, without needless digits.

    Parameters
    ----------
    value : a number or a text
    units : of it, None: it has none
    """
    number = f"{value:.12g}" if isinstance(value, float) else str(value)
    return f"{number} {units}" if units else number


CALIBRATION, CALIBRATION_LIFE = "calibration", "calibration_life"
"""Attributes of a run: the id of the run by which its wear coefficient was calibrated,
and its life."""


class Headline(NamedTuple):
    """One number of a run.

    Parameters
    ----------
    text : with its unit and what it is
    short : with its unit alone, or what it is where that is not plain
    of : what its error is an error of
    error : estimated numerical error, relative to it; None where there is no estimate
    """

    text: str
    short: str
    of: str
    error: float | None

    @property
    def margin(self) -> str:
        """The estimated numerical error, "" without one."""
        return "" if self.error is None else f"± {100 * self.error:.2g} %"

    @property
    def with_error(self) -> str:
        """The text with its estimated numerical error, where there is one."""
        return (
            f"{self.text} ({self.margin} of the {self.of})"
            if self.margin
            else self.text
        )


class _Kind(NamedTuple):
    name: str
    scale: float
    text: str
    short: str
    of: str
    error: str
    hours: str = ""


LIFE = _Kind(
    "life",
    1.0,
    "cycles of life",
    "cycles",
    "life",
    "error_estimate_life",
    "service_life",
)
WEAR = _Kind(
    "max_wear_depth",
    1e6,
    "µm worn",
    "µm",
    "wear",
    "error_estimate_wear_depth",
    "operating_hours",
)
ERROR = "error_estimate_mesh_force_max"
FORCE = _Kind(
    "mesh_force_max", 1.0, "N largest mesh force", "N in mesh", "force", ERROR
)
STE = _Kind("ste_peak_to_peak", 1e6, "µm range of STE", "µm STE", "STE", "")

WORST = "N largest mesh force of the worst other attractor found"
RIVAL = _Kind("coexisting_force_max", 1.0, WORST, "N in another attractor", "force", "")


AS_ASKED = ("cycles", "depth")
"""Ends of a life that a scene asks for."""
NO_WEAR = "no wear"


def unasked_end(summary: Mapping[str, Any]) -> str:
    """Return how a life ended that ended otherwise than asked; nothing of any other.

    Parameters
    ----------
    summary : results by name, as the catalogue has them
    """
    reason = str(summary.get("end_reason") or "")
    if not reason or reason in AS_ASKED:
        return ""
    if reason == NO_WEAR:
        return (
            "no wear: nothing wears off these flanks; look at the coefficient, its "
            "film and its factor"
        )
    return f"the life ended before its limit: {reason}"


def headlines(summary: Mapping[str, Any]) -> list[Headline]:
    """Return what a run came to, the most telling first.

    Parameters
    ----------
    summary : results by name, SI, as the catalogue has them; a run whose last ``cycle``
        is 0 wears nothing
    """
    kinds = (FORCE, STE, WEAR) if summary.get("cycle") == 0.0 else (LIFE, WEAR)
    numbers = [
        _headline(kind, summary)
        for kind in (*kinds, RIVAL)
        if summary.get(kind.name) is not None
    ]
    end = unasked_end(summary)
    if not end:
        return numbers
    if summary["end_reason"] == NO_WEAR:
        return [Headline(end, NO_WEAR, "", None), *numbers]
    return [*numbers, Headline(end, f"ended: {summary['end_reason']}", "", None)]


def _headline(kind: _Kind, summary: Mapping[str, Any]) -> Headline:
    value = summary[kind.name]
    error = summary.get(kind.error)
    number = f"{value * kind.scale:.4g}"
    relative = error / value if error is not None and value else None
    hours = hours_text(summary.get(kind.hours))
    tail = (
        f"{' = ' if kind.hours == 'service_life' else ' after '}{hours}"
        if hours
        else ""
    )
    return Headline(
        f"{number} {kind.text}{tail}", f"{number} {kind.short}{tail}", kind.of, relative
    )


def seconds_text(seconds: float | None) -> str:
    """Return a duration for people, "" for none.

    Parameters
    ----------
    seconds : a duration [s]
    """
    if seconds is None:
        return ""
    if seconds < 1.0:
        return f"{1000 * seconds:.0f} ms"
    if seconds < 100.0:
        return f"{seconds:.1f} s"
    return f"{seconds / 60:.1f} min" if seconds < 6000.0 else f"{seconds / 3600:.1f} h"


def hours_text(seconds: float | None) -> str:
    """Return an operating time in hours, three digits of it.

    Nothing where there is none.

    Parameters
    ----------
    seconds : an operating time [s]
    """
    if not seconds:
        return ""
    hours = float(f"{seconds / HOUR:.3g}")
    return f"{hours:,.0f} h" if hours >= 1000.0 else f"{hours:g} h"
