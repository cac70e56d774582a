"""An oil film between flanks that are apart: it brakes them before they strike."""

from collections.abc import Iterator
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.specification import GearError
from wearlab.mesh.damping_laws import DampingLaw, MeshesInOperation


class SqueezeFilm(NamedTuple):
    """Viscous where flanks touch; a film of ``h_c + clearance`` where they are apart.

    Parameters
    ----------
    film : (n_mesh,) β = 3√2 π η b R^{3/2} [N s √m]
    thickness : (n_mesh,) h_c = (β/c)^{2/3}, the film that damps as touching flanks do
        [m]
    """

    film: Array
    thickness: Array


def in_contact(
    law: Any, m: Any, force: float, stiffness: float, part: float, rate: float
) -> Any:
    """Return ``F + c ẋ`` and its derivatives, 0 where that pulls.

    Parameters and returns are those of `wearlab.mesh.damping.register`.
    """
    normal = force + part * rate
    if normal <= 0.0:
        return 0.0, 0.0, 0.0
    return normal, stiffness, part


def out_of_contact(
    law: Any, m: Any, clearance: float, rate: float
) -> tuple[float, float, float]:
    """Return ``β ẋ/(h_c + clearance)^{3/2}`` and its derivatives.

    Flanks that part pull nothing: the film cavitates. Parameters and returns are those
    of `wearlab.mesh.damping.register`.
    """
    if rate <= 0.0:
        return 0.0, 0.0, 0.0
    height = law.thickness[m] + clearance
    damping = law.film[m] / (height * np.sqrt(height))
    return damping * rate, 1.5 * damping * rate / height, damping


class SqueezeFilmDamping(DampingLaw):
    """The viscous law in contact; elsewhere approaching flanks squeeze an oil film."""

    needs_oil: ClassVar[bool] = True

    model: Literal["squeeze-film"] = "squeeze-film"
    """viscous in contact; flanks that are apart squeeze the oil between them. Source:
    Hamrock, Schmid & Jacobson 2004; Ankouni et al. 2016"""

    def problems(self, scene: Any) -> Iterator[str]:
        """Yield a message when the scene has no oil."""
        if scene.lubricant is None:
            yield (
                "'squeeze-film' needs an oil: give [lubricant], such as viscosity = "
                '"0.012 Pa*s"'
            )

    def build(self, meshes: MeshesInOperation) -> SqueezeFilm:
        """Return the law.

        Raises
        ------
        GearError
            When flanks that touch are not damped, so that no film damps as they do.
        """
        from wearlab.mesh.damping import register

        register(SqueezeFilm, in_contact, out_of_contact)
        if not meshes.damping.all():
            raise GearError(
                "mesh.damping_law: 'squeeze-film' needs mesh.damping above nought"
            )
        assert meshes.viscosity is not None

        # a rigid cylinder approaches a plane through a viscous fluid:
        # W/(η L V) = 3√2 π (R/h)^{3/2}
        film = (
            3.0
            * np.pi
            * np.sqrt(2.0 * meshes.curvature_radius**3)
            * meshes.viscosity
            * meshes.face_width
        )
        thickness = (film / meshes.damping) ** (2.0 / 3.0)
        return SqueezeFilm(film, thickness)
