"""Whether cases came to what their campaign expects: verdict and measured values against ``[expect]``."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from wearlab.store.errors import StoreError
from wearlab.store.outcome import Comparison
from wearlab.units import convert

if TYPE_CHECKING:
    from wearlab.campaign import Campaign, Case, Expectation, Wanted
    from wearlab.store import Store
    from wearlab.store.catalogue import Entry

COMPLETED = "completed"


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
    comparison: Comparison


def comparisons(
    campaign: "Campaign", store: "Store", entries: "dict[str, Entry]"
) -> Iterator[Comparison | None]:
    """Yield for every case how it compares with its expectation, None where it has none."""
    for case in campaign.cases:
        expectation = getattr(case, "expect", None)
        yield None if expectation is None else compare(expectation, case, store, entries.get(case.id))


def compare(expectation: "Expectation", case: "Case", store: "Store", entry: "Entry | None") -> Comparison:
    """Return how a finished case compares with its expectation.

    Of a variable with several values, the one of largest magnitude counts (of complex ones the largest
    modulus); of the response period, the one farthest from the expected.
    """
    verdict = _verdict(entry)
    wanted, checks, met = [], [], True
    if expectation.verdict is not None:
        wanted.append(expectation.verdict)
        checks.append(verdict)
        met = verdict == expectation.verdict
    if expectation.end_reason is not None:
        reason = str((entry and entry.summary.get("end_reason")) or "none")
        wanted.append(f"end_reason = {expectation.end_reason}")
        checks.append(f"end_reason = {reason}")
        met = met and reason.startswith(expectation.end_reason)
    for name, value in expectation.values.items():
        measured = None if entry is None or entry.state != "done" else _measured(store, entry, name, value)
        wanted.append(f"{name} = {value.written}")
        checks.append(f"{name} = {_shown(measured, value)}")
        met = met and measured is not None and bool(abs(measured - value.value) <= value.tolerance)
    return Comparison(verdict, ", ".join(wanted), ", ".join(checks), met)


def _verdict(entry: "Entry | None") -> str:
    if entry is None:
        return "not computed"
    return str(entry.summary.get("verdict") or COMPLETED) if entry.state == "done" else entry.state


def _measured(store: "Store", entry: "Entry", name: str, wanted: "Wanted") -> float | None:
    """Return the value that counts, in the stored unit; None when the run has no such numbers."""
    import numpy as np

    try:
        dataset = store.run(entry.id)
    except StoreError:
        return None
    if name not in dataset.variables or dataset[name].dtype.kind not in "fiub":
        return None
    variable = dataset[name]
    values = np.asarray(variable.values, float)
    if "part" in variable.dims:
        values = np.sqrt((np.moveaxis(values, variable.dims.index("part"), -1) ** 2).sum(axis=-1))
    values = values[np.isfinite(values)]
    if not values.size:
        return None
    far = np.abs(values - wanted.value) if name == "response_period" else np.abs(values)
    return float(values.ravel()[np.argmax(far)])


def _shown(measured: float | None, wanted: "Wanted") -> str:
    if measured is None:
        return "absent"
    if wanted.units is None:
        return f"{measured:.6g}"
    stored, written = wanted.units
    return f"{convert(measured, stored, written):.6g} {written}"
