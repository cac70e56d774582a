"""The datasets of several conditions of operation become one."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from wearlab.life import history
from wearlab.scene import Scene
from wearlab.scene.operation import labels_of

OF_THE_FLANKS = (
    "contact_ratio",
    "mesh_phase_offset",
    "slow_error",
    "error_weight",
    "specific_sliding",
    "mode_kind",
    "iso_theoretical_stiffness",
    "iso_single_stiffness",
    "iso_mesh_stiffness_alpha",
    "iso_mesh_stiffness_beta",
)
"""Variables that no torque or speed changes."""
PADDED = ("mesh_period", "rival")
"""Dimensions that one condition may have more of than another."""


def along_duty(blocks: Sequence[xr.Dataset]) -> xr.Dataset:
    """Return datasets of conditions that take turns as one, ``duty`` after ``update``.

    Parameters
    ----------
    blocks : datasets of the duty blocks, all with the same updates
    """
    return _in_usual_order(_concat(blocks, "duty"), "duty")


def in_order(stages: Sequence[xr.Dataset]) -> xr.Dataset:
    """Return the datasets of stages in order as one.

    States follow one another along ``update``, all else lies along ``stage``.

    Parameters
    ----------
    stages : datasets of the stages
    """
    states = []
    of_stages = []
    for dataset in stages:
        names = [
            name
            for name, variable in dataset.data_vars.items()
            if "update" in variable.dims
        ]
        states.append(dataset[names])
        of_stages.append(dataset.drop_vars(names))
    along_update = _concat(states, "update")
    along_stage = _concat(of_stages, "stage")
    return _in_usual_order(along_update.merge(along_stage, join="outer"), "stage")


def _concat(datasets: Sequence[xr.Dataset], along: str) -> xr.Dataset:
    """Return datasets as one, NaN where one has less than another.

    No labels but numbers where it may.
    """
    numbered = []
    for dataset in datasets:
        numbers = {
            dim: np.arange(dataset.sizes[dim]) for dim in PADDED if dim in dataset.dims
        }
        unlabelled = dataset.drop_vars(list(dataset.coords))
        numbered.append(unlabelled.assign_coords(numbers))
    return xr.concat(
        numbered, along, join="outer", coords="minimal", combine_attrs="override"
    )


def _in_usual_order(joined: xr.Dataset, new: str) -> xr.Dataset:
    """Return joined variables with the new dimension after ``update``.

    What no condition alters goes without it.
    """
    variables = {}
    for name, variable in joined.drop_vars(PADDED, errors="ignore").data_vars.items():
        if new in variable.dims and name in OF_THE_FLANKS:
            variable = variable.isel({new: 0})
        elif new in variable.dims:
            variable = variable.transpose("update", new, ..., missing_dims="ignore")
        variables[name] = variable
    return xr.Dataset(variables)


def condition_coordinates(
    scene: Scene, life_history: history.History
) -> dict[str, Any]:
    """Return the coordinates of the conditions of operation, none of a single one.

    Parameters
    ----------
    scene : the scene
    life_history : the life through the stages that were reached
    """
    blocks = scene.operation.loaded_blocks
    stages = scene.operation.stages[: len(life_history.stages)]
    coordinates: dict[str, Any] = {}
    for along, conditions in (("duty", blocks), ("stage", stages)):
        if conditions:
            torques = [condition.torque for condition in conditions]
            speeds = [condition.speed for condition in conditions]
            coordinates[f"{along}_torque"] = torques
            coordinates[f"{along}_speed"] = speeds
    if blocks:
        rows = scene.operation.blocks
        share = np.array([block.share for block in rows])
        is_loaded = np.array([block.is_loaded for block in rows])
        coordinates["duty"] = np.arange(1, len(rows) + 1)[is_loaded]
        coordinates["duty_share"] = (share / share.sum())[is_loaded]
    if stages:
        labels = labels_of(scene.operation.stages)[: len(stages)]
        counts = [len(life_history.kept(k).cycle) for k in range(len(labels))]
        coordinates["stage"] = labels
        coordinates["update_stage"] = np.repeat(labels, counts)
    return coordinates
