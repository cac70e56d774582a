"""A formula worked out on a campaign's dataset: every name becomes an array with its unit."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from wearlab import nearest, units
from wearlab.query import evaluate, formula

BASE = "base"
STATES = ("cycle", "mesh_cycles")
PLAIN = ("", "1")
REDUCED = {
    "max": lambda values, dims: values.max(dims),
    "min": lambda values, dims: values.min(dims),
    "mean": lambda values, dims: values.mean(dims),
    "range": lambda values, dims: values.max(dims) - values.min(dims),
}


class AmountError(ValueError):
    """A formula has no number on these runs; one sentence says why."""


@dataclass(frozen=True)
class Measured:
    """Values with their unit."""

    values: Any
    units: str


def amount(text: str, grid: Any, units: str = "") -> float:
    """Return the number that a formula has on a campaign's dataset.

    Parameters
    ----------
    text : of the grammar of `wearlab.query.formula`
    grid : what `Store.open` returns; without a place along ``case``, the base counts
    units : that it is wanted in, "" for a plain number

    Raises
    ------
    AmountError : a name or a label is not there, units do not fit, no run has it, or several numbers remain
    """
    found = _worked_out(formula.parse_formula(text), grid, {})
    values = np.unique(np.asarray(found.values, float))
    values = values[np.isfinite(values)]
    if not values.size:
        raise AmountError(f"{text}: no stored run has it")
    if np.ptp(values) > 1e-12 * np.abs(values).max():
        dims = [f"{dim} ({size})" for dim, size in found.values.sizes.items() if size > 1]
        raise AmountError(f"{text}: {values.size} numbers, not one: choose along {', '.join(dims)}")
    return _converted(float(values[0]), found.units, units, text)


def _converted(value: Any, given: str, wanted: str, text: str) -> Any:
    if given in PLAIN and wanted in PLAIN:
        return value
    try:
        return units.convert(value, given or "1", wanted or "1")
    except units.UnitError as error:
        raise AmountError(f"{text}: {error}") from None


def _worked_out(tree: Any, grid: Any, places: Mapping[str, Any]) -> Measured:
    match tree:
        case formula.PlainNumber(value):
            import xarray as xr

            return Measured(xr.DataArray(value), "1")
        case formula.Named(name):
            return _variable(name, grid, places)
        case formula.PlacedNumber(inner, own):
            return _worked_out(inner, grid, {**dict(own), **places})
        case formula.Applied(function, inner, dim):
            return _applied(function, _worked_out(inner, grid, places), dim, grid)
        case formula.Joined(sign, left, right):
            return _joined(sign, _worked_out(left, grid, places), _worked_out(right, grid, places))
    raise AssertionError(tree)


def _joined(sign: str, left: Measured, right: Measured) -> Measured:
    """Return a sum in the unit of its left side, a product of which one side is plain, or a ratio."""
    a, b = left.values, right.values
    if sign in "+-":
        zero = left.units in PLAIN and not np.any(a)
        units = right.units if zero else left.units
        b = _converted(b, right.units, units, f"the two sides of {sign}")
        return Measured(a + b if sign == "+" else a - b, units)
    if right.units in PLAIN:
        return Measured(a * b if sign == "*" else a / b, left.units)
    if sign == "*" and left.units in PLAIN:
        return Measured(a * b, right.units)
    if sign == "/":
        return Measured(a / _converted(b, right.units, left.units, "the two sides of /"), "1")
    raise AmountError(f"a product of {left.units} and {right.units}: one side has to be a plain number")


def _applied(function: str, found: Measured, dim: str | None, grid: Any) -> Measured:
    values = found.values
    if function == "abs":
        return Measured(abs(values), found.units)
    if dim is not None and dim not in values.dims:
        raise AmountError(f"{function}(…, {dim}): {_not_there(dim, values.dims)}")
    if function in REDUCED:
        return Measured(REDUCED[function](values, dim), found.units)
    assert dim is not None
    filled = values.fillna(-np.inf if function == "largest_at" else np.inf)
    at = filled.argmax(dim) if function == "largest_at" else filled.argmin(dim)
    if dim not in grid.coords:
        return Measured(at, "1")
    along = grid[dim]
    if along.dtype.kind not in "fiu":
        raise AmountError(f"{function}(…, {dim}): {dim} has names, not numbers")
    return Measured(along.isel({dim: at}).drop_vars(dim), str(along.attrs.get("units", "1")))


def _variable(name: str, grid: Any, places: Mapping[str, Any]) -> Measured:
    if name not in grid.variables:
        raise AmountError(f"{name}: {_not_there(name, grid.variables)}")
    values = grid[name]
    if values.dtype.kind not in "fiub":
        raise AmountError(f"{name} holds text, not numbers")
    for dim, label in places.items():
        values = _at(values, dim, label, grid)
    if "case" in values.dims and BASE in values["case"].values:
        values = values.sel(case=BASE)
    values = values.compute(scheduler="synchronous") if values.chunks else values
    return Measured(values.astype(float).reset_coords(drop=True), str(grid[name].attrs.get("units", "1")))


def _at(values: Any, dim: str, label: Any, grid: Any) -> Any:
    """Return values at one place of a dimension; the last wear state is each run's own."""
    if dim in STATES:
        if "update" not in values.dims or dim not in grid.variables:
            return values
        gaps = abs(grid[dim] - float(label)).fillna(np.inf).compute(scheduler="synchronous")
        return values.isel(update=_alike(gaps.argmin("update"), values))
    if dim not in values.dims:
        if dim not in grid.dims:
            raise AmountError(f"{dim} = {label}: {_not_there(dim, grid.dims)}")
        return values
    if dim == "update":
        whole = isinstance(label, float) and label == int(label)
        if not whole or not -values.sizes[dim] <= label < values.sizes[dim]:
            raise AmountError(
                f"update = {label}: it counts from 0 to {values.sizes[dim] - 1}, -1 is the last"
            )
        counts = grid["n_updates"]
        at = counts + int(label) if label < 0 else counts * 0 + int(label)
        return values.isel(update=_alike(at.clip(min=0), values))
    own = list(grid[dim].values) if dim in grid.coords else list(range(values.sizes[dim]))
    attributes = grid[dim].attrs if dim in grid.coords else {}
    index = evaluate.index_of_quantity(label, own, attributes.get("units"), attributes.get("key", ""))
    if index is None:
        raise AmountError(f"{dim} = {label}: {_not_there(str(label), map(str, own))}")
    return values.isel({dim: index})


def _alike(at: Any, values: Any) -> Any:
    """Return indices along the dimensions that values still have; a case that is not there is the base."""
    for dim in [dim for dim in at.dims if dim not in values.dims]:
        chosen = values.coords.get(dim)
        own = list(at[dim].values) if dim in at.coords else []
        at = at.isel({dim: own.index(chosen.item()) if chosen is not None and own else 0})
    return at.drop_vars(list(at.coords))


def _not_there(name: str, known: Any) -> str:
    near = nearest.meant(name, [str(one) for one in known], "")
    return f"is not there{near}"
