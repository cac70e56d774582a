"""Updates are kept as runs are: under the identity of all that they depend on, and sealed."""

import hashlib
import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearlab.campaign import Campaign
from wearlab.sources import hash_of
from wearlab.updating.study import MeasuredCase, studies

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.store import Store
    from wearlab.updating.outcome import UpdateOutcome

FORMAT = 1


def identity(about: str, *, replay: bool, check: int) -> str:
    """Return the identity of an update: what it is of (`subject`), how it was asked for, this room's code."""
    return _hash([FORMAT, code(), replay, check, about])


def subject(wanted: Sequence[MeasuredCase]) -> str:
    """Return the identity of what an update is of: its runs, the files' contents, its words.

    A campaign's title is none of it: what is kept belongs to whatever asks the same, and to nothing else.
    """
    parts: list[Any] = []
    for study in wanted:
        spec = study.spec
        parts += [study.label, [scene.id for scene in study.scenes(1)], repr(study.limit)]
        parts += [
            spec.discrepancy,
            spec.draws,
            spec.seed,
            sorted((k, repr(v)) for k, v in spec.unknown.items()),
            repr(spec.days),
        ]
        for seen in study.seen:
            data = seen.data
            parts += [data.quantity, data.where, data.columns.model_dump(), sorted(data.units.items())]
            parts += [repr(data.error), sorted(data.select.items()), data.since, seen.fingerprint]
    return _hash(parts)


def subject_of(campaign: Campaign) -> str:
    """Return the identity of what a campaign's update would be of, as its files stand now.

    Raises
    ------
    UpdateError : it has no [update], or a file cannot be read
    """
    return subject(studies(campaign))


def _hash(parts: list[Any]) -> str:
    text = json.dumps(parts, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:20]


@cache
def code() -> str:
    """Return the hash of the sources of this room."""
    return hash_of(sorted(Path(__file__).parent.glob("*.py")))


def kept(wanted: Sequence[MeasuredCase], store: "Store", *, replay: bool, check: int) -> "xr.DataTree | None":
    """Return the update when it was made before, None otherwise."""
    from wearlab.store.updates import read_update

    return read_update(store, identity(subject(wanted), replay=replay, check=check))


def keep(
    store: "Store",
    tree: "xr.DataTree",
    outcomes: "Sequence[UpdateOutcome]",
    title: str,
    *,
    name: str,
    about: str,
) -> "xr.DataTree":
    """Write an update into the store; return it with its identity and seal.

    Parameters
    ----------
    store : where it is kept
    tree, outcomes : the update, and what it was made of
    title : of the campaign
    name, about : identity of the update, and of what it is of
    """
    from wearlab.store.seal import SEAL
    from wearlab.store.updates import keep_update, seal_of

    runs = list(dict.fromkeys(run.id for outcome in outcomes for run in outcome.posterior.histories))
    summary = {outcome.study.label: _summary(outcome) for outcome in outcomes}
    tree.attrs |= {"id": name, "subject": about, "runs": " ".join(runs), "summary": json.dumps(summary)}
    tree.attrs[SEAL] = seal_of(tree)
    keep_update(store, tree, title, runs, summary)
    return tree


def _summary(outcome: "UpdateOutcome") -> dict[str, float]:
    import numpy as np

    low, middle, high = outcome.answer.remaining(np.array([0.05, 0.5, 0.95]))
    return {"now": outcome.answer.now, "remaining_5": low, "remaining_50": middle, "remaining_95": high}
