"""How variables of an update are named and labelled."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from wearlab.campaign.measured import THICKNESS
from wearlab.schema import VARIABLES
from wearlab.units import KINDS, convert
from wearlab.updating.likelihood import Block
from wearlab.updating.outcome import UpdateOutcome

CHAIN = ("chain", "draw")
INSPECTED = {"units": "1", "long_name": "cycle of the inspection"}


def names_of(keys: Sequence[str]) -> dict[str, str]:
    """Return what each unknown is called: its last word; by the whole key where two share it."""
    last = [key.rpartition(".")[2] for key in keys]
    return {
        key: word if last.count(word) == 1 else key.replace(".", "_")
        for key, word in zip(keys, last, strict=True)
    }


def variable(
    values: Any, units: str, long_name: str, dims: tuple[str, ...] = CHAIN, **more: str
) -> xr.Variable:
    """Return a labelled variable; one of draws gets its single chain."""
    data = np.asarray(values)
    return xr.Variable(
        dims, data[None] if dims[0] == "chain" else data, {"units": units, "long_name": long_name, **more}
    )


def si_unit(unit: str | None) -> tuple[float, str]:
    """Return what a number in a campaign's unit is multiplied by for its SI value, and that unit."""
    kind = next((kind for kind in KINDS.values() if unit in kind.units), None)
    if unit is None or kind is None:
        return 1.0, unit or "1"
    return convert(1.0, unit, kind.unit), kind.unit


def draws_of(count: int) -> dict[str, xr.Variable]:
    """Return the coordinates of draws: one chain, as nothing was sampled by a walk."""
    return {
        "chain": xr.Variable("chain", [0], {"units": "1", "long_name": "chain"}),
        "draw": xr.Variable("draw", np.arange(count), {"units": "1", "long_name": "draw"}),
    }


def display_of(block: Block) -> str:
    """Return the unit in which a measured quantity is shown."""
    name = block.data.quantity
    return "um" if name == THICKNESS else VARIABLES[name].display_units


def name_of(outcome: UpdateOutcome, number: int) -> str:
    """Return what the values of a block are called: quantity and place, and its number where two share it."""
    names = [block.name.replace("-", "_") for block in outcome.posterior.blocks]
    return names[number] if names.count(names[number]) == 1 else f"{names[number]}_{number + 1}"
