"""What the units of a fleet share: numbers of one law, known or not."""

from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.campaign.distributions import Distribution
from wearlab.updating.run_curves import ObservationPoints, RunCurve, RunHistory

POWER, STRAYING, SPREAD, MEDIAN = "power", "straying", "spread", "median"
SMALLEST_WORN = 1e-100  # [SI], in place of nothing


class Parameter(NamedTuple):
    """Something positive that all units share.

    Parameters
    ----------
    name : what it is called in datasets
    prior : what is known of it before
    scale : SI value of the prior's unit
    """

    name: str
    prior: Distribution
    scale: float = 1.0


class Shared(NamedTuple):
    """What the units share, as lanes.

    Parameters
    ----------
    power : b, (p, 1)
    straying : ρ, (p, 1)
    sd : of each block, (p, 1) [SI]
    reference : T [cycles]
    tails : whether errors are Student-t
    """

    power: Array
    straying: Array
    sd: tuple[Array, ...]
    reference: float
    tails: bool = False

    def equal(self, cycle: float | Array) -> Array:
        """Return the equal wear time Λ = T (N/T)^b of cycles.

        It is (p, 1) of one cycle, (p, 1, n) of n.

        Parameters
        ----------
        cycle : N, from the start of the run
        """
        power = self.power[..., None] if np.ndim(cycle) else self.power
        return np.asarray(self.reference * (cycle / self.reference) ** power)

    @property
    def rate(self) -> Array:
        """The variance of W per unit of equal wear time, (p, 1)."""
        return np.asarray(self.straying**2 / self.reference)

    def worn(self, run: RunHistory, curve: RunCurve, factor: Array) -> Array:
        """Return what is worn of a quantity at T, of a profile in the mean.

        Parameters
        ----------
        run : the stored run
        curve : the quantity over its cycles
        factor : on the wear coefficient
        """
        places = np.arange(curve.value.shape[1])
        if not len(places):  # of a profile that was not measured of this unit
            return np.full(np.shape(factor), SMALLEST_WORN)
        cycles = run.start + self.reference * factor[..., None] / run.factor
        return np.maximum(curve.at(cycles, places).mean(axis=-1), SMALLEST_WORN)

    def mean(
        self,
        run: RunHistory,
        points: ObservationPoints,
        factor: Array,
        cycle: Array,
        column: Any = 0,
    ) -> Array:
        """Return the mean course of a quantity at cycles, (…, n) [SI].

        Parameters
        ----------
        run : the stored run
        points : with the curve of the quantity
        factor : on the wear coefficient, (…)
        cycle : when, (n,)
        column : of the curve, of each cycle where they differ
        """
        equal = self.equal(run.equal(cycle, points.clock))
        run_cycle = run.start + equal * (factor[..., None] / run.factor)
        return points.curve.at(run_cycle, column)


class Law(NamedTuple):
    """What is unknown of all units together, and what is known.

    Parameters
    ----------
    parameters : unknown; the errors first (``sd_`` and the number of a block), then
        spread and median
    reference : T, cycles at which f and straying are said
    power, straying : where they are known
    sd : of each block where it is known
    tails : whether errors are Student-t, of unknown degrees of freedom [normal]
    """

    parameters: tuple[Parameter, ...]
    reference: float
    power: float = 1.0
    straying: float = 0.0
    sd: tuple[float, ...] = (0.0,)
    tails: bool = False

    def shared(self, theta: Array) -> Shared:
        """Return what the units share at points.

        Parameters
        ----------
        theta : ln of the parameters, (p, parameters)
        """
        names = [parameter.name for parameter in self.parameters]
        columns = dict(zip(names, np.exp(theta.T)[..., None], strict=True))
        ones = np.ones((len(theta), 1))
        return Shared(
            power=columns.get(POWER, np.full((1, 1), self.power)),
            straying=columns.get(STRAYING, self.straying * ones),
            sd=tuple(
                columns.get(f"sd_{n}", value * ones) for n, value in enumerate(self.sd)
            ),
            reference=self.reference,
            tails=self.tails,
        )
