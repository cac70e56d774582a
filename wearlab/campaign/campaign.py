"""What a campaign file asks for."""

from dataclasses import dataclass, field
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from wearlab.campaign.axes import Axis
from wearlab.campaign.case import Case
from wearlab.campaign.exclusion import Excluded
from wearlab.campaign.figure import FigureSpec
from wearlab.campaign.measured import UpdateSpec
from wearlab.campaign.report import ReportSpec
from wearlab.campaign.telling import campaign_html
from wearlab.options import option
from wearlab.plugins import Plugin


class Metadata(BaseModel):
    """Who made it; no part of any run's identity."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    author: str | tuple[str, ...] | None = option(None, "author, or a list of authors", derived="not told")
    orcid: str | None = option(None, "ORCID of the author", derived="not told")
    institution: str | None = option(None, "institution", derived="not told")
    licence: str | None = option(None, "licence of the datasets", derived="not told")


@dataclass(frozen=True)
class Campaign:
    """What a campaign file asks for.

    Parameters
    ----------
    title, reference, metadata : texts, not part of any run
    cases : every run; equal scenes share an id
    excluded : cases that a condition of the file keeps from being run
    axes : sweep axes, the dimensions of the grid
    figures : what is to be drawn
    path : the file
    plugins : the sources of a user's own variants
    update : what was measured and what is unknown, None when the file does not say
    report : what its page tells
    warnings : what the file does that it hardly means
    """

    title: str
    reference: str | None
    metadata: dict[str, str]
    cases: tuple[Case, ...]
    axes: tuple[Axis, ...] = ()
    figures: tuple[FigureSpec, ...] = field(default=(), repr=False)
    path: Path | None = None
    excluded: tuple[Excluded, ...] = field(default=(), repr=False)
    plugins: tuple[Plugin, ...] = field(default=(), repr=False)
    update: UpdateSpec | None = field(default=None, repr=False)
    report: ReportSpec = field(default=ReportSpec(), repr=False)
    warnings: tuple[str, ...] = field(default=(), repr=False)

    def __repr__(self) -> str:
        axes = ", ".join(f"{axis.name} {len(axis.values)}" for axis in self.axes)
        return f"<Campaign {self.title!r}: {len(self.cases)} cases{f' ({axes})' if axes else ''}>"

    def _repr_html_(self) -> str:
        return campaign_html(repr(self), self.axes, self.cases)
