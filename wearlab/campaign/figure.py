"""``[[figure]]``: what a figure shows; how it is drawn is not known here."""

from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from wearlab.options import option

Names = str | tuple[str, ...]


class FigureSpec(BaseModel):
    """One figure of a campaign."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: str = option(..., "kind of figure, listed by `wearlab schema --figures`")
    select: dict[str, Any] = option({}, "dimension = label, or a list of labels", derived="the kind's")
    x: str | None = option(None, "dimension or coordinate along x", derived="the kind's")
    y: Names | None = option(None, "variable along y, or a list of them", derived="the kind's")
    hue: str | None = option(None, "dimension told apart by colour", derived="the kind's")
    rows: str | None = option(None, "dimension told apart by rows of panels", derived="the kind's")
    cols: str | None = option(None, "dimension told apart by columns of panels", derived="the kind's")
    units: str | dict[str, str] | None = option(
        None, "unit of y as a text, or a table of variable = unit", derived="each variable's display unit"
    )
    y_as: Literal["logarithm", "difference"] | None = option(
        None, "y on a logarithmic axis, or less the first curve of its panel", derived="its value"
    )
    title: str | None = option(None, "title of the figure", derived="the kind's")
    note: str | None = option(
        None, "one line under the figure: departures from a paper, and why", derived="none"
    )
    published: Path | None = option(
        None, "CSV of points from a paper: columns x, y, hue and their units", derived="none"
    )
