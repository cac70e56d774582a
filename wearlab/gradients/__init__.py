"""Derivatives of what a run says with respect to the numbers of its scene."""

from wearlab.gradients.derivatives import gradient
from wearlab.gradients.lived import GradientError
