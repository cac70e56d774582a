"""Damping in proportion to the elastic force: no jump where flanks meet."""

from typing import Annotated, Any, Literal, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.specification import GearError
from wearlab.mesh.damping_laws import DampingLaw, MeshesInOperation
from wearlab.options import POSITIVE, LossPerSpeed


class HuntCrossley(NamedTuple):
    """``N = F max(0, 1 + χ ẋ)``; flanks that are apart exert nothing.

    Parameters
    ----------
    loss : (n_mesh,) χ [s/m]
    """

    loss: Array


def in_contact(
    law: Any, m: Any, force: float, stiffness: float, part: float, rate: float
) -> Any:
    """Return ``F (1 + χ ẋ)`` and its derivatives, 0 where that pulls.

    Parameters and returns are those of `wearlab.mesh.damping.register`.
    """
    factor = 1.0 + law.loss[m] * rate
    if factor <= 0.0:
        return 0.0, 0.0, 0.0
    return force * factor, stiffness * factor, force * law.loss[m]


class HuntCrossleyDamping(DampingLaw):
    """Damping in proportion to the elastic force.

    Flanks that meet at a speed v part at ``v (1 − ⅔ χ v)`` while that loss is small,
    whatever their load.
    """

    model: Literal["hunt-crossley"] = "hunt-crossley"
    """damping in proportion to the elastic force: N = F (1 + χ ẋ). Source: Hunt &
    Crossley 1975 Eq. 6"""
    loss: Annotated[LossPerSpeed, POSITIVE] | None = None
    """χ: flanks that meet at a speed v part slower by the share ⅔ χ v [c over the
    static force of the mesh: about that force the loss is the viscous law's]. Source:
    Hunt & Crossley 1975"""

    def build(self, meshes: MeshesInOperation) -> HuntCrossley:
        """Return the law, with χ as given, else c over the static force.

        Raises
        ------
        GearError
            When χ is to follow from a static force of nought.
        """
        from wearlab.mesh.damping import no_force, register

        register(HuntCrossley, in_contact, no_force)
        if self.loss is not None:
            return HuntCrossley(np.full(len(meshes.damping), self.loss))
        if not meshes.force.all():
            raise GearError(
                "mesh.damping_law: without a torque no static force says what χ is: "
                'give loss, such as {model = "hunt-crossley", loss = "0.3 s/m"}'
            )
        return HuntCrossley(meshes.damping / meshes.force)
