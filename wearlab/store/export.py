"""A campaign's runs in one file that anybody can read: netCDF, or Zarr; written run by run.

Memory holds one run at a time. Grid points without a run are NaN (texts: empty), as in the grid itself.
"""

import json
import os
import shutil
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import dask
import netCDF4
import numpy as np
import xarray as xr

from wearlab.store.errors import StoreError
from wearlab.store.files import part_of, written
from wearlab.store.outcome import calibration_of

if TYPE_CHECKING:
    from wearlab.campaign import Campaign
    from wearlab.store.catalogue import Entry
    from wearlab.store.store import Store

ACDD = {"author": "creator_name", "orcid": "creator_url", "institution": "institution", "licence": "license"}
CONVENTIONS = "CF-1.11, ACDD-1.3"
KEYWORDS = "gears, gear dynamics, tooth wear, mesh stiffness, transmission error"
Point = tuple[int, ...]


def export(
    campaign: "Campaign", store: "Store", out: Path, tell: Callable[[str], None] = lambda run_id: None
) -> Path:
    """Write a campaign as one netCDF file, or as a Zarr folder where the name ends in ``.zarr``.

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
    entries = store.entries(case.id for case in campaign.cases)
    grid = store.open(campaign)
    attributes = export_attributes(campaign, store)
    part = part_of(out)
    try:
        with written(out):
            out.parent.mkdir(parents=True, exist_ok=True)
            if out.suffix == ".zarr":
                _zarr(grid.assign_attrs(attributes), part)
                shutil.rmtree(out, ignore_errors=True)
            else:
                _netcdf(grid, attributes, entries, store, part, tell)
            os.replace(part, out)
    finally:
        shutil.rmtree(part, ignore_errors=True)
        with suppress(OSError):
            part.unlink()
    return out


def export_attributes(campaign: "Campaign", store: "Store") -> dict[str, str]:
    """Return CF and ACDD attributes; the same store gives the same ones, whenever it is exported."""
    from wearlab.campaign.inheritance import fingerprint, source_text

    entries, grid = store.entries(case.id for case in campaign.cases), store.open(campaign)
    text = source_text(campaign.path)
    dates = sorted(entry.started for entry in entries.values() if entry.started)
    code = sorted({(e.wearlab_version or "", e.source_hash or "") for e in entries.values()} - {("", "")})
    metadata = getattr(campaign, "metadata", None) or {}
    attributes = {
        "Conventions": CONVENTIONS,
        "title": campaign.title,
        "summary": f"{len(entries)} runs of coupled gear wear and dynamics, by sweep axes and case",
        "keywords": KEYWORDS,
        "history": "; ".join(f"{date} runs computed" for date in dates[-1:]),
        "references": campaign.reference or "",
        "source": "; ".join(f"wearlab {version}, sources {source}" for version, source in code),
        "date_created": dates[-1] if dates else "",
        "campaign": text,
        "campaign_hash": fingerprint(text),
        "missing": "; ".join(np.atleast_1d(grid.attrs.get("missing", [])).tolist()),
    }
    if calibrations := sorted(
        {calibration for entry in entries.values() if (calibration := calibration_of(entry))}
    ):
        attributes["calibration"] = "; ".join(calibrations)
    attributes |= {ACDD[key]: str(value) for key, value in metadata.items() if key in ACDD}
    return {key: value for key, value in attributes.items() if value}


def _netcdf(
    grid: xr.Dataset,
    attributes: Mapping[str, str],
    entries: "Mapping[str, Entry]",
    store: "Store",
    part: Path,
    tell: Callable[[str], None],
) -> None:
    dims = tuple(str(dim) for dim in grid["run_id"].dims)
    shared = _shared(grid, dims, entries, store)  # read before the file is open: HDF5 has one door only
    with netCDF4.Dataset(part, "w", format="NETCDF4") as file:
        file.setncatts(dict(attributes))
        for name, length in grid.sizes.items():
            file.createDimension(str(name), length)
        for name, variable in grid.variables.items():
            _declare(file, str(name), variable, dims, name in grid.coords)
            if not _by_run(variable, dims):
                _fill(file, str(name), shared[name])
        scene = file.createVariable("scene", str, dims)
        scene.long_name = "the whole scene of the run, as JSON in SI units"
        for run_id, points in _points(grid).items():
            for point in points:
                scene[point] = entries[run_id].scene or "" if run_id in entries else ""
            if run_id in entries and entries[run_id].state == "done":
                _place(file, grid, dims, points, store.run(run_id))
                tell(run_id)


def _shared(
    grid: xr.Dataset, dims: tuple[str, ...], entries: "Mapping[str, Entry]", store: "Store"
) -> dict[Any, xr.Variable]:
    """Return, in memory, what is the same for all runs or belongs to the grid itself."""
    run = next((store.run(i) for i, e in entries.items() if e.state == "done"), xr.Dataset())
    return {
        name: run.variables.get(name, variable).compute() if variable.chunks is not None else variable
        for name, variable in grid.variables.items()
        if not _by_run(variable, dims)
    }


def _by_run(variable: xr.Variable, dims: tuple[str, ...]) -> bool:
    """Say whether a variable is read from every run; else all runs share it, or the grid has it."""
    return variable.chunks is not None and variable.dims[: len(dims)] == dims


def _declare(
    file: netCDF4.Dataset, name: str, variable: xr.Variable, dims: tuple[str, ...], coordinate: bool
) -> None:
    """Make a variable; a chunk of it holds one run."""
    own = tuple(str(dim) for dim in variable.dims)
    text = variable.dtype.kind in "OUS"
    kind: Any = str if text else np.dtype("i1") if variable.dtype.kind == "b" else variable.dtype
    options: dict[str, Any] = {}
    if not text and own:
        chunks = [1 if dim in dims else max(1, file.dimensions[dim].size) for dim in own]
        options = {
            "zlib": True,
            "complevel": 1,
            "chunksizes": chunks if any(d in dims for d in own) else None,
        }
    if variable.dtype.kind == "f" and not coordinate:
        options["fill_value"] = np.nan
    made = file.createVariable(name, kind, own, **options)
    if (
        coordinate and variable.dtype.kind == "f" and _by_run(variable, dims)
    ):  # no filling says what is missing
        for first in range(made.shape[0] if own else 0):
            made[first] = np.nan
    for key, value in variable.attrs.items():
        if value is not None and key != "_FillValue":
            made.setncattr(str(key), value if isinstance(value, str | int | float) else json.dumps(value))


def _fill(file: netCDF4.Dataset, name: str, variable: xr.Variable) -> None:
    values = np.asarray(variable.values)
    if values.dtype.kind in "OUS":
        values = values.astype(object)
    if values.ndim or values.dtype.kind != "O":
        file[name][...] = values
    else:
        file[name][...] = np.array([values.item()], object)[0]


def _points(grid: xr.Dataset) -> dict[str, list[Point]]:
    """Return where each run stands; a broadcast case stands at many points."""
    points: dict[str, list[Point]] = {}
    ids = grid["run_id"].values
    for point in np.ndindex(*ids.shape):
        if str(ids[point]):
            points.setdefault(str(ids[point]), []).append(point)
    return points


def _place(
    file: netCDF4.Dataset, grid: xr.Dataset, dims: tuple[str, ...], points: list[Point], run: xr.Dataset
) -> None:
    """Write one run's variables at its points, by label along dims of text, from the start along others."""
    for name, variable in run.variables.items():
        free = str(name) if str(name) in grid.variables else f"{name}_values"
        known = grid.variables.get(free)
        if known is None or not _by_run(known, dims) or known.dims[len(dims) :] != variable.dims:
            continue
        where = tuple(_where(grid, run, str(dim)) for dim in variable.dims)
        values = variable.values
        for point in points:
            if values.dtype.kind in "OUS":
                _put_texts(file[free], point, where, values)
            else:
                file[free][(*point, *where)] = values


