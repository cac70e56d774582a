"""A campaign as one lazy dataset: sweep axes, then ``case``, then the run's own dimensions.

Nothing is opened to build it: lengths, dims, dtypes, attributes and labels come from the catalogue. A point's
file is read when its chunk is computed. Position in the campaign places a run, so float noise in an axis
never splits it.
"""

import hashlib
import json
import math
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import dask.array
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearlab.query.evaluate import met
from wearlab.query.keys import differences, flat, quantity_at
from wearlab.store import catalogue, outcome
from wearlab.store.files import number_type, refuse_oversized
from wearlab.store.reading import LazyVariable, Places, RunFile, RunGroup
from wearlab.units import KINDS, convert

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.campaign import Axis, Campaign, Coordinate

BASE = "base"
MISSING, EXCLUDED, DONE = "missing", "excluded", "done"
UPDATE = "update"
TEXT = np.dtype(object, metadata={"element_type": str})  # as xarray marks texts that it need not look through
MOST_MISSING = 5  # points that are named
UNSAID = ("factor", "depth", "amount", "model", "file")
"""Last words of keys that say too little alone."""
MOST_WORDS = 2  # keys that name the base beside its cases
Variables = dict[str, Any]


@dataclass(frozen=True)
class Grid:
    """Where runs stand, and what they are like.

    Parameters
    ----------
    dims : sweep axes and ``case``
    numbers : number of the run with data at each point, −1 where there is none (grid shape)
    files, groups : the runs with data
    digests : hash of each coordinate's values, per run
    texts : name → the text of each run, where a run has one: known without opening files
    sizes : longest length of each run dim
    labels : labels along run dims; ``by_label`` are those whose values are placed by name
    token : changes when a run is another
    """

    dims: tuple[str, ...]
    numbers: NDArray[np.intp]
    files: tuple[RunFile, ...]
    groups: tuple[RunGroup, ...]
    digests: Sequence[Mapping[str, str]]
    texts: Mapping[str, NDArray[np.object_]]
    sizes: Mapping[str, int]
    labels: Mapping[str, list[Any]]
    by_label: frozenset[str]
    token: str


def open_grid(
    campaign: "Campaign",
    runs: Sequence[catalogue.Entry],
    layouts: Mapping[str, dict[str, Any]],
    folder: Path,
    scenes: Mapping[str, str],
) -> xr.Dataset:
    """Return the lazy dataset of a campaign.

    Parameters
    ----------
    campaign : its axes and cases
    runs : what the catalogue knows of its runs
    layouts : the tables of variables that the runs name
    folder : path of a run's file is ``folder / id[:2] / (id + ".nc")``
    scenes : run → its scene as canonical JSON, of the runs that `named_runs` gives

    Returns
    -------
    Dataset, one dask chunk per run and variable (one in all for a coordinate that the runs share);
    ``status``, ``reason``, ``run_id`` and ``n_updates`` over the grid dims; with cases and axes the
    coordinate ``computed``: where a run stands at its own place, not repeated along axes;
    points without data are NaN (text: ""); ``attrs["missing"]`` names the first of them.
    """
    axes = grid_axes(campaign)
    points = _points(campaign, axes)
    known = {run.id: run for run in runs}
    cases = [known.get(case.id) for case in campaign.cases]
    done = {run.id: run for run in cases if run is not None and run.state == DONE}
    grid = _grid(
        tuple(axes), points, [case.id for case in campaign.cases], list(done.values()), layouts, folder
    )
    status = [MISSING if run is None else run.state for run in cases]
    reasons = ["" if run is None else outcome.last_line(run.reason) for run in cases]
    variables = _states(campaign, axes, grid, points, status, reasons)
    coordinates = _axis_coordinates(campaign, axes)
    if words := _base_text(campaign, scenes):
        coordinates["case"][2]["base"] = words
    if "case" in axes and campaign.axes:
        coordinates["computed"] = _computed(
            campaign, axes, np.asarray(variables["status"][1] == DONE), scenes
        )
    for name in dict.fromkeys(name for group in grid.groups for name in group.variables):
        _add(variables, coordinates, name, grid)
    for dim in grid.sizes.keys() - coordinates.keys():  # so that grids of unequal lengths are joined
        words = "wear state" if dim == UPDATE else dim.replace("_", " ")
        coordinates[dim] = (dim, np.arange(grid.sizes[dim]), {"long_name": f"number of the {words}"})
    attributes: dict[str, Any] = {"title": campaign.title}
    if campaign.reference:  # CF: no attribute is an empty text
        attributes["references"] = campaign.reference
    attributes["missing"] = _missing(campaign, axes, points, status)
    return xr.Dataset(variables, coordinates, attributes)


