"""How a run is cited, and a campaign as a research object crate: data, file, figures and citation in one zip.

Source: RO-Crate Metadata Specification 1.1 (doi:10.5281/zenodo.4031327): a metadata descriptor that is about
the root dataset ``./``, which has a name, a description, a date, a licence and parts; entities in one graph.
"""

import json
import mimetypes
import re
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from wearlab import __version__
from wearlab.store import files, lineage, netcdf, outcome

if TYPE_CHECKING:
    from wearlab.campaign import Campaign
    from wearlab.store import campaigns, updates
    from wearlab.store.store import Store

SPECIAL = re.compile(r"([&%$#_{}])")
WHO = ("author", "orcid", "institution", "licence")
BASE = "base"
SUBJECT = "experiments and datasets of coupled gear wear and dynamics"
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
    from wearlab.store import updates

    update = updates.find_update(store, prefix)
    if update is not None:
        return _of_update(store, update)
    entry = store.find(prefix)
    attributes = store.run(entry.id).attrs
    members = store.catalogue.members([entry.id])
    member = max(reversed(members), key=_standing, default=None)
    facts = {
        "id": entry.id,
        "campaign": member.campaign if member else "",
        "case": "" if member is None else _case(member),
        "also_in": "" if member is None else "; ".join(_other_titles(members, member)),
        "reference": member.reference if member else "",
        "date": (entry.started or str(attributes.get("date_created", "")))[:10],
        "sha256": entry.sha256 or "",
        netcdf.SEAL: str(attributes.get(netcdf.SEAL, "")),
        "wearlab_version": entry.wearlab_version or "",
        "source_hash": entry.source_hash or "",
        "lineage": "; ".join(map(str, lineage.lineage(store, entry))),
        "calibration": outcome.calibration_of(entry),
        **{name: str(attributes[name]) for name in CODE if attributes.get(name)},
    }
    if member is not None:
        facts |= {key: member.metadata[key] for key in WHO if key in member.metadata}
    return {key: value for key, value in facts.items() if value}


def _of_update(store: "Store", update: "updates.KeptUpdate") -> dict[str, str]:
    """Return what a citation of an update needs: who and what, and the runs that it was made from."""
    from wearlab.store import updates

    tree = updates.read_update(store, update.id)
    attributes = {} if tree is None else tree.attrs
    metadata = {key: str(attributes[key]) for key in WHO if attributes.get(key)}
    facts = {
        "kind": "Update",
        "id": update.id,
        "campaign": update.title,
        "case": "; ".join(update.summary),
        "reference": str(attributes.get("references", "")),
        "date": update.recorded[:10],
        "sha256": update.sha256,
        netcdf.SEAL: str(attributes.get(netcdf.SEAL, "")),
        "wearlab_version": str(attributes.get("wearlab_version", "")),
        "source_hash": str(attributes.get("source_hash", "")),
        "made_from": " ".join(update.runs),
        **{key: metadata[key] for key in WHO if key in metadata},
    }
    return {key: value for key, value in facts.items() if value}


def _standing(member: "campaigns.Member") -> tuple[bool, bool]:
    """Return what lets a campaign speak for its runs: that it names its authors, that it is a file."""
    return "author" in member.metadata, member.path is not None


def _case(member: "campaigns.Member") -> str:
    """Return the case's label, unless it is the file itself, and its place on every axis."""
    label = [] if member.label == BASE else [member.label]
    return ", ".join([*label, *(f"{name} {value}" for name, value in member.position.items())])


def _other_titles(members: "Sequence[campaigns.Member]", chosen: "campaigns.Member") -> list[str]:
    return list(dict.fromkeys(member.campaign for member in members if member.campaign != chosen.campaign))


def _title(facts: dict[str, str]) -> str:
    words = [facts[key] for key in ("campaign", "case") if key in facts]
    return ", ".join(words) or f"Run {facts['id']}"


def _authors(facts: dict[str, str]) -> list[str]:
    return [author.strip() for author in facts.get("author", "").split(";") if author.strip()]


def head_of(who: str, date: str, title: str) -> str:
    """Return the begin of a citation: author, year, title; without an author the title is first."""
    year, title = [f"({date[:4]})"] if date else [], f"{title} [data set]"
    return ". ".join([who, *year, title] if who else [title, *year])


