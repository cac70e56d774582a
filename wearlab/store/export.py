"""A campaign's runs in one file that anybody can read.

netCDF, Zarr, or a research object crate.

A crate is one zip with data, campaign file, figures and citation.

Memory holds one run at a time. Grid points without a run are NaN (texts: empty), as in
the grid itself.
"""

import hashlib
import json
import mimetypes
import shutil
import warnings
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import dask
import numpy as np
import xarray as xr

from wearlab import __version__
from wearlab.store import files, provenance, remarks
from wearlab.store.files import StoreError
from wearlab.store.netcdf import SEAL, content_hash, is_intact

if TYPE_CHECKING:
    from wearlab.campaign import Campaign
    from wearlab.store import catalogue
    from wearlab.store.store import Store

ACDD = {name: name for name in ("institution", "project", "acknowledgement")}
ACDD |= {"author": "creator_name", "orcid": "creator_url", "email": "creator_email"}
ACDD |= {"licence": "license", "publisher": "publisher_name"}
"""What of [metadata] a file's attribute is, by the Attribute Convention for Data
Discovery 1.3."""
ASSUMED = "The variables 'validity' and 'model_error' say what was assumed"
COMMENT = f"{ASSUMED} and how far the models are known to be off."
COMPUTED = {
    "processing_level": "model output: computed, not measured",
    "comment": COMMENT,
}
Tell = Callable[[str], None]
CONSOLIDATED = "Consolidated metadata"
"""What xarray warns of: Zarr's format 3 has them by custom only."""
KEYWORDS = "gears, gear dynamics, tooth wear, mesh stiffness, transmission error"


def export(
    campaign: "Campaign", store: "Store", out: Path, tell: Tell = lambda run_id: None
) -> Path:
    """Write a campaign as one netCDF file, or as a Zarr folder.

    A folder where the name ends in ``.zarr``.

    Parameters
    ----------
    campaign : its cases
    store : where the runs are; what is missing there is missing in the file, and named
    out : the file, which appears whole or not at all
    tell : called with the id of each run that was written

    Raises
    ------
    StoreError : there is no store, a run is damaged, or the disk refuses
    """
    entries = store.archive.entries(case.id for case in campaign.cases)
    grid = store.open(campaign)
    # with the scene of each run, so that its file needs no store
    scenes = [
        (entries[i].scene if i in entries else "") or ""
        for i in grid["run_id"].values.ravel()
    ]
    texts = np.reshape(np.array(scenes, object), grid["run_id"].shape)
    about = {"long_name": "the whole scene of the run, as JSON in SI units"}
    grid = grid.assign(scene=(grid["run_id"].dims, texts, about))
    grid = grid.assign_attrs(export_attributes(campaign, store))
    with files.replaced(out) as part:
        if out.suffix == ".zarr":
            _zarr(grid, part)
            _seal(part, is_zarr=True)
            shutil.rmtree(out, ignore_errors=True)
        else:
            _netcdf(grid, entries, part, tell)
            _seal(part)
    return out


def _seal(part: Path, is_zarr: bool = False) -> None:
    """Write the hash of an export's content into it, as the files of runs have it."""
    engine = "zarr" if is_zarr else "netcdf4"
    with xr.open_dataset(part, engine=engine, cache=False) as dataset:
        sealed = xr.Dataset(attrs=dataset.attrs | {SEAL: content_hash(dataset)})
    if not is_zarr:
        sealed.to_netcdf(part, mode="a", engine="netcdf4")
        return
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", CONSOLIDATED)
        sealed.to_zarr(part, mode="a", zarr_format=3, consolidated=True)


def verify_export(path: Path) -> files.Problem | None:
    """Return what is wrong with an exported netCDF file, by the hash that it carries.

    Parameters
    ----------
    path : the file

    Raises
    ------
    StoreError : it cannot be read
    """
    from wearlab.store import reading

    is_sound = is_intact(reading.read_run(path))
    if is_sound:
        return None
    if is_sound is None:
        return files.Problem(path, "unknown", f"carries no {SEAL}: export it again")
    return files.Problem(path, "altered", "its content is not what was exported")


