"""The runs that a figure shows, picked from a grid and narrowed by select."""

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from wearlab import nearest, schema
from wearlab.figures import doubt, plot
from wearlab.figures.kind import FigureError, FigureRequest, LifeEnd, Run
from wearlab.figures.wording import Label, converted, cycles, place
from wearlab.query.evaluate import index_of_quantity
from wearlab.store.grid import key_text, own_values
from wearlab.units import UnitError, convert, is_number, split

STATE_COORDINATES = ("cycle", "mesh_cycles")
FACE_COORDINATE = "face_position"
BASE = "base"
COUNT = "n_updates"
END_REASON = "end_reason"
WORN_OUT = "depth"
"""End reason of a life that reached its depth limit, as runs store it."""
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
    "face_position",
    "phase",
    "contact_ratio",
    "max_wear_depth",
)
OF_WORN_OUT = {
    "life",
    "service_life",
    "remaining_useful_life",
    "error_estimate_life",
}
"""Results of lives that reached the depth of ``wear.until``."""


def index_of(
    selected: Any,
    values: Sequence[Any],
    dim: str,
    name: str,
    units: str | None = None,
    key: str = "",
) -> list[int]:
    """Return the indices of a label, or of a list of labels, along a dimension.

    Parameters
    ----------
    selected : a label, a list of labels, or a quantity with its unit
    values : the labels there are
    dim, name : the dimension and the figure, for the message
    units : unit of the values, when they have one
    key : dotted key of a scene that the values were given to, when they were

    Raises
    ------
    FigureError : a label that is not there
    """
    indices = []
    for label in _listed(selected):
        index = index_of_quantity(label, values, units, key)
        if index is None:
            valid = [_with_unit(value, units) for value in values]
            raise FigureError(
                f"{name}: select.{dim} = {label!r} is not there; "
                f"{nearest.choices(label, valid)}"
            )
        indices.append(index)
    return indices


def _with_unit(value: Any, units: str | None) -> str:
    """Return a label as a campaign file may name it: a number with its unit."""
    if not is_number(value):
        return str(value)
    return f"{value:g} {units}" if units else f"{value:g}"


def _listed(selected: Any) -> list[Any]:
    """Return what was selected as a list, also where it is a single label."""
    return list(selected) if isinstance(selected, list | tuple) else [selected]


def narrow(data: xr.Dataset, request: FigureRequest, grid_dims: set[str]) -> xr.Dataset:
    """Return the run with only the selected places of its own dimensions.

    ``update`` counts from 0 (−1 is the last); ``cycle`` and ``mesh_cycles`` take the
    nearest wear state, ``face_position`` the nearest slice [mm]; other dimensions go by
    label, or by position where they have none.

    Parameters
    ----------
    data : variables of a run
    request : its ``select`` names places by dimension
    grid_dims : dimensions of the campaign's grid, which are none of the run's

    Raises
    ------
    FigureError : an unknown dimension or label
    """
    for key, selected in request.select.items():
        if key in grid_dims or (key, selected) == ("case", "base"):
            continue
        names_states = key in STATE_COORDINATES and key in data.variables
        if key == "update" or names_states:
            if "update" in data.dims:
                states = _states(_listed(selected), data, key, request)
                data = data.isel(update=states)
        elif key == FACE_COORDINATE and key in data.variables:
            if "face" in data.dims:
                slices = _slices_of_face(_listed(selected), data, request)
                data = data.isel(face=slices)
        elif key in data.dims:
            places = data[key]  # counted from 0 where it has no coordinate
            units = places.attrs.get("units")
            values = list(places.values)
            indices = index_of(selected, values, key, request.name, units)
            data = data.isel({key: indices})
        elif key not in schema.DIMENSIONS:
            own = (*map(str, data.dims), *STATE_COORDINATES, FACE_COORDINATE)
            valid = sorted({*grid_dims, *own})
            raise request.error(
                f"select.{key}: no such dimension; {nearest.choices(key, valid)}"
            )
    return data


