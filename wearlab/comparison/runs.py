"""Two runs compared: what of them, at the same cycles or wear depths, and as rows of a table."""

import json
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, NamedTuple, cast

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearlab.arrays import Array
from wearlab.query.keys import differences
from wearlab.schema import VARIABLES
from wearlab.schema import attributes as declared
from wearlab.units import convert

ORDERS = 10


class CompareError(ValueError):
    """Runs or campaigns that have nothing in common to compare.

    The message says what each has.
    """


class Quantity(NamedTuple):
    """One thing compared.

    Parameters
    ----------
    name : its variable in a comparison
    source : the variable of the run that it comes from, whose unit it has
    long_name : in words
    of : variable of the run → values at its wear states [as they are]
    """

    name: str
    source: str
    long_name: str
    of: Callable[[xr.DataArray], xr.DataArray] = lambda values: values

    @property
    def attributes(self) -> dict[str, str]:
        """Its unit, display unit and name."""
        variable = VARIABLES[self.source]
        units = {"units": variable.units, "display_units": variable.display_units}
        return {**units, "long_name": self.long_name}


def _mean_over_periods(force: xr.DataArray) -> xr.DataArray:
    """Return the wave over one mesh period: the mean over the periods of the response."""
    return (
        force.mean("mesh_period", skipna=True) if "mesh_period" in force.dims else force
    )


WAVE = ("mesh_period", "phase")


def _range(values: xr.DataArray) -> xr.DataArray:
    """Return the largest minus the smallest value over the phases, all mesh periods together."""
    return _peak(values) + _peak(-values)


def _peak(values: xr.DataArray) -> xr.DataArray:
    return values.max([dim for dim in WAVE if dim in values.dims])


def _orders(force: xr.DataArray) -> xr.DataArray:
    """Return the amplitudes at whole multiples of the mesh frequency, 1 to ``ORDERS``."""
    return (
        _spectra(force)
        .isel(order=slice(ORDERS))
        .assign_coords(order=np.arange(1, ORDERS + 1))
    )


def _between_orders(force: xr.DataArray) -> xr.DataArray:
    """Return the RMS of what lies between those multiples: subharmonics and what is not periodic."""
    return _spectra(force).isel(order=ORDERS)


def _spectra(force: xr.DataArray) -> xr.DataArray:
    """Return the spectrum of each response, as many mesh periods long as it is."""
    if "mesh_period" not in force.dims:
        force = force.expand_dims("mesh_period")
    dims: dict[str, Any] = {"input_core_dims": [WAVE], "output_core_dims": [["order"]]}
    return cast(
        xr.DataArray,
        xr.apply_ufunc(_spectrum, force, vectorize=True, keep_attrs=False, **dims),
    )


def _spectrum(waves: Array) -> Array:
    """Return the amplitudes of (periods, phases) at mesh orders, then the RMS of all between these."""
    held = waves[np.isfinite(waves).all(axis=-1)]
    if not len(held):
        return np.full(ORDERS + 1, np.nan)
    amplitude = 2.0 * np.abs(np.fft.rfft(held.ravel())) / held.size
    whole = amplitude[len(held) :: len(held)][:ORDERS]
    whole = np.pad(whole, (0, ORDERS - len(whole)), constant_values=np.nan)
    return np.append(
        whole,
        np.sqrt(
            0.5 * np.sum(amplitude[np.arange(len(amplitude)) % len(held) != 0] ** 2)
        ),
    )


STE, FORCE, WORDS = (
    "static_transmission_error",
    "dynamic_mesh_force",
    "dynamic mesh force",
)
QUANTITIES = (
    Quantity("wear_depth", "wear_depth", "wear depth"),
    Quantity("max_wear_depth", "max_wear_depth", "largest wear depth"),
    Quantity("mesh_stiffness", "mesh_stiffness", "mesh stiffness (TVMS)"),
    Quantity(
        "stiffness_peak_to_peak",
        "mesh_stiffness",
        "range of the mesh stiffness",
        _range,
    ),
    Quantity(
        "stiffness_harmonics", "stiffness_harmonics", "harmonics of the mesh stiffness"
    ),
    Quantity(STE, STE, "static transmission error"),
    Quantity("ste_peak_to_peak", STE, "range of the static transmission error", _range),
    Quantity(
        "ste_harmonics", "ste_harmonics", "harmonics of the static transmission error"
    ),
    Quantity(FORCE, FORCE, f"{WORDS}, mean over mesh periods", _mean_over_periods),
    Quantity("mesh_force_peak", FORCE, f"largest {WORDS}", _peak),
    Quantity("mesh_force_peak_to_peak", FORCE, f"range of the {WORDS}", _range),
    Quantity("mesh_force_orders", FORCE, f"mesh orders of the {WORDS}", _orders),
    Quantity(
        "mesh_force_between_orders",
        FORCE,
        "RMS of the dynamic mesh force between mesh orders",
        _between_orders,
    ),
)
SCALARS = ("life", "service_life")


