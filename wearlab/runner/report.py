"""What a call of ``run`` did."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wearlab.runner.expectation import Expected


class RunnerError(Exception):
    """The work cannot be given to anybody: no scheduler answers, or it went away."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C: finished runs are kept, those in flight are forgotten."""


@dataclass(frozen=True)
class CaseReport:
    """A case that gave no data, or that gave warnings.

    Parameters
    ----------
    id, label : the run and what the campaign calls it
    state : done, failed or refused
    reason : the traceback of a failure, the reason of a refusal
    warnings : distinct warnings raised while it ran
    """

    id: str
    label: str
    state: str
    reason: str | None = None
    warnings: tuple[str, ...] = ()

    @property
    def headline(self) -> str:
        """The last line of the reason: what went wrong, without the traceback."""
        return (self.reason or "").strip().rpartition("\n")[2]


@dataclass(frozen=True)
class Report:
    """The state of a campaign's runs after ``run``.

    Parameters
    ----------
    total : distinct runs of the campaign
    computed : runs computed by this call
    done, failed, refused : states of all runs of the campaign, earlier calls included
    seconds : wall time of this call [s]
    troubled : the failed, the refused, and those computed with warnings
    expected : the cases with an expectation, and what became of them
    notes : what else is to be known: workers refused, a catalogue made anew
    """

    total: int
    computed: int
    done: int
    failed: int
    refused: int
    seconds: float
    troubled: tuple[CaseReport, ...] = ()
    expected: "tuple[Expected, ...]" = ()
    notes: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether every expectation is met, and every run without one is done."""
        foreseen = {case.id for case in self.expected}
        without_data = {case.id for case in self.troubled if case.state != "done"}
        missing = self.total - self.done - len(without_data)
        return all(case.comparison.met for case in self.expected) and not (without_data - foreseen or missing)
