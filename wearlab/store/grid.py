"""A campaign as one lazy dataset: sweep axes, then ``case``, then the run's own dimensions.

Nothing is opened to build it: lengths, dims, dtypes, attributes and labels come from the catalogue. A point's
file is read when its chunk is computed. Position in the campaign places a run, so float noise in an axis
never splits it.
"""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import dask.array
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearlab.store.catalogue import Entry
from wearlab.store.image import read_variable
from wearlab.store.place import value_text

if TYPE_CHECKING:
    from wearlab.campaign import Axis, Campaign, Coordinate

BASE = "base"
MISSING = "missing"


@dataclass(frozen=True)
class Run:
    """One stored run, ready to be placed: its file, lengths, variables and labels."""

    path: str
    sizes: Mapping[str, int]
    variables: Mapping[str, dict[str, Any]]
    labels: Mapping[str, list[Any]]
    digests: Mapping[str, str]


@dataclass(frozen=True)
class Shape:
    """The run dimensions of a grid: longest lengths, and the labels that name places along them."""

    sizes: dict[str, int]
    labels: dict[str, list[Any]]
    by_label: frozenset[str]


@dataclass(frozen=True)
class Block:
    """Reads one variable of one run into its padded place; dask calls it with the block's index.

    Parameters
    ----------
    paths : file of each grid point, "" where there is none (grid shape)
    places : per grid point, the index along each run dim where the file's values go (None: from 0 on)
    name : the variable
    shape : its padded run dims
    dtype, fill : of the result
    """

    paths: NDArray[np.object_]
    places: NDArray[np.object_]
    name: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    fill: Any

    def __call__(self, block_id: tuple[int, ...]) -> NDArray[Any]:
        """Return the values of one grid point, padded."""
        point = block_id[: self.paths.ndim]
        result = np.full(self.shape, self.fill, self.dtype)
        if self.paths[point]:
            values = read_variable(self.paths[point], self.name)
            result[np.ix_(*self._where(point, values.shape))] = values
        return result.reshape((1,) * self.paths.ndim + self.shape)

    def _where(self, point: tuple[int, ...], lengths: tuple[int, ...]) -> list[NDArray[np.intp]]:
        given = self.places[point] or (None,) * len(lengths)
        return [
            np.arange(n) if index is None else np.asarray(index)
            for n, index in zip(lengths, given, strict=True)
        ]


def open_grid(
    campaign: "Campaign", entries: Mapping[str, Entry], layouts: Mapping[str, dict[str, Any]], runs: Path
) -> xr.Dataset:
    """Return the lazy dataset of a campaign.

    Parameters
    ----------
    campaign : its axes and cases
    entries : what the catalogue knows of its runs, by id
    layouts : the tables of variables that the entries name
    runs : path of a run's file is ``runs / id[:2] / (id + ".nc")``

    Returns
    -------
    Dataset, one dask chunk per run and variable (one in all for a coordinate that the runs share);
    ``status``, ``run_id`` and ``n_updates`` over the grid dims;
    points without data are NaN (text: "") and named in ``attrs["missing"]``.
    """
    axes = grid_axes(campaign)
    ids = _ids(campaign, axes)
    done = {
        run_id: _run(entry, layouts[entry.layout or ""], runs)
        for run_id, entry in entries.items()
        if entry.state == "done"
    }
    shape = _shape(list(done.values()))
    dims = tuple(axes)
    status = _map(ids, lambda i: entries[i].state if i in entries else (MISSING if i else ""), object)
    updates = _map(ids, lambda i: done[i].sizes.get("update", 1) if i in done else 0, np.int64)
    grid = xr.Dataset(
        {
            "status": (dims, status.astype(str), {"long_name": "state of the run"}),
            "run_id": (dims, ids.astype(str), {"long_name": "identity of the run"}),
            "n_updates": (dims, updates, {"long_name": "number of wear states of the run"}),
        },
        coords=_axis_coordinates(campaign, axes),
    )
    for name in dict.fromkeys(name for run in done.values() for name in run.variables):
        _add(grid, name, ids, done, shape, dims)
    grid.attrs = {
        "title": campaign.title,
        "references": campaign.reference or "",
        "missing": _missing(axes, ids, status),
    }
    return grid


def grid_axes(campaign: "Campaign") -> dict[str, list[Any]]:
    """Return the grid's dims and the values along them: sweep axes, then ``case`` where there are cases."""
    axes = {axis.name: list(axis.values) for axis in campaign.axes}
    labels = list(dict.fromkeys(case.label for case in campaign.cases))
    if labels != [BASE]:
        axes["case"] = sorted(labels, key=lambda label: label != BASE)
    return axes


def _ids(campaign: "Campaign", axes: Mapping[str, list[Any]]) -> NDArray[np.object_]:
    """Return the run id of every grid point, "" where the campaign has none; unswept cases are broadcast."""
    ids = np.full([len(values) for values in axes.values()], "", object)
    for case in campaign.cases:
        place = {**case.position, **({"case": axes["case"].index(case.label)} if "case" in axes else {})}
        ids[tuple(place.get(name, slice(None)) for name in axes)] = case.id
    return ids


def _run(entry: Entry, layout: Mapping[str, Any], runs: Path) -> Run:
    path = runs / entry.id[:2] / f"{entry.id}.nc"
    return Run(str(path), entry.sizes, layout["variables"], layout["labels"], entry.digests)


