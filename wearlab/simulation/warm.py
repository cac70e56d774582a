"""Compile once, before workers start, what a set of scenes will call.

Several workers share that.
"""

import gc
from collections.abc import Callable, Iterable
from contextlib import suppress

import numpy as np

from wearlab import assembly
from wearlab.dynamics.integrators import contact_change, kernel
from wearlab.dynamics.steady import integrate, periodic
from wearlab.gears.specification import GearError
from wearlab.life.limits import StopWear
from wearlab.options import Part
from wearlab.scene import Scene

Job = tuple[Callable[[Scene], None], Scene]
"""What to do with a scene that calls some of its kernels."""


Report = Callable[[int, int, str], None]
"""Called with how many parts are compiled, how many there are, and what comes next."""


def warm_up(
    scenes: Iterable[Scene],
    turn: int = 0,
    workers: int = 1,
    report: Report | None = None,
) -> None:
    """Compile the kernels of every kind of scene and cache them on disk.

    Of several workers each does its share of the jobs, the longest last: on disk is
    what others have compiled by then.

    Parameters
    ----------
    scenes : scenes to come; those that need the same kernels are evaluated once
    turn, workers : this worker's place among those that share the work, and their
        number
    report : is told before each job, and at the end; None: nobody
    """
    kinds = kinds_of(scenes)
    jobs: list[Job] = (
        [(_evaluate, scene) for scene in kinds] if workers == 1 else jobs_of(kinds)
    )
    share = jobs[turn::workers][::-1]
    for done, job in enumerate(share):
        if report is not None:
            report(done, len(share), name_of(job))
        do(job)
    if report is not None:
        report(len(share), len(share), "")


def jobs_of(kinds: Iterable[Scene]) -> list[Job]:
    """Return what compiles all kernels of kinds of scenes, in parts, longest first.

    What locates changes of contact is compiled beside the map of a period, which finds
    it on disk.
    """
    ordered = sorted(kinds, key=lambda scene: -len(scene.meshes))
    moving = [scene for scene in ordered if scene.dynamics]
    jobs: list[Job] = [
        (job, scene) for scene in moving for job in (_evaluate, _change_contact)
    ]
    return jobs + [(_evaluate, scene) for scene in ordered if not scene.dynamics]


def name_of(job: Job) -> str:
    """Return what a job of `jobs_of` compiles, in words."""
    evaluate, scene = job
    gears = scene.gears.kind
    if evaluate is _change_contact:
        return f"changes of contact, {gears}"
    what = "contact, motion and wear" if scene.dynamics else "contact and wear"
    return f"{what}, {gears}"


def do(job: Job) -> None:
    """Do a job of `jobs_of`.

    No garbage is collected while it compiles, which saves an eighth of its time.
    """
    evaluate, scene = job
    collects = gc.isenabled()
    gc.disable()
    try:
        with suppress(GearError, StopWear):
            evaluate(scene)
    finally:
        if collects:
            gc.enable()


def kinds_of(scenes: Iterable[Scene]) -> list[Scene]:
    """Return one scene of every kind: two of a kind call the same kernels."""
    return list({_kernels(scene): scene for scene in scenes}.values())


def _evaluate(scene: Scene) -> None:
    coupling = assembly.build(scene.in_heaviest_condition).coupling
    coupling.evaluate(coupling.unworn())


def _change_contact(scene: Scene) -> None:
    """Take a step as one in which contact changes."""
    coupling = assembly.build(scene.in_heaviest_condition).coupling
    moves = coupling.vibration
    if moves is None or not isinstance(moves.method, periodic.Periodic):
        return
    flanks = coupling.flanks(coupling.unworn())
    tables = moves.tables(coupling.in_motion(flanks))
    steps = integrate.OnTables(kernel.kernel_of(moves.system, tables, moves.period))
    states = np.zeros_like(steps.states(1))
    size = np.uint64(states[0].size)
    places = states.reshape(-1), np.uint64(0), size
    contact_change.step_with_changes(
        steps.kernel.flanks,
        steps.kernel.series,
        steps.kernel.balance,
        0,
        np.uint64(1),
        *places,
    )


def _kernels(scene: Scene) -> tuple[object, ...]:
    """Return what decides which kernels a scene calls."""
    meshes = list(scene.meshes.values())
    moves = scene.dynamics
    wear = scene.wear
    forces = meshes[0].excitation.by_pairs, not scene.operation.fluctuation
    dynamics = moves and (moves.chosen, moves.method, moves.friction is None, *forces)
    law = wear and (
        wear.contact_patch.chosen,
        _choices(wear.coefficient),
        _choices(wear.law),
    )
    return (
        dynamics,
        tuple((mesh.stiffness.chosen, mesh.contact.chosen) for mesh in meshes),
        law,
    )


def _choices(options: object) -> object:
    """Return what is chosen among options, without numbers that kernels are handed."""
    if isinstance(options, Part):
        return type(options), *(_choices(value) for _, value in options)
    if isinstance(options, dict):
        return (*((name, _choices(value)) for name, value in options.items()),)
    return options if isinstance(options, bool | str) else None
