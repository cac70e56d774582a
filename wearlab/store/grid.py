"""A campaign as one lazy dataset: sweep axes, ``case``, then the run's dimensions.

Nothing is opened to build it: lengths, dims, dtypes, attributes and labels come from
the catalogue. A point's file is read when its chunk is computed. Position in the
campaign places a run, so float noise in an axis never splits it.
"""

import hashlib
import json
import math
import re
from collections.abc import Container, Iterator, Mapping
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import dask.array
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearlab.query.evaluate import compared
from wearlab.query.keys import differences, flat, quantity_at
from wearlab.store import catalogue, former, outcome, reading
from wearlab.store.files import StoreError, refuse_oversized
from wearlab.units import KINDS, convert, is_number

if TYPE_CHECKING:
    from wearlab.campaign import Axis, Campaign, Coordinate
    from wearlab.store.stored_runs import StoredRuns

BASE = "base"
MISSING, EXCLUDED, DONE = "missing", "excluded", "done"
UPDATE = "update"
STATES = {
    "status": "state of the run",
    "reason": "why the run has no data",
    "run_id": "identity of the run",
}
# as xarray marks texts that it need not look through
TEXT = np.dtype(object, metadata={"element_type": str})
NUMBER = re.compile(r"[<>|=]?[biuf][1248]")
MAX_MISSING = 5  # points that are named
VAGUE_WORDS = ("factor", "depth", "amount", "model", "file")
"""Last words of keys that say too little by themselves."""
MAX_BASE_KEYS = 2  # keys that name the base beside its cases
# texts that a grid needs of every run
PLACED = catalogue.OF_DOCUMENTS.replace(", scene", "")
Variables = dict[str, Any]
Index = tuple[Any, ...]


def open_grid(
    campaign: "Campaign", store: "StoredRuns", si: bool = False
) -> xr.Dataset:
    """Return the lazy dataset of a campaign.

    Parameters
    ----------
    campaign : its axes and cases
    store : what its catalogue knows of the runs; only scenes of the first run of each
        case are read
    si : sweep axes, and what advances along them, in SI units instead of those of the
        file

    Returns
    -------
    Dataset, one dask chunk per run and variable (one in all for a coordinate that the
    runs share); ``status``, ``reason``, ``run_id`` and ``n_updates`` over the grid
    dims; with cases and axes the coordinate ``computed``: where a run stands at its own
    place, not repeated along axes; points without data are NaN (text: "");
    ``attrs["missing"]`` names the first of them.
    """
    archive = store.archive
    entries = archive.catalogue.entries((case.id for case in campaign.cases), PLACED)
    runs = {
        run_id: replace(run, state="interrupted") if archive.is_stale(run) else run
        for run_id, run in entries.items()
    }
    layouts = archive.catalogue.layouts(
        run.layout for run in entries.values() if run.layout
    )
    first_runs = {case.label: case.id for case in reversed(campaign.cases)}
    scenes = {
        run_id: entry.scene or ""
        for run_id, entry in archive.entries(first_runs.values()).items()
    }

    missing = [case.id for case in campaign.cases if case.id not in runs]
    older = former.older_versions(campaign, archive, missing)
    cases = _Cases(campaign, runs, older, si)
    stored = _GridRuns(cases, layouts, archive.files.folder.absolute())
    variables = cases.states()
    variables["n_updates"] = stored.update_counts()
    coordinates = cases.axis_coordinates()
    if base := _base_text(campaign, scenes):
        _, _, attributes = coordinates["case"]
        attributes["base"] = base
    if "case" in cases.axes and campaign.axes:
        is_done = np.asarray(variables["status"][1] == DONE)
        coordinates["computed"] = cases.computed(is_done, scenes)

    for name, is_coordinate, variable in stored.named_variables():
        (coordinates if is_coordinate else variables)[name] = variable
    # so that grids of unequal lengths are joined
    for dim in [dim for dim in stored.sizes if dim not in coordinates]:
        coordinates[dim] = _counted(dim, stored.sizes[dim])

    attributes = {"title": campaign.title}
    if campaign.reference:  # CF: none is an empty text
        attributes["references"] = campaign.reference
    return xr.Dataset(variables, coordinates, attributes | {"missing": cases.missing()})


