"""A dashpot on the rate of approach of touching flanks."""

from typing import ClassVar, Literal

from wearlab.mesh.damping_laws import DampingLaw, MeshesInOperation


class ViscousDamping(DampingLaw):
    """A dashpot on the rate of approach of the flanks, shared like the stiffness.

    Flanks do not pull.
    """

    acts_in_separation: ClassVar[bool] = True

    model: Literal["viscous"] = "viscous"
    """a dashpot on the rate of approach of touching flanks. Source: L16 Eq. 6, W23 Eq.
    36"""

    def build(self, meshes: MeshesInOperation) -> None:
        """Return None: the kernels have this law built in."""