def citation(facts: dict[str, str]) -> str:
    """Return one sentence that cites a run, and a line of provenance."""
    orcid = f" (ORCID {facts['orcid']})" if "orcid" in facts else ""
    names = ", ".join(_authors(facts))
    who = f"{names}{orcid}" if names else facts.get("institution", "")
    head = head_of(who, facts.get("date", ""), _title(facts))
    end = f" After {facts['reference']}." if "reference" in facts else ""
    onward = f" It goes on from {facts['lineage']}." if "lineage" in facts else ""
    onward += (
        f" Its wear coefficient was calibrated by run {facts['calibration']}."
        if "calibration" in facts
        else ""
    )
    licence = f" Licence: {facts['licence']}." if "licence" in facts else ""
    code = f"wearlab {facts.get('wearlab_version', '?')}, sources {facts.get('source_hash', '?')}"
    commit = f", commit {facts['commit']}" if facts.get("commit", "unknown") != "unknown" else ""
    changed = " with changes" if facts.get("dirty") == "true" else ""
    what = f"{facts.get('kind', 'Run')} {facts['id']}"
    return (
        f"{head}. {what}, computed by {code}.{onward}{end}{licence}\n"
        f"provenance: {code}{commit}{changed}; SHA-256 of the file {facts.get('sha256', '?')}, "
        f"of its content {facts.get(netcdf.SEAL, '?')}"
    )


def bibtex(facts: dict[str, str]) -> str:
    """Return a BibTeX entry, special characters escaped."""
    fields = {
        "author": " and ".join(_authors(facts)),
        "title": f"{_title(facts)} [data set]",
        "year": facts.get("date", "")[:4],
        "institution": facts.get("institution", ""),
        "version": f"wearlab {facts.get('wearlab_version', '')}, sources {facts.get('source_hash', '')}",
        "note": f"{facts.get('kind', 'Run').lower()} {facts['id']}, SHA-256 {facts.get('sha256', '')}"
        + (f", after {facts['reference']}" if "reference" in facts else "")
        + (f", goes on from {facts['lineage']}" if "lineage" in facts else "")
        + (f", calibrated by run {facts['calibration']}" if "calibration" in facts else "")
        + (f", licence {facts['licence']}" if "licence" in facts else ""),
    }
    lines = [f"  {key} = {{{_escaped(value)}}}," for key, value in fields.items() if value]
    software = (
        "@software{wearlab,\n  author = {{The wearlab developers}},\n"
        f"  title = {{wearlab: {SUBJECT}}},\n"
        f"  version = {{{facts.get('wearlab_version', '')}}},\n}}"
    )
    return "\n".join([f"@misc{{wearlab-{facts['id'][:10]},", *lines, "}", "", software])


def _escaped(text: str) -> str:
    return SPECIAL.sub(r"\\\1", " ".join(text.replace("\\", "").split()))


CONTEXT = "https://w3id.org/ro/crate/1.1/context"
SPECIFICATION = "https://w3id.org/ro/crate/1.1"
DESCRIPTOR = "ro-crate-metadata.json"
FIRST = (1980, 1, 1, 0, 0, 0)  # the time of every entry: the same store gives the same bytes
NETCDF = "application/x-netcdf"
NO_LICENCE = "no licence is given: all rights are reserved by the authors"
SOFTWARE = f"#wearlab-{__version__}"
Entity = dict[str, Any]


def export_crate(
    campaign: "Campaign",
    store: "Store",
    out: Path,
    figures: Sequence[Path] = (),
    tell: Callable[[str], None] = lambda run_id: None,
) -> Path:
    """Write a campaign with its data, its file, figures and citation as a crate.

    Parameters
    ----------
    campaign, store : its cases and where their runs are
    out : the zip, which appears whole or not at all
    figures : drawn ones, which go into the folder ``figures``
    tell : called with the id of each run that was written

    Raises
    ------
    StoreError : there is no store, a run is damaged, or the disk refuses
    """
    from wearlab.store import export

    said = export.export_attributes(campaign, store)
    with TemporaryDirectory(prefix="wearlab-") as folder:
        data = export.export(campaign, store, Path(folder) / "runs.nc", tell)
        parts: dict[str, tuple[bytes | Path, str]] = {
            "runs.nc": (data, "all runs of the campaign, by its sweeps and cases"),
            "CITATION.txt": (_citation(said).encode(), "how to cite it"),
        }
        if said.get("campaign"):
            parts["campaign.toml"] = (said["campaign"].encode(), "the campaign file, and all that it extends")
        for figure in figures:
            parts[f"figures/{figure.name}"] = (figure, f"figure {figure.stem.replace('_', ' ')}")
        _write(out, parts, _metadata(said, {name: told for name, (_, told) in parts.items()}))
    return out


