"""What touching meshes and loads put in at all stages, affine in the projections d·q of the meshes."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.compiled import jit
from wearlab.dynamics.balance import Balance
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

Array = NDArray[np.float64]


class Inputs(NamedTuple):
    """The inputs at the stages of all steps, ``u = push (1, sizes) − law d·q``.

    Parameters
    ----------
    law : (n_steps, 3, n_in, n_mesh)
    push : (n_steps, 3, n_in, 1 + n_balance) by tables and constant loads; by loads of size one
    """

    law: Array
    push: Array


def inputs_of(
    system: System, balance: Balance | None, tables: StageTables, period: float, mean: Array, shares: Array
) -> Inputs:
    """Return the mesh law and the loads at all stages, as `wearlab.dynamics.flanks.mesh_law` has them.

    Parameters
    ----------
    system, balance, tables, period : what moves
    mean : (n_mesh,) stiffness that the linear part holds [N/m]
    shares : (n_in, n_vectors) share of the channels and loads in the inputs
    """
    steps, stages, meshes = tables.error.shape
    count = 0 if balance is None else len(balance.held)
    channels = meshes if system.friction_constant is None else 3 * meshes
    law = np.zeros((steps, stages, len(shares), meshes))
    push = np.empty((steps, stages, len(shares), 1 + count))
    push[..., 0] = shares[:, channels]
    if system.fluctuation_direction is not None and tables.fluctuation is not None:
        push[..., 0] += tables.fluctuation[..., None] * shares[:, channels + 1]
    if count:
        push[..., 1:] = shares[:, -count:]
    friction = None if system.friction_constant is None else (tables.sliding, tables.moment)
    tabulate(
        tables.stiffness, tables.gap, tables.error, tables.error_rate, friction, shares, mean,
        system.mesh_damping / period, law, push,
    )  # fmt: skip
    return Inputs(law, push)


@jit
def tabulate(
    stiffness: Any, gap: Any, error: Any, error_rate: Any, friction: Any, shares: Any, mean: Any,
    damping: Any, law: Any, push: Any,
) -> None:  # fmt: skip
    """Add ``W = k d·q − Σ_p k_p (g_p + e) − c ė`` of every mesh, less its mean part, to ``law`` and ``push``.

    ``friction``: Λμ and Λμ s of all pairs, whose channels are ``Σ_p Λμ_p F_p`` and ``Σ_p Λμ_p s_p F_p``.
    """
    steps, stages, meshes, pairs = stiffness.shape
    for step in range(steps):
        for stage in range(stages):
            for m in range(meshes):
                total, held = -mean[m], damping[m] * error_rate[step, stage, m]
                for p in range(pairs):
                    k = stiffness[step, stage, m, p]
                    total += k
                    held += k * (gap[step, stage, m, p] + error[step, stage, m])
                enter(shares, m, m, total, held, law[step, stage], push[step, stage])
                if friction is not None:
                    for channel in range(2):
                        total, held = 0.0, 0.0
                        for p in range(pairs):
                            k = friction[channel][step, stage, m, p] * stiffness[step, stage, m, p]
                            total += k
                            held += k * (gap[step, stage, m, p] + error[step, stage, m])
                        at = (channel + 1) * meshes + m
                        enter(shares, at, m, total, held, law[step, stage], push[step, stage])


@jit
def enter(shares: Any, channel: int, m: int, total: float, held: float, law: Any, push: Any) -> None:
    """Add the force ``total d·q − held`` of a channel of mesh ``m`` to the inputs that share it."""
    for a in range(len(shares)):
        share = shares[a, channel]
        if share != 0.0:
            law[a, m] += share * total
            push[a, 0] += share * held
