"""The runs that a figure shows: picked from a campaign's grid, loaded without padding, narrowed by select."""

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from wearlab import nearest, schema
from wearlab.figures import doubt, plot
from wearlab.figures.kind import FigureError, FigureRequest, Run
from wearlab.figures.wording import Label, converted, cycles, place
from wearlab.query.evaluate import index_of_quantity
from wearlab.store.grid import key_text, own_values
from wearlab.units import is_number

STATE_COORDINATES = ("cycle", "mesh_cycles")


def index_of(
    asked: Any,
    values: Sequence[Any],
    dim: str,
    name: str,
    units: str | None = None,
    key: str = "",
) -> list[int]:
    """Return the indices of a label, or of a list of labels, along a dimension.

    Parameters
    ----------
    asked : a label, a list of labels, or a quantity with its unit
    values : the labels there are
    dim, name : the dimension and the figure, for the message
    units : unit of the values, when they have one
    key : dotted key of a scene that the values were given to, when they were
    """
    indices = []
    for label in _several(asked):
        index = index_of_quantity(label, values, units, key)
        if index is None:
            unit = f" {units}" if units else ""
            shown = [
                f"{value:g}{unit}" if is_number(value) else str(value)
                for value in values
            ]
            said = (
                f"select.{dim} = {label!r} is not there; "
                f"{nearest.choices(label, shown)}"
            )
            raise FigureError(f"{name}: {said}")
        indices.append(index)
    return indices


def _several(asked: Any) -> list[Any]:
    return list(asked) if isinstance(asked, list | tuple) else [asked]


def narrow(data: xr.Dataset, request: FigureRequest, grid_dims: set[str]) -> xr.Dataset:
    """Return the run with only the selected places of its own dimensions.

    ``update`` counts from 0 (−1 is the last); ``cycle`` and ``mesh_cycles`` take the
    nearest wear state; other dimensions go by label, or by position where they have
    none.

    Raises
    ------
    FigureError : an unknown dimension or label
    """
    for key, asked in request.select.items():
        if key in grid_dims or (key, asked) == ("case", "base"):
            continue
        if key == "update" or (key in STATE_COORDINATES and key in data.variables):
            if "update" in data.dims:
                data = data.isel(update=_states(_several(asked), data, key, request))
        elif key in data.dims:
            places = data[key]  # counted from 0 where it has no coordinate
            units = places.attrs.get("units")
            data = data.isel(
                {key: index_of(asked, list(places.values), key, request.name, units)}
            )
        elif key not in schema.DIMENSIONS:
            valid = sorted({*grid_dims, *map(str, data.dims), *STATE_COORDINATES})
            raise request.error(
                f"select.{key}: no such dimension; {nearest.choices(key, valid)}"
            )
    return data


def _states(
    asked: list[Any], data: xr.Dataset, key: str, request: FigureRequest
) -> list[int]:
    """Return the wear states of numbers, or those next to counts of cycles."""
    if key != "update":
        if not all(map(is_number, asked)):
            raise request.error(
                f"select.{key} = {request.select[key]!r} is not a number of cycles, such "
                "as 2e7"
            )
        return list(
            dict.fromkeys(
                int(np.nanargmin(np.abs(data[key].values - float(n)))) for n in asked
            )
        )
    count = data.sizes["update"]
    for index in asked:
        if not isinstance(index, int) or not -count <= index < count:
            raise request.error(
                f"select.{key} = {index!r} is not there; valid: 0 to {count - 1}, -1 "
                "is the last"
            )
    return [index % count for index in asked]


BASE = "base"
COUNT = "n_updates"
COORDINATES = (
    "cycle",
    "mesh_cycles",
    "operating_hours",
    "preset_depth",
    "path_position",
    "diameter",
    "roll_angle",
    "distance_to_pitch_circle",
    "characteristic_point",
    "phase",
    "contact_ratio",
    "max_wear_depth",
)


Point = tuple[dict[str, int], dict[str, Label], str]
"""A run in a grid: its place, the labels there, its id."""


