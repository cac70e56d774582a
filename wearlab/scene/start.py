"""``[start]``: the run whose wear a life goes on from."""

import re
from typing import Annotated, Any, NamedTuple

import pydantic
from annotated_types import Le

from wearlab import options
from wearlab.scene import gears

ID = re.compile(r"[0-9a-f]{20,64}")


class StartWear(NamedTuple):
    """The wear that a run starts from, read from its parent.

    Parameters
    ----------
    cycle : of the parent, at which it was taken
    error : of its interpolation between stored states, estimated [m]; 0 at a stored
        state
    side : flank → side of the tooth that the parent loaded
    position : flank → (n,) path coordinate of the nodes [m]
    depth : flank → (n,) wear depth there [m]
    estimate : error of the parent's wear depth at that cycle, as the parent estimates
        it [m]; NaN: unknown
    planet_depth : flank → (n_planets, n) wear depth of every planet there, of planets
        that differ; None: they are alike [m]
    """

    cycle: float
    error: float
    side: dict[str, str]
    position: dict[str, tuple[float, ...]]
    depth: dict[str, tuple[float, ...]]
    estimate: float = 0.0
    planet_depth: dict[str, tuple[tuple[float, ...], ...]] | None = None


def _identity(text: str) -> str:
    if not ID.fullmatch(text):
        raise ValueError(
            f"{text!r} is no full id of a run, 20 hexadecimal digits as `wearlab ls "
            "--json` shows it; or "
            "give 'campaign' and 'select'"
        )
    return text


class Start(options.Part):
    """Another run's wear at one of its cycles.

    ``cycle`` counts from 0 again, ``parent_cycle`` is kept.

    A campaign file may name the run by ``campaign`` and ``select`` instead of ``run``.
    """

    alternatives = (
        (("run",), ("campaign", "select")),
        (("cycle",), ("life_fraction",)),
    )

    run: Annotated[str, pydantic.AfterValidator(_identity)] | None = None
    """identity of the run to continue [named by campaign and select]. Source:
    wearlab"""
    campaign: str | None = options.option(None, identity=False)
    """campaign file whose run is continued [named by run]. Source: wearlab"""
    select: dict[str, Any] | None = options.option(None, identity=False)
    """axis = value or case = label, of the run in that campaign [its only run]. Source:
    wearlab"""
    cycle: Annotated[options.Number, options.NOT_NEGATIVE] | None = None
    """cycle of that run at which this one begins [its last state]. Source: wearlab"""
    life_fraction: Annotated[options.Number, options.NOT_NEGATIVE, Le(1.0)] | None = (
        None
    )
    """the same as a fraction of that run's life [its last state]. Source: wearlab"""
    replace: tuple[str, ...] = ()
    """members that get new flanks. Source: wearlab"""

    def _check(self) -> None:
        if self.run is None:
            raise ValueError(
                "give 'run', or 'campaign' and 'select', of the run to continue"
            )


def is_replaced(flank: str, replaced: tuple[str, ...]) -> bool:
    """Say whether a flank belongs to one of the replaced members."""
    return gears.member_of(flank) in replaced
