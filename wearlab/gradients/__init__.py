"""Derivatives of what a run says with respect to the numbers of its scene."""

from wearlab.gradients.errors import GradientError
from wearlab.gradients.gradient import gradient

__all__ = ["GradientError", "gradient"]
