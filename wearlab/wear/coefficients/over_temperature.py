"""A wear coefficient over the temperature of the flank."""

from typing import Annotated, ClassVar, Literal

from wearlab import options
from wearlab.materials import over_temperature
from wearlab.wear.coefficients import CoefficientModel, same_everywhere
from wearlab.wear.setting import PowerOfLoad, Setting


class OverTemperatureCoefficient(CoefficientModel):
    """A table over the flank's temperature, straight between, unknown beyond."""

    needs: ClassVar[tuple[str, ...]] = ("flank_temperature",)

    model: Literal["over-temperature"]
    """table over the temperature of the flank that [thermal] finds. Source: VDI 2736-2
    """
    temperature: tuple[options.Temperature, ...]
    """temperatures, ascending, such as ["20 degC", "60 degC"]"""
    value: tuple[Annotated[options.WearCoefficient, options.NOT_NEGATIVE], ...]
    """wear coefficient at each of them, such as ["1e-6 mm^3/Nm", "2e-6 mm^3/Nm"]"""

    def _check(self) -> None:
        over_temperature.check_table(self.temperature, self.value)

    @property
    def curve(self) -> over_temperature.TemperatureCurve:
        """The coefficient over the flank's temperature [m²/N]."""
        return over_temperature.TemperatureCurve(self.temperature, self.value)

    def build(self, setting: Setting) -> PowerOfLoad:
        """Return k at the flank's temperature, everywhere [m²/N]."""
        assert setting.flank_temperature is not None  # a rule of the scene
        return same_everywhere(self.curve.at(setting.flank_temperature), setting)
