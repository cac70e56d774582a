"""One figure for a program or a notebook: a grid or a run, a kind, and the options of ``[[figure]]``."""

from typing import TYPE_CHECKING, Any

import xarray as xr
from pydantic import ValidationError

from wearlab.campaign.campaign import FigureSpec
from wearlab.figures.ask import read
from wearlab.figures.drawing import plotted
from wearlab.figures.errors import FigureError, choices
from wearlab.figures.kinds import KINDS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WHERE = "figure"


def figure(
    of: Any,
    kind: str,
    *,
    ax: Any = None,
    size: float | tuple[float, float] | None = None,
    **options: Any,
) -> "Figure":
    """Return a figure of stored or simulated runs.

    Parameters
    ----------
    of : a grid (`Store.open`), one run (`Store.run`, `simulate`), or what `run` returned
    kind : listed by ``wearlab schema --figures``
    ax : axes of matplotlib to draw in, one for each panel; title and legend stand in them, notes are left out
    size : width, or width and height [inches]; text and lines grow with the width [the house's]
    options : as in ``[[figure]]``: select, x, y, hue, rows, cols, units, title, note, published

    Returns
    -------
    A figure of matplotlib; notebooks show it, ``savefig`` writes it. What the reader's rcParams set (fonts,
    ``text.usetex``, ``font.size``) holds before the house style; ``title=""`` leaves the title out.

    Raises
    ------
    FigureError : no such kind or option, or nothing of it can be drawn
    """
    spec = _specified({"kind": kind, **options})
    plot, _, _ = plotted(_grid(of), read(spec, 1, None))
    from wearlab.figures.render import drawn

    return drawn(plot, size, ax)


def _specified(given: dict[str, Any]) -> FigureSpec:
    known = FigureSpec.model_fields
    for key in given:
        if key not in known:
            raise FigureError(f"{WHERE}: {key!r} is no option; {choices(key, sorted(known))}")
    if given["kind"] not in KINDS:
        raise FigureError(f"{WHERE}: no such kind; {choices(str(given['kind']), KINDS)}")
    try:
        return FigureSpec.model_validate(
            {key: tuple(value) if isinstance(value, list) else value for key, value in given.items()}
        )
    except ValidationError as error:
        key = str(error.errors()[0]["loc"][0])
        raise FigureError(f"{WHERE}: {key} = {given[key]!r}: wanted: {known[key].description}") from None


def _grid(of: Any) -> xr.Dataset:
    """Return a grid; of one run, a grid of one point."""
    grid = of.to_xarray() if hasattr(of, "to_xarray") and not isinstance(of, xr.Dataset) else of
    if not isinstance(grid, xr.Dataset):
        raise FigureError(f"{WHERE}: {type(of).__name__} is no dataset: give a grid, a run, or a report")
    if "run_id" in grid:
        return grid
    if "id" not in grid.attrs:
        raise FigureError(f"{WHERE}: this dataset is neither a run nor a grid of runs")
    states = {"run_id": str(grid.attrs["id"]), "status": "done", "n_updates": grid.sizes.get("update", 1)}
    return grid.assign(states)
