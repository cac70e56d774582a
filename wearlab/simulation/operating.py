"""The conditions that a scene runs in: one, several in turn, or stages in order."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.life import coupled, duty_coupling
from wearlab.life.thermal_coupling import ThermalDuty
from wearlab.scene import Scene
from wearlab.scene.operation import DutyBlock


class OperatingCondition(NamedTuple):
    """What runs at a time: one condition, or several that take turns.

    Parameters
    ----------
    parts : its physics
    weight : share of the cycles of each condition, of idle ones the rest [1]
    speed : mean speed of the reference gear relative to the carrier, over time [rad/s]
    coupling : contact, dynamics and wear of all conditions together
    cycles : how long it lasts, None: to the limits of the scene
    """

    parts: tuple[assembly.GearModel, ...]
    weight: Array
    speed: float
    coupling: coupled.Coupled
    cycles: float | None

    @property
    def loaded_share(self) -> Array:
        """Share of the cycles in which each flank is loaded, (n_flanks,) [1]."""
        share = np.zeros(len(self.first.gears.flanks))
        for model, weight in zip(self.parts, self.weight, strict=True):
            for flank, (kind, _) in enumerate(model.gears.flank_places):
                share[flank] += weight * model.gears.is_loaded(kind)
        return np.where(np.abs(share - 1.0) < duty_coupling.ROUNDED, 1.0, share)

    @property
    def first(self) -> assembly.GearModel:
        """The physics in the first condition; the flanks are the same in all."""
        return self.parts[0]


def operating_conditions(scene: Scene) -> tuple[OperatingCondition, ...]:
    """Return the stages of a scene: one, unless it has stages of operation.

    Parameters
    ----------
    scene : the scene

    Raises
    ------
    GearError
        When no such gears can exist or run.
    """
    operation = scene.operation
    scenes = scene.in_conditions()
    if operation.stages:
        return tuple(
            operating_condition([in_stage], [1.0], stage.cycles)
            for in_stage, stage in zip(scenes, operation.stages, strict=True)
        )
    shares = [block.share for block in operation.loaded_blocks] or [1.0]
    idle = [block for block in operation.blocks if not block.is_loaded]
    return (operating_condition(scenes, shares, idle=idle),)


def operating_condition(
    scenes: Sequence[Scene],
    share: Sequence[float],
    cycles: float | None = None,
    idle: Sequence[DutyBlock] = (),
) -> OperatingCondition:
    """Return conditions that take turns, of the cycles ``w_b = u_b ω_b / Σ u_b ω_b``.

    Idle conditions have their share of the time and of the cycles, and no wear.

    Parameters
    ----------
    scenes : in one condition each
    share : u, of the time; only their proportions count [1]
    cycles : how long they last, None: to the limits of the scene
    idle : conditions without torque or without speed
    """
    models = tuple(map(assembly.build, scenes))
    of_input = models[0].gears.speed / scenes[0].operation.speed
    idle_speeds = [of_input * block.speed for block in idle]
    shares = np.array([*share, *(block.share for block in idle)], float)
    time = shares / shares.sum()
    speed = np.array([*(model.gears.speed for model in models), *idle_speeds])
    weight = np.ones(1)
    if len(time) > 1:
        weight = (time * speed / (time @ speed))[: len(models)]
    mean_speed = float(duty_coupling.mixture(time, list(speed)))
    turning = taking_turns(models, weight, time[: len(models)])
    return OperatingCondition(models, weight, mean_speed, turning, cycles)


def taking_turns(
    models: Sequence[assembly.GearModel], weight: Array, time: Array
) -> coupled.Coupled:
    """Return conditions that take turns as one coupling.

    Parameters
    ----------
    models : the physics in each condition
    weight : share of the cycles of each condition [1]
    time : share of the operating time of each condition [1]
    """
    first, *later = (model.coupling for model in models)
    thermal = models[0].scene.thermal
    shares_heat = thermal is not None and thermal.duty_temperature == "mean"
    is_alone = not later and weight[0] == 1.0
    never_pauses = float(time.sum()) >= 1.0 - duty_coupling.ROUNDED
    if is_alone and (never_pauses or not shares_heat):
        return first
    blocks = (first, *later)
    if not shares_heat:
        return duty_coupling.DutyCoupling(first.kinds, blocks, weight)
    mesh_of_blocks = [model.gears.kinds[0] for model in models]
    speeds = [mesh.speed for mesh in mesh_of_blocks]
    balance = assembly.heat.mean_balance(
        models[0].scene, mesh_of_blocks[0], speeds, time
    )
    return ThermalDuty(first.kinds, blocks, weight, time=time, balance=balance)
