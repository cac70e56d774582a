"""Figures of an update: its tree in place of runs."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from wearlab.figures.ask import Ask
from wearlab.figures.errors import FigureError
from wearlab.figures.kind import Kind
from wearlab.figures.wording import Label
from wearlab.units import HOUR

if TYPE_CHECKING:
    from wearlab.store import Store


@dataclass(frozen=True)
class Updated:
    """One case of an update.

    Parameters
    ----------
    key : its label, empty where there is one case
    groups : the groups of its tree
    """

    key: Mapping[str, Label]
    groups: Mapping[str, xr.Dataset]

    def __getitem__(self, name: str) -> xr.Dataset:
        return self.groups.get(name, xr.Dataset())

    @property
    def hours_per_cycle(self) -> float | None:
        """Operating hours of a cycle, None where the update does not say."""
        cycle = self["predictions"].get("seconds_per_cycle")
        return None if cycle is None else float(cycle) / HOUR


def updated_cases(subject: str, store: "Store", ask: Ask, kind: Kind) -> list[Updated]:
    """Return the cases of the latest update that is of a campaign's measurements and has what a kind needs.

    Raises
    ------
    FigureError : none is kept that has it
    """
    from wearlab.store.updates import read_update, updates_of

    for update in updates_of(store, subject):
        tree = read_update(store, update.id)
        if tree is None or not all(_has(tree, need) for need in kind.needs):
            continue
        groups = {name: node.to_dataset() for name, node in tree.children.items()}
        updated = _cases(groups)
        wanted = ask.select.get("case")
        labels = [wanted] if isinstance(wanted, str) else wanted
        kept = [case for case in updated if not labels or not case.key or case.key["case"].value in labels]
        if not kept:
            raise FigureError(f"{ask.name}: select.case: the update has no such case")
        return kept
    option = {"inspection": " --replay", "calibration": " --check 200"}
    words = "".join(more for need, more in option.items() if any(need in needed for needed in kind.needs))
    raise FigureError(
        f"{ask.name}: no update of this campaign and its measurements as they stand is kept that shows it: "
        f"wearlab update FILE{words}"
    )


def _has(tree: xr.DataTree, need: str) -> bool:
    """Say whether a tree has a group, ``group``, or a dimension in it, ``group:dimension``."""
    name, _, dim = need.partition(":")
    return name in tree.children and (not dim or dim in tree[name].dims)


def _cases(groups: dict[str, xr.Dataset]) -> list[Updated]:
    predictions = groups["predictions"]
    if "case" not in predictions.dims:
        return [Updated({}, groups)]
    return [
        Updated(
            {"case": Label(str(label), str(label))},
            {
                name: group.sel(case=label) if "case" in group.dims else group
                for name, group in groups.items()
            },
        )
        for label in predictions["case"].values.tolist()
    ]


def finite(values: xr.DataArray) -> np.ndarray:
    """Return the values that are there."""
    flat = np.asarray(values.values, float).ravel()
    return np.asarray(flat[np.isfinite(flat)])
