"""``wear.coefficient.film``: the oil film and the share of wear it leaves, one variant a file."""

from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar

from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.wear.setting import PowerOfLoad, Setting


class FilmModel(Variant):
    """Any film: its thickness under a load, and the share of wear it leaves; needs oil and roughnesses."""

    slot: ClassVar[Slot] = Slot("wear.coefficient.film", __name__)
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