def pick(
    grid: xr.Dataset, request: FigureRequest, *, all_cases: bool
) -> tuple[list[Point], list[str]]:
    """Return the selected points of a grid that have data, a broadcast case once, and the names of others.

    Parameters
    ----------
    grid : the campaign's dataset
    request : its ``select`` narrows the grid dimensions
    all_cases : whether every case is shown when ``select`` names none; else ``base``

    Raises
    ------
    FigureError : a label that the grid does not have, or nothing left
    """
    dims = [str(dim) for dim in grid.run_id.dims]
    ids = grid.run_id.values
    status = grid.status.values
    wanted = [_wanted(grid, dim, request, all_cases) for dim in dims]
    unsaid = (
        ()
        if "case" in (request.hue, request.rows, request.cols, request.x)
        else (BASE,)
    )
    picked: dict[object, Point] = {}
    missing: dict[str, None] = {}
    for point in itertools.product(*wanted):
        run_id = str(ids[point])
        if not run_id:
            continue
        labels, repeated = _labels(grid, dims, point)
        if status[point] == "done":
            place = dict(zip(dims, point, strict=True))
            picked.setdefault(
                labels["case"] if repeated else point, (place, labels, run_id)
            )
        else:
            told = dict.fromkeys(
                x.text for x in labels.values() if x.value not in unsaid
            )
            missing[f"{', '.join(told) or run_id[:12]}: {status[point]}"] = None
    if not picked and not missing:
        raise request.error(f"select = {dict(request.select)} leaves no run")
    if not picked:
        raise request.error(
            f"none of its runs is there to be drawn: {'; '.join(missing)}"
        )
    return list(picked.values()), list(missing)


def _wanted(
    grid: xr.Dataset, dim: str, request: FigureRequest, all_cases: bool
) -> list[int]:
    values = list(grid[dim].values)
    if dim in request.select:
        units = grid[dim].attrs.get("units")
        key = grid[dim].attrs.get("key")
        return index_of(
            request.select[dim], values, dim, request.name, units, key or ""
        )
    if (
        dim == "case"
        and BASE in values
        and not (
            all_cases or "case" in (request.hue, request.rows, request.cols, request.x)
        )
    ):
        return [values.index(BASE)]
    return list(range(len(values)))


def _labels(
    grid: xr.Dataset, dims: Sequence[str], point: tuple[int, ...]
) -> tuple[dict[str, Label], bool]:
    """Return the labels of a point, and whether it is one of a case that is repeated along every axis.

    Such a case bears its own label along them; the base is called by what it is, where
    the grid says that.
    """
    at = zip(dims, point, strict=True)
    labels = {
        dim: place(dim, grid[dim].values[i], grid[dim].attrs.get("units"))
        for dim, i in at
    }
    case = labels.get("case")
    if case is None or case.value == BASE:
        known = (
            {"case": Label(BASE, str(grid["case"].attrs.get("base", BASE)))}
            if case
            else {}
        )
        return labels | known, False
    index = tuple(
        at if dim == "case" else slice(None)
        for dim, at in zip(dims, point, strict=True)
    )
    own = own_values(grid)
    ids = grid.run_id.values[index]
    repeated = (
        case.value in own
        if own
        else bool(ids.size > 1 and len(set(ids.flat) - {""}) == 1)
    )
    return ({dim: case for dim in dims} if repeated else labels), repeated


