"""What a wear law may know of a flank: before anything runs, and in one wear state."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.wear.path import WearPath

NEEDS = (
    "lubricant",
    "roughness",
    "lambda_ratio",
    "hardness",
    "temperature",
    "flank_temperature",
)
"""What a coefficient, film or law may need: `lambda_ratio` is the oil and both
roughnesses, `flank_temperature` is what [thermal] finds."""


class Setting(NamedTuple):
    """A flank, its mate and the oil between them.

    What the scene does not say is ``None``.

    Parameters
    ----------
    path : the path of contact, both flanks
    gear : which of the two flanks wears, 0 driving, 1 driven
    lubricant : the oil, with ``viscosity`` [Pa·s] and ``pressure_viscosity`` [1/Pa]
    roughness : mean roughness R_a of both flanks, (driving, driven) [m]
    hardness : of the flank that wears [Pa]
    temperature : of the oil [K]
    flank_temperature : of the flank that wears, as [thermal] finds it [K]
    """

    path: WearPath
    gear: int
    lubricant: Any = None
    roughness: tuple[float, float] | None = None
    hardness: float | None = None
    temperature: float | None = None
    flank_temperature: float | None = None


class FlankState(NamedTuple):
    """One flank in one wear state, at every node of the path.

    What the scene does not say is NaN.

    Parameters
    ----------
    load : (n,) normal force per face width when the node is in contact [N/m]
    pressure : (n,) Hertz pressure then, mean or peak as ``wear.pressure`` says [Pa]
    sliding_speed : (n,) |v_own − v_other| [m/s]
    sliding_distance : (n,) sliding of the node in one cycle, over the width of contact
        [m]
    lambda_ratio : (n,) film thickness over roughness; NaN unless the scene has oil and
        both roughnesses [1]
    depth : (n,) wear so far [m]
    hardness : of this flank [Pa]
    temperature : of the oil [K]
    coefficient : (n,) wear coefficient, film included; NaN while it is itself asked for
        [m²/N]
    flank_temperature : of this flank, as [thermal] finds it [K]
    """

    load: Array
    pressure: Array
    sliding_speed: Array
    sliding_distance: Array
    lambda_ratio: Array
    depth: Array
    hardness: float
    temperature: float
    coefficient: Array
    flank_temperature: float = float("nan")


class PowerOfLoad(NamedTuple):
    """A quantity along the path as ``scale · w^exponent``, w = F/B [N/m].

    Parameters
    ----------
    scale : (n,) value at 1 N/m
    exponent : power of the load per unit length [1]
    """

    scale: Array
    exponent: float

    def at(self, load: ArrayLike) -> Array:
        """Return the values at the loads per unit length ``load``, (n,) [N/m]."""
        if self.exponent == 0.0:
            return self.scale
        return np.asarray(self.scale * np.asarray(load, float) ** self.exponent)
