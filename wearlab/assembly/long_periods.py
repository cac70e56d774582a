"""What lasts longer than a mesh period: slow errors and a fluctuating torque."""

from collections.abc import Sequence
from fractions import Fraction
from math import lcm

import numpy as np
from scipy.linalg import null_space

from wearlab.arrays import Array
from wearlab.assembly import memory
from wearlab.dynamics import system
from wearlab.gears import specification
from wearlab.life.vibration import hunting_grid
from wearlab.mesh import gear_set, stages
from wearlab.mesh.clock import Mesh
from wearlab.scene import Scene, operation

TAKEN_UP = 1e-9
LONGEST_PERIOD = 60
"""Mesh periods after which a fluctuating torque has to repeat."""
SAME_ORDER = 1e-9
MAX_SINES = 2e10
"""Values of waves that a transmission error over all mesh periods may sum: minutes."""


def hunting_period(
    scene: Scene, gears: gear_set.GearSet, meshes: Sequence[Mesh]
) -> int:
    """Return the mesh periods until slow errors of teeth and input torque repeat.

    Raises
    ------
    GearError : the torque repeats after more than `LONGEST_PERIOD` mesh periods only
    """
    slow = any(len(mesh.error.slow.amplitude) for mesh in meshes)
    turns = 1
    if scene.errors is not None and slow:
        turns = scene.errors.slow.periods([gear.teeth for gear in gears.gears.values()])
    return lcm(
        turns,
        *(_repeats(harmonic, gears.period) for harmonic in scene.operation.fluctuation),
    )


def require_memory(teeth: Sequence[int], periods: int, numbers: int) -> None:
    """Refuse hunting teeth whose mesh periods would fill the memory.

    Parameters
    ----------
    teeth : numbers of teeth of the gears
    periods : mesh periods until the same teeth meet again
    numbers : that are held of each mesh period

    Raises
    ------
    GearError : all periods take more than `memory.MAX_BYTES`
    """
    if limit := memory.gigabytes_beyond(numbers * periods):
        raise _meet_too_rarely(teeth, periods, limit)


def require_bounded_transmission_error(
    scene: Scene, gears: gear_set.GearSet, meshes: Sequence[Mesh], phases: int
) -> None:
    """Refuse measured pitches whose transmission error takes too much memory or work.

    Parameters
    ----------
    scene, gears : the scene and its gear set
    meshes : with their errors
    phases : stored phases of a mesh period

    Raises
    ------
    GearError : it takes more than `memory.MAX_BYTES` or `MAX_SINES`
    """
    if scene.errors is None or not scene.prescribed.measured_pitches:
        return
    teeth = [gear.teeth for gear in gears.gears.values()]
    periods = scene.errors.slow.periods(teeth)
    states = memory.wear_states(scene)
    require_memory(teeth, periods, (states + 1) * len(meshes) * phases)

    waves = sum(len(mesh.error.slow.amplitude) for mesh in meshes)
    sines = float(waves * phases * periods)
    if sines > MAX_SINES:
        limit = f"{sines:.3g} values of waves, more than {MAX_SINES:g}"
        raise _meet_too_rarely(teeth, periods, limit)


def _meet_too_rarely(
    teeth: Sequence[int], periods: int, limit: str
) -> specification.GearError:
    """Return why teeth that meet again so late are refused, and what to give."""
    names = " and ".join(map(str, dict.fromkeys(teeth)))
    return specification.GearError(
        f"errors.slow: {names} teeth meet again after {periods} mesh periods, which "
        f"need {limit}: give numbers of teeth with a common factor, or errors of one "
        "wave a turn and errors.slow = 'averaged'"
    )


def _repeats(harmonic: operation.TorqueFluctuation, period: float) -> int:
    """Return the mesh periods after which a harmonic of the torque repeats."""
    order = harmonic.order_at(period)
    near = Fraction(order).limit_denominator(LONGEST_PERIOD)
    if abs(near - order) <= SAME_ORDER * order:
        return near.denominator
    key = "order" if harmonic.frequency is None else "frequency"
    remedy = (
        f"{float(near):.6g}"
        if harmonic.frequency is None
        else f"{float(near) / period:.8g} Hz"
    )
    raise specification.GearError(
        f"operation.torque_fluctuation.{key}: {order:.6g} times the mesh frequency of "
        f"{1 / period:.6g} Hz "
        f"repeats after more than {LONGEST_PERIOD} mesh periods; give {remedy}, which "
        "repeats after "
        f"{near.denominator}"
    )


def slow_errors(
    scene: Scene, gears: gear_set.GearSet, meshes: Sequence[Mesh], system: system.System
) -> Array | None:
    """Return once-per-revolution errors (n_angles, n_mesh) [m], None where none acts.

    A constant error does nothing to a set that turns freely until it is taken up: when
    some ``D q = e`` has ``K q = 0``.
    """
    if scene.prescribed.slow.turns:
        return None
    at_angles = gears.slow_errors(meshes)
    if at_angles is None:
        return None
    rows = scene.prescribed.slow.rows(meshes, at_angles)
    if rows is None:
        return None
    free = system.direction @ null_space(system.total_stiffness)
    taken_up = (
        free @ np.linalg.lstsq(free, rows.T, rcond=None)[0]
        if free.size
        else np.zeros_like(rows.T)
    )
    return (
        None
        if np.abs(taken_up - rows.T).max() <= TAKEN_UP * np.abs(rows).max()
        else rows
    )


def fluctuation(
    scene: Scene, grid: stages.StageGrid, periods: int, duration: float
) -> Array | None:
    """Return ``Σ aᵢ cos(2π orderᵢ φ + phaseᵢ)/a₁`` at stages of mesh periods, (n, 3).

    Parameters
    ----------
    scene : its harmonics; their first amplitude is the system's fluctuating load
    grid : steps of a mesh period
    periods : mesh periods after which all of them repeat
    duration : of a mesh period [s]
    """
    harmonics = scene.operation.fluctuation
    if not harmonics:
        return None
    phase = hunting_grid(grid, periods).phase
    turned = [
        2 * np.pi * harmonic.order_at(duration) * phase + harmonic.phase
        for harmonic in harmonics
    ]
    waves = [
        harmonic.amplitude * np.cos(angle)
        for harmonic, angle in zip(harmonics, turned, strict=True)
    ]
    return np.asarray(sum(waves) / harmonics[0].amplitude)
