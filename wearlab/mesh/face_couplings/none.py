"""Slices along the face that yield each for itself."""

from typing import ClassVar, Literal

from wearlab.mesh.face_couplings import FaceCouplingModel


class NoFaceCoupling(FaceCouplingModel):
    """Slices that yield each for itself."""

    of_contact: ClassVar[bool] = False
    model_error: ClassVar[str] = (
        "slices apart: too soft at the ends of the face, by 2 to 44 % under a tilted "
        "load and 30 to 160 % "
        "under one on the last eighth, most on faces of 5 modules"
    )

    model: Literal["none"] = "none"
    """slices apart. Source: wearlab"""
