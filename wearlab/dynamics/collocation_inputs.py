"""What touching meshes and loads put in at all stages, affine in the projections d·q of the meshes."""

from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.balance import Balance
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables


class Inputs(NamedTuple):
    """The inputs at the stages of all steps, ``u = shares (push − law d·q) + load (1, sizes)``.

    Channels are the meshes, with friction three times over: channel c feels mesh c mod n_mesh.

    Parameters
    ----------
    share : (n_shares,) share of a channel in an input
    to, of : (n_shares,) which input, and which channel
    law, push : (n_steps, 3, n_channel) stiffness beyond the linear part's [N/m], and force [N]
    load : (n_steps or 1, 3 or 1, n_in, 1 + n_balance) by given loads; by loads of size one
    """

    share: Array
    to: Index
    of: Index
    law: Array
    push: Array
    load: Array


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
    channels = meshes if system.friction_constant is None else 3 * meshes
    law, push = np.empty((2, steps, stages, channels))
    load = load_of(system, balance, tables, shares)
    rubbing = tables.filled
    tabulate(
        tables.stiffness, tables.gap, tables.error, tables.error_rate, rubbing.sliding, rubbing.moment, mean,
        system.mesh_damping / period, law, push,
    )  # fmt: skip
    to, of = np.ascontiguousarray(np.nonzero(shares[:, :channels]))
    return Inputs(shares[to, of], to, of, law, push, load)


def load_of(
    system: System, balance: Balance | None, tables: StageTables, shares: Array, *, shifted: bool = False
) -> Array:
    """Return the inputs by given loads and by loads of size one, see `Inputs` and `basis_of`."""
    count = 0 if balance is None else len(balance.held)
    channels = len(system.direction) if system.friction_constant is None else 3 * len(system.direction)
    constant = 0 if shifted else 1
    load = shares[:, channels : channels + 1] if constant else np.zeros((len(shares), 1))
    if system.fluctuation_direction is not None and tables.fluctuation is not None:
        at = channels + constant
        load = load + tables.fluctuation[..., None, None] * shares[:, at : at + 1]
    load = load.reshape(-1, load.shape[-3] if load.ndim > 2 else 1, *load.shape[-2:])
    if count:
        sizes = np.broadcast_to(shares[:, -count:], (*load.shape[:3], count))
        load = np.concatenate([load, sizes], axis=3)
    return np.ascontiguousarray(load)


@jit
def tabulate(
    stiffness: Any, gap: Any, error: Any, error_rate: Any, sliding: Any, moment: Any, mean: Any, damping: Any,
    law: Any, push: Any,
) -> None:  # fmt: skip
    """Fill ``law`` and ``push`` with ``Σ_p k_p − k̄`` and ``Σ_p k_p (g_p + e) + c ė`` of every mesh.

    They may be of fewer steps than the tables: of the first.
    ``sliding``, ``moment``: Λμ and Λμ s of all pairs, for the channels ``Σ_p Λμ_p F_p`` and
    ``Σ_p Λμ_p s_p F_p``, where there are any.
    """
    stages, meshes, pairs = stiffness.shape[1:]
    for step in range(len(law)):
        for stage in range(stages):
            for m in range(meshes):
                total, held = -mean[m], damping[m] * error_rate[step, stage, m]
                for p in range(pairs):
                    k = stiffness[step, stage, m, p]
                    total += k
                    held += k * (gap[step, stage, m, p] + error[step, stage, m])
                law[step, stage, m], push[step, stage, m] = total, held
                if law.shape[2] > meshes:
                    for channel, shares in enumerate((sliding, moment)):
                        total, held = 0.0, 0.0
                        for p in range(pairs):
                            k = shares[step, stage, m, p] * stiffness[step, stage, m, p]
                            total += k
                            held += k * (gap[step, stage, m, p] + error[step, stage, m])
                        at = (channel + 1) * meshes + m
                        law[step, stage, at], push[step, stage, at] = total, held


@jit_inner(forceinline=True)
def at_stage(inputs: Any, step: int, stage: int, law: Any, push: Any) -> None:
    """Fill the inputs of a stage, ``push (1, sizes) − law d·q``: (n_in, n_mesh) and (n_in, 1 + n_balance)."""
    load, count = inputs.load, len(push)
    row, column = step if len(load) > 1 else 0, stage if load.shape[1] > 1 else 0
    for a in range(count):  # not by slices: they take as long as all the rest
        for x in range(push.shape[1]):
            push[a, x] = load[row, column, a, x]
        for m in range(law.shape[1]):
            law[a, m] = 0.0
    for x in range(len(inputs.share)):
        a, channel, share = inputs.to[x], inputs.of[x], inputs.share[x]
        felt = channel
        while felt >= law.shape[1]:  # a division takes longer than all the rest
            felt -= law.shape[1]
        law[a, felt] += share * inputs.law[step, stage, channel]
        push[a, 0] += share * inputs.push[step, stage, channel]
