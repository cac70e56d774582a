"""The equation of motion at any instant within a step.

Methods use it that do not follow changes of contact.
"""

from typing import Any

import numpy as np

from wearlab.compiled import jit_inner
from wearlab.dynamics.integrators import damping_law, mesh_law, rk4


@jit_inner(counted=False)
def set_instant(kernel: Any, step: int, x: float, state: Any) -> None:
    """Set what touches and pushes within a step, and the laws of channels and loads.

    Parameters
    ----------
    kernel, step : the system, and a step of its tables
    x : fraction of the step [1]
    state : (2n,) there
    """
    for m in range(len(kernel.flanks.meshes.damping)):
        place, speed = mesh_law.motion_of(
            kernel.structure, m, np.uint64(1), state, np.uint64(0)
        )
        damping_law.set_flanks(
            kernel.damping_law, kernel.flanks, step, x, m, place, speed
        )
    mesh_law.fill_channel_laws(kernel.flanks, mesh_law.THIS, 1)
    mesh_law.fill_load_inputs(kernel.flanks, kernel.balance, step, x, x, mesh_law.THIS)


@jit_inner(counted=False)
def acceleration(kernel: Any, step: int, x: float, state: Any, out: Any) -> None:
    """Write q̈ at an instant within a step.

    Parameters
    ----------
    kernel, step, x, state : as in `set_instant`
    out : (n,) written [m/s²]
    """
    set_instant(kernel, step, x, state)
    rk4.acceleration(kernel, mesh_law.START, state, out)
