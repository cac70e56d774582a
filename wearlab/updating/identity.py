"""What an update is of, as hashes: runs, contents of files, settings, the code."""

import hashlib
import json
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from wearlab import sources
from wearlab.campaign import Campaign
from wearlab.store import Store, updates
from wearlab.updating import cases

FORMAT = 2  # of what is kept


def identity(
    subject: str, *, replay: bool, check: int, today: date | None = None
) -> str:
    """Return the identity of an update: its subject, how it was asked for, the code.

    Parameters
    ----------
    subject : as `subject_hash` returns it
    replay : whether it also answers as after every inspection
    check : number of synthetic twins
    today : the day from which what is overdue is judged, None without a calendar
    """
    parts = [FORMAT, code_hash(), replay, check, subject]
    return _hash(parts if today is None else [*parts, today.isoformat()])


def subject_hash(studies: cases.Subjects) -> str:
    """Return the identity of what an update is of: its runs, its files, its settings.

    A campaign's title is none of it, nor where its files lie: what is kept belongs to
    whatever asks the same, and to nothing else.

    Parameters
    ----------
    studies : case by case
    """
    parts: list[Any] = []
    for study in studies:
        spec = study.spec.model_copy(update={"limit": None, "data": (), "today": None})
        if spec.record is not None:
            record = spec.record.model_copy(update={"file": Path()})
            spec = spec.model_copy(update={"record": record})
        parts += [study.label, [study.first.id], repr(study.limit), repr(spec)]
        parts += [repr(study.record and study.record.fingerprint)]
        parts += [np.asarray(part).tolist() for part in study.calendar or ()]
        for observed in study.observations:
            data = observed.data.model_copy(update={"file": Path(), "case": None})
            parts += [repr(data), observed.fingerprint]
    return _hash(parts)


def subject_of(campaign: Campaign) -> str:
    """Return the identity of a campaign's update, as its files stand now.

    Parameters
    ----------
    campaign : with an [update]

    Raises
    ------
    UpdateError : it has no [update], or a file cannot be read
    """
    return subject_hash(cases.studies(campaign))


def _hash(parts: list[Any]) -> str:
    """Return a short hash of texts and numbers."""
    text = json.dumps(parts, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:20]


@cache
def code_hash() -> str:
    """Return the hash of the sources of this room."""
    room = Path(__file__).parent
    return sources.hash_of(sorted(file for file in room.iterdir() if file.is_file()))


def stored_update(
    studies: cases.Subjects, store: Store, *, replay: bool, check: int
) -> xr.DataTree | None:
    """Return the update when it was made before, None otherwise.

    Parameters
    ----------
    studies : case by case
    store : where updates are kept
    replay : whether it also answers as after every inspection
    check : number of synthetic twins
    """
    today = studies[0].spec.today
    subject = subject_hash(studies)
    name = identity(subject, replay=replay, check=check, today=today)
    return updates.read_update(store, name)
