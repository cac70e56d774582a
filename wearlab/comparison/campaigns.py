"""``compare``: two runs in full, two campaigns or grids pair by pair, as named runs."""

import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np
import xarray as xr

from wearlab.comparison.quantities import (
    QUANTITIES,
    SCALARS,
    CompareError,
    described,
)
from wearlab.comparison.runs import compare_runs
from wearlab.comparison.states import CYCLE, WEAR_DEPTH
from wearlab.store import Store
from wearlab.store.grid import DONE, EXCLUDED, MAX_MISSING, own_values
from wearlab.store.outcome import value_text
from wearlab.units import KINDS, UnitError, convert

BASE = "base"
SHOWN_NAMES = 4  # runs in a message
Key = tuple[tuple[str, Any], ...]
Place = Mapping[str, tuple[Any, str | None]]
"""Value and unit of a run along each axis."""


class SideRun(NamedTuple):
    """A run of one side.

    Parameters
    ----------
    key : label and place by which it finds its partner
    name : what people call it
    id : its identity
    read : reads it
    """

    key: Key
    name: str
    id: str
    read: Callable[[], xr.Dataset]


class Side(NamedTuple):
    """One of the two things compared.

    Parameters
    ----------
    title : what it is called
    members : its runs
    absent : names of the runs without data
    single : whether it is one run, not a campaign
    """

    title: str
    members: tuple[SideRun, ...]
    absent: tuple[str, ...] = ()
    single: bool = False


class Pairs(NamedTuple):
    """The runs of two sides that belong together, and the names of the others.

    Parameters
    ----------
    matched : a run of A and its partner of B
    only_a, only_b : names of the runs without a partner
    """

    matched: list[tuple[SideRun, SideRun]]
    only_a: list[str]
    only_b: list[str]


def side(subject: Any, store: Store | None, name: str) -> Side:
    """Return what is compared as named runs.

    Parameters
    ----------
    subject : dataset of a run, grid, `Campaign`, or the id of a run
    store : where campaigns and ids are looked up
    name : A or B

    Raises
    ------
    CompareError : it is none of these, or needs a store and has none
    """
    if isinstance(subject, xr.Dataset):
        if "run_id" in subject:
            return _side_of_grid(subject, name)
        return _side_of_run(subject, name)
    if store is None:
        raise CompareError(
            f"{name}: {subject!r} is looked up in a store: give store = Store(...)"
        )
    if isinstance(subject, str):
        return _side_of_run(store.run(subject), name)
    if hasattr(subject, "cases"):
        return _side_of_grid(store.open(subject), name, store.run)
    raise CompareError(
        f"{name}: {type(subject).__name__} is no run, no id and no campaign"
    )


def _side_of_run(run: xr.Dataset, name: str) -> Side:
    """Return one run as a side."""
    run_id = str(run.attrs.get("id", ""))
    title = run_id[:10] or name
    return Side(title, (SideRun((), title, run_id, lambda: run),), single=True)


def _side_of_grid(
    grid: xr.Dataset, name: str, read: Callable[[str], xr.Dataset] | None = None
) -> Side:
    """Return the runs of a grid.

    Parameters
    ----------
    grid : as `Store.open` gives it, or a part of it
    name : A or B
    read : reads a run by its id [from the grid]
    """
    dims = [str(dim) for dim in grid["run_id"].dims]
    axes = {dim: _axis_of(grid, dim) for dim in dims}
    case_labels = [str(label) for label, _ in axes.get("case", [(BASE, None)])]
    repeated = own_values(grid) if read or "computed" in grid.coords else None
    members: dict[object, SideRun] = {}
    # of these points: the grid's attributes list all that were opened with them
    absent: list[str] = []
    for point in np.ndindex(*grid["run_id"].shape):
        run_id = str(grid["run_id"].values[point])
        state = str(grid["status"].values[point])
        if state in ("", EXCLUDED):
            continue

        index = dict(zip(dims, point, strict=True))
        place = {dim: axes[dim][i] for dim, i in index.items()}
        label = str(place.pop("case", (BASE, None))[0])
        is_placed = repeated is not None and label not in repeated
        member_key = point if is_placed else (label, run_id)
        if member_key in members or label in (repeated or ()):
            place = {}  # repeated along the axes: known by its label alone
        title = _member_name(label, place)
        if not run_id or state != DONE:
            absent.append(f"{title}: {state}")
            continue
        reader = partial(read, run_id) if read else _point_reader(grid, index)
        members[member_key] = SideRun(_key(label, place), title, run_id, reader)

    def place_of_case(run: SideRun) -> int:
        return case_labels.index(dict(run.key)["case"])

    ordered = sorted(members.values(), key=place_of_case)
    return Side(
        str(grid.attrs.get("title") or name),
        tuple(ordered),
        _shortened(list(dict.fromkeys(absent))),
    )