def described(names: Iterable[str]) -> dict[str, tuple[str, list[str]]]:
    """Return unit, display unit and name of each quantity, as coordinates along ``quantity``."""
    table = {quantity.name: quantity.attributes for quantity in QUANTITIES}
    keys = {"units": "units", "display_units": "display_units", "name": "long_name"}
    return {
        f"quantity_{end}": ("quantity", [table[n][key] for n in names])
        for end, key in keys.items()
    }


CYCLE, WEAR_DEPTH = "cycle", "wear_depth"
SAME = 1e-9  # two positions that differ by less, relative to the longest, are one

Stands = tuple[Array, NDArray[np.intp]]


def positions(run: xr.Dataset, on: str, name: str) -> Stands:
    """Return where a run's wear states stand, strictly ascending, and which states these are.

    Parameters
    ----------
    run : one run
    on : "cycle", or "wear_depth": the largest of all flanks [m]
    name : what messages call the run

    Raises
    ------
    CompareError : the run has no wear
    """
    if "update" not in run.dims:
        return np.zeros(1), np.zeros(1, np.intp)
    if on == CYCLE:
        position = (
            run["cycle"].values
            if "cycle" in run
            else np.arange(run.sizes["update"], dtype=float)
        )
    else:
        source = next((n for n in ("max_wear_depth", "wear_depth") if n in run), None)
        if source is None:
            raise CompareError(
                f"{name} has no wear depth to be aligned on; compare on cycle"
            )
        position = (
            run[source].max([dim for dim in run[source].dims if dim != "update"]).values
        )
    rising = np.concatenate(
        [[True], position[1:] > np.maximum.accumulate(position)[:-1]]
    )
    return np.asarray(position[rising], float), np.flatnonzero(rising)


def common(a: Array, b: Array, on: str) -> Array:
    """Return every position of either run that both reach.

    Raises
    ------
    CompareError : no position is reached by both
    """
    low = max(a[0], b[0])
    high = min(a[-1], b[-1])
    if low > high:
        message = (
            f"A runs over {on} {a[0]:.6g} to {a[-1]:.6g}, B over {b[0]:.6g} to "
            f"{b[-1]:.6g}"
        )
        raise CompareError(f"{message}: nothing in common")
    inside = np.unique(np.concatenate([a, b, [low, high]]))
    inside = inside[(inside >= low) & (inside <= high)]
    is_distinct = np.diff(inside, prepend=-np.inf) > SAME * max(
        abs(high), abs(low), 1e-300
    )
    return np.asarray(inside[is_distinct])


def at_positions(values: xr.DataArray, stands: Stands, targets: Array) -> xr.DataArray:
    """Return values at wanted positions, linear between stored states.

    The dim ``state`` comes first.

    Parameters
    ----------
    values : with the dim ``update``, or without it: the same at every state
    stands : (n,) positions of the run's states, and their indices
    targets : (m,) positions, within those given
    """
    if "update" not in values.dims:
        return values.expand_dims(state=len(targets))
    positions, states = stands
    stored = values.transpose("update", ...).isel(update=states)
    above = np.clip(
        np.searchsorted(positions, targets),
        min(1, len(positions) - 1),
        len(positions) - 1,
    )
    below = np.maximum(above - 1, 0)
    width = positions[above] - positions[below]
    share = np.where(
        width > 0, (targets - positions[below]) / np.where(width > 0, width, 1.0), 0.0
    )
    share = np.where(np.abs(share - np.round(share)) < SAME, np.round(share), share)
    share = share.reshape(-1, *(1,) * (stored.ndim - 1))
    low = stored.values[below]
    high = stored.values[above]
    mixed = np.where(
        share == 0.0, low, np.where(share == 1.0, high, low + share * (high - low))
    )
    coordinates = {n: c for n, c in stored.coords.items() if "update" not in c.dims}
    return xr.DataArray(mixed, dims=("state", *stored.dims[1:]), coords=coordinates)


