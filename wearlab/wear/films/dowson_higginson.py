"""Dowson and Higginson's film, and the wear that Ding and Kahraman leave under it."""

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.wear.films import FilmModel
from wearlab.wear.setting import Setting


class DowsonHigginsonFilm(FilmModel):
    """Minimum film of a line contact; wear fades from λ = ½ and ends at λ = 4."""

    model: Literal["dowson-higginson"] = "dowson-higginson"
    """Dowson and Higginson's film, share 2/7 (4 − λ). Source: L16 Eq. 27"""

    def build(self, setting: Setting) -> Callable[[Array], Array]:
        """Return L16's share of wear."""
        return film_factor


def film_factor(lambda_ratio: ArrayLike) -> Array:
    """Return the share of wear: 1 to λ = ½, (2/7)(4 − λ), 0 from 4 (L16 Eq. 27).

    Parameters
    ----------
    lambda_ratio : λ, (n,) [1]
    """
    return np.asarray(
        np.clip((2.0 / 7.0) * (4.0 - np.asarray(lambda_ratio, float)), 0.0, 1.0)
    )