def _slices_of_face(
    selected: list[Any], data: xr.Dataset, request: FigureRequest
) -> list[int]:
    """Return the slices of a face that are nearest to places from mid-face."""
    places = data[FACE_COORDINATE].values
    slices = []
    for place_text in selected:
        try:
            at = _metres(place_text)
        except UnitError as error:
            raise request.error(
                f"select.{FACE_COORDINATE} = {place_text!r}: {error}; such as '5 mm'"
            ) from None
        slices.append(int(np.argmin(np.abs(places - at))))
    return list(dict.fromkeys(slices))


def _metres(selected: Any) -> float:
    """Return a place on the face, a number in millimetres or with its unit, in SI."""
    if is_number(selected):
        return 1e-3 * float(selected)
    number, unit = split(str(selected))
    return float(convert(float(number), unit or "mm", "m"))


def _states(
    selected: list[Any], data: xr.Dataset, key: str, request: FigureRequest
) -> list[int]:
    """Return the wear states of numbers, or those next to counts of cycles."""
    if key == "update":
        return _numbered_states(selected, data.sizes["update"], request)
    if not all(map(is_number, selected)):
        raise request.error(
            f"select.{key} = {request.select[key]!r} is not a number of cycles, "
            "such as 2e7"
        )
    cycles = data[key].values
    nearest_states = [
        int(np.nanargmin(np.abs(cycles - float(count)))) for count in selected
    ]
    return list(dict.fromkeys(nearest_states))


def _numbered_states(
    selected: list[Any], count: int, request: FigureRequest
) -> list[int]:
    """Return wear states by their numbers, those below 0 counted from the end."""
    for index in selected:
        if not isinstance(index, int) or not -count <= index < count:
            raise request.error(
                f"select.update = {index!r} is not there; valid: 0 to {count - 1}, -1 "
                "is the last"
            )
    return [index % count for index in selected]


class Point(NamedTuple):
    """A run in a grid.

    Parameters
    ----------
    place : its index along each dimension of the grid
    labels : its label along each of them
    run_id : its identity
    """

    place: dict[str, int]
    labels: dict[str, Label]
    run_id: str


class _PointLabels(NamedTuple):
    """Labels of a point, and whether its case is repeated along every axis."""

    labels: dict[str, Label]
    repeated: bool


