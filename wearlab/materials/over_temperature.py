"""A quantity known at some temperatures: straight between them, unknown beyond."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

ZERO_CELSIUS = 273.15
"""0 °C [K]."""


class OutsideTable(ValueError):
    """A temperature beyond the table of a quantity: nothing is known there."""


class TemperatureCurve(NamedTuple):
    """A quantity over temperature.

    Parameters
    ----------
    temperature : (n,) ascending [K]
    value : (n,) the quantity there
    """

    temperature: tuple[float, ...]
    value: tuple[float, ...]

    @property
    def lowest(self) -> float:
        """The lowest temperature at which it is known [K]."""
        return self.temperature[0]

    @property
    def highest(self) -> float:
        """The highest temperature at which it is known [K]."""
        return self.temperature[-1]

    def at(self, temperature: float) -> float:
        """Return the quantity at a temperature, straight between those of the table.

        Parameters
        ----------
        temperature : [K]

        Raises
        ------
        OutsideTable : nothing is known there

        Examples
        --------
        >>> TemperatureCurve((293.15, 333.15), (2.9e9, 1.9e9)).at(313.15)
        2400000000.0
        """
        if not self.lowest <= temperature <= self.highest:
            raise OutsideTable(
                f"{celsius(temperature)} is outside the table, which goes from "
                f"{celsius(self.lowest)} to {celsius(self.highest)}"
            )
        last_interval = len(self.temperature) - 2
        row = min(bisect_right(self.temperature, temperature) - 1, last_interval)
        low, high = self.value[row : row + 2]
        if low == high:
            return low
        start = self.temperature[row]
        share = (temperature - start) / (self.temperature[row + 1] - start)
        return low + share * (high - low)


def held(value: float) -> TemperatureCurve:
    """Return a quantity that no temperature changes.

    Parameters
    ----------
    value : at every temperature
    """
    return TemperatureCurve((-math.inf, math.inf), (value, value))


def check_table(temperature: Sequence[float], value: Sequence[float]) -> None:
    """Refuse a table over temperature that is none.

    Parameters
    ----------
    temperature : [K]
    value : the quantity there

    Raises
    ------
    ValueError : with what is wrong
    """
    if len(temperature) != len(value):
        raise ValueError(
            f"temperature has {len(temperature)} entries and value {len(value)}: give "
            "one value for each temperature"
        )
    if len(temperature) < 2:
        raise ValueError("a table over temperature has two rows at least")
    if any(high <= low for low, high in pairwise(temperature)):
        raise ValueError("temperature must ascend")


def celsius(temperature: float) -> str:
    """Return a temperature [K] as people read it.

    >>> celsius(373.15)
    '100 °C'

    Parameters
    ----------
    temperature : [K]
    """
    return f"{temperature - ZERO_CELSIUS:.4g} °C"
