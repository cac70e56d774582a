"""Where a run comes from: which it goes on from, which calibrated it, which rest on it.

And its citation.
"""

import json
import re
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from wearlab.store import netcdf
from wearlab.store.used_plugins import plugins_of_scene

if TYPE_CHECKING:
    from wearlab.store import catalogue, updates
    from wearlab.store.stored_runs import StoredRuns

LONGEST = 100  # runs of a chain


class Ancestor(NamedTuple):
    """One run that another goes on from.

    Parameters
    ----------
    run : its id
    name : campaign, label and place that it has in this store, "" where no campaign
        here has it
    at : where the other one begins, in words
    replaced : members that got new flanks there
    state : of that run in this store, "not in this store" when it is not there
    """

    run: str
    name: str
    at: str
    replaced: tuple[str, ...]
    state: str

    def __str__(self) -> str:
        name = f" ({self.name})" if self.name else ""
        new = f", new flanks: {', '.join(self.replaced)}" if self.replaced else ""
        state = "" if self.state == "done" else f", {self.state}"
        return f"run {self.run}{name} from {self.at}{new}{state}"


def lineage(store: "StoredRuns", entry: "catalogue.Entry") -> list[Ancestor]:
    """Return the runs that a run goes on from: parent, grandparent, and so on.

    Parameters
    ----------
    store : where they are looked for
    entry : the run
    """
    current: catalogue.Entry | None = entry
    steps: list[Ancestor] = []
    while (
        current is not None
        and (start := start_of(current.scene))
        and len(steps) < LONGEST
    ):
        parent = str(start["run"])
        at = _at(start, current.summary)
        current = store.archive.entries([parent]).get(parent)
        state = current.state if current is not None else "not in this store"
        new = tuple(map(str, start.get("replace") or ()))
        steps.append(Ancestor(parent, name_of(store, parent), at, new, state))
    return steps


def children(store: "StoredRuns", run_id: str, by: str = "start.run") -> list[str]:
    """Return the ids of the runs that go on from a run.

    Or of those that another key says were made by it.

    Parameters
    ----------
    store : where they are looked for
    run_id : the parent
    by : the key that names the parent
    """
    if by not in store.names():
        return []
    return [
        row["id"]
        for row in store.query(f"{by} = '{run_id}'", columns=(), sort="started")
    ]


def rests_on(store: "StoredRuns", entry: "catalogue.Entry") -> set[str]:
    """Return the ids of all runs that a run needs to be made again.

    Those before it, and those that calibrate.

    Parameters
    ----------
    store : where they are looked for
    entry : the run
    """
    ancestors = {step.run for step in lineage(store, entry)}
    entries = store.archive.entries(ancestors)
    return (ancestors | {run.calibration for run in (entry, *entries.values())}) - {""}


def name_of(store: "StoredRuns", run_id: str) -> str:
    """Return what the campaign recorded last calls a run.

    Its title, the label and the place.

    Parameters
    ----------
    store : with the campaigns
    run_id : identity of the run
    """
    member = next(iter(store.archive.catalogue.members([run_id])), None)
    if member is None:
        return ""
    places = [f"{axis}={value}" for axis, value in member.position.items()]
    return ", ".join([member.campaign, member.label, *places])


def start_of(scene: str | None) -> dict[str, Any]:
    """Return the ``start`` of a scene, {} where it begins with new flanks.

    Parameters
    ----------
    scene : canonical JSON
    """
    try:
        start = json.loads(scene or "{}").get("start")
    except (ValueError, AttributeError, RecursionError):
        return {}
    return (
        start if isinstance(start, dict) and isinstance(start.get("run"), str) else {}
    )


def _at(start: dict[str, Any], summary: dict[str, Any]) -> str:
    if (cycle := summary.get("parent_cycle", start.get("cycle"))) is not None:
        return f"cycle {float(cycle):.6g}"
    if (share := start.get("life_fraction")) is not None:
        return f"{float(share):.3g} of its life"
    return "its last state"


SPECIAL = re.compile(r"([&%$#_{}])")
WHO = ("author", "orcid", "institution", "licence")
BASE = "base"
SUBJECT = "experiments and datasets of coupled gear wear and dynamics"
SENTENCES = {"lineage": " It goes on from {}."}
SENTENCES |= {
    "calibration": " Its wear coefficient was calibrated by run {}.",
    "plugins": " With plug-ins: {}.",
    "reference": " After {}.",
}
SENTENCES["licence"] = " Licence: {}."
NOTED = dict(
    reference="after",
    lineage="goes on from",
    calibration="calibrated by run",
    plugins="with plug-ins",
    licence="licence",
)
FILE = (netcdf.SEAL, "wearlab_version", "source_hash")
CODE = ("commit", "dirty", "model_version", "packages", "parents")


def facts_of(store: "StoredRuns", prefix: str) -> dict[str, str]:
    """Return what a citation needs, as texts.

    Parameters
    ----------
    store : where the run is
    prefix : the run's id, or its beginning

    Raises
    ------
    StoreError : no such run, or it has no data
    """
    from wearlab.store import updates

    update = updates.find_update(store, prefix)
    facts = _of_run(store, prefix) if update is None else _of_update(store, update)
    return {key: value for key, value in facts.items() if value}