def _axis_of(grid: xr.Dataset, dim: str) -> list[tuple[Any, str | None]]:
    """Return value and unit of every place along an axis of a grid."""
    units = grid[dim].attrs.get("units")
    return [(value, units) for value in grid[dim].values.tolist()]


def _member_name(label: str, place: Place) -> str:
    """Return what people call a run: its label, its place, or both."""
    words = ", ".join(
        f"{dim} = {value_text(value, units)}" for dim, (value, units) in place.items()
    )
    if not words:
        return label
    return words if label == BASE else f"{label}, {words}"


def _shortened(names: list[str]) -> tuple[str, ...]:
    """Return the first names of a long list, and how many more there are."""
    if len(names) <= MAX_MISSING:
        return tuple(names)
    return (*names[:MAX_MISSING], f"and {len(names) - MAX_MISSING} more")


def _point_reader(grid: xr.Dataset, index: dict[str, int]) -> Callable[[], xr.Dataset]:
    """Return what reads the run at a point of a grid, without what only pads it."""

    def read() -> xr.Dataset:
        run = grid.isel(index).drop_vars([d for d in index if d in grid.coords])
        if "update" in run.dims and "n_updates" in run:
            run = run.isel(update=slice(int(run["n_updates"])))
        if "phase_values" in run:
            run = run.rename({"phase_values": "phase"})
        run = run.compute(scheduler="synchronous")
        padding = [
            name
            for name, variable in run.data_vars.items()
            if variable.dtype.kind == "f" and bool(variable.isnull().all())
        ]
        return run.drop_vars(padding).assign_attrs(id=str(run["run_id"].values))

    return read


def _key(label: str, place: Place) -> Key:
    """Return label and place in a form that depends on no unit."""
    values = sorted(
        (name, _si_text(value, units)) for name, (value, units) in place.items()
    )
    return (("case", label), *values)


def _si_text(value: Any, units: str | None) -> str:
    """Return a value as text: of a quantity in SI, to nine digits."""
    if isinstance(value, str | bool) or not isinstance(value, int | float):
        return str(value)
    if not units:
        return f"{float(value):.9g}"
    for kind in sorted(KINDS.values(), key=lambda kind: units not in kind.units):
        with suppress(UnitError):
            return f"{convert(float(value), units, kind.unit):.9g}"
    return f"{value} {units}"


def pairs(a: Side, b: Side) -> Pairs:
    """Return the runs that belong together, and those left over on either side.

    Two single runs belong together whatever they are; others by label and place.

    Parameters
    ----------
    a, b : the two sides
    """
    if len(a.members) == len(b.members) == 1:
        return Pairs([(a.members[0], b.members[0])], list(a.absent), list(b.absent))
    partners = {member.key: member for member in b.members}
    matched = []
    for member in a.members:
        if member.key in partners:
            matched.append((member, partners[member.key]))
    matched_keys = {member.key for member, _ in matched}

    def left_over(members: Sequence[SideRun]) -> list[str]:
        return [member.name for member in members if member.key not in matched_keys]

    return Pairs(
        matched,
        [*left_over(a.members), *a.absent],
        [*left_over(b.members), *b.absent],
    )


