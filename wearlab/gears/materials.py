"""Elastic materials of gears."""

from typing import Literal, NamedTuple

from wearlab.gears.errors import GearError

Plane = Literal["strain", "stress"]


class Material(NamedTuple):
    """An isotropic, linearly elastic material.

    Parameters
    ----------
    youngs_modulus : Young's modulus E [Pa]
    poisson_ratio : Poisson's ratio ν [1]
    density : density [kg/m³]
    """

    youngs_modulus: float
    poisson_ratio: float
    density: float

    @property
    def shear_modulus(self) -> float:
        """Shear modulus, G = E / (2 (1 + ν)) [Pa]."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def plane_strain_modulus(self) -> float:
        """Plane-strain modulus, E / (1 − ν²) [Pa]."""
        return self.youngs_modulus / (1.0 - self.poisson_ratio**2)

    def in_plane(self, plane: Plane) -> "Material":
        """Return the material that in plane stress is what this one is in a plane state.

        In plane strain that of the same G with ``E/(1 − ν²)`` and ``ν/(1 − ν)``.
        """
        if plane == "stress":
            return self
        nu = self.poisson_ratio
        return self._replace(youngs_modulus=self.plane_strain_modulus, poisson_ratio=nu / (1.0 - nu))


STEEL = Material(youngs_modulus=206e9, poisson_ratio=0.3, density=7830.0)


def check_material(material: Material, name: str) -> None:
    """Refuse a material without stiffness, or with a Poisson's ratio outside 0 … 0.5.

    Raises
    ------
    GearError : the material cannot exist
    """
    E, nu, rho = material
    if not (E > 0.0 and 0.0 <= nu < 0.5 and rho > 0.0):
        raise GearError(
            f"{name}: a material needs youngs_modulus > 0, 0 <= poisson_ratio < 0.5 and density > 0, "
            f"not {E:g} Pa, {nu:g} and {rho:g} kg/m³"
        )