def _counted(dim: str, size: int) -> tuple[str, NDArray[Any], dict[str, str]]:
    """Return the coordinate of a dimension without labels, counted from 0."""
    noun = "wear state" if dim == UPDATE else dim.replace("_", " ")
    return dim, np.arange(size), {"long_name": f"number of the {noun}"}


class _Cases:
    """The cases of a campaign on its grid: where they stand, and what became of each.

    Parameters
    ----------
    campaign : its axes and cases
    entries : runs that the catalogue knows, by id
    older : what to say of those that another version of the model made, by id
    si : whether axes are told in SI units
    """

    def __init__(
        self,
        campaign: "Campaign",
        entries: Mapping[str, catalogue.Entry],
        older: Mapping[str, str],
        si: bool,
    ) -> None:
        self.campaign = campaign
        self.older = older
        self.axes = grid_axes(campaign)
        self.along = {axis.name: _along(axis, si) for axis in campaign.axes}
        self.runs = [entries.get(case.id) for case in campaign.cases]
        self.status = [MISSING if run is None else run.state for run in self.runs]
        # the number of the case at every grid point, −1 where there is none; broadcast
        # where unswept
        shape = [len(values) for values in self.axes.values()]
        self.points = np.full(shape, -1, np.intp)
        for number, case in enumerate(campaign.cases):
            self.points[self.index(case)] = number

    def index(self, case: Any) -> Index:
        """Return the index of a case in an array over the grid.

        Or of an excluded case.
        """
        place = dict(case.position)
        if "case" in self.axes and case.label in self.axes["case"]:
            place["case"] = self.axes["case"].index(case.label)
        return tuple(place.get(name, slice(None)) for name in self.axes)

    def states(self) -> Variables:
        """Return state, reason for the lack of data, and run id at every point."""
        reasons = [
            self.older.get(case.id, "")
            if run is None
            else outcome.last_line(run.reason)
            for case, run in zip(self.campaign.cases, self.runs, strict=True)
        ]
        texts_of_cases = {
            "status": self.status,
            "reason": reasons,
            "run_id": [case.id for case in self.campaign.cases],
        }
        # the last text, "", stands where there is no case: its number is −1
        texts = {
            name: np.array([*values, ""], object)[self.points, ...]
            for name, values in texts_of_cases.items()
        }
        for exclusion in getattr(self.campaign, "excluded", ()):
            index = self.index(exclusion)
            shape = np.shape(texts["status"][index])
            is_free = np.broadcast_to(self.points[index] < 0, shape)
            for name, text in (("status", EXCLUDED), ("reason", exclusion.condition)):
                texts[name][index] = np.where(is_free, text, texts[name][index])

        dims = tuple(self.axes)
        return {
            name: (dims, text.astype(str), {"long_name": STATES[name]})
            for name, text in texts.items()
        }

    def axis_coordinates(self) -> Variables:
        """Return the sweep axes, what advances along them, and the labels of cases."""
        coordinates: Variables = {}
        for axis, coordinate in self.along.items():
            for name, (values, unit, key) in coordinate.items():
                attributes = {"long_name": key_text(key or name)}
                if unit:
                    attributes["units"] = unit
                attributes["key"] = key
                coordinates[name] = (axis, list(values), attributes)
        if "case" in self.axes:
            coordinates["case"] = ("case", self.axes["case"], {"long_name": "case"})
        return coordinates

    def computed(
        self, is_done: NDArray[np.bool_], scenes: Mapping[str, str]
    ) -> tuple[Any, ...]:
        """Return the coordinate ``computed``: where each run stands at its own place.

        Its attribute ``own_values`` has the values of the cases that are repeated along
        the axes.

        Parameters
        ----------
        is_done : whether there are data, at every point
        scenes : canonical JSON by run id
        """
        computed = is_done.copy()
        own_values: dict[str, dict[str, Any]] = {}
        for case in self.campaign.cases:
            if case.position:
                continue
            index = self.index(case)
            values = self._values_along_axes(scenes.get(case.id) or "{}")
            computed[index] &= self._stands_at(values, np.shape(is_done[index]))
            own_values[case.label] = {
                name: value for name, value in values.items() if value is not None
            }
        attributes = {
            "long_name": "whether the run stands at its own place here; else a case "
            "without a sweep, repeated",
            "own_values": json.dumps(own_values, ensure_ascii=False),
        }
        return (tuple(self.axes), computed, attributes)

    def _values_along_axes(self, scene: str) -> dict[str, Any]:
        """Return what a scene has of all that the axes change, in the axes' units."""
        values = dict(flat(json.loads(scene)))
        return {
            name: _in_axis_unit(values.get(coordinate.key), coordinate)
            for coordinates in self.along.values()
            for name, coordinate in coordinates.items()
        }

    def _stands_at(
        self, values: Mapping[str, Any], shape: tuple[int, ...]
    ) -> NDArray[np.bool_]:
        """Return at which points of the axes a scene has the values of the axes."""
        stands = np.ones(shape, bool)
        for number, coordinates in enumerate(self.along.values()):
            is_equal = [
                [compared("=", values[name], value) for value in coordinate.values]
                for name, coordinate in coordinates.items()
            ]
            along_axis = [1] * stands.ndim
            along_axis[number] = -1
            stands &= np.all(is_equal, axis=0).reshape(along_axis)
        return stands

    def missing(self) -> list[str]:
        """Name the first grid points that have a run but no data.

        The last line says how many more there are.
        """
        lacks = [*(state != DONE for state in self.status), False]
        points = np.argwhere(np.array(lacks)[self.points])
        lines = []
        for point in points[:MAX_MISSING]:
            number = self.points[tuple(point)]
            place = ", ".join(
                f"{name}={outcome.value_text(self.axes[name][i], None)}"
                for name, i in zip(self.axes, point, strict=True)
            )
            run_id = self.campaign.cases[number].id
            state = self.older.get(run_id, self.status[number])
            lines.append(f"{place or run_id}: {state}")
        omitted = len(points) - len(lines)
        return [*lines, f"and {omitted} more, by status"] if omitted > 0 else lines


