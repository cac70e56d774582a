"""``[wear.coefficient]``: the wear coefficient k.

A file beside this one adds another.
"""

from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import BeforeValidator, Discriminator, Tag

from wearlab import options
from wearlab.arrays import Array
from wearlab.slots import Slot, Variant
from wearlab.wear.films import FilmModel
from wearlab.wear.path import WearPath
from wearlab.wear.setting import NEEDS, FlankState, PowerOfLoad, Setting

STANDARD_FILM = "dowson-higginson"


def _switch_or_model(value: Any) -> str:
    return "model" if isinstance(value, dict | FilmModel) else "switch"


def _model(value: Any) -> Any:
    """Read the name of a film model as its table.

    What names none is refused as no switch.
    """
    if (
        isinstance(value, dict)
        and set(value) == {"model"}
        and value["model"] not in FilmModel.slot.variants
    ):
        return value["model"]
    return (
        {"model": value}
        if isinstance(value, str) and value in FilmModel.slot.variants
        else value
    )


Chosen = Annotated[options.Switch, Tag("switch")] | Annotated[FilmModel, Tag("model")]
Film = Annotated[Chosen, Discriminator(_switch_or_model), BeforeValidator(_model)]


def standard_film() -> FilmModel:
    """Return the film of Dowson and Higginson."""
    return FilmModel.slot.variants[STANDARD_FILM].model_construct()  # type: ignore[return-value]


class CoefficientModel(Variant):
    """Any wear coefficient: its film, its scatter, and ``build``.

    ``needs`` names what the scene must say for it: ``lubricant``, ``roughness``,
    ``lambda_ratio`` (both), ``hardness`` of the flank, ``temperature`` of the oil.
    """

    slot: ClassVar[Slot] = Slot("wear.coefficient", __name__)
    per_member: ClassVar[bool] = True
    may_need: ClassVar[tuple[str, ...]] = NEEDS
    needs: ClassVar[tuple[str, ...]] = ()
    model_error: ClassVar[str] = (
        "usually known within a decade; depth and 1/life are proportional to it"
    )
    """How far it is known to be off."""

    film: Film = False
    """whether the oil film lowers the coefficient: by the model named, or by Dowson and
    Higginson's. Source: L16 after Ding & Kahraman 2007"""
    factor: Annotated[options.Number, options.NOT_NEGATIVE] = 1.0
    """factor on the coefficient, for scatter"""

    @property
    def film_model(self) -> "FilmModel | None":
        """The film model, None without film."""
        if isinstance(self.film, FilmModel):
            return self.film
        return standard_film() if self.film else None

    def build(self, setting: Setting) -> PowerOfLoad | Callable[[FlankState], Array]:
        """Return k along the path, without ``factor`` and film: a power of the load, or a function.

        Parameters
        ----------
        setting : the flank, its mate and the oil

        Returns
        -------
        PowerOfLoad, or a function of a `FlankState` that returns k at every node, (n,)
        [m²/N]
        """
        raise NotImplementedError(f"{type(self).__name__} has no build")


class ConstantCoefficient(CoefficientModel):
    """A given coefficient."""

    model: Literal["constant"]
    """constant coefficient. Source: Archard 1953"""
    value: Annotated[options.WearCoefficient, options.NOT_NEGATIVE]
    """k of Archard's law dh = k p ds: volume worn per force and sliding distance, 1
    mm^3/(N*m) = 1e-9 m^2/N; what catalogues and tribometers print in mm^3/(N*m) is this
    k. Source: L16 Eq. 19"""

    def build(self, setting: Setting) -> PowerOfLoad:
        """Return k everywhere [m²/N]."""
        return same_everywhere(self.value, setting)


def same_everywhere(value: float, setting: Setting) -> PowerOfLoad:
    """Return one value at all nodes, whatever the load."""
    return PowerOfLoad(np.full(setting.path.equivalent_radius.shape, value), 0.0)


class HardnessCoefficient(CoefficientModel):
    """A dimensionless coefficient over the hardness, K/H."""

    model: Literal["hardness"]
    """Archard's K over the hardness. Source: B23"""
    k: Annotated[options.Number, options.NOT_NEGATIVE]
    """Archard's dimensionless K. Source: B23"""
    hardness: Annotated[options.Hardness, options.POSITIVE] | None = None
    """hardness H of the wearing flank, such as '60 HRC', '300 HV' or '7 GPa' [that of
    the gear's material]. Source: B23; HRC by ASTM E140, HB by ISO 18265"""

    @property
    def needs(self) -> tuple[str, ...]:  # type: ignore[override]
        """The flank's hardness, where this coefficient does not say it."""
        return () if self.hardness is not None else ("hardness",)

    def build(self, setting: Setting) -> PowerOfLoad:
        """Return ``K/H`` everywhere [m²/N]."""
        hardness = self.hardness or setting.hardness
        assert hardness is not None  # a rule of the scene
        return same_everywhere(self.k / hardness, setting)


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


FACTOR = 3.981e29
LOAD = 1.219
PRESSURE_VISCOSITY = -7.377
ROUGHNESS = 1.589


class JanakiramanCoefficient(CoefficientModel):
    """A regression over load, pressure-viscosity and roughness.

    Needs oil and both roughnesses.
    """

    needs: ClassVar[tuple[str, ...]] = ("lubricant", "roughness")

    model: Literal["janakiraman"]
    """regression of Janakiraman, Li & Kahraman 2014. Source: W23 Eqs. 40–43,
    doi:10.1115/1.4027440"""

    def build(self, setting: Setting) -> PowerOfLoad:
        """Return the regression as a power of the load [m²/N]."""
        assert setting.roughness is not None
        composite = float(np.hypot(*setting.roughness))
        return regression(setting.path, setting.lubricant.pressure_viscosity, composite)


def regression(
    path: WearPath, pressure_viscosity: float, roughness: float
) -> PowerOfLoad:
    """Return k along the path as a power of the load [m²/N].

    Parameters
    ----------
    path : WearPath
    pressure_viscosity : α of the oil at the contact's temperature [1/Pa]
    roughness : composite R_a of the two flanks [m]

    References
    ----------
    Janakiraman, Li & Kahraman 2014, as W23 Eqs. 40–43.
    """
    E = path.contact_modulus
    R = path.equivalent_radius
    G = pressure_viscosity * E
    S = roughness / R
    return PowerOfLoad(
        FACTOR / E * (E * R) ** -LOAD * G**PRESSURE_VISCOSITY * S**ROUGHNESS, LOAD
    )
