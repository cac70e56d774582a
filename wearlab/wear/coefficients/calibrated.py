"""A wear coefficient found from one life of the same gears."""

from typing import Annotated, ClassVar, Literal, NamedTuple

from wearlab import options
from wearlab.wear.coefficients import CoefficientModel, same_everywhere
from wearlab.wear.setting import PowerOfLoad, Setting

UNCALIBRATED = 1e-16
"""Stands in for a wear coefficient that is still to be calibrated: lives tell its scale
[m²/N]."""


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

    model_error: ClassVar[str] = (
        "from one life; right at that torque and speed, predicted elsewhere"
    )

    model: Literal["calibrated"]
    """the constant that reproduces one life; all other lives are predicted with it.
    Source: W23"""
    life: Annotated[options.Number, options.POSITIVE]
    """life, in cycles. Source: W23 Fig. 12: 1.637e7"""
    depth: Annotated[options.Depth, options.POSITIVE]
    """wear depth that ends it. Source: W23: 400 µm"""
    flank: str
    """flank on which it is reached. Source: W23: sun"""
    torque: Annotated[options.Torque, options.POSITIVE]
    """torque on the input member during that life"""
    speed: Annotated[options.Speed, options.POSITIVE]
    """speed of the input member during that life"""

    def build(self, setting: Setting) -> PowerOfLoad:
        """Return the coefficient that lives tell the scale of [m²/N]."""
        return same_everywhere(UNCALIBRATED, setting)
