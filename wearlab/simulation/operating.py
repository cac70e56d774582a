"""The conditions a scene runs in: one, several that take turns, or several in order."""

from dataclasses import dataclass

import numpy as np

from wearlab.life.coupled import Coupled
from wearlab.life.duty import DutyCoupling, DutyShares, duty_shares
from wearlab.scene import Scene
from wearlab.scene.build import Parts, build
from wearlab.scene.operation import labels_of


@dataclass(frozen=True)
class Stage:
    """What runs at a time: one condition, or several that take turns.

    Parameters
    ----------
    label : its name, "" where it is the only one
    scenes : the scene in each condition alone
    parts : its physics
    shares : how often each condition comes
    coupling : contact, dynamics and wear of all conditions together
    cycles : how long it lasts, None: to the limits of the scene
    """

    label: str
    scenes: tuple[Scene, ...]
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


def in_condition(scene: Scene, torque: float, speed: float, largest_torque: float | None = None) -> Scene:
    """Return the scene in one condition alone: input torque [N m] and speed [rad/s].

    Several conditions share flanks, and nodes that reach as far as the largest torque of all bends the teeth.
    """
    return scene.model_copy(update={"operation": scene.operation.alone(torque, speed, largest_torque)})


def stages_of(scene: Scene) -> tuple[Stage, ...]:
    """Return the stages of a scene: one, unless it has stages of operation.

    Raises
    ------
    GearError
        When no such gears can exist or run.
    """
    operation = scene.operation
    if operation.stages:
        return tuple(
            _stage(
                (in_condition(scene, stage.torque, stage.speed, operation.largest_torque),),
                (1.0,),
                label,
                stage.cycles,
            )
            for label, stage in zip(labels_of(operation.stages), operation.stages, strict=True)
        )
    if not operation.blocks:
        return (_stage((scene,), (1.0,)),)
    each = tuple(
        in_condition(scene, block.torque, block.speed, operation.largest_torque) for block in operation.blocks
    )
    return (_stage(each, tuple(block.share for block in operation.blocks)),)


def _stage(
    scenes: tuple[Scene, ...], share: tuple[float, ...], label: str = "", cycles: float | None = None
) -> Stage:
    parts = tuple(build(scene) for scene in scenes)
    return Stage(label, scenes, parts, *_together(parts, share), cycles)


def _together(parts: tuple[Parts, ...], share: tuple[float, ...]) -> tuple[DutyShares, Coupled]:
    """Return the shares of the conditions, and what they couple to."""
    if len(parts) == 1:
        return DutyShares(np.ones(1), parts[0].speed), parts[0].coupling
    shares = duty_shares(share, [part.speed for part in parts])
    return shares, coupled(parts, shares)


def coupled(parts: tuple[Parts, ...], shares: DutyShares) -> Coupled:
    """Return conditions that take turns as one coupling."""
    if len(parts) == 1:
        return parts[0].coupling
    couplings = tuple(part.coupling for part in parts)
    return DutyCoupling(couplings[0].kinds, couplings, shares.weight)
