"""Natural frequencies, mode shapes and critical speeds of a gear set."""

from typing import Any

import numpy as np

from wearlab import assembly
from wearlab.gears.specification import GearError
from wearlab.scene import Scene
from wearlab.simulation import label

MOVING_SHARE = 0.3
"""Share of the largest amplitude of a mode from which a coordinate moves in it."""


def mode_values(model: assembly.GearModel) -> label.Values:
    """Return natural frequencies and the speeds at which the mesh frequency meets them.

    Parameters
    ----------
    model : the physics of the scene
    """
    of_scene = assembly.build_modes(model)
    values: label.Values = {
        "natural_frequency": of_scene.modes.frequency,
        "critical_speed": of_scene.critical_speed[0],
        "mode_participation": of_scene.modes.participation.T,
    }
    if of_scene.kinds is not None:
        values["mode_kind"] = list(of_scene.kinds)
    return values


def modes_table(scene: Scene) -> list[dict[str, Any]]:
    """Return one row a mode: frequency, what moves, excitation and critical speeds.

    A critical speed is that of the input member, as ``operation.speed`` is.

    Parameters
    ----------
    scene : a scene with dynamics

    Raises
    ------
    Refused
        When the scene has no dynamics, or no such gears can exist.
    """
    if scene.dynamics is None:
        raise label.Refused("the scene has no [dynamics]: nothing vibrates")
    try:
        of_scene = assembly.build_modes(assembly.build(scene))
    except GearError as error:
        raise label.Refused(str(error)) from error

    columns = _columns(of_scene)
    rows = zip(*columns.values(), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]


def _columns(of_scene: assembly.SceneModes) -> dict[str, Any]:
    """Return the columns of the table of modes."""
    modes = of_scene.modes
    amplitudes = np.abs(modes.shape)
    coordinates = np.asarray(of_scene.coordinates)
    moving = [
        coordinates[amplitude > MOVING_SHARE * amplitude.max()]
        for amplitude in amplitudes
    ]

    columns: dict[str, Any] = {
        "mode": range(1, len(amplitudes) + 1),
        "natural_frequency [Hz]": modes.frequency.tolist(),
    }
    if of_scene.kinds is not None:
        columns["kind"] = of_scene.kinds
    columns["moves"] = map(", ".join, moving)
    columns["excited by the mesh"] = map(bool, modes.excited())
    columns["participation"] = modes.participation.max(axis=-1).tolist()
    for order, speeds in enumerate(of_scene.critical_speed, 1):
        rpm = speeds * 30.0 / np.pi
        columns[f"critical speed, order {order} [rpm]"] = rpm.tolist()
    return columns