def _write(out: Path, parts: Mapping[str, tuple[bytes | Path, str]], metadata: str) -> None:
    part = files.part_of(out)
    try:
        with files.written(out):
            out.parent.mkdir(parents=True, exist_ok=True)
            with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as crate:
                for name, (content, _) in {DESCRIPTOR: (metadata.encode(), ""), **parts}.items():
                    entry = zipfile.ZipInfo(name, FIRST)
                    entry.compress_type = zipfile.ZIP_DEFLATED
                    crate.writestr(entry, content.read_bytes() if isinstance(content, Path) else content)
            part.replace(out)
    finally:
        part.unlink(missing_ok=True)


def _citation(said: Mapping[str, str]) -> str:
    """Return a sentence that cites the data, and where they come from."""
    who = said.get("creator_name") or said.get("institution", "")
    after = f" After {said['references']}." if "references" in said else ""
    head = head_of(who, said.get("date_created", ""), said["title"])
    return f"{head}, computed by {said.get('source', 'wearlab')}.{after}\n"


def _metadata(said: Mapping[str, str], parts: Mapping[str, str]) -> str:
    """Return the crate's JSON-LD."""
    people = [_person(name, said) for name in said.get("creator_name", "").split(";") if name.strip()]
    licence = said.get("license", "")
    root: Entity = {
        "@id": "./",
        "@type": "Dataset",
        "name": said["title"],
        "description": said["summary"],
        "datePublished": said.get("date_created", "")[:10] or "1980-01-01",
        "license": {"@id": licence} if "://" in licence else licence or NO_LICENCE,
        "keywords": said["keywords"],
        "hasPart": [{"@id": name} for name in parts],
        "mentions": {"@id": "#computation"},
    }
    if people:
        root["author"] = [{"@id": person["@id"]} for person in people]
    if "references" in said:
        root["citation"] = said["references"]
    computation = {
        "@id": "#computation",
        "@type": "CreateAction",
        "name": said.get("source", f"wearlab {__version__}"),
        "instrument": {"@id": SOFTWARE},
        "result": {"@id": "runs.nc"},
    }
    if "campaign.toml" in parts:
        computation["object"] = {"@id": "campaign.toml"}
    software = {
        "@id": SOFTWARE,
        "@type": "SoftwareApplication",
        "name": "wearlab",
        "version": __version__,
        "description": "experiments and datasets of coupled gear wear and dynamics",
    }
    about = {
        "@id": DESCRIPTOR,
        "@type": "CreativeWork",
        "about": {"@id": "./"},
        "conformsTo": {"@id": SPECIFICATION},
    }
    rights = [{"@id": licence, "@type": "CreativeWork", "name": licence}] if "://" in licence else []
    files = [_file(name, told) for name, told in parts.items()]
    graph = [about, root, *files, *people, *rights, computation, software]
    return json.dumps({"@context": CONTEXT, "@graph": graph}, indent=1, ensure_ascii=False)


def _person(name: str, said: Mapping[str, str]) -> Entity:
    """Return an author; the address given belongs to the one of a single author."""
    name = name.strip()
    address = said.get("creator_url", "") if ";" not in said["creator_name"] else ""
    person: Entity = {
        "@id": address if "://" in address else f"#{quote(name)}",
        "@type": "Person",
        "name": name,
    }
    return person | ({"affiliation": said["institution"]} if "institution" in said else {})


def _file(name: str, told: str) -> Entity:
    kind = NETCDF if name.endswith(".nc") else "application/toml" if name.endswith(".toml") else None
    kind = kind or mimetypes.guess_type(name)[0] or "application/octet-stream"
    return {"@id": name, "@type": "File", "name": told, "encodingFormat": kind}