def pick(
    grid: xr.Dataset, request: FigureRequest, *, all_cases: bool
) -> tuple[list[Point], list[str]]:
    """Return the selected points of a grid that have data, and names of those without.

    A case that is repeated along every axis is picked once.

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
    reason = grid.reason.values if "reason" in grid else np.full(ids.shape, "")
    indices = [_selected_indices(grid, dim, request, all_cases) for dim in dims]
    names_cases = "case" in _roles_and_x(request)

    picked: dict[object, Point] = {}
    missing: dict[str, None] = {}
    for index in itertools.product(*indices):
        run_id = str(ids[index])
        if not run_id:
            continue
        labels, repeated = _labels(grid, dims, index)
        if status[index] == "done":
            place = dict(zip(dims, index, strict=True))
            identity = labels["case"] if repeated else index
            picked.setdefault(identity, Point(place, labels, run_id))
        else:
            name = _name_of_missing(labels, names_cases) or run_id[:12]
            is_older = status[index] == "missing" and reason[index]
            state = reason[index] if is_older else status[index]
            missing[f"{name}: {state}"] = None

    if not picked and not missing:
        raise request.error(f"select = {dict(request.select)} leaves no run")
    if not picked:
        raise request.error(
            f"none of its runs is there to be drawn: {'; '.join(missing)}"
        )
    return list(picked.values()), list(missing)


def _roles_and_x(request: FigureRequest) -> tuple[str | None, ...]:
    """Return the names that a figure gives to its hue, rows, columns and x."""
    return (request.hue, request.rows, request.cols, request.x)


def _name_of_missing(labels: Mapping[str, Label], names_cases: bool) -> str:
    """Return the name of a run by its labels; the base only where cases are named."""
    texts = [
        label.text for label in labels.values() if names_cases or label.value != BASE
    ]
    return ", ".join(dict.fromkeys(texts))


def _selected_indices(
    grid: xr.Dataset, dim: str, request: FigureRequest, all_cases: bool
) -> list[int]:
    """Return the selected places along a dimension of the grid."""
    values = list(grid[dim].values)
    if dim in request.select:
        units = grid[dim].attrs.get("units")
        key = grid[dim].attrs.get("key") or ""
        selected = request.select[dim]
        return index_of(selected, values, dim, request.name, units, key)

    shows_cases = all_cases or "case" in _roles_and_x(request)
    if dim == "case" and BASE in values and not shows_cases:
        return [values.index(BASE)]
    return list(range(len(values)))


def _labels(
    grid: xr.Dataset, dims: Sequence[str], index: tuple[int, ...]
) -> _PointLabels:
    """Return the labels of a point.

    A case that is repeated along every axis bears its own label along them; the base is
    called by what it is, where the grid says that.
    """
    places = dict(zip(dims, index, strict=True))
    labels = {
        dim: place(dim, grid[dim].values[i], grid[dim].attrs.get("units"))
        for dim, i in places.items()
    }
    case = labels.get("case")
    if case is None:
        return _PointLabels(labels, repeated=False)
    if case.value == BASE:
        labels["case"] = Label(BASE, str(grid["case"].attrs.get("base", BASE)))
        return _PointLabels(labels, repeated=False)

    if _is_repeated(grid, case, places):
        return _PointLabels(dict.fromkeys(dims, case), repeated=True)
    return _PointLabels(labels, repeated=False)


def _is_repeated(grid: xr.Dataset, case: Label, places: Mapping[str, int]) -> bool:
    """Say whether a case is one run that is repeated along every axis."""
    case_values = own_values(grid)
    if case_values:
        return case.value in case_values
    index = tuple(i if dim == "case" else slice(None) for dim, i in places.items())
    ids = grid.run_id.values[index]
    return bool(ids.size > 1 and len(set(ids.flat) - {""}) == 1)


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

    Parameters
    ----------
    grid : the campaign's dataset
    points : the runs that were picked
    names : variables that the figure needs
    request : its ``select`` narrows the dimensions of the runs
    """
    if len(set(map(str, grid.run_id.values.flat)) - {""}) == len(points):
        _load_common(grid)
    if "phase_values" in grid:
        grid = grid.rename({"phase_values": "phase"})

    axes = along_axes(grid)
    dims = [str(dim) for dim in grid.run_id.dims]
    picked = _read_picked(grid, points, list(names), axes)
    scales = _scales_of_axes(grid, axes)
    case_values = own_values(grid)

    runs = []
    for number, point in enumerate(points):
        data = picked.isel({"picked": number}, missing_dims="ignore")
        case = point.labels.get("case")
        values_of_case = case_values.get(str(case.value)) if case is not None else None
        if case is not None and values_of_case is not None:
            beside = dict.fromkeys((axis for axis in axes if axis not in dims), case)
        else:
            beside = _labels_beside(grid, data, axes, dims)

        states = slice(int(data[COUNT]))
        reached = data.isel(update=states, missing_dims="ignore")
        present = _without_absent(reached, dims)
        runs.append(
            Run(
                id=point.run_id,
                place=point.labels,
                data=narrow(present, request, set(dims)),
                along={**point.labels, **beside},
                scales=scales,
                case_values=_numbers_in(values_of_case or {}),
                doubts=doubt.doubts(present),
                end=_early_end(present),
            )
        )
    return _with_states(runs)


def _early_end(data: xr.Dataset) -> LifeEnd | None:
    """Return how far a life came, None where it reached its limit or has none."""
    reason = str(data[END_REASON].values) if END_REASON in data else ""
    if reason in ("", WORN_OUT) or "cycle" not in data:
        return None
    seconds = np.nan
    if "operating_hours" in data:
        seconds = float(np.max(data["operating_hours"].values))
    return LifeEnd(reason, float(np.max(data["cycle"].values)), seconds)


def _load_common(grid: xr.Dataset) -> None:
    """Read what any figure needs into the grid itself."""
    names = (*COORDINATES, *doubt.WITNESSES, END_REASON)
    common = [name for name in names if name in grid.variables]
    grid[common].load(scheduler="synchronous")


