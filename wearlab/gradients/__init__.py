"""Derivatives of what a run says with respect to the numbers of its scene."""

from wearlab.gradients.derivatives import gradient
from wearlab.gradients.replayed_life import GradientError
