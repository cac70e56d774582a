"""A film that leaves another share of wear: a smooth one, ``1/(1 + (λ/λ_half)^n)``."""

from typing import Annotated, Literal

from wearlab.options import POSITIVE, Number
from wearlab.wear.films import FilmModel


class SmoothFilm(FilmModel):
    """Dowson and Higginson's film; the share of wear falls smoothly over λ."""

    model: Literal["smooth"] = "smooth"
    """share of wear 1/(1 + (λ/λ_half)^n). Source: a user"""
    half: Annotated[Number, POSITIVE] = 1.5
    """λ at which half of the wear is left"""
    steepness: Annotated[Number, POSITIVE] = 3.0
    """exponent n"""

    def build(self, setting):
        """Return the share of wear as a function of λ [1]."""
        half, steepness = self.half, self.steepness
        return lambda ratio: 1.0 / (1.0 + (ratio / half) ** steepness)