def export_attributes(campaign: "Campaign", store: "Store") -> dict[str, str]:
    """Return CF and ACDD attributes.

    The same store gives the same ones, whenever it is exported.

    Parameters
    ----------
    campaign : its cases, and what its file says of authors
    store : where the runs are
    """
    from wearlab.campaign.inheritance import fingerprint, source_text

    entries = store.archive.entries(case.id for case in campaign.cases)
    text = source_text(campaign.path)
    dates = sorted(entry.started for entry in entries.values() if entry.started)
    latest = dates[-1] if dates else ""
    calibrations = {entry.calibration for entry in entries.values()} - {""}
    attributes = {
        "Conventions": "CF-1.11, ACDD-1.3",
        "title": campaign.title,
        "summary": f"{len(entries)} runs of coupled gear wear and dynamics, by sweep "
        "axes and case",
        "keywords": KEYWORDS,
        "id": fingerprint("\n".join([text, *sorted(entries)])),
        **COMPUTED,
        "history": f"{latest} runs computed" if latest else "",
        "references": campaign.reference or "",
        "source": _source(entries.values()),
        "date_created": latest,
        "campaign": text,
        "campaign_hash": fingerprint(text),
        "missing": "; ".join(store.open(campaign).attrs["missing"]),
        "calibration": "; ".join(sorted(calibrations)),
        **_remark_attributes(campaign, store, entries),
        **credited(getattr(campaign, "metadata", None) or {}),
    }
    return {key: value for key, value in attributes.items() if value}


def _source(entries: "Iterable[catalogue.Entry]") -> str:
    """Return which versions of wearlab computed runs."""
    versions = {
        (entry.wearlab_version or "", entry.source_hash or "") for entry in entries
    }
    return "; ".join(
        f"wearlab {version}, sources {source}"
        for version, source in sorted(versions - {("", "")})
    )


def _remark_attributes(
    campaign: "Campaign", store: "Store", run_ids: Iterable[str]
) -> dict[str, str]:
    """Return the tags and notes on a campaign and its runs, as JSON."""
    subjects = [remarks.subject_of(campaign.title), *run_ids]
    stored_remarks = remarks.remarks_on(store.archive.catalogue, subjects)
    attributes = {}
    for kind in ("tag", "note"):
        texts = [
            {
                "of": remark.campaign or remark.subject,
                kind: remark.text,
                "by": remark.who,
                "when": remark.when,
            }
            for remark in stored_remarks
            if remark.what == kind
        ]
        attributes[f"{kind}s"] = json.dumps(texts, ensure_ascii=False) if texts else ""
    return attributes


def credited(metadata: Mapping[str, str]) -> dict[str, str]:
    """Return whom a file's attributes name, of a campaign's [metadata].

    An ORCID as its address.

    Parameters
    ----------
    metadata : texts by name

    >>> credited({"author": "Ada", "orcid": "0000-0002-1825-0097"})
    {'creator_name': 'Ada', 'creator_url': 'https://orcid.org/0000-0002-1825-0097'}
    """
    attributes = {
        ACDD[key]: str(value) for key, value in metadata.items() if key in ACDD
    }
    if attributes.get("creator_url", "://").find("://") < 0:
        attributes["creator_url"] = f"https://orcid.org/{attributes['creator_url']}"
    return attributes


def _netcdf(
    grid: xr.Dataset, entries: "Mapping[str, catalogue.Entry]", part: Path, tell: Tell
) -> None:
    """Write the grid through xarray, a chunk of a variable holding one run.

    Read in this thread alone.
    """
    for variable in grid.variables.values():
        attributes = {
            key: value for key, value in variable.attrs.items() if value is not None
        }
        plain = (str, int, float)
        variable.attrs = {
            k: v if isinstance(v, plain) else json.dumps(v)
            for k, v in attributes.items()
        }
    exported = [
        i
        for i in dict.fromkeys(grid["run_id"].values.ravel())
        if i in entries and entries[i].sha256
    ]
    xr.Dataset(attrs=grid.attrs).to_netcdf(part, format="NETCDF4", engine="netcdf4")
    with dask.config.set(scheduler="synchronous"):
        for number, (name, variable) in enumerate(
            grid.variables.items()
        ):  # one graph for all would be large
            encoding = {name: _encoding(grid, name)}
            if variable.dtype.kind in "OU":
                variable = variable.compute().astype(object)
            xr.Dataset({name: variable}).to_netcdf(
                part, mode="a", engine="netcdf4", encoding=encoding
            )
            share = [
                len(exported) * n // len(grid.variables) for n in (number, number + 1)
            ]
            for run in exported[slice(*share)]:
                tell(run)


