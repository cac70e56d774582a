"""The conditions that a scene runs in: one, several in turn, or stages in order."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.life import coupled, duty_coupling
from wearlab.scene import Scene


class OperatingCondition(NamedTuple):
    """What runs at a time: one condition, or several that take turns.

    Parameters
    ----------
    parts : its physics
    weight : share of the cycles of each condition [1]
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
    shares = [block.share for block in operation.blocks] or [1.0]
    return (operating_condition(scenes, shares),)


def operating_condition(
    scenes: Sequence[Scene], share: Sequence[float], cycles: float | None = None
) -> OperatingCondition:
    """Return conditions that take turns, of the cycles ``w_b = u_b ω_b / Σ u_b ω_b``.

    Parameters
    ----------
    scenes : in one condition each
    share : u, of the time; only their proportions count [1]
    cycles : how long they last, None: to the limits of the scene
    """
    models = tuple(map(assembly.build, scenes))
    time = np.asarray(share, float) / np.sum(share)
    speed = np.array([model.gears.speed for model in models])
    weight = np.ones(1)
    if len(models) > 1:
        weight = time * speed / (time @ speed)
    mean_speed = float(duty_coupling.mixture(time, list(speed)))
    return OperatingCondition(
        models, weight, mean_speed, taking_turns(models, weight), cycles
    )


def taking_turns(
    models: Sequence[assembly.GearModel], weight: Array
) -> coupled.Coupled:
    """Return conditions that take turns as one coupling.

    Parameters
    ----------
    models : the physics in each condition
    weight : share of the cycles of each condition [1]
    """
    first, *later = (model.coupling for model in models)
    if not later:
        return first
    return duty_coupling.DutyCoupling(first.kinds, (first, *later), weight)
