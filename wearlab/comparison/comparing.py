"""``compare``: two runs in full, two campaigns pair by pair."""

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import xarray as xr

from wearlab.comparison.aligning import CYCLE, WEAR_DEPTH
from wearlab.comparison.errors import CompareError
from wearlab.comparison.pair_of_runs import SIDES, compare_runs
from wearlab.comparison.quantities import QUANTITIES, described
from wearlab.comparison.sides import Side, SideRun, pairs, side

if TYPE_CHECKING:
    from wearlab.store import Store

TOLERANCE = 0.01
PER_PAIR = ("largest_relative_difference", "first_difference")


def compare(
    a: Any,
    b: Any,
    on: Literal["cycle", "wear_depth"] = "cycle",
    tolerance: float = TOLERANCE,
    store: "Store | None" = None,
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
    Of two runs: every quantity ``q(run, state, …)``, ``q_difference`` = B − A, and the summary
    ``relative_difference(quantity, state)`` [1], ``largest_relative_difference(quantity)`` [1],
    ``first_difference(quantity)`` [cycles, or m of wear depth; NaN: never].
    Of campaigns: the summary for every ``pair`` of runs with equal label and place, and
    ``largest_value(pair, run, quantity)``, ``life(pair, run)``.
    ``attrs``: ids, titles, ``scene_differences`` as JSON.

    Raises
    ------
    CompareError : nothing in common
    StoreError : a run is not there
    """
    if on not in (CYCLE, WEAR_DEPTH):
        raise CompareError(f"on = {on!r}: there are 'cycle' and 'wear_depth'")
    if not tolerance > 0.0:
        raise CompareError(f"tolerance = {tolerance!r} is not greater than 0")
    left, right = side(a, store, "A"), side(b, store, "B")
    if left.single and right.single:
        return compare_runs(left.members[0].read(), right.members[0].read(), on, tolerance)
    return _campaigns(left, right, on, tolerance)


def _campaigns(a: Side, b: Side, on: str, tolerance: float) -> xr.Dataset:
    matched, only_a, only_b = pairs(a, b)
    if not matched:
        raise CompareError(
            f"no run of {a.title!r} has a partner in {b.title!r}: "
            f"A has {_some(only_a)}; B has {_some(only_b)}"
        )
    made = [_reduced(left, other, on, tolerance) for left, other in matched]
    whole = xr.concat(made, "pair", join="outer", combine_attrs="drop", data_vars="all", coords="minimal")
    whole = whole.sel(quantity=[q.name for q in QUANTITIES if q.name in whole["quantity"]])
    whole = whole.assign_coords(
        {
            **described([str(name) for name in whole["quantity"].values]),
            "pair": [left.name for left, _ in matched],
            "run_id": (("pair", "run"), [[left.id, other.id] for left, other in matched]),
        }
    )
    return whole.assign_attrs(
        title=f"comparison of {a.title!r} and {b.title!r}",
        campaign_a=a.title,
        campaign_b=b.title,
        aligned_on=on,
        tolerance=tolerance,
        only_a=json.dumps(only_a, ensure_ascii=False),
        only_b=json.dumps(only_b, ensure_ascii=False),
        scene_differences=_shared([str(compared["scene_differences"].values) for compared in made]),
    )


def _reduced(a: SideRun, b: SideRun, on: str, tolerance: float) -> xr.Dataset:
    """Return what is kept of one pair, its files closed: memory does not grow with the waves."""
    full = compare_runs(a.read(), b.read(), on, tolerance)
    names = [str(name) for name in full["quantity"].values]
    largest = [[_largest(full[name].sel(run=run).values) for name in names] for run in SIDES]
    scalars = [n for n in ("life", "service_life") if n in full]
    kept = full[[*PER_PAIR, *scalars]].reset_coords(drop=True)
    return kept.assign(
        largest_value=(
            ("run", "quantity"),
            largest,
            {
                "long_name": "largest magnitude over the common states",
                "comment": "in each quantity's SI unit",
            },
        ),
        scene_differences=((), full.attrs["scene_differences"]),
    )


def _largest(values: Any) -> float:
    held = values[np.isfinite(values)]
    return float(np.abs(held).max()) if held.size else float("nan")


def _shared(texts: Sequence[str]) -> str:
    """Return the scene's differences that every pair has alike."""
    tables = [json.loads(text) for text in texts]
    return json.dumps(
        [column for column in tables[0] if all(column in t for t in tables[1:])], ensure_ascii=False
    )


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:4]) + (", …" if len(names) > 4 else "") or "nothing with data"
