"""``compare``: two runs in full, two campaigns or grids pair by pair, as named runs."""

import json
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np
import xarray as xr

from wearlab.comparison import runs
from wearlab.store import Store
from wearlab.store.grid import DONE, EXCLUDED, MOST_MISSING, own_values
from wearlab.store.outcome import value_text
from wearlab.units import KINDS, UnitError, convert

BASE = "base"
Key = tuple[tuple[str, Any], ...]


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
    """One of the two things compared: its title and runs.

    The names of the runs without data.
    """

    title: str
    members: tuple[SideRun, ...]
    absent: tuple[str, ...] = ()
    single: bool = False


def side(subject: Any, store: Store | None, name: str) -> Side:
    """Return what was given as named runs.

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
        return (
            _of_grid(subject, name) if "run_id" in subject else _of_run(subject, name)
        )
    if store is None:
        raise runs.CompareError(
            f"{name}: {subject!r} is looked up in a store: give store = Store(...)"
        )
    if isinstance(subject, str):
        return _of_run(store.run(subject), name)
    if hasattr(subject, "cases"):
        return _of_grid(store.open(subject), name, store.run)
    raise runs.CompareError(
        f"{name}: {type(subject).__name__} is no run, no id and no campaign"
    )


def _of_run(run: xr.Dataset, name: str) -> Side:
    run_id = str(run.attrs.get("id", ""))
    return Side(
        run_id[:10] or name,
        (SideRun((), run_id[:10] or name, run_id, lambda: run),),
        single=True,
    )


def _of_grid(
    grid: xr.Dataset, name: str, read: Callable[[str], xr.Dataset] | None = None
) -> Side:
    """Return the runs of a grid, read from it, or by their ids."""
    dims = [str(dim) for dim in grid["run_id"].dims]
    places = {dim: grid[dim].values.tolist() for dim in dims}
    members: dict[object, SideRun] = {}
    absent: list[
        str
        # of these points: the grid's own list tells of all that were opened with them
    ] = []
    repeated = own_values(grid) if read or "computed" in grid.coords else None
    for point in np.ndindex(*grid["run_id"].shape):
        run_id = str(grid["run_id"].values[point])
        state = str(grid["status"].values[point])
        if state in ("", EXCLUDED):
            continue
        index = dict(zip(dims, point, strict=True))
        values = {
            d: (places[d][i], grid[d].attrs.get("units")) for d, i in index.items()
        }
        label = str(values.pop("case", (BASE, None))[0])
        own = (
            point if repeated is not None and label not in repeated else (label, run_id)
        )
        if own in members or label in (
            repeated or ()
        ):  # repeated along the axes: known by its label alone
            values = {}
        words = ", ".join(f"{d} = {value_text(v, u)}" for d, (v, u) in values.items())
        named = label if not words else words if label == BASE else f"{label}, {words}"
        if run_id and state == DONE:
            reader = partial(read, run_id) if read else _point(grid, index)
            members[own] = SideRun(_key(label, values), named, run_id, reader)
        else:
            absent.append(f"{named}: {state}")
    order = {str(label): rank for rank, label in enumerate(places.get("case", [BASE]))}
    ordered = sorted(
        members.values(), key=lambda member: order[dict(member.key)["case"]]
    )
    absent = list(dict.fromkeys(absent))
    more = (
        [f"and {len(absent) - MOST_MISSING} more"] if len(absent) > MOST_MISSING else []
    )
    return Side(
        str(grid.attrs.get("title") or name),
        tuple(ordered),
        (*absent[:MOST_MISSING], *more),
    )


def _point(grid: xr.Dataset, index: dict[str, int]) -> Callable[[], xr.Dataset]:
    def read() -> xr.Dataset:
        run = grid.isel(index).drop_vars([d for d in index if d in grid.coords])
        if "update" in run.dims and "n_updates" in run:
            run = run.isel(update=slice(int(run["n_updates"])))
        run = run.rename({f"{n}_values": n for n in ("phase",) if f"{n}_values" in run})
        run = run.compute(scheduler="synchronous")
        void = [
            n
            for n, v in run.data_vars.items()
            if v.dtype.kind == "f" and bool(v.isnull().all())
        ]
        return run.drop_vars(void).assign_attrs(id=str(run["run_id"].values))

    return read


def _key(label: str, places: dict[str, tuple[Any, str | None]]) -> Key:
    """Return label and place in a form that does not depend on the unit a file chose."""
    return (
        ("case", label),
        *sorted((name, _si(*place)) for name, place in places.items()),
    )


def _si(value: Any, units: str | None) -> Any:
    if isinstance(value, str | bool) or not isinstance(value, int | float):
        return str(value)
    if not units:
        return f"{float(value):.9g}"
    for kind in sorted(KINDS.values(), key=lambda kind: units not in kind.units):
        with suppress(UnitError):
            return f"{convert(float(value), units, kind.unit):.9g}"
    return f"{value} {units}"


def pairs(
    a: Side, b: Side
) -> tuple[list[tuple[SideRun, SideRun]], list[str], list[str]]:
    """Return the runs that belong together, and the names of those left over on either side.

    Two single runs belong together whatever they are; others by label and place.
    """
    if len(a.members) == len(b.members) == 1:
        return [(a.members[0], b.members[0])], list(a.absent), list(b.absent)
    partners = {member.key: member for member in b.members}
    matched = [
        (member, partners[member.key]) for member in a.members if member.key in partners
    ]
    matched_keys = {member.key for member, _ in matched}
    left = [*(m.name for m in a.members if m.key not in matched_keys), *a.absent]
    right = [*(m.name for m in b.members if m.key not in matched_keys), *b.absent]
    return matched, left, right


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
    ``largest_relative_difference(quantity)`` [1], ``first_difference(quantity)``
    [cycles, or m of wear depth; NaN: never]. Of campaigns: the summary for every
    ``pair`` of runs with equal label and place, and ``largest_value(pair, run,
    quantity)``, ``life(pair, run)``. ``attrs``: ids, titles, ``scene_differences`` as
    JSON.

    Raises
    ------
    CompareError : nothing in common
    StoreError : a run is not there
    """
    if on not in (runs.CYCLE, runs.WEAR_DEPTH):
        raise runs.CompareError(f"on = {on!r}: there are 'cycle' and 'wear_depth'")
    if not tolerance > 0.0:
        raise runs.CompareError(f"tolerance = {tolerance!r} is not greater than 0")
    left = side(a, store, "A")
    right = side(b, store, "B")
    if left.single and right.single:
        return runs.compare_runs(
            left.members[0].read(), right.members[0].read(), on, tolerance
        )
    return _campaigns(left, right, on, tolerance)


