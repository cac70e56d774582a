"""``[start]``: a run that goes on from another run's wear."""

import re
from typing import Annotated, Any, ClassVar, NamedTuple

from annotated_types import Le
from pydantic import AfterValidator, model_validator

from wearlab.options import NOT_NEGATIVE, Alternatives, Number, Part, option
from wearlab.scene.members import member_of

ID = re.compile(r"[0-9a-f]{20,64}")


class StartWear(NamedTuple):
    """The wear that a run starts from, read from its parent.

    Parameters
    ----------
    cycle : of the parent, at which it was taken
    error : of its interpolation between stored states, estimated [m]; 0 at a stored state
    side : flank → side of the tooth that the parent loaded
    position : flank → (n,) path coordinate of the nodes [m]
    depth : flank → (n,) wear depth there [m]
    estimate : error of the parent's wear depth at that cycle, as the parent estimates it [m]; NaN: unknown
    """

    cycle: float
    error: float
    side: dict[str, str]
    position: dict[str, tuple[float, ...]]
    depth: dict[str, tuple[float, ...]]
    estimate: float = 0.0


def _identity(text: str) -> str:
    if not ID.fullmatch(text):
        raise ValueError(
            f"{text!r} is no full id of a run, 20 hexadecimal digits as `wearlab ls --json` shows it; or "
            "give 'campaign' and 'select'"
        )
    return text


class Start(Part):
    """Another run's wear at one of its cycles; ``cycle`` counts from 0 again, ``parent_cycle`` is kept.

    A campaign file may name the run by ``campaign`` and ``select`` instead of ``run``.
    """

    alternatives: ClassVar[Alternatives] = (
        (("run",), ("campaign", "select")),
        (("cycle",), ("life_fraction",)),
    )

    run: Annotated[str, AfterValidator(_identity)] | None = option(
        None, "identity of the run to continue", derived="named by campaign and select", source="wearlab"
    )
    campaign: str | None = option(
        None, "campaign file whose run is continued", derived="named by run", source="wearlab", identity=False
    )
    select: dict[str, Any] | None = option(
        None,
        "axis = value or case = label, of the run in that campaign",
        derived="its only run",
        source="wearlab",
        identity=False,
    )
    cycle: Annotated[Number, NOT_NEGATIVE] | None = option(
        None, "cycle of that run at which this one begins", derived="its last state", source="wearlab"
    )
    life_fraction: Annotated[Number, NOT_NEGATIVE, Le(1.0)] | None = option(
        None, "the same as a fraction of that run's life", derived="its last state", source="wearlab"
    )
    replace: tuple[str, ...] = option((), "members that get new flanks", source="wearlab")

    @model_validator(mode="after")
    def _one_run(self) -> "Start":
        if self.run is None:
            raise ValueError("give 'run', or 'campaign' and 'select', of the run to continue")
        return self


def is_replaced(flank: str, replaced: tuple[str, ...]) -> bool:
    """Say whether a flank belongs to one of the replaced members."""
    return member_of(flank) in replaced
