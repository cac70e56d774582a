"""Materials of gears and ``[lubricant]``: constants, or names of the catalogues."""

import re
from typing import Annotated, Any, Literal

from annotated_types import Lt
from pydantic import (
    BeforeValidator,
    Discriminator,
    PrivateAttr,
    Tag,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)

from wearlab import nearest, options
from wearlab.materials import grades, oil, over_temperature

CONSTANTS = ("youngs_modulus", "poisson_ratio", "density", "hardness")
PLASTIC = 20e9
"""Young's modulus below which a material is a plastic: that of magnesium, the softest
metal of gears, is 45 GPa [Pa]."""
EXPANSION_OF_PLASTICS, EXPANSION_OF_METALS = 1.2e-4, 1.2e-5
"""Thermal expansion of a material that states none [1/K]."""


class ModulusTable(options.Part):
    """Young's modulus over temperature, straight between the rows, unknown beyond."""

    temperature: tuple[options.Temperature, ...]
    """temperatures, ascending, such as ["20 degC", "60 degC", "100 degC"]"""
    value: tuple[Annotated[options.Pressure, options.POSITIVE], ...]
    """Young's modulus at each of them, such as ["2.9 GPa", "1.9 GPa", "1.1 GPa"]; of
    plastics the one at the frequency of the mesh (DMA)"""

    def _check(self) -> None:
        over_temperature.check_table(self.temperature, self.value)


def _table_or_value(value: Any) -> str:
    """Return the tag of a modulus: "table" over temperature, else "value"."""
    return "table" if isinstance(value, dict | ModulusTable) else "value"


OneModulus = Annotated[options.Pressure, options.POSITIVE]
Modulus = Annotated[
    Annotated[OneModulus, Tag("value")] | Annotated[ModulusTable, Tag("table")],
    Discriminator(_table_or_value),
]


class MaterialOptions(options.Part):
    """An isotropic elastic material.

    A name of the catalogue gives all of it, and options beside it win.
    """

    youngs_modulus: Modulus
    """Young's modulus E; over temperature, for [thermal], {temperature, value}"""
    poisson_ratio: Annotated[options.Number, options.NOT_NEGATIVE, Lt(0.5)]
    """Poisson's ratio ν"""
    density: Annotated[options.Density, options.POSITIVE]
    """density ρ"""
    hardness: Annotated[options.Hardness, options.POSITIVE] | None = None
    """hardness of the flanks, such as '60 HRC', '300 HV', '200 HB' or '7 GPa' [what is
    usual for a named material, for wear laws that ask for it]. Source: HRC by ASTM
    E140, HB by ISO 18265"""
    service_temperature: options.Temperature | None = None
    """highest temperature that it may have in service, for [thermal] [the highest of
    its tables]"""
    thermal_expansion: options.ThermalExpansion | None = None
    """coefficient of linear thermal expansion, for [thermal] [1.2e-4 1/K of plastics,
    1.2e-5 1/K of metals]"""
    name: str | None = options.option(None, identity=False)
    """a material of the catalogue, such as '18CrNiMo7-6' or 'POM'. Source:
    wearlab.materials.grades"""
    _modulus_of_catalogue: bool = PrivateAttr(default=False)

    @property
    def modulus_of_catalogue(self) -> bool:
        """Whether Young's modulus is the catalogue's, not one that the file states."""
        return self._modulus_of_catalogue

    @property
    def modulus(self) -> over_temperature.TemperatureCurve:
        """Young's modulus over temperature [Pa]."""
        stated = self.youngs_modulus
        if isinstance(stated, ModulusTable):
            return over_temperature.TemperatureCurve(stated.temperature, stated.value)
        return over_temperature.held(stated)

    @property
    def cold_modulus(self) -> float:
        """Young's modulus, over temperature that at the lowest of its table [Pa]."""
        return self.modulus.value[0]

    @property
    def is_plastic(self) -> bool:
        """Whether it is a plastic, by its modulus."""
        return self.cold_modulus < PLASTIC

    @property
    def softens(self) -> bool:
        """Whether its modulus is given over temperature."""
        return isinstance(self.youngs_modulus, ModulusTable)

    @property
    def expansion(self) -> float:
        """Coefficient of thermal expansion, as stated or as usual [1/K]."""
        if self.thermal_expansion is not None:
            return self.thermal_expansion
        return EXPANSION_OF_PLASTICS if self.is_plastic else EXPANSION_OF_METALS

    @property
    def sources(self) -> tuple[str, ...]:
        """What the catalogue says, and what of it is assumed."""
        if self.name is None or self.name == "steel":
            return ()
        entry = grades.MATERIALS[self.name]
        lines = [f"{self.name}: constants of {entry.source}"]
        if entry.hardness is not None and self.hardness == entry.hardness:
            lines.append(f"{self.name}: hardness {entry.treatment}, assumed")
        if entry.hardness is None:
            lines.append(f"{self.name}: constants hold {entry.treatment}")
        return tuple(lines)


