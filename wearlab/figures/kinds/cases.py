"""One number of every run beside its name: what each of many choices comes to."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from wearlab.figures.errors import FigureError
from wearlab.figures.kind import Ask, Kind
from wearlab.figures.plot import Scale, Series, merged
from wearlab.figures.runs import Run
from wearlab.figures.slices import slices
from wearlab.figures.wording import Label

MOST = 80
"""Names that can be read one below the other."""
DEPTH = "max_wear_depth"
PLACE = Scale("run", "1")


def _numbers(run: Run, ask: Ask) -> Iterator[Series]:
    """Yield a run's number, at its last wear state where none is selected, named by its place in the grid."""
    name = ask.y[0]
    if "update" in run.data[name].dims:
        run = replace(run, data=run.data.isel(update=[-1]), states=run.states[-1:])
    called = ", ".join(dict.fromkeys(label.text for label in run.place.values())) or "run"
    for piece in slices(run, name, ask):
        key = {dim: label for dim, label in piece.key.items() if dim not in (*run.place, "update")}
        values = np.atleast_1d(piece.values)
        named = {**key, "run": Label(called, called)}
        yield Series(named, values, np.zeros(1), piece.scale, PLACE, "points", x_error=piece.error)


def listed(series: list[Series]) -> list[Series]:
    """Join the numbers of what is not the run, one below the other in the order of the file.

    Raises
    ------
    FigureError : more names than can be read
    """
    names = tuple(dict.fromkeys(curve.key["run"].text for curve in series))
    if len(names) > MOST:
        raise FigureError(
            f"cases: {len(names)} runs cannot be told by name (at most {MOST}): narrow them with select, or "
            "take histogram or scatter"
        )
    groups: dict[tuple[tuple[str, Label], ...], list[Series]] = {}
    for curve in series:
        key = tuple((dim, label) for dim, label in curve.key.items() if dim != "run")
        groups.setdefault(key, []).append(curve)
    rows = []
    for key, group in groups.items():
        places = np.array([1.0 + names.index(curve.key["run"].text) for curve in group])
        rows.append(replace(merged(group), key=dict(key), y=places, names=names))
    if len(groups) == 1 and len(names) > 1:
        ends = np.array([0.5, len(names) + 0.5])
        first = rows[0]
        level = np.full(2, first.x[0])
        rows.append(Series({}, level, ends, first.across, first.up, "reference", names[0], names=names))
    return rows


CASES = Kind(
    name="cases",
    title="",
    shows="one number of every run, at its last wear state, beside the run's name",
    needs=(DEPTH,),
    dims=(),
    series=_numbers,
    roles=(("hue", "*"),),
    all_cases=True,
    ranks=True,
    y=DEPTH,
    titled="{}",
    joined=listed,
    along_x=True,
)
