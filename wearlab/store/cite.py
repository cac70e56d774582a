"""How a run is cited: who, what, when, made by which code, with the hash that proves it."""

import re
from typing import TYPE_CHECKING

from wearlab.store.lineage import lineage
from wearlab.store.seal import SEAL

if TYPE_CHECKING:
    from wearlab.store.store import Store

SPECIAL = re.compile(r"([&%$#_{}])")
WHO = ("author", "orcid", "institution", "licence")
CODE = ("commit", "dirty", "model_version", "packages", "parents")


def facts_of(store: "Store", prefix: str) -> dict[str, str]:
    """Return what a citation needs, as texts.

    Parameters
    ----------
    store : where the run is
    prefix : the run's id, or its beginning

    Raises
    ------
    StoreError : no such run, or it has no data
    """
    entry = store.find(prefix)
    attributes = store.run(entry.id).attrs
    member = next(iter(store.catalogue.members([entry.id])), None)
    facts = {
        "id": entry.id,
        "campaign": member.campaign if member else "",
        "case": "" if member is None else ", ".join([member.label, *map(str, member.position.values())]),
        "reference": member.reference if member else "",
        "date": (entry.started or str(attributes.get("date_created", "")))[:10],
        "sha256": entry.sha256 or "",
        SEAL: str(attributes.get(SEAL, "")),
        "wearlab_version": entry.wearlab_version or "",
        "source_hash": entry.source_hash or "",
        "lineage": "; ".join(map(str, lineage(store, entry))),
        **{name: str(attributes[name]) for name in CODE if attributes.get(name)},
    }
    if member is not None:
        facts |= {key: member.metadata[key] for key in WHO if key in member.metadata}
    return {key: value for key, value in facts.items() if value}


def citation(facts: dict[str, str]) -> str:
    """Return one sentence that cites a run, and a line of provenance."""
    orcid = f" (ORCID {facts['orcid']})" if "orcid" in facts else ""
    who = f"{facts['author']}{orcid}. " if "author" in facts else ""
    year = f"({facts['date'][:4]}). " if "date" in facts else ""
    what = f"{facts['campaign']}, {facts['case']}" if "campaign" in facts else "Run"
    end = f" After {facts['reference']}." if "reference" in facts else ""
    onward = f" It goes on from {facts['lineage']}." if "lineage" in facts else ""
    licence = f" Licence: {facts['licence']}." if "licence" in facts else ""
    code = f"wearlab {facts.get('wearlab_version', '?')}, sources {facts.get('source_hash', '?')}"
    commit = f", commit {facts['commit']}" if facts.get("commit", "unknown") != "unknown" else ""
    changed = " with changes" if facts.get("dirty") == "true" else ""
    return (
        f"{who}{year}{what} [data set]. Run {facts['id']}, computed by {code}.{onward}{end}{licence}\n"
        f"provenance: {code}{commit}{changed}; SHA-256 of the file {facts.get('sha256', '?')}, "
        f"of its content {facts.get(SEAL, '?')}"
    )


def bibtex(facts: dict[str, str]) -> str:
    """Return a BibTeX entry, special characters escaped."""
    title = f"{facts['campaign']}, {facts['case']}" if "campaign" in facts else f"Run {facts['id']}"
    fields = {
        "author": facts.get("author", ""),
        "title": f"{title} [data set]",
        "year": facts.get("date", "")[:4],
        "institution": facts.get("institution", ""),
        "version": f"wearlab {facts.get('wearlab_version', '')}, sources {facts.get('source_hash', '')}",
        "note": f"run {facts['id']}, SHA-256 {facts.get('sha256', '')}"
        + (f", after {facts['reference']}" if "reference" in facts else "")
        + (f", goes on from {facts['lineage']}" if "lineage" in facts else "")
        + (f", licence {facts['licence']}" if "licence" in facts else ""),
    }
    lines = [f"  {key} = {{{_escaped(value)}}}," for key, value in fields.items() if value]
    return "\n".join([f"@misc{{wearlab-{facts['id'][:10]},", *lines, "}"])


def _escaped(text: str) -> str:
    return SPECIAL.sub(r"\\\1", " ".join(text.replace("\\", "").split()))
