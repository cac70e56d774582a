"""``[wear.coefficient]``: the wear coefficient k, one variant a file."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import BeforeValidator, Discriminator, Tag

from wearlab.options import NOT_NEGATIVE, Number, Switch, named, option
from wearlab.slots import Slot, Variant
from wearlab.wear.films import FilmModel

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.wear.setting import FlankState, PowerOfLoad, Setting

STANDARD_FILM = "dowson-higginson"


def _switch_or_model(value: Any) -> str:
    return "model" if isinstance(value, dict | FilmModel) else "switch"


def _model(value: Any) -> Any:
    """Read the name of a film model as its table; what names none is refused as no switch."""
    if isinstance(value, dict) and set(value) == {"model"} and value["model"] not in FilmModel.slot.variants:
        return value["model"]
    return {"model": value} if isinstance(value, str) and value in FilmModel.slot.variants else value


Film = Annotated[
    Annotated[Switch, Tag("switch")] | Annotated[Annotated[FilmModel, *named()], Tag("model")],
    Discriminator(_switch_or_model),
    BeforeValidator(_model),
]


class CoefficientModel(Variant):
    """Any wear coefficient: its film, its scatter, and ``build``.

    ``needs`` names what the scene must say for it: ``lubricant``, ``roughness``, ``hardness`` of the flank,
    ``temperature`` of the oil.
    """

    slot: ClassVar[Slot] = Slot("wear.coefficient", __name__)
    per_member: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ()
    departure: ClassVar[str] = "usually known within a decade; depth and 1/life are proportional to it"
    """How far it is known to be off."""

    film: Film = option(
        False,
        "whether the oil film lowers the coefficient: by the model named, or by Dowson and Higginson's",
        source="L16 after Ding & Kahraman 2007",
    )
    factor: Annotated[Number, NOT_NEGATIVE] = option(1.0, "factor on the coefficient, for scatter")

    @property
    def film_model(self) -> "FilmModel | None":
        """The film model, None without film."""
        if isinstance(self.film, FilmModel):
            return self.film
        return FilmModel.slot.variants[STANDARD_FILM].model_construct() if self.film else None  # type: ignore[return-value]

    def build(self, setting: "Setting") -> "PowerOfLoad | Callable[[FlankState], Array]":
        """Return k along the path, without ``factor`` and film: a power of the load, or a function.

        Parameters
        ----------
        setting : the flank, its mate and the oil

        Returns
        -------
        PowerOfLoad, or a function of a `FlankState` that returns k at every node, (n,) [m²/N]
        """
        raise NotImplementedError(f"{type(self).__name__} has no build")