def _where(grid: xr.Dataset, run: xr.Dataset, dim: str) -> Any:
    """Return the places of a run's values along one of its dims."""
    if dim in run.coords and dim in grid.indexes and run[dim].dtype.kind in "OUS":
        known = [str(label) for label in grid[dim].values]
        return [known.index(str(label)) for label in run[dim].values]
    return slice(0, run.sizes[dim])


def _put_texts(target: Any, point: Point, where: tuple[Any, ...], values: Any) -> None:
    places = [
        range(*w.indices(n)) if isinstance(w, slice) else w for w, n in zip(where, values.shape, strict=True)
    ]
    for index in np.ndindex(*values.shape):
        target[(*point, *(place[i] for place, i in zip(places, index, strict=True)))] = str(values[index])


def _zarr(grid: xr.Dataset, part: Path) -> None:
    """Write the grid through xarray, chunk by chunk.

    Raises
    ------
    StoreError : zarr is not installed
    """
    try:
        import zarr  # noqa: F401
    except ImportError:
        raise StoreError(
            "Zarr needs the package zarr: pip install 'wearlab[zarr]'; or name the file .nc"
        ) from None
    for name in [n for n, v in grid.variables.items() if v.dtype.kind == "O"]:
        grid[name] = grid[name].compute(scheduler="synchronous").astype(str)
    with dask.config.set(scheduler="synchronous"):
        grid.to_zarr(part, mode="w", zarr_format=2, consolidated=True)