def _shape(runs: Sequence[Run]) -> Shape:
    """Join the run dims: the union of names along a dim of text, the longest of the others."""
    sizes: dict[str, int] = {}
    labels: dict[str, list[Any]] = {}
    for run in runs:
        for dim, size in run.sizes.items():
            sizes[dim] = max(size, sizes.get(dim, 0))
    by_label = set()
    for dim in sizes:
        known = [run.labels[dim] for run in runs if dim in run.labels]
        if not known:
            continue
        if isinstance(known[0][0] if known[0] else "", str):
            by_label.add(dim)
            labels[dim] = list(dict.fromkeys(label for some in known for label in some))
            sizes[dim] = len(labels[dim])
        elif (longest := max(known, key=len)) and all(some == longest[: len(some)] for some in known):
            labels[dim] = longest
    return Shape(sizes, labels, frozenset(by_label))


def _add(
    grid: xr.Dataset,
    name: str,
    ids: NDArray[np.object_],
    done: Mapping[str, Run],
    shape: Shape,
    dims: tuple[str, ...],
) -> None:
    """Put one variable into the grid: shared labels as they are, everything else as a lazy array."""
    first = next(run.variables[name] for run in done.values() if name in run.variables)
    own = tuple(first["dims"])
    if own == (name,) and name in shape.labels:
        grid.coords[name] = ((name,), shape.labels[name], first["attrs"])
        return
    if _is_shared(name, done.values()):  # one file answers for all, and the grid dims do not matter
        ids, dims = np.array(next(iter(done)), object), ()
    holders = {
        i: run for i, run in done.items() if tuple(run.variables.get(name, {}).get("dims", "?")) == own
    }
    padded = tuple(shape.sizes[dim] for dim in own)
    whole = set(ids.flat) <= set(holders) and all(
        run.sizes[dim] == shape.sizes[dim] for run in holders.values() for dim in own
    )
    dtype, fill = _dtype(first["dtype"], whole)
    block = Block(
        _map(ids, lambda i: holders[i].path if i in holders else "", object),
        _map(ids, lambda i: _places(holders[i], own, shape) if i in holders else None, object),
        *(name, padded, dtype, fill),
    )
    data = dask.array.map_blocks(
        block,
        name=f"{name}-{_digest(repr((block.paths.tolist(), padded, block.places.tolist())))}",
        chunks=tuple((1,) * n for n in ids.shape) + tuple((n,) for n in padded),
        dtype=dtype,
        meta=np.empty((0,) * (ids.ndim + len(own)), dtype),
    )
    # a coordinate that bears its dimension's name but differs from run to run cannot be an index
    free = f"{name}_values" if name in own else name
    grid[free] = (dims + own, data, first["attrs"])
    if first["coordinate"]:
        grid.coords[free] = grid[free]


def _is_shared(name: str, runs: Iterable[Run]) -> bool:
    """Say whether a coordinate has the same values in every run."""
    digests = {run.digests.get(name) for run in runs}
    return len(digests) == 1 and None not in digests


def _places(run: Run, own: tuple[str, ...], shape: Shape) -> tuple[list[int] | None, ...] | None:
    """Return where the run's values go along each of its dims, None where they simply start at 0."""
    places = tuple(
        _place(run.labels.get(dim), shape.labels[dim]) if dim in shape.by_label else None for dim in own
    )
    return places if any(place is not None for place in places) else None


def _place(labels: list[Any] | None, union: list[Any]) -> list[int] | None:
    if labels is None or labels == union[: len(labels)]:
        return None
    return [union.index(label) for label in labels]


def _dtype(stored: str, whole: bool) -> tuple[np.dtype[Any], Any]:
    """Return dtype and filling: text stays text, numbers with holes become float64."""
    if stored == "str":
        return np.dtype(object), ""
    return (np.dtype(stored), 0) if whole and np.dtype(stored).kind != "f" else (np.dtype(float), np.nan)


def _axis_coordinates(campaign: "Campaign", axes: Mapping[str, list[Any]]) -> dict[str, Any]:
    coordinates: dict[str, Any] = {}
    for axis in campaign.axes:
        own: list[tuple[str, Axis | Coordinate]] = [(axis.name, axis), *axis.coordinates.items()]
        for name, one in own:
            units = {} if not one.units else {"units": one.units}
            coordinates[name] = (axis.name, list(one.values), {**units, "key": one.key})
    if "case" in axes:
        coordinates["case"] = ("case", axes["case"])
    return coordinates


def _missing(axes: Mapping[str, list[Any]], ids: NDArray[np.object_], status: NDArray[Any]) -> list[str]:
    """Name every grid point that has a run but no data."""
    names = []
    for point in np.ndindex(ids.shape):
        if ids[point] and status[point] != "done":
            places = zip(axes, point, strict=True)
            where = ", ".join(f"{name}={value_text(axes[name][i], None)}" for name, i in places)
            names.append(f"{where or ids[point]}: {status[point]}")
    return names


def _map(ids: NDArray[np.object_], function: Any, dtype: Any) -> NDArray[Any]:
    result = np.empty(ids.shape, dtype)
    for point in np.ndindex(ids.shape):
        result[point] = function(ids[point])
    return result


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]
