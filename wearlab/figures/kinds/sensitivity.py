"""How far a result moves with each thing it depends on, the strongest influence first.

Cases are named ``what: value``; those of one ``what`` differ in it alone from the one
case without a colon in its name.
"""

from collections.abc import Iterator

import numpy as np

from wearlab.figures.ask import Ask
from wearlab.figures.errors import FigureError
from wearlab.figures.kind import Kind
from wearlab.figures.plot import Scale, Series
from wearlab.figures.runs import Run
from wearlab.figures.slices import shown
from wearlab.figures.wording import Label

BETWEEN = ": "
RANK = Scale("order of influence", "1")


def _case(run: Run, ask: Ask) -> Iterator[Series]:
    """Yield a run's value as one point; `ranked` puts the points of one influence on one line."""
    name = (ask.y or ("life",))[0]
    values, scale = shown(run.data[name], name, ask)
    if values.ndim:
        raise FigureError(f"{ask.name}: {name} is not one number per run")
    case = run.place.get("case")
    what, between, _ = ("", "", "") if case is None else case.text.partition(BETWEEN)
    what = what if between else ""
    yield Series({"influence": Label(what, what)}, values[None], np.zeros(1), scale, RANK, "line-points")


def ranked(series: list[Series]) -> list[Series]:
    """Join the points of every influence, the one with the widest range first; the base becomes a line."""
    groups: dict[str, list[float]] = {}
    for one in series:
        groups.setdefault(one.key["influence"].text, []).append(float(one.x[0]))
    base = groups.pop("", [])
    order = sorted(groups, key=lambda what: np.ptp(groups[what] + base), reverse=True)
    first = series[0]
    found = [
        Series(
            {"influence": Label(float(rank), what)},
            np.sort(groups[what] + base),
            np.full(len(groups[what] + base), float(rank)),
            first.across, RANK, "line-points",
        )
        for rank, what in enumerate(order, 1)
    ]  # fmt: skip
    if base:
        ends = np.array([0.5, len(order) + 0.5])
        found.append(Series({}, np.full(2, base[0]), ends, first.across, RANK, "reference", "base"))
    return found


SENSITIVITY = Kind(
    name="sensitivity",
    title="Order of influence",
    shows="the range of one result over cases named 'what: value', one line for each what, widest first",
    needs=("life",),
    dims=(),
    series=_case,
    roles=(("hue", "influence"),),
    all_cases=True,
    ranks=True,
    joined=ranked,
)