def _of_run(store: "StoredRuns", prefix: str) -> dict[str, str]:
    """Return what a citation of a run needs.

    Who and what, and the code that made it.
    """
    from wearlab.store import catalogue

    entry = store.archive.find(prefix)
    attributes = store.run(entry.id).attrs
    members = store.archive.catalogue.members([entry.id])
    # the campaign that names its authors speaks for its runs, or one that is a file
    candidates = members[::-1] or [catalogue.Member("", None, "", "", {})]
    member = max(
        candidates, key=lambda each: ("author" in each.metadata, each.path is not None)
    )
    label = [] if member.label == BASE else [member.label]
    places = [f"{name} {value}" for name, value in member.position.items()]
    other_campaigns = dict.fromkeys(
        m.campaign for m in members if m.campaign != member.campaign
    )
    facts = {
        "id": entry.id,
        "campaign": member.campaign,
        "case": ", ".join(label + places),
    }
    facts |= {"also_in": "; ".join(other_campaigns), "reference": member.reference}
    facts["date"] = (entry.started or str(attributes.get("date_created", "")))[:10]
    facts |= {
        "sha256": entry.sha256 or "",
        **_among({**attributes, **vars(entry)}, FILE),
    }
    facts |= {
        "lineage": "; ".join(map(str, lineage(store, entry))),
        "calibration": entry.calibration,
        "plugins": "; ".join(map(str, plugins_of_scene(entry.scene, store.path))),
    }
    return facts | _among(attributes, CODE) | _among(member.metadata, WHO)


def _of_update(store: "StoredRuns", update: "updates.KeptUpdate") -> dict[str, str]:
    """Return what a citation of an update needs.

    Who and what, and the runs that it was made from.
    """
    from wearlab.store import updates

    attributes = getattr(updates.read_update(store, update.id), "attrs", {})
    facts = {
        "kind": "Update",
        "id": update.id,
        "campaign": update.title,
        "case": "; ".join(update.summary),
    }
    facts |= {
        "reference": str(attributes.get("references", "")),
        "date": update.recorded[:10],
    }
    facts |= {
        "sha256": update.sha256,
        **_among(attributes, FILE),
        "made_from": " ".join(update.runs),
    }
    return facts | _among(attributes, WHO)


def _among(values: Mapping[str, Any], names: Iterable[str]) -> dict[str, str]:
    return {name: str(values[name]) for name in names if values.get(name)}


def _title(facts: dict[str, str]) -> str:
    words = [facts[key] for key in ("campaign", "case") if key in facts]
    return ", ".join(words) or f"Run {facts['id']}"


def _authors(facts: dict[str, str]) -> list[str]:
    return [
        author.strip()
        for author in facts.get("author", "").split(";")
        if author.strip()
    ]


def head_of(who: str, date: str, title: str) -> str:
    """Return the begin of a citation: author, year, title.

    Without an author the title is first.

    Parameters
    ----------
    who : authors or institution
    date : ISO date, "" for none
    title : of the data
    """
    year = [f"({date[:4]})"] if date else []
    title = f"{title} [data set]"
    return ". ".join([who, *year, title] if who else [title, *year])


def citation(facts: dict[str, str]) -> str:
    """Return one sentence that cites a run, and a line of provenance.

    Parameters
    ----------
    facts : as `facts_of` returns them
    """
    orcid = f" (ORCID {facts['orcid']})" if "orcid" in facts else ""
    names = ", ".join(_authors(facts))
    who = f"{names}{orcid}" if names else facts.get("institution", "")
    head = head_of(who, facts.get("date", ""), _title(facts))
    sentences = "".join(
        text.format(facts[key]) for key, text in SENTENCES.items() if key in facts
    )
    code = (
        f"wearlab {facts.get('wearlab_version', '?')}, sources "
        f"{facts.get('source_hash', '?')}"
    )
    commit = (
        f", commit {facts['commit']}"
        if facts.get("commit", "unknown") != "unknown"
        else ""
    )
    changed = " with changes" if facts.get("dirty") == "true" else ""
    subject = f"{facts.get('kind', 'Run')} {facts['id']}"
    file = (
        f"SHA-256 of the file {facts.get('sha256', '?')}, of its content "
        f"{facts.get(netcdf.SEAL, '?')}"
    )
    return (
        f"{head}. {subject}, computed by {code}.{sentences}\nprovenance: "
        f"{code}{commit}{changed}; {file}"
    )


def bibtex(facts: dict[str, str]) -> str:
    """Return a BibTeX entry, special characters escaped.

    Parameters
    ----------
    facts : as `facts_of` returns them
    """
    version = facts.get("wearlab_version", "")
    noted = "".join(
        f", {words} {facts[key]}" for key, words in NOTED.items() if key in facts
    )
    fields = {
        "author": " and ".join(_authors(facts)),
        "title": f"{_title(facts)} [data set]",
    }
    fields |= {
        "year": facts.get("date", "")[:4],
        "institution": facts.get("institution", ""),
    }
    fields["version"] = f"wearlab {version}, sources {facts.get('source_hash', '')}"
    kind = facts.get("kind", "Run").lower()
    fields["note"] = f"{kind} {facts['id']}, SHA-256 {facts.get('sha256', '')}{noted}"
    plain = {
        key: " ".join(value.replace("\\", "").split())
        for key, value in fields.items()
        if value
    }
    escaped = {key: SPECIAL.sub(r"\\\1", text) for key, text in plain.items()}
    software = {
        "author": "{The wearlab developers}",
        "title": f"wearlab: {SUBJECT}",
        "version": version,
    }
    dataset_entry = _entry(f"misc{{wearlab-{facts['id'][:10]}", escaped)
    return f"{dataset_entry}\n\n{_entry('software{wearlab', software)}"


def _entry(head: str, fields: dict[str, str]) -> str:
    return "\n".join(
        [f"@{head},", *(f"  {key} = {{{text}}}," for key, text in fields.items()), "}"]
    )
