"""Compile once, before workers start, what a set of scenes will call."""

from collections.abc import Iterable
from contextlib import suppress

from wearlab.gears.errors import GearError
from wearlab.life.limits import StopWear
from wearlab.scene import Scene
from wearlab.scene.build import build


def warm_up(scenes: Iterable[Scene]) -> None:
    """Evaluate one wear state of every kind of scene, so that its kernels are compiled and cached on disk.

    Parameters
    ----------
    scenes : scenes to come; those that need the same kernels are evaluated once
    """
    for scene in {_kernels(scene): scene for scene in scenes}.values():
        with suppress(GearError, StopWear):
            parts = build(scene)
            parts.coupling.evaluate(parts.coupling.unworn())


def _kernels(scene: Scene) -> tuple[object, ...]:
    """Return what decides which kernels a scene calls."""
    meshes = scene.mesh.each(scene.gears.kind)
    dynamics = scene.dynamics and (
        scene.dynamics.chosen,
        scene.dynamics.method,
        scene.dynamics.friction is None,
        all(mesh.normal_backlash is None for mesh in meshes),
        meshes[0].damping_in,
        meshes[0].excitation.by_pairs,
        scene.operation.torque_fluctuation is None,
    )
    law = scene.wear and (
        scene.wear.contact_patch.chosen,
        str(scene.wear.coefficient),
        str(scene.wear.law),
    )
    return dynamics, tuple((mesh.stiffness.chosen, mesh.contact.chosen) for mesh in meshes), law