def same_nodes(a: xr.DataArray, b: xr.DataArray) -> tuple[xr.DataArray, xr.DataArray]:
    """Return both on A's phases and nodes, with the flanks and meshes that both have.

    Raises
    ------
    CompareError : they have no flank, mesh or member in common
    """
    shared_dims = {dim for dim in a.dims if dim in b.dims}
    for dim in ("flank", "mesh", "member", "harmonic", "order"):
        if dim in shared_dims and dim in a.coords and dim in b.coords:
            shared = [label for label in a[dim].values if label in b[dim].values]
            if not shared:
                raise CompareError(
                    f"no {dim} in common: {list(a[dim].values)} and "
                    f"{list(b[dim].values)}"
                )
            a = a.sel({dim: shared})
            b = b.sel({dim: shared})
    b = _on_phases(a, b) if "phase" in shared_dims else b
    return a, _on_profile(a, b) if "profile" in shared_dims else b


def _on_phases(a: xr.DataArray, b: xr.DataArray) -> xr.DataArray:
    """Return B on A's phases, linear and periodic.

    Phase 0 is where a pair of mesh 1 enters at A.
    """
    phases = phases_of(b)
    target_phases = phases_of(a)
    if phases.shape == target_phases.shape and np.allclose(
        phases, target_phases, rtol=0.0, atol=1e-12
    ):
        return b
    moved = b.transpose(..., "phase")
    waves = np.apply_along_axis(
        lambda wave: np.interp(target_phases, phases, wave, period=1.0),
        -1,
        moved.values,
    )
    return _laid(b, moved, waves).assign_coords(phase=target_phases)


def phases_of(wave: xr.DataArray) -> Array:
    """Return the phases at which a wave is given, (n,) [1]."""
    count = wave.sizes["phase"]
    return np.asarray(
        wave["phase"] if "phase" in wave.coords else np.arange(count) / count, float
    )


def _on_profile(a: xr.DataArray, b: xr.DataArray) -> xr.DataArray:
    """Return B at A's nodes, by path position, linear.

    NaN where B's path does not reach.
    """
    target_path = _path(a)
    path = _path(b)
    if (
        target_path is None
        or path is None
        or (
            path.shape == target_path.shape
            and np.allclose(path, target_path, atol=1e-12)
        )
    ):
        if target_path is None and a.sizes["profile"] != b.sizes["profile"]:
            raise CompareError(
                "the runs have different nodes and no path_position to match them"
            )
        return b
    moved = b.transpose("flank", ..., "profile")
    flanks = [
        np.apply_along_axis(partial(_interpolated, new, old), -1, rows)
        for new, old, rows in zip(target_path, path, moved.values, strict=True)
    ]
    return _laid(b, moved, np.stack(flanks)).assign_coords(
        path_position=a["path_position"]
    )


def _interpolated(new: Array, old: Array, row: Array) -> Array:
    """Return a row known at old positions at new ones, NaN beyond the ends."""
    return np.interp(new, old, row, left=np.nan, right=np.nan)


def _laid(template: xr.DataArray, moved: xr.DataArray, values: Array) -> xr.DataArray:
    """Return other values along the last dimension of a transposed array, laid out as it was given."""
    coordinates = {
        name: c for name, c in moved.coords.items() if moved.dims[-1] not in c.dims
    }
    return xr.DataArray(values, coordinates, moved.dims).transpose(*template.dims)


def _path(values: xr.DataArray) -> Array | None:
    """Return positions (flank, profile), the two nodes of a step set apart."""
    if "path_position" not in values.coords or "flank" not in values.dims:
        return None
    position = (
        values["path_position"].transpose("flank", "profile").values.astype(float)
    )
    span = 1e-9 * np.ptp(position)
    twin = np.isclose(np.diff(position, axis=1), 0.0, atol=1e-3 * span)
    position[:, :-1][twin] -= span
    position[:, 1:][twin] += span
    return np.asarray(position)


SIDES = ("A", "B")


