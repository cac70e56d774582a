"""Scenes whose tables would fill the memory are refused before they are made."""

from wearlab.gears.specification import GearError
from wearlab.scene import Scene

MAX_BYTES = 10e9
"""Memory that tables of a run may take."""
FLOAT_BYTES = 8
NUMBERS_OF_A_STEP = 120
"""Numbers in the tables of a mesh, of three stages, and as many beside them while they
are made."""
NUMBERS_OF_A_PHASE = 54
"""Numbers that are stored of a mesh in a wear state, and as many while they are
written."""
NUMBERS_OF_A_DEPTH = 40
"""The same of a wear depth: what is stored along the path beside it."""
WEAR_STATES = 32
"""Wear states that are stored of a life where none was asked for, about."""


def gigabytes_beyond(numbers: float) -> str:
    """Return how much memory numbers take where that is too much, else "".

    Parameters
    ----------
    numbers : that are held at once
    """
    needed = FLOAT_BYTES * numbers
    if needed <= MAX_BYTES:
        return ""
    return f"{needed / 1e9:.3g} GB, more than {MAX_BYTES / 1e9:g} GB"


def require_memory_for_steps(steps: int, mesh_count: int) -> None:
    """Refuse so many steps of a mesh period that their tables would fill the memory.

    Parameters
    ----------
    steps : of a mesh period
    mesh_count : number of meshes that move

    Raises
    ------
    GearError : they take more than `MAX_BYTES`
    """
    of_a_step = NUMBERS_OF_A_STEP * mesh_count
    if limit := gigabytes_beyond(of_a_step * steps):
        most = int(MAX_BYTES / FLOAT_BYTES / of_a_step)
        raise GearError(
            f"numerics.steps_per_period: {steps} steps of {mesh_count} meshes need "
            f"{limit}: give at most {most}, or leave it out"
        )


def require_memory_for_states(
    scene: Scene, phases: int, meshes: int, depths: int
) -> None:
    """Refuse so many phases, nodes and wear states that a run would fill the memory.

    Parameters
    ----------
    scene : which says how many wear states are stored
    phases : stored phases of a mesh period
    meshes : number of meshes
    depths : number of wear depths of all flanks

    Raises
    ------
    GearError : they take more than `MAX_BYTES`
    """
    states = wear_states(scene)
    of_a_state = NUMBERS_OF_A_PHASE * meshes * phases + NUMBERS_OF_A_DEPTH * depths
    if limit := gigabytes_beyond(of_a_state * states):
        raise GearError(
            f"numerics.phase_points: {phases} phases of {meshes} meshes, and {depths} "
            f"wear depths, in about {states} wear states need {limit}: give fewer "
            "phase_points, profile_points or wear.snapshots"
        )


def wear_states(scene: Scene) -> int:
    """Return about how many wear states a run stores.

    Parameters
    ----------
    scene : the scene
    """
    if scene.wear is None or scene.wear.until is None:
        return 1
    snapshots = scene.wear.snapshots
    if snapshots is None:
        return WEAR_STATES
    asked = (snapshots.cycles, snapshots.mesh_cycles, snapshots.depth)
    return 2 + sum(len(places or ()) for places in asked)
