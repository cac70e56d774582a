"""The conditions a scene runs in, one or several, and their datasets as one."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.life import coupled, coupling, history
from wearlab.scene import Scene, build
from wearlab.scene.operation import DutyBlock, OperationStage, labels_of


@dataclass(frozen=True)
class Stage:
    """What runs at a time: one condition, or several that take turns.

    Parameters
    ----------
    parts : its physics
    weight : share of the cycles of each condition [1]
    speed : mean speed of the reference gear relative to the carrier, over time [rad/s]
    coupling : contact, dynamics and wear of all conditions together
    cycles : how long it lasts, None: to the limits of the scene
    """

    parts: tuple[build.Parts, ...]
    weight: Array
    speed: float
    coupling: coupled.Coupled
    cycles: float | None

    @property
    def first(self) -> build.Parts:
        """The physics in the first condition; the flanks are the same in all."""
        return self.parts[0]


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
        return tuple(stage_of([alone(stage)], [1.0], stage.cycles) for stage in operation.stages)
    blocks = operation.blocks or ()
    conditions, shares = [alone(block) for block in blocks], [block.share for block in blocks]
    return (stage_of(conditions or [scene], shares or [1.0]),)


def stage_of(scenes: Sequence[Scene], share: Sequence[float], cycles: float | None = None) -> Stage:
    """Return conditions that take turns, of the cycles ``w_b = u_b ω_b / Σ u_b ω_b``.

    Parameters
    ----------
    scenes : in one condition each
    share : u, of the time; only their proportions count [1]
    cycles : how long they last, None: to the limits of the scene
    """
    parts = tuple(map(build.build, scenes))
    time, speed = np.asarray(share, float) / np.sum(share), np.array([part.gears.speed for part in parts])
    weight = time * speed / (time @ speed) if len(parts) > 1 else np.ones(1)
    mean_speed = float(coupling.mixture(time, list(speed)))
    return Stage(parts, weight, mean_speed, taking_turns(parts, weight), cycles)


def taking_turns(parts: Sequence[build.Parts], weight: Array) -> coupled.Coupled:
    """Return conditions that take turns as one coupling."""
    first, *others = (part.coupling for part in parts)
    return coupling.DutyCoupling(first.kinds, (first, *others), weight) if others else first


OF_THE_FLANKS = (
    *("contact_ratio", "mesh_phase_offset", "slow_error", "error_weight", "specific_sliding"),
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
    numbered = []
    for dataset in each:
        numbers = {dim: np.arange(dataset.sizes[dim]) for dim in PADDED if dim in dataset.dims}
        numbered.append(dataset.drop_vars(list(dataset.coords)).assign_coords(numbers))
    return xr.concat(numbered, along, join="outer", coords="minimal", combine_attrs="override")


def _as_before(joined: xr.Dataset, new: str) -> xr.Dataset:
    """Return the joined variables in their usual order of dimensions; what no condition alters without it."""
    restored = {}
    for name, var in joined.drop_vars(PADDED, errors="ignore").data_vars.items():
        if new in var.dims and name in OF_THE_FLANKS:
            var = var.isel({new: 0})
        elif new in var.dims:
            var = var.transpose("update", new, ..., missing_dims="ignore")
        restored[name] = var
    return xr.Dataset(restored)


def condition_coordinates(scene: Scene, lived: history.History) -> dict[str, Any]:
    """Return the coordinates that tell the conditions of operation, none where there is but one."""
    blocks, stages = scene.operation.blocks or (), (scene.operation.stages or ())[: len(lived.stages)]
    told: dict[str, Any] = {}
    for along, each in (("duty", blocks), ("stage", stages)):
        if each:
            told |= {f"{along}_{what}": [getattr(one, what) for one in each] for what in ("torque", "speed")}
    if blocks:
        share = np.array([block.share for block in blocks])
        told |= {"duty": np.arange(1, len(blocks) + 1), "duty_share": share / share.sum()}
    if stages:
        labels = labels_of(scene.operation.stages)[: len(stages)]
        kept = [len(lived.kept(k).cycle) for k in range(len(labels))]
        told |= {"stage": labels, "update_stage": np.repeat(labels, kept)}
    return told