class _GridRuns:
    """The runs with data on a grid, and what they are like.

    Parameters
    ----------
    cases : where runs stand
    layouts : the tables of variables that the runs name
    folder : of their files
    """

    def __init__(self, cases: _Cases, layouts: Mapping[str, Any], folder: Path) -> None:
        finished = {
            run.id: run for run in cases.runs if run is not None and run.state == DONE
        }
        self.runs = list(finished.values())
        forms = dict.fromkeys(run.form for run in self.runs)
        group_of_form = {form: number for number, form in enumerate(forms)}
        self.groups = [
            reading.RunGroup(dict(sizes), **layouts[key or ""]) for key, sizes in forms
        ]
        self.files = tuple(
            reading.RunFile(
                path=f"{folder}/{run.id[:2]}/{run.id}.nc",
                sha256=run.sha256,
                group=group_of_form[run.form],
            )
            for run in self.runs
        )
        self._refuse_oversized_files()

        # the number of the run with data at each point, −1 where there is none
        number_of_run = {run_id: number for number, run_id in enumerate(finished)}
        numbers = [number_of_run.get(case.id, -1) for case in cases.campaign.cases]
        self.dims = tuple(cases.axes)
        self.numbers = np.asarray(np.array([*numbers, -1], np.intp)[cases.points])
        contents = (
            [(run.id, run.sha256) for run in self.runs],
            cases.points.tobytes(),
            str(folder),
        )
        # changes with any of the runs
        self.token = hashlib.sha256(repr(contents).encode()).hexdigest()[:16]

        self.sizes: dict[str, int] = {}
        self.labels: dict[str, list[Any]] = {}
        self.text_dims = set[str]()
        self._join_dims()

    def _refuse_oversized_files(self) -> None:
        """Refuse runs whose largest variable claims more than their files can hold."""
        for number, group in enumerate(self.groups):
            shapes = (
                [group.sizes[dim] for dim in variable["dims"]]
                for variable in group.variables.values()
            )
            claimed = max((8 * math.prod(shape) for shape in shapes), default=0)
            first = next(file.path for file in self.files if file.group == number)
            refuse_oversized(first, claimed)

    def _join_dims(self) -> None:
        """Join the dims of the runs.

        All names along a dim of text, the longest of the others.
        """
        for group in self.groups:
            for dim, size in group.sizes.items():
                self.sizes[dim] = max(size, self.sizes.get(dim, 0))
        for dim in self.sizes:
            lists = [group.labels[dim] for group in self.groups if dim in group.labels]
            longest = max(lists, key=len, default=[])
            if lists and isinstance(lists[0][0] if lists[0] else "", str):
                self.text_dims.add(dim)
                self.labels[dim] = list(dict.fromkeys(chain.from_iterable(lists)))
                self.sizes[dim] = len(self.labels[dim])
            elif longest and all(labels == longest[: len(labels)] for labels in lists):
                self.labels[dim] = longest

    def update_counts(self) -> tuple[Any, ...]:
        """Return the variable ``n_updates``: the number of wear states of each run."""
        counts = [self.groups[f.group].sizes.get(UPDATE, 1) for f in self.files]
        attributes = {"long_name": "number of wear states of the run"}
        return (self.dims, np.array([*counts, 0], np.int64)[self.numbers], attributes)

    def named_variables(self) -> Iterator[tuple[str, bool, Any]]:
        """Yield name on the grid, whether it is a coordinate, and each variable."""
        names = chain.from_iterable(group.variables for group in self.groups)
        for name in dict.fromkeys(names):
            layout = self._layout_of(name)
            # a coordinate that bears its dimension's name but differs from run to run
            # cannot be an index
            is_index = name in layout["dims"]
            free = f"{name}_values" if is_index and name not in self.labels else name
            yield free, bool(layout.get("coordinate")), self.variable(name)

    def _layout_of(self, name: str) -> Mapping[str, Any]:
        """Return dims, dtype and attributes of a variable.

        As the first group has them.
        """
        return next(
            group.variables[name] for group in self.groups if name in group.variables
        )

    def variable(self, name: str) -> Any:
        """Return a variable on the grid: labels and texts known, others lazy arrays."""
        layout = self._layout_of(name)
        dims = tuple(layout["dims"])
        attributes = layout["attrs"]
        if not dims and layout["dtype"] == "str":  # such as the verdict
            texts = [*(str(run.summary.get(name) or "") for run in self.runs), ""]
            on_grid = np.array(texts, object)[self.numbers]
            return self.dims, np.asarray(on_grid, TEXT), attributes
        if dims == (name,) and name in self.labels:
            return (name,), self.labels[name], attributes
        return self._lazy_variable(name, dims, layout)

    def _lazy_variable(
        self, name: str, dims: tuple[str, ...], layout: Mapping[str, Any]
    ) -> xr.Variable:
        """Return a variable whose values are read when they are asked for."""
        numbers = self.numbers
        grid_dims = self.dims
        digests = {run.digests.get(name) for run in self.runs}
        if layout.get("coordinate") and len(digests) == 1 and None not in digests:
            numbers = np.zeros((), np.intp)  # one file answers for all
            grid_dims = ()
        places = {
            number: tuple(self._place(group.labels.get(dim), dim) for dim in dims)
            for number, group in enumerate(self.groups)
            if tuple(group.variables.get(name, {}).get("dims", "?")) == dims
        }
        padded = tuple(self.sizes[dim] for dim in dims)
        have_equal_sizes = all(
            group.sizes.get(dim) == self.sizes[dim]
            for group in self.groups
            for dim in dims
        )
        has_no_holes = (
            bool((numbers >= 0).all())
            and len(places) == len(self.groups)
            and have_equal_sizes
        )
        dtype, fill = _dtype(layout["dtype"], has_no_holes)
        lazy = reading.LazyVariable(
            name, numbers, self.files, places, padded, dtype, fill
        )
        one_run_each = tuple((1,) * size for size in numbers.shape)
        data = dask.array.from_array(
            lazy,
            one_run_each + tuple((size,) for size in padded),
            f"{name}-{self.token}",
            asarray=False,
            meta=np.empty((0,) * lazy.ndim, dtype),
            inline_array=True,
        )
        return xr.Variable(grid_dims + dims, data, layout["attrs"], fastpath=True)

    def _place(self, labels: list[Any] | None, dim: str) -> list[int] | None:
        """Return where values go along a dim, None where they simply start at 0."""
        union = self.labels.get(dim, [])
        starts_at_0 = labels is None or labels == union[: len(labels)]
        if dim not in self.text_dims or labels is None or starts_at_0:
            return None
        return [union.index(label) for label in labels]


