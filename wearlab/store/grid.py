"""A campaign as one lazy dataset: sweep axes, then ``case``, then the run's own dimensions.

Nothing is opened to build it: lengths, dims, dtypes, attributes and labels come from
the catalogue. A point's file is read when its chunk is computed. Position in the
campaign places a run, so float noise in an axis never splits it.
"""

import hashlib
import json
import math
import re
from collections.abc import Container, Mapping
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
from wearlab.store import catalogue, outcome, reading
from wearlab.store.files import StoreError, refuse_oversized
from wearlab.units import KINDS, convert, is_number

if TYPE_CHECKING:
    from wearlab.campaign import Axis, Campaign, Coordinate
    from wearlab.store.store import Store

BASE = "base"
MISSING, EXCLUDED, DONE = "missing", "excluded", "done"
UPDATE = "update"
STATES = {
    "status": "state of the run",
    "reason": "why the run has no data",
    "run_id": "identity of the run",
}
TEXT = np.dtype(
    object, metadata={"element_type": str}
)  # as xarray marks texts that it need not look through
NUMBER = re.compile(r"[<>|=]?[biuf][1248]")
MOST_MISSING = 5  # points that are named
UNSAID = ("factor", "depth", "amount", "model", "file")
"""Last words of keys that say too little alone."""
MOST_WORDS = 2  # keys that name the base beside its cases
PLACED = catalogue.OF_DOCUMENTS.replace(
    ", scene", ""
)  # texts that a grid needs of every run
Variables = dict[str, Any]


def open_grid(campaign: "Campaign", store: "Store", si: bool = False) -> xr.Dataset:
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
    entries = store.archive.catalogue.entries(
        (case.id for case in campaign.cases), PLACED
    )
    runs = {
        i: replace(run, state="interrupted") if store.archive.is_stale(run) else run
        for i, run in entries.items()
    }
    layouts = store.archive.catalogue.layouts(
        run.layout for run in entries.values() if run.layout
    )
    of_cases = {case.label: case.id for case in reversed(campaign.cases)}
    scenes = {
        run_id: entry.scene or ""
        for run_id, entry in store.archive.entries(of_cases.values()).items()
    }
    cases = _Cases(campaign, runs, si)
    stored = _Stored(cases, layouts, store.archive.files.folder.absolute())
    variables = cases.states()
    coordinates = cases.axis_coordinates()
    updates = np.array(
        [*(stored.groups[f.group].sizes.get(UPDATE, 1) for f in stored.files), 0],
        np.int64,
    )
    about = {"long_name": "number of wear states of the run"}
    variables["n_updates"] = (stored.dims, updates[stored.numbers], about)
    if words := _base_text(campaign, scenes):
        coordinates["case"][2]["base"] = words
    if "case" in cases.axes and campaign.axes:
        coordinates["computed"] = cases.computed(
            np.asarray(variables["status"][1] == DONE), scenes
        )
    for name in dict.fromkeys(
        chain.from_iterable(group.variables for group in stored.groups)
    ):
        first, variable = stored.variable(name)
        # a coordinate that bears its dimension's name but differs from run to run
        # cannot be an index
        free = (
            f"{name}_values"
            if name in first["dims"] and name not in stored.labels
            else name
        )
        (coordinates if first.get("coordinate") else variables)[free] = variable
    # so that grids of unequal lengths are joined
    for dim in [dim for dim in stored.sizes if dim not in coordinates]:
        words = "wear state" if dim == UPDATE else dim.replace("_", " ")
        coordinates[dim] = (
            dim,
            np.arange(stored.sizes[dim]),
            {"long_name": f"number of the {words}"},
        )
    referred = (
        {"references": campaign.reference} if campaign.reference else {}
    )  # CF: none is an empty text
    attributes = {"title": campaign.title, **referred, "missing": cases.missing()}
    return xr.Dataset(variables, coordinates, attributes)


