"""Figures of an update: its tree in place of runs; scales, lines, areas, densities."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.figures.errors import FigureError, choices
from wearlab.figures.kind import Ask, Kind
from wearlab.figures.plot import Scale, Series
from wearlab.figures.wording import Label, typeset
from wearlab.units import HOUR, convert

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
        if ("unit" in tree["predictions"].dims) != any(need.endswith(":unit") for need in kind.needs):
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


CYCLES = Scale("cycles", "1")
REST = Scale("remaining life in cycles", "1")
DENSITY = Scale("density over its largest", "1")
PLACES = 300
NOT_DRAWN = ("remaining_useful_life", "wear_coefficient")


def line(
    update: Updated, over: tuple[Array, Scale], of: tuple[Array, Scale], look: str = "line", text: str = ""
) -> Series:
    """Return a curve of one case: values and their scale, over values and theirs."""
    (x, across), (y, up) = over, of
    hours = update.hours_per_cycle if across in (CYCLES, REST) else None
    return Series(update.key, np.asarray(x, float), np.asarray(y, float), across, up, look, text, (), hours)  # type: ignore[arg-type]


def area(update: Updated, x: Array, low: Array, high: Array, across: Scale, up: Scale) -> Series:
    """Return the area between two curves of one case."""
    held = np.isfinite(low) & np.isfinite(high)
    outline = np.concatenate([x[held], x[held][::-1]]), np.concatenate([low[held], high[held][::-1]])
    hours = update.hours_per_cycle if across in (CYCLES, REST) else None
    return Series(update.key, *outline, across, up, "area", hours=hours)


def density(values: Array) -> tuple[Array, Array]:
    """Return a kernel estimate of a density between the 0.2 % ends of a sample."""
    from scipy.stats import gaussian_kde

    low, high = np.quantile(values, [0.002, 0.998])
    if not high > low:
        return np.array([low, low]), np.array([0.0, 1.0])
    x = np.linspace(low, high, PLACES)
    inside = values[(values >= low) & (values <= high)]
    return x, np.asarray(gaussian_kde(inside)(x))


def unknowns_of(data: xr.Dataset, ask: Ask) -> list[str]:
    """Return what is drawn of a sample: what was asked for, else the unknowns and the life."""
    known = [str(name) for name in data.data_vars]
    for name in ask.y:
        if name not in known:
            raise FigureError(f"{ask.name}: y = {name!r} is nothing the update knows; {choices(name, known)}")
    return list(ask.y) or [name for name in known if name not in NOT_DRAWN]


def logs(values: xr.DataArray) -> tuple[Array, Scale]:
    """Return the common logarithms of a variable as it is shown, those that have one, and their scale."""
    unit, shown = values.attrs.get("units", "1"), values.attrs.get("display_units", "1")
    held = np.asarray(values.values, float).ravel()
    scale = convert(1.0, unit, shown) if shown not in (unit, "1") else 1.0
    told = f" in {typeset(shown)}" if shown not in ("1", "") else ""
    return np.log10(np.maximum(scale * held, 1e-300)), Scale(f"log₁₀ of {words(str(values.name))}{told}", "1")


def words(name: str) -> str:
    """Return a variable's name as words."""
    return name.replace("_", " ")


def update_kind(
    name: str,
    title: str,
    shows: str,
    needs: tuple[str, ...],
    series: Callable[[Updated, Ask], Iterable[Series]],
    *first: tuple[str, str],
) -> Kind:
    """Return a kind of figure that is drawn from an update; cases stand side by side."""
    roles = (*first, ("cols", "case"), ("rows", "case"), ("hue", "case"))
    return Kind(name, title, shows, needs, (), series, roles, of="update")  # type: ignore[arg-type]