def _dtype(stored: str, has_no_holes: bool) -> tuple[np.dtype[Any], Any]:
    """Return dtype and filling: text stays text, numbers with holes become float64."""
    if stored == "str":
        return TEXT, ""
    if not NUMBER.fullmatch(stored):
        reason = f"{stored[:40]!r} as a type of numbers"
        raise StoreError(f"the catalogue names {reason}; 'wearlab reindex' mends it")
    if has_no_holes and np.dtype(stored).kind != "f":
        return np.dtype(stored), 0
    return np.dtype(float), np.nan


def grid_axes(campaign: "Campaign") -> dict[str, list[Any]]:
    """Return the grid's dims and the values along them.

    Sweep axes, then ``case`` where there are cases.

    Parameters
    ----------
    campaign : its axes and cases
    """
    axes = {axis.name: list(axis.values) for axis in campaign.axes}
    labels = dict.fromkeys(case.label for case in campaign.cases)
    if [*labels] != [BASE]:
        axes["case"] = sorted(labels, key=lambda label: label != BASE)
    return axes


def _base_text(campaign: "Campaign", scenes: Mapping[str, str]) -> str:
    """Return what the base has for what the other cases change, or what is swept.

    Cases that change little come first; those that change too much to be told are left
    out.
    """
    first = {case.label: scenes.get(case.id, "") for case in reversed(campaign.cases)}
    swept = {
        coordinate.key for axis in campaign.axes for coordinate in _along(axis).values()
    }
    base = first.pop(BASE, "")
    changes = (
        _replaced_words(base, scene, swept)
        for scene in first.values()
        if scene and base
    )
    replaced: dict[str, str] = {}
    for words in sorted(changes, key=len):
        if len(replaced | words) <= MAX_BASE_KEYS:
            replaced |= words
    if replaced:
        kinds = (key.removesuffix(".model").rpartition(".")[2] for key in replaced)
        values = ("no" if word == "none" else word for word in replaced.values())
        phrases = map(" ".join, zip(values, kinds, strict=True))
        return ", ".join(phrases).replace("_", " ")

    has_swept_cases = any(
        case.position for case in campaign.cases if case.label != BASE
    )
    if not campaign.axes or not first or has_swept_cases:
        return ""
    return f"{', '.join(axis.name for axis in campaign.axes)} swept".replace("_", " ")