def grid_axes(campaign: "Campaign") -> dict[str, list[Any]]:
    """Return the grid's dims and the values along them: sweep axes, then ``case`` where there are cases."""
    axes = {axis.name: list(axis.values) for axis in campaign.axes}
    labels = list(dict.fromkeys(case.label for case in campaign.cases))
    if labels != [BASE]:
        axes["case"] = sorted(labels, key=lambda label: label != BASE)
    return axes


def _points(campaign: "Campaign", axes: Mapping[str, list[Any]]) -> NDArray[np.intp]:
    """Return the number of the case at every grid point, −1 where there is none; broadcast where unswept."""
    points = np.full([len(values) for values in axes.values()], -1, np.intp)
    for number, case in enumerate(campaign.cases):
        points[_place(case, axes)] = number
    return points


def named_runs(campaign: "Campaign") -> list[str]:
    """Return the first run of each case, whose scenes tell where cases stand and in what they differ."""
    return list({case.label: case.id for case in reversed(campaign.cases)}.values())


def _base_text(campaign: "Campaign", scenes: Mapping[str, str]) -> str:
    """Return what the base is beside the other cases: what it has for what they change, or what is swept.

    Cases that change little come first; those that change too much to be told are left out.
    """
    first = {case.label: scenes.get(case.id, "") for case in reversed(campaign.cases)}
    swept = {along.key for axis in campaign.axes for along in _along(axis).values()}
    base = first.pop(BASE, "")
    told: dict[str, str] = {}
    for words in sorted((_changed(base, text, swept) for text in first.values() if text and base), key=len):
        if len(told | words) <= MOST_WORDS:
            told |= words
    if told:
        kinds = (key.removesuffix(".model").rpartition(".")[2] for key in told)
        values = ("no" if word == "none" else word for word in told.values())
        return ", ".join(map(" ".join, zip(values, kinds, strict=True))).replace("_", " ")
    unswept = (
        campaign.axes and first and not any(case.position for case in campaign.cases if case.label != BASE)
    )
    return f"{', '.join(axis.name for axis in campaign.axes)} swept".replace("_", " ") if unswept else ""


def _changed(base: str, other: str, swept: Container[str]) -> dict[str, str]:
    """Return the words that the base has for those that another scene changes, by key."""
    pairs = [d for d in differences(base, other) if isinstance(d.a, str) and isinstance(d.b, str)]
    return {d.key: str(d.a) for d in pairs if d.key not in swept}


def _computed(
    campaign: "Campaign", axes: Mapping[str, list[Any]], done: NDArray[np.bool_], scenes: Mapping[str, str]
) -> tuple[Any, ...]:
    """Return where each run stands at its own place, and the own values of the cases that are repeated."""
    computed, own = done.copy(), {}
    for case in campaign.cases:
        if case.position:
            continue
        scene = dict(flat(json.loads(scenes.get(case.id) or "{}")))
        given = {
            name: value
            for axis in campaign.axes
            for name, along in _along(axis).items()
            if (value := _own_value(scene.get(along.key), along)) is not None
        }
        place = _place(case, axes)
        at_own = np.ones(np.shape(done[place]), bool)
        for number, axis in enumerate(campaign.axes):
            keys = _along(axis).items()
            equal = np.all([[_same(given.get(n), v) for v in along.values] for n, along in keys], axis=0)
            at_own &= equal.reshape([-1 if i == number else 1 for i in range(at_own.ndim)])
        computed[place] &= at_own
        own[case.label] = given
    words = "whether the run stands at its own place here; else a case without a sweep, repeated"
    return (tuple(axes), computed, {"long_name": words, "own_values": json.dumps(own, ensure_ascii=False)})


