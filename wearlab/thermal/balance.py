"""Where friction and the heat's way out balance: the temperatures of two gears.

The bodies settle in minutes and wear takes hours to months, so that the temperatures
are a function of the wear state: with rises ``R P`` over the surroundings, P is what
the gears make at those temperatures, ``P = P_V(ϑ_0 + R P)``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.materials.over_temperature import celsius

ROOT, FLANK = 0, 1
"""Places of a tooth along the last axis of temperatures."""
PLACES = ("root", "flank")
SETTLED = 1e-11
"""Miss of the power, over it, at which temperatures have settled."""
SMALL_STEP = 1e-6
"""Step of the power, over it, after which the miss of a smooth loss has shrunk."""
SHRUNK = 0.1
"""Miss over the last one above which a small step has found noise alone: contact of
whole outlines is known to some 1e-7 [1]."""
MAX_EVALUATIONS = 30
"""Evaluations after which bounded powers stand as they are: motions that repeat in no
period have a loss with noise, and no closer one."""
SHY = 1.0 - 1e-12
"""Share of a limit's rise that is looked at, so that rounding stays in the tables."""
FARTHEST = 1000.0
"""Distances of a step of the fixed point that a secant may go beyond it."""


class NoSteadyTemperature(ValueError):
    """Friction makes more heat than passes at any temperature at which all is known."""


class TemperatureLimit(NamedTuple):
    """A temperature that a place of a gear must not pass.

    Parameters
    ----------
    gear : name of the member
    number : 0 driving, 1 driven
    place : `ROOT` or `FLANK`
    temperature : the highest one allowed [K]
    reason : what ends there, in words
    """

    gear: str
    number: int
    place: int
    temperature: float
    reason: str


@dataclass(frozen=True)
class HeatBalance:
    """How warm a power of friction makes the two gears.

    Parameters
    ----------
    ambient : temperature of the surroundings [K]
    resistance : (2, 2) of (driving, driven) at (root, flank) [K/W]
    limits : temperatures that places must not pass
    """

    ambient: float
    resistance: Array
    limits: tuple[TemperatureLimit, ...] = ()

    def temperatures(self, power: float) -> Array:
        """Return the temperatures under a power of friction, (2, 2) [K].

        Parameters
        ----------
        power : P_V, averaged over the time [W]
        """
        return self.ambient + self.resistance * power

    def power_at(self, limit: TemperatureLimit) -> float:
        """Return the power of friction at which a limit is reached, maybe inf [W].

        Parameters
        ----------
        limit : of one place
        """
        resistance = self.resistance[limit.number, limit.place]
        allowed = limit.temperature - self.ambient
        return float(SHY * allowed / resistance) if resistance > 0.0 else np.inf

    @property
    def nearest_limit(self) -> TemperatureLimit | None:
        """The limit that growing friction reaches first, None where there is none."""
        reached = [limit for limit in self.limits if np.isfinite(self.power_at(limit))]
        return min(reached, key=self.power_at, default=None)

    def steady_power(self, loss: Callable[[Array], float]) -> float:
        """Return the power of friction that holds its own temperatures [W].

        Parameters
        ----------
        loss : temperatures (2, 2) [K] to P_V there [W]

        Raises
        ------
        NoSteadyTemperature
            At no temperature up to the nearest limit as much heat passes as friction
            makes.
        """
        limit = self.nearest_limit
        highest = np.inf if limit is None else max(self.power_at(limit), 0.0)
        try:
            return fixed_point(lambda power: loss(self.temperatures(power)), highest)
        except RunawayPower as error:
            raise NoSteadyTemperature(self._too_warm(limit, error)) from None

    def _too_warm(self, limit: TemperatureLimit | None, runaway: "RunawayPower") -> str:
        """Return why there is no steady temperature, with its numbers."""
        if limit is None:
            return (
                "no steady temperature: friction makes more heat than passes at any "
                f"temperature (at {runaway.power:.3g} W of it {runaway.loss:.3g} W)"
            )
        return (
            f"no steady temperature: the {PLACES[limit.place]} of {limit.gear} would "
            f"pass {celsius(limit.temperature)}, {limit.reason}: at that temperature "
            f"friction makes {runaway.loss:.4g} W, and {runaway.power:.4g} W hold it"
        )


class RunawayPower(ArithmeticError):
    """No power up to the highest allowed is its own loss.

    Parameters
    ----------
    power : the highest one looked at [W]
    loss : the loss there, which is more [W]
    """

    def __init__(self, power: float, loss: float) -> None:
        super().__init__(f"a loss of {loss:g} W at {power:g} W")
        self.power = power
        self.loss = loss


def fixed_point(loss: Callable[[float], float], highest: float = np.inf) -> float:
    """Return the least power P that is its own loss, P = loss(P), up to the highest.

    Secants between two bounds, once there are two, and steps from below before. The
    start is always the surroundings' temperature, so that no other start can have
    another result.

    Parameters
    ----------
    loss : P to the loss at the temperatures that P makes, ≥ 0 [W]
    highest : up to where it is known [W]

    Raises
    ------
    RunawayPower : the loss is larger than the power up to the highest one

    Examples
    --------
    A loss that grows by 0.4 % a kelvin, with a resistance of 2 K/W:

    >>> round(fixed_point(lambda power: 14.0 * (1.0 + 0.004 * 2.0 * power)), 6)
    15.765766
    """
    low = 0.0
    excess_at_low = loss(0.0)
    if excess_at_low == 0.0:
        return 0.0
    bounds = [low, np.inf]
    before = (low, excess_at_low)
    power = min(excess_at_low, highest)
    excess = np.inf
    for _ in range(MAX_EVALUATIONS):
        excess = loss(power) - power
        if abs(excess) <= SETTLED * power:
            return power
        if excess > 0.0 and power >= highest:
            raise RunawayPower(power, power + excess)
        if _is_noise(before, (power, excess)):
            return power
        bounds[int(excess < 0.0)] = power
        following = _secant(before, (power, excess), bounds)
        before = (power, excess)
        power = min(following, highest)
    if np.isfinite(bounds[1]):
        return before[0]
    raise RunawayPower(before[0], before[0] + excess)


def _is_noise(before: tuple[float, float], last: tuple[float, float]) -> bool:
    """Return whether a small step from a (power, excess) has left its excess."""
    power, excess = last
    is_small = abs(power - before[0]) <= SMALL_STEP * power
    return is_small and abs(excess) > SHRUNK * abs(before[1])


def _secant(
    before: tuple[float, float], last: tuple[float, float], bounds: list[float]
) -> float:
    """Return the next power: on the secant of two (power, excess), within the bounds.

    Without an upper bound it goes up, not farther than some steps of the fixed point.
    """
    low, high = bounds
    power, excess = last
    slope = (excess - before[1]) / (power - before[0])
    following = power - excess / slope if slope < 0.0 else np.inf
    if np.isinf(high):
        return float(min(following, power + FARTHEST * excess))
    if low < following < high:
        return float(following)
    return float(0.5 * (low + high))


class HeatState(NamedTuple):
    """How warm the gears are in one wear state.

    Parameters
    ----------
    friction_power : P_V, averaged over the time under load [W]
    loss_factor : degree of tooth loss H_V [1]
    load_beyond : share of the load that pairs beyond A and E carry [1]
    temperature : (2, 2) of (driving, driven) at (root, flank) [K]
    modulus : (2, 2) Young's moduli there [Pa]
    is_shared : whether it is that of conditions that take turns, by their mean loss
    """

    friction_power: float
    loss_factor: float
    load_beyond: float
    temperature: Array
    modulus: Array
    is_shared: bool = False