def _read_picked(
    grid: xr.Dataset, points: Sequence[Point], names: list[str], axes: list[str]
) -> xr.Dataset:
    """Return the needed variables of all picked runs, along a dimension ``picked``."""
    witnesses = doubt.variables_for(names)
    common = (*COORDINATES, END_REASON, COUNT)
    needed = dict.fromkeys((*names, *common, *witnesses, *axes))
    places = {
        str(dim): xr.Variable("picked", [point.place[str(dim)] for point in points])
        for dim in grid.run_id.dims
    }
    box = grid[[name for name in needed if name in grid.variables]].isel(places)
    return box.compute(scheduler="synchronous")


def _scales_of_axes(grid: xr.Dataset, axes: Sequence[str]) -> dict[str, plot.Scale]:
    """Return what each axis shows; axes of numbers are called by their keys."""
    scales = {}
    for name in axes:
        is_numeric = grid[name].dtype.kind in "fiu"
        key = grid[name].attrs.get("key") if is_numeric else None
        units = str(grid[name].attrs.get("units", "1"))
        scales[name] = plot.Scale(key_text(str(key or name)), units)
    return scales


def _labels_beside(
    grid: xr.Dataset, data: xr.Dataset, axes: Sequence[str], dims: Sequence[str]
) -> dict[str, Label]:
    """Return a run's label of each key that advances with an axis."""
    return {
        name: place(name, data[name].values.item(), grid[name].attrs.get("units"))
        for name in axes
        if name not in dims
    }


def _numbers_in(values: Mapping[str, Any]) -> dict[str, float]:
    """Return those of some values that are numbers."""
    return {
        name: float(value)
        for name, value in values.items()
        if isinstance(value, int | float)
    }


def along_axes(grid: xr.Dataset) -> list[str]:
    """Return the axes of a grid and the coordinates along them.

    Their values are what a figure can be drawn over.

    Parameters
    ----------
    grid : the campaign's dataset
    """
    dims = [str(dim) for dim in grid.run_id.dims]
    beside = [
        str(name)
        for name, coordinate in grid.coords.items()
        if len(coordinate.dims) == 1
        and coordinate.dims[0] in dims
        and "key" in coordinate.attrs
    ]
    return list(dict.fromkeys((*dims, *beside)))


def axis_named(grid: xr.Dataset, name: str) -> str:
    """Return the axis that a name means: itself, or the one of a key that ends so.

    Parameters
    ----------
    grid : the campaign's dataset
    name : of an axis or coordinate, or the end of the key that it varies
    """
    if name in grid.variables or name in grid.dims:
        return name
    keys = {axis: str(grid[axis].attrs.get("key", "")) for axis in along_axes(grid)}
    matches = [
        axis for axis, key in keys.items() if key == name or key.endswith(f".{name}")
    ]
    return matches[0] if len(matches) == 1 else name


def _without_absent(data: xr.Dataset, dims: Iterable[str]) -> xr.Dataset:
    """Drop places in the grid, and variables and mesh periods that it only padded."""
    absent = [
        name
        for name, variable in data.variables.items()
        if name not in data.dims and _is_void(variable)
    ]
    data = data.drop_vars([*absent, *dims, COUNT], errors="ignore")

    reached = []
    for variable in data.data_vars.values():
        if "mesh_period" in variable.dims:
            further = [dim for dim in variable.dims if dim != "mesh_period"]
            reached.append(variable.notnull().any(further).values)
    return data.isel(mesh_period=np.any(reached, axis=0)) if reached else data


def _is_void(variable: xr.Variable) -> bool:
    """Say whether a variable has no value at all."""
    if variable.dtype.kind == "f":
        return bool(np.isnan(variable.values).all())
    return variable.dtype.kind in "OU" and not any(variable.values.flat)


