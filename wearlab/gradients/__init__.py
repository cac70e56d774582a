"""Derivatives of the results of a run with respect to the numbers of its scene."""

from wearlab.gradients.derivatives import gradient
from wearlab.gradients.numbers import GradientError

__all__ = ["GradientError", "gradient"]
