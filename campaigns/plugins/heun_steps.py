"""A step over cycles of one's own: Heun's method, of second order.

A method has a `start`, which returns a stepper at the first state. The stepper's ``advance`` takes one step:
``h₁ = h₀ + ΔN r(h₀)``, then ``h = h₀ + ΔN (r(h₀) + r(h₁))/2``. How long a life may be, snapshots, depth
limits and checkpoints are not its business.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from wearlab.life.limits import CountedRate
from wearlab.life.step import Node, Step, Stepper, growth
from wearlab.life.steps import StepMethod
from wearlab.options import POSITIVE, Depth


class HeunStep(StepMethod):
    """Heun's method, a step as long as the wear takes to grow by a threshold."""

    method: Literal["heun"] = "heun"
    """second order, two rates a step. Source: a user"""
    threshold: Annotated[Depth, POSITIVE] = 1e-6
    """wear of a step"""

    def build(self) -> "Heun":
        """Return the method."""
        return Heun(self.threshold)


@dataclass(frozen=True)
class Heun:
    """The method: what every life begins with."""

    threshold: float

    def start(
        self, node: Node, rate: CountedRate, tolerance: float, scale: float
    ) -> "HeunStepper":
        """Return the stepper of one life."""
        return HeunStepper(rate, self.threshold)


class HeunStepper(Stepper):
    """Takes step after step, none rejected."""

    def __init__(self, rate: CountedRate, threshold: float) -> None:
        self.rate = rate
        self.threshold = threshold

    def advance(self, node: Node, largest: float) -> tuple[Step, None]:
        """Return the step from ``node``, at most ``largest`` cycles long, and no jump."""
        fastest = float(node.rate.max())
        by_threshold = self.threshold / fastest if fastest > 0.0 else np.inf
        size = min(by_threshold, largest, self.max_size)
        self.trying = size

        first = self.rate(node.depth + size * node.rate)
        depth = node.depth + 0.5 * size * (node.rate + first)
        end = Node(node.cycle + size, depth, self.rate(depth))

        error = size * (end.rate - first) / 6.0
        return Step(node, end, (node.rate, end.rate), error, growth(node, end)), None