def _replaced_words(base: str, scene: str, swept: Container[str]) -> dict[str, str]:
    """Return the words of the base for which another scene has other words, by key."""
    return {
        difference.key: difference.a
        for difference in differences(base, scene)
        if isinstance(difference.a, str)
        and isinstance(difference.b, str)
        and difference.key not in swept
    }


def _along(axis: "Axis", si: bool = False) -> "dict[str, Coordinate]":
    """Return an axis and what advances along it, in the units of the file, or in SI."""
    from wearlab.campaign import Coordinate

    coordinates: dict[str, Coordinate] = {}
    named: dict[str, Axis | Coordinate] = {axis.name: axis, **axis.coordinates}
    for name, along in named.items():
        kind = quantity_at(along.key) if si and along.units else None
        if kind is None or not along.units:
            coordinates[name] = Coordinate(along.values, along.units, along.key)
            continue
        unit = KINDS[kind].unit
        values = (convert(float(value), along.units, unit) for value in along.values)
        coordinates[name] = Coordinate(tuple(values), unit, along.key)
    return coordinates


def own_values(grid: xr.Dataset) -> dict[str, dict[str, Any]]:
    """Return the values that cases without a sweep have of the swept keys.

    Parameters
    ----------
    grid : as `open_grid` returns it

    Returns
    -------
    By case and coordinate.
    """
    text = (
        grid["computed"].attrs.get("own_values") if "computed" in grid.coords else None
    )
    return dict(json.loads(text)) if text else {}


def _in_axis_unit(stored: Any, along: "Coordinate") -> Any:
    """Return a value of a scene in the unit of an axis.

    None where there is no value.
    """
    if not is_number(stored) or not along.units:
        return stored
    kind = quantity_at(along.key)
    if kind is None:
        return stored
    return convert(float(stored), KINDS[kind].unit, along.units)


def key_text(key: str) -> str:
    """Return what stands under a key in words.

    That is its last word, with the word before where the last says too little.

    Parameters
    ----------
    key : dotted

    Examples
    --------
    >>> key_text("operation.speed"), key_text("wear.coefficient.value")
    ('speed', 'wear coefficient')
    """
    words = key.split(".")
    if words[-1] == "value":
        telling = words[-3:-1]
    elif words[-1] in VAGUE_WORDS:
        telling = words[-2:]
    else:
        telling = words[-1:]
    return " ".join(telling or words).replace("_", " ")