def compare_runs(a: xr.Dataset, b: xr.Dataset, on: str, tolerance: float) -> xr.Dataset:
    """Return two runs side by side at the same cycles or wear depths.

    Every quantity q stands as ``q(run, state, …)`` with ``q_difference(state, …)`` = B
    − A. How much they differ, ``relative_difference(quantity, state)``, is max|B − A|
    at a state over max(|A|, |B|) of all states; ``first_difference(quantity)`` is where
    it first exceeds the tolerance, linear between states.

    Parameters
    ----------
    a, b : runs
    on : "cycle" or "wear_depth"
    tolerance : relative

    Raises
    ------
    CompareError : nothing in common
    """
    stands = [positions(run, on, side) for run, side in zip((a, b), SIDES, strict=True)]
    wanted = common(stands[0][0], stands[1][0], on)
    made: dict[str, Any] = {}
    relative: dict[str, Array] = {}
    for quantity in QUANTITIES:
        if quantity.source not in a or quantity.source not in b:
            continue
        values = (_of(quantity, run) for run in (a, b))
        own, other = same_nodes(
            *(at_positions(*each, wanted) for each in zip(values, stands, strict=True))
        )
        both = np.stack([own.values, other.transpose(*own.dims).values])
        named = quantity.attributes
        words = f"{quantity.long_name}: B − A"
        made[quantity.name] = xr.DataArray(
            both, own.coords, ("run", *own.dims), attrs=named
        )
        less = own.copy(data=both[1] - both[0])
        made[f"{quantity.name}_difference"] = less.assign_attrs(
            {**named, "long_name": words}
        )
        relative[quantity.name] = _relative(own.values, other.values)
    if not relative:
        raise CompareError("the runs have no variable in common that is compared")
    for name in (name for name in SCALARS if name in a and name in b):
        both = np.array([float(a[name]), float(b[name])])
        made[name] = ("run", both, declared(name))
        made[f"{name}_difference"] = ((), both[1] - both[0], declared(name))
    aligned = declared("cycle" if on == CYCLE else "max_wear_depth")
    places: dict[str, Any] = {"run": list(SIDES), "cycle": ("state", wanted, aligned)}
    if on != CYCLE:
        pairs = zip((a, b), stands, strict=True)
        cycles = [
            at_positions(run["cycle"], each, wanted).values for run, each in pairs
        ]
        places["cycle"] = (("run", "state"), np.stack(cycles), declared("cycle"))
        places["aligned_depth"] = ("state", wanted, aligned)
    table = np.stack(list(relative.values()))
    first = np.array([first_above(wanted, row, tolerance) for row in table])
    said = {
        "long_name": f"{aligned['long_name']} at which the runs first differ by more "
        "than the tolerance"
    }
    largest = np.max(table, axis=1, initial=0.0, where=np.isfinite(table))
    of_all = RELATIVE | {"long_name": "relative difference, largest of all states"}
    made["relative_difference"] = ("quantity", "state"), table, RELATIVE
    made["largest_relative_difference"] = "quantity", largest, of_all
    made["first_difference"] = "quantity", first, {**aligned, **said}
    places |= {"quantity": list(relative), **described(relative)}
    return xr.Dataset(made, places, _said(a, b, on, tolerance))


def _of(quantity: Quantity, run: xr.Dataset) -> xr.DataArray:
    values = run[quantity.source]
    coordinates = [n for n in values.coords if n in values.dims]
    if "profile" in values.dims and "path_position" in run:
        coordinates.append("path_position")
    return quantity.of(
        values.reset_coords(drop=True).assign_coords({n: run[n] for n in coordinates})
    )


RELATIVE = {
    "units": "1",
    "display_units": "%",
    "long_name": "largest difference over the largest value",
}


def _relative(a: Array, b: Array) -> Array:
    """Return how much two arrays differ at each state, relative to the largest of all states."""
    scale = max(
        float(np.max(np.abs(x), initial=0.0, where=~np.isnan(x))) for x in (a, b)
    )
    distance = np.abs(b - a).reshape(len(a), -1)
    is_finite = np.isfinite(distance)
    largest = np.where(
        is_finite.any(axis=1),
        np.max(distance, axis=1, initial=0.0, where=is_finite),
        np.nan,
    )
    return largest / scale if scale > 0.0 else np.where(np.isnan(largest), np.nan, 0.0)


def first_above(position: Array, values: Array, tolerance: float) -> float:
    """Return where values first exceed a tolerance, linear between positions.

    NaN where they never do.
    """
    above = np.flatnonzero(np.nan_to_num(values, nan=-1.0) > tolerance)
    if not above.size:
        return float("nan")
    i = int(above[0])
    if i == 0 or not np.isfinite(values[i - 1]):
        return float(position[i])
    share = (tolerance - values[i - 1]) / (values[i] - values[i - 1])
    return float(position[i - 1] + share * (position[i] - position[i - 1]))