def _along(axis: "Axis") -> "dict[str, Axis | Coordinate]":
    """Return an axis and what advances along it, by name."""
    return {axis.name: axis, **axis.coordinates}


def own_values(grid: xr.Dataset) -> dict[str, dict[str, Any]]:
    """Return what each case that is not swept has of the keys that are, by case and coordinate."""
    told = grid["computed"].attrs.get("own_values") if "computed" in grid.coords else None
    return dict(json.loads(told)) if told else {}


def _own_value(stored: Any, along: "Axis | Coordinate") -> Any:
    """Return a value of a scene in the unit of an axis, None where the scene has no such key."""
    kind = quantity_at(along.key)
    if not isinstance(stored, int | float) or isinstance(stored, bool) or kind is None or not along.units:
        return stored
    return convert(float(stored), KINDS[kind].unit, along.units)


def _same(value: Any, other: Any) -> bool:
    if isinstance(value, int | float) and isinstance(other, int | float):
        return met("=", float(value), float(other))
    return bool(value == other)


def _place(case: Any, axes: Mapping[str, list[Any]]) -> tuple[Any, ...]:
    place = dict(case.position)
    if "case" in axes and case.label in axes["case"]:
        place["case"] = axes["case"].index(case.label)
    return tuple(place.get(name, slice(None)) for name in axes)


def _grid(
    dims: tuple[str, ...],
    points: NDArray[np.intp],
    ids: Sequence[str],
    done: Sequence[catalogue.Entry],
    layouts: Mapping[str, dict[str, Any]],
    folder: Path,
) -> Grid:
    numbers = {run.id: number for number, run in enumerate(done)}
    of_case = np.array([*(numbers.get(run_id, -1) for run_id in ids), -1], np.intp)
    kinds = {run.form: None for run in done}
    known = [(layouts[key or ""], dict(sizes)) for key, sizes in kinds]
    groups = tuple(RunGroup(sizes, layout["variables"], layout["labels"]) for layout, sizes in known)
    place = {kind: number for number, kind in enumerate(kinds)}
    top = str(folder)
    files = tuple(RunFile(f"{top}/{r.id[:2]}/{r.id}.nc", r.sha256, place[r.form]) for r in done)
    for number, group in enumerate(groups):
        refuse_oversized(next(file.path for file in files if file.group == number), _claimed(group))
    sizes, labels, by_label = _shape(groups)
    token = hashlib.sha256(
        repr(([(r.id, r.sha256) for r in done], points.tobytes(), top)).encode()
    ).hexdigest()
    digests = [run.digests for run in done]
    texts = _texts(done, groups)
    return Grid(
        dims, np.asarray(of_case[points]), files, groups, digests, texts, sizes, labels, by_label, token[:16]
    )


def _texts(done: Sequence[catalogue.Entry], groups: Sequence[RunGroup]) -> dict[str, NDArray[np.object_]]:
    """Return the texts that runs have one of, such as the verdict, as the catalogue has them."""
    of_group = [
        {n for n, v in group.variables.items() if v["dtype"] == "str" and not v["dims"]} for group in groups
    ]
    names = sorted(set[str]().union(*of_group))
    return {
        name: np.array([*(str(run.summary.get(name) or "") for run in done), ""], object) for name in names
    }


def _claimed(group: RunGroup) -> int:
    """Return the bytes of the largest variable."""
    sizes = ([group.sizes[dim] for dim in variable["dims"]] for variable in group.variables.values())
    return max((8 * math.prod(lengths) for lengths in sizes), default=0)