def _material(value: object, read: ValidatorFunctionWrapHandler) -> MaterialOptions:
    """Read a material, and mark it where its modulus is the catalogue's."""
    material: MaterialOptions = read(_with_constants(value))
    stated = value if isinstance(value, dict) else {}
    if isinstance(value, str) or ("name" in stated and "youngs_modulus" not in stated):
        material._modulus_of_catalogue = True
    return material


def _with_constants(value: object) -> object:
    """Read a name of the catalogue, alone or beside options that differ from it."""
    name = (
        value
        if isinstance(value, str)
        else value.get("name")
        if isinstance(value, dict)
        else None
    )
    if name is None:
        return value
    material = grades.catalogue_name(name) if isinstance(name, str) else None
    if material is None:
        near = nearest.meant(str(name), [*grades.MATERIALS, *grades.ALIASES], ";")
        choices = f"{near} there are {', '.join(grades.MATERIALS)}"
        remedy = "or give youngs_modulus, poisson_ratio and density"
        raise ValueError(f"{name!r} is not a known material{choices}; {remedy}")
    entry = grades.MATERIALS[material]
    constants = {
        key: options.Stored(value)
        for key, value in zip(CONSTANTS, entry[:4], strict=True)
        if value
    }
    beside = (
        {k: v for k, v in value.items() if k != "name"}
        if isinstance(value, dict)
        else {}
    )
    return {**constants, "name": material, **beside}


NamedMaterial = Annotated[
    MaterialOptions,
    WrapValidator(
        _material,
        json_schema_input_type=Literal[tuple(grades.MATERIALS)] | MaterialOptions,
    ),
]


STEEL = MaterialOptions(
    youngs_modulus=options.Stored(206e9),
    poisson_ratio=options.Stored(0.3),
    density=options.Stored(7830.0),
)


GRADE = re.compile(r"(?:ISO\s*)?(?:VG\s*)?(\d+)", re.IGNORECASE)
RANGE = (263.15, 423.15)  # K, where ASTM D341 is drawn


def _grade(value: object) -> object:
    """Read ``"ISO VG 220"`` as 220."""
    grade = GRADE.fullmatch(value.strip()) if isinstance(value, str) else None
    number = int(grade[1]) if grade else value
    if (
        isinstance(number, int)
        and not isinstance(number, bool)
        and number in oil.GRADES
    ):
        return number
    raise ValueError(
        f"{value!r} is no grade of ISO 3448: write 'ISO VG 220'; there are "
        f"{', '.join(map(str, oil.GRADES))}"
    )


Grade = Annotated[
    int,
    BeforeValidator(
        _grade, json_schema_input_type=Annotated[str, "such as 'ISO VG 220'"] | int
    ),
]


