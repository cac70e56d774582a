"""The film of Dowson and Higginson, and L16's share of wear over its λ."""

from collections.abc import Callable
from typing import Literal

from wearlab.arrays import Array
from wearlab.options import option
from wearlab.wear.films import FilmModel
from wearlab.wear.setting import Setting


class DowsonHigginsonFilm(FilmModel):
    """Minimum film of a line contact; wear fades from λ = ½ and ends at λ = 4."""

    model: Literal["dowson-higginson"] = option(
        "dowson-higginson", "Dowson and Higginson's film, share 2/7 (4 − λ)", source="L16 Eq. 27"
    )

    def build(self, setting: Setting) -> Callable[[Array], Array]:
        """Return L16's share of wear."""
        from wearlab.wear.film import film_factor

        return film_factor
