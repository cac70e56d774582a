"""``[lubricant]``: the oil at the temperature of the contact, by its values, its grade or its datasheet."""

import re
from typing import Annotated, ClassVar, Literal

from pydantic import BeforeValidator, model_validator

from wearlab.options import (
    POSITIVE,
    Alternatives,
    Density,
    KinematicViscosity,
    Number,
    Part,
    PressureViscosity,
    Temperature,
    Viscosity,
    option,
)
from wearlab.shop import oil

GRADE = re.compile(r"(?:ISO\s*)?(?:VG\s*)?(\d+)", re.IGNORECASE)
RANGE = (263.15, 423.15)  # K, where ASTM D341 is drawn


def _grade(value: object) -> object:
    """Read ``"ISO VG 220"`` as 220."""
    grade = GRADE.fullmatch(value.strip()) if isinstance(value, str) else None
    number = int(grade[1]) if grade else value
    if isinstance(number, int) and not isinstance(number, bool) and number in oil.GRADES:
        return number
    raise ValueError(
        f"{value!r} is no grade of ISO 3448: write 'ISO VG 220'; there are {', '.join(map(str, oil.GRADES))}"
    )


Grade = Annotated[
    int, BeforeValidator(_grade, json_schema_input_type=Annotated[str, "such as 'ISO VG 220'"] | int)
]


class Lubricant(Part):
    """Viscosity and its growth with pressure: given, or those of an ISO VG grade or datasheet when warm."""

    alternatives: ClassVar[Alternatives] = (
        (("viscosity",), ("grade", "viscosity_index"), ("kinematic_viscosity_40", "kinematic_viscosity_100")),
    )

    viscosity: Annotated[Viscosity, POSITIVE] | None = option(
        None,
        "dynamic viscosity η0 at ambient pressure, where the flanks touch",
        derived="from grade or datasheet at the temperature (ASTM D341)",
        source="Dowson & Higginson 1966",
    )
    pressure_viscosity: Annotated[PressureViscosity, POSITIVE] | None = option(
        None,
        "pressure-viscosity coefficient α",
        derived="estimated from the viscosity, k η^s",
        source="Dowson & Higginson 1966, W23 Eq. 41; estimate: AGMA 925-A03",
    )
    temperature: Annotated[Temperature, POSITIVE] | None = option(
        None, "temperature of the oil where the flanks touch, such as '60 degC'", derived="not known"
    )
    grade: Grade | None = option(
        None, "viscosity grade, such as 'ISO VG 220'", derived="none", source="ISO 3448", identity=False
    )
    viscosity_index: Annotated[Number, POSITIVE] | None = option(
        None, "viscosity index of a grade", derived="95", source="ISO 2909, ASTM D2270", identity=False
    )
    kinematic_viscosity_40: Annotated[KinematicViscosity, POSITIVE] | None = option(
        None, "datasheet: kinematic viscosity at 40 °C", derived="none", source="ASTM D341", identity=False
    )
    kinematic_viscosity_100: Annotated[KinematicViscosity, POSITIVE] | None = option(
        None, "datasheet: kinematic viscosity at 100 °C", derived="none", source="ASTM D341", identity=False
    )
    density: Annotated[Density, POSITIVE] | None = option(
        None,
        "density of a grade or datasheet at 15 °C",
        derived="43.37 lg ν₄₀ + 805.5 kg/m³",
        source="ISO/TR 15144-1",
        identity=False,
    )
    base: Literal["mineral", "pao"] = option(
        "mineral", "base oil, for α", source="AGMA 925-A03", identity=False
    )

    @model_validator(mode="after")
    def _at_the_temperature(self) -> "Lubricant":
        """Fill in viscosity and α of a grade or datasheet."""
        words = self._words()
        if words is None:
            if self.viscosity is None or self.pressure_viscosity is None:
                raise ValueError(
                    "give viscosity and pressure_viscosity; or grade and temperature, such as 'ISO VG 220' "
                    "and '60 degC'; or kinematic_viscosity_40, kinematic_viscosity_100 and temperature"
                )
            return self
        if self.temperature is None or not RANGE[0] <= self.temperature <= RANGE[1]:
            raise ValueError("a grade or datasheet needs temperature, such as '60 degC' (-10 to 150 degC)")
        properties = {
            "viscosity": oil.dynamic_viscosity(words, self.temperature),
            "pressure_viscosity": self.pressure_viscosity or oil.pressure_viscosity(words, self.temperature),
        }
        self.__dict__.update(properties)  # frozen from here on
        return self

    def _words(self) -> oil.Oil | None:
        try:
            if self.grade is not None:
                index = self.viscosity_index or oil.USUAL_INDEX
                return oil.of_grade(self.grade, index, self.density, self.base)
            if self.kinematic_viscosity_40 and self.kinematic_viscosity_100:
                if self.kinematic_viscosity_100 >= self.kinematic_viscosity_40:
                    raise ValueError("the viscosity at 100 degC must be below that at 40 degC")
                pair = self.kinematic_viscosity_40, self.kinematic_viscosity_100
                return oil.of_datasheet(*pair, self.density, self.base)
        except ValueError as error:
            raise ValueError(str(error)) from None
        if self.kinematic_viscosity_40 or self.kinematic_viscosity_100:
            raise ValueError("a datasheet gives both kinematic_viscosity_40 and kinematic_viscosity_100")
        return None

    @property
    def told(self) -> tuple[str, ...]:
        """What was taken from a grade or datasheet, and what of it is an estimate."""
        words = self._words()
        if words is None or self.temperature is None or self.viscosity is None:
            return ()
        degrees = self.temperature - oil.KELVIN
        name = f"ISO VG {self.grade}" if self.grade else "datasheet"
        lines = [f"oil: {name} at {degrees:.4g} °C: η0 = {1e3 * self.viscosity:.4g} mPa·s (ASTM D341)"]
        if "pressure_viscosity" not in self.model_fields_set and self.pressure_viscosity:
            value = f"{1e9 * self.pressure_viscosity:.3g} 1/GPa"
            lines.append(f"oil: pressure-viscosity coefficient {value} estimated (AGMA 925-A03, {self.base})")
        if self.grade and self.viscosity_index is None:
            lines.append("oil: viscosity index 95 assumed")
        if self.density is None:
            lines.append(f"oil: density {words.density_15:.0f} kg/m³ at 15 °C estimated (ISO/TR 15144-1)")
        return tuple(lines)