def _campaigns(a: Side, b: Side, on: str, tolerance: float) -> xr.Dataset:
    matched, only_a, only_b = pairs(a, b)
    if not matched:
        told = f"A has {_some(only_a)}; B has {_some(only_b)}"
        raise runs.CompareError(
            f"no run of {a.title!r} has a partner in {b.title!r}: {told}"
        )
    made = [_reduced(left, other, on, tolerance) for left, other in matched]
    whole = xr.concat(
        made,
        "pair",
        join="outer",
        combine_attrs="drop",
        data_vars="all",
        coords="minimal",
    )
    whole = whole.sel(
        quantity=[q.name for q in runs.QUANTITIES if q.name in whole["quantity"]]
    )
    ids = [[left.id, other.id] for left, other in matched]
    names: dict[str, Any] = {
        "pair": [left.name for left, _ in matched],
        "run_id": (("pair", "run"), ids),
    }
    whole = whole.assign_coords(names | runs.described(whole["quantity"].values))
    words = f"comparison of {a.title!r} and {b.title!r}"
    title = {"title": words, "campaign_a": a.title, "campaign_b": b.title}
    left = {
        f"only_{side}": json.dumps(o, ensure_ascii=False)
        for side, o in (("a", only_a), ("b", only_b))
    }
    alike = _shared([str(compared["scene_differences"].values) for compared in made])
    aligned = {"aligned_on": on, "tolerance": tolerance}
    return whole.assign_attrs({**title, **aligned, **left, "scene_differences": alike})


def _reduced(a: SideRun, b: SideRun, on: str, tolerance: float) -> xr.Dataset:
    """Return what is kept of one pair, its files closed: memory does not grow with the waves."""
    full = runs.compare_runs(a.read(), b.read(), on, tolerance)
    names = [str(name) for name in full["quantity"].values]
    apart = (abs(full[name].where(np.isfinite(full[name]))) for name in names)
    largest = np.stack(
        [each.max([dim for dim in each.dims if dim != "run"]).values for each in apart],
        1,
    )
    scalars = [name for name in runs.SCALARS if name in full]
    kept = full[
        ["largest_relative_difference", "first_difference", *scalars]
    ].reset_coords(drop=True)
    about = {
        "long_name": "largest magnitude over the common states",
        "comment": "in each quantity's SI unit",
    }
    kept["largest_value"] = ("run", "quantity"), largest, about
    return kept.assign(scene_differences=((), full.attrs["scene_differences"]))


def _shared(texts: Sequence[str]) -> str:
    """Return the scene's differences that every pair has alike."""
    first, *remaining = (json.loads(text) for text in texts)
    return json.dumps(
        [key for key in first if all(key in t for t in remaining)], ensure_ascii=False
    )


def _some(names: Sequence[str]) -> str:
    return (
        ", ".join(names[:4]) + (", …" if len(names) > 4 else "") or "nothing with data"
    )
