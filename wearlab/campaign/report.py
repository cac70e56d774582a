"""``[report]``: what the page of a campaign tells, and in which order; no part of any run's identity."""

from typing import Annotated, Any, Literal

from annotated_types import Ge
from pydantic import BaseModel, ConfigDict

from wearlab.campaign.modelled import modelled
from wearlab.options import Number, option

SECTION = "report"
DECADE = 10.0**0.5
Part = Literal[
    "answer", "gears", "figures", "asked", "results", "expected", "failures", "assumptions", "provenance"
]
PARTS: tuple[Part, ...] = (
    *("answer", "gears", "figures", "assumptions", "asked", "results", "expected", "failures", "provenance"),
)


class ReportSpec(BaseModel):
    """What the page of a campaign tells."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    lead: str | None = option(None, "what the reader should know first, in a sentence or two", derived="none")
    sections: tuple[Part, ...] = option(
        PARTS, "what is told, in this order; what a campaign does not have is left out", derived="all"
    )
    wear_coefficient_factor: Annotated[Number, Ge(1)] = option(
        DECADE,
        "the wear coefficient may be so many times as large or as small: the range of the answer",
        derived="a decade in all, √10 either way",
    )


def read_report(table: Any) -> ReportSpec:
    """Return what ``[report]`` asks for.

    Raises
    ------
    CampaignError : anything in it is wrong
    """
    return modelled(ReportSpec, table, SECTION)
