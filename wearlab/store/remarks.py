"""Tags and notes on runs and campaigns: one remark, its line in a file, and what the catalogue knows of it.

Remarks are no part of any run's identity, and the file of a run does not know of them.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping
from typing import Any, Literal, NamedTuple

from wearlab.store.catalogue import Catalogue

TABLE = """
CREATE TABLE IF NOT EXISTS remarks (
    subject TEXT NOT NULL, line TEXT NOT NULL, what TEXT, text TEXT, who TEXT, recorded TEXT, campaign TEXT,
    stands INTEGER, PRIMARY KEY (subject, line)
) WITHOUT ROWID
"""
THERE = "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = 'remarks'"
COLUMNS = "subject, line, what, text, who, recorded, campaign, stands"
KINDS = ("tag", "untag", "note")
SEAL = 16  # hexadecimal digits
What = Literal["tag", "untag", "note"]


class Remark(NamedTuple):
    """A tag or note.

    Parameters
    ----------
    subject : id of the run, or `subject_of` a campaign
    what : tag | untag | note
    text : the tag, or what is noted
    who, when : by whom, and when in UTC
    campaign : title of the campaign that it is about, "" where it is about a run
    """

    subject: str
    what: What
    text: str
    who: str
    when: str
    campaign: str = ""

    @property
    def line(self) -> str:
        """The line that tells it, with its hash."""
        told = {key: value for key, value in self._asdict().items() if value}
        return json.dumps(told | {"seal": _seal(told)}, ensure_ascii=False, sort_keys=True)


def _seal(told: Mapping[str, Any]) -> str:
    text = json.dumps({k: v for k, v in told.items() if k != "seal"}, ensure_ascii=False, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:SEAL]


def subject_of(title: str) -> str:
    """Return under which name remarks on a campaign are kept: its title counts, whichever runs it has.

    Examples
    --------
    >>> subject_of("Wear of a spur pair at five speeds")
    'campaignb25b21d2abba8966'
    """
    return f"campaign{hashlib.sha256(title.encode()).hexdigest()[:16]}"


def read_line(line: str, subject: str) -> Remark:
    """Return the remark of a line.

    Raises
    ------
    ValueError : no wearlab wrote it, it is damaged, or about another subject
    """
    told = json.loads(line)
    if not isinstance(told, dict) or told.get("seal") != _seal(told):
        raise ValueError("its hash is not that of its words")
    values = {key: told.get(key, "") for key in Remark._fields}
    if values["subject"] != subject or values["what"] not in KINDS:
        raise ValueError("is about another run, or no remark")
    if not all(isinstance(value, str) for value in values.values()):
        raise ValueError("holds more than texts")
    if values["campaign"] and subject_of(values["campaign"]) != subject:
        raise ValueError("names another campaign")
    return Remark(**values)


def remarks_on(catalogue: Catalogue, subjects: Iterable[str] | None = None) -> list[Remark]:
    """Return the tags that stand and the notes on some runs or campaigns, all when None, the latest last."""
    if not catalogue.exists() or not catalogue.read(THERE):
        return []
    told = "SELECT subject, what, text, who, recorded, campaign FROM remarks WHERE stands AND what != 'untag'"
    if subjects is None:
        rows = catalogue.read(told)
    else:
        rows = list(catalogue.read_many(f"{told} AND subject IN", list(subjects)))
    texts = [Remark(*(str(value or "") for value in row)) for row in rows]  # type: ignore[arg-type]
    return sorted(texts, key=lambda remark: (remark.when, remark.text))


def texts_of(catalogue: Catalogue, run_ids: Iterable[str], what: str) -> dict[str, tuple[str, ...]]:
    """Return the tags, or the notes, of runs: their own, and those of the campaigns that they belong to."""
    ids = list(run_ids)
    if not catalogue.read(THERE):
        return {}
    told: dict[str, dict[str, None]] = {}
    titles = dict(catalogue.read("SELECT DISTINCT campaign, subject FROM remarks WHERE campaign != ''"))
    of_campaigns: dict[str, list[str]] = {}
    if titles:
        question = "SELECT run, title FROM members JOIN campaigns ON campaign = key WHERE run IN"
        for run_id, title in catalogue.read_many(question, ids):
            if title in titles:
                of_campaigns.setdefault(titles[title], []).append(run_id)
    for remark in remarks_on(catalogue, [*ids, *of_campaigns]):
        if remark.what == what:
            for run_id in of_campaigns.get(remark.subject, [remark.subject]):
                told.setdefault(run_id, {})[remark.text] = None
    return {run_id: tuple(texts) for run_id, texts in told.items()}