def _encoding(grid: xr.Dataset, name: Any) -> dict[str, Any]:
    """Return how a variable is kept.

    What is read from runs in chunks of one run, numbers deflated.
    """
    variable = grid.variables[name]
    lacks = variable.dtype.kind == "f" and name not in grid.coords
    encoding: dict[str, Any] = {"_FillValue": np.nan if lacks else None}
    if variable.dtype.kind in "OUS":
        # a width that is read back with the text would cut longer ones that join it
        return encoding | {"dtype": "S1", "char_dim_name": f"{name}_letter"}
    if not variable.ndim:
        return encoding
    along = grid["run_id"].dims
    chunks = tuple(
        1 if d in along else max(1, n)
        for d, n in zip(variable.dims, variable.shape, strict=True)
    )
    by_run = any(dim in along for dim in variable.dims)
    return encoding | {
        "zlib": True,
        "complevel": 1,
        **({"chunksizes": chunks} if by_run else {}),
    }


def _zarr(grid: xr.Dataset, part: Path) -> None:
    """Write the grid through xarray, chunk by chunk.

    Raises
    ------
    StoreError : zarr is not installed
    """
    if find_spec("zarr") is None:
        raise StoreError(
            "Zarr needs the package zarr: pip install 'wearlab[zarr]'; or name the "
            "file .nc"
        )
    with dask.config.set(scheduler="synchronous"), warnings.catch_warnings():
        warnings.filterwarnings("ignore", CONSOLIDATED)
        texts = [n for n, v in grid.variables.items() if v.dtype.kind in "OU"]
        for name in texts:
            grid[name] = grid[name].compute().astype(object)
        grid.to_zarr(part, mode="w", zarr_format=3, consolidated=True)


CONTEXT = "https://w3id.org/ro/crate/1.1/context"
SPECIFICATION = "https://w3id.org/ro/crate/1.1"
DESCRIPTOR = "ro-crate-metadata.json"
FIRST = (
    1980,
    1,
    1,
    0,
    0,
    0,
)  # the time of every entry: the same store gives the same bytes
NO_LICENCE = "no licence is given: all rights are reserved by the authors"
SOFTWARE = f"#wearlab-{__version__}"
Entity = dict[str, Any]


