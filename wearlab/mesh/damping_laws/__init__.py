"""``mesh.damping_law``: how a mesh loses energy, in contact and out of it."""

from collections.abc import Iterator
from typing import Any, ClassVar, Literal, NamedTuple

from wearlab.arrays import Array
from wearlab.slots import Slot, Variant


class MeshesInOperation(NamedTuple):
    """What a damping law is made of.

    Parameters
    ----------
    damping : (n_mesh,) c of `mesh.damping` or `mesh.damping_ratio` [N s/m]
    force : (n_mesh,) static normal force [N]
    curvature_radius : (n_mesh,) reduced radius of curvature at the pitch point [m]
    face_width : (n_mesh,) [m]
    viscosity : of the oil, None without one [Pa s]
    """

    damping: Array
    force: Array
    curvature_radius: Array
    face_width: Array
    viscosity: float | None


class DampingLaw(Variant):
    """Any damping law of a mesh."""

    slot: ClassVar[Slot] = Slot(
        "mesh.damping_law", __name__, default="viscous", by_name=True
    )
    needs_oil: ClassVar[bool] = False

    def build(self, meshes: MeshesInOperation) -> Any:
        """Return the law as the steps take it, see `wearlab.mesh.damping`.

        None: viscous.

        Raises
        ------
        GearError
            When something that it needs is missing.
        """
        raise NotImplementedError(f"{type(self).__name__} has no build")

    def problems(self, scene: Any) -> Iterator[str]:
        """Yield what this law asks of the other sections of a scene."""
        return iter(())


class ViscousDamping(DampingLaw):
    """A dashpot on the rate of approach of the flanks, shared like the stiffness.

    Flanks do not pull.
    """

    model: Literal["viscous"] = "viscous"
    """a dashpot on the rate of approach of touching flanks. Source: L16 Eq. 6, W23 Eq.
    36"""

    def build(self, meshes: MeshesInOperation) -> None:
        """Return nothing: the steps have this law built in."""
        return None
