"""Datasets of several conditions of operation as one: along ``duty``, or with the stages in order."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from wearlab.life.history import History
from wearlab.scene import Scene
from wearlab.scene.operation import labels_of

Values = dict[str, Any]

OF_THE_FLANKS = (
    "contact_ratio",
    "mesh_phase_offset",
    "slow_error",
    "error_weight",
    "specific_sliding",
    "mode_kind",
)
"""Variables that no torque or speed changes."""
PADDED = ("mesh_period", "rival")
"""Dimensions that one condition may have more of than another."""


def along_duty(blocks: Sequence[xr.Dataset]) -> xr.Dataset:
    """Return the datasets of conditions that take turns as one, ``duty`` after ``update``."""
    return _as_before(blocks[0], xr.concat(_alike(blocks), "duty", join="exact"), "duty")


def in_order(stages: Sequence[xr.Dataset]) -> xr.Dataset:
    """Return the datasets of stages in order: states along ``update``, all else along ``stage``."""
    alike = _alike(stages)
    states = [
        dataset.drop_vars([name for name in dataset if "update" not in dataset[name].dims])
        for dataset in alike
    ]
    others = [
        dataset.drop_vars([name for name in dataset if "update" in dataset[name].dims]) for dataset in alike
    ]
    joined = xr.concat(states, "update", join="exact").merge(xr.concat(others, "stage", join="exact"))
    return _as_before(stages[0], joined, "stage")


def _as_before(first: xr.Dataset, joined: xr.Dataset, new: str) -> xr.Dataset:
    """Return the joined variables in their usual order of dimensions; what no condition alters without it."""
    restored = {}
    for name, var in joined.data_vars.items():
        if new in var.dims and name in OF_THE_FLANKS:
            var = var.isel({new: 0})
        elif new in var.dims:
            old = [dim for dim in var.dims if dim not in ("update", new)]
            var = var.transpose(*(dim for dim in ("update", new) if dim in var.dims), *old)
        restored[name] = var.assign_attrs(first[name].attrs if name in first else var.attrs)
    return xr.Dataset(restored)


def _alike(each: Sequence[xr.Dataset]) -> list[xr.Dataset]:
    """Return datasets of one shape: mesh periods and rivals that one has not are NaN; without coordinates.

    A variable that one condition lacks (another attractor) is NaN there.
    """
    bare = [dataset.drop_vars(list(dataset.coords)) for dataset in each]
    names = dict.fromkeys(name for dataset in bare for name in dataset.data_vars)
    most = {dim: max((own.sizes.get(dim, 0) for own in bare), default=0) for dim in PADDED}
    alike = []
    for dataset in bare:
        short = {dim: (0, most[dim] - dataset.sizes[dim]) for dim in PADDED if dim in dataset.dims}
        if any(end for _, end in short.values()):
            dataset = dataset.pad(short, constant_values=np.nan)
        for name in names:
            if name not in dataset:
                other = next(two[name] for two in bare if name in two)
                shape = [dataset.sizes.get(dim, other.sizes[dim]) for dim in other.dims]
                dataset = dataset.assign({name: (other.dims, np.full(shape, np.nan))})
        alike.append(dataset)
    return alike


def condition_coordinates(scene: Scene, lived: History) -> Values:
    """Return the coordinates that tell the conditions of operation, none where there is but one."""
    operation = scene.operation
    if operation.blocks:
        blocks = operation.blocks
        total = sum(block.share for block in blocks)
        return {
            "duty": np.arange(1, len(blocks) + 1),
            "duty_torque": [block.torque for block in blocks],
            "duty_speed": [block.speed for block in blocks],
            "duty_share": [block.share / total for block in blocks],
        }
    if operation.stages:
        reached = operation.stages[: len(lived.stages)]
        labels = np.array(labels_of(operation.stages))
        return {
            "stage": list(labels[: len(reached)]),
            "stage_torque": [stage.torque for stage in reached],
            "stage_speed": [stage.speed for stage in reached],
            "update_stage": list(labels[lived.stage_of]),
        }
    return {}
