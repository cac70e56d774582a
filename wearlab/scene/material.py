"""The material of a gear: its constants, or a name of the catalogue."""

from typing import Annotated, Literal

from annotated_types import Lt
from pydantic import BeforeValidator

from wearlab.nearest import meant
from wearlab.options import (
    NOT_NEGATIVE,
    POSITIVE,
    Density,
    Hardness,
    Number,
    Part,
    Pressure,
    Stored,
    option,
)
from wearlab.shop.materials import ALIASES, MATERIALS, known

CONSTANTS = ("youngs_modulus", "poisson_ratio", "density", "hardness")


class MaterialOptions(Part):
    """An isotropic elastic material; a name of the catalogue gives all of it, and options beside it win."""

    youngs_modulus: Annotated[Pressure, POSITIVE] = option(..., "Young's modulus E")
    poisson_ratio: Annotated[Number, NOT_NEGATIVE, Lt(0.5)] = option(..., "Poisson's ratio ν")
    density: Annotated[Density, POSITIVE] = option(..., "density ρ")
    hardness: Annotated[Hardness, POSITIVE] | None = option(
        None,
        "hardness of the flanks, such as '60 HRC', '300 HV', '200 HB' or '7 GPa'",
        derived="what is usual for a named material, for wear laws that ask for it",
        source="HRC by ASTM E140, HB by ISO 18265",
    )
    name: str | None = option(
        None,
        "a material of the catalogue, such as '18CrNiMo7-6' or 'POM'",
        derived="none",
        source="wearlab.shop.materials",
        identity=False,
    )

    @property
    def told(self) -> tuple[str, ...]:
        """What the catalogue says, and what of it is assumed."""
        if self.name is None or self.name == "steel":
            return ()
        entry = MATERIALS[self.name]
        lines = [f"{self.name}: constants of {entry.source}"]
        if entry.hardness is not None and self.hardness == entry.hardness:
            lines.append(f"{self.name}: hardness {entry.treatment}, assumed")
        if entry.hardness is None:
            lines.append(f"{self.name}: constants hold {entry.treatment}")
        return tuple(lines)


def _material(value: object) -> object:
    """Read a name of the catalogue, alone or beside options that differ from it."""
    name = value if isinstance(value, str) else value.get("name") if isinstance(value, dict) else None
    if name is None:
        return value
    material = known(name) if isinstance(name, str) else None
    if material is None:
        raise ValueError(f"{not_a_name(name)}; or give youngs_modulus, poisson_ratio and density")
    entry = MATERIALS[material]
    own = {key: Stored(constant) for key, constant in zip(CONSTANTS, entry[:4], strict=True) if constant}
    beside = {k: v for k, v in value.items() if k != "name"} if isinstance(value, dict) else {}
    return {**own, "name": material, **beside}


def not_a_name(name: object) -> str:
    """Return that a name is not in the catalogue, and the nearest that is."""
    near = meant(str(name), [*MATERIALS, *ALIASES], ";")
    return f"{name!r} is not a known material{near} there are {', '.join(MATERIALS)}"


NamedMaterial = Annotated[
    MaterialOptions,
    BeforeValidator(_material, json_schema_input_type=Literal[tuple(MATERIALS)] | MaterialOptions),
]


STEEL = MaterialOptions(youngs_modulus=Stored(206e9), poisson_ratio=Stored(0.3), density=Stored(7830.0))
