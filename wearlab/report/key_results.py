"""Safeties, load over the face, errors and temperatures of a run, unworn and worn."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from wearlab import units
from wearlab.store import Store, StoreError

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.store.catalogue import Entry

SYMBOLS = {
    "iso_pitting_safety": "S_H",
    "iso_face_load_factor": "K_Hβ (ISO 6336-1)",
    "face_load_factor": "K_Hβ",
    "ste_peak_to_peak": "range of transmission error",
    "tooth_temperature": "temperature of the teeth",
}
"""The variables, and what they are called on a page."""
DEPTH = "max_wear_depth"


class KeyResult(NamedTuple):
    """One number of a run.

    Parameters
    ----------
    variable : that it is of
    column : the formula by which columns and conditions ask for it
    place : flank or wear state, in words
    value : in the stored unit
    """

    variable: str
    column: str
    place: str
    value: float


class _Choice(NamedTuple):
    """A part of a variable."""

    place: str
    condition: str
    values: "xr.DataArray"


def key_results(store: Store, entry: "Entry") -> list[KeyResult]:
    """Return the safeties, face load factors and transmission errors of a run.

    Of every flank one number; unworn and at the last wear state; of several meshes the
    largest. There are none where the file of the run cannot be read.

    Parameters
    ----------
    store : where the run is
    entry : of the run
    """
    import xarray as xr

    from wearlab.store import reading

    if not entry.layout:
        return []
    layout = store.archive.catalogue.layouts([entry.layout])[entry.layout]
    described = layout["variables"]
    names = [name for name in SYMBOLS if name in described]
    read_names = [name for name in (*names, DEPTH) if name in described]
    path = str(store.archive.files.path(entry.id))
    try:
        stored = reading.read_variables(path, read_names, entry.sha256)
    except StoreError:
        return []

    arrays = {
        name: xr.DataArray(values, dims=described[name]["dims"])
        for name, values in stored.items()
    }
    first_state = _first_state(arrays.get(DEPTH))
    flanks = layout["labels"].get("flank", ())
    results = []
    for name in names:
        for choice in _choices(arrays[name], first_state, flanks):
            value = float(choice.values.max())
            if not math.isfinite(value):
                continue
            column = f"{name}[{choice.condition}]" if choice.condition else name
            if choice.values.size > 1:
                column = f"max({column})"
            results.append(KeyResult(name, column, choice.place, value))
    return results


def _first_state(depth: "xr.DataArray | None") -> str:
    """Return what the first wear state of a run is called."""
    if depth is None or "update" not in depth.dims:
        return "unworn"
    return "as it begins" if float(depth[{"update": 0}].max()) > 0.0 else "unworn"


def _choices(
    values: "xr.DataArray", first_state: str, flanks: Sequence[str]
) -> Iterator[_Choice]:
    """Yield the parts of a variable that are told: flanks, or first and last state."""
    if "flank" in values.dims:
        for index, flank in enumerate(flanks):
            yield _Choice(flank, f"flank='{flank}'", values[{"flank": index}])
    elif "update" in values.dims:
        yield _Choice(first_state, "update=0", values[{"update": 0}])
        if values.sizes["update"] > 1:
            yield _Choice("worn", "update=-1", values[{"update": -1}])
    else:
        yield _Choice("", "", values)


def table_of(
    results_by_case: Sequence[Sequence[KeyResult]], variables: Mapping[str, Any]
) -> tuple[list[str], list[list[str]]]:
    """Return heads with units, and a row of texts for each case; "" for what it lacks.

    Parameters
    ----------
    results_by_case : of each case its numbers
    variables : units and display units by name, as `wearlab.schema.VARIABLES` has them
    """
    heads: dict[str, None] = {}
    rows = []
    for results in results_by_case:
        texts = {}
        for result in results:
            variable = variables[result.variable]
            value = units.convert(result.value, variable.units, variable.display_units)
            texts[_head(result, variable.display_units)] = f"{float(value):.4g}"
        heads |= dict.fromkeys(texts)
        rows.append(texts)
    return list(heads), [[texts.get(head, "") for head in heads] for texts in rows]


def _head(result: KeyResult, unit: str) -> str:
    """Return what stands above a number: its symbol, its place and its unit."""
    is_largest = result.column.startswith("max(")
    words = ["largest" if is_largest else "", SYMBOLS[result.variable], result.place]
    head = " ".join(filter(None, words))
    return head if unit in ("", "1") else f"{head} [{units.shown_unit(unit)}]"
