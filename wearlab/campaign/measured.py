"""What an ``[update]`` comes to [SI]: what was measured and how well, what ends the life, which day it was.

Files of measurements are read by `wearlab.updating`, not here.
"""

from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any, Literal

from wearlab.campaign.distributions import Distribution
from wearlab.campaign.update_options import Columns
from wearlab.schema import VARIABLES

SECTION = "update"
THICKNESS = "tooth_thickness"
WHEN = ("cycle", "hours", "mesh_cycles", "date")
WHERE = ("diameter", "roll_angle", "path_position")
PREVIOUS = "previous"


@dataclass(frozen=True)
class Limit:
    """The wear that ends the life [SI]; ``where`` is its flank or member, None where it is not said."""

    quantity: Literal["max_wear_depth", "worn_mass"]
    value: float
    where: str | None = None


@dataclass(frozen=True)
class ErrorModel:
    """Errors of one block [SI of the quantity]; a distribution is in the unit that it says."""

    sd: float | Distribution | None = None
    relative: float = 0.0
    offset_sd: float = 0.0
    drift: float | Distribution | None = None


@dataclass(frozen=True)
class Data:
    """One ``[[update.data]]`` block.

    Parameters
    ----------
    number : its place in the file, from 1
    file, quantity, where, select, since : as written; ``where`` is the member or flank
    cases : the cases it belongs to, none: all
    columns : what each column that is named says
    units : unit of each column that has one
    error : how far the values are off
    """

    number: int
    file: Path
    quantity: str
    where: str | None
    cases: tuple[str, ...]
    columns: Columns
    units: dict[str, str]
    error: ErrorModel
    select: dict[str, Any] = field(default_factory=dict)
    since: float | str | None = None
    date_format: str | None = None

    @property
    def place(self) -> str:
        """How messages call it."""
        return f"{SECTION}.data[{self.number - 1}]"

    @property
    def label(self) -> str:
        """The quantity, where it was measured, and what of it was selected."""
        selected = [f"{dim}_{value}" for dim, value in self.select.items()]
        return "_".join([self.quantity, *([self.where] if self.where else []), *selected])

    @property
    def si(self) -> str:
        """The SI unit of the quantity."""
        return unit_of(self.quantity)


@dataclass(frozen=True)
class Days:
    """A day, the operating hours on it (None: those of the last inspection), and hours a year from it on."""

    day: date
    hours: float | None
    hours_per_year: float


@dataclass(frozen=True)
class UpdateSpec:
    """A whole ``[update]``."""

    limit: Limit | None
    discrepancy: str
    draws: int
    seed: int
    unknown: dict[str, Distribution]
    data: tuple[Data, ...]
    days: Days | None = None


def unit_of(quantity: str) -> str:
    """Return the SI unit of a quantity that may be measured, "1" for a plain number."""
    if quantity == THICKNESS:
        return "m"
    return VARIABLES[quantity].units
