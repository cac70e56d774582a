"""``[thermal]``: how warm friction makes the teeth of plastic gears.

A file beside this one adds another.
"""

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from annotated_types import Le
from pydantic import BeforeValidator, Discriminator, Tag

from wearlab import options
from wearlab.materials import over_temperature
from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair

INSULANCE = {"open": 0.0, "partly-open": 0.030, "closed": 0.060}
"""R_λG of housings; partly open ones have 0.015 to 0.045 [K m²/W]."""
ON_METAL = {"flank": 6300.0, "root": 895.0}
ON_PLASTIC = {"flank": 9000.0, "root": 2148.0}
"""VDI 2736's k_ϑ of a plastic gear by the material of its mate."""


class HeatTransfer(options.Part):
    """How badly the teeth of one gear give off heat."""

    flank: Annotated[options.Number, options.NOT_NEGATIVE]
    """k_ϑ of the flank, in K (m/s)^0.75 mm^1.75/W. Source: VDI 2736-2"""
    root: Annotated[options.Number, options.NOT_NEGATIVE]
    """k_ϑ of the root, in K (m/s)^0.75 mm^1.75/W. Source: VDI 2736-2"""


class HeatTransfers(options.Part):
    """Heat transfer of the gears that warm up."""

    pinion: HeatTransfer | None = None
    """of the pinion [by the pair of materials; a metal stays as cold as the
    surroundings]"""
    gear: HeatTransfer | None = None
    """of the wheel [by the pair of materials; a metal stays as cold as the
    surroundings]"""


class Housing(options.Part):
    """The walls that the heat passes."""

    alternatives = ((("model",), ("resistance",)),)

    model: Literal["open", "partly-open", "closed"] | None = None
    """how open it is [by resistance]. Source: VDI 2736-2"""
    resistance: Annotated[options.ThermalInsulance, options.NOT_NEGATIVE] | None = None
    """R_λG, such as '0.06 K*m^2/W' [0 open, 0.03 partly open, 0.06 closed]. Source: VDI
    2736-2"""
    area: Annotated[options.Area, options.POSITIVE] | None = None
    """surface A_G that gives off the heat [required unless open]"""

    def _check(self) -> None:
        if self.model is None and self.resistance is None:
            raise ValueError(
                "give 'open', or resistance and area, such as { resistance = '0.06 "
                "K*m^2/W', area = '0.01 m^2' }"
            )
        if self.insulance > 0.0 and self.area is None:
            kind = self.model or "a resistance"
            raise ValueError(
                f"{kind} needs the area that gives off heat, such as "
                "{ model = 'closed', area = '0.01 m^2' }"
            )

    @property
    def insulance(self) -> float:
        """R_λG [K m²/W]."""
        if self.model is None:
            return self.resistance or 0.0
        return INSULANCE[self.model]

    @property
    def thermal_resistance(self) -> float:
        """R_λG/A_G [K/W]."""
        return 0.0 if self.area is None else self.insulance / self.area


class FrictionTable(options.Part):
    """Coefficient of friction over the temperature of the warmer flank."""

    temperature: tuple[options.Temperature, ...]
    """temperatures, ascending"""
    value: tuple[Annotated[options.Number, options.NOT_NEGATIVE, Le(1.0)], ...]
    """coefficient of friction at each of them"""

    def _check(self) -> None:
        over_temperature.check_table(self.temperature, self.value)


def _table_or_number(value: Any) -> str:
    """Return the tag of a friction: "table" over temperature, else "number"."""
    return "table" if isinstance(value, dict | FrictionTable) else "number"


def _housing(value: Any) -> Any:
    """Read the name of a housing as its table."""
    return {"model": value} if isinstance(value, str) else value


OneFriction = Annotated[options.Number, options.NOT_NEGATIVE, Le(1.0)]
Friction = Annotated[
    Annotated[OneFriction, Tag("number")] | Annotated[FrictionTable, Tag("table")],
    Discriminator(_table_or_number),
]


class ThermalModel(Variant):
    """Any model of how warm teeth become."""

    slot: ClassVar[Slot] = Slot("thermal", __name__, default="computed-loss")
    model_error: ClassVar[str] = ""
    """How far its temperatures are known to be off."""

    ambient: options.Temperature
    """temperature of the surroundings, from which teeth warm up"""
    friction: Friction
    """coefficient of friction of the flanks, or {temperature, value} over the
    temperature of the warmer flank; dry: POM on POM 0.28, PA66 on PA66 0.40, steel on
    plastic 0.20. Source: VDI 2736-2, second-hand"""
    relative_duty: Annotated[options.Number, options.POSITIVE, Le(1.0)] = 1.0
    """share of the time under load, ED; with operation.duty its rows tell. Source: VDI
    2736-2"""
    housing: Annotated[
        Housing,
        BeforeValidator(
            _housing,
            json_schema_input_type=Literal["open", "partly-open", "closed"] | Housing,
        ),
    ] = Housing(model="open")
    """walls that the heat passes: open, partly-open, closed, or {resistance, area}; all
    but open need the area. Source: VDI 2736-2"""
    heat_transfer: HeatTransfers = HeatTransfers()
    """heat transfer of the teeth [by the pair of materials, flagged]. Source: VDI
    2736-2"""
    duty_temperature: Literal["mean", "own"] = "mean"
    """temperature of the conditions of operation.duty: one, by their mean loss over
    time, for conditions that change within minutes; or of each its own"""

    @property
    def friction_curve(self) -> over_temperature.TemperatureCurve:
        """Coefficient of friction over the temperature of the warmer flank [1]."""
        if isinstance(self.friction, FrictionTable):
            table = self.friction
            return over_temperature.TemperatureCurve(table.temperature, table.value)
        return over_temperature.held(self.friction)

    def fixed_loss_factor(self, pair: "GearPair") -> float | None:
        """Return the degree of tooth loss H_V of all wear states [1].

        None: each wear state has that of its forces.

        Parameters
        ----------
        pair : the gears in their operating position
        """
        return None