class _Cases:
    """The cases of a campaign on its grid: where they stand, and what became of each.

    Parameters
    ----------
    campaign : its axes and cases
    known : runs that the catalogue knows, by id
    si : whether axes are told in SI units
    """

    def __init__(
        self, campaign: "Campaign", known: Mapping[str, catalogue.Entry], si: bool
    ) -> None:
        self.campaign = campaign
        self.axes = grid_axes(campaign)
        self.along = {axis.name: _along(axis, si) for axis in campaign.axes}
        self.runs = [known.get(case.id) for case in campaign.cases]
        self.status = [MISSING if run is None else run.state for run in self.runs]
        # the number of the case at every grid point, −1 where there is none; broadcast
        # where unswept
        self.points = np.full(
            [len(values) for values in self.axes.values()], -1, np.intp
        )
        for number, case in enumerate(campaign.cases):
            self.points[self.place(case)] = number

    def place(self, case: Any) -> tuple[Any, ...]:
        """Return the index of a case, or of one that is excluded, in an array over the grid."""
        place = dict(case.position)
        if "case" in self.axes and case.label in self.axes["case"]:
            place["case"] = self.axes["case"].index(case.label)
        return tuple(place.get(name, slice(None)) for name in self.axes)

    def states(self) -> Variables:
        """Return what is known of every point: state, why there are no data, and the run."""
        reasons = [
            "" if run is None else outcome.last_line(run.reason) for run in self.runs
        ]
        told = {
            "status": self.status,
            "reason": reasons,
            "run_id": [case.id for case in self.campaign.cases],
        }
        texts = {
            name: np.array([*each, ""], object)[self.points, ...]
            for name, each in told.items()
        }
        for exclusion in getattr(self.campaign, "excluded", ()):
            place = self.place(exclusion)
            free = np.broadcast_to(
                self.points[place] < 0, np.shape(texts["status"][place])
            )
            for name, text in (("status", EXCLUDED), ("reason", exclusion.condition)):
                texts[name][place] = np.where(free, text, texts[name][place])
        dims = tuple(self.axes)
        return {
            name: (dims, text.astype(str), {"long_name": STATES[name]})
            for name, text in texts.items()
        }

    def axis_coordinates(self) -> Variables:
        """Return the sweep axes, what advances along them, and the labels of the cases."""
        coordinates: Variables = {}
        for axis, coordinate in self.along.items():
            for name, (values, unit, key) in coordinate.items():
                told = {
                    "long_name": key_text(key or name),
                    **({"units": unit} if unit else {}),
                    "key": key,
                }
                coordinates[name] = (axis, list(values), told)
        if "case" in self.axes:
            coordinates["case"] = ("case", self.axes["case"], {"long_name": "case"})
        return coordinates

    def computed(
        self, done: NDArray[np.bool_], scenes: Mapping[str, str]
    ) -> tuple[Any, ...]:
        """Return where each run stands at its own place, and the own values of cases that are repeated."""
        computed = done.copy()
        own = {}
        for case in self.campaign.cases:
            if case.position:
                continue
            scene = dict(flat(json.loads(scenes.get(case.id) or "{}")))
            place = self.place(case)
            given: dict[str, Any] = {}
            at_own = np.ones(np.shape(done[place]), bool)
            for number, keys in enumerate(self.along.values()):
                given |= {
                    name: _own_value(scene.get(along.key), along)
                    for name, along in keys.items()
                }
                same = [
                    [compared("=", given[n], v) for v in along.values]
                    for n, along in keys.items()
                ]
                at_own &= np.all(same, axis=0).reshape(
                    [-1 if i == number else 1 for i in range(at_own.ndim)]
                )
            computed[place] &= at_own
            own[case.label] = {
                name: value for name, value in given.items() if value is not None
            }
        words = (
            "whether the run stands at its own place here; else a case without a "
            "sweep, repeated"
        )
        about = {"long_name": words, "own_values": json.dumps(own, ensure_ascii=False)}
        return (tuple(self.axes), computed, about)

    def missing(self) -> list[str]:
        """Name the first grid points that have a run but no data, and say how many more there are."""
        lacking = np.argwhere(
            np.array([*(state != DONE for state in self.status), False])[self.points]
        )
        names = []
        for point in lacking[:MOST_MISSING]:
            number = self.points[tuple(point)]
            places = zip(self.axes, point, strict=True)
            where = ", ".join(
                f"{name}={outcome.value_text(self.axes[name][i], None)}"
                for name, i in places
            )
            names.append(
                f"{where or self.campaign.cases[number].id}: {self.status[number]}"
            )
        omitted = len(lacking) - len(names)
        return [*names, f"and {omitted} more, by status"] if omitted > 0 else names


