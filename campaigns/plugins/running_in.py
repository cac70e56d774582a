"""A wear law with running-in: fresh flanks wear faster, until their asperities are gone.

``dh = k p ds (1 + (r − 1) exp(−h/h_0))``: r times as fast at first, Archard's after a depth of several h_0.
"""

from typing import Annotated, Literal

import numpy as np

from wearlab.options import POSITIVE, Depth, Number
from wearlab.wear.laws import LawModel


class RunningIn(LawModel):
    """Archard's law with a rate that depends on the depth so far."""

    model: Literal["running-in"] = "running-in"
    """faster while fresh. Source: a user"""
    ratio: Annotated[Number, POSITIVE] = 5.0
    """rate of fresh flanks over Archard's"""
    depth: Annotated[Depth, POSITIVE] = 1e-6
    """depth h_0 over which this dies out"""

    def build(self, setting):
        """Return the depth per cycle of a flank's state [m]."""
        ratio, depth = self.ratio, self.depth

        def rate(state):
            fresh = 1.0 + (ratio - 1.0) * np.exp(-state.depth / depth)
            return state.coefficient * state.pressure * state.sliding_distance * fresh

        return rate
