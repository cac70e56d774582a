"""Tooth friction and the balance of energy over a period, named as the dataset names them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.energy import energy_balance
from wearlab.dynamics.response import Response
from wearlab.life.vibration import Vibration
from wearlab.mesh.excitation import Touching
from wearlab.mesh.profile import Lookup, interpolate
from wearlab.scene.build import Parts

Array = NDArray[np.float64]
Values = dict[str, Any]


def energy_values(parts: Parts, vibration: Vibration, response: Response) -> Values:
    """Return every term of the balance of energy [W], its residual and the efficiency, where flanks rub."""
    if vibration.nominal is None or parts.friction is None:
        return {}
    found = energy_balance(response, vibration.nominal)
    values: Values = {f"energy_{name}": power for name, power in found._asdict().items()}
    return values | {"residual_energy": found.residual, "efficiency": found.efficiency}


def friction_force(parts: Parts, mesh: int, mine: Touching, where: Lookup, pair: Array) -> Array:
    """Return ``Σ_j Λμ F_j`` on the driving flank, positive in recess, (n_phases,) [N].

    Parameters
    ----------
    parts, mesh, mine : the mesh and its flanks
    where : the phases
    pair : (n_phases, n_pairs) forces on the drive flanks [N]
    """
    assert parts.friction is not None
    sense = mine.analysis.grid.sliding_sense[where.segment]
    return np.asarray(parts.friction * (sense * pair).sum(axis=1))


def moments(
    parts: Parts, kind: int, gear: int, mine: Touching, where: Lookup, pair: Array, damping: Array
) -> Array:
    """Return ``Σ_j F_j (1 + Λμ ρ_j/r_b)`` and the damping, on a gear of a mesh, (n_rows, n_phases) [N].

    Friction adds to the moment of a driving gear in recess, where its arm is ρ = r_b tan α_w + s.

    Parameters
    ----------
    parts, kind, gear : 0 driving or 1 driven, of a kind of mesh
    mine, where : its flanks and the phases
    pair : (n_rows, n_phases, n_pairs) forces on the drive flanks [N]
    damping : (n_rows, n_phases) damping force [N]
    """
    grid, own = mine.analysis.grid, parts.kinds[kind].pair
    s = np.zeros(pair.shape[1:])
    interpolate(grid.first, where, grid.touching, 0.0, s)
    arm = own.curvature(s.ravel())[gear].reshape(s.shape) / own.gears[gear].base_radius
    friction = (parts.friction or 0.0) * grid.sliding_sense[where.segment] * arm
    return np.asarray((pair * (1.0 + friction)).sum(axis=-1) + damping)
