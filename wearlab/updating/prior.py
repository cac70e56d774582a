"""What is known of the wear coefficient's factor before anything is measured."""

from dataclasses import dataclass

import numpy as np

from wearlab.arrays import Array
from wearlab.campaign.distributions import SMALLEST, Distribution


@dataclass(frozen=True)
class Prior:
    """What is known of the factor on the wear coefficient before; None: it is what the runs have."""

    factor: Distribution | None

    def ends(self) -> tuple[float, float]:
        """Return the range of ln factor."""
        assert self.factor is not None
        return float(np.log(self.factor.at(SMALLEST))), float(np.log(self.factor.at(1.0 - SMALLEST)))

    def log_density(self, log_factor: Array) -> Array:
        """Return the log of the density per unit of ln factor."""
        assert self.factor is not None
        f = np.exp(log_factor)
        with np.errstate(divide="ignore"):
            return np.log(np.array([self.factor.density(x) * x for x in f.tolist()]))
