"""Profile modifications: reliefs, crowning and slope, as material removed normal to the flank."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.gears.errors import GearError

POWERS = {"linear": 1, "parabolic": 2}
"""Power of the distance from its beginning with which a relief of each shape grows."""


@dataclass(frozen=True)
class Relief:
    """Material removed over a length of the path of contact at one end of the active profile.

    Parameters
    ----------
    amount : material removed at the very end [m]
    length : length along the path of contact over which the relief fades to 0 [m]
    shape : "linear" or "parabolic" (tangent to the unmodified profile where it begins)
    """

    amount: float
    length: float
    shape: Literal["linear", "parabolic"] = "linear"

    def removed(self, distance: Array) -> Array:
        """Return the material removed at a distance from the profile's end, (n,) [m]."""
        fade = np.clip(1.0 - distance / self.length, 0.0, None)
        return self.amount * fade ** POWERS[self.shape]


@dataclass(frozen=True)
class ReliefFrom:
    """A tip relief by where it starts on the flank.

    Parameters
    ----------
    amount : material removed at the tip [m]
    radius : where the relief starts [m], None when it is given by roll angle
    roll_angle : where it starts [rad], None when it is given by radius
    shape : "linear" or "parabolic"
    """

    amount: float
    radius: float | None = None
    roll_angle: float | None = None
    shape: Literal["linear", "parabolic"] = "linear"

    def of(self, base_radius: float, tip_radius: float, name: str, *, internal: bool) -> Relief:
        """Return the relief of a gear, ``length = |√(r_a² − r_b²) − ρ|``, ρ = r_b φ or √(r² − r_b²).

        Raises
        ------
        GearError : it would start below the base circle or not before the tip
        """
        tip = math.sqrt(tip_radius**2 - base_radius**2)
        if self.roll_angle is not None:
            start, said = base_radius * self.roll_angle, f"{math.degrees(self.roll_angle):.4g} deg"
        else:
            assert self.radius is not None
            square, said = self.radius**2 - base_radius**2, f"{2e3 * self.radius:.6g} mm"
            if square <= 0.0:
                raise GearError(
                    f"{name}: tip_relief cannot start at {said}, inside the base circle of "
                    f"{2e3 * base_radius:.6g} mm"
                )
            start = math.sqrt(square)
        before = start > tip if internal else start < tip
        if not before:
            raise GearError(f"{name}: tip_relief starts at {said}, which is not between root and tip")
        return Relief(self.amount, abs(tip - start), self.shape)


def settled(
    relief: Relief | ReliefFrom | None,
    base_radius: float,
    tip_radius: float,
    name: str,
    *,
    internal: bool = False,
) -> Relief | None:
    """Return a relief by its length, whichever way it was given."""
    if isinstance(relief, ReliefFrom):
        return relief.of(base_radius, tip_radius, name, internal=internal)
    return relief


@dataclass(frozen=True)
class Modification:
    """All profile modifications of one flank.

    Parameters
    ----------
    tip_relief, root_relief : reliefs, or None
    profile_crowning : amount removed at both ends, parabola with 0 in the middle [m]
    profile_slope : surplus of material at the tip end against the root end, 0 in the middle [m];
        positive as f_Hα of ISO 1328-1 (material grows towards the tip)
    """

    tip_relief: Relief | None = None
    root_relief: Relief | None = None
    profile_crowning: float = 0.0
    profile_slope: float = 0.0

    def removed(self, position: ArrayLike, active_length: float) -> Array:
        """Return the material removed normal to the flank.

        ``g(x) = tip(L − x) + root(x) + c (2x/L − 1)² − f (x/L − ½)``

        Parameters
        ----------
        position : (n,) x, distance along the path from the root end of the active profile [m]
        active_length : L, length of the active path A–E [m]

        Returns
        -------
        (n,) material removed [m]; positive is a gap, negative (slope only) a surplus
        """
        x = np.asarray(position, dtype=float)
        centred = x / active_length - 0.5
        removed = 4.0 * self.profile_crowning * centred**2 - self.profile_slope * centred
        if self.tip_relief is not None:
            removed = removed + self.tip_relief.removed(active_length - x)
        if self.root_relief is not None:
            removed = removed + self.root_relief.removed(x)
        return removed


def modification(
    tip_relief: Relief | None,
    root_relief: Relief | None,
    profile_crowning: float | None,
    profile_slope: float | None,
) -> Modification | None:
    """Return the modification made of the parts that are given, or None without any."""
    if tip_relief is None and root_relief is None and not profile_crowning and not profile_slope:
        return None
    return Modification(tip_relief, root_relief, profile_crowning or 0.0, profile_slope or 0.0)


def check_reliefs(item: Modification, active_length: float, name: str) -> None:
    """Refuse reliefs that are negative or longer than the active profile.

    Raises
    ------
    GearError : naming the relief, its numbers and the longest one possible
    """
    for word, relief in (("tip_relief", item.tip_relief), ("root_relief", item.root_relief)):
        if relief is None:
            continue
        if not relief.amount >= 0.0:
            raise GearError(f"{name}: {word} amount {relief.amount * 1e6:.3g} µm is negative; give >= 0")
        if not 0.0 < relief.length <= active_length * (1.0 + 1e-9):
            raise GearError(
                f"{name}: {word} length {relief.length * 1e3:.4g} mm must lie above 0 and within the "
                f"active path of {active_length * 1e3:.4g} mm"
            )
