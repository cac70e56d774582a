"""One figure as asked for: the campaign's ``[[figure]]`` block, read with forgiving defaults."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, NamedTuple

from wearlab.figures.errors import FigureError


class Points(NamedTuple):
    """The CSV of points read from a paper: its name and its text."""

    name: str
    text: str


@dataclass(frozen=True)
class Ask:
    """A figure's wishes; what is None is left to its kind.

    Parameters
    ----------
    name : how errors call the figure
    kind : a key of the table of kinds
    select : dimension → label or list of labels
    x, hue, rows, cols : names of dimensions or coordinates
    y : names of variables
    units : variable → unit
    y_as : "logarithm": on such an axis; "difference": less the first curve of its panel
    title, note : texts; a title of "" is none
    published : CSV of points from a paper: where it is, or what it says
    """

    name: str
    kind: str
    select: Mapping[str, Any] = field(default_factory=dict)
    x: str | None = None
    y: tuple[str, ...] = ()
    hue: str | None = None
    rows: str | None = None
    cols: str | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    y_as: Literal["logarithm", "difference"] | None = None
    title: str | None = None
    note: str | None = None
    published: Path | Points | None = None


def read(spec: Any, number: int, folder: Path | None) -> Ask:
    """Return what a ``[[figure]]`` asks for.

    Parameters
    ----------
    spec : the campaign's figure (kind, select, x, y, hue, rows, cols, units, y_as, title, note, published)
    number : its place in the file, from 1
    folder : directory of the campaign file, where a relative ``published`` is looked up
    """
    name = f"figure {number} ({spec.kind})"
    y = getattr(spec, "y", None)
    return Ask(
        name=name,
        kind=spec.kind,
        select=dict(getattr(spec, "select", None) or {}),
        y=(y,) if isinstance(y, str) else tuple(y or ()),
        units=_units(getattr(spec, "units", None), name),
        published=_path(getattr(spec, "published", None), folder),
        **{key: getattr(spec, key, None) or None for key in ("x", "hue", "rows", "cols", "y_as", "note")},
        title=getattr(spec, "title", None),
    )


def _units(units: Any, name: str) -> dict[str, str]:
    if units is None or units == "":
        return {}
    if isinstance(units, str):
        return {"y": units}
    if isinstance(units, Mapping):
        return {str(key): str(value) for key, value in units.items()}
    raise FigureError(f"{name}: units = {units!r} is neither a unit nor a table of variable = unit")


def _path(published: Any, folder: Path | None) -> Path | None:
    if not published:
        return None
    return (folder or Path()) / Path(published)
