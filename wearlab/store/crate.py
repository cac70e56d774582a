"""A campaign as a research object crate: data, campaign, figures and citation in a zip that says what it is.

Source: RO-Crate Metadata Specification 1.1 (doi:10.5281/zenodo.4031327): a metadata descriptor that is about
the root dataset ``./``, which has a name, a description, a date, a licence and parts; entities in one graph.
"""

import json
import mimetypes
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from wearlab import __version__
from wearlab.store.cite import head_of
from wearlab.store.files import part_of, written

if TYPE_CHECKING:
    from wearlab.campaign import Campaign
    from wearlab.store.store import Store

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
    from wearlab.store.export import export, export_attributes

    said = export_attributes(campaign, store)
    with TemporaryDirectory(prefix="wearlab-") as folder:
        data = export(campaign, store, Path(folder) / "runs.nc", tell)
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
    part = part_of(out)
    try:
        with written(out):
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