class Lubricant(options.Part):
    """Viscosity and its growth with pressure: given, or of a grade at a temperature."""

    alternatives = (
        (
            ("viscosity",),
            ("grade", "viscosity_index"),
            ("kinematic_viscosity_40", "kinematic_viscosity_100"),
        ),
    )

    viscosity: Annotated[options.Viscosity, options.POSITIVE] | None = None
    """dynamic viscosity η0 at ambient pressure, where the flanks touch [from grade or
    datasheet at the temperature (ASTM D341)]. Source: Dowson & Higginson 1966"""
    pressure_viscosity: (
        Annotated[options.PressureViscosity, options.POSITIVE] | None
    ) = None
    """pressure-viscosity coefficient α [estimated from the viscosity, k η^s]. Source:
    Dowson & Higginson 1966, W23 Eq. 41; estimate: AGMA 925-A03"""
    temperature: Annotated[options.Temperature, options.POSITIVE] | None = None
    """temperature of the oil where the flanks touch, such as '60 degC' [not known]"""
    grade: Grade | None = options.option(None, identity=False)
    """viscosity grade, such as 'ISO VG 220'. Source: ISO 3448"""
    viscosity_index: Annotated[options.Number, options.POSITIVE] | None = (
        options.option(None, identity=False)
    )
    """viscosity index of a grade [95]. Source: ISO 2909, ASTM D2270"""
    kinematic_viscosity_40: (
        Annotated[options.KinematicViscosity, options.POSITIVE] | None
    ) = options.option(None, identity=False)
    """datasheet: kinematic viscosity at 40 °C. Source: ASTM D341"""
    kinematic_viscosity_100: (
        Annotated[options.KinematicViscosity, options.POSITIVE] | None
    ) = options.option(None, identity=False)
    """datasheet: kinematic viscosity at 100 °C. Source: ASTM D341"""
    density: Annotated[options.Density, options.POSITIVE] | None = options.option(
        None, identity=False
    )
    """density of a grade or datasheet at 15 °C [43.37 lg ν₄₀ + 805.5 kg/m³]. Source:
    ISO/TR 15144-1"""
    base: Literal["mineral", "pao"] = options.option("mineral", identity=False)
    """base oil, for α. Source: AGMA 925-A03"""

    def _check(self) -> None:
        """Fill in viscosity and α of a grade or datasheet."""
        words = self._words()
        if words is None:
            if self.viscosity is None or self.pressure_viscosity is None:
                raise ValueError(
                    "give viscosity and pressure_viscosity; or grade and temperature, "
                    "such as 'ISO VG 220' "
                    "and '60 degC'; or kinematic_viscosity_40, "
                    "kinematic_viscosity_100 and temperature"
                )
            return
        if self.temperature is None or not RANGE[0] <= self.temperature <= RANGE[1]:
            raise ValueError(
                "a grade or datasheet needs temperature, such as '60 degC' (-10 to "
                "150 degC)"
            )
        viscosity = oil.dynamic_viscosity(words, self.temperature)
        alpha = self.pressure_viscosity or oil.pressure_viscosity(
            words, self.temperature
        )
        self.__dict__.update(
            viscosity=viscosity, pressure_viscosity=alpha
        )  # frozen from here on

    def _words(self) -> oil.Oil | None:
        """Return the oil of a grade or datasheet, None where its viscosity is given."""
        if self.grade is not None:
            return oil.of_grade(
                self.grade,
                self.viscosity_index or oil.USUAL_INDEX,
                self.density,
                self.base,
            )
        at_40 = self.kinematic_viscosity_40
        at_100 = self.kinematic_viscosity_100
        if not at_40 and not at_100:
            return None
        if not at_40 or not at_100:
            raise ValueError(
                "a datasheet gives both kinematic_viscosity_40 and "
                "kinematic_viscosity_100"
            )
        if at_100 >= at_40:
            raise ValueError("the viscosity at 100 degC must be below that at 40 degC")
        return oil.of_datasheet(at_40, at_100, self.density, self.base)

    @property
    def sources(self) -> tuple[str, ...]:
        """What was taken from a grade or datasheet, and what of it is an estimate."""
        words = self._words()
        if words is None or self.temperature is None or self.viscosity is None:
            return ()
        degrees = self.temperature - oil.KELVIN
        name = f"ISO VG {self.grade}" if self.grade else "datasheet"
        lines = [
            f"oil: {name} at {degrees:.4g} °C: η0 = {1e3 * self.viscosity:.4g} mPa·s "
            "(ASTM D341)"
        ]
        if (
            "pressure_viscosity" not in self.model_fields_set
            and self.pressure_viscosity
        ):
            value = f"{1e9 * self.pressure_viscosity:.3g} 1/GPa"
            lines.append(
                f"oil: pressure-viscosity coefficient {value} estimated (AGMA "
                f"925-A03, {self.base})"
            )
        if self.grade and self.viscosity_index is None:
            lines.append("oil: viscosity index 95 assumed")
        if self.density is None:
            lines.append(
                f"oil: density {words.density_15:.0f} kg/m³ at 15 °C estimated "
                "(ISO/TR 15144-1)"
            )
        return tuple(lines)
