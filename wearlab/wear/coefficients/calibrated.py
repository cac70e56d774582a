"""The constant with which these gears have one given life; found by a run of that life alone."""

from typing import Annotated, ClassVar, Literal, NamedTuple

from wearlab.options import POSITIVE, Depth, Number, Speed, Torque, option
from wearlab.wear.coefficients import CoefficientModel
from wearlab.wear.coefficients.constant import same_everywhere
from wearlab.wear.setting import PowerOfLoad, Setting

UNCALIBRATED = 1e-16
"""Stands in for a wear coefficient that is still to be calibrated: lives tell its scale [m²/N]."""


class CalibrationLife(NamedTuple):
    """The life of the run that a coefficient is calibrated by.

    Parameters
    ----------
    run : its identity
    cycles : its life with the coefficient `UNCALIBRATED`
    error : estimated error of it, in cycles
    end_reason : what ended it
    """

    run: str
    cycles: float
    error: float
    end_reason: str


class CalibratedCoefficient(CoefficientModel):
    """The constant with which these gears have one given life, from unworn flanks."""

    departure: ClassVar[str] = "from one life; right at that torque and speed, predicted elsewhere"

    model: Literal["calibrated"] = option(
        ..., "the constant that reproduces one life; all other lives are predicted with it", source="W23"
    )
    life: Annotated[Number, POSITIVE] = option(..., "life, in cycles", source="W23 Fig. 12: 1.637e7")
    depth: Annotated[Depth, POSITIVE] = option(..., "wear depth that ends it", source="W23: 400 µm")
    flank: str = option(..., "flank on which it is reached", source="W23: sun")
    torque: Annotated[Torque, POSITIVE] = option(..., "torque on the input member during that life")
    speed: Annotated[Speed, POSITIVE] = option(..., "speed of the input member during that life")

    def build(self, setting: Setting) -> PowerOfLoad:
        """Return the coefficient that lives tell the scale of [m²/N]."""
        return same_everywhere(UNCALIBRATED, setting)
