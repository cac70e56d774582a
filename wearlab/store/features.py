"""Features for statistics and learning: one row for each wear state of each run, one column for each number.

A variable along flanks, meshes, members, harmonics, orders or modes gives one column for each label, named
by dots: ``ste_harmonics.pinion-gear.1``. A signal along the phase gives its indicators: mean, RMS and range
of its fluctuation, crest factor, kurtosis and amplitudes at mesh orders, at the stored phases. Whatever
differs between the runs' scenes comes first, by its key.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearlab.query.flat import flat
from wearlab.query.result_keys import declared_key
from wearlab.query.scene_keys import scene_key
from wearlab.store.errors import StoreError
from wearlab.store.indicators import INDICATORS, indicators
from wearlab.store.kept_runs import KeptRuns
from wearlab.store.table import Column, Table

if TYPE_CHECKING:
    from wearlab.store.catalogue import Entry

STATE = "update"
NAMED = frozenset(
    ("flank", "member", "mesh", "harmonic", "order", "mode", "axis", "duty", "stage", "multiplier", "part")
)
"""Dimensions whose labels become part of a column's name."""
ALONG = ("mesh_period", "phase")
ALWAYS = ("operation.torque", "operation.speed")
OWN = (
    Column("run"),
    Column("state"),
    Column("cycle", "1", "1"),
    Column("operating_hours", "s", "h"),
)
LEFT_OUT = ("run_time", "count", "residual", "error_weight", "secant_stiffness", "excitation")
HARMONICS = ("mesh_stiffness", "static_transmission_error", "dynamic_transmission_error")
"""Signals whose RMS and amplitudes at mesh orders the dataset has already, jumps between phases included."""
Row = dict[Column, Any]


def features(store: KeptRuns, where: str = "", variables: Sequence[str] | None = None) -> Table:
    """Return the features of the runs that meet a condition.

    Parameters
    ----------
    store : where they are
    where : condition as in `Store.query` [all runs that are done]
    variables : from which columns are made [every number]

    Returns
    -------
    Table with the columns run, state (number of the wear state), cycle, operating_hours, the values of the
    scenes that differ, then the features.

    Raises
    ------
    QueryError : the condition cannot be read
    StoreError : there is no store, no such run, or no run has a variable
    """
    ids = store.query(where, columns=())["id"]
    done = {key: entry for key, entry in store.entries(ids).items() if entry.state == "done"}
    if not done:
        raise StoreError(f"features: no run {'that is done meets the condition' if where else 'is done'}")
    inputs = _differing(done)
    rows: list[Row] = []
    known: set[str] = set()
    for run_id in done:
        data = store.run(run_id)
        known.update(map(str, data.variables))
        rows += [{**own, **inputs[run_id], **found} for own, found in _states(run_id, data, variables)]
    columns = tuple(dict.fromkeys((*OWN, *(column for row in rows for column in row))))
    _refuse_unknown(variables, columns, known)
    return Table(columns, [tuple(row.get(column) for column in columns) for row in rows])


def _refuse_unknown(variables: Sequence[str] | None, columns: Iterable[Column], known: set[str]) -> None:
    present = [column.name for column in columns]
    for name in variables or ():
        if declared_key(name) is None:
            near = get_close_matches(name, sorted(known), 1)
            meant = f"did you mean {near[0]!r}?" if near else "'wearlab variables' lists them"
            raise StoreError(f"features: {name!r}: there is no such variable; {meant}")
        if not any(one.startswith(name) for one in present):
            raise StoreError(f"features: {name!r}: no run here has it as numbers at its wear states")


def _differing(entries: Mapping[str, "Entry"]) -> dict[str, Row]:
    """Return torque, speed and every value of the scenes that is not the same in all of them."""
    scenes = {run_id: dict(flat(json.loads(entry.scene or "{}"))) for run_id, entry in entries.items()}
    keys = dict.fromkeys(key for scene in scenes.values() for key in scene)
    kept = [
        key for key in keys if key in ALWAYS or len({repr(scene.get(key)) for scene in scenes.values()}) > 1
    ]
    columns = {key: _input(key, [scene.get(key) for scene in scenes.values()]) for key in kept}
    return {
        run_id: {columns[key]: scene.get(key) for key in kept if scene.get(key) is not None}
        for run_id, scene in scenes.items()
    }


def _input(key: str, values: list[Any]) -> Column:
    known = scene_key(key, any(isinstance(value, str) for value in values))
    return Column(key, known.unit, known.display_unit, given=True)


def _states(run_id: str, data: xr.Dataset, variables: Sequence[str] | None) -> Iterator[tuple[Row, Row]]:
    kept = [
        str(name)
        for name, one in data.variables.items()
        if one.dtype.kind in "fiu"
        and declared_key(str(name)) is not None
        and name not in data.coords
        and (not str(name).startswith(LEFT_OUT) if variables is None else name in variables)
    ]
    count = data.sizes.get(STATE, 1)
    rows: list[Row] = [{} for _ in range(count)]
    for name in kept:
        for row, own in zip(rows, _columns(name, data.variables[name], data), strict=False):
            row |= own
    for state, row in enumerate(rows):
        values = (run_id, state, *(_coordinate(data, name, state) for name in ("cycle", "operating_hours")))
        yield dict(zip(OWN, values, strict=True)), row


def _coordinate(data: xr.Dataset, name: str, state: int) -> float | None:
    return float(data[name].values[state]) if name in data.variables and data[name].ndim else None


def _columns(name: str, values: xr.Variable, data: xr.Dataset) -> Iterator[Row]:
    """Yield the columns of one variable at each wear state; of one without states, the same at each."""
    along = [dim for dim in ALONG if dim in values.dims]
    named = [str(dim) for dim in values.dims if dim in NAMED]
    if set(values.dims) - {STATE, *named, *along}:
        return
    table = values.transpose(*(dim for dim in (STATE, *named, *along) if dim in values.dims)).values
    if STATE not in values.dims:
        table = np.broadcast_to(table, (data.sizes.get(STATE, 1), *table.shape))
    labels = [_labels(data, dim) for dim in named]
    places = list(np.ndindex(*(len(one) for one in labels)))
    ends = ["".join(f".{one[at]}" for one, at in zip(labels, place, strict=True)) for place in places]
    of = _of_signal if along else _of_value
    units = str(values.attrs.get("units", "")), str(values.attrs.get("display_units", ""))
    for state in table:
        row: Row = {}
        for place, end in zip(places, ends, strict=True):
            row |= of(name, state[place], end, *units)
        yield row


def _of_value(name: str, value: Any, end: str, units: str, shown: str) -> Row:
    return {Column(name + end, units, shown): _plain(value)}


def _of_signal(name: str, values: NDArray[Any], end: str, units: str, shown: str) -> Row:
    return {
        Column(f"{name}_{what}{end}", INDICATORS.get(what) or units, INDICATORS.get(what) or shown): _plain(
            one
        )
        for what, one in indicators(_signal(values)).items()
        if not (what.startswith(("rms", "order_")) and name in HARMONICS)
    }


def _labels(data: xr.Dataset, dim: str) -> list[str]:
    known = data.coords[dim].values if dim in data.coords else range(1, data.sizes[dim] + 1)
    return [str(one) for one in known]


def _signal(values: NDArray[Any]) -> NDArray[np.float64]:
    """Return a signal over whole mesh periods, (periods, phases); periods that only pad are left out."""
    periods = np.atleast_2d(np.asarray(values, float))
    return periods[np.isfinite(periods).all(axis=1)]


def _plain(value: Any) -> float | None:
    number = float(value)
    return number if np.isfinite(number) else None
