"""What a call of ``run`` did."""

from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

from wearlab.store.outcome import last_line

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.campaign import Campaign
    from wearlab.runner.expectation import Expected
    from wearlab.store import Store


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
        return last_line(self.reason)


MOST_TOLD = 5
"""Cases without data whose reasons are printed."""


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
    campaign, store : whose runs these are, and where they are kept
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
    campaign: "Campaign | None" = field(default=None, repr=False, compare=False)
    store: "Store | None" = field(default=None, repr=False, compare=False)

    def __repr__(self) -> str:
        return f"<Report: {self.headline}>"

    def __str__(self) -> str:
        told = [
            f"{outcome.label}: {outcome.state}: {outcome.headline}"
            for outcome in self.troubled
            if outcome.state != "done"
        ]
        more = [f"and {len(told) - MOST_TOLD} more"] if len(told) > MOST_TOLD else []
        return "\n  ".join([self.headline, *told[:MOST_TOLD], *more])

    @property
    def headline(self) -> str:
        """What became of the runs, in one line."""
        counts = [f"{n} {word}" for n, word in ((self.failed, "failed"), (self.refused, "refused")) if n]
        done = f"{self.done} of {self.total} done"
        word = "tried" if counts else "computed"
        return f"{', '.join([done, *counts])}; {self.computed} {word} in {self.seconds:.1f} s"

    def _repr_html_(self) -> str:
        from wearlab.store.table import table_html

        rows = [
            (outcome.id[:10], outcome.label, outcome.state, outcome.headline) for outcome in self.troubled
        ]
        table = table_html(("id", "case", "state", "reason"), rows) if rows else ""
        return f"<p><b>{self.headline}</b></p>{table}"

    def to_dict(self) -> dict[str, Any]:
        """Return counts, times and troubled cases as plain data."""
        told = asdict(replace(self, campaign=None, store=None))
        return {key: value for key, value in told.items() if key not in ("campaign", "store")}

    def to_xarray(self, *, si: bool = False) -> "xr.Dataset":
        """Return the runs as one lazy dataset, as `Store.open` does.

        Parameters
        ----------
        si : sweep axes in SI units instead of those of the file

        Raises
        ------
        StoreError : there is no store any more
        """
        if self.store is None or self.campaign is None:
            raise ValueError("this report does not know its store")
        return self.store.open(self.campaign, si=si)

    @property
    def ok(self) -> bool:
        """Whether every expectation is met, and every run without one is done."""
        foreseen = {case.id for case in self.expected}
        without_data = {case.id for case in self.troubled if case.state != "done"}
        missing = self.total - self.done - len(without_data)
        return all(case.comparison.met for case in self.expected) and not (without_data - foreseen or missing)