def _shape(groups: Sequence[RunGroup]) -> tuple[dict[str, int], dict[str, list[Any]], frozenset[str]]:
    """Join the run dims: the union of names along a dim of text, the longest of the others."""
    sizes: dict[str, int] = {}
    labels: dict[str, list[Any]] = {}
    for group in groups:
        for dim, size in group.sizes.items():
            sizes[dim] = max(size, sizes.get(dim, 0))
    by_label = set()
    for dim in sizes:
        known = [group.labels[dim] for group in groups if dim in group.labels]
        if not known:
            continue
        if isinstance(known[0][0] if known[0] else "", str):
            by_label.add(dim)
            labels[dim] = list(dict.fromkeys(label for some in known for label in some))
            sizes[dim] = len(labels[dim])
        elif (longest := max(known, key=len)) and all(some == longest[: len(some)] for some in known):
            labels[dim] = longest
    return sizes, labels, frozenset(by_label)


def _add(variables: Variables, coordinates: Variables, name: str, grid: Grid) -> None:
    """Put one variable into the grid: shared labels as they are, everything else as a lazy array."""
    first = next(group.variables[name] for group in grid.groups if name in group.variables)
    own = tuple(first["dims"])
    if not own and name in grid.texts:
        texts = np.asarray(grid.texts[name][grid.numbers], TEXT)
        (coordinates if first["coordinate"] else variables)[name] = (grid.dims, texts, first["attrs"])
        return
    if own == (name,) and name in grid.labels:
        coordinates[name] = ((name,), grid.labels[name], first["attrs"])
        return
    numbers, dims = grid.numbers, grid.dims
    if first["coordinate"] and _is_shared(name, grid):  # one file answers for all
        numbers, dims = np.zeros((), np.intp), ()
    places = {
        number: _places(group, own, grid)
        for number, group in enumerate(grid.groups)
        if tuple(group.variables.get(name, {}).get("dims", "?")) == own
    }
    padded = tuple(grid.sizes[dim] for dim in own)
    whole = (
        bool((numbers >= 0).all())
        and len(places) == len(grid.groups)
        and all(group.sizes[dim] == grid.sizes[dim] for group in grid.groups for dim in own)
    )
    dtype, fill = _dtype(first["dtype"], whole)
    lazy = LazyVariable(name, numbers, grid.files, grid.groups, places, padded, dtype, fill)
    data = dask.array.from_array(
        lazy,
        chunks=tuple((1,) * n for n in numbers.shape) + tuple((n,) for n in padded),
        name=f"{name}-{grid.token}",
        asarray=False,
        meta=np.empty((0,) * lazy.ndim, dtype),
        inline_array=True,
    )
    # a coordinate that bears its dimension's name but differs from run to run cannot be an index
    free = f"{name}_values" if name in own else name
    (coordinates if first["coordinate"] else variables)[free] = xr.Variable(
        dims + own, data, first["attrs"], fastpath=True
    )


def _is_shared(name: str, grid: Grid) -> bool:
    """Say whether a coordinate has the same values in every run."""
    digests = {digests.get(name) for digests in grid.digests}
    return len(digests) == 1 and None not in digests


def _places(group: RunGroup, own: tuple[str, ...], grid: Grid) -> Places:
    """Return where a group's values go along each of their dims, None where they simply start at 0."""
    return tuple(
        _labelled(group.labels.get(dim), grid.labels[dim]) if dim in grid.by_label else None for dim in own
    )


def _labelled(labels: list[Any] | None, union: list[Any]) -> list[int] | None:
    if labels is None or labels == union[: len(labels)]:
        return None
    return [union.index(label) for label in labels]


def _dtype(stored: str, whole: bool) -> tuple[np.dtype[Any], Any]:
    """Return dtype and filling: text stays text, numbers with holes become float64."""
    if stored == "str":
        return TEXT, ""
    stored = number_type(stored)
    return (np.dtype(stored), 0) if whole and np.dtype(stored).kind != "f" else (np.dtype(float), np.nan)