def compare(
    a: Any,
    b: Any,
    on: Literal["cycle", "wear_depth"] = "cycle",
    tolerance: float = 0.01,
    store: Store | None = None,
) -> xr.Dataset:
    """Compare two runs, or two campaigns.

    Parameters
    ----------
    a, b : datasets of runs, ids of runs, campaigns, or grids opened from a store
    on : at which wear states: the same "cycle", or the same (largest) "wear_depth"
    tolerance : relative difference that counts
    store : where ids and campaigns are looked up

    Returns
    -------
    Of two runs: every quantity ``q(run, state, …)``, ``q_difference`` = B − A, and the
    summary ``relative_difference(quantity, state)`` [1],
    ``relative_estimate(quantity, state)``, the error of both runs by their own
    estimates [1], ``largest_relative_difference(quantity)`` [1], ``differs(quantity)``,
    whether a difference is larger than the estimates, ``first_difference(quantity)``
    [cycles, or m of wear depth; NaN: never], ``has_state(run, state)``, whether a
    stored wear state is near. Wear depths are those of the rates between states; other
    quantities are compared where both runs have a state near, and NaN elsewhere. Of
    campaigns: the summary for every ``pair`` of runs with equal label and place, and
    ``largest_value(pair, run, quantity)``, ``life(pair, run)``. ``attrs``: ids, titles,
    ``scene_differences`` as JSON.

    Raises
    ------
    CompareError : nothing in common
    StoreError : a run is not there
    """
    if on not in (CYCLE, WEAR_DEPTH):
        raise CompareError(f"on = {on!r}: there are 'cycle' and 'wear_depth'")
    if not tolerance > 0.0:
        raise CompareError(f"tolerance = {tolerance!r} is not greater than 0")
    left = side(a, store, "A")
    right = side(b, store, "B")
    if left.single and right.single:
        run_a = left.members[0].read()
        run_b = right.members[0].read()
        return compare_runs(run_a, run_b, on, tolerance)
    return _compare_campaigns(left, right, on, tolerance)


def _compare_campaigns(a: Side, b: Side, on: str, tolerance: float) -> xr.Dataset:
    """Return the summaries of all pairs of runs of two campaigns."""
    matched, only_a, only_b = pairs(a, b)
    if not matched:
        reason = f"A has {_listed(only_a)}; B has {_listed(only_b)}"
        raise CompareError(
            f"no run of {a.title!r} has a partner in {b.title!r}: {reason}"
        )
    summaries = [_summary(run_a, run_b, on, tolerance) for run_a, run_b in matched]
    combined = xr.concat(
        summaries,
        "pair",
        join="outer",
        combine_attrs="drop",
        data_vars="all",
        coords="minimal",
    )
    names = [quantity.name for quantity in QUANTITIES]
    names = [name for name in names if name in combined["quantity"]]
    combined = combined.sel(quantity=names)

    pair_names = [run_a.name for run_a, _ in matched]
    pair_ids = [[run_a.id, run_b.id] for run_a, run_b in matched]
    coordinates: dict[str, Any] = {
        "pair": pair_names,
        "run_id": (("pair", "run"), pair_ids),
        **described(combined["quantity"].values),
    }
    combined = combined.assign_coords(coordinates)
    shared = _shared_differences(
        [str(summary["scene_differences"].values) for summary in summaries]
    )
    return combined.assign_attrs(
        title=f"comparison of {a.title!r} and {b.title!r}",
        campaign_a=a.title,
        campaign_b=b.title,
        aligned_on=on,
        tolerance=tolerance,
        only_a=json.dumps(only_a, ensure_ascii=False),
        only_b=json.dumps(only_b, ensure_ascii=False),
        scene_differences=shared,
    )


def _summary(a: SideRun, b: SideRun, on: str, tolerance: float) -> xr.Dataset:
    """Return what is kept of one pair: memory does not grow with the waves."""
    full = compare_runs(a.read(), b.read(), on, tolerance)
    scalars = [name for name in SCALARS if name in full]
    kept_variables = [
        "largest_relative_difference",
        "differs",
        "first_difference",
        *scalars,
        *(f"{name}_estimate" for name in scalars),
    ]
    summary = full[kept_variables].reset_coords(drop=True)

    largest = []
    for name in map(str, full["quantity"].values):
        values = full[name]
        magnitude = abs(values.where(np.isfinite(values)))
        states_and_places = [dim for dim in magnitude.dims if dim != "run"]
        largest.append(magnitude.max(states_and_places).values)
    attributes = {
        "long_name": "largest magnitude over the common states",
        "comment": "in each quantity's SI unit",
    }
    summary["largest_value"] = (
        ("run", "quantity"),
        np.stack(largest, axis=1),
        attributes,
    )
    return summary.assign(scene_differences=((), full.attrs["scene_differences"]))


def _shared_differences(texts: Sequence[str]) -> str:
    """Return the scene's differences that every pair has alike, as JSON."""
    differences = [json.loads(text) for text in texts]
    shared = [
        difference
        for difference in differences[0]
        if all(difference in of_pair for of_pair in differences[1:])
    ]
    return json.dumps(shared, ensure_ascii=False)


def _listed(names: Sequence[str]) -> str:
    """Return a few names for a message."""
    if not names:
        return "nothing with data"
    listed = ", ".join(names[:SHOWN_NAMES])
    return f"{listed}, …" if len(names) > SHOWN_NAMES else listed
