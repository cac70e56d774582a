"""What a call of ``run`` did, and whether cases came to what their campaign expects."""

from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

from wearlab.store import Store, StoreError, catalogue, outcome
from wearlab.units import convert

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.campaign import Campaign, Case, Expectation, ExpectedNumber


@dataclass(frozen=True)
class Expected:
    """One case with an expectation, and what became of it.

    Parameters
    ----------
    id, label, position : the run, its label, and the values that set it apart
    comparison : verdict, expected, measured, and whether they agree
    """

    id: str
    label: str
    position: dict[str, str]
    comparison: outcome.Comparison


def compare(
    expectation: "Expectation",
    case: "Case",
    store: Store,
    entry: catalogue.Entry | None,
) -> outcome.Comparison:
    """Return how a finished case compares with its expectation.

    Of a variable with several values, the one of largest magnitude counts (of complex
    ones the largest modulus); of the response period, the one farthest from the
    expected.

    Parameters
    ----------
    expectation : of the campaign
    case : whose run it is
    store : where the run is
    entry : the run as the catalogue has it, None: there is none
    """
    has_data = entry is not None and entry.state == "done"
    verdict: str = "not computed" if entry is None else entry.state
    if entry is not None and has_data:
        verdict = str(entry.summary.get("verdict") or "completed")
    checks: list[
        tuple[str, str, bool]
    ] = []  # what is wanted, what came, whether they agree
    if expectation.verdict is not None:
        checks.append((expectation.verdict, verdict, verdict == expectation.verdict))
    if (end := expectation.end_reason) is not None:
        reason = str((entry and entry.summary.get("end_reason")) or "none")
        checks.append(
            (f"end_reason = {end}", f"end_reason = {reason}", reason.startswith(end))
        )
    for name, value in expectation.values.items():
        measured = (
            _measured(store, entry, name, value)
            if entry is not None and has_data
            else None
        )
        near = measured is not None and bool(
            abs(measured - value.value) <= value.tolerance
        )
        checks.append(
            (f"{name} = {value.written}", f"{name} = {_shown(measured, value)}", near)
        )
    expected_text = ", ".join(expected_text for expected_text, _, _ in checks)
    measured_text = ", ".join(measured_text for _, measured_text, _ in checks)
    return outcome.Comparison(
        verdict, expected_text, measured_text, all(near for _, _, near in checks)
    )


def _measured(
    store: Store, entry: catalogue.Entry, name: str, expected: "ExpectedNumber"
) -> float | None:
    """Return the value that counts, in the stored unit.

    None when the run has no such numbers.
    """
    import numpy as np

    try:
        dataset = store.run(entry.id)
    except StoreError:
        return None
    if name not in dataset.variables or dataset[name].dtype.kind not in "fiub":
        return None
    variable = dataset[name].astype(float)
    if "part" in variable.dims:
        variable = (variable**2).sum("part", skipna=False) ** 0.5
    values = variable.values[np.isfinite(variable.values)]
    far = np.abs(values - (expected.value if name == "response_period" else 0.0))
    return float(values[np.argmax(far)]) if values.size else None


def _shown(measured: float | None, expected: "ExpectedNumber") -> str:
    if measured is None:
        return "absent"
    if expected.units is None:
        return f"{measured:.6g}"
    stored, written = expected.units
    return f"{convert(measured, stored, written):.6g} {written}"


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
        return outcome.last_line(self.reason)


MAX_LISTED_RUNS = 5
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
    store: Store | None = field(default=None, repr=False, compare=False)

    def __repr__(self) -> str:
        return f"<Report: {self.headline}>"

    def __str__(self) -> str:
        reasons = [
            f"{c.label}: {c.state}: {c.headline}"
            for c in self.troubled
            if c.state != "done"
        ]
        omitted = (
            [f"and {len(reasons) - MAX_LISTED_RUNS} more"]
            if len(reasons) > MAX_LISTED_RUNS
            else []
        )
        return "\n  ".join([self.headline, *reasons[:MAX_LISTED_RUNS], *omitted])

    @property
    def headline(self) -> str:
        """What became of the runs, in one line."""
        counts = [
            f"{n} {word}"
            for n, word in ((self.failed, "failed"), (self.refused, "refused"))
            if n
        ]
        done = f"{self.done} of {self.total} done"
        word = "tried" if counts else "computed"
        return (
            f"{', '.join([done, *counts])}; {self.computed} {word} in "
            f"{self.seconds:.1f} s"
        )

    def _repr_html_(self) -> str:
        from wearlab.store.table import table_html

        rows = [
            (case.id[:10], case.label, case.state, case.headline)
            for case in self.troubled
        ]
        table = table_html(("id", "case", "state", "reason"), rows) if rows else ""
        return f"<p><b>{self.headline}</b></p>{table}"

    def to_dict(self) -> dict[str, Any]:
        """Return counts, times and troubled cases as plain data."""
        fields = asdict(replace(self, campaign=None, store=None))
        return {
            name: value
            for name, value in fields.items()
            if name not in ("campaign", "store")
        }

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
        return all(case.comparison.met for case in self.expected) and not (
            without_data - foreseen or missing
        )