def _states(
    campaign: "Campaign",
    axes: Mapping[str, list[Any]],
    grid: Grid,
    points: NDArray[np.intp],
    status: Sequence[str],
    reasons: Sequence[str],
) -> Variables:
    """Return what is known of every point: state, why there are no data, run, number of wear states."""
    ids = [case.id for case in campaign.cases]
    states, why, named = (
        np.asarray(np.array([*texts, ""], object)[points], object) for texts in (status, reasons, ids)
    )
    for exclusion in getattr(campaign, "excluded", ()):
        place = _place(exclusion, axes)
        free = np.broadcast_to(points[place] < 0, np.shape(states[place]))
        states[place] = np.where(free, EXCLUDED, states[place])
        why[place] = np.where(free, exclusion.condition, why[place])
    lengths = [grid.groups[file.group].sizes.get(UPDATE, 1) for file in grid.files]
    updates = np.array([*lengths, 0], np.int64)[grid.numbers]
    dims = grid.dims
    return {
        "status": (dims, states.astype(str), {"long_name": "state of the run"}),
        "reason": (dims, why.astype(str), {"long_name": "why the run has no data"}),
        "run_id": (dims, named.astype(str), {"long_name": "identity of the run"}),
        "n_updates": (dims, updates, {"long_name": "number of wear states of the run"}),
    }


def _axis_coordinates(campaign: "Campaign", axes: Mapping[str, list[Any]]) -> Variables:
    coordinates: Variables = {}
    for axis in campaign.axes:
        for name, values in _along(axis).items():
            units = {} if not values.units else {"units": values.units}
            told = {"long_name": key_text(values.key or name), **units, "key": values.key}
            coordinates[name] = (axis.name, list(values.values), told)
    if "case" in axes:
        coordinates["case"] = ("case", axes["case"], {"long_name": "case"})
    return coordinates


def key_text(key: str) -> str:
    """Return what stands under a key in words: its last word, and what it is of where that says too little.

    Examples
    --------
    >>> key_text("operation.speed"), key_text("wear.coefficient.value")
    ('speed', 'wear coefficient')
    """
    words = key.split(".")
    some = words[-3:-1] if words[-1] == "value" else words[-2:] if words[-1] in UNSAID else words[-1:]
    return " ".join(some or words).replace("_", " ")


def _missing(
    campaign: "Campaign", axes: Mapping[str, list[Any]], points: NDArray[np.intp], status: Sequence[str]
) -> list[str]:
    """Name the first grid points that have a run but no data, and say how many more there are."""
    lacking = np.argwhere(np.array([*(state != DONE for state in status), False])[points])
    names = []
    for point in lacking[:MOST_MISSING]:
        number = points[tuple(point)]
        places = zip(axes, point, strict=True)
        where = ", ".join(f"{name}={outcome.value_text(axes[name][i], None)}" for name, i in places)
        names.append(f"{where or campaign.cases[number].id}: {status[number]}")
    more = len(lacking) - len(names)
    return [*names, f"and {more} more, by status"] if more > 0 else names


def axes_in_si(grid: "xr.Dataset") -> "xr.Dataset":
    """Return a grid whose sweep axes, and what advances along them, are in SI units.

    Parameters
    ----------
    grid : as `wearlab.store.grid.open_grid` gives it, axes in the units of the campaign file
    """
    changed: dict[str, Any] = {}
    for name, axis in grid.coords.items():
        kind = quantity_at(str(axis.attrs["key"])) if "key" in axis.attrs else None
        if kind is not None and "units" in axis.attrs:
            unit = KINDS[kind].unit
            values = [convert(float(value), axis.attrs["units"], unit) for value in axis.values]
            changed[str(name)] = (axis.dims, values, {**axis.attrs, "units": unit})
    if "computed" in grid.coords:
        own = json.loads(grid["computed"].attrs["own_values"])
        for values in own.values():
            for name in changed.keys() & values.keys():
                values[name] = convert(values[name], grid[name].attrs["units"], changed[name][2]["units"])
        attributes = {**grid["computed"].attrs, "own_values": json.dumps(own, ensure_ascii=False)}
        changed["computed"] = grid["computed"].assign_attrs(attributes)
    return grid.assign_coords(changed)
