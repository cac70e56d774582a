"""What is compared, as named runs: one run, a campaign in a store, or a grid opened from one."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from wearlab.comparison.errors import CompareError
from wearlab.store.place import place, value_text
from wearlab.units import KINDS, UnitError, convert

if TYPE_CHECKING:
    from wearlab.store import Store

BASE = "base"
Key = tuple[tuple[str, Any], ...]


@dataclass(frozen=True)
class SideRun:
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


@dataclass(frozen=True)
class Side:
    """One of the two things compared: its title and runs; the names of the runs without data."""

    title: str
    members: tuple[SideRun, ...]
    absent: tuple[str, ...] = ()
    single: bool = False


def side(given: Any, store: "Store | None", name: str) -> Side:
    """Return what was given as named runs.

    Parameters
    ----------
    given : dataset of a run, grid, `Campaign`, or the id of a run
    store : where campaigns and ids are looked up
    name : A or B

    Raises
    ------
    CompareError : it is none of these, or needs a store and has none
    """
    if isinstance(given, xr.Dataset):
        return _of_grid(given, name) if "run_id" in given else _of_run(given, name)
    if store is None:
        raise CompareError(f"{name}: {given!r} is looked up in a store: give store = Store(...)")
    if isinstance(given, str):
        return _of_run(store.run(given), name)
    if hasattr(given, "cases"):
        return _of_campaign(given, store)
    raise CompareError(f"{name}: {type(given).__name__} is no run, no id and no campaign")


def _of_run(run: xr.Dataset, name: str) -> Side:
    run_id = str(run.attrs.get("id", ""))
    return Side(run_id[:10] or name, (SideRun((), run_id[:10] or name, run_id, lambda: run),), single=True)


def _of_campaign(campaign: Any, store: "Store") -> Side:
    entries = store.entries(case.id for case in campaign.cases)
    axes = {axis.name: axis for axis in campaign.axes}
    members, absent = [], []
    for case in campaign.cases:
        places = {n: (axes[n].values[i], axes[n].units) for n, i in case.position.items()}
        words = ", ".join(f"{n} = {text}" for n, text in place(campaign, case).items())
        name = case.label if not words else words if case.label == BASE else f"{case.label}, {words}"
        entry = entries.get(case.id)
        if entry is None or entry.state != "done":
            absent.append(f"{name}: {entry.state if entry else 'missing'}")
            continue
        members.append(SideRun(_key(case.label, places), name, case.id, _reader(store, case.id)))
    return Side(campaign.title, tuple(members), tuple(absent))


def _reader(store: "Store", run_id: str) -> Callable[[], xr.Dataset]:
    return lambda: store.run(run_id)


def _of_grid(grid: xr.Dataset, name: str) -> Side:
    dims = [str(dim) for dim in grid["run_id"].dims]
    members: dict[str, SideRun] = {}
    absent = [str(missing) for missing in np.atleast_1d(grid.attrs.get("missing", []))]
    for point in np.ndindex(*grid["run_id"].shape):
        run_id = str(grid["run_id"].values[point])
        if not run_id or str(grid["status"].values[point]) != "done":
            continue
        index = dict(zip(dims, point, strict=True))
        values = {d: (_plain(grid[d].values[i]), grid[d].attrs.get("units")) for d, i in index.items()}
        label = str(values.pop("case", (BASE, None))[0])
        if run_id in members:  # broadcast along the axes: known by its label alone
            members[run_id] = SideRun(_key(label, {}), label, run_id, members[run_id].read)
            continue
        words = ", ".join(f"{d} = {value_text(v, u)}" for d, (v, u) in values.items())
        members[run_id] = SideRun(_key(label, values), words or label, run_id, _point(grid, index))
    ordered = sorted(members.values(), key=lambda member: dict(member.key)["case"] != BASE)
    return Side(str(grid.attrs.get("title") or name), tuple(ordered), tuple(absent))


def _point(grid: xr.Dataset, index: dict[str, int]) -> Callable[[], xr.Dataset]:
    def read() -> xr.Dataset:
        run = grid.isel(index).drop_vars([d for d in index if d in grid.coords])
        if "update" in run.dims and "n_updates" in run:
            run = run.isel(update=slice(int(run["n_updates"])))
        run = run.rename({f"{n}_values": n for n in ("phase",) if f"{n}_values" in run})
        run = run.compute(scheduler="synchronous")
        void = [n for n, v in run.data_vars.items() if v.dtype.kind == "f" and bool(v.isnull().all())]
        return run.drop_vars(void).assign_attrs(id=str(run["run_id"].values))

    return read


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def _key(label: str, places: dict[str, tuple[Any, str | None]]) -> Key:
    """Return label and place in a form that does not depend on the unit a file chose."""
    return (("case", label), *sorted((name, _si(*place)) for name, place in places.items()))


def _si(value: Any, units: str | None) -> Any:
    if isinstance(value, str | bool) or not isinstance(value, int | float):
        return str(value)
    if units:
        try:
            value = convert(float(value), units, _base(units))
        except UnitError:
            return f"{value} {units}"
    return f"{float(value):.9g}"


def _base(units: str) -> str:
    """Return the SI unit of the first kind of quantity that is written so."""
    for kind in KINDS.values():
        if units in kind.units:
            return kind.unit
    for kind in KINDS.values():
        try:
            convert(1.0, units, kind.unit)
        except UnitError:
            continue
        return kind.unit
    return units


def pairs(a: Side, b: Side) -> tuple[list[tuple[SideRun, SideRun]], list[str], list[str]]:
    """Return the runs that belong together, and the names of those left over on either side.

    Two single runs belong together whatever they are; others by label and place.
    """
    if len(a.members) == len(b.members) == 1:
        return [(a.members[0], b.members[0])], list(a.absent), list(b.absent)
    others = {member.key: member for member in b.members}
    matched = [(own_member, others[own_member.key]) for own_member in a.members if own_member.key in others]
    taken = {left.key for left, _ in matched}
    return matched, list(_left(a, taken)), list(_left(b, taken))


def _left(of_side: Side, taken: set[Key]) -> Iterator[str]:
    yield from (member.name for member in of_side.members if member.key not in taken)
    yield from of_side.absent
