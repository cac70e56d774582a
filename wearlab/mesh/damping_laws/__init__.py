"""``mesh.damping_law``: how a mesh loses energy, in contact and out of it.

A file beside this one adds another.
"""

from collections.abc import Iterator
from typing import Any, ClassVar, NamedTuple

from wearlab.arrays import Array
from wearlab.slots import Slot, Variant


class MeshesInOperation(NamedTuple):
    """The data of the meshes from which a damping law is made.

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
    """Whether it needs the viscosity of an oil."""
    acts_in_separation: ClassVar[bool] = False
    """Whether ``mesh.damping_in = "always"`` may let it act in separation, too."""

    def build(self, meshes: MeshesInOperation) -> Any:
        """Return the law as kernels take it, see `wearlab.mesh.damping`; None: viscous.

        Parameters
        ----------
        meshes : data of the meshes

        Raises
        ------
        GearError
            When the meshes lack what the law needs.
        """
        raise NotImplementedError(f"{type(self).__name__} has no build")

    def problems(self, scene: Any) -> Iterator[str]:
        """Yield messages about what the other sections of a scene lack for this law.

        Parameters
        ----------
        scene : the scene, read
        """
        return iter(())