class _Stored:
    """The runs with data on a grid, and what they are like.

    Parameters
    ----------
    cases : where runs stand
    layouts : the tables of variables that the runs name
    folder : of their files
    """

    def __init__(self, cases: _Cases, layouts: Mapping[str, Any], folder: Path) -> None:
        done = {
            run.id: run for run in cases.runs if run is not None and run.state == DONE
        }
        self.done = list(done.values())
        kinds = {
            form: number
            for number, form in enumerate(dict.fromkeys(run.form for run in self.done))
        }
        self.groups = [
            reading.RunGroup(dict(sizes), **layouts[key or ""]) for key, sizes in kinds
        ]
        told = [
            (f"{folder}/{run.id[:2]}/{run.id}.nc", run.sha256, kinds[run.form])
            for run in self.done
        ]
        self.files = tuple(map(reading.RunFile._make, told))
        for number, group in enumerate(self.groups):
            sizes = (
                [group.sizes[dim] for dim in variable["dims"]]
                for variable in group.variables.values()
            )
            claimed = max(
                (8 * math.prod(lengths) for lengths in sizes), default=0
            )  # by the largest variable
            refuse_oversized(
                next(file.path for file in self.files if file.group == number), claimed
            )
        # the number of the run with data at each point, −1 where there is none
        of_run = {run_id: number for number, run_id in enumerate(done)}
        of_case = [of_run.get(case.id, -1) for case in cases.campaign.cases]
        self.dims = tuple(cases.axes)
        self.numbers = np.asarray(np.array([*of_case, -1], np.intp)[cases.points])
        made = (
            [(run.id, run.sha256) for run in self.done],
            cases.points.tobytes(),
            str(folder),
        )
        self.token = hashlib.sha256(repr(made).encode()).hexdigest()[
            :16
        ]  # another when a run is
        self._join()

    def _join(self) -> None:
        """Join the run dims: the union of names along a dim of text, the longest of the others."""
        self.sizes: dict[str, int] = {}
        self.labels: dict[str, list[Any]] = {}
        self.by_label = set[str]()
        for group in self.groups:
            for dim, size in group.sizes.items():
                self.sizes[dim] = max(size, self.sizes.get(dim, 0))
        for dim in self.sizes:
            known = [group.labels[dim] for group in self.groups if dim in group.labels]
            longest = max(known, key=len, default=[])
            if known and isinstance(known[0][0] if known[0] else "", str):
                self.by_label.add(dim)
                self.labels[dim] = list(dict.fromkeys(chain.from_iterable(known)))
                self.sizes[dim] = len(self.labels[dim])
            elif longest and all(some == longest[: len(some)] for some in known):
                self.labels[dim] = longest

    def variable(self, name: str) -> tuple[Mapping[str, Any], Any]:
        """Return how a variable is stored, and it on the grid: labels and texts known, others lazy arrays."""
        first = next(
            group.variables[name] for group in self.groups if name in group.variables
        )
        own = tuple(first["dims"])
        if (
            not own and first["dtype"] == "str"
        ):  # such as the verdict: as the catalogue has it
            texts = np.array(
                [*(str(run.summary.get(name) or "") for run in self.done), ""], object
            )
            return first, (
                self.dims,
                np.asarray(texts[self.numbers], TEXT),
                first["attrs"],
            )
        if own == (name,) and name in self.labels:
            return first, ((name,), self.labels[name], first["attrs"])
        numbers = self.numbers
        dims = self.dims
        digests = {run.digests.get(name) for run in self.done}
        if (
            first.get("coordinate") and len(digests) == 1 and None not in digests
        ):  # one file answers for all
            numbers = np.zeros((), np.intp)
            dims = ()
        places = {
            number: tuple(self._place(group.labels.get(dim), dim) for dim in own)
            for number, group in enumerate(self.groups)
            if tuple(group.variables.get(name, {}).get("dims", "?")) == own
        }
        padded = tuple(self.sizes[dim] for dim in own)
        equal = all(
            group.sizes.get(dim) == self.sizes[dim]
            for group in self.groups
            for dim in own
        )
        whole = bool((numbers >= 0).all()) and len(places) == len(self.groups) and equal
        dtype, fill = _dtype(first["dtype"], whole)
        lazy = reading.LazyVariable(
            name, numbers, self.files, places, padded, dtype, fill
        )
        chunks = tuple((1,) * n for n in numbers.shape) + tuple((n,) for n in padded)
        told = {
            "asarray": False,
            "meta": np.empty((0,) * lazy.ndim, dtype),
            "inline_array": True,
        }
        data = dask.array.from_array(lazy, chunks, f"{name}-{self.token}", **told)
        return first, xr.Variable(dims + own, data, first["attrs"], fastpath=True)

    def _place(self, labels: list[Any] | None, dim: str) -> list[int] | None:
        """Return where values go along a dim, None where they simply start at 0."""
        union = self.labels.get(dim, [])
        if dim not in self.by_label or labels is None or labels == union[: len(labels)]:
            return None
        return [union.index(label) for label in labels]


