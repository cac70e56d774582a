"""The conditions a scene runs in, one or several, and their datasets as one."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from wearlab.life.coupled import Coupled
from wearlab.life.coupling import DutyCoupling, DutyShares, duty_shares
from wearlab.life.history import History
from wearlab.scene import Scene
from wearlab.scene.build import Parts, build
from wearlab.scene.operation import DutyBlock, OperationStage, labels_of


@dataclass(frozen=True)
class Stage:
    """What runs at a time: one condition, or several that take turns.

    Parameters
    ----------
    label : its name, "" where it is the only one
    parts : its physics
    shares : how often each condition comes
    coupling : contact, dynamics and wear of all conditions together
    cycles : how long it lasts, None: to the limits of the scene
    """

    label: str
    parts: tuple[Parts, ...]
    shares: DutyShares
    coupling: Coupled
    cycles: float | None

    @property
    def first(self) -> Parts:
        """The physics in the first condition; the flanks are the same in all."""
        return self.parts[0]

    @property
    def speed(self) -> float:
        """Mean speed of the reference gear relative to the carrier, over time [rad/s]."""
        return self.shares.mean_speed


def stages_of(scene: Scene) -> tuple[Stage, ...]:
    """Return the stages of a scene: one, unless it has stages of operation.

    Raises
    ------
    GearError
        When no such gears can exist or run.
    """
    operation = scene.operation

    def alone(one: DutyBlock | OperationStage) -> Scene:
        condition = operation.alone(one.torque, one.speed, operation.largest_torque)
        return scene.model_copy(update={"operation": condition})

    if operation.stages:
        labelled = zip(labels_of(operation.stages), operation.stages, strict=True)
        return tuple(_stage([alone(stage)], (1.0,), label, stage.cycles) for label, stage in labelled)
    if not operation.blocks:
        return (_stage([scene], (1.0,)),)
    blocks = operation.blocks
    return (_stage([alone(block) for block in blocks], [block.share for block in blocks]),)


def _stage(
    scenes: Sequence[Scene], share: Sequence[float], label: str = "", cycles: float | None = None
) -> Stage:
    parts = tuple(map(build, scenes))
    shares = DutyShares(np.ones(1), parts[0].speed)
    if len(parts) > 1:
        shares = duty_shares(share, [part.speed for part in parts])
    return Stage(label, parts, shares, coupled(parts, shares), cycles)


def coupled(parts: tuple[Parts, ...], shares: DutyShares) -> Coupled:
    """Return conditions that take turns as one coupling."""
    if len(parts) == 1:
        return parts[0].coupling
    couplings = tuple(part.coupling for part in parts)
    return DutyCoupling(couplings[0].kinds, couplings, shares.weight)


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
    return _as_before(_concat(blocks, "duty"), "duty")


def in_order(stages: Sequence[xr.Dataset]) -> xr.Dataset:
    """Return the datasets of stages in order: states along ``update``, all else along ``stage``."""
    along = [[name for name, var in one.data_vars.items() if "update" in var.dims] for one in stages]
    states = [one[names] for one, names in zip(stages, along, strict=True)]
    others = [one.drop_vars(names) for one, names in zip(stages, along, strict=True)]
    joined = _concat(states, "update").merge(_concat(others, "stage"), join="outer")
    return _as_before(joined, "stage")


def _concat(each: Sequence[xr.Dataset], along: str) -> xr.Dataset:
    """Return datasets as one, NaN where one has less than another; no labels but numbers where it may."""
    numbered = [
        dataset.drop_vars(list(dataset.coords)).assign_coords(
            {dim: np.arange(dataset.sizes[dim]) for dim in PADDED if dim in dataset.dims}
        )
        for dataset in each
    ]
    return xr.concat(numbered, along, join="outer", coords="minimal", combine_attrs="override")


def _as_before(joined: xr.Dataset, new: str) -> xr.Dataset:
    """Return the joined variables in their usual order of dimensions; what no condition alters without it."""
    restored = {}
    for name, var in joined.drop_vars(PADDED, errors="ignore").data_vars.items():
        if new in var.dims and name in OF_THE_FLANKS:
            var = var.isel({new: 0})
        elif new in var.dims:
            old = [dim for dim in var.dims if dim not in ("update", new)]
            var = var.transpose(*(dim for dim in ("update", new) if dim in var.dims), *old)
        restored[name] = var
    return xr.Dataset(restored)


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
