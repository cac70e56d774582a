"""Natural frequencies of a scene as rows of a table."""

from typing import Any

import numpy as np

from wearlab.gears.specification import GearError
from wearlab.scene import Scene
from wearlab.scene.build import build
from wearlab.scene.build.modes import build_modes
from wearlab.simulation.errors import Refused


def modes_table(scene: Scene) -> list[dict[str, Any]]:
    """Return one row a mode: frequency, what moves, whether the mesh excites it, and its critical speeds.

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
        raise Refused("the scene has no [dynamics]: nothing vibrates")
    try:
        table = build_modes(build(scene))
    except GearError as error:
        raise Refused(str(error)) from error
    rows, excited = [], table.modes.excited()
    for mode in range(len(table.modes.frequency)):
        shape = np.abs(table.modes.shape[mode])
        share = table.modes.participation[mode].max()
        rows.append(
            {
                "mode": mode + 1,
                "natural_frequency [Hz]": float(table.modes.frequency[mode]),
                **({} if table.kinds is None else {"kind": table.kinds[mode]}),
                "moves": ", ".join(
                    name
                    for name, size in zip(table.coordinates, shape, strict=True)
                    if size > 0.3 * shape.max()
                ),
                "excited by the mesh": bool(excited[mode]),
                "participation": float(share),
            }
            | {
                f"critical speed, order {order + 1} [rpm]": float(speeds[mode] * 30.0 / np.pi)
                for order, speeds in enumerate(table.critical_speed)
            }
        )
    return rows