def _dtype(stored: str, whole: bool) -> tuple[np.dtype[Any], Any]:
    """Return dtype and filling: text stays text, numbers with holes become float64."""
    if stored == "str":
        return TEXT, ""
    if not NUMBER.fullmatch(stored):
        reason = f"{stored[:40]!r} as a type of numbers"
        raise StoreError(f"the catalogue names {reason}; 'wearlab reindex' mends it")
    return (
        (np.dtype(stored), 0)
        if whole and np.dtype(stored).kind != "f"
        else (np.dtype(float), np.nan)
    )


def grid_axes(campaign: "Campaign") -> dict[str, list[Any]]:
    """Return the grid's dims and the values along them: sweep axes, then ``case`` where there are cases."""
    axes = {axis.name: list(axis.values) for axis in campaign.axes}
    labels = dict.fromkeys(case.label for case in campaign.cases)
    if [*labels] != [BASE]:
        axes["case"] = sorted(labels, key=lambda label: label != BASE)
    return axes


def _base_text(campaign: "Campaign", scenes: Mapping[str, str]) -> str:
    """Return what the base is beside the other cases: what it has for what they change, or what is swept.

    Cases that change little come first; those that change too much to be told are left
    out.
    """
    first = {case.label: scenes.get(case.id, "") for case in reversed(campaign.cases)}
    swept = {along.key for axis in campaign.axes for along in _along(axis).values()}
    base = first.pop(BASE, "")
    replaced: dict[str, str] = {}
    for words in sorted(
        (_changed(base, text, swept) for text in first.values() if text and base),
        key=len,
    ):
        if len(replaced | words) <= MOST_WORDS:
            replaced |= words
    if replaced:
        kinds = (key.removesuffix(".model").rpartition(".")[2] for key in replaced)
        values = ("no" if word == "none" else word for word in replaced.values())
        return ", ".join(map(" ".join, zip(values, kinds, strict=True))).replace(
            "_", " "
        )
    swept_too = any(case.position for case in campaign.cases if case.label != BASE)
    if not campaign.axes or not first or swept_too:
        return ""
    return f"{', '.join(axis.name for axis in campaign.axes)} swept".replace("_", " ")


def _changed(base: str, other: str, swept: Container[str]) -> dict[str, str]:
    """Return the words that the base has for those that another scene changes, by key."""
    pairs = [
        d
        for d in differences(base, other)
        if isinstance(d.a, str) and isinstance(d.b, str)
    ]
    return {d.key: str(d.a) for d in pairs if d.key not in swept}


def _along(axis: "Axis", si: bool = False) -> "dict[str, Coordinate]":
    """Return an axis and what advances along it, by name: in the units of the file, or in SI."""
    from wearlab.campaign import Coordinate

    told: dict[str, Coordinate] = {}
    each: dict[str, Axis | Coordinate] = {axis.name: axis, **axis.coordinates}
    for name, along in each.items():
        told[name] = Coordinate(along.values, along.units, along.key)
        if si and along.units and (kind := quantity_at(along.key)) is not None:
            unit = KINDS[kind].unit
            values = tuple(
                convert(float(value), along.units, unit) for value in along.values
            )
            told[name] = Coordinate(values, unit, along.key)
    return told


def own_values(grid: xr.Dataset) -> dict[str, dict[str, Any]]:
    """Return what each case that is not swept has of the keys that are, by case and coordinate."""
    text = (
        grid["computed"].attrs.get("own_values") if "computed" in grid.coords else None
    )
    return dict(json.loads(text)) if text else {}


def _own_value(stored: Any, along: "Coordinate") -> Any:
    """Return a value of a scene in the unit of an axis, None where the scene has no such key."""
    if (
        not is_number(stored)
        or not along.units
        or (kind := quantity_at(along.key)) is None
    ):
        return stored
    return convert(float(stored), KINDS[kind].unit, along.units)


def key_text(key: str) -> str:
    """Return what stands under a key in words: its last word, and what it is of where that says too little.

    Examples
    --------
    >>> key_text("operation.speed"), key_text("wear.coefficient.value")
    ('speed', 'wear coefficient')
    """
    words = key.split(".")
    telling = (
        words[-3:-1]
        if words[-1] == "value"
        else words[-2:]
        if words[-1] in UNSAID
        else words[-1:]
    )
    return " ".join(telling or words).replace("_", " ")