def read_runs(
    grid: xr.Dataset,
    points: Sequence[Point],
    names: Iterable[str],
    request: FigureRequest,
) -> list[Run]:
    """Read what a figure needs, of all runs at once, narrowed by ``select``.

    Variables that a run does not have are left out of its dataset. What any figure
    needs stays in a grid of which all runs are shown: it is read once for all its
    figures.
    """
    if len(set(map(str, grid.run_id.values.flat)) - {""}) == len(points):
        always = [
            name for name in (*COORDINATES, *doubt.WITNESSES) if name in grid.variables
        ]
        grid[always].load(scheduler="synchronous")
    grid = grid.rename(
        {f"{name}_values": name for name in ("phase",) if f"{name}_values" in grid}
    )
    names = list(names)
    axes = along_axes(grid)
    dims = [str(dim) for dim in grid.run_id.dims]
    wanted = dict.fromkeys((*names, *COORDINATES, *doubt.read_for(names), *axes, COUNT))
    places = {
        dim: xr.Variable("picked", [point[dim] for point, _, _ in points])
        for dim in dims
    }
    box = grid[[name for name in wanted if name in grid.variables]].isel(places)
    box = box.compute(scheduler="synchronous")
    keys = {n: grid[n].attrs.get("key") for n in axes if grid[n].dtype.kind in "fiu"}
    words = {
        n: key_text(str(keys.get(n) or n)) for n in axes
    }  # numbers by the key they were given to
    scales = {
        name: plot.Scale(text, str(grid[name].attrs.get("units", "1")))
        for name, text in words.items()
    }
    own = own_values(grid)
    runs = []
    for number, (_, labels, run_id) in enumerate(points):
        whole = box.isel({"picked": number}, missing_dims="ignore")
        values = {name: whole[name].values.item() for name in axes if name not in dims}
        beside = {
            name: place(name, value, grid[name].attrs.get("units"))
            for name, value in values.items()
        }
        case = labels.get("case")
        given = dict[str, float]()
        if case is not None and (mine := own.get(str(case.value))) is not None:
            beside = dict.fromkeys(beside, case)
            given = {
                name: float(v) for name, v in mine.items() if isinstance(v, int | float)
            }
        full = _without_absent(
            whole.isel(update=slice(int(whole[COUNT])), missing_dims="ignore"), dims
        )
        told = ({**labels, **beside}, scales, given, doubt.doubts(full))
        runs.append(Run(run_id, labels, narrow(full, request, set(dims)), (), *told))
    return _with_states(runs)


def along_axes(grid: xr.Dataset) -> list[str]:
    """Return the axes of a grid and the coordinates along them, whose values a figure can be drawn over."""
    dims = [str(dim) for dim in grid.run_id.dims]
    beside = [
        str(name)
        for name, v in grid.coords.items()
        if len(v.dims) == 1 and v.dims[0] in dims
    ]
    return list(
        dict.fromkeys((*dims, *(name for name in beside if "key" in grid[name].attrs)))
    )


def axis_named(grid: xr.Dataset, name: str) -> str:
    """Return the axis or coordinate that a name means: itself, or the one of a key that ends so."""
    if name in grid.variables or name in grid.dims:
        return name
    keys = {axis: str(grid[axis].attrs.get("key", "")) for axis in along_axes(grid)}
    meant = [
        axis for axis, key in keys.items() if key == name or key.endswith(f".{name}")
    ]
    return meant[0] if len(meant) == 1 else name


def _without_absent(data: xr.Dataset, dims: Iterable[str]) -> xr.Dataset:
    """Drop the places in the grid, variables that it only padded, mesh periods that no state reaches."""
    absent = [
        name
        for name, v in data.variables.items()
        if name not in data.dims and _is_void(v)
    ]
    data = data.drop_vars([*absent, *dims, COUNT], errors="ignore")
    along = [v.notnull() for v in data.data_vars.values() if "mesh_period" in v.dims]
    held = [
        v.any([dim for dim in v.dims if dim != "mesh_period"]).values for v in along
    ]
    return data.isel(mesh_period=np.any(held, axis=0)) if held else data


def _is_void(variable: xr.Variable) -> bool:
    if variable.dtype.kind == "f":
        return bool(np.isnan(variable.values).all())
    return variable.dtype.kind in "OU" and not any(variable.values.flat)


