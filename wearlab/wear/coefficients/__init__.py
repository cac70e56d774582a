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


Switched = Annotated[options.Switch, Tag("switch")]
Chosen = Switched | Annotated[FilmModel, Tag("model")]
Film = Annotated[Chosen, Discriminator(_switch_or_model), BeforeValidator(_model)]


def standard_film() -> FilmModel:
    """Return the film of Dowson and Higginson."""
    standard: Any = FilmModel.slot.variants[STANDARD_FILM]
    film: FilmModel = standard.model_construct()
    return film


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
        """Return k along the path, without ``factor`` and film.

        Parameters
        ----------
        setting : the flank, its mate and the oil

        Returns
        -------
        PowerOfLoad, or a function of a `FlankState` that returns k at every node, (n,)
        [m²/N]
        """
        raise NotImplementedError(f"{type(self).__name__} has no build")


def same_everywhere(value: float, setting: Setting) -> PowerOfLoad:
    """Return one value at all nodes, whatever the load.

    Parameters
    ----------
    value : the coefficient [m²/N]
    setting : what the law stands on
    """
    return PowerOfLoad(np.full(setting.path.equivalent_radius.shape, value), 0.0)
