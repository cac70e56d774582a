"""One figure of a grid, a run or a report, for programs and notebooks."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

import xarray as xr
from pydantic import ValidationError

from wearlab.campaign.campaign import FigureSpec
from wearlab.figures import kinds
from wearlab.figures.kind import FigureError, no_kind, read
from wearlab.figures.paper import width_in_inches
from wearlab.figures.plot import Plot
from wearlab.figures.plotting import of_update, plotted
from wearlab.nearest import choices

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from wearlab.store import Store

NAME = "figure"
"""How errors call a figure that stands in no campaign file."""
Size = float | str | tuple[float, float] | None
"""Width in inches or with its unit, or width and height [inches]."""


class ReportOfRuns(Protocol):
    """What `wearlab.run` returns."""

    def to_xarray(self) -> xr.Dataset:
        """Return the runs as one dataset."""


def figure(
    of: "xr.Dataset | ReportOfRuns",
    kind: str,
    *,
    ax: "Axes | Sequence[Axes] | None" = None,
    size: Size = None,
    **options: Any,
) -> "Figure":
    """Return a figure of stored or simulated runs.

    >>> import wearlab as wl
    >>> pair = wl.Scene.from_mapping({
    ...     "gears": {
    ...         "kind": "external-pair", "module": "3 mm", "face_width": "20 mm",
    ...         "pinion": {"teeth": 25}, "gear": {"teeth": 30},
    ...     },
    ...     "operation": {"torque": "100 N*m", "speed": "1100 rpm"},
    ... })
    >>> drawing = wl.figure(wl.simulate(pair), "ste", size=3.5)
    >>> [" ".join(axes.get_ylabel().split()) for axes in drawing.axes]
    ['Static transmission error (µm)']

    Parameters
    ----------
    of : datasets of several runs (`Store.open`), of one (`Store.run`, `simulate`), or
        the report of `run`
    kind : listed by ``wearlab schema --figures``
    ax : axes of matplotlib to draw in, one for each panel; title and legend stand in
        them, notes are left out
    size : width with its unit, such as "84 mm", or in inches; or width and height
        [inches]; text is as large as ``font.size`` says [as the panels need]
    options : as in ``[[figure]]``: select, x, y, hue, rows, cols, units, title, note,
        published

    Returns
    -------
    A figure of matplotlib; notebooks show it, ``savefig`` writes it. What you set in
    rcParams (fonts, ``text.usetex``, ``font.size``) holds before wearlab's style;
    ticks, legend and notes go with ``font.size``;
    ``title=""`` leaves the title out.

    Raises
    ------
    FigureError : no such kind or option, or nothing of it can be drawn
    """
    request = read(specified({"kind": kind, **options}), 1, None)
    plot = plotted(grid_of(of), request).plot
    from wearlab.figures.render import drawn

    width = width_in_inches(size) if isinstance(size, int | float | str) else size
    return drawn(plot, width, ax)


def specified(options: dict[str, Any]) -> FigureSpec:
    """Return options as of ``[[figure]]`` as a campaign has them.

    Parameters
    ----------
    options : by name, ``kind`` among them

    Raises
    ------
    FigureError : no such kind or option
    """
    fields = FigureSpec.model_fields
    for key in options:
        if key not in fields:
            raise FigureError(
                f"{NAME}: {key!r} is no option; {choices(key, sorted(fields))}"
            )
    if options["kind"] not in kinds.KINDS:
        raise FigureError(f"{NAME}: {no_kind(str(options['kind']))}")

    values = {
        key: tuple(value) if isinstance(value, list) else value
        for key, value in options.items()
    }
    try:
        return FigureSpec.model_validate(values)
    except ValidationError as error:
        key = str(error.errors()[0]["loc"][0])
        meaning = FigureSpec.texts()[key]["description"]
        raise FigureError(
            f"{NAME}: {key} = {options[key]!r}: wanted: {meaning}"
        ) from None


def grid_of(of: Any) -> xr.Dataset:
    """Return a grid; of one run, a grid of one point.

    Parameters
    ----------
    of : a grid, a run, or a report of runs

    Raises
    ------
    FigureError : it is none of them
    """
    grid = of
    if hasattr(of, "to_xarray") and not isinstance(of, xr.Dataset):
        grid = of.to_xarray()
    if not isinstance(grid, xr.Dataset):
        raise FigureError(
            f"{NAME}: {type(of).__name__} is no dataset: give a grid, a run, or a "
            "report"
        )
    if "run_id" in grid:
        return grid
    if "id" not in grid.attrs:
        raise FigureError(f"{NAME}: this dataset is neither a run nor a grid of runs")

    return grid.assign(
        run_id=str(grid.attrs["id"]),
        status="done",
        n_updates=grid.sizes.get("update", 1),
    )


def update_plot(subject: str, store: "Store", kind: str) -> Plot:
    """Return a figure of a kept update as data.

    Parameters
    ----------
    subject : identity of what the update is of
    store : where it is kept
    kind : of the figure

    Raises
    ------
    FigureError : no such kind, or no update that shows it
    """
    request = read(specified({"kind": kind}), 1, None)
    return of_update(subject, store, request)