def export_crate(
    campaign: "Campaign",
    store: "Store",
    out: Path,
    figures: Sequence[Path] = (),
    tell: Tell = lambda _: None,
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
    attributes = export_attributes(campaign, store)
    with TemporaryDirectory(prefix="wearlab-") as folder:
        data = export(campaign, store, Path(folder) / "runs.nc", tell)
        parts: dict[str, tuple[bytes | Path, str]] = {}
        parts["runs.nc"] = (data, "all runs of the campaign, by its sweeps and cases")
        parts["CITATION.txt"] = (_citation(attributes).encode(), "how to cite it")
        if attributes.get("campaign"):
            parts["campaign.toml"] = (
                attributes["campaign"].encode(),
                "the campaign file, and all that it extends",
            )
        for figure in figures:
            parts[f"figures/{figure.name}"] = (
                figure,
                f"figure {figure.stem.replace('_', ' ')}",
            )
        hashes = {name: _sha256_of(content) for name, (content, _) in parts.items()}
        descriptions = {name: description for name, (_, description) in parts.items()}
        metadata = _metadata(attributes, descriptions, hashes)
        written = {DESCRIPTOR: metadata.encode()} | {
            name: content for name, (content, _) in parts.items()
        }
        with (
            files.replaced(out) as part,
            zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as crate,
        ):
            for name, content in written.items():
                image = content.read_bytes() if isinstance(content, Path) else content
                crate.writestr(
                    zipfile.ZipInfo(name, FIRST), image, zipfile.ZIP_DEFLATED
                )
    return out


def _sha256_of(content: bytes | Path) -> str:
    if isinstance(content, Path):
        return files.hash_of(content)
    return hashlib.sha256(content).hexdigest()


def _citation(attributes: Mapping[str, str]) -> str:
    """Return a sentence that cites the data, and where they come from."""
    who = attributes.get("creator_name") or attributes.get("institution", "")
    reference = (
        f" After {attributes['references']}." if "references" in attributes else ""
    )
    head = provenance.head_of(
        who, attributes.get("date_created", ""), attributes["title"]
    )
    return f"{head}, computed by {attributes.get('source', 'wearlab')}.{reference}\n"


def _metadata(
    attributes: Mapping[str, str],
    parts: Mapping[str, str],
    hashes: Mapping[str, str],
) -> str:
    """Return the crate's JSON-LD.

    Parameters
    ----------
    attributes : of the data
    parts : what each file of the crate is
    hashes : SHA-256 of each file
    """
    authors = [
        _person(name, attributes)
        for name in attributes.get("creator_name", "").split(";")
        if name.strip()
    ]
    licence = attributes.get("license", "")
    descriptor = {
        "@id": DESCRIPTOR,
        "@type": "CreativeWork",
        "about": {"@id": "./"},
        "conformsTo": {"@id": SPECIFICATION},
    }
    graph = [descriptor, _root(attributes, parts, authors)]
    graph += [
        _entity(name, "File", text, encodingFormat=_format(name), sha256=hashes[name])
        for name, text in parts.items()
    ]
    graph += authors
    if _is_address(licence):
        graph.append(_entity(licence, "CreativeWork", licence))
    source = attributes.get("source", f"wearlab {__version__}")
    made_by = {"instrument": {"@id": SOFTWARE}, "result": {"@id": "runs.nc"}}
    if "campaign.toml" in parts:
        made_by["object"] = {"@id": "campaign.toml"}
    graph.append(_entity("#computation", "CreateAction", source, **made_by))
    graph.append(
        _entity(
            SOFTWARE,
            "SoftwareApplication",
            "wearlab",
            version=__version__,
            description=provenance.SUBJECT,
        )
    )
    return json.dumps(
        {"@context": CONTEXT, "@graph": graph}, indent=1, ensure_ascii=False
    )


def _root(
    attributes: Mapping[str, str],
    parts: Mapping[str, str],
    authors: Sequence[Entity],
) -> Entity:
    """Return the dataset that a crate is."""
    licence = attributes.get("license", "")
    date = attributes.get("date_created", "")[:10] or "1980-01-01"
    root = _entity(
        "./",
        "Dataset",
        attributes["title"],
        description=attributes["summary"],
        datePublished=date,
        license={"@id": licence} if _is_address(licence) else licence or NO_LICENCE,
        keywords=attributes["keywords"],
        hasPart=[{"@id": name} for name in parts],
        mentions={"@id": "#computation"},
    )
    if authors:
        root["author"] = [{"@id": author["@id"]} for author in authors]
    if "references" in attributes:
        root["citation"] = attributes["references"]
    return root


def _is_address(text: str) -> bool:
    """Say whether a text, such as a licence, is an address."""
    return "://" in text


def _entity(name: str, kind: str, label: str, **more: Any) -> Entity:
    return {"@id": name, "@type": kind, "name": label, **more}


def _person(name: str, attributes: Mapping[str, str]) -> Entity:
    """Return an author; the address given belongs to the one of a single author."""
    name = name.strip()
    address = (
        attributes.get("creator_url", "")
        if ";" not in attributes["creator_name"]
        else ""
    )
    affiliation = (
        {"affiliation": attributes["institution"]}
        if "institution" in attributes
        else {}
    )
    return _entity(
        address if "://" in address else f"#{quote(name)}",
        "Person",
        name,
        **affiliation,
    )


def _format(name: str) -> str:
    encoding_format = {".nc": "application/x-netcdf", ".toml": "application/toml"}.get(
        Path(name).suffix
    )
    return (
        encoding_format or mimetypes.guess_type(name)[0] or "application/octet-stream"
    )