def _with_states(runs: list[Run]) -> list[Run]:
    """Name wear states by preset depth, or by cycles with the hours where equal cycles took equal hours."""
    named = [_cycle_labels(run.data) for run in runs]
    hours = [() if _preset_labels(run.data) else _hours(run.data) for run in runs]
    pairs = {
        pair
        for both in zip(named, hours, strict=True)
        for pair in zip(*both, strict=False)
    }
    worn = {label: text for label, text in pairs if label.value != 0.0}
    equal = len(worn) == sum(label.value != 0.0 for label, _ in pairs)
    said = {
        x: Label(x.value, f"{x.text} ({text})") for x, text in worn.items() if equal
    }
    states = [tuple(said.get(label, label) for label in labels) for labels in named]
    return [replace(run, states=own) for run, own in zip(runs, states, strict=True)]


def _hours(data: xr.Dataset) -> tuple[str, ...]:
    """Return the operating time of every wear state, in words."""
    if "operating_hours" not in data or data["operating_hours"].dims != ("update",):
        return ()
    units = str(data["operating_hours"].attrs.get("units", "h"))
    values = converted(data["operating_hours"].values, units, "h")
    rounded = (float(f"{value:.3g}") for value in values)
    return tuple(
        f"{value:g} h" if value < 1000.0 else f"{value:,.0f} h" for value in rounded
    )


def _preset_labels(data: xr.Dataset) -> list[Label]:
    """Name wear states by the depth that they were asked for by, none unless all worn ones were."""
    if "preset_depth" not in data or data.preset_depth.dims != ("update", "flank"):
        return []
    count = int(np.isfinite(np.atleast_1d(data.cycle.values)).sum())
    asked = converted(
        data.preset_depth.values[:count],
        str(data.preset_depth.attrs.get("units", "m")),
        "um",
    )
    known = np.isfinite(asked)
    if not known[1:].any(axis=1).all() or count < 2:
        return []
    place = np.where(known, asked, -1.0).argmax(axis=1)
    told = zip(asked[np.arange(count), place], data.flank.values[place], strict=True)
    labels = [Label(float(depth), f"{depth:g} µm on {flank}") for depth, flank in told]
    return labels if known[0].any() else [Label(0.0, "first state"), *labels[1:]]


def _cycle_labels(data: xr.Dataset) -> tuple[Label, ...]:
    if "cycle" not in data:
        return tuple(
            Label(i, f"wear state {i}") for i in range(data.sizes.get("update", 1))
        )
    depth = data.get("max_wear_depth")
    unworn = depth is not None and not np.any(
        depth.values.reshape(data.cycle.size, -1)[0]
    )
    labels = [
        cycles(float(count))
        for count in np.atleast_1d(data.cycle.values)
        if not math.isnan(count)
    ]
    labels = _preset_labels(data) or labels
    if unworn and labels and labels[0].value == 0.0:
        labels[0] = Label(0.0, "unworn")
    return tuple(labels)


def require(
    runs: list[Run],
    names: Sequence[str],
    request: FigureRequest,
    ended: Mapping[str, int],
) -> list[Run]:
    """Return the runs that have all these variables.

    ``ended`` counts what ended the lives of the others.

    Raises
    ------
    FigureError : none has
    """
    able = [run for run in runs if all(name in run.data.variables for name in names)]
    if able:
        return able
    absent = [
        name for name in names if not any(name in run.data.variables for run in runs)
    ] or list(names)
    lacking = f"no selected run has {' and '.join(absent)}"
    made = list(
        dict.fromkeys(
            schema.origin_of(name)[1] for name in absent if name in schema.VARIABLES
        )
    )
    if {*absent} <= {
        "life",
        "service_life",
        "remaining_useful_life",
        "error_estimate_life",
    } and ended:
        by = ", ".join(f"{count} by {reason}" for reason, count in ended.items())
        why = (
            f"all ended before the depth of wear.until ({by}); y = 'max_wear_depth' "
            "shows how far they came"
        )
        raise request.error(f"{lacking}: {why}")
    names = sorted({str(name) for run in runs for name in run.data.data_vars})
    known = (
        f"it takes {' and '.join(made)}" if made else nearest.choices(absent[0], names)
    )
    raise request.error(f"{lacking}; {known}")
