"""Contact patch and path of contact of flanks with a width, slice by slice."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.mesh.face.contact import FaceContact
from wearlab.wear.patch import PatchSetting
from wearlab.wear.path import WearPath, contact_half_width


@dataclass(frozen=True)
class FacePatchSetting(PatchSetting):
    """What a contact patch may know of flanks with a width: forces and law by slice.

    Parameters
    ----------
    face : contact over the face
    """

    face: FaceContact

    @cached_property
    def line_load(self) -> Array:
        """Static load per width of unworn flanks at each node, (n_face, n) [N/m]."""
        return self.face.grid.at_nodes(self.face.unworn.load)

    @cached_property
    def static(self) -> Array:
        """That load as a force on the whole face, (n_face n,) [N]."""
        return self.line_load.ravel() * self.path.face_width

    @cached_property
    def half_width(self) -> Array:
        """Hertz's half width of every slice, (n_face, n) [m]."""
        return contact_half_width(
            self.reference.reshape(self.line_load.shape), self.path
        )


def repeated(path: WearPath, slices: int) -> WearPath:
    """Return the path of a section as that of all slices, one after another.

    Parameters
    ----------
    path : of the transverse section
    slices : how many there are
    """
    along = (
        "curvature",
        "surface_velocity",
        "specific_sliding",
        "arc_weight",
        "arc",
        "pressure_angle",
    )
    wide: dict[str, Any] = {
        name: np.tile(getattr(path, name), (1, slices)) for name in along
    }
    return path._replace(
        equivalent_radius=np.tile(path.equivalent_radius, slices), **wide
    )
