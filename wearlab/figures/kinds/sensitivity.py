"""How far a result moves with each thing it depends on, the strongest influence first.

Cases named ``what: value`` differ in this ``what`` alone from the case without a colon in its name; other
cases stand each for themselves. A sweep is an influence: the mean result at each of its places over all
others. So is a sampled input: the mean result in bins of equally many runs.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from wearlab.arrays import Array
from wearlab.figures.errors import FigureError
from wearlab.figures.kind import Ask, Kind
from wearlab.figures.plot import Scale, Series
from wearlab.figures.runs import BASE, Run
from wearlab.figures.slices import lone, shown
from wearlab.figures.wording import Label

BETWEEN = ": "
RANK = Scale("order of influence", "1")
MOST_BINS = 8
LEAST_IN_BIN = 4
MOST_PLACES = 20
"""Places of a sweep shown one by one; of more, bins."""


@dataclass(frozen=True)
class Dependence(Series):
    """The result of one run, and where it stands along everything that varies."""

    places: Mapping[str, float | str] = None  # type: ignore[assignment]


def _case(run: Run, ask: Ask) -> Iterator[Series]:
    """Yield a run's value as one point; `ranked` puts the points of one influence on one line."""
    name = ask.y[0]
    values, scale = lone(*shown(run.data[name], name, ask), name, ask)
    if not np.isfinite(values).all():
        return
    case = run.place.get("case")
    label = BASE if case is None else str(case.value)
    what, between, _ = label.partition(BETWEEN)
    what = what if between else "" if label == BASE else label
    # a case that is broadcast stands nowhere along the axes; keys that advance with an axis stand for it
    everything = {**run.place, **run.beside}
    axes = {} if what else {run.words.get(n, n): x.value for n, x in everything.items() if n != "case"}
    key = {"influence": Label(what, what)}
    yield Dependence(key, values.reshape(1), np.zeros(1), scale, RANK, "line-points", places=axes)


def ranked(series: list[Series]) -> list[Series]:
    """Join the points of every influence, the one with the widest range first; the base becomes a line.

    Raises
    ------
    FigureError : nothing varies
    """
    cases: dict[str, list[float]] = defaultdict(list)
    for curve in series:
        cases[curve.key["influence"].text].append(float(curve.x[0]))
    base = cases.pop("", [])
    if len(base) == 0 and len(cases) > 1 and any(len(v) > 1 for v in cases.values()):
        # one case without a colon in its name is the base of the others
        alone = [name for name, values in cases.items() if len(values) == 1]
        base = cases.pop(alone[0]) if alone else []
    level = [float(np.mean(base))] if base else []
    groups = {what: np.sort(values + level) for what, values in cases.items()}
    groups |= _of_axes([curve for curve in series if not curve.key["influence"].text])
    groups = {what: values for what, values in groups.items() if len(values) > 1}
    if not groups:
        raise FigureError(
            "nothing varies in this result: sweeps, samples or cases are needed, such as [[case]] with "
            'label = "torque: 300 N·m"; or none of the runs has a finite result'
        )
    order = sorted(groups, key=lambda what: np.ptp(groups[what]), reverse=True)
    first = series[0]
    ranks = [
        Series(
            {}, groups[what], np.full(len(groups[what]), float(rank)), first.across, RANK, "line-points",
            names=tuple(what.replace("_", " ") for what in order),
        )
        for rank, what in enumerate(order, 1)
    ]  # fmt: skip
    if level:
        ends = np.array([0.5, len(order) + 0.5])
        words = "base" if len(base) == 1 else "mean of the base runs"
        ranks.append(Series({}, np.full(2, level[0]), ends, first.across, RANK, "reference", words))
    return ranks


def _of_axes(outcomes: Sequence[Series]) -> dict[str, Array]:
    """Return the mean results along every axis and every key that advances with one."""
    values = np.array([float(outcome.x[0]) for outcome in outcomes])
    places = [outcome.places for outcome in outcomes if isinstance(outcome, Dependence)]
    if len(places) < len(outcomes) or not places:
        return {}
    spread = {}
    for name in dict.fromkeys(name for place in places for name in place):
        at = [place.get(name) for place in places]
        distinct = list(dict.fromkeys(at))
        if len(distinct) < 2 or (len(distinct) == len(at) and name in ("seed", "sample", "run")):
            continue
        if len(distinct) <= MOST_PLACES or any(isinstance(x, str) for x in distinct):
            means = [values[[x == place for x in at]].mean() for place in distinct]
        else:
            bins = min(MOST_BINS, len(values) // LEAST_IN_BIN)
            means = [values[some].mean() for some in np.array_split(np.argsort(np.array(at, float)), bins)]
        spread[name] = np.sort(np.array(means, float))
    return spread


SENSITIVITY = Kind(
    name="sensitivity",
    title="Order of influence",
    shows="the range of one result over cases named 'what: value', over sweeps and over sampled inputs "
    "(means over all else), one line for each, widest first",
    needs=("life",),
    dims=(),
    series=_case,
    roles=(),
    all_cases=True,
    ranks=True,
    joined=ranked,
    y="life",
    titled="What moves the {}",
    along_x=True,
)
