"""The elastic force of a mesh at given phases and deflections."""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.mesh.contact import ContactAnalysis, Nodes, Quasistatic
from wearlab.mesh.excitation import Touching
from wearlab.mesh.profile import Lookup
from wearlab.mesh.sharing import share
from wearlab.mesh.tabulation import springs


class MeshForce(NamedTuple):
    """The elastic force on the flanks at given phases and deflections.

    Parameters
    ----------
    elastic : (n,) drive minus back flank force [N]
    pair : (n, n_pairs) force on each pair's drive flank, never negative [N]
    """

    elastic: Array
    pair: Array


def mesh_force(flanks: Touching, where: Lookup, deflection: Array, backlash: float | None) -> MeshForce:
    """Return the elastic force at phases for deflections (n,) [m].

    Parameters
    ----------
    flanks : of the mesh
    where : the phases
    deflection : (n,) mesh deflection δ there [m]
    backlash : normal backlash, None: the back flank is not modelled [m]

    References
    ----------
    L16 Eq. 6, recentred: contact at δ > 0; W23 Eq. 36: the gaps of worn pairs.
    """
    if flanks.series is None:
        return _force_of_pairs(flanks.analysis, flanks.nodes, where, deflection, backlash)
    stiffness = flanks.series.stiffness.value(where.phase)
    drive = stiffness * np.maximum(0.0, deflection)
    share = load_share(flanks.analysis.quasistatic(flanks.nodes, where))
    return MeshForce(drive - back_force(stiffness, deflection, backlash), drive[:, None] * share)


def load_share(state: Quasistatic) -> Array:
    """Return each pair's share of the static force, 0 without load, (n, n_pairs) [1]."""
    total = state.force.sum(axis=1, keepdims=True)
    return np.divide(state.force, total, out=np.zeros_like(state.force), where=total > 0.0)


def _force_of_pairs(
    analysis: ContactAnalysis, nodes: Nodes, where: Lookup, deflection: Array, backlash: float | None
) -> MeshForce:
    stiffness, gaps, compliance, gap, cross = springs(analysis, nodes, where)
    pair = stiffness * np.maximum(0.0, deflection[:, None] - gaps)
    drive = pair.sum(axis=1)
    if cross.shape[2]:
        unused, tangent = np.empty(len(drive)), np.empty(len(drive))
        share(compliance, gap, cross, drive, unused, pair, tangent)
    return MeshForce(drive - back_force(stiffness.sum(axis=1), deflection, backlash), pair)


def back_force(stiffness: Array, deflection: Array, backlash: float | None) -> Array:
    """Return the force of the back flanks, ``k max(0, −j_bn − δ)``, else 0, (n,) [N].

    References
    ----------
    L16 Eq. 6, recentred: back contact begins where drive contact ends at −j_bn.
    """
    if backlash is None:
        return np.zeros_like(deflection)
    return stiffness * np.maximum(0.0, -backlash - deflection)
