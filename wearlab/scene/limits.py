"""Ends of a life, and wear states that are stored on the way."""

from typing import Annotated, Any

import pydantic
from annotated_types import MinLen

from wearlab import options, units
from wearlab.scene import gears
from wearlab.scene.operation import BACK

Positive = Annotated[options.Number, options.POSITIVE]
PositiveDepth = Annotated[options.Depth, options.POSITIVE]


def _ascending(values: tuple[float, ...]) -> tuple[float, ...]:
    """Sort values; those that are equal in 12 digits are one, the smallest."""
    descending = sorted(values, reverse=True)
    distinct = {units.rounded(value): value for value in descending}
    return tuple(distinct.values())[::-1]


def _of_the_set(flank: Any, info: pydantic.ValidationInfo) -> Any:
    """Return the name of a flank, or refuse one that this kind of gear set has not."""
    flanks = gears.set_in(info.context).flanks
    if flank is None or str(flank).removesuffix(BACK) in flanks:
        return flank
    raise ValueError(
        f"{flank!r} is no flank of this gear set; there are {', '.join(flanks)}"
    )


Flank = Annotated[str, pydantic.BeforeValidator(_of_the_set)]


class Until(options.Part):
    """Where the life ends: at the first limit reached."""

    cycles: Positive | None = None
    """revolutions of the pinion [no such limit]"""
    mesh_cycles: Positive | None = None
    """mesh cycles [no such limit]"""
    hours: Annotated[options.Hours, options.POSITIVE] | None = None
    """operating hours, a plain count or a time with its unit [no such limit]"""
    depth: PositiveDepth | None = None
    """largest wear depth [no such limit]. Source: W23: 400 µm"""
    flank: Flank | None = None
    """the flank whose largest depth counts [whichever is deepest]"""

    def _check(self) -> None:
        if self.cycles is self.mesh_cycles is self.hours is self.depth is None:
            raise ValueError(
                "give at least one of 'cycles', 'mesh_cycles', 'hours', 'depth'"
            )
        if self.flank is not None and self.depth is None:
            raise ValueError("'flank' belongs to a 'depth', and there is none")


class SnapshotOptions(options.Part):
    """Wear states stored on the way; asking for them changes nothing."""

    alternatives = ((("cycles",), ("mesh_cycles",), ("depth", "flank")),)

    cycles: (
        Annotated[tuple[Positive, ...], MinLen(1), pydantic.AfterValidator(_ascending)]
        | None
    ) = None
    """at these revolutions of the pinion [not by cycles]"""
    mesh_cycles: (
        Annotated[tuple[Positive, ...], MinLen(1), pydantic.AfterValidator(_ascending)]
        | None
    ) = None
    """at these mesh cycles [not by mesh cycles]"""
    depth: (
        Annotated[
            tuple[PositiveDepth, ...], MinLen(1), pydantic.AfterValidator(_ascending)
        ]
        | None
    ) = None
    """when the wear reaches these depths [not by depth]"""
    flank: Flank | None = None
    """the flank whose largest depth counts [whichever is deepest]"""

    def _check(self) -> None:
        if self.cycles is self.mesh_cycles is self.depth is None:
            raise ValueError("give one of 'cycles', 'mesh_cycles', 'depth'")