def _with_states(runs: list[Run]) -> list[Run]:
    """Name wear states by preset depth, or by cycles.

    The hours stand with them where equal cycles took equal hours in all runs.
    """
    labels_of = [_cycle_labels(run.data) for run in runs]
    hours_of = [() if _preset_labels(run.data) else _hours(run.data) for run in runs]

    pairs = set()
    for labels, hours in zip(labels_of, hours_of, strict=True):
        pairs |= set(zip(labels, hours, strict=False))
    worn = [(label, text) for label, text in pairs if label.value != 0.0]
    with_hours = {}
    if len(dict(worn)) == len(worn):
        for label, text in worn:
            with_hours[label] = Label(label.value, f"{label.text} ({text})")

    return [
        replace(run, states=tuple(with_hours.get(label, label) for label in labels))
        for run, labels in zip(runs, labels_of, strict=True)
    ]


def _hours(data: xr.Dataset) -> tuple[str, ...]:
    """Return the operating time of every wear state, in words."""
    if "operating_hours" not in data or data["operating_hours"].dims != ("update",):
        return ()
    units = str(data["operating_hours"].attrs.get("units", "h"))
    values = converted(data["operating_hours"].values, units, "h")
    rounded = [float(f"{value:.3g}") for value in values]
    return tuple(
        f"{value:g} h" if value < 1000.0 else f"{value:,.0f} h" for value in rounded
    )


def _preset_labels(data: xr.Dataset) -> list[Label]:
    """Return wear states by their preset depths, none unless all worn ones have one."""
    if "preset_depth" not in data or data.preset_depth.dims != ("update", "flank"):
        return []
    count = int(np.isfinite(np.atleast_1d(data.cycle.values)).sum())
    units = str(data.preset_depth.attrs.get("units", "m"))
    depths = converted(data.preset_depth.values[:count], units, "um")

    is_preset = np.isfinite(depths)
    if not is_preset[1:].any(axis=1).all() or count < 2:
        return []
    deepest = np.where(is_preset, depths, -1.0).argmax(axis=1)
    preset = depths[np.arange(count), deepest]
    flanks = data.flank.values[deepest]
    labels = [
        Label(float(depth), f"{depth:g} µm on {flank}")
        for depth, flank in zip(preset, flanks, strict=True)
    ]
    if not is_preset[0].any():
        labels[0] = Label(0.0, "first state")
    return labels


def _cycle_labels(data: xr.Dataset) -> tuple[Label, ...]:
    """Return the labels of wear states by preset depth or cycles, else by number."""
    if "cycle" not in data:
        count = data.sizes.get("update", 1)
        return tuple(Label(i, f"wear state {i}") for i in range(count))

    counts = np.atleast_1d(data.cycle.values)
    labels = [cycles(float(count)) for count in counts if not math.isnan(count)]
    labels = _preset_labels(data) or labels
    depth = data.get("max_wear_depth")
    unworn = depth is not None and not np.any(
        depth.values.reshape(data.cycle.size, -1)[0]
    )
    if unworn and labels and labels[0].value == 0.0:
        labels[0] = Label(0.0, "unworn")
    return tuple(labels)


def require(
    runs: list[Run],
    names: Sequence[str],
    request: FigureRequest,
    end_reasons: Mapping[str, int],
) -> list[Run]:
    """Return the runs that have all these variables.

    Parameters
    ----------
    runs : that were picked
    names : of the variables
    request : what the figure asks for
    end_reasons : how many lives ended for which reason

    Raises
    ------
    FigureError : no run has them
    """
    able = [run for run in runs if all(name in run.data.variables for name in names)]
    if able:
        return able

    present = {str(name) for run in runs for name in run.data.variables}
    absent = [name for name in names if name not in present] or list(names)
    lacking = f"no selected run has {' and '.join(absent)}"
    if set(absent) <= OF_WORN_OUT and end_reasons:
        ends = ", ".join(
            f"{count} by {reason}" for reason, count in end_reasons.items()
        )
        raise request.error(
            f"{lacking}: all ended before the depth of wear.until ({ends}); "
            "y = 'max_wear_depth' shows how far they came"
        )

    origins = dict.fromkeys(
        schema.origin_of(name)[1] for name in absent if name in schema.VARIABLES
    )
    if origins:
        raise request.error(f"{lacking}; it takes {' and '.join(origins)}")
    valid = sorted({str(name) for run in runs for name in run.data.data_vars})
    raise request.error(f"{lacking}; {nearest.choices(absent[0], valid)}")