def _said(a: xr.Dataset, b: xr.Dataset, on: str, tolerance: float) -> dict[str, object]:
    changed = differences(str(a.attrs.get("scene", "")), str(b.attrs.get("scene", "")))
    names = {"run": "id", "source_hash": "source_hash"}
    each = {
        f"{k}_{s}": str(r.attrs.get(name, ""))
        for k, name in names.items()
        for s, r in (("a", a), ("b", b))
    }
    scenes = json.dumps([key._asdict() for key in changed], ensure_ascii=False)
    told = {"aligned_on": on, "tolerance": tolerance, "scene_differences": scenes}
    return {"title": "comparison of two runs", **each, **told}


Row = tuple[str, ...]
SCENE_HEADS = ("key", "A", "B", "unit")
QUANTITY_HEADS = (
    "quantity",
    "A",
    "B",
    "unit",
    "largest difference",
    "there",
    "first above tolerance",
)
OF_LIVES = ("life A [cycles]", "life B [cycles]")
PAIR_HEADS = (
    "runs",
    *OF_LIVES,
    "largest difference",
    "of",
    "first above tolerance",
    "of ",
)
ABSENT = "—"


def scene_rows(comparison: xr.Dataset) -> list[Row]:
    """Return key, A, B and unit of every key of the scenes that differs."""
    changed = json.loads(comparison.attrs.get("scene_differences") or "[]")
    return [
        (key["key"], _value(key["a"]), _value(key["b"]), key["units"] or "")
        for key in changed
    ]


def quantity_rows(comparison: xr.Dataset) -> list[Row]:
    """Return one row a quantity of two runs: both values where they differ most, and where they first do."""
    rows: list[Row] = []
    aligned = comparison[
        "cycle" if comparison.attrs["aligned_on"] == CYCLE else "aligned_depth"
    ].values
    summary = ("largest_relative_difference", "first_difference")
    for name, share, first in zip(
        *(comparison[n].values for n in ("quantity", *summary)), strict=True
    ):
        apart = abs(comparison[f"{name}_difference"])
        apart = apart.where(np.isfinite(apart), -1.0)
        at = apart.argmax(...)  # where they differ most
        values = comparison[name].isel(at).where(apart.isel(at) >= 0.0).values
        there = (
            "" if share == 0.0 else _place(comparison, float(aligned[int(at["state"])]))
        )
        rows.append(
            (
                *_both(comparison[name], values),
                _percent(share),
                there,
                _place(comparison, first),
            )
        )
    for name in (name for name in SCALARS if name in comparison):
        called, a, b, unit = _both(comparison[name], comparison[name].values)
        apart = np.ptp(comparison[name].values)
        largest = np.abs(comparison[name].values).max()
        share = _percent(apart / largest) if np.isfinite(largest) and largest else ""
        rows.append((called, a, b, "cycles" if name == "life" else unit, share, "", ""))
    return rows


def _both(quantity: xr.DataArray, values: Any) -> tuple[str, str, str, str]:
    """Return what a quantity is, the values of A and B as they are shown, and their unit."""
    stored = quantity.attrs["units"]
    shown = quantity.attrs["display_units"]
    a, b = (_number(convert(float(value), stored, shown)) for value in values)
    return quantity.attrs["long_name"], a, b, "" if shown == "1" else shown


def pair_rows(comparison: xr.Dataset) -> list[Row]:
    """Return one row a pair of runs of two campaigns: the quantity that differs most, and the first to."""
    rows = []
    names = [str(name) for name in comparison["quantity_name"].values]
    for index, pair in enumerate(comparison["pair"].values):
        compared = comparison.isel(pair=index)
        shares = compared["largest_relative_difference"].values
        first = compared["first_difference"].values
        most = int(np.argmax(np.nan_to_num(shares, nan=-1.0)))
        lives = (
            map(_number, compared["life"].values) if "life" in compared else ("", "")
        )
        where = (ABSENT, "")
        if np.isfinite(first).any():
            earliest = int(np.nanargmin(first))
            where = _place(compared, first[earliest]), names[earliest]
        rows.append((str(pair), *lives, _percent(shares[most]), names[most], *where))
    return rows


def _place(comparison: xr.Dataset, value: float) -> str:
    if not np.isfinite(value):
        return ABSENT
    if comparison.attrs["aligned_on"] == "wear_depth":
        return f"{_number(convert(value, 'm', 'um'))} µm of wear"
    return f"{_number(value)} cycles"


def _number(value: Any) -> str:
    return f"{float(value):.4g}" if np.isfinite(value) else ABSENT


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"


def _value(value: Any) -> str:
    return (
        ABSENT
        if value is None
        else f"{value:.9g}"
        if isinstance(value, float)
        else str(value)
    )
