"""``wear.coefficient.film``: the oil film and the share of wear it leaves.

A file beside this one adds another.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar, Literal

from wearlab.arrays import Array
from wearlab.options import option
from wearlab.slots import Slot, Variant
from wearlab.wear.setting import NEEDS, Setting

if TYPE_CHECKING:
    from wearlab.wear.setting import PowerOfLoad


class FilmModel(Variant):
    """Any film: its thickness under a load, and the share of wear it leaves; needs oil and roughnesses."""

    slot: ClassVar[Slot] = Slot("wear.coefficient.film", __name__)
    may_need: ClassVar[tuple[str, ...]] = NEEDS
    needs: ClassVar[tuple[str, ...]] = ("lubricant", "roughness")

    def thickness(self, setting: "Setting") -> "PowerOfLoad":
        """Return the film thickness along the path as a power of the load, by Dowson and Higginson [m]."""
        from wearlab.wear.film import Film, composite_rq

        oil = setting.lubricant
        assert setting.roughness is not None
        film = Film(oil.viscosity, oil.pressure_viscosity, composite_rq(setting.roughness))
        return film.along(setting.path)

    def build(self, setting: "Setting") -> "Callable[[Array], Array]":
        """Return the share of wear that the film leaves, a function of λ (n,) [1] to (n,) within 0 and 1."""
        raise NotImplementedError(f"{type(self).__name__} has no build")


class DowsonHigginsonFilm(FilmModel):
    """Minimum film of a line contact; wear fades from λ = ½ and ends at λ = 4."""

    model: Literal["dowson-higginson"] = option(
        "dowson-higginson", "Dowson and Higginson's film, share 2/7 (4 − λ)", source="L16 Eq. 27"
    )

    def build(self, setting: Setting) -> Callable[[Array], Array]:
        """Return L16's share of wear."""
        from wearlab.wear.film import film_factor

        return film_factor
